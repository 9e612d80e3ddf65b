"""Bounds of the beginning of a motion that continues a clip: those of the clip itself, where they are higher."""

from a2g_jax.geometry.motion import Motion
from a2g_jax.metrics.body.check import Stretch
from a2g_jax.training.run import Run

#: Seconds in which the posture of a clip passes into that of the motion.
PASSAGE = 1.5
#: What a user can change about the first frame, which another seed does not.
REMEDY = "give another --seed-clip, or one that ends in another pose"


def seed_stretches(run: Run, clip: Motion) -> tuple[Stretch, ...]:
    """Stretches of a motion that continues a clip. The first frame follows from the clip and stays as it is; until the
    clip's posture has passed, its own extremes are allowed.

    Args:
        clip: its end, with the poses that are continued, on the run's skeleton and feet.
    """
    bounds = run.config.body_bounds.loosened(clip, "the seed clip")
    return Stretch(0, 1, bounds), Stretch(1, round(PASSAGE * clip.fps), bounds, fixed=False)
