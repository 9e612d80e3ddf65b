"""Flags of ``a2g generate`` that name clips: pinned to the timeline, as a style, or as seed poses."""

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from a2g_jax.cli.argument_types import number, share
from a2g_jax.cli.paths import existing_corpus, existing_file
from a2g_jax.cli.speech import warn_of_speech
from a2g_jax.errors import InputError
from a2g_jax.generation.pins.form import parse_pin

if TYPE_CHECKING:
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.generation.audio2gestures.pinned import Pinned
    from a2g_jax.generation.generator import Sampler
    from a2g_jax.generation.pins.pinned import PinnedClips
    from a2g_jax.generation.stylized_flow.styled import Clip
    from a2g_jax.training.run import Run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the flags of pins and styles; their defaults are those of ``ClipPins``, ``Pins`` and ``Styling``."""
    pin = parser.add_argument_group("clips on the timeline")
    pin.add_argument(
        "--pin",
        action="append",
        metavar="FILE@SECOND[+LENGTH]",
        help="a BVH or NPZ to perform from that second on (its first LENGTH seconds); may be repeated",
    )
    pin.add_argument(
        "--pin-mode",
        choices=("clip", "latent"),
        help="perform the clip itself (default), or decode it from its code, which only runs of audio2gestures have",
    )
    pin.add_argument(
        "--pin-blend",
        type=number(float, 0, 10, "a number from 0 to 10"),
        metavar="SECONDS",
        help="length of the transitions before and after each (default: as short as speed and jerk of the hands allow;"
        " 0.75 with --pin-mode latent)",
    )
    pin.add_argument(
        "--pin-shared",
        type=share,
        metavar="SHARE",
        help="with --pin-mode latent: weight of the clip's own shared code against the audio's (default: 1; 0 as in the"
        " paper)",
    )
    pin.add_argument(
        "--pin-corpus",
        metavar="CORPUS",
        help="corpus whose 99th percentile of jerk is compared with the seams' (default: that of the clips and the"
        " unpinned sample)",
    )
    style = parser.add_argument_group("the style of a clip (runs of stylized_flow)")
    style.add_argument("--style", metavar="CLIP", help="a BVH or NPZ whose style the motions take on")
    style.add_argument("--style-audio", metavar="FILE", help="the clip's own speech (default: silence)")
    style.add_argument(
        "--style-share", type=share, metavar="SHARE", help="weight of the style against the random draw (default: 0.9)"
    )
    style.add_argument(
        "--style-mode",
        choices=("repeat", "statistics"),
        help="the clip's latents forwards and backwards, or only their mean and standard deviation (default: repeat)",
    )
    style.add_argument("--style-with", metavar="CLIP", help="a second clip, to blend the style with")
    style.add_argument("--style-with-audio", metavar="FILE", help="its speech (default: silence)")
    style.add_argument("--style-mix", type=share, metavar="SHARE", help="weight of the second clip (default: 0.5)")
    seed = parser.add_argument_group("continuing a clip (runs of stylized_flow and emotion_gesture)")
    seed.add_argument(
        "--seed-clip", metavar="CLIP", help="a BVH or NPZ whose last poses are the seed poses of the motions"
    )


def check_flags(options: argparse.Namespace, settings: Sequence[str] = ()) -> None:
    """Refuse flags that belong to a flag that is not there, and pins together with styles.

    Args:
        settings: flags of sampling settings, such as ``["--style-gain", "1.2"]``.

    Raises:
        InputError: such a flag.
    """
    if not options.pin:
        _refuse(options, ("pin_mode", "pin_blend", "pin_shared", "pin_corpus"), "--pin; name a clip and a second")
    if options.pin_mode != "latent":
        _refuse(options, ("pin_shared",), "--pin-mode latent")
    if options.style is None:
        names = ("style_audio", "style_share", "style_mode", "style_with", "style_with_audio", "style_mix")
        _refuse(options, names, "--style; name a clip")
        if of_styles := [flag.partition("=")[0] for flag in settings if flag.startswith("--style-")]:
            raise InputError(f"{of_styles[0]} is for --style; name a clip.")
    if options.style_with is None:
        _refuse(options, ("style_with_audio", "style_mix"), "--style-with; name a second clip")
    if options.pin_mode == "latent" and (options.style is not None or options.seed_clip is not None):
        raise InputError("--pin-mode latent is for runs of audio2gestures, --style and --seed-clip for others.")


def check_files(options: argparse.Namespace) -> None:
    """Refuse clips, speeches and corpora that do not exist.

    Raises:
        InputError: there is no such file or corpus, or a pin has another form.
    """
    for text in options.pin or ():
        existing_file(str(parse_pin(text)[0]))
    existing_corpus(options.pin_corpus)
    for name in ("style", "style_audio", "style_with", "style_with_audio", "seed_clip"):
        existing_file(getattr(options, name))


@dataclass(frozen=True)
class Chosen:
    """A sampler, and its contribution to the output."""

    sampler: "Sampler"
    about: dict[str, Any] = field(default_factory=dict)
    """Further arguments of :func:`~a2g_jax.generation.export.export`."""
    report: Callable[[Path], Iterable[str]] = lambda out: ()
    """Writes its files to the output folder, and gives the lines to print."""


def sampler_of(run: "Run", audio: Any, options: argparse.Namespace) -> Chosen:
    """The sampler of the flags: plain, pinned, styled or continuing a clip.

    Args:
        audio: (N,), mono, at the run's sample rate.

    Raises:
        InputError: a run or clip that cannot be used for it, or a request past the end of the audio.
    """
    from a2g_jax.generation.generator import audio_frames
    from a2g_jax.models.control_curves import check_ends

    lines = getattr(run.config.sampling_settings, "controls", ())
    check_ends(lines, audio_frames(run, audio), run.config.fps)
    if options.pin_mode == "latent":
        pinned = _in_codes(run, audio, options)
        return _pinned(pinned, Chosen(pinned))
    chosen = _unpinned(run, audio, options)
    return _pinned(_performed(run, audio, options, chosen.sampler), chosen) if options.pin else chosen


def _unpinned(run: "Run", audio: Any, options: argparse.Namespace) -> Chosen:
    # Models that encode clips also adapt those that motion continues.
    encodes = run.config.build().encode is not None
    if options.style is not None or (options.seed_clip is not None and encodes):
        return _styled(run, options)
    if options.seed_clip is not None:
        return _seeded(run, audio, Path(options.seed_clip))

    from a2g_jax.generation.generator import Generator

    generator = Generator(run)
    generator.check(audio)
    return Chosen(generator)


def _performed(run: "Run", audio: Any, options: argparse.Namespace, sampler: "Sampler") -> "PinnedClips":
    from a2g_jax.generation.generator import audio_frames
    from a2g_jax.generation.pins.pinned import ClipPins

    pins = ClipPins(tuple(options.pin), options.pin_blend, _pin_corpus(options))
    return pins.place(run, sampler, audio_frames(run, audio))


def _in_codes(run: "Run", audio: Any, options: argparse.Namespace) -> "Pinned":
    from a2g_jax.generation.audio2gestures.pinned import Pins
    from a2g_jax.generation.generator import audio_frames

    values = _given({"blend": options.pin_blend, "shared": options.pin_shared})
    return Pins(tuple(options.pin), corpus=_pin_corpus(options), **values).place(run, audio_frames(run, audio))


def _pin_corpus(options: argparse.Namespace) -> "Corpus | None":
    from a2g_jax.data.corpus import Corpus
    from a2g_jax.data.corpus_integrity import verify_corpus

    if options.pin_corpus is None:
        return None
    corpus = Corpus.open(options.pin_corpus)
    verify_corpus(corpus)
    return corpus


def _pinned(pinned: "PinnedClips | Pinned", below: Chosen) -> Chosen:
    """A sampler with pins, whose samples are those of another."""
    from a2g_jax.generation.pins.report import describe
    from a2g_jax.io.files import write_json

    def report(out: Path) -> list[str]:
        write_json(out / "pins.json", pinned.reports)
        lines = [f"sample {number}, {describe(row)}" for number, rows in enumerate(pinned.reports) for row in rows]
        return [*below.report(out), *lines]

    return Chosen(pinned, {**below.about, "lanes": (pinned.lane(),)}, report)


def _seeded(run: "Run", audio: Any, path: Path) -> Chosen:
    from a2g_jax.generation.seeded import continue_clip

    seeded = continue_clip(run, path)
    seeded.generator.check(audio)
    lines = [f"--seed-clip {path}: {note}" for note in seeded.notes]
    return Chosen(seeded, {"label": f"continuing {path.name}"}, lambda out: lines)


def _styled(run: "Run", options: argparse.Namespace) -> Chosen:
    from a2g_jax.generation.stylized_flow.styled import Styling
    from a2g_jax.io.files import write_json

    values = {"share": options.style_share, "mode": options.style_mode, "mix": options.style_mix}
    styling = Styling(
        style=_clip("--style", options.style, options.style_audio),
        second=_clip("--style-with", options.style_with, options.style_with_audio),
        seed_clip=_clip("--seed-clip", options.seed_clip, None),
        **_given(values),
    )
    styled = styling.place(run)

    def report(out: Path) -> list[str]:
        write_json(out / "style.json", styled.to_json())
        return [*styling.notes, *styled.lines()]

    return Chosen(styled, {"label": styling.label}, report)


def _clip(flag: str, path: str | None, audio: str | None) -> "Clip | None":
    from a2g_jax.generation.stylized_flow.styled import Clip

    if audio is not None:
        warn_of_speech(audio)
    return None if path is None else Clip(flag, Path(path), None if audio is None else Path(audio))


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


def _refuse(options: argparse.Namespace, names: tuple[str, ...], what: str) -> None:
    for name in names:
        if getattr(options, name) is not None:
            raise InputError(f"--{name.replace('_', '-')} is for {what}.")
