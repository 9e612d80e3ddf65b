"""PyTorch's side of the layers of Audio2Gestures, with the names of Flax.

Activations lie as (clips, channels, frames). Where PyTorch has a kernel of its own (recurrent layers, attention, layer
normalisation), it is used, so that ours are compared with an independent implementation.
"""

from typing import NamedTuple

import numpy as np
import scipy.fft
import torch
from torch import Tensor, nn
from torch.nn import functional
from torch.nn.functional import conv1d

from a2g_jax.models.audio2gestures.config import Audio2GesturesConfig
from a2g_jax.models.audio2gestures.networks import LOG_VARIANCE_BOUND

#: As in Flax.
NORM_EPSILON = 1e-6


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
        return self.blocks(x)[-1]

    def blocks(self, x: Tensor) -> list[Tensor]:
        """The output of each block."""
        outputs = []
        for block in self.children():
            x = block(x)
            outputs.append(x)
        return outputs


class Gaussian(NamedTuple):
    """Means and log-variances (clips, channels, frames)."""

    mean: Tensor
    log_variance: Tensor

    def shift(self, noise: Tensor) -> Tensor:
        """The draw for standard normal noise."""
        return self.mean + torch.exp(0.5 * self.log_variance) * noise


class GaussianHead(nn.Module):
    """Mean and bounded log-variance. Flax numbers the outer layer of each pair first."""

    def __init__(self, inputs: int, hidden: int, outputs: int) -> None:
        super().__init__()
        self.Dense_0, self.Dense_1 = Conv(hidden, outputs), Conv(inputs, hidden)
        self.Dense_2, self.Dense_3 = Conv(hidden, outputs), Conv(inputs, hidden)

    def forward(self, x: Tensor) -> Gaussian:
        mean = self.Dense_0(torch.relu(self.Dense_1(x)))
        return Gaussian(mean, _bounded(self.Dense_2(torch.relu(self.Dense_3(x)))))


def _bounded(log_variance: Tensor) -> Tensor:
    return LOG_VARIANCE_BOUND * torch.tanh(log_variance / LOG_VARIANCE_BOUND)


def block_dct(x: Tensor, points: int, inverse: bool = False) -> Tensor:
    """The orthonormal DCT-II (or its inverse) of every ``points`` frames of (B, C, T), by SciPy's basis."""
    basis = torch.from_numpy(scipy.fft.dct(np.eye(points), axis=0, norm="ortho")).to(x)
    return ((basis.T if inverse else basis) @ x.unflatten(2, (-1, points))[..., None]).squeeze(-1).flatten(2)


class BandHead(nn.Module):
    """Mean, and log-variance where there is one, of DCT bands."""

    def __init__(self, inputs: int, outputs: int, points: int, variational: bool) -> None:
        super().__init__()
        self.Dense_0 = Conv(inputs, outputs)
        self.Dense_1 = Conv(inputs, outputs) if variational else None
        self.points = points

    def forward(self, x: Tensor) -> Gaussian:
        bands = block_dct(x, self.points)
        mean = self.Dense_0(bands)
        if self.Dense_1 is None:
            return Gaussian(mean, torch.full_like(mean, -torch.inf))
        return Gaussian(mean, _bounded(self.Dense_1(bands)))


class GRU(nn.Module):
    """PyTorch's recurrent layer with the names and layout of our parameters."""

    def __init__(self, inputs: int, features: int, reverse: bool) -> None:
        super().__init__()
        self.input_kernel = nn.Parameter(torch.zeros(3 * features, inputs, 1))
        self.input_bias = nn.Parameter(torch.zeros(3 * features))
        self.state_kernel = nn.Parameter(torch.zeros(3 * features, features, 1))
        self.state_bias = nn.Parameter(torch.zeros(3 * features))
        self.reverse = reverse

    def forward(self, x: Tensor) -> Tensor:
        frames = x.permute(2, 0, 1)
        weights = [self.input_kernel[..., 0], self.state_kernel[..., 0], self.input_bias, self.state_bias]
        state = frames.new_zeros(1, frames.shape[1], self.state_kernel.shape[1])
        inputs = frames.flip(0) if self.reverse else frames
        states, _ = torch.gru(inputs, state, weights, True, 1, 0.0, False, False, False)
        return (states.flip(0) if self.reverse else states).permute(1, 2, 0)


class BidirectionalGRU(nn.Module):
    """Layers of a forward and a backward GRU."""

    def __init__(self, inputs: int, layers: int, features: int) -> None:
        super().__init__()
        self.layers = layers
        for layer in range(layers):
            width = 2 * features if layer else inputs
            self.add_module(f"GRU_{2 * layer}", GRU(width, features, False))
            self.add_module(f"GRU_{2 * layer + 1}", GRU(width, features, True))

    def forward(self, x: Tensor) -> Tensor:
        for layer in range(self.layers):
            x = torch.cat([getattr(self, f"GRU_{2 * layer}")(x), getattr(self, f"GRU_{2 * layer + 1}")(x)], dim=1)
        return x


class LayerNorm(nn.Module):
    """Layer normalisation over channels."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.scale, self.bias = nn.Parameter(torch.ones(channels)), nn.Parameter(torch.zeros(channels))

    def forward(self, x: Tensor) -> Tensor:
        x = x.transpose(1, 2)
        return functional.layer_norm(x, x.shape[-1:], self.scale, self.bias, NORM_EPSILON).transpose(1, 2)


class LocalAttention(nn.Module):
    """One head, with a bias for each distance and no attention beyond ``reach`` frames."""

    def __init__(self, channels: int, reach: int) -> None:
        super().__init__()
        self.Dense_0, self.Dense_1, self.Dense_2 = (Conv(channels, channels) for _ in range(3))
        self.distance_bias = nn.Parameter(torch.zeros(2 * reach + 1))
        self.reach = reach

    def forward(self, x: Tensor) -> Tensor:
        frames = torch.arange(x.shape[2])
        distance = frames[None] - frames[:, None]
        bias = self.distance_bias[distance.clamp(-self.reach, self.reach) + self.reach]
        mask = bias.masked_fill(distance.abs() > self.reach, -torch.inf)
        query, key, value = (layer(x).transpose(1, 2) for layer in (self.Dense_0, self.Dense_1, self.Dense_2))
        return functional.scaled_dot_product_attention(query, key, value, mask).transpose(1, 2)


class TransformerLayer(nn.Module):
    """Attention, and two linear layers with the outer one named first."""

    def __init__(self, channels: int, hidden: int, reach: int) -> None:
        super().__init__()
        self.LocalAttention_0 = LocalAttention(channels, reach)
        self.LayerNorm_0, self.LayerNorm_1 = LayerNorm(channels), LayerNorm(channels)
        self.Dense_0, self.Dense_1 = Conv(hidden, channels), Conv(channels, hidden)

    def forward(self, x: Tensor) -> Tensor:
        x = self.LayerNorm_0(x + self.LocalAttention_0(x))
        return self.LayerNorm_1(x + torch.relu(self.Dense_0(torch.relu(self.Dense_1(x)))))


class Transformer(nn.Module):
    """A linear layer and encoder layers."""

    def __init__(self, inputs: int, config: Audio2GesturesConfig) -> None:
        super().__init__()
        self.Dense_0 = Conv(inputs, config.attention_channels)
        self.layers = config.attention_layers
        for layer in range(self.layers):
            made = TransformerLayer(config.attention_channels, config.attention_hidden, config.attention_window // 2)
            self.add_module(f"TransformerLayer_{layer}", made)

    def forward(self, x: Tensor) -> Tensor:
        x = self.Dense_0(x)
        for layer in range(self.layers):
            x = getattr(self, f"TransformerLayer_{layer}")(x)
        return x


def add_backbone(module: nn.Module, config: Audio2GesturesConfig, inputs: int, channels: tuple[int, ...]) -> int:
    """Add the backbone of ``config`` to a module, under the name of ours, and return the width of its output."""
    if config.backbone == "gru":
        module.BidirectionalGRU_0 = BidirectionalGRU(inputs, config.recurrent_layers, config.recurrent_channels)
        return 2 * config.recurrent_channels
    if config.backbone == "transformer":
        module.Transformer_0 = Transformer(inputs, config)
        return config.attention_channels
    module.TCN_0 = TCN(inputs, channels, config.kernel_size)
    return channels[-1]


def run_backbone(module: nn.Module, x: Tensor) -> Tensor:
    """Output of the backbone of :func:`add_backbone`."""
    name = next(name for name in ("TCN_0", "BidirectionalGRU_0", "Transformer_0") if hasattr(module, name))
    output: Tensor = getattr(module, name)(x)
    return output


def add_head(
    module: nn.Module, config: Audio2GesturesConfig, inputs: int, hidden: int, number: int, shared: bool
) -> None:
    """Add the ``number``-th head to a module."""
    if config.latent == "dct":
        head: nn.Module = BandHead(inputs, config.code_channels, config.dct_points, not shared)
        module.add_module(f"BandHead_{number}", head)
    else:
        module.add_module(f"GaussianHead_{number}", GaussianHead(inputs, hidden, config.code_channels))


def run_head(module: nn.Module, number: int, x: Tensor) -> Gaussian:
    """Output of the head of :func:`add_head`."""
    name = f"BandHead_{number}" if hasattr(module, f"BandHead_{number}") else f"GaussianHead_{number}"
    output: Gaussian = getattr(module, name)(x)
    return output
