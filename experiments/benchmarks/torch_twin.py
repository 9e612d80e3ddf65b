"""A PyTorch twin of our Audio2Gestures: the same networks and losses, to compare values and speed.

Written from ``a2g_jax.models.audio2gestures``; equations, weights and parameter counts are the same. Two things follow
PyTorch's conventions: activations have the layout (clips, channels, frames), and rotation matrices come from plain
Gram-Schmidt, without our fallback for degenerate vectors (which costs us a little). Submodules have the names of Flax,
so that parameters are copied and compared by name.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from experiments.benchmarks.torch_layers import (
    TCN,
    Conv,
    Gaussian,
    add_backbone,
    add_head,
    block_dct,
    run_backbone,
    run_head,
)
from experiments.benchmarks.torch_rotations import geodesic_distance, matrix_from_6d
from experiments.benchmarks.torch_similarity import lpips, ssim, stft_distance


class AudioEncoder(nn.Module):
    """Audio features to the shared code."""

    def __init__(self, config: Audio2GesturesConfig, bands: int) -> None:
        super().__init__()
        width = add_backbone(self, config, bands, config.audio_channels)
        add_head(self, config, width, config.head_channels, 0, shared=True)

    def forward(self, audio: Tensor) -> Gaussian:
        return run_head(self, 0, run_backbone(self, audio))


class MotionEncoder(nn.Module):
    """Motion to the shared and the specific code; None for the latter where the code is not split."""

    def __init__(self, config: Audio2GesturesConfig, pose: int) -> None:
        super().__init__()
        head = config.head_channels
        width = add_backbone(self, config, pose, config.motion_channels)
        self.Dense_0 = Conv(width, head)
        self.Dense_1 = Conv(width, head) if config.split else None
        for number in range(1 + config.split):
            add_head(self, config, head, head, number, shared=number == 0)

    def forward(self, motion: Tensor) -> tuple[Gaussian, Gaussian | None]:
        x = run_backbone(self, motion)
        shared = run_head(self, 0, self.Dense_0(x))
        return shared, None if self.Dense_1 is None else run_head(self, 1, self.Dense_1(x))


class Decoder(nn.Module):
    """Both codes to motion. Flax numbers the last layer first."""

    def __init__(self, config: Audio2GesturesConfig, pose: int) -> None:
        super().__init__()
        width = config.decoder_channels[-1]
        codes = (1 + config.split) * config.code_channels
        self.TCN_0 = TCN(codes, config.decoder_channels, config.kernel_size)
        self.Dense_0, self.Dense_1 = Conv(width, pose), Conv(width, width)

    def forward(self, shared: Tensor, specific: Tensor | None = None) -> Tensor:
        x = shared if specific is None else torch.cat([shared, specific], dim=1)
        return self.Dense_0(torch.relu(self.Dense_1(self.TCN_0(x))))


class MappingNet(nn.Module):
    """Noise to a specific code."""

    def __init__(self, config: Audio2GesturesConfig) -> None:
        super().__init__()
        code, taps = config.code_channels, config.kernel_size
        self.Conv1D_0, self.Conv1D_1, self.Conv1D_2 = (Conv(code, code, taps) for _ in range(3))
        add_head(self, config, code, code, 0, shared=False)

    def forward(self, noise: Tensor) -> Gaussian:
        x = self.Conv1D_0(noise)
        x = self.Conv1D_1(torch.relu(x))
        x = self.Conv1D_2(torch.relu(x))
        return run_head(self, 0, x)


class Noise(NamedTuple):
    """All draws of a training step: standard normal, each (clips, channels, frames)."""

    audio: Tensor
    """For the shared code of audio."""
    motion: Tensor
    """For the shared code of motion."""
    specific: Tensor
    """For the specific code of motion."""
    first: Tensor
    """For the first random specific code."""
    second: Tensor
    """For the second."""
    mapped: Tensor
    """For the draws from both mapped distributions; twice as many clips."""

    @classmethod
    def draw(cls, clips: int, channels: int, frames: int) -> "Noise":
        """Draw from PyTorch's global generator."""
        return cls(*(torch.randn(clips, channels, frames) for _ in range(5)), torch.randn(2 * clips, channels, frames))


class Twin(nn.Module):
    """The four networks, forward kinematics and losses."""

    def __init__(
        self,
        config: Audio2GesturesConfig,
        skeleton: Skeleton,
        bands: int,
        features: Callable[[Tensor], list[Tensor]] | None = None,
    ) -> None:
        """
        Args:
            features: of motion (B, 6 J, T), blocks (B, C, T), for LPIPS.
        """
        super().__init__()
        self.features = features
        if config.normalise_pose or config.dropout > 0:
            raise ValueError("Expected a configuration without pose normalisation and dropout, as in the papers.")
        self.config = config
        self.audio_encoder = AudioEncoder(config, bands)
        self.motion_encoder = MotionEncoder(config, 6 * skeleton.joints)
        self.decoder = Decoder(config, 6 * skeleton.joints)
        self.mapping_net = MappingNet(config) if config.split and config.mapping else None
        self.levels = [(np.array(level), [skeleton.parents[joint] for joint in level]) for level in skeleton.levels]
        self.register_buffer("offsets", torch.tensor(np.asarray(skeleton.offsets)), persistent=False)
        for number, (level, parents) in enumerate(self.levels):
            above = self.levels[number - 1][0].tolist() if number else []
            rows = [above.index(parent) for parent in parents] if number else []
            self.register_buffer(f"joints_{number}", torch.tensor(level), persistent=False)
            self.register_buffer(f"rows_{number}", torch.tensor(rows, dtype=torch.long), persistent=False)
        order = np.argsort(np.concatenate([level for level, _ in self.levels]))
        self.register_buffer("order", torch.tensor(order), persistent=False)

    def positions(self, rotations: Tensor) -> Tensor:
        """Joint positions (..., J, 3) in metres of local rotations (..., J, 3, 3), level by level."""
        world = rotations.index_select(-3, self.joints_0)
        place = torch.zeros_like(world[..., 0])
        places = [place]
        for number in range(1, len(self.levels)):
            joints, rows = getattr(self, f"joints_{number}"), getattr(self, f"rows_{number}")
            parent = world.index_select(-3, rows)
            place = place.index_select(-2, rows) + (parent @ self.offsets[joints][..., None])[..., 0]
            world = parent @ rotations.index_select(-3, joints)
            places.append(place)
        return torch.cat(places, dim=-2).index_select(-2, self.order)

    def rotations(self, flat: Tensor) -> Tensor:
        """Rotation matrices (B, T, J, 3, 3) of decoded motion (B, 6 J, T)."""
        return matrix_from_6d(flat.transpose(1, 2).unflatten(-1, (-1, 6)))

    def terms(self, audio: Tensor, pose: Tensor, noise: Noise) -> dict[str, Tensor]:
        """Every loss, unweighted, of normalised audio (B, T, bands) and motion (B, T, J, 6)."""
        clips = len(audio)
        audio_shared = self._encode(self.audio_encoder, audio.transpose(1, 2))
        motion_shared, motion_specific = self._encode(self.motion_encoder, pose.flatten(2).transpose(1, 2))
        s_audio = self._in_time(audio_shared.shift(noise.audio))
        s_motion = self._in_time(motion_shared.shift(noise.motion))
        common = {"alignment": (s_audio - s_motion).abs().mean()}
        if self.config.latent != "dct":
            common["kl_shared"] = kl(audio_shared) + kl(motion_shared)
        if motion_specific is None:
            made = self.rotations(self.decoder(torch.cat([s_motion, s_audio])))
            return common | self._motion_terms(pose, made)
        i_motion = self._in_time(motion_specific.shift(noise.specific))

        i_random, kl_specific = noise.mapped, kl(motion_specific)
        if self.mapping_net is not None:
            mean = i_motion.detach().mean(2, keepdim=True)
            std = i_motion.detach().std(2, keepdim=True, correction=0)
            mapped = self.mapping_net(torch.cat([mean + std * noise.first, mean + std * noise.second]))
            i_random, kl_specific = self._in_time(mapped.shift(noise.mapped)), kl_specific + kl(mapped)

        shared = torch.cat([s_motion, s_audio, s_audio, s_audio])
        specific = torch.cat([i_motion, i_motion, i_random])
        rotations = self.rotations(self.decoder(shared, specific))
        true_rotations = matrix_from_6d(pose)
        drawn = rotations[2 * clips : 3 * clips]
        target, sampled, other = self.positions(torch.cat([true_rotations, rotations[2 * clips :]])).chunk(3)
        recovered = self._encode(self.motion_encoder, self._flat(drawn))[1]
        assert recovered is not None
        excess = (sampled - target).abs().sum(-1) - self.config.relaxed_threshold
        return {
            **common,
            **self._motion_terms(pose, rotations[: 2 * clips]),
            "kl_specific": kl_specific,
            "relaxed": torch.clamp(excess, min=0.0).mean(),
            "sampled_rotation": geodesic_distance(drawn, true_rotations).mean(),
            "sampled_speed": distance(sampled.diff(dim=1), target.diff(dim=1)),
            "bicycle": (i_random[:clips].detach() - self._in_time(recovered.mean)).abs().mean(),
            "diversity": -distance(sampled, other),
        }

    def _motion_terms(self, pose: Tensor, rotations: Tensor) -> dict[str, Tensor]:
        """Losses of the reconstruction and then the translation against the truth."""
        true_rotations = matrix_from_6d(pose)
        target, both = self.positions(true_rotations), self.positions(rotations)
        twice = torch.cat([target, target])
        terms = {
            "rotation": geodesic_distance(rotations, torch.cat([true_rotations, true_rotations])).mean(),
            "position": distance(both, twice),
            "speed": distance(both.diff(dim=1), twice.diff(dim=1)),
        }
        if self.config.stft_weight > 0:
            terms["stft"] = stft_distance(both.flatten(2), twice.flatten(2))
        if self.config.ssim_weight > 0:
            terms["ssim"] = 1.0 - ssim(both.flatten(2), twice.flatten(2))
        if self.config.lpips_weight > 0:
            assert self.features is not None
            truth = pose.flatten(2).transpose(1, 2)
            terms["lpips"] = lpips(self.features(self._flat(rotations)), self.features(torch.cat([truth, truth])))
        return terms

    def _flat(self, rotations: Tensor) -> Tensor:
        """Rotations (B, T, J, 3, 3) as motion (B, 6 J, T)."""
        return rotations[..., :2].transpose(-1, -2).flatten(2).transpose(1, 2)

    def _encode(self, encoder: nn.Module, x: Tensor) -> Any:
        """Codes; with the DCT, each block on its own."""
        points = self.config.dct_points
        if self.config.latent != "dct":
            return encoder(x)
        blocks = x.unflatten(2, (-1, points)).transpose(1, 2)
        codes = encoder(blocks.flatten(0, 1))

        def join(code: Gaussian) -> Gaussian:
            return Gaussian(*(part.unflatten(0, blocks.shape[:2]).transpose(1, 2).flatten(2) for part in code))

        return join(codes) if isinstance(codes, Gaussian) else tuple(join(code) for code in codes)

    def _in_time(self, code: Tensor) -> Tensor:
        """A code in time, the decoder's input."""
        return block_dct(code, self.config.dct_points, inverse=True) if self.config.latent == "dct" else code

    def weights(self, step: int) -> dict[str, float]:
        """Weight of each loss at a step."""
        c = self.config
        together = min(step / c.alignment_ramp_steps, 1.0) if c.alignment_ramp_steps else 1.0
        ramp = min(step / c.kl_ramp_steps, 1.0) if c.kl_ramp_steps else 1.0
        decay = max(1.0 - step / c.diversity_decay_steps, 0.0) if c.diversity_decay_steps else 1.0
        return {
            "rotation": c.rotation_weight,
            "position": c.position_weight,
            "speed": c.speed_weight,
            "stft": c.stft_weight,
            "ssim": c.ssim_weight,
            "lpips": c.lpips_weight,
            "alignment": c.alignment_weight * together,
            "kl_shared": c.kl_shared_weight * ramp,
            "kl_specific": c.kl_specific_weight * ramp,
            "relaxed": c.relaxed_weight,
            "sampled_rotation": c.sampled_rotation_weight,
            "sampled_speed": c.sampled_speed_weight,
            "bicycle": c.bicycle_weight,
            "diversity": c.diversity_weight * decay,
        }

    def generate(self, shared: Gaussian, mean: Tensor, std: Tensor, noise: tuple[Tensor, Tensor, Tensor]) -> Tensor:
        """Rotations (B, T, J, 3, 3) for encoded audio and B specific codes drawn around (B, channels, 1) statistics.

        Args:
            noise: for the mapping net's input, the shared code and the specific code, each (B, channels, frames).
        """
        if self.mapping_net is None:
            raise ValueError("Expected a configuration with a mapping net.")
        code = self.mapping_net(mean + std * noise[0])
        return self.rotations(self.decoder(shared.shift(noise[1]), code.shift(noise[2])))


def distance(first: Tensor, second: Tensor) -> Tensor:
    """Mean L1 distance of points (..., 3)."""
    return (first - second).abs().sum(-1).mean()


def kl(code: Gaussian) -> Tensor:
    """KL divergence from the standard normal, summed over channels, a frame's average."""
    return 0.5 * (code.log_variance.exp() + code.mean**2 - 1.0 - code.log_variance).sum(1).mean()
