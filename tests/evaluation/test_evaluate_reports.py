"""Reports of the table: what they are of, which can be compared, and the command that writes them."""

import json

import pytest

from a2g_jax.cli import main
from a2g_jax.errors import InputError
from a2g_jax.evaluation.report import MOTIONS, check_comparable, markdown


def test_reports_say_what_they_are_of(result):
    text = markdown(result)
    assert "| mean pose | 1 |" in text
    assert "No score here measures" in text
    assert result["about"]["feature_network"][:16] in text
    json.dumps(result, allow_nan=False)


def test_what_cannot_be_compared_is_refused(result):
    other = {**result, "about": {**result["about"], "feature_network": "another"}}
    check_comparable({"a": result, "b": result})
    with pytest.raises(InputError, match="a and b: cannot be compared: feature network is .* and another in the"):
        check_comparable({"a": result, "b": other})
    paper = {**result, "about": {**result["about"], "units": "audio2gestures"}}
    with pytest.raises(InputError, match="units is ours in one and audio2gestures in the other"):
        check_comparable({"a": result, "b": paper})


def test_a_report_of_the_first_version_says_how_it_scaled_errors(result):
    """L1* was by the length of the bones; units were not stated."""
    about = {key: value for key, value in result["about"].items() if key not in ("units", "wrist_to_wrist")}
    check_comparable({"a": {**result, "about": about}, "b": {**result, "about": {**about, "units": "ours"}}})
    assert "position L1* (by the bones' length, as in 0.1), cm" in markdown({**result, "about": about})
    assert "position L1*, cm" in markdown(result)


def test_the_command_writes_its_report(corpus, tmp_path, capsys):
    out = tmp_path / "report"
    command = ["evaluate", "--corpus", str(corpus.path), "--out", str(out), "--samples", "1"]
    assert main([*command, "--beat-sigma", "0.3"]) == 0
    printed = capsys.readouterr().out
    assert "| truth | 1 |" in printed
    assert "beat alignment, motion to audio, 0.3 s" in printed
    assert {path.name for path in out.iterdir()} == {"report.json", "report.md", "report.tex", "report.png"}
    assert main([*command, "--units", "audio2gestures"]) == 0
    printed = capsys.readouterr().out
    assert "speed L1, cm/frame ↓ | acceleration L1, cm/frame2 ↓" in printed
    assert "on a skeleton of 120.64 cm" in printed
    assert json.loads((out / "report.json").read_text())["about"]["units"] == "audio2gestures"
    assert json.loads((out / "report.json").read_text())["about"]["beat_sigma"] == pytest.approx(1 / 6)
    with pytest.raises(SystemExit):
        main([*command, "--beat-sigma", "5"])
    assert "seconds from 0.01 to 2; got '5'" in capsys.readouterr().err
    assert main([*command, "--units", "feet"]) == 2
    assert "there are no 'feet'; there are: ours, audio2gestures, stylized-flow" in capsys.readouterr().err
    assert main([*command, "--split", "nothing"]) == 2
    assert "has no split 'nothing'" in capsys.readouterr().err
    assert main([*command, "--features", str(tmp_path)]) == 2


def save_report(result, folder):
    """The part of a report that is read again; the tables and the picture take longer than the scores."""
    folder.mkdir()
    (folder / "report.json").write_text(json.dumps(result))


def test_reports_are_put_side_by_side(corpus, plain, tmp_path, capsys):
    """Two reports of the same thing become one; the baselines are there once, clashing names say their report."""
    table = plain
    mean = next(row for row in table["rows"] if row["name"] == "mean pose")
    for name in ("first", "second"):
        mine = {**mean, "name": "mine"}
        save_report({**table, "rows": [mine, *table["rows"]], "audits": {}}, tmp_path / name)
    out = tmp_path / "both"
    command = ["evaluate", "--compare", str(tmp_path / "first"), str(tmp_path / "second"), "--out", str(out)]
    assert main(command) == 0
    names = [row["name"] for row in json.loads((out / "report.json").read_text())["rows"]]
    assert names == [f"mine ({tmp_path / 'first'})", f"mine ({tmp_path / 'second'})", *MOTIONS]
    capsys.readouterr()
    assert main([*command[:4], "--out", str(out), "--corpus", str(corpus.path)]) == 2
    assert main([*command, "--units", "audio2gestures"]) == 2
    assert main(["evaluate", "--compare", str(tmp_path), "--out", str(out)]) == 2
    assert "is no report" in capsys.readouterr().err
    other = {**table, "about": {**table["about"], "clips": 99}}
    save_report(other, tmp_path / "third")
    assert main(["evaluate", "--compare", str(tmp_path / "first"), str(tmp_path / "third"), "--out", str(out)]) == 2
    assert "clips is" in capsys.readouterr().err
    assert main(["evaluate", "--out", str(out)]) == 2
    assert "--corpus is needed" in capsys.readouterr().err
