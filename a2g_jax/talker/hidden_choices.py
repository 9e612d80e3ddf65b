"""Entropy and agreement of the discrete hidden choices of a generated recording, in closed form.

They follow from the speaker's probabilities alone; nothing is sampled.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.recording import Recording
from a2g_jax.talker.gesture_plan import (
    FAMILY_CHANGE,
    accented_syllables,
    family_probabilities,
    group_units,
    hand_probabilities,
    other_families,
    posture_probabilities,
)
from a2g_jax.talker.speech import SpeechPlan, plan_from_json
from a2g_jax.talker.styles import FAMILIES, HANDS, GestureStyle, gesture_style


class Choice(NamedTuple):
    """One kind of hidden choice in one recording."""

    times: int
    """How often it is made in the recording."""
    entropy: float
    """Of one such choice, given the choices before it; nats."""
    agreement: float
    """Probability that two independent draws agree in one such choice."""
    full_agreement: float
    """Probability that two independent draws agree in every such choice of the recording."""

    @property
    def total_entropy(self) -> float:
        """Of all such choices in the recording, given those of other kinds before them, nats."""
        return self.times * self.entropy


def speech_plan(recording: Recording) -> SpeechPlan:
    """The speech plan of a generated recording.

    Raises:
        InputError: the recording is not a generated one.
    """
    if "speech" not in recording.annotations:
        raise InputError(f"{recording.name}: is not a generated recording, so its true distribution is unknown.")
    return plan_from_json(recording.annotations["speech"])


def hidden_choices(recording: Recording) -> dict[str, Choice]:
    """Entropy and expected agreement of every kind of hidden choice in a generated recording.

    Chosen once: ``"rest_pose"`` and ``"posture"``. For each gesture unit: ``"hand"``, ``"place"``, ``"hold"`` and
    ``"family"``, whose probabilities depend on the hand. For each stroke after a unit's first: ``"stroke_family"``,
    which is the unit's family or occasionally another one; its ``full_agreement`` is of all strokes, the first ones
    included. Entropies are conditional, so they add up (see :func:`hidden_entropy`); agreements are of the kind alone,
    whatever the choices before.

    Raises:
        InputError: the recording is not a generated one.
    """
    plan = speech_plan(recording)
    style = gesture_style(plan.speaker, plan.emotion)
    sizes = [len(unit) for unit in group_units(plan, accented_syllables(plan, style.threshold, style.spacing))]
    units = len(sizes)
    return {
        "rest_pose": _independent(1, np.array(style.rest_poses)),
        "posture": _independent(1, np.array(posture_probabilities())),
        "hand": _independent(units, np.array(hand_probabilities(style))),
        "place": _independent(units, np.array(style.places)),
        "hold": _independent(units, np.array([style.hold, 1.0 - style.hold])),
        **_families(sizes, style),
    }


def hidden_entropy(recording: Recording) -> float:
    """Entropy, nats, of all discrete hidden choices of a generated recording: minus the expected log-probability.

    A lower bound on any model's mean negative log-likelihood of these choices.
    """
    return sum(choice.total_entropy for choice in hidden_choices(recording).values())


def _independent(times: int, probabilities: Float[np.ndarray, " n"]) -> Choice:
    agreement = float(np.sum(probabilities**2))
    return Choice(times, entropy(probabilities), agreement, agreement**times)


def _families(sizes: list[int], style: GestureStyle) -> dict[str, Choice]:
    """The families of units, and those of their strokes; ``sizes`` are the units' numbers of strokes."""
    hands = np.array(hand_probabilities(style))
    given = np.array([family_probabilities(style, hand) for hand in HANDS])
    joint = hands[:, None] * given
    other = np.array([[other_families(style, hand, family) for family in FAMILIES] for hand in HANDS])
    # A later stroke's family, given the hand and the unit's family.
    later = (1.0 - FAMILY_CHANGE) * np.eye(len(FAMILIES)) + FAMILY_CHANGE * other
    unit_agreement = float(np.sum(joint.sum(axis=0) ** 2))
    stroke_agreement = float(np.sum(np.einsum("hu,huf->f", joint, later) ** 2))
    alike = np.einsum("huf,guf->hgu", later, later)
    full = 1.0
    for size in sizes:
        full *= float(np.einsum("hu,gu,hgu->", joint, joint, alike ** (size - 1)))
    unit_entropy = float(np.sum(hands * [entropy(row) for row in given]))
    rows = np.array([[entropy(row) for row in table] for table in later])
    return {
        "family": Choice(len(sizes), unit_entropy, unit_agreement, unit_agreement ** len(sizes)),
        "stroke_family": Choice(sum(sizes) - len(sizes), float(np.sum(joint * rows)), stroke_agreement, full),
    }


def entropy(probabilities: Float[np.ndarray, " n"]) -> float:
    """``-sum p ln p`` in nats; outcomes of probability 0 add nothing."""
    likely = probabilities[probabilities > 0.0]
    return float(-np.sum(likely * np.log(likely)))
