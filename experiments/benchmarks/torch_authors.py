"""A PyTorch training step of Audio2Gestures with the structure of the authors' public code, to compare speed.

Written from the papers and our notes on that code's structure, with the networks of :mod:`torch_twin`: the skeleton has
the 55 joints of SMPL-X, of which 33 never turn, and forward kinematics goes from joint to joint; each of three motions
(reconstruction, audio to motion, sampled) is decoded on its own; samples are to differ from the audio-to-motion one.
"""

import torch
from torch import Tensor

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from experiments.benchmarks.torch_rotations import geodesic_distance, matrix_from_6d
from experiments.benchmarks.torch_twin import Noise, Twin, distance, kl


class AuthorsTwin(Twin):
    """The networks of a body's joints, and losses on all joints of the full skeleton."""

    def __init__(self, config: Audio2GesturesConfig, body: Skeleton, full: Skeleton, bands: int) -> None:
        """
        Args:
            full: the skeleton whose first joints are the body's.
        """
        super().__init__(config, body, bands)
        self.parents = full.parents
        self.register_buffer("bones", torch.tensor(full.offsets), persistent=False)

    def positions(self, rotations: Tensor) -> Tensor:
        """Positions (B, T, 55, 3) of local rotations (B, T, 22, 3, 3), joint by joint."""
        rest = torch.eye(3).expand(*rotations.shape[:2], len(self.parents) - rotations.shape[2], 3, 3)
        every = torch.cat([rotations, rest], dim=2)
        world, places = [every[:, :, 0]], [torch.zeros_like(every[:, :, 0, 0])]
        for joint, parent in enumerate(self.parents[1:], start=1):
            places.append(places[parent] + (world[parent] @ self.bones[joint][:, None])[..., 0])
            world.append(world[parent] @ every[:, :, joint])
        return torch.stack(places, dim=2)

    def terms(self, audio: Tensor, pose: Tensor, noise: Noise) -> dict[str, Tensor]:
        """Every loss, unweighted, of normalised audio (B, T, bands) and motion (B, T, J, 6)."""
        config = self.config
        audio_shared = self.audio_encoder(audio.transpose(1, 2))
        motion_shared, motion_specific = self.motion_encoder(pose.flatten(2).transpose(1, 2))
        s_audio, s_motion = audio_shared.shift(noise.audio), motion_shared.shift(noise.motion)
        i_motion = motion_specific.shift(noise.specific)
        mean, std = i_motion.detach().mean(2, keepdim=True), i_motion.detach().std(2, keepdim=True, correction=0)
        assert self.mapping_net is not None
        mapped = self.mapping_net(mean + std * noise.first)
        i_random = mapped.shift(noise.mapped[: len(audio)])

        truth = matrix_from_6d(pose)
        target = self.positions(truth)
        made = [self.rotations(self.decoder(*codes)) for codes in ((s_motion, i_motion), (s_audio, i_motion))]
        drawn = self.rotations(self.decoder(s_audio, i_random))
        rebuilt, transferred = (self.positions(rotations) for rotations in made)
        sampled = self.positions(drawn)
        shared, recovered = self.motion_encoder(self._flat(drawn))
        excess = (sampled - target).abs().sum(-1) - config.relaxed_threshold
        both = (rebuilt, transferred)
        return {
            "alignment": (s_audio - s_motion).abs().mean(),
            "kl_shared": kl(audio_shared) + kl(motion_shared),
            "kl_specific": kl(motion_specific) + kl(mapped),
            "rotation": sum(geodesic_distance(rotations, truth).mean() for rotations in made) / 2,
            "position": sum(distance(places, target) for places in both) / 2,
            "speed": sum(distance(places.diff(dim=1), target.diff(dim=1)) for places in both) / 2,
            "relaxed": torch.clamp(excess, min=0.0).mean(),
            "sampled_rotation": geodesic_distance(drawn, truth).mean(),
            "sampled_speed": distance(sampled.diff(dim=1), target.diff(dim=1)),
            "bicycle": (i_random.detach() - recovered.mean).abs().mean(),
            "bicycle_shared": (s_audio.detach() - shared.mean).abs().mean(),
            "diversity": -distance(sampled, transferred.detach()),
        }
