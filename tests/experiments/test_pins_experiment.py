"""Absurd clips are performed as a sound body or refused by name, and the tables are complete."""

from pathlib import Path

import pytest

from a2g_jax.generation.generator import Generator
from a2g_jax.generation.pins.request import pin_of
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import demo_run
from experiments.pins.absurd import _outcome, outcomes
from experiments.pins.clips import Take, absurd
from experiments.pins.measure import SPEECH, measure
from experiments.pins.table import markdown


@pytest.fixture(scope="module")
def figures():
    run, take = demo_run(), Take("generated talk", talk(20.0, 7, speaker="felix").motion)
    plain = next(Generator(run).stream(talk(SPEECH, 3).audio, 1, 0))
    absurd = outcomes(run, plain, take, Path("/nowhere/data"), 800.0)
    rows = measure(run, [plain], [take], 3, 800.0, seed=1)
    return {"seed": 1, "jerk_limit": 800.0, "runs": {"demo": {"sources": {"generated talk": rows}, "absurd": absurd}}}


@pytest.mark.slow
def test_absurd_clips_never_break_the_body(figures):
    rows = {row["case"]: row for row in figures["runs"]["demo"]["absurd"]}
    for row in rows.values():
        if row["outcome"] == "refused":
            assert any(sign.isdigit() for sign in row["message"]) or "single frame" in row["message"]
        else:
            assert row["turn"] < 60.0
            assert row["speed"] < 6.0
    assert {name for name, row in rows.items() if row["outcome"] == "refused"} >= {
        "a cartwheel",
        "a shoulder flipped in every third frame",
        "eight times too fast",
        "one frame",
        "longer than the speech",
        "two that overlap",
    }
    assert rows["a root that jumps by 3 m"]["outcome"] == rows["a T-pose before the clip"]["outcome"] == "adapted"
    assert rows["half a second"]["outcome"] == "performed"


@pytest.mark.slow
def test_pins_of_the_experiment_are_followed(figures):
    row = figures["runs"]["demo"]["sources"]["generated talk"]
    assert row["followed"]["mean"] == 1.0
    assert row["wrist_worst_cm"] < 0.01 < row["unpinned_wrist_error_cm"]["mean"]
    text = markdown(figures)
    assert text.count("| demo | generated talk |") == 1
    assert "a cartwheel | refused" in text


def test_a_dog_is_counted_as_refused(shared):
    """Its skeleton is refused before it is a pin."""
    case = absurd(talk(4.0, 7).motion.clip(30, 90), shared)["a dog"]
    run = demo_run()
    row = _outcome(run, talk(SPEECH, 3).motion, lambda: [pin_of(case(), run, "clip", 4.0)], 800.0)
    assert row["outcome"] == "refused"
    assert "human" in row["message"]
