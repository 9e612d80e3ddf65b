"""Cases of textgrid files."""

from experiments.cases.runner import Case

CASES: tuple[Case, ...] = ()
