"""Common settings of the tables of the stylized flow.

Rows of the flow have the published structure at a size for 2 cores (preset ``tiny_published``) and our linear first
layer, so that only the paper's own parts differ; the flow and MoGlow are also trained as published, without it. The
spring that keeps poses within the range of training motion acts in generation of minutes, not in these tables.
"""

from collections.abc import Mapping
from typing import Any

from experiments.stylized_flow.protocol import PROTOCOLS
from experiments.tables.setting import Variant

#: Training of flows: the published schedule and clipping, at a size and for a time that 2 cores allow.
TRAINING: dict[str, Any] = {
    "batch_size": 16,
    "learning_rate": 1.5e-3,
    "schedule": "noam",
    "warmup_steps": 200,
    "clip_value": 5.0,
    "clip_norm": 100.0,
    "augmentation": 0.0,
}

#: MoGlow, as a change of the flow's presets: LSTMs, a normal prior, no global encoder and no reverse pass.
MOGLOW = {"cell": "lstm", "freedom": 0.0, "global_channels": 0, "reverse_share": 0.0}

#: Steps of MoGlow in the time of one step of the flow, measured by ``python -m experiments.stylized_flow.step_time``:
#: it has no reverse pass and no encoder. With the linear layer and without.
EQUAL: Mapping[str, Mapping[bool, float]] = {
    "trinity": {True: 1.4, False: 1.36},
    "ted": {True: 1.77, False: 1.79},
}

#: Steps of the other models, in those of the flow. Their steps cost a fraction of the flow's, so they train for less
#: time than the flow; the tables state the seconds.
OTHERS = {"trinity": {"a2g": 1.0, "s2g": 0.5}, "ted": {"a2g": 0.5, "s2g": 0.3}}

#: Our linear first layer, which is not published.
LINEAR_LAYER = {"predictor": True, "history_input": "poses"}

#: Clips and context of the protocols.
CLIPS: Mapping[str, Mapping[str, Any]] = {
    "trinity": {"history_frames": 5, "lookahead_frames": 20, "clip_frames": PROTOCOLS["trinity"].frames},
    "ted": {"history_frames": 12, "lookahead_frames": 0, "clip_frames": PROTOCOLS["ted"].frames},
}
PERCEPTUAL = {"perceptual_weight": 0.1}


def flow(protocol: str, **changes: Any) -> Variant:
    """A flow on a protocol's clips, with its perceptual loss and our linear layer unless changed."""
    return _variant({**CLIPS[protocol], **PERCEPTUAL, **LINEAR_LAYER, **changes})


def published(protocol: str) -> Variant:
    """The paper's own flow: without our linear layer."""
    return flow(protocol, predictor=False)


def _variant(changes: Mapping[str, Any], steps: float = 1.0) -> Variant:
    return Variant(dict(changes), model="stylized_flow", preset="tiny_published", training=TRAINING, steps=steps)


def moglow(protocol: str, predictor: bool) -> Variant:
    """MoGlow on a protocol's clips, trained for as long as the flow.

    Args:
        predictor: with the linear first layer, which is ours.
    """
    changes = {**CLIPS[protocol], **MOGLOW, **LINEAR_LAYER, "predictor": predictor}
    return _variant(changes, EQUAL[protocol][predictor])


def baseline(protocol: str) -> Variant:
    """The paper's baseline of Table 2: MoGlow with GRUs, trained for as many steps as the flow."""
    return _variant({**CLIPS[protocol], **MOGLOW, **LINEAR_LAYER, "cell": "gru"})
