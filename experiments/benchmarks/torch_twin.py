"""A PyTorch twin of our Audio2Gestures: the same networks and losses, to compare values and speed.

Written from ``a2g_jax.models.audio2gestures``; equations and weights are the same, so are parameter counts. Two things
are done the way PyTorch likes them instead of ours: activations lie as (clips, channels, frames), and rotation
matrices come from plain Gram-Schmidt, without our fallback for degenerate vectors (which costs us a little).
Submodules carry the names that Flax gives ours, so that parameters are copied and compared by name.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import conv1d

from a2g_jax.geometry.skeleton import Skeleton
from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.networks import LOG_VARIANCE_BOUND


class Conv(nn.Module):
    """Convolution over time with "same" zero padding; one tap makes it a linear layer for each frame."""

    def __init__(self, inputs: int, outputs: int, taps: int = 1, dilation: int = 1) -> None:
        super().__init__()
        self.kernel = nn.Parameter(nn.init.xavier_uniform_(torch.empty(outputs, inputs, taps)))
        self.bias = nn.Parameter(torch.zeros(outputs))
        self.dilation = dilation
        self.padding = dilation * (taps // 2)

    def forward(self, x: Tensor) -> Tensor:
        return conv1d(x, self.kernel, self.bias, padding=self.padding, dilation=self.dilation)


class ResidualBlock(nn.Module):
    """Two dilated convolutions added to the input."""

    def __init__(self, inputs: int, outputs: int, taps: int, dilation: int) -> None:
        super().__init__()
        self.Conv1D_0 = Conv(inputs, outputs, taps, dilation)
        self.Conv1D_1 = Conv(outputs, outputs, taps, dilation)
        self.Dense_0 = Conv(inputs, outputs) if inputs != outputs else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        y = torch.relu(self.Conv1D_1(torch.relu(self.Conv1D_0(x))))
        return torch.relu(self.Dense_0(x) + y)


class TCN(nn.Module):
    """Residual blocks, block i with dilation ``2 ** i``."""

    def __init__(self, inputs: int, channels: tuple[int, ...], taps: int) -> None:
        super().__init__()
        widths = (inputs, *channels)
        for block, (before, after) in enumerate(zip(widths, channels, strict=False)):
            self.add_module(f"ResidualBlock_{block}", ResidualBlock(before, after, taps, 2**block))

    def forward(self, x: Tensor) -> Tensor:
        for block in self.children():
            x = block(x)
        return x


class Gaussian(NamedTuple):
    """Means and log-variances (clips, channels, frames)."""

    mean: Tensor
    log_variance: Tensor

    def shift(self, noise: Tensor) -> Tensor:
        """The draw that standard normal noise stands for."""
        return self.mean + torch.exp(0.5 * self.log_variance) * noise


class GaussianHead(nn.Module):
    """Mean and bounded log-variance. Flax numbers the outer layer of each pair first."""

    def __init__(self, inputs: int, hidden: int, outputs: int) -> None:
        super().__init__()
        self.Dense_0, self.Dense_1 = Conv(hidden, outputs), Conv(inputs, hidden)
        self.Dense_2, self.Dense_3 = Conv(hidden, outputs), Conv(inputs, hidden)

    def forward(self, x: Tensor) -> Gaussian:
        mean = self.Dense_0(torch.relu(self.Dense_1(x)))
        log_variance = self.Dense_2(torch.relu(self.Dense_3(x)))
        return Gaussian(mean, LOG_VARIANCE_BOUND * torch.tanh(log_variance / LOG_VARIANCE_BOUND))


class AudioEncoder(nn.Module):
    """Audio features to the shared code."""

    def __init__(self, config: Audio2GesturesConfig, bands: int) -> None:
        super().__init__()
        self.TCN_0 = TCN(bands, config.audio_channels, config.kernel_size)
        self.GaussianHead_0 = GaussianHead(config.audio_channels[-1], config.head_channels, config.code_channels)

    def forward(self, audio: Tensor) -> Gaussian:
        return self.GaussianHead_0(self.TCN_0(audio))


class MotionEncoder(nn.Module):
    """Motion to the shared and the specific code."""

    def __init__(self, config: Audio2GesturesConfig, pose: int) -> None:
        super().__init__()
        head, code = config.head_channels, config.code_channels
        self.TCN_0 = TCN(pose, config.motion_channels, config.kernel_size)
        self.Dense_0, self.Dense_1 = Conv(config.motion_channels[-1], head), Conv(config.motion_channels[-1], head)
        self.GaussianHead_0, self.GaussianHead_1 = GaussianHead(head, head, code), GaussianHead(head, head, code)

    def forward(self, motion: Tensor) -> tuple[Gaussian, Gaussian]:
        x = self.TCN_0(motion)
        return self.GaussianHead_0(self.Dense_0(x)), self.GaussianHead_1(self.Dense_1(x))


class Decoder(nn.Module):
    """Both codes to motion. Flax numbers the last layer first."""

    def __init__(self, config: Audio2GesturesConfig, pose: int) -> None:
        super().__init__()
        width = config.decoder_channels[-1]
        self.TCN_0 = TCN(2 * config.code_channels, config.decoder_channels, config.kernel_size)
        self.Dense_0, self.Dense_1 = Conv(width, pose), Conv(width, width)

    def forward(self, shared: Tensor, specific: Tensor) -> Tensor:
        return self.Dense_0(torch.relu(self.Dense_1(self.TCN_0(torch.cat([shared, specific], dim=1)))))


class MappingNet(nn.Module):
    """Noise to a specific code."""

    def __init__(self, config: Audio2GesturesConfig) -> None:
        super().__init__()
        code, taps = config.code_channels, config.kernel_size
        self.Conv1D_0, self.Conv1D_1, self.Conv1D_2 = (Conv(code, code, taps) for _ in range(3))
        self.GaussianHead_0 = GaussianHead(code, code, code)

    def forward(self, noise: Tensor) -> Gaussian:
        x = self.Conv1D_0(noise)
        x = self.Conv1D_1(torch.relu(x))
        x = self.Conv1D_2(torch.relu(x))
        return self.GaussianHead_0(x)


def matrix_from_6d(six: Tensor) -> Tensor:
    """Gram-Schmidt of (..., 6) to (..., 3, 3)."""
    first, second = six[..., :3], six[..., 3:]
    first = first / first.norm(dim=-1, keepdim=True)
    second = second - (first * second).sum(-1, keepdim=True) * first
    second = second / second.norm(dim=-1, keepdim=True)
    return torch.stack([first, second, torch.linalg.cross(first, second)], dim=-1)


def geodesic_distance(first: Tensor, second: Tensor) -> Tensor:
    """Angle between rotations (..., 3, 3), radians, with zero gradient where they are equal.

    Sine and cosine of the angle from the rows, without forming the product of the matrices: the same numbers.
    """
    skew = torch.linalg.cross(first, second, dim=-1).sum(-2)
    square = (skew * skew).sum(-1)
    positive = square > torch.finfo(square.dtype).tiny
    norm = torch.where(positive, torch.sqrt(torch.where(positive, square, 1.0)), 0.0)
    return torch.atan2(norm / 2, ((first * second).sum((-1, -2)) - 1) / 2)


class Noise(NamedTuple):
    """All that a training step draws: standard normal, each (clips, channels, frames)."""

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
    """For the draws from what both are mapped to; twice as many clips."""

    @classmethod
    def draw(cls, clips: int, channels: int, frames: int) -> "Noise":
        """From PyTorch's global generator."""
        return cls(*(torch.randn(clips, channels, frames) for _ in range(5)), torch.randn(2 * clips, channels, frames))


class Twin(nn.Module):
    """The four networks, forward kinematics and losses."""

    def __init__(self, config: Audio2GesturesConfig, skeleton: Skeleton, bands: int) -> None:
        super().__init__()
        if config.normalise_pose or config.dropout > 0:
            raise ValueError("Expected a configuration without pose normalisation and dropout, as in the papers.")
        self.config = config
        self.audio_encoder = AudioEncoder(config, bands)
        self.motion_encoder = MotionEncoder(config, 6 * skeleton.joints)
        self.decoder = Decoder(config, 6 * skeleton.joints)
        self.mapping_net = MappingNet(config)
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
        audio_shared = self.audio_encoder(audio.transpose(1, 2))
        motion_shared, motion_specific = self.motion_encoder(pose.flatten(2).transpose(1, 2))
        s_audio = audio_shared.shift(noise.audio)
        s_motion = motion_shared.shift(noise.motion)
        i_motion = motion_specific.shift(noise.specific)

        mean = i_motion.detach().mean(2, keepdim=True)
        std = i_motion.detach().std(2, keepdim=True, correction=0)
        mapped = self.mapping_net(torch.cat([mean + std * noise.first, mean + std * noise.second]))
        i_random = mapped.shift(noise.mapped)

        shared = torch.cat([s_motion, s_audio, s_audio, s_audio])
        specific = torch.cat([i_motion, i_motion, i_random])
        rotations = self.rotations(self.decoder(shared, specific))
        true_rotations = matrix_from_6d(pose)
        positions = self.positions(torch.cat([true_rotations, rotations]))
        target, rebuilt, transferred, sampled, other = positions.chunk(5)
        drawn = rotations[2 * clips : 3 * clips]
        again = drawn[..., :2].transpose(-1, -2).flatten(2)
        recovered = self.motion_encoder(again.transpose(1, 2))[1]

        both, twice = torch.cat([rebuilt, transferred]), torch.cat([target, target])
        rotation_twice = torch.cat([true_rotations, true_rotations])
        excess = (sampled - target).abs().sum(-1) - self.config.relaxed_threshold
        return {
            "rotation": geodesic_distance(rotations[: 2 * clips], rotation_twice).mean(),
            "position": _distance(both, twice),
            "speed": _distance(both.diff(dim=1), twice.diff(dim=1)),
            "alignment": (s_audio - s_motion).abs().mean(),
            "kl_shared": _kl(audio_shared) + _kl(motion_shared),
            "kl_specific": _kl(motion_specific) + _kl(mapped),
            "relaxed": torch.clamp(excess, min=0.0).mean(),
            "sampled_rotation": geodesic_distance(drawn, true_rotations).mean(),
            "sampled_speed": _distance(sampled.diff(dim=1), target.diff(dim=1)),
            "bicycle": (i_random[:clips].detach() - recovered.mean).abs().mean(),
            "diversity": -_distance(sampled, other),
        }

    def weights(self, step: int) -> dict[str, float]:
        """Weight of each loss at a step."""
        c = self.config
        ramp = min(step / c.kl_ramp_steps, 1.0) if c.kl_ramp_steps else 1.0
        decay = max(1.0 - step / c.diversity_decay_steps, 0.0) if c.diversity_decay_steps else 1.0
        return {
            "rotation": c.rotation_weight,
            "position": c.position_weight,
            "speed": c.speed_weight,
            "alignment": c.alignment_weight,
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
        code = self.mapping_net(mean + std * noise[0])
        return self.rotations(self.decoder(shared.shift(noise[1]), code.shift(noise[2])))


def _distance(first: Tensor, second: Tensor) -> Tensor:
    return (first - second).abs().sum(-1).mean()


def _kl(code: Gaussian) -> Tensor:
    return 0.5 * (code.log_variance.exp() + code.mean**2 - 1.0 - code.log_variance).sum(1).mean()


def _as_ours(value: Tensor) -> np.ndarray:
    array = value.detach().cpu().numpy()
    if array.ndim == 1:
        return array
    return array[:, :, 0].T if array.shape[2] == 1 else array.transpose(2, 1, 0)


def load_params(module: nn.Module, params: Mapping[str, Any]) -> None:
    """Copy a tree of our Flax parameters into a module whose parts have the same names.

    Raises:
        ValueError: a parameter is missing on either side, or has another shape.
    """
    own = dict(module.named_parameters(recurse=False))
    parts = {name: part for name, part in module.named_children() if any(True for _ in part.parameters())}
    if {*own, *parts} != set(params):
        raise ValueError(f"Expected the parameters {sorted({*own, *parts})}; got {sorted(params)}.")
    for name, value in own.items():
        array = np.array(params[name])
        if array.ndim == 2:
            array = array[None]
        if array.ndim == 3:
            array = array.transpose(2, 1, 0)
        if array.shape != tuple(value.shape):
            raise ValueError(f"Expected {name} of shape {tuple(value.shape)}; got {array.shape}.")
        with torch.no_grad():
            value.copy_(torch.from_numpy(np.ascontiguousarray(array)))
    for name, part in parts.items():
        load_params(part, params[name])


def gradients(module: nn.Module) -> dict[str, Any]:
    """Gradients of all parameters as a tree shaped like our Flax parameters; zeros where none arrived."""
    tree: dict[str, Any] = {}
    for path, value in module.named_parameters():
        *folders, name = path.split(".")
        place = tree
        for folder in folders:
            place = place.setdefault(folder, {})
        place[name] = _as_ours(value.grad if value.grad is not None else torch.zeros_like(value))
    return tree
