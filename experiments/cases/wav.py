"""Cases of wav files."""

from experiments.cases.runner import Case

CASES: tuple[Case, ...] = ()
