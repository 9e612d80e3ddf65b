"""Plots of motion for notebooks and pictures; needs Matplotlib."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.geometry.body_joints import find_body_joints
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.skeleton import BODY_JOINTS

#: The first is for the reference of a comparison.
COLOURS = ("#9aa5b4", "#2f6fde", "#d9822b", "#2a9d63")


def film_strip(axes: Any, motions: Sequence[Motion], moments: int = 8, colours: Sequence[Any] = COLOURS) -> None:
    """Draw stick figures from the front at evenly spaced moments, the motions over each other.

    Args:
        axes: Matplotlib axes.
        motions: motions of the same length; the first is drawn pale.
        moments: number of moments.
        colours: of the motions, in turn.
    """
    frames = min(motion.frames for motion in motions)
    for number, motion in enumerate(motions):
        positions = motion.positions()
        positions = positions - positions[:, :1]
        colour = colours[number % len(colours)]
        for moment, frame in enumerate(np.linspace(0, frames - 1, moments).round().astype(int)):
            x, y = positions[frame, :, 0] + 1.1 * moment, positions[frame, :, 1]
            for joint, parent in enumerate(motion.skeleton.parents):
                if parent >= 0:
                    axes.plot(
                        x[[parent, joint]], y[[parent, joint]], color=colour, linewidth=2.2, solid_capstyle="round"
                    )
    fps = motions[0].fps
    ticks = np.linspace(0, frames - 1, moments) / fps
    axes.set_xticks(1.1 * np.arange(moments), [f"{tick:.1f} s" for tick in ticks])
    axes.set_yticks([])
    axes.set_aspect("equal")
    axes.spines[:].set_visible(False)


def wrist_heights(motion: Motion) -> Float[np.ndarray, "T 2"]:
    """Heights of the left and the right wrist above the pelvis, metres.

    Raises:
        ValueError: a rig without wrists.
    """
    body = find_body_joints(motion.skeleton)
    if body is None:
        raise ValueError("expected a body with two wrists")
    positions = motion.positions()
    wrists = [body[BODY_JOINTS.index(f"{side}_Wrist")] for side in "LR"]
    heights: Float[np.ndarray, "T 2"] = positions[:, wrists, 1] - positions[:, [0, 0], 1]
    return heights


def compare_wrists(axes: Sequence[Any], motions: Sequence[Motion], labels: Sequence[str]) -> None:
    """Draw the heights of both wrists over time, the left in the first axes, the right in the second."""
    for number, (motion, label) in enumerate(zip(motions, labels, strict=True)):
        heights = wrist_heights(motion)
        seconds = np.arange(motion.frames) / motion.fps
        for side, panel in enumerate(axes):
            panel.plot(seconds, 100 * heights[:, side], color=COLOURS[number % len(COLOURS)], label=label)
    for name, panel in zip(("left", "right"), axes, strict=True):
        panel.set_ylabel(f"{name} wrist, cm")
        panel.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("seconds")
    axes[0].legend(frameon=False, ncols=len(motions), loc="lower right", bbox_to_anchor=(1.0, 1.0))


def band_spectra(
    axes: Any, spectra: Sequence[Float[np.ndarray, "points C"]], labels: Sequence[str], fps: float
) -> None:
    """Draw the root mean square over channels of each DCT band over its frequency."""
    for number, (bands, label) in enumerate(zip(spectra, labels, strict=True)):
        points = len(bands)
        hertz = np.arange(points) * fps / (2 * points)
        level = np.sqrt(np.mean(np.square(bands), axis=1))
        axes.semilogy(hertz, np.maximum(level, 1e-4), color=COLOURS[number % len(COLOURS)], label=label)
    axes.set_xlabel("Hz")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
