"""Report on styled motion: how near its hands are to the clip's in height, speed and radius, and their agreement."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS
from a2g_jax.metrics.hands import hand_speeds, local_places
from a2g_jax.metrics.rhythm import agreement_with_null
from a2g_jax.metrics.style import HandStyle, hand_style

#: Differences from the clip that people do not mind: metres, m/s, metres. They are also the units of the way.
NEAR = HandStyle(0.05, 0.1, 0.05)
#: Shares of the way between which a style counts as followed in part.
PARTLY = (0.5, 1.5)
#: Factor on the higher one of the clip's own and the plain motion's top speed, from which styled motion is rough.
ROUGH = 1.5


class Verdict:
    """Words for how a style was followed."""

    FOLLOWED, PARTLY, NOT = "followed", "followed in part", "NOT FOLLOWED"


@dataclass(frozen=True)
class StyleTarget:
    """Hands of a clip, those that are requested, and those of plain motion for the speech."""

    clip: HandStyle
    plain: HandStyle
    top_speed: float
    """Of the faster hand, m/s: the higher one of the clip's and the plain motion's."""
    requested: HandStyle | None = None
    """Hands of the clip with what other controls request in place of it; None for the clip's."""

    @property
    def goal(self) -> HandStyle:
        """The hands that motion is judged by."""
        return self.clip if self.requested is None else self.requested

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        found = {"clip": self.clip._asdict(), "plain": self.plain._asdict(), "top_speed": self.top_speed}
        return found if self.requested is None else {**found, "requested": self.requested._asdict()}

    def way(self, made: HandStyle) -> float:
        """Share of the way from plain motion to the goal that motion went, a projection in units of :data:`NEAR`."""
        aim, went = ((np.array(end) - np.array(self.plain)) / np.array(NEAR) for end in (self.goal, made))
        return float(aim @ went / max(float(aim @ aim), 1e-9))

    def verdict(self, made: HandStyle) -> str:
        """Followed: height, speed and radius are all near the goal's. In part: two of them are, or motion went at least
        half of the way, and no more than half as far again."""
        near = int(np.sum(np.abs(np.array(made) - np.array(self.goal)) <= np.array(NEAR)))
        if near == len(made):
            return Verdict.FOLLOWED
        return Verdict.PARTLY if near == 2 or PARTLY[0] <= self.way(made) <= PARTLY[1] else Verdict.NOT


@dataclass(frozen=True)
class StyleReport:
    """One styled sample."""

    way: float
    verdict: str
    hands: HandStyle
    agreement: float
    agreement_shifted: float
    """Of the same motion shifted against the speech."""
    top_speed: float
    """Of the faster hand, m/s."""
    rough: bool
    """Whether that is above 1.5 times the clip's own and the plain motion's."""

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return {**asdict(self), "hands": self.hands._asdict()}

    def describe(self, target: StyleTarget) -> str:
        """A line for the terminal."""
        rough = f", ROUGH: {self.top_speed:.1f} m/s" if self.rough else ""
        whose = "the clip's" if target.requested is None else "requested by the clip and --control"
        return (
            f"hands {_words(self.hands)}, {whose} {_words(target.goal)}: {self.way:.0%} of the way,"
            f" {self.verdict}{rough}; agreement with the speech {self.agreement:.2f} (shifted"
            f" {self.agreement_shifted:.2f})"
        )


def hands_of(motion: Motion) -> tuple[HandStyle, float] | None:
    """Height, speed and radius of a motion's hands, and the top speed of the faster one, m/s; None without wrists."""
    body = find_body_joints(motion.skeleton)
    if body is None or motion.frames < 2:
        return None
    wrists = [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"]
    places = local_places(motion)
    style = hand_style(places, motion.fps, (wrists[0], wrists[1]), body[BODY_JOINTS.index("Pelvis")])
    return style, float(hand_speeds(places, motion.skeleton, motion.fps).max())


def report_style(motion: Motion, audio: Float[np.ndarray, " N"], sample_rate: int, target: StyleTarget) -> StyleReport:
    """The report on a styled motion for a speech."""
    hands, top = hands_of(motion) or (HandStyle(0.0, 0.0, 0.0), 0.0)
    found = agreement_with_null(motion, audio, sample_rate)
    rough = top > ROUGH * target.top_speed
    return StyleReport(target.way(hands), target.verdict(hands), hands, found.value, found.null_mean, top, rough)


def _words(hands: HandStyle) -> str:
    return f"{100 * hands.height:+.0f} cm, {hands.speed:.2f} m/s, {100 * hands.radius:.0f} cm"
