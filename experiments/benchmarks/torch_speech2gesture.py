"""A PyTorch twin of our Speech2Gesture: the same networks and losses, to compare values.

Written from ``a2g_jax.models.speech2gesture``, with PyTorch's own convolutions. Activations have the layout (clips,
channels, frames) or (clips, channels, frames, bands). Submodules have the names of Flax, so that parameters are copied
and compared by name.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from flax.traverse_util import flatten_dict
from torch import Tensor, nn
from torch.nn import functional

from a2g_jax.models.speech2gesture.config import Speech2GestureConfig
from a2g_jax.models.speech2gesture.networks import EPSILON, SLOPE


class Conv(nn.Module):
    """Convolution over time (and frequency) after zero padding on either side."""

    def __init__(
        self,
        inputs: int,
        outputs: int,
        taps: tuple[int, ...],
        stride: tuple[int, ...],
        padding: tuple[tuple[int, int], ...],
    ) -> None:
        super().__init__()
        self.kernel = nn.Parameter(torch.empty(outputs, inputs, *taps))
        self.bias = nn.Parameter(torch.empty(outputs))
        self.stride = stride
        self.padding = [side for axis in reversed(padding) for side in axis]

    def forward(self, x: Tensor) -> Tensor:
        convolve = functional.conv1d if x.ndim == 3 else functional.conv2d
        return convolve(functional.pad(x, self.padding), self.kernel, self.bias, self.stride)


def _same(inputs: int, outputs: int) -> Conv:
    return Conv(inputs, outputs, (3,), (1,), ((1, 1),))


def _strided(inputs: int, outputs: int, stride: int) -> Conv:
    """Four taps. An odd number of frames is padded for the last step of two."""
    return Conv(inputs, outputs, (4,), (stride,), ((1, 2),))


class LayerNorm(nn.Module):
    """Layer normalisation of each frame over all its values, with a scale and an offset for each channel."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.scale = nn.Parameter(torch.empty(channels))
        self.bias = nn.Parameter(torch.empty(channels))

    def forward(self, x: Tensor) -> Tensor:
        axes = [axis for axis in range(x.ndim) if axis not in (0, 2)]
        variance, mean = torch.var_mean(x, axes, correction=0, keepdim=True)
        shape = (1, -1) + (1,) * (x.ndim - 2)
        return (x - mean) / torch.sqrt(variance + EPSILON) * self.scale.view(shape) + self.bias.view(shape)


class Activation(nn.Module):
    """Layer normalisation, if requested, and a leaky rectifier."""

    def __init__(self, channels: int, normalise: bool) -> None:
        super().__init__()
        self.LayerNorm_0 = LayerNorm(channels) if normalise else nn.Identity()

    def forward(self, x: Tensor) -> Tensor:
        return functional.leaky_relu(self.LayerNorm_0(x), SLOPE)


class AudioEncoder(nn.Module):
    """Eight convolutions; the last one covers all remaining bands."""

    def __init__(self, config: Speech2GestureConfig, bands: int) -> None:
        super().__init__()
        widths = config.audio_channels
        self.layers = len(widths) - 1
        for layer, (before, after) in enumerate(zip((2, *widths), widths[:-1], strict=False)):
            stride = 1 + layer % 2
            # Bands are padded as far as an odd number of them needs.
            padding = ((1, 1), (1, 1 + bands % 2 if stride == 2 else 1))
            self.add_module(f"ImageConv_{layer}", Conv(before, after, (3, 2 + stride), (1, stride), padding))
            self.add_module(f"Activation_{layer}", Activation(after, config.normalise))
            bands = -(-bands // stride)
        self.Conv1D_0 = _same(bands * widths[-2], widths[-1])
        self.add_module(f"Activation_{self.layers}", Activation(widths[-1], config.normalise))

    def forward(self, audio: Tensor) -> Tensor:
        x = torch.stack([audio, torch.ones_like(audio)], dim=1)
        for layer in range(self.layers):
            x = getattr(self, f"Activation_{layer}")(getattr(self, f"ImageConv_{layer}")(x))
        x = x.permute(0, 3, 1, 2).flatten(1, 2)
        return getattr(self, f"Activation_{self.layers}")(self.Conv1D_0(x))


class UNet(nn.Module):
    """Halvings of time, and as many on the way back."""

    def __init__(self, config: Speech2GestureConfig) -> None:
        super().__init__()
        self.depth, width = config.depth, config.channels
        self.same = 2 + config.depth + config.decoder_layers
        for layer in range(self.same):
            self.add_module(f"Conv1D_{layer}", _same(config.audio_channels[-1] if layer == 0 else width, width))
        for layer in range(self.depth):
            self.add_module(f"StridedConv1D_{layer}", _strided(width, width, 2))
        for layer in range(self.same + self.depth):
            self.add_module(f"Activation_{layer}", Activation(width, config.normalise))

    def forward(self, x: Tensor) -> Tensor:
        activations: Any = iter([getattr(self, f"Activation_{n}") for n in range(self.same + self.depth)])
        convolutions: Any = iter([getattr(self, f"Conv1D_{n}") for n in range(self.same)])

        def same(x: Tensor) -> Tensor:
            return next(activations)(next(convolutions)(x))

        x = same(same(x))
        levels = []
        for layer in range(self.depth):
            levels.append(x)
            x = next(activations)(getattr(self, f"StridedConv1D_{layer}")(x))
        for level in reversed(levels):
            x = same(x.repeat_interleave(2, dim=2) + level)
        for _ in range(self.same - 2 - self.depth):
            x = same(x)
        return x


class Generator(nn.Module):
    """Audio (B, T, bands) to z-scores (B, T, values)."""

    def __init__(self, config: Speech2GestureConfig, bands: int, values: int) -> None:
        super().__init__()
        self.stride = config.stride
        self.AudioEncoder_0 = AudioEncoder(config, bands)
        self.UNet_0 = UNet(config)
        self.Dense_0 = Conv(config.channels, values, (1,), (1,), ((0, 0),))

    def forward(self, audio: Tensor) -> Tensor:
        frames = audio.shape[1]
        x = functional.pad(audio, (0, 0, 0, -frames % self.stride))
        return self.Dense_0(self.UNet_0(self.AudioEncoder_0(x))).transpose(1, 2)[:, :frames]


class Discriminator(nn.Module):
    """Scores (B, patches) of differences of frames (B, T, values)."""

    def __init__(self, config: Speech2GestureConfig, values: int) -> None:
        super().__init__()
        widths = config.discriminator_channels
        self.layers = len(widths)
        for layer, (before, after) in enumerate(zip((values, *widths), widths, strict=False)):
            stride = 1 if layer == self.layers - 1 else 2
            self.add_module(f"StridedConv1D_{layer}", _strided(before, after, stride))
            self.add_module(f"Activation_{layer}", Activation(after, config.normalise and layer > 0))
        self.add_module(f"StridedConv1D_{self.layers}", _strided(widths[-1], 1, 1))

    def forward(self, motion: Tensor) -> Tensor:
        x = motion.transpose(1, 2)
        for layer in range(self.layers):
            x = getattr(self, f"Activation_{layer}")(getattr(self, f"StridedConv1D_{layer}")(x))
        return getattr(self, f"StridedConv1D_{self.layers}")(x)[:, 0]


class Twin(nn.Module):
    """Both networks and their losses."""

    def __init__(
        self, config: Speech2GestureConfig, bands: int, mean: np.ndarray, std: np.ndarray, positions: Callable | None
    ) -> None:
        """
        Args:
            mean: of the values of a pose, (R, D); so is their ``std``.
            positions: local rotations (..., J, 3, 3) and joint positions (..., J, 3) in metres of values (..., R, D)
                in 6D; None if they are not rotations.
        """
        super().__init__()
        self.generator = Generator(config, bands, mean.size)
        self.discriminator = Discriminator(config, mean.size)
        self.register_buffer("mean", torch.from_numpy(mean), persistent=False)
        self.register_buffer("std", torch.from_numpy(std), persistent=False)
        self.positions = positions

    def generate(self, audio: Tensor) -> Tensor:
        """Values of poses (B, T, R, D)."""
        return self.generator(audio).unflatten(-1, self.mean.shape) * self.std + self.mean

    def terms(self, audio: Tensor, target: Tensor) -> dict[str, Tensor]:
        """Every loss, unweighted."""
        pose = self.generate(audio)
        if self.positions is None:
            ours, theirs = self._normalised(pose), self._normalised(target)
            terms = {
                "value": functional.l1_loss(ours, theirs),
                "value_speed": functional.l1_loss(ours.diff(dim=1), theirs.diff(dim=1)),
            }
            shown = pose
        else:
            terms, rotations = rotation_terms(self.positions, pose, target)
            shown = rotations[..., :2].transpose(-1, -2).flatten(-2)
        fake, real = (self._normalised(values).flatten(2).diff(dim=1) for values in (shown, target))
        judged = self.discriminator(torch.cat([real, fake.detach()]))
        real_score, fake_score = judged.chunk(2)
        for value in self.discriminator.parameters():
            value.requires_grad_(False)
        fooled = self.discriminator(fake)
        for value in self.discriminator.parameters():
            value.requires_grad_(True)
        return terms | {
            "adversarial": functional.mse_loss(fooled, torch.ones_like(fooled)),
            "discriminator": functional.mse_loss(real_score, torch.ones_like(real_score))
            + functional.mse_loss(fake_score, torch.zeros_like(fake_score)),
        }

    def _normalised(self, values: Tensor) -> Tensor:
        return (values - self.mean) / self.std


def rotation_terms(positions: Callable, pose: Tensor, target: Tensor) -> tuple[dict[str, Tensor], Tensor]:
    """Losses of rotations, positions and velocities, and our rotations."""
    (turned, ours), (true, theirs) = positions(pose), positions(target)
    cosine = ((turned * true).sum((-1, -2)) - 1) / 2
    distance = lambda a, b: (a - b).abs().sum(-1).mean()  # noqa: E731
    return {
        "rotation": torch.arccos(cosine).mean(),
        "position": distance(ours, theirs),
        "speed": distance(ours.diff(dim=1), theirs.diff(dim=1)),
    }, turned


def load_params(module: nn.Module, params: Mapping[str, Any]) -> None:
    """Copy a tree of our Flax parameters into a module whose parts have the same names.

    Raises:
        ValueError: a parameter is missing on either side, or has another shape.
    """
    arrays, own = flatten_dict(dict(params), sep="."), dict(module.named_parameters())
    if set(arrays) != set(own):
        raise ValueError(f"Expected other parameters; only one side has {sorted(set(arrays) ^ set(own))}.")
    for name, value in own.items():
        array = _as_theirs(np.array(arrays[name]))
        if array.shape != tuple(value.shape):
            raise ValueError(f"Expected {name} of shape {tuple(value.shape)}; got {array.shape}.")
        with torch.no_grad():
            value.copy_(torch.from_numpy(np.ascontiguousarray(array)))


def _as_theirs(array: np.ndarray) -> np.ndarray:
    """A kernel (taps ..., inputs, outputs) as (outputs, inputs, taps ...)."""
    if array.ndim == 1:
        return array
    kernel = array[None] if array.ndim == 2 else array
    return np.moveaxis(kernel, (-1, -2), (0, 1))


def gradients(module: nn.Module, params: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Gradients by the flat names of our parameters and in their shapes; zeros where there is none."""
    shapes = {name: array.shape for name, array in flatten_dict(dict(params), sep=".").items()}
    found = {}
    for name, value in module.named_parameters():
        gradient = torch.zeros_like(value) if value.grad is None else value.grad
        array = gradient.detach().numpy()
        found[name] = (np.moveaxis(array, (0, 1), (-1, -2)) if array.ndim > 1 else array).reshape(shapes[name])
    return found
