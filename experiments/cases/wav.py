"""Cases of audio files."""

from pathlib import Path

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.features.mel import log_mel
from a2g_jax.generation.generator import Generator
from a2g_jax.geometry.retarget.poses import rotation_angle
from a2g_jax.inspection.inspect import inspect
from a2g_jax.io.audio import read_audio
from a2g_jax.training.run import open_run
from experiments.cases.runner import Case, Outcome, finds, reported

#: Degrees by which motion may differ.
_DEGREES = 0.2


def motion_difference(first: np.ndarray, second: np.ndarray, run_name: str = "demo", seed: int = 0) -> float:
    """Largest angle between the joints of the motions of two speeches with one seed, degrees."""
    run = open_run(run_name)
    motions = [Generator(run).generate(audio, 1, seed)[0] for audio in (first, second)]
    rotations = [np.asarray(motion.rotations, np.float64) for motion in motions]
    return float(rotation_angle(*rotations).max())


def _same_motion(path: Path) -> Outcome:
    reference, offset = read_audio(path.parent / "ref.wav"), read_audio(path)
    worst = {name: motion_difference(reference, offset, name) for name in ("demo", "demo-flow")}
    text = ", ".join(f"{value:.4f} degrees with {name}" for name, value in worst.items())
    return max(worst.values()) < _DEGREES, f"motion differs by at most {text}; {reported(inspect(path))}"


def _all_samples(path: Path) -> Outcome:
    audio, reference = read_audio(path), read_audio(path.parent / "ref.wav")
    right = len(audio) == 64000 and np.array_equal(audio, reference)
    return right, f"{len(audio) / 16000:.3f} s, {'as' if right else 'not as'} ref.wav; {reported(inspect(path))}"


def _unfinished(path: Path) -> Outcome:
    right, text = _all_samples(path)
    return right and "128000 bytes" in text and "ecord it again" not in text, text


def _channels(path: Path) -> Outcome:
    report = inspect(path)
    found = next((one for one in report.findings if one.code == "channels"), None)
    if found is None or "--channel left" not in found.fix:
        return False, reported(report)
    left, right = (read_audio(path, channel=number) for number in (1, 2))
    try:
        read_audio(path, channel=3)
    except InputError as error:
        refused = str(error)
    apart = float(np.abs(left - right).max())
    return apart > 0.1 and "2 channels" in refused, f"{reported(report)} Each can be read; they differ by {apart:.2f}"


def _sound(path: Path) -> Outcome:
    report = inspect(path)
    features = log_mel(read_audio(path), open_run("demo").config.mel, 30.0, 120)
    return report.warnings == 0 and len(report.findings) == 0, f"{reported(report)}; features of {len(features)} frames"


CASES: tuple[Case, ...] = (
    Case("wav/ref.wav", "nothing reported", _sound),
    Case("wav/dc_offset_0p02.wav", "the motion of ref.wav within 0.2 degrees", _same_motion),
    Case("wav/data_size_zero_recorder_crash.wav", "4.000 s, the 128000 bytes named", _unfinished),
    Case("wav/bw64.wav", "4.000 s", _all_samples),
    Case("wav/rf64.wav", "4.000 s", _all_samples),
    Case("wav/stereo_two_speakers.wav", "the channels differ, and one can be chosen", _channels),
    Case("wav/noise_only.wav", "no speech", finds("no-speech", words="no speech")),
    Case("wav/music_tone.wav", "no speech", finds("no-speech", words="no speech")),
    Case("wav/clipped_hot_float.wav", "beyond full scale", finds("full-scale", words="beyond full scale")),
)
