"""The measures behind the figures of the generated corpus: on signals whose answer is known, and on tiny recordings."""

import json
from argparse import Namespace

import numpy as np
import pytest

pytest.importorskip("sklearn")
pytest.importorskip("matplotlib")

from sklearn.metrics import roc_auc_score

from a2g_jax.talker.paths import minimum_jerk
from a2g_jax.talker.skeleton import FOREARM, TALKER_SKELETON, UPPER_ARM
from experiments.talker import (
    __main__ as everything,
)
from experiments.talker import (
    bounds,
    common,
    cost,
    emotions,
    hidden,
    movement,
    predictable,
    realism,
    sound,
    takes,
    timing,
)

ROLE = {"seconds": 10.0, "seed": 3, "speaker": "felix", "emotion": "neutral", "name": "0000", "room": False}


@pytest.fixture(scope="module")
def syllables():
    """A buzz of 150 Hz, four bursts a second for five seconds, then two seconds of silence."""
    time = np.arange(7 * 16000) / 16000
    buzz = sum(np.sin(2 * np.pi * 150 * k * time) / k for k in range(1, 20))
    bursts = np.maximum(np.sin(2 * np.pi * 2 * time), 0.0) ** 2 + np.maximum(-np.sin(2 * np.pi * 2 * time), 0.0) ** 2
    rng = np.random.default_rng(0)
    audio = 0.1 * buzz * (bursts + 0.02) * (time < 5) + 1e-4 * rng.standard_normal(len(time))
    return sound.analyse(audio.astype(np.float32), 16000)


def test_results_are_written_without_the_machines_paths(tmp_path, capsys):
    part = common.Part(
        "probe",
        "Probe",
        lambda parser: parser.add_argument("--shared"),
        lambda options: {"x": 1.23456, "y": float("nan")},
        lambda result: common.table([["x", result["x"], [0.1, 0.25], None]], ["", "value", "interval", "-"]),
    )
    out = tmp_path / "here" / "probe.json"
    common.run_part(part, ["--seed", "5", "--out", str(out), "--shared", str(tmp_path)])
    text = out.read_text()
    document = json.loads(text)
    assert document["command"] == "python -m experiments.talker.probe --seed 5"
    assert document["result"] == {"x": 1.235, "y": None}
    assert str(tmp_path) not in text
    assert "| x | 1.24 | 0.1 to 0.25 | - |" in capsys.readouterr().out


def test_intervals():
    low, high = common.wilson(8, 10)
    assert (low, high) == pytest.approx((0.4902, 0.9433), abs=2e-3)  # Newcombe 1998's example has these digits
    values = np.random.default_rng(0).normal(3.0, 1.0, 400)
    low, high = common.interval_of(lambda index: float(values[index].mean()), 400)
    assert low < values.mean() < high
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.4)


def test_roles_are_balanced_and_repeat():
    roles = common.cast_evenly(2, 20.0, 7)
    assert len(roles) == 96
    assert len({role["seed"] for role in roles}) == 96
    assert len({(role["speaker"], role["emotion"]) for role in roles}) == 48
    assert sum(role["room"] for role in roles) == 48
    assert roles == common.cast_evenly(2, 20.0, 7)


def test_sound_of_known_syllables(syllables):
    peaks = sound.syllable_peaks(syllables)
    np.testing.assert_allclose(peaks, 0.125 + 0.25 * np.arange(20), atol=0.02)
    figures = sound.summary(syllables)
    assert figures["f0_median_hz"] == pytest.approx(150, rel=0.03)
    assert figures["modulation_peak_hz"] == pytest.approx(4.0, rel=0.1)
    assert figures["pause_share"] == pytest.approx(2 / 7, abs=0.03)
    assert figures["syllable_rate_hz"] == pytest.approx(4.0, rel=0.05)
    assert np.isfinite(sound.statistics(syllables)).all()
    rows = sound.frame_features(syllables, np.array([-1.0, 0.0, 3.0, 99.0]))
    assert rows.shape == (4, 20)
    assert np.isfinite(rows).all()


@pytest.mark.parametrize("fps", [15.0, 30.0, 60.0])
def test_movement_of_a_known_path_at_any_rate(fps):
    # Hands swing forward and back as 0.2 sin(2 pi t): speed up to 0.4 pi, smoothing takes 5 %.
    time = np.arange(int(10 * fps)) / fps
    positions = np.zeros((len(time), 22, 3))
    rest = np.zeros(3)
    for side, sign in (("L", 1.0), ("R", -1.0)):
        for name, place in (("Shoulder", (0.2, 0.4, 0)), ("Elbow", (0.2, 0.1, 0)), ("Wrist", (0.2, 0.0, 0.2))):
            movement.joint(positions, f"{side}_{name}")[:] = rest + np.array(place) * (sign, 1, 1)
        movement.joint(positions, f"{side}_Wrist")[:, 2] += 0.2 * np.sin(2 * np.pi * time)
    moves = movement.paths(positions, fps)
    shrink = np.exp(-0.5 * (2 * np.pi * movement.SMOOTHING) ** 2)
    inner = slice(30, -30)
    speed = movement.derivative(moves.wrists, 1)[inner]
    assert speed.max() == pytest.approx(0.4 * np.pi * shrink, rel=0.02)
    jerk = movement.derivative(moves.wrists, 3)[inner]
    assert jerk.max() == pytest.approx(0.2 * (2 * np.pi) ** 3 * shrink, rel=0.03)
    figures = movement.summary(moves)
    assert figures["range_forward_m"] == pytest.approx(0.4 * np.sin(0.45 * np.pi) * shrink, rel=0.05)
    assert figures["range_side_m"] < 1e-6
    assert figures["rest_share"] == 0.0
    assert figures["strokes_per_minute"] == pytest.approx(120, abs=12)
    still = movement.summary(movement.paths(np.repeat(positions[:1], 100, axis=0), fps))
    assert still["rest_share"] == 1.0
    assert still["strokes_per_minute"] == 0.0


def test_arrival_is_where_a_minimum_jerk_step_has_done_most_of_its_way():
    time = np.linspace(0.0, 1.0, 1001)
    speed = np.gradient(minimum_jerk(time))
    assert time[timing.arrival(speed, int(np.argmax(speed)))] == pytest.approx(0.82, abs=0.005)
    twice = np.concatenate([2 * speed, speed])
    peak = timing.last_burst(twice)
    assert peak == pytest.approx(1501, abs=2)
    assert timing.last_burst(np.concatenate([4 * speed, speed])) == pytest.approx(500, abs=2)


def test_timing_of_a_small_recording():
    rows = timing.measure(ROLE)
    count = len(rows["planned_apex"])
    assert count >= 5
    assert all(len(rows[name]) == count for name in ("planned_peak", "peak", "apex", "speed"))
    assert np.nanmax(np.abs(np.subtract(rows["peak"], rows["planned_peak"]))) < 0.05
    found = timing.against_shifts([rows], "planned_apex", "planned_peak", 100, 0)
    assert found["share"] > found["null_95"][1]
    # Times that have nothing to do with each other do not differ from shifted ones.
    rng = np.random.default_rng(0)
    loose = {"a": rng.uniform(0, 600, 300).tolist(), "b": rng.uniform(0, 600, 300).tolist(), "seconds": [600.0]}
    assert abs(timing.against_shifts([loose], "a", "b", 100, 0)["z"]) < 3.5


def test_timing_tables_and_picture(tmp_path):
    options = Namespace(minutes=4.0, seed=0, workers=1, shifts=3)
    roles = common.cast_evenly(1, 5.0, 0, speakers=("ada",), rooms=False)
    result = common.rounded(_with_roles(timing, roles, options))
    timing.picture(result, tmp_path / "t.png")
    assert (tmp_path / "t.png").stat().st_size > 5000
    assert "requested" in timing.tables(result)


def _with_roles(module, roles, options):
    patch = pytest.MonkeyPatch()
    with patch.context() as scope:
        scope.setattr(module, "cast_evenly", lambda *args, **kwargs: roles)
        return module.run(options)


def test_hidden_choices_found_in_what_tells_and_not_in_noise():
    rng = np.random.default_rng(0)
    labels = rng.choice(["left", "right", "both"], 150, p=[0.2, 0.3, 0.5])
    takes_of = np.repeat(np.arange(15), 10).astype(str)
    noise = rng.standard_normal((150, 20))
    telling = noise + 3.0 * (labels == "left")[:, None] - 3.0 * (labels == "right")[:, None]
    for name in hidden.MODELS:
        blind = hidden._task((name, noise, labels, takes_of, 0), permutations=5)
        sure = hidden._task((name, telling, labels, takes_of, 0), permutations=5)
        assert sure["own"].mean() > 0.9
        figures = hidden.compare([blind], [takes_of])
        assert figures["gain"] < 0.08
        assert figures["majority"] == pytest.approx(np.mean(labels == "both"))
        assert figures["gain_95"][0] <= figures["gain"] <= figures["gain_95"][1]
        assert hidden.compare([sure], [takes_of])["p"] == pytest.approx(1 / 6)


@pytest.mark.slow
def test_hidden_runs_on_small_recordings():
    roles = [{**ROLE, "seed": seed, "name": f"{seed:04d}"} for seed in range(3)]
    result = common.rounded(_with_roles(hidden, roles, Namespace(takes=1, permutations=1, seed=0, workers=1)))
    assert result["units"] >= 6
    assert set(result["within_speakers"]) == {
        f"{target}/{sense}/{name}"
        for target in hidden.TARGETS
        for sense in ("audio", "motion")
        for name in hidden.MODELS
    }
    assert "labels shuffled" in hidden.tables(result)


def test_pairs_of_guesses_and_strokes_are_one_to_one():
    strokes = np.array([1.0, 2.0, 3.0])
    assert predictable.matches(np.array([0.95, 1.05, 2.5, 3.09]), strokes) == 2
    assert predictable.matches(np.zeros(0), strokes) == 0
    assert predictable.f1([np.array([1.0, 2.0])], [strokes]) == pytest.approx(2 * 2 / 5)
    rng = np.random.default_rng(0)
    truth, values = rng.random(500) < 0.2, rng.integers(0, 9, 500).astype(float)
    values[truth] += 1
    assert predictable.auc([values[:200], values[200:]], [truth[:200], truth[200:]]) == pytest.approx(
        roc_auc_score(truth, values)
    )


def _planted(rng, informative):
    """A recording whose first feature, and nothing else, tells of strokes and their sizes."""
    apexes = np.arange(1.0, 29.0, 1.3) + rng.uniform(-0.3, 0.3, 22)
    grid = np.arange(900) / predictable.FPS
    trace = np.exp(-0.5 * ((grid[:, None] - apexes) / 0.05) ** 2).max(axis=1)
    features = rng.standard_normal((900, 180)).astype(np.float32)
    sizes = rng.random(22)
    at = rng.standard_normal((22, 180))
    if informative:
        features[:, 0] += 8 * trace
        at[:, 0] += 8 * sizes
    return {
        "features": features,
        "energy": rng.standard_normal(900),
        "apexes": apexes,
        "sizes": sizes,
        "at_strokes": at,
        "seconds": 30.0,
    }


@pytest.mark.slow
def test_strokes_are_predicted_where_the_features_tell():
    rng = np.random.default_rng(0)
    for informative in (True, False):
        planted = [_planted(rng, informative) for _ in range(5)]
        times = predictable.judge(planted, "apexes", 5, 0)
        size = predictable.size_score(planted, "sizes", 3, 0)
        assert abs(times["energy alone"]["auc"] - 0.5) < 0.08
        if informative:
            assert times["regressor"]["auc"] > 0.9
            assert times["regressor"]["f1"] > times["regressor"]["f1_null_95"][1] + 0.3
            assert size["r2"] > size["r2_null_95"][1] + 0.15
        else:
            assert abs(times["regressor"]["auc"] - 0.5) < 0.08
            assert size["r2"] < 0.1


def test_predictable_reads_a_recording():
    take = predictable.read(ROLE)
    assert take["features"].shape == (300, 180)
    assert take["at_strokes"].shape == (len(take["apexes"]), 180)
    assert np.isfinite(take["features"]).all()
    assert len(take["speeds"]) == len(take["sizes"]) == len(take["apexes"])


@pytest.mark.slow
def test_emotions_judged_shown_and_drawn(tmp_path):
    rng = np.random.default_rng(0)
    classes = emotions.LABELS["emotion"]
    labels = np.repeat(classes, 10)
    noise = rng.standard_normal((80, 12))
    telling = noise + 4 * np.eye(8, 12)[np.repeat(np.arange(8), 10)]
    for name in emotions.MODELS:
        assert emotions.judge(telling, labels, classes, name, 0)["accuracy"] > 0.8
        blind = emotions.judge(noise, labels, classes, name, 0)
        assert blind["interval"][0] < 1 / 8 + 0.05
        assert np.sum(blind["confusion"]) == 80
    audio, gestures = emotions.features({**ROLE, "room": True})
    assert np.isfinite(audio).all()
    assert np.isfinite(gestures).all()
    result = {"recordings": 80, "seconds": 1.0, "features": {"audio": 1, "motion": 1}, "folds": 5}
    for what, names in emotions.LABELS.items():
        for sense in ("audio", "motion"):
            for name in emotions.MODELS:
                which = np.repeat(names, 10)
                rows = rng.standard_normal((len(which), 4))
                result[f"{what}/{sense}/{name}"] = emotions.judge(rows, which, names, "logistic", 0)
    result = common.rounded(result)
    assert emotions.tables(result).count("| emotion from") == 4
    emotions.picture(result, tmp_path / "e.png")
    assert (tmp_path / "e.png").stat().st_size > 5000


def test_figures_against_the_real_range():
    assert realism.compare("rest_share", 0.5, [0.1, 0.2]) == {
        "generated": 0.5,
        "real": [0.1, 0.2],
        "ratio": pytest.approx(2.5),
        "far": True,
    }
    assert realism.compare("rest_share", 0.15, [0.1, 0.2])["ratio"] == 1.0
    assert not realism.compare("rest_share", 0.06, [0.1, 0.2])["far"]
    assert realism.compare("log_mel_mean_db", -31.0, [-24.0, -20.0])["far"]


def test_realism_without_real_takes_says_so(tmp_path):
    roles = [ROLE, {**ROLE, "emotion": "sadness", "seed": 4}]
    result = common.rounded(
        _with_roles(realism, roles, Namespace(repeats=1, seconds=10.0, seed=0, workers=1, shared=tmp_path))
    )
    assert result["real"] == {}
    assert len(result["missing"]) == 5
    assert set(result["rows"]) == set(realism.ROWS)
    assert all(row["generated"] is not None for row in result["rows"].values())
    text = realism.tables(result)
    assert "Skipped: BEAT: " in text
    assert str(tmp_path) not in text + json.dumps(result)


def test_real_takes(shared):
    found, missing = takes.real_takes(shared.parent)
    assert missing == []
    assert len(found) == 5
    for take in found:
        if take.moves is None:
            continue
        # Hands in front of the speaker and below the shoulders, within the arm's reach.
        middle = np.median(take.moves.reach, axis=0)
        assert (middle[:, 2] > 0).all(), take.name
        assert (middle[:, 1] < 0).all(), take.name
        assert middle[0, 0] > middle[1, 0], take.name
        assert 0.4 < take.moves.arm < 0.7, take.name
    assert 3 < found[0].syllable_rate < 7


def test_smplx_rotations_and_bone_directions_stand_in_t_pose():
    positions = takes.smplx_positions(np.zeros((3, 165)), np.zeros((3, 3)), 30.0)
    assert positions.shape == (3, 22, 3)
    offsets = np.asarray(TALKER_SKELETON.offsets)
    left = sum(offsets[TALKER_SKELETON.index(f"L_{name}"), 0] for name in ("Collar", "Shoulder", "Elbow", "Wrist"))
    np.testing.assert_allclose(np.ptp(positions[0, :, 0]), 2 * left, atol=1e-4)
    bones = np.zeros((10, 42, 3))
    bones[:, 0, 1] = -1.0  # up, in the data's axes
    bones[:, [1, 3, 4], 0] = 1.0
    bones[:, [2, 20, 21], 0] = -1.0
    moves = takes.ted_paths(bones.reshape(10, 126), 15.0)
    np.testing.assert_allclose(moves.reach[0, 0], [0.15 + UPPER_ARM + FOREARM, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(moves.reach[0, 1], [-0.15 - UPPER_ARM - FOREARM, 0.0, 0.0], atol=1e-9)


def test_bounds_of_small_recordings():
    roles = [{**ROLE, "seconds": 6.0, "seed": seed, "name": f"{seed:04d}"} for seed in (1, 2)]
    options = Namespace(takes=2, seconds=6.0, draws=3, seed=0, workers=1)
    patch = pytest.MonkeyPatch()
    with patch.context() as scope:
        scope.setattr(bounds, "SPEAKERS", {"felix": None})
        scope.setattr(bounds, "cast_evenly", lambda *args, **kwargs: roles)
        result = common.rounded(bounds.run(options))
    wrists, joints = (result["all"]["multimodality"][title][0] for title in list(bounds.DISTANCES)[:2])
    assert wrists > joints > 0.5
    rhythm = result["all"]["scores"]["rhythm agreement"]
    assert 0 <= rhythm["floor"][0] <= 1
    assert 0 <= rhythm["ceiling"][0] <= 1
    assert "±" in bounds.tables(result)
    still = bounds.distance
    motion = bounds.talk(**roles[0]).motion
    assert still(motion, motion, "l1") == 0.0


@pytest.mark.slow
def test_cost_of_a_small_corpus():
    figures = cost.corpus("corpus-1", 0.4, 0, 1)
    assert figures["median_s"] > 0
    assert 20 < figures["mb_per_hour"] < 2000
    assert all(callable(cost.stage(name, 0)) for name in cost.STAGES)
    rows = [{"contender": "a", **figures, "peak_mb": 100.0}, {"contender": "b", "failed": "exit code 1: no"}]
    text = cost.tables(common.rounded({"recording_seconds": 60.0, "minutes": 0.4, "rows": rows}))
    assert "exit code 1" in text


def test_the_page_is_what_the_results_say(tmp_path):
    assert everything.page(tmp_path, tmp_path).startswith("# The generated corpus")
    text = everything.page(common.RESULTS, common.PICTURES)
    for path in common.RESULTS.glob("*.json"):
        assert json.loads(path.read_text())["command"] in text
    assert everything.PAGE.read_text() == text
