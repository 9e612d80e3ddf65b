"""Samples in the style of clips, and going on from clips, as the command line asks for them."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.audio2gestures.pins import face, read_on_skeleton
from a2g_jax.generation.style_arguments import MIX, MODE, SHARE
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.style import Style, blend
from a2g_jax.geometry.motion import Motion
from a2g_jax.geometry.pose_space import rotations_from_rows
from a2g_jax.io.audio import read_audio
from a2g_jax.training.run import Run

#: Shortest clip that a style is taken from, seconds: shorter ones hold a pose or two, and no style.
SHORTEST = 1.0


@dataclass(frozen=True)
class Clip:
    """A motion file, and maybe its speech."""

    flag: str
    """Which named it, for messages."""
    path: Path
    audio: Path | None = None


@dataclass(frozen=True)
class Styling:
    """What is asked for."""

    style: Clip | None = None
    second: Clip | None = None
    """Blended with the first."""
    seed_clip: Clip | None = None
    """Gone on from."""
    share: float = SHARE
    """Of style beside chance."""
    mode: str = MODE
    """See :mod:`a2g_jax.generation.stylized_flow.style`."""
    mix: float = MIX
    """Of the second clip."""

    @property
    def label(self) -> str:
        """For a page's heading."""
        words = []
        if self.style is not None:
            other = "" if self.second is None else f" and {self.second.path.name} ({self.mix:g})"
            words.append(f"style of {self.style.path.name}{other}, share {self.share:g}, {self.mode}")
        if self.seed_clip is not None:
            words.append(f"going on from {self.seed_clip.path.name}")
        return ", ".join(words)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know."""
        silent = [clip for clip in (self.style, self.second) if clip is not None and clip.audio is None]
        return tuple(f"{clip.path}: heard in silence, as no {clip.flag}-audio names its speech" for clip in silent)

    def place(self, run: Run, samples: int) -> "Styled":
        """The clips as a run sees them.

        Raises:
            InputError: a run of another model, a clip that cannot be used, or samples that would all be the same.
        """
        space = FlowSpace(run)
        if self.style is not None and self.share == 1.0 and self.mode == "repeat" and samples > 1:
            raise InputError(
                "--style-share 1: leaves nothing to chance, so that all samples would be the same; ask for --samples 1,"
                " a smaller share, or --style-mode statistics."
            )
        style = seed = None
        if self.style is not None:
            style = self._style(space, self.style)
            if self.second is not None:
                style = blend(style, self._style(space, self.second), self.mix)
        if self.seed_clip is not None:
            seed = read_facing(self.seed_clip, run)
            if seed.frames < space.history:
                raise InputError(
                    f"{self.seed_clip.flag} {self.seed_clip.path}: has {seed.frames} frames at the run's"
                    f" {seed.fps:g} fps; give a clip of {space.history} or more."
                )
        return Styled(space, style, seed)

    def _style(self, space: FlowSpace, clip: Clip) -> Style:
        motion = read_facing(clip, space.run)
        if motion.seconds < SHORTEST:
            raise InputError(
                f"{clip.flag} {clip.path}: lasts {motion.seconds:.2f} s; give a clip of {SHORTEST:g} s or more."
            )
        audio = None if clip.audio is None else read_audio(clip.audio, space.run.config.mel.sample_rate)
        return Style(space.encode(motion, audio, name=f"{clip.flag} {clip.path}"), self.mode, self.share)


@dataclass(frozen=True, eq=False)
class Styled:
    """Clips in the latent space, ready for samples."""

    space: FlowSpace
    style: Style | None
    seed_poses: Motion | None

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int) -> Iterator[Motion]:
        """Samples, one after another."""
        yield from self.space.stream(audio, samples, seed, self.style, self.seed_poses)


def read_facing(clip: Clip, run: Run) -> Motion:
    """A clip on the run's skeleton, at its rate, turned about the vertical to face as the run's motions do.

    Raises:
        InputError: a file that cannot be read, a rig that is not understood, or a run without a skeleton.
    """
    config = run.config
    motion = read_on_skeleton(clip.path, config.skeleton, config.fps)
    usual = rotations_from_rows(np.asarray(config.statistics["pose"].mean)[None], config.representation)
    return face(motion, np.asarray(usual[0, 0], np.float64))[0]


def styling_of(options: argparse.Namespace) -> Styling | None:
    """What the flags of :mod:`a2g_jax.generation.style_arguments` ask for; None if nothing.

    Raises:
        InputError: a flag that is for another one which is not there, or clips pinned as well.
    """
    if options.style is None:
        flags = ("style_audio", "style_share", "style_mode", "style_with", "style_with_audio", "style_mix")
        _refuse(options, flags, "--style; name a clip")
    if options.style_with is None:
        _refuse(options, ("style_with_audio", "style_mix"), "--style-with; name a second clip")
    if options.style is None and options.seed_clip is None:
        return None
    if options.pin:
        raise InputError("--pin is for runs of audio2gestures, --style and --seed-clip for those of stylized_flow.")
    return Styling(
        style=_clip("--style", options.style, options.style_audio),
        second=_clip("--style-with", options.style_with, options.style_with_audio),
        seed_clip=_clip("--seed-clip", options.seed_clip, None),
        share=SHARE if options.style_share is None else options.style_share,
        mode=options.style_mode or MODE,
        mix=MIX if options.style_mix is None else options.style_mix,
    )


def _refuse(options: argparse.Namespace, names: tuple[str, ...], what: str) -> None:
    for name in names:
        if getattr(options, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} is for {what}.")


def _clip(flag: str, path: str | None, audio: str | None) -> Clip | None:
    return None if path is None else Clip(flag, Path(path), None if audio is None else Path(audio))
