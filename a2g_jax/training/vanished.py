"""Gradients that are exactly zero: nothing is learned any more, although every number is finite."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from a2g_jax.progress import say

#: Lines of the log in a row after which one of several players counts as stuck; a hinge may rest for a while.
_PATIENCE = 3
_NORM = "gradient_norm"


def zero_gradient(lines: Iterable[Mapping[str, Any]]) -> tuple[int, str] | None:
    """Step from which a gradient stays exactly zero to the end of the log, and the update it belongs to.

    Of several updates, one alone may rest for two lines.

    Args:
        lines: of ``metrics.jsonl``, in order.

    Returns:
        The step and the update's name (empty for the only one, or for all); None where all gradients move.
    """
    since: dict[str, tuple[int, int]] = {}
    last: Mapping[str, Any] = {}
    for line in lines:
        if line.get("split") != "train":
            continue
        last = {name: value for name, value in line.items() if name.startswith(_NORM)}
        for name, value in last.items():
            if value == 0.0:
                first, count = since.get(name, (int(line["step"]), 0))
                since[name] = first, count + 1
            else:
                since.pop(name, None)
    if not last or not since:
        return None
    if all(name in since for name in last):
        return max(since[name][0] for name in last), ""
    for name in last:
        if name in since and since[name][1] >= _PATIENCE:
            return since[name][0], name.removeprefix(f"{_NORM}_")
    return None


def zero_message(step: int, update: str) -> str:
    """The fault in words."""
    whose = f" of {update}" if update else ""
    return f"the gradient{whose} is exactly zero since step {step}, so nothing is learned any more"


class ZeroGradients:
    """Mentions gradients that vanish in a training, once each."""

    def __init__(self, out: Path) -> None:
        self._out = out
        self._lines: list[dict[str, Any]] = []
        self._said: set[str] = set()

    def note(self, step: int, values: Mapping[str, float]) -> None:
        """Take the terms of a logged step into account."""
        norms = {name: value for name, value in values.items() if name.startswith(_NORM)}
        self._lines = [*self._lines[-_PATIENCE:], {"step": step, "split": "train", **norms}]
        found = zero_gradient(self._lines)
        if found is not None and found[1] not in self._said:
            self._said.add(found[1])
            say(f"{self._out}: {zero_message(*found)}; start again with a lower --learning-rate or another --seed.")
