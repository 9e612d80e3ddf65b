"""Every shared problem file has its right outcome; skipped where these files are absent."""

import pytest

from experiments.cases.__main__ import CASES
from experiments.cases.runner import Case, cases_folder, judge, line_of, refuses


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.file)
def test_case(case):
    folder = cases_folder()
    if not folder.is_dir():
        pytest.skip(f"no problem files at {folder} (set A2G_SHARED_DATA to the folder beside it)")
    outcome = judge(case, folder)
    assert outcome[0], line_of(case, outcome)


def test_a_missing_file_and_a_wrong_outcome_are_said(tmp_path):
    case = Case("none.bvh", "a refusal", refuses("no such"))
    assert line_of(case, judge(case, tmp_path)).startswith("WRONG  none.bvh: expected a refusal; there is no such file")
    (tmp_path / "none.bvh").write_text("hello\n")
    assert judge(case, tmp_path)[0] is False
    right = Case("none.bvh", "a refusal", refuses("Is this a BVH file"))
    assert line_of(right, judge(right, tmp_path)).startswith("right")
