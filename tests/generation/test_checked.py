"""Bad samples are drawn again, then reported; good ones stay bit for bit."""

import json
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.generation.checked import REDRAWS, Checked, redrawn_seed
from a2g_jax.generation.drafts import Draft, enter, recorded
from a2g_jax.generation.export import export
from a2g_jax.generation.pins.pinned import PinnedClips
from a2g_jax.generation.pins.request import pin_of
from a2g_jax.io.audio import write_audio
from a2g_jax.metrics.body.check import Stretch, check_motion
from a2g_jax.talker.recordings import talk
from a2g_jax.training.body_extremes import corpus_extremes
from a2g_jax.training.run import Run, demo_run, load_run, save_run

SPEECH = talk(6.0, 21).audio
SOUND = talk(6.0, 21).motion


@pytest.fixture(scope="module")
def run(toy_run_config, toy_corpus):
    """A run without weights: the samplers here draw by themselves."""
    return Run(replace(toy_run_config(), body_extremes=corpus_extremes(toy_corpus, toy_run_config())), {}, {}, 0)


def broken(motion, frame=60, joint="L_Knee"):
    rotations = np.array(motion.rotations)
    rotations[frame, motion.skeleton.names.index(joint)] = np.diag([-1.0, 1.0, -1.0])
    return replace(motion, rotations=rotations)


@dataclass
class Scripted:
    """A sampler whose draws are bad where ``bad`` returns true; each has its seed and sample in the root's place."""

    bad: object
    """Whether the draw of a seed and a sample is bad."""
    drawn: list = field(default_factory=list)
    reports: list = field(default_factory=list)
    kept: list = field(default_factory=list)
    ignores_seed: bool = False

    def stream(self, audio, samples, seed=0):
        return recorded(self.drafts(audio, samples, seed))

    def drafts(self, audio, samples, seed=0):
        for sample in range(samples):
            self.drawn.append((seed, sample))
            mark = 0 if self.ignores_seed else 1e-4 * (seed % 100) + 1e-6 * sample
            motion = replace(SOUND, root=SOUND.root + np.float32(mark))
            record = lambda number, kept, about=(seed, sample): self._record(number, kept, about)  # noqa: E731
            yield Draft(broken(motion) if self.bad(seed, sample) else motion, record)

    def _record(self, number, kept, about):
        enter(self.reports, number, about)
        enter(self.kept, number, kept)


def test_good_samples_stay_as_they_are(run):
    sampler = Scripted(lambda seed, sample: False)
    checked = Checked(run, sampler)
    motions = list(checked.stream(SPEECH, 3, 7))
    for motion, own in zip(motions, Scripted(sampler.bad).stream(SPEECH, 3, 7), strict=True):
        np.testing.assert_array_equal(motion.root, own.root)
        np.testing.assert_array_equal(motion.rotations, own.rotations)
    assert sampler.drawn == [(7, 0), (7, 1), (7, 2)]
    assert [report.draws for report in checked.reports] == [1, 1, 1]
    assert checked.lines() == ["checked: 3 of 3 within the bounds of any person"]
    assert checked.plain() == "checked: all 3 look physically possible"


def test_a_bad_sample_is_drawn_again(run):
    """Whatever the other samples are: sample k depends on seed and k alone, and so does its report."""
    bad = lambda seed, sample: (seed, sample) in {(7, 1), (redrawn_seed(7, 1, 1), 0)}  # noqa: E731
    sampler = Scripted(bad)
    checked = Checked(run, sampler)
    motions = list(checked.stream(SPEECH, 4, 7))
    assert sampler.drawn[2:4] == [(redrawn_seed(7, 1, 1), 0), (redrawn_seed(7, 1, 2), 0)]
    assert sampler.reports == [(7, 0), (redrawn_seed(7, 1, 2), 0), (7, 2), (7, 3)]
    assert [report.draws for report in checked.reports] == [1, 3, 1, 1]
    assert all(check_motion(motion, checked.bounds) == () for motion in motions)
    assert "sample 1: good after 3 draws; before: 2.00 s (frame 60): L_Knee" in checked.lines()[1]
    alone = list(Checked(run, Scripted(bad)).stream(SPEECH, 2, 7))
    for one, other in zip(alone, motions, strict=False):
        np.testing.assert_array_equal(one.root, other.root)


def test_reports_of_nested_samplers(toy_run_config):
    """Draws in place of a bad sample change no report on the others, of whichever sampler; each is on what is kept."""
    run = demo_run()
    pin = pin_of(talk(20.0, 77, speaker="felix").motion.clip(100, 130), run, "clip", 3.0)
    inner = Scripted(lambda seed, sample: (seed, sample) == (7, 1))
    pinned = PinnedClips(run, inner, (pin,), limit=860.0)
    checked = Checked(run, pinned)
    motions = list(checked.stream(SPEECH, 3, 7))
    assert [report.draws for report in checked.reports] == [1, 2, 1]
    assert inner.reports == [(7, 0), (redrawn_seed(7, 1, 1), 0), (7, 2)]
    assert [kept is motion for kept, motion in zip(inner.kept, motions, strict=True)] == [True] * 3
    assert len(pinned.reports) == 3
    one = Checked(run, PinnedClips(run, Scripted(inner.bad), (pin,), limit=860.0))
    list(one.stream(SPEECH, 2, 7))
    assert one.sampler.reports == pinned.reports[:2]


def test_a_sample_that_stays_bad_is_reported(run, tmp_path):
    sampler = Scripted(lambda seed, sample: sample == 1 or seed != 7)
    checked = Checked(run, sampler)
    counts = export(
        run, checked, SPEECH, tmp_path, samples=2, seed=7, formats=("npz", "html"), title="it", report=lambda done: None
    )
    assert counts == {"npz": 2, "html": 1}
    assert len(sampler.drawn) == 2 + REDRAWS
    written = json.loads((tmp_path / "checks.json").read_text())
    assert [row["draws"] for row in written["samples"]] == [1, 1 + REDRAWS]
    assert written["samples"][0]["findings"] == []
    worst = written["samples"][1]["findings"][0]
    assert (worst["joint"], worst["first"]) == ("L_Knee", 60)
    assert worst["value"] > worst["bound"] == written["bounds"][worst["figure"]]["L_Knee"]
    assert "sample 1: OUTSIDE THE BOUNDS OF A BODY after 4 draws" in "".join(checked.lines())
    assert checked.plain() == "checked: 1 of 2 look physically possible"
    assert "outside the bounds of a body at 2.0" in (tmp_path / "index.html").read_text()


def test_strict_leaves_nothing(run, tmp_path):
    """The error names sample, time, joint and figure; files of an earlier call stay."""
    sampler = Scripted(lambda seed, sample: sample == 1 or seed != 7)
    (tmp_path / "sample_00.npz").write_bytes(b"earlier")
    with pytest.raises(InputError, match=r"sample 1: .* after 4 draws: 2\.0\d s \(frame 6\d\): L_Knee .* --strict"):
        export(run, Checked(run, sampler, strict=True), SPEECH, tmp_path, samples=3, seed=7, formats=("npz",), title="")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"sample_00.npz": b"earlier"}
    good = Checked(run, Scripted(lambda seed, sample: False), strict=True)
    export(run, good, SPEECH, tmp_path, samples=1, seed=7, formats=("npz",), title="")
    assert {path.name for path in tmp_path.iterdir()} == {"sample_00.npz", "checks.json"}


def test_no_draws_where_they_change_nothing(run):
    fixed = Scripted(lambda seed, sample: True)
    fixed.varies = False
    (report,) = _reports(run, fixed)
    assert (report.draws, len(fixed.drawn)) == (1, 1)
    same = Scripted(lambda seed, sample: True, ignores_seed=True)
    (report,) = _reports(run, same)
    assert (report.draws, len(same.drawn)) == (2, 2)
    assert report.findings
    clip = Scripted(lambda seed, sample: True)
    clip.stretches = (Stretch(50, 70, run.config.body_bounds),)
    (report,) = _reports(run, clip)
    assert (report.draws, len(clip.drawn)) == (1, 1)
    clip.stretches = (Stretch(50, 60, run.config.body_bounds),)
    (report,) = _reports(run, clip)
    assert report.draws == 1 + REDRAWS


def _reports(run, sampler):
    checked = Checked(run, sampler)
    list(checked.stream(SPEECH, 1, 0))
    return checked.reports


def test_nan_is_never_written(run, tmp_path):
    class Broken:
        def stream(self, audio, samples, seed=0):
            yield replace(SOUND, root=np.full_like(SOUND.root, np.nan))

    with pytest.raises(InputError, match="sample 0: .*Pelvis is not a number; use another --seed or speech."):
        export(run, Broken(), SPEECH, tmp_path, samples=1, seed=0, formats=("npz",), title="")
    assert list(tmp_path.iterdir()) == []


def test_nan_after_good_samples_leaves_them_with_their_checks(run, tmp_path):
    """With ``strict``, none; progress is that of the check then."""

    class Broken:
        varies = False

        def stream(self, audio, samples, seed=0):
            yield SOUND
            yield SOUND
            yield replace(SOUND, root=np.full_like(SOUND.root, np.nan))

    done = []
    kwargs = {"samples": 3, "seed": 0, "formats": ("npz",), "title": "", "report": done.append}
    with pytest.raises(InputError, match="sample 2: .*is not a number"):
        export(run, Broken(), SPEECH, tmp_path / "loose", **kwargs)
    assert {path.name for path in (tmp_path / "loose").iterdir()} == {
        "sample_00.npz",
        "sample_01.npz",
        "checks.json",
    }
    rows = json.loads((tmp_path / "loose" / "checks.json").read_text())["samples"]
    assert [len(row["findings"]) for row in rows] == [0, 0, 1]
    assert done == [1, 2]
    done.clear()
    with pytest.raises(InputError, match="sample 2: .*is not a number"):
        export(run, Checked(run, Broken(), strict=True), SPEECH, tmp_path / "strict", **kwargs)
    assert not (tmp_path / "strict").exists()
    assert done == [1, 2]


def test_seeds_of_draws_are_distinct():
    seeds = {redrawn_seed(seed, sample, attempt) for seed in range(20) for sample in range(20) for attempt in (1, 2, 3)}
    assert len(seeds) == 1200
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert redrawn_seed(3, 1, 2) == redrawn_seed(3, 1, 2)


def test_extremes_in_a_run(toy_run_config, toy_corpus, tmp_path, monkeypatch):
    """They are measured with a minute of training motion, and survive the run's folder."""
    assert corpus_extremes(toy_corpus, toy_run_config()) is None
    monkeypatch.setattr("a2g_jax.training.body_extremes.LEAST_SECONDS", 3.0)
    found = corpus_extremes(toy_corpus, toy_run_config())
    config = replace(toy_run_config(), body_extremes=found)
    import jax

    params = jax.device_get(jax.jit(config.build().init)(jax.random.key(0)))
    save_run(tmp_path, Run(config, params, {}, 0))
    again = load_run(tmp_path).config.body_bounds
    assert again.source == "the training split with margins"
    for name, values in config.body_bounds.high.items():
        np.testing.assert_allclose(again.high[name], values, rtol=1e-5)
    about = json.loads((tmp_path / "run.json").read_text())
    del about["body_extremes"]
    about["checksum"] = None
    (tmp_path / "run.json").write_text(json.dumps(about))
    assert load_run(tmp_path).config.body_bounds.source == "any person"
    (tmp_path / "run.json").write_text(json.dumps(about | {"body_extremes": {"turn": [1.0]}}))
    with pytest.raises(InputError, match=r"run.json: body_extremes: is damaged"):
        load_run(tmp_path)


def test_the_command_line(tmp_path, capsys, monkeypatch):
    write_audio(tmp_path / "speech.wav", SPEECH, 16000)
    command = ["generate", "demo", "--audio", str(tmp_path / "speech.wav"), "--samples", "2", "--formats", "npz"]
    assert main([*command, "--out", str(tmp_path / "out"), "--strict"]) == 0
    assert "checked: 2 of 2 within the bounds of" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "checks.json").read_text())["samples"][1]["draws"] == 1
    from a2g_jax.generation.generator import Generator

    own = Generator.stream
    monkeypatch.setattr(Generator, "stream", lambda *args, **given: map(broken, own(*args, **given)))
    assert main([*command, "--out", str(tmp_path / "bad")]) == 0
    assert "sample 0: OUTSIDE THE BOUNDS OF A BODY after 4 draws: 2.0" in capsys.readouterr().out
    assert main([*command, "--out", str(tmp_path / "worse"), "--strict"]) == 2
    assert "L_Knee" in capsys.readouterr().err
    assert not (tmp_path / "worse").exists()
