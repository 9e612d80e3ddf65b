"""The files of ``a2g talk``: a generated recording and several motions that are right for it."""

import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from typing import Any

import jax

from a2g_jax import __version__
from a2g_jax.data.recording import Recording
from a2g_jax.errors import InputError
from a2g_jax.generation.talk.request import TalkRequest, truth_from_json
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.files import make_folder, write_json
from a2g_jax.io.npz import write_motion_npz
from a2g_jax.io.textgrid import write_words
from a2g_jax.talker.recordings import plan_from_json, resample_motion
from a2g_jax.talker.styles import gesture_style
from a2g_jax.talker.transcript import speech_tiers
from a2g_jax.talker.truth import GestureTruth

#: Most joint positions that a page may hold: about 200 MB of HTML.
_PAGE_LIMIT = 20_000_000
_OWN = r"speech\.(wav|TextGrid|json)|motion_\d\d+\.(bvh|npz)|truth_\d\d+\.json|index\.html"


def right_motions(recording: Recording, samples: int, seed: int) -> Iterator[tuple[Motion, GestureTruth]]:
    """``samples`` motions that are right for a recording, with their truth: its own, then draws.

    Motion ``k`` is ``resample_motion(recording, jax.random.fold_in(jax.random.key(seed), k))``.
    """
    yield recording.motion, truth_from_json(recording.annotations["gestures"])
    for number in range(1, samples):
        yield resample_motion(recording, jax.random.fold_in(jax.random.key(seed), number))


def deliver_talk(
    recording: Recording,
    out: str | os.PathLike[str],
    *,
    request: TalkRequest,
    samples: int,
    formats: Sequence[str],
    report: Callable[[int], None] = lambda done: None,
) -> dict[str, int]:
    """Write a generated recording with several right motions; what an earlier run left is replaced.

    - ``speech.wav``: 16 bits, at the recording's rate. ``speech.TextGrid``: words, syllables, phones and more.
    - ``speech.json``: ``plan`` (all that the audio determines, as :class:`~a2g_jax.talker.speech.SpeechPlan`),
      and how it was made.
    - ``motion_00.bvh``, ``motion_00.npz``, ...: motion 0 is the recording's own, the others are draws.
    - ``truth_00.json``, ...: ``key`` of the draw (null for the recording's own), ``style`` (as
      :class:`~a2g_jax.talker.styles.GestureStyle`) and ``gestures``: strokes, phases of both hands, units, rest
      pose, posture and log-probability (as :class:`~a2g_jax.talker.truth.GestureTruth`).
    - ``index.html``: a page that shows all of it.

    Args:
        recording: made by :func:`~a2g_jax.talker.recordings.talk`.
        out: folder, made if needed; files of other names in it stay.
        request: what was asked for: the seed of the draws, and the view.
        samples: how many motions.
        formats: any of :data:`a2g_jax.generation.formats.TALK_FORMATS`.
        report: called with the number of motions done.

    Returns:
        How many files of each format were written.

    Raises:
        InputError: a folder that cannot be used, or too large a page.
    """
    from a2g_jax.generation.talk.page import write_talk_page

    plan = plan_from_json(recording.annotations["speech"])
    if "html" in formats and samples * recording.motion.frames * recording.motion.skeleton.joints > _PAGE_LIMIT:
        raise InputError(
            f"a page of {samples} motions of {recording.motion.frames} frames would be too large for a browser;"
            " ask for fewer --samples or --seconds, or leave html out of --formats."
        )
    out = make_folder(out)
    for old in out.iterdir():
        if re.fullmatch(_OWN, old.name) and not old.is_dir():
            old.unlink()
    if "wav" in formats:
        write_audio(out / "speech.wav", recording.audio, recording.sample_rate)
    if "textgrid" in formats:
        write_words(out / "speech.TextGrid", recording.words, plan.seconds, tiers=speech_tiers(plan))
    if "json" in formats:
        write_json(out / "speech.json", {**_made(recording, request), "plan": asdict(plan)})
    shown = []
    for number, (body, truth) in enumerate(right_motions(recording, samples, request.seed)):
        motion = request.seen(body)
        if "bvh" in formats:
            write_bvh(out / f"motion_{number:02d}.bvh", motion)
        if "npz" in formats:
            write_motion_npz(out / f"motion_{number:02d}.npz", motion)
        if "json" in formats:
            write_json(out / f"truth_{number:02d}.json", _truth(recording, motion, truth, number, request))
        if "html" in formats:
            shown.append((motion, truth))
        report(number + 1)
    if shown:
        write_talk_page(out / "index.html", recording, shown)
    each = {"json": 1 + samples, "bvh": samples, "npz": samples}
    return {kind: each.get(kind, 1) for kind in formats}


def _made(recording: Recording, request: TalkRequest) -> dict[str, Any]:
    return {
        "format": "a2g_jax talk",
        "package": __version__,
        "recording": recording.name,
        "speaker": recording.speaker,
        "emotion": recording.emotion,
        "sample_rate": recording.sample_rate,
        "room": request.room,
    }


def _truth(
    recording: Recording, motion: Motion, truth: GestureTruth, number: int, request: TalkRequest
) -> dict[str, Any]:
    return {
        "format": "a2g_jax talk",
        "motion": f"motion_{number:02d}",
        # Of resample_motion: jax.random.fold_in(jax.random.key(seed), fold).
        "key": {"seed": request.seed, "fold": number} if number else None,
        "view": request.view,
        "fps": motion.fps,
        "frames": motion.frames,
        "style": asdict(gesture_style(recording.speaker, recording.emotion)),
        "gestures": asdict(truth),
    }
