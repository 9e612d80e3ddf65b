"""The shipped weights: there, trained on generated data alone, and listening."""

from dataclasses import replace

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.controls import control_rows
from a2g_jax.generation.generator import Generator
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import read_bvh
from a2g_jax.metrics.rhythm import agreement_with_null, wrist_speed
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run


def test_demo_writes_motions_and_a_page(tmp_path, capsys):
    assert main(["demo", "--out", str(tmp_path / "demo"), "--samples", "3", "--order", "best"]) == 0
    printed = capsys.readouterr()
    assert "open" in printed.out
    assert "best first: sample " in printed.out
    assert "outside" not in printed.out + printed.err
    assert (tmp_path / "demo" / "index.html").stat().st_size > 100_000
    motions = [read_bvh(path) for path in sorted((tmp_path / "demo").glob("*.bvh"))]
    assert [motion.frames for motion in motions] == [600, 600, 600]
    assert np.abs(motions[0].positions() - motions[1].positions()).max() > 0.05


@pytest.mark.smoke
def test_two_seconds_of_speech():
    first, second = Generator(demo_run()).generate(talk(2.0, 5).audio, 2, seed=0)
    assert first.frames == 60
    assert np.isfinite(first.positions()).all()
    assert np.abs(first.rotations - second.rotations).max() > 1e-3


def test_no_recording_went_into_the_weights():
    run = demo_run()
    assert run.config.corpus["recipe"]["reader"] == "talker"
    assert run.steps > 0


def test_the_shipped_model_listens():
    """Strokes follow the speech, against the same motion shifted; the README has the figures."""
    generator = Generator(demo_run())
    take = talk(30.0, 987654, speaker="felix")
    motions = generator.generate(take.audio, 3, seed=1)
    scores = [agreement_with_null(motion, take.audio, 16000, lead=0.15) for motion in motions]
    assert np.mean([score.value for score in scores]) > np.mean([score.null_mean for score in scores]) + 0.03
    for motion in motions:
        assert 0.05 < wrist_speed(motion).mean() < 1.0


def test_hands_rise_on_request_and_not_without_one(tmp_path, capsys):
    speech, run = talk(9.0, 5).audio, demo_run()
    generator = Generator(run)

    def height(motion):
        wrists = [motion.skeleton.names.index(name) for name in ("L_Wrist", "R_Wrist")]
        places = motion.positions()
        return float(np.mean(places[:, wrists, 1] - places[:, :1, 1]))

    def heights(*lines):
        controls = control_rows(run, lines, generator.frames(speech))
        return [height(motion) for motion in generator.generate(speech, 3, seed=0, controls=controls)]

    assert np.mean(heights("height=0.9")) > np.mean(heights("height=0.1")) + 0.08
    plain = [height(motion) for motion in generator.generate(speech, 3, seed=0)]
    np.testing.assert_allclose(heights(), plain, atol=1e-5)
    # The command gives what Python gives.
    write_audio(tmp_path / "speech.wav", speech, 16000)
    flags = ["--out", str(tmp_path / "out"), "--samples", "1", "--formats", "bvh", "--control", "height=0.1@0,0.9@6"]
    assert main(["demo", "--audio", str(tmp_path / "speech.wav"), *flags]) == 0
    (path,) = (tmp_path / "out").glob("*.bvh")
    np.testing.assert_allclose(height(read_bvh(path)), heights("height=0.1@0,0.9@6")[0], atol=2e-3)
    assert main(["demo", "--control", "height=90", "--out", str(tmp_path / "out")]) == 2
    assert "give 0.9" in capsys.readouterr().err


def test_weights_without_properties_refuse_controls_and_name_the_remedy():
    run = demo_run()
    old = replace(run, summary={"specific_code": run.summary["specific_code"]})
    requested = replace(old, config=old.config.with_sampling(controls=("energy=0.9",)))
    with pytest.raises(InputError, match="a2g train audio2gestures --resume"):
        Generator(requested)
    with pytest.raises(InputError, match="--resume"):
        control_rows(old, ("energy=0.9",), 30)
    Generator(old)


@pytest.mark.parametrize("line", ["emotion=anger@60", "energy=0.2@0,0.9@1"])
def test_requests_past_the_end_of_the_speech_are_refused(line, tmp_path, capsys):
    """Otherwise their values would hold from the start, or never arrive."""
    run, second = demo_run(), np.random.default_rng(0).normal(0.0, 0.1, 16000).astype(np.float32)
    late = Generator(replace(run, config=run.config.with_sampling(controls=(line,))))
    for refuse in (late.check, lambda audio: late.generate(audio, 1), lambda _: control_rows(run, (line,), 30)):
        with pytest.raises(InputError, match="past the end of the speech, which lasts 1.00 s"):
            refuse(second)
    write_audio(tmp_path / "speech.wav", second, 16000)
    flags = ["--audio", str(tmp_path / "speech.wav"), "--control", line, "--out", str(tmp_path / "out")]
    for command in (["demo"], ["generate", "demo"]):
        assert main([*command, *flags]) == 2
        assert "past the end" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("controls", "named"),
    [
        (np.full((30, 6), 90.0), "energy holds values outside of 0 to 1"),
        (np.full((30, 5), 0.5), "expected a column for each of energy"),
        (np.full((30, 6), 0.5), "emotion holds other values than 0 to 7"),
    ],
)
def test_arrays_of_controls_are_checked(controls, named):
    with pytest.raises(InputError, match=named):
        Generator(demo_run()).generate(np.ones(16000, np.float32), 1, controls=controls.astype(np.float32))
