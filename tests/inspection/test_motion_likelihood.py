"""Log-likelihood of motions by a flow: injected glitches rank lowest, and ``a2g inspect --score`` reports them."""

import json
from dataclasses import replace

import numpy as np
import pytest
from glitches_for_tests import GLITCHES

from a2g_jax.cli import main
from a2g_jax.data.corpus_writer import prepare_recording, write_corpus
from a2g_jax.data.settings import Features
from a2g_jax.errors import InputError
from a2g_jax.evaluation.likelihood import compiled_log_likelihood
from a2g_jax.features.mel import MelConfig, log_mel
from a2g_jax.geometry.motion import resample
from a2g_jax.geometry.pose_track import represent
from a2g_jax.inspection import likelihood as likelihood_module
from a2g_jax.inspection.likelihood import motion_likelihood
from a2g_jax.inspection.unlikely import acceleration_changes, unlikely_moments
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.models.stylized_flow.config import StylizedFlowConfig
from a2g_jax.models.train_config import TrainConfig
from a2g_jax.talker.recordings import talk
from a2g_jax.training.loop import train
from a2g_jax.training.run import RunConfig, load_run

MODEL = StylizedFlowConfig(
    flow_steps=4,
    hidden=16,
    layers=1,
    history_frames=3,
    lookahead_frames=2,
    clip_frames=28,
    frame_dropout=0.0,
    global_channels=0,
    reverse_share=0.0,
)
TRAINING = TrainConfig(
    steps=300,
    batch_size=16,
    learning_rate=3e-3,
    warmup_steps=20,
    clip_value=5.0,
    clip_norm=100.0,
    augmentation=0.0,
    checkpoint_every=1000,
    validate_every=1000,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A flow trained for a moment on a minute of one speaker."""
    out = tmp_path_factory.mktemp("scored")
    features = Features(fps=20.0, pose="exponential", mel=MelConfig(bands=4))
    rows = (prepare_recording(talk(12.0, seed, speaker="ada", name=f"take{seed}"), features) for seed in range(6))
    corpus = write_corpus(out / "corpus", rows, features=features, recipe={"reader": "talker"})
    config = RunConfig.of("stylized_flow", "tiny", MODEL, TRAINING, corpus)
    train(config, corpus, out / "run", resume=False, progress=False)
    return out / "run"


@pytest.fixture(scope="module")
def run(folder):
    return load_run(folder)


@pytest.fixture(scope="module")
def take():
    """A recording of the same speaker that is not in the corpus."""
    return talk(20.0, 77, speaker="ada", name="held")


@pytest.fixture(scope="module")
def motion(take):
    return resample(take.motion, 20.0)


@pytest.fixture
def files(take, tmp_path):
    """A motion with a flipped wrist at 7.5 s, on the corpus's rig at its own rate, and its speech."""
    wrong, _ = GLITCHES["flipped wrist"](take.motion, round(7.5 * take.motion.fps))
    write_bvh(tmp_path / "wrong.bvh", wrong)
    write_audio(tmp_path / "speech.wav", take.audio, take.sample_rate)
    return str(tmp_path / "wrong.bvh"), str(tmp_path / "speech.wav")


@pytest.mark.parametrize("frame", [90, 210])
@pytest.mark.parametrize("name", list(GLITCHES))
def test_injected_glitches_are_unlikely(run, take, motion, name, frame):
    wrong, where = GLITCHES[name](motion, frame)
    found = motion_likelihood(run, wrong, take.audio)
    values = found.log_likelihood
    percent = np.array([100 * np.mean(values < value) for value in values[where.start - 3 : where.stop - 3]])
    if name == "frozen":
        # Standing still for a moment is likely, the jump at its end is not; a model trained so briefly shows it weakly.
        assert percent[-1] == percent.min()
        assert percent[-1] < 25 < np.median(percent)
    else:
        assert percent.max() < 5
    if name in ("flipped wrist", "jitter"):
        first = found.moments[0]
        assert where.start <= first.frame < where.stop
        assert first.deviations > 2 * likelihood_module.WARN
        assert name == "jitter" or first.joints == ("L_Wrist",)


def test_a_clean_motion_has_no_warning_and_always_the_same_likelihood(run, take, motion):
    found = motion_likelihood(run, motion, take.audio)
    assert max(moment.deviations for moment in found.moments) < likelihood_module.WARN
    assert len(found.log_likelihood) == motion.frames - 3
    np.testing.assert_allclose(found.seconds[[0, -1]], [3 / 20, (motion.frames - 1) / 20])
    np.testing.assert_array_equal(motion_likelihood(run, motion, take.audio).log_likelihood, found.log_likelihood)


def test_windows_are_one_pass(run, take, motion, monkeypatch):
    monkeypatch.setattr(likelihood_module, "WINDOW", 64)
    found = motion_likelihood(run, motion, take.audio)
    config = run.config
    features = config.statistics["audio"].normalise(log_mel(take.audio, config.mel, config.fps, motion.frames + 2))
    pose = np.pad(represent(motion, "exponential", "")[0], ((0, 2), (0, 0), (0, 0)))
    whole = np.asarray(compiled_log_likelihood(run)(features[None].astype(np.float32), pose[None]))[0]
    first = 64 + MODEL.clip_frames
    np.testing.assert_allclose(found.log_likelihood[:first], whole[:first], rtol=1e-3, atol=1e-2)
    # Later, hidden states began within the motion instead of at its start.
    assert np.median(np.abs(found.log_likelihood - whole)) < 0.05 * np.std(whole)


def test_moments_are_half_a_second_apart_and_name_the_joint(motion):
    rotations = np.array(motion.rotations)
    rotations[100, 18] = rotations[100, 18] @ np.diag([1.0, -1.0, -1.0]).astype(np.float32)
    wrong = replace(motion, rotations=rotations)
    values = np.zeros(motion.frames - 3)
    values[[97, 98, 120]] = [-50.0, -40.0, -20.0]
    values += np.random.default_rng(0).normal(size=len(values))
    first, second, *others = unlikely_moments(values, 3, wrong)
    assert (first.frame, second.frame) == (100, 123)
    assert first.seconds == 5.0
    assert first.joints == (motion.skeleton.names[18],)
    # The MAD of a normal distribution, so that a deviation is one.
    np.testing.assert_allclose(first.deviations, 50, rtol=0.15)
    frames = sorted(moment.frame for moment in (first, second, *others))
    assert min(np.diff(frames)) >= 10
    assert acceleration_changes(motion)[:3].max() == 0


def test_another_facing_is_turned_back(run, take, motion):
    about = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]], np.float32)
    rotations = np.array(motion.rotations)
    rotations[:, 0] = about @ rotations[:, 0]
    plain, turned = (motion_likelihood(run, one, take.audio) for one in (motion, replace(motion, rotations=rotations)))
    assert plain.turned == 0.0
    np.testing.assert_allclose(abs(turned.turned), 90, atol=20)
    assert np.median(turned.log_likelihood) > np.median(plain.log_likelihood) - 20


def test_the_command_line_reports_the_moment(folder, files, tmp_path, capsys):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "score.png"
    arguments = ["inspect", str(folder), "--score", files[0], "--audio", files[1]]
    assert main([*arguments, "--strict", "--picture", str(picture)]) == 1
    text = capsys.readouterr().out
    assert "bits per dimension" in text
    assert "joint L_Wrist, frame 150, 7.50 s" in text
    assert "curve" not in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main([*arguments, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["kind"] == "likelihood"
    assert document["findings"][0]["place"]["frame"] == 150
    curve = document["facts"]["curve"]
    at = int(np.argmin(curve["log_likelihood"]))
    assert curve["seconds"][at] == 7.5
    assert len(curve["seconds"]) == document["facts"]["likelihood"]["frames"] == 397


def test_bad_requests_get_one_line(folder, files, take, motion, run, tmp_path, toy_run_config, capsys):
    def refused(*arguments):
        assert main(["inspect", *arguments]) == 2
        return capsys.readouterr().err

    bvh, wav = files
    assert "--audio" in refused(str(folder), "--score", bvh)
    assert "--score" in refused(str(folder), "--picture", "x.png")
    assert ".png" in refused(str(folder), "--score", bvh, "--audio", wav, "--picture", "x.pdf")
    assert "is not a run" in refused(str(tmp_path), "--score", bvh, "--audio", wav)
    short = str(tmp_path / "short.wav")
    write_audio(tmp_path / "short.wav", take.audio[: 5 * take.sample_rate], take.sample_rate)
    assert "lasts 20.00 s, but its speech only 5.00 s" in refused(str(folder), "--score", bvh, "--audio", short)
    with pytest.raises(InputError, match="more than the 3"):
        motion_likelihood(run, motion.clip(0, 3), take.audio)
    other = toy_run_config()
    with pytest.raises(InputError, match="has no likelihood"):
        compiled_log_likelihood(replace(run, config=other))
