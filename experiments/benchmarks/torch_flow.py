"""A PyTorch twin of our stylized flow and MoGlow: the same networks and losses, to compare values and speed.

Written from ``a2g_jax.models.stylized_flow`` with PyTorch's own recurrent layers, whose gates are the same. Sampling
has two forms: with the whole condition through every recurrent layer at every frame, and with the audio's share of the
gates and the audio's embedding precomputed for all frames. Either way matrices are inverted once.
"""

import math
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional

from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from experiments.benchmarks.torch_flow_encoder import Fusion, WindowEncoder

#: Smallest scale of a coupling, and the offset of a raw scale before the sigmoid.
_EPSILON, _OFFSET = 1e-6, 2.0


class Actnorm(nn.Module):
    """A scale and a shift for every channel."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.bias, self.log_scale = nn.Parameter(torch.zeros(channels)), nn.Parameter(torch.zeros(channels))

    def forward(self, x: Tensor) -> Tensor:
        return (x + self.bias) * self.log_scale.exp()

    def inverse(self, y: Tensor) -> Tensor:
        """Inverse of :meth:`forward`."""
        return y * (-self.log_scale).exp() - self.bias


class Invertible(nn.Module):
    """1x1 convolution with its matrix as an LU decomposition."""

    permutation: Tensor
    sign: Tensor

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.lower, self.upper = (nn.Parameter(torch.zeros(channels, channels)) for _ in range(2))
        self.log_scale = nn.Parameter(torch.zeros(channels))
        self.register_buffer("permutation", torch.eye(channels))
        self.register_buffer("sign", torch.ones(channels))

    def weight(self) -> Tensor:
        """The matrix."""
        lower = self.lower.tril(-1) + torch.eye(len(self.sign), dtype=self.sign.dtype)
        return self.permutation @ lower @ (self.upper.triu(1) + torch.diag(self.sign * self.log_scale.exp()))


class Coupling(nn.Module):
    """Scale and shift of the second half of the channels, from the first half and the condition."""

    def __init__(self, config: StylizedFlowConfig, channels: int, condition: int) -> None:
        super().__init__()
        self.kept = channels // 2
        recurrent = nn.LSTM if config.cell == "lstm" else nn.GRU
        self.recurrent = recurrent(self.kept + condition, config.hidden, config.layers, batch_first=True)
        self.out = nn.Linear(config.hidden, 2 * (channels - self.kept))
        self.first_scale = 1 / (1 + math.exp(-_OFFSET)) + _EPSILON if config.exact_identity else 1.0

    def forward(self, kept: Tensor, condition: Tensor, state: Any = None) -> tuple[Tensor, Tensor, Any]:
        """Scale, shift and the state after the last frame."""
        output, state = self.recurrent(torch.cat([kept, condition], dim=-1), state)
        return *self.affine(output), state

    def affine(self, output: Tensor) -> tuple[Tensor, Tensor]:
        """Scale and shift of the recurrent layers' output."""
        shift, raw = self.out(output).chunk(2, dim=-1)
        return (torch.sigmoid(raw + _OFFSET) + _EPSILON) / self.first_scale, shift


class Step(nn.Module):
    """Actnorm, 1x1 convolution, coupling."""

    def __init__(self, config: StylizedFlowConfig, channels: int, condition: int) -> None:
        super().__init__()
        self.actnorm, self.invertible = Actnorm(channels), Invertible(channels)
        self.coupling = Coupling(config, channels, condition)

    def forward(self, x: Tensor, condition: Tensor) -> tuple[Tensor, Tensor]:
        """Frames (B, T, C) and their log-determinants."""
        x = self.actnorm(x) @ self.invertible.weight().T
        kept, changed = x[..., : self.coupling.kept], x[..., self.coupling.kept :]
        scale, shift, _ = self.coupling(kept, condition)
        log_det = self.actnorm.log_scale.sum() + self.invertible.log_scale.sum() + scale.log().sum(-1)
        return torch.cat([kept, (changed + shift) * scale], dim=-1), log_det

    def inverse(self, y: Tensor, condition: Tensor, matrix: Tensor, state: Any = None) -> tuple[Tensor, Any]:
        """Inverse of :meth:`forward`, and the state; ``matrix`` is the inverse one."""
        kept, changed = y[..., : self.coupling.kept], y[..., self.coupling.kept :]
        scale, shift, state = self.coupling(kept, condition, state)
        return self.actnorm.inverse(torch.cat([kept, changed / scale - shift], dim=-1) @ matrix.T), state


class Split(NamedTuple):
    """A coupling's first layer without the audio's columns, and their contribution to the gates of every frame."""

    weight: Tensor
    audio_gates: Tensor


class Twin(nn.Module):
    """Flow, global encoder and losses; poses are z-scores of C channels."""

    def __init__(self, config: StylizedFlowConfig, channels: int, bands: int) -> None:
        super().__init__()
        if config.style_controls:
            raise ValueError("Expected a configuration without style controls.")
        self.config = config
        self.context_width = config.history_frames * channels + config.global_channels
        width = self.context_width + config.audio_frames * bands
        self.steps = nn.ModuleList(Step(config, channels, width) for _ in range(config.flow_steps))
        self.global_encoder = None
        if config.global_channels:
            parts = {
                "pose": WindowEncoder(config, channels),
                "audio": WindowEncoder(config, bands),
                "fusion": Fusion(config),
            }
            self.global_encoder = nn.ModuleDict(parts)

    def embed(self, name: str, stretches: Tensor) -> Tensor:
        """Embeddings (B, N, E) of stretches (B, N, T, C)."""
        assert self.global_encoder is not None
        flat = self.global_encoder[name](stretches.flatten(0, 1).transpose(1, 2))
        return flat.unflatten(0, stretches.shape[:2])

    def fuse(self, pose: Tensor, audio: Tensor) -> Tensor:
        """The global feature (B, N, G)."""
        assert self.global_encoder is not None
        both = torch.cat([pose, audio], dim=-1)
        return self.global_encoder["fusion"](both.flatten(0, 1)).unflatten(0, both.shape[:2])

    def condition(self, flat: Tensor, audio: Tensor, visible: Tensor) -> Tensor:
        """Context of the inner frames of clips (B, T, C) and (B, T, bands); ``visible`` is (B, N, history)."""
        config = self.config
        history = _stretches(flat[:, : flat.shape[1] - 1 - config.lookahead_frames], config.history_frames)
        history, windows = history * visible[..., None], _stretches(audio, config.audio_frames)
        context = [history.flatten(2)]
        if self.global_encoder is not None:
            context.append(self.fuse(self.embed("pose", history), self.embed("audio", windows)))
        return torch.cat([*context, windows.flatten(2)], dim=-1)

    def latents(self, x: Tensor, condition: Tensor) -> tuple[Tensor, Tensor]:
        """Latents (B, N, C) and log-determinants (B, N)."""
        total = torch.zeros(x.shape[:2], dtype=x.dtype)
        for step in self.steps:
            x, log_det = step(x, condition)
            total = total + log_det
        return x, total

    def motion(self, z: Tensor, condition: Tensor) -> Tensor:
        """Frames of latents, all at once."""
        for step in reversed(self.steps):
            z, _ = step.inverse(z, condition, torch.linalg.inv(step.invertible.weight()))
        return z

    def terms(self, flat: Tensor, audio: Tensor, visible: Tensor, z: Tensor | None = None) -> dict[str, Tensor]:
        """Bits per frame, and with latents ``z`` the distance of their motion from the truth."""
        config = self.config
        condition = self.condition(flat, audio, visible)
        inner = flat[:, config.history_frames : flat.shape[1] - config.lookahead_frames]
        latents, log_det = self.latents(inner, condition)
        terms = {"bits": -(log_prob(latents, config.freedom) + log_det).mean() / math.log(2.0)}
        if z is not None:
            terms["reconstruction"] = (self.motion(z, condition) - inner).abs().mean()
        return terms

    @torch.inference_mode()
    def sample(self, z: Tensor, audio: Tensor, precompute: bool) -> Tensor:
        """Motions (B, T, C) of latents for one audio (T, bands), frame by frame from the mean pose.

        Args:
            precompute: compute the terms that depend only on the audio for all frames in advance, as ours does.
        """
        config, count = self.config, len(z)
        padded = functional.pad(audio, (0, 0, config.history_frames, config.lookahead_frames))
        windows = _stretches(padded[None], config.audio_frames)
        audio_flat = windows[0].flatten(1)
        embedding = self.embed("audio", windows) if self.global_encoder is not None and precompute else None
        matrices = [torch.linalg.inv(step.invertible.weight()) for step in self.steps]
        splits = [self._split(step.coupling, audio_flat) for step in self.steps] if precompute else []
        states: list[Any] = [self._rest(count, z) if precompute else None for _ in self.steps]
        history = z.new_zeros(count, config.history_frames, z.shape[-1])
        frames = []
        for frame in range(z.shape[1]):
            context = history.flatten(1)
            if self.global_encoder is not None:
                here = (
                    self.embed("audio", windows[:, frame : frame + 1]) if embedding is None else embedding[:, [frame]]
                )
                feature = self.fuse(self.embed("pose", history[:, None]), here.expand(count, -1, -1))
                context = torch.cat([context, feature[:, 0]], dim=-1)
            x = z[:, frame]
            if not precompute:
                context = torch.cat([context, audio_flat[frame].expand(count, -1)], dim=-1)[:, None]
            for number in range(len(self.steps) - 1, -1, -1):
                step = self.steps[number]
                if precompute:
                    x, states[number] = _cells(
                        step, splits[number], frame, x, context, matrices[number], states[number]
                    )
                else:
                    x, states[number] = step.inverse(x.reshape(count, 1, -1), context, matrices[number], states[number])
            x = x.reshape(count, -1)
            frames.append(x)
            history = torch.cat([history[:, 1:], x[:, None]], dim=1)
        return torch.stack(frames, dim=1)

    def _split(self, coupling: Coupling, audio_flat: Tensor) -> Split:
        weight, border = coupling.recurrent.weight_ih_l0, coupling.kept + self.context_width
        return Split(
            weight[:, :border].contiguous(),
            functional.linear(audio_flat, weight[:, border:], coupling.recurrent.bias_ih_l0),
        )

    def _rest(self, count: int, like: Tensor) -> list[Any]:
        zeros = like.new_zeros(count, self.config.hidden)
        return [(zeros, zeros) if self.config.cell == "lstm" else zeros for _ in range(self.config.layers)]


def _cells(
    step: Step, split: Split, frame: int, y: Tensor, context: Tensor, matrix: Tensor, states: list[Any]
) -> tuple[Tensor, list[Any]]:
    """:meth:`Step.inverse` of one frame, with the audio's share in place of the first layer's bias."""
    coupling = step.coupling
    recurrent, after = coupling.recurrent, []
    kept, changed = y[:, : coupling.kept], y[:, coupling.kept :]
    x, weight, bias = torch.cat([kept, context], dim=-1), split.weight, split.audio_gates[frame]
    for layer, state in enumerate(states):
        if layer:
            weight, bias = getattr(recurrent, f"weight_ih_l{layer}"), getattr(recurrent, f"bias_ih_l{layer}")
        own = weight, getattr(recurrent, f"weight_hh_l{layer}"), bias, getattr(recurrent, f"bias_hh_l{layer}")
        lstm = isinstance(recurrent, nn.LSTM)
        state = torch.lstm_cell(x, state, *own) if lstm else torch.gru_cell(x, state, *own)
        x = state[0] if lstm else state
        after.append(state)
    scale, shift = coupling.affine(x)
    return step.actnorm.inverse(torch.cat([kept, changed / scale - shift], dim=-1) @ matrix.T), after


def _stretches(x: Tensor, frames: int) -> Tensor:
    """Every stretch of so many frames of (B, T, C): (B, N, frames, C)."""
    return x.unfold(1, frames, 1).transpose(2, 3)


def log_prob(z: Tensor, freedom: float) -> Tensor:
    """Log-density of every frame (..., C): Student-t, or standard normal where ``freedom`` is 0."""
    if freedom == 0:
        return torch.distributions.Normal(0.0, 1.0).log_prob(z).sum(-1)
    half = (freedom + z.shape[-1]) / 2
    constant = math.lgamma(half) - math.lgamma(freedom / 2) - z.shape[-1] / 2 * math.log(math.pi * freedom)
    return constant - half * torch.log1p(z.square().sum(-1) / freedom)
