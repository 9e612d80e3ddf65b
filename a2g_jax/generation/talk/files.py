"""The files of ``a2g talk``: a generated recording and several motions that are right for it."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from typing import Any

import jax

from a2g_jax import __version__
from a2g_jax.generation.formats import PAGE, MotionFiles, check_page_size
from a2g_jax.generation.talk.page import write_talk_page
from a2g_jax.generation.talk.request import TalkRequest, truth_from_json
from a2g_jax.geometry.motion import Motion
from a2g_jax.io.audio import write_audio
from a2g_jax.io.files import check_folder_writable, write_json
from a2g_jax.io.textgrid import write_words
from a2g_jax.recording import Recording
from a2g_jax.talker.recordings import resample_motion
from a2g_jax.talker.speech import plan_from_json, plan_to_json
from a2g_jax.talker.styles import gesture_style
from a2g_jax.talker.transcript import speech_tiers
from a2g_jax.talker.truth import GestureTruth

_OTHERS = r"speech\.(wav|TextGrid|json)|truth_\d\d+\.json"


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
    """Write a generated recording with several right motions; files of an earlier run are replaced.

    - ``speech.wav``: 16 bits, at the recording's rate. ``speech.TextGrid``: words, syllables, phones and more.
    - ``speech.json``: ``plan`` (all that the audio determines, as :class:`~a2g_jax.talker.speech.SpeechPlan`),
      and the recipe.
    - ``motion_00.bvh``, ``motion_00.npz``, ...: motion 0 is the recording's own, the others are draws.
    - ``truth_00.json``, ...: ``key`` of the draw (null for the recording's own), ``style`` (as
      :class:`~a2g_jax.talker.styles.GestureStyle`) and ``gestures``: strokes, phases of both hands, units, rest
      pose, posture and log-probability (as :class:`~a2g_jax.talker.truth.GestureTruth`).
    - ``index.html``: a page that shows all of it.

    Args:
        recording: made by :func:`~a2g_jax.talker.recordings.talk`.
        out: folder, made if needed; files of other names in it stay.
        request: the seed of the draws, and the view.
        samples: how many motions.
        formats: of :func:`~a2g_jax.generation.formats.talk_formats`.
        report: called with the number of motions done.

    Returns:
        How many files of each format were written.

    Raises:
        InputError: a folder that cannot be used, or too large a page.
    """
    plan = plan_from_json(recording.annotations["speech"])
    check_folder_writable(out)
    if PAGE in formats:
        check_page_size(samples, recording.motion.frames, recording.motion.skeleton.joints)
    with MotionFiles(out, ("motion",), formats, _OTHERS) as files:
        if "wav" in formats:
            write_audio(files.folder / "speech.wav", recording.audio, recording.sample_rate)
        if "textgrid" in formats:
            write_words(files.folder / "speech.TextGrid", recording.words, plan.seconds, tiers=speech_tiers(plan))
        if "json" in formats:
            write_json(files.folder / "speech.json", {**_made(recording, request), "plan": plan_to_json(plan)})
        shown = []
        for number, (whole, truth) in enumerate(right_motions(recording, samples, request.seed)):
            motion = request.in_view(whole)
            files.write(number, motion)
            if "json" in formats:
                write_json(files.folder / f"truth_{number:02d}.json", _truth(recording, motion, truth, number, request))
            if PAGE in formats:
                shown.append((motion, truth))
            report(number + 1)
        if shown:
            write_talk_page(files.folder / "index.html", recording, shown)
    each = {"json": 1 + samples, "wav": 1, "textgrid": 1, PAGE: 1}
    return {kind: each.get(kind, samples) for kind in formats}


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
