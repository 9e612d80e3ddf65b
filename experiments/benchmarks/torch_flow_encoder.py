"""The global encoder of the flow's PyTorch twin: embeddings of poses and of audio, and their fusion."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from experiments.benchmarks.torch_layers import Conv, LayerNorm


class WindowEncoder(nn.Module):
    """Embedding of a stretch (B, C, T), averaged over time; parts have the names of Flax, in the order of their use."""

    def __init__(self, config: StylizedFlowConfig, inputs: int) -> None:
        super().__init__()
        width, self.blocks, self.normed = config.encoder_channels, config.encoder_blocks, int(config.strided_norm)
        self.StridedConv1D_0 = Conv(inputs, width, 4)
        for block in range(self.blocks):
            self.add_module(f"Conv1D_{block}", Conv(width, width, 3))
        self.StridedConv1D_1 = Conv(width, config.embedding_channels, 4)
        widths = [width] * (self.normed + self.blocks) + [config.embedding_channels] * self.normed
        for number, channels in enumerate(widths):
            self.add_module(f"LayerNorm_{number}", LayerNorm(channels))

    def forward(self, x: Tensor) -> Tensor:
        x = self._after(0, _halve(self.StridedConv1D_0, x))
        for block in range(self.blocks):
            norm = getattr(self, f"LayerNorm_{block + self.normed}")
            x = torch.relu(x + norm(getattr(self, f"Conv1D_{block}")(x)))
        return self._after(self.blocks + 1, _halve(self.StridedConv1D_1, x)).mean(-1)

    def _after(self, number: int, x: Tensor) -> Tensor:
        return torch.relu(getattr(self, f"LayerNorm_{number}")(x)) if self.normed else x


def _halve(conv: Conv, x: Tensor) -> Tensor:
    """Every second frame, an odd number of them rounded up."""
    padded = functional.pad(x, (1, 1 + x.shape[-1] % 2))
    return functional.conv1d(padded, conv.kernel, conv.bias, stride=2)


class Fusion(nn.Module):
    """Both embeddings to the global feature. Flax numbers the last layer first."""

    def __init__(self, config: StylizedFlowConfig) -> None:
        super().__init__()
        width = config.encoder_channels
        self.Dense_0, self.Dense_1 = Conv(width, config.global_channels), Conv(width, width)
        self.Dense_2 = Conv(2 * config.embedding_channels, width)

    def forward(self, x: Tensor) -> Tensor:
        x = self.Dense_1(torch.relu(self.Dense_2(x[..., None])))
        return self.Dense_0(torch.relu(x))[..., 0]
