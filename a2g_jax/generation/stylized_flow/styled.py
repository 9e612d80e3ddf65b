"""Samples in the style or with the seed poses of clips from files."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.errors import InputError
from a2g_jax.generation.clips import read_motion, without_calibration
from a2g_jax.generation.drafts import Draft, enter, recorded
from a2g_jax.generation.generator import plant_rotations, speech_features
from a2g_jax.generation.seed_bounds import REMEDY, seed_stretches
from a2g_jax.generation.stylized_flow.fit import Fitted, fit
from a2g_jax.generation.stylized_flow.latent_space import FlowSpace
from a2g_jax.generation.stylized_flow.report import StyleReport, StyleTarget, hands_of, report_style
from a2g_jax.generation.stylized_flow.style import Style, blend
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import read_audio
from a2g_jax.metrics.body.check import Stretch
from a2g_jax.metrics.style import HandStyle
from a2g_jax.training.run import Run

#: Seconds of a seed clip before its seed poses that are looked at.
_BEFORE_SEED = 1.0

#: Height, speed and radius of the hands, and the top speed of the faster one.
Hands = tuple[HandStyle, float]


@dataclass(frozen=True)
class Clip:
    """A motion file, optionally with its speech."""

    flag: str
    """The option that named it, for messages."""
    path: Path
    audio: Path | None = None

    @property
    def label(self) -> str:
        """Option and file, for messages."""
        return f"{self.flag} {self.path}"


@dataclass(frozen=True)
class Styling:
    """Options of styled generation."""

    style: Clip | None = None
    second: Clip | None = None
    """Blended with the first."""
    seed_clip: Clip | None = None
    """Motion whose last poses are the seed poses of the samples."""
    share: float = 0.9
    """Share of the style; the rest is drawn."""
    mode: str = "repeat"
    """See :mod:`a2g_jax.generation.stylized_flow.style`."""
    mix: float = 0.5
    """Share of the second clip in the blend."""

    @property
    def label(self) -> str:
        """Description for a page's heading."""
        words = []
        if self.style is not None:
            other = "" if self.second is None else f" and {self.second.path.name} ({self.mix:g})"
            words.append(f"style of {self.style.path.name}{other}, share {self.share:g}, {self.mode}")
        if self.seed_clip is not None:
            words.append(f"continuing {self.seed_clip.path.name}")
        return ", ".join(words)

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings for the user."""
        silent = [clip for clip in (self.style, self.second) if clip is not None and clip.audio is None]
        return tuple(f"{clip.path}: encoded with silence; give its speech with {clip.flag}-audio" for clip in silent)

    def place(self, run: Run) -> "Styled":
        """The clips, encoded with a run.

        Raises:
            InputError: a run of another model, or a clip that cannot be used.
        """
        space = FlowSpace(run)
        style = seed = target = None
        clips: dict[str, Fitted] = {}
        if self.style is not None:
            style, clips[self.style.label] = self._style(space, self.style)
            hands = hands_of(clips[self.style.label].motion)
            if self.second is not None:
                other, clips[self.second.label] = self._style(space, self.second)
                style = blend(style, other, self.mix)
                hands = _between(hands, hands_of(clips[self.second.label].motion), self.mix)
            target = hands if style.share > 0 else None
        if self.seed_clip is not None:
            seed = clips[self.seed_clip.label] = self._seed(space)
        return Styled(space, style, seed, target, clips)

    def _style(self, space: FlowSpace, clip: Clip) -> tuple[Style, Fitted]:
        fitted = fit(read_motion(clip.path), space.run, clip.label)
        audio = None if clip.audio is None else read_audio(clip.audio, space.run.config.mel.sample_rate)
        return space.fitted_style(fitted, audio, self.mode, self.share, name=clip.label)

    def _seed(self, space: FlowSpace) -> Fitted:
        assert self.seed_clip is not None
        motion, notes = without_calibration(read_motion(self.seed_clip.path))
        fps = space.run.config.fps
        self._check_seed(round(motion.seconds * fps), space)
        # Only its end is continued, and faults before it do not matter.
        needed = round((space.history / fps + _BEFORE_SEED) * motion.fps)
        end = motion.clip(max(0, motion.frames - needed), motion.frames)
        fitted = fit(end, space.run, self.seed_clip.label, whole=False)
        # With no frame beyond its last one, it may be shorter than the file.
        self._check_seed(len(fitted.rows), space)
        return replace(fitted, notes=(*notes, *fitted.notes))

    def _check_seed(self, frames: int, space: FlowSpace) -> None:
        assert self.seed_clip is not None
        if frames < space.history:
            raise InputError(
                f"{self.seed_clip.label}: has {frames} frames at the run's {space.run.config.fps:g} fps; give a clip of"
                f" {space.history} or more."
            )


@dataclass(frozen=True, eq=False)
class Styled:
    """A sampler with a style and seed poses."""

    space: FlowSpace
    style: Style | None
    seed_poses: Fitted | None
    target: Hands | None = None
    """Hands of the clip of the style; None without a style, or where wrists are not found."""
    clips: dict[str, Fitted] = field(default_factory=dict)
    """The clips by the option and file that named them."""
    reports: list[StyleReport | None] = field(default_factory=list)
    """Report on each sample of :meth:`stream` so far; None without a style."""
    _matched: list[tuple[bytes, Style, StyleTarget | None]] = field(default_factory=list)
    """The last speech, its style with requests, and the target of reports."""

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """Bounds of the beginning of motions that continue a clip."""
        if self.seed_poses is None:
            return ()
        run = self.space.run
        return seed_stretches(run, plant_rotations(run, np.asarray(self.seed_poses.motion.rotations)))

    @property
    def remedy(self) -> str:
        """What changes the first frame of motions that continue a clip."""
        return "" if self.seed_poses is None else REMEDY

    def stream(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Motion]:
        """Yield samples one after another."""
        return recorded(self.drafts(audio, samples, seed))

    def drafts(self, audio: Float[np.ndarray, " N"], samples: int, seed: int = 0) -> Iterator[Draft]:
        """The motions of :meth:`stream`, which add to the reports when they are recorded."""
        style, target = (None, None) if self.style is None else self._for_speech(self.style, audio)
        for motion in self.space.stream(audio, samples, seed, style, self.seed_poses):
            yield Draft(motion, partial(self._record, audio, target))

    def _record(self, audio: Float[np.ndarray, " N"], target: StyleTarget | None, sample: int, motion: Motion) -> None:
        rate = self.space.run.config.mel.sample_rate
        enter(self.reports, sample, None if target is None else report_style(motion, audio, rate, target))

    def _for_speech(self, style: Style, audio: Float[np.ndarray, " N"]) -> tuple[Style, StyleTarget | None]:
        """The style with requests for a speech, found once for all samples and draws, and the target of reports."""
        key = np.ascontiguousarray(audio).tobytes()
        if self._matched and self._matched[0][0] == key:
            return self._matched[0][1:]
        features = speech_features(self.space.run, audio)
        plain, target = self.space.plain(features), None
        if self.target is not None:
            config = self.space.run.config
            without = [hands_of(config.space.motion(rows, config.fps)) for rows in plain]
            found = [hands for hands in without if hands is not None]
            if found:
                hands = HandStyle(*np.mean([style for style, _ in found], axis=0).tolist())
                requested = self.space.requested_hands(self.target[0], len(features))
                controlled = None if requested == self.target[0] else requested
                target = StyleTarget(self.target[0], hands, max(self.target[1], *(top for _, top in found)), controlled)
        self._matched[:] = [(key, self.space.match(style, features, plain), target)]
        return self._matched[0][1:]

    def to_json(self) -> dict[str, Any]:
        """Clips and samples as JSON values."""
        target = self._matched[0][2] if self._matched else None
        return {
            "format": "a2g_jax style",
            "clips": {name: clip.as_json() for name, clip in self.clips.items()},
            "target": None if target is None else target.to_json(),
            "samples": [None if one is None else one.to_json() for one in self.reports],
        }

    def lines(self) -> list[str]:
        """The same for the terminal."""
        found = []
        for name, clip in self.clips.items():
            found += [f"{name}: {note}" for note in clip.notes]
            if changes := clip.adapted.describe():
                found.append(f"{name}: adapted to the training motion: {changes}")
        target = self._matched[0][2] if self._matched else None
        for number, one in enumerate(self.reports):
            if one is not None and target is not None:
                found.append(f"sample {number}: {one.describe(target)}")
        return found


def _between(first: Hands | None, second: Hands | None, share: float) -> Hands | None:
    if first is None or second is None:
        return None
    mixed = (1.0 - share) * np.array(first[0]) + share * np.array(second[0])
    return HandStyle(*mixed.tolist()), max(first[1], second[1])
