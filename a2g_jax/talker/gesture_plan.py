"""Selection of the syllables with strokes, which the plan determines, and the hidden choices drawn for them."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from a2g_jax.talker.speech import SpeechPlan
from a2g_jax.talker.styles import FAMILIES, HANDS, PLACES, POSTURES, REST_POSES, GestureStyle
from a2g_jax.talker.truth import GestureUnit, Stroke

LEAD_MEAN, LEAD_SPREAD = 0.06, 0.04
"""A stroke arrives this long before its syllable's energy peak, seconds: normal, truncated to :data:`LEAD_RANGE`."""
LEAD_RANGE = (-0.03, 0.20)
LONG_PAUSE = 0.8
"""Pauses of the speech longer than this (seconds) end a gesture unit; the hands go back to rest."""
UNIT_GAP = 1.6
"""Strokes further apart than this (seconds) belong to different units."""
UNIT_STROKES = 5
"""A unit has at most this many strokes."""
FAMILY_CHANGE = 0.18
"""Probability that a stroke after a unit's first is of another family than the unit."""


@dataclass(frozen=True)
class GestureDraws:
    """The strokes of a recording and every discrete hidden choice."""

    strokes: tuple[Stroke, ...]
    units: tuple[GestureUnit, ...]
    rest_pose: str
    posture: str

    def log_probability(self, style: GestureStyle) -> float:
        """Log-probability (nats) of the discrete choices under ``style``."""
        total = math.log(style.rest_poses[REST_POSES.index(self.rest_pose)])
        total += math.log(posture_probabilities()[POSTURES.index(self.posture)])
        for unit in self.units:
            total += math.log(hand_probabilities(style)[HANDS.index(unit.hand)])
            total += math.log(family_probabilities(style, unit.hand)[FAMILIES.index(unit.family)])
            total += math.log(style.places[PLACES.index(unit.place)])
            total += math.log(style.hold if unit.holds else 1.0 - style.hold)
            for index in unit.strokes[1:]:
                family = self.strokes[index].family
                if family == unit.family:
                    total += math.log(1.0 - FAMILY_CHANGE)
                else:
                    total += math.log(FAMILY_CHANGE)
                    total += math.log(other_families(style, unit.hand, unit.family)[FAMILIES.index(family)])
        return total


def posture_probabilities() -> tuple[float, ...]:
    """Probabilities of the postures, the same for all speakers."""
    return (0.5, 0.25, 0.25)


def hand_probabilities(style: GestureStyle) -> tuple[float, ...]:
    """Probabilities of left, right and both hands."""
    one = 1.0 - style.two_handed
    return one * (1.0 - style.right_handed), one * style.right_handed, style.two_handed


def family_probabilities(style: GestureStyle, hand: str) -> tuple[float, ...]:
    """Probabilities of the families given the hand: frames need two hands, points are rare with two."""
    allowed = {"frame": 0.0} if hand != "both" else {"point": 0.15, "list": 0.4}
    weights = [weight * allowed.get(name, 1.0) for name, weight in zip(FAMILIES, style.families, strict=True)]
    return tuple(weight / sum(weights) for weight in weights)


def other_families(style: GestureStyle, hand: str, family: str) -> tuple[float, ...]:
    """Probabilities of the families of a stroke that is not of its unit's ``family``."""
    chances = family_probabilities(style, hand)
    rest = 1.0 - chances[FAMILIES.index(family)]
    return tuple(0.0 if name == family else chance / rest for name, chance in zip(FAMILIES, chances, strict=True))


def accented_syllables(plan: SpeechPlan, threshold: float, spacing: float) -> list[int]:
    """Indices of the syllables whose accent passes ``threshold``, the stronger first, ``spacing`` seconds apart.

    Deterministic, so the times of strokes and nods are predictable from the audio.
    """
    taken: list[int] = []
    accents = [(-s.accent, s.peak, index) for index, s in enumerate(plan.syllables) if s.accent >= threshold]
    for _, peak, index in sorted(accents):
        if all(abs(peak - plan.syllables[other].peak) >= spacing for other in taken):
            taken.append(index)
    return sorted(taken, key=lambda index: plan.syllables[index].peak)


def group_units(plan: SpeechPlan, syllables: list[int]) -> list[list[int]]:
    """Group positions in ``syllables`` into units: split at long pauses, long gaps, and evenly where one gets long."""
    runs: list[list[int]] = []
    for position, index in enumerate(syllables):
        if runs:
            before = plan.syllables[syllables[position - 1]].peak
            now = plan.syllables[index].peak
            if now - before <= UNIT_GAP and _pause_between(plan, before, now) <= LONG_PAUSE:
                runs[-1].append(position)
                continue
        runs.append([position])
    units: list[list[int]] = []
    for run in runs:
        parts = math.ceil(len(run) / UNIT_STROKES)
        edges = [round(part * len(run) / parts) for part in range(parts + 1)]
        units.extend(run[low:high] for low, high in pairwise(edges))
    return units


def _pause_between(plan: SpeechPlan, first: float, second: float) -> float:
    """Longest pause between phrases that lies between two times, seconds."""
    return max(
        (b.start - a.end for a, b in pairwise(plan.phrases) if a.end >= first - 0.2 and b.start <= second + 0.2),
        default=0.0,
    )


def draw_gestures(plan: SpeechPlan, style: GestureStyle, rng: np.random.Generator) -> GestureDraws:
    """Draw the hidden choices for a plan."""
    rest_pose = REST_POSES[rng.choice(len(REST_POSES), p=style.rest_poses)]
    posture = POSTURES[rng.choice(len(POSTURES), p=posture_probabilities())]
    syllables = accented_syllables(plan, style.threshold, style.spacing)
    strokes: list[Stroke] = []
    units: list[GestureUnit] = []
    for positions in group_units(plan, syllables):
        hand = HANDS[rng.choice(len(HANDS), p=hand_probabilities(style))]
        family = FAMILIES[rng.choice(len(FAMILIES), p=family_probabilities(style, hand))]
        place = PLACES[rng.choice(len(PLACES), p=style.places)]
        holds = bool(rng.random() < style.hold)
        for order, position in enumerate(positions):
            other = order > 0 and rng.random() < FAMILY_CHANGE
            chances = other_families(style, hand, family)
            syllable = plan.syllables[syllables[position]]
            strokes.append(
                Stroke(
                    apex=syllable.peak - draw_lead(rng),
                    syllable=syllables[position],
                    size=min(max(syllable.accent, 0.0), 1.0),
                    hand=hand,
                    family=FAMILIES[rng.choice(len(FAMILIES), p=chances)] if other else family,
                    hold=float(rng.uniform(0.3, 0.9)) if holds else float(rng.uniform(0.02, 0.10)),
                    unit=len(units),
                )
            )
        units.append(GestureUnit(tuple(positions), hand, family, place, holds))
    return GestureDraws(tuple(strokes), tuple(units), rest_pose, posture)


def draw_lead(rng: np.random.Generator) -> float:
    """Time from a stroke's apex to its syllable's peak, seconds."""
    while True:
        lead = float(rng.normal(LEAD_MEAN, LEAD_SPREAD))
        if LEAD_RANGE[0] <= lead <= LEAD_RANGE[1]:
            return lead
