"""Trainings whose gradient is exactly zero are found and mentioned."""

import json
import shutil

from integrity_for_tests import PACKAGE

from a2g_jax.inspection.inspect import inspect
from a2g_jax.training import loop
from a2g_jax.training.vanished import zero_gradient


def lines(*norms):
    return [{"step": 10 * (n + 1), "split": "train", **norm} for n, norm in enumerate(norms)]


def test_gradients_of_zero_are_found_in_logs():
    one = lambda *values: zero_gradient(lines(*({"gradient_norm": value} for value in values)))  # noqa: E731
    assert one() is None
    assert one(1.0, 0.5) is None
    assert one(1.0, 0.0, 0.5) is None
    assert one(1.0, 0.0, 0.0) == (20, "")
    two = lambda *pairs: zero_gradient(  # noqa: E731
        lines(*({"gradient_norm_g": g, "gradient_norm_d": d} for g, d in pairs))
    )
    assert two((1.0, 0.0), (1.0, 0.0)) is None
    assert two((1.0, 0.0), (1.0, 0.0), (1.0, 0.0)) == (10, "d")
    assert two((1.0, 1.0), (0.0, 0.0)) == (20, "")


def test_a_training_that_has_died_is_mentioned(tmp_path, capsys):
    zeros = loop.ZeroGradients(tmp_path / "run")
    for step, norm in ((5, 1.0), (10, 0.0), (15, 0.0)):
        zeros.note(step, {"loss": 1.0, "gradient_norm": norm})
    said = capsys.readouterr().err.splitlines()
    assert said == [
        f"{tmp_path / 'run'}: the gradient is exactly zero since step 10, so nothing is learned any more; start again"
        " with a lower --learning-rate or another --seed."
    ]


def test_inspect_mentions_a_training_that_has_died(tmp_path):
    run_folder = shutil.copytree(PACKAGE / "demo_features", tmp_path / "run")
    rows = lines({"loss": 1.0, "gradient_norm": 0.1}, {"loss": 1.0, "gradient_norm": 0.0})
    (run_folder / "metrics.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    (found,) = (finding for finding in inspect(run_folder).findings if finding.code == "zero-gradient")
    assert (found.severity, found.value) == ("warning", 20.0)
