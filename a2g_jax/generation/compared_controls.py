"""Requested controls of systems side by side, which need not have the same ones."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from a2g_jax.errors import InputError
from a2g_jax.models.control_curves import parse_curves, parse_line, public_name
from a2g_jax.training.run import Run


def with_controls(runs: Mapping[str, Run], lines: Sequence[str]) -> tuple[dict[str, Run], dict[str, tuple[str, ...]]]:
    """The runs with the requests that each can follow, and by run the requests that it has no control for.

    Args:
        runs: by name.
        lines: such as ``energy=0.9``.

    Raises:
        InputError: a line that is not well formed, that no run has a control for, or whose values do not fit a run.
    """
    parsed = {line: parse_line(line).name for line in lines}
    found: dict[str, Run] = {}
    without: dict[str, tuple[str, ...]] = {}
    for name, run in runs.items():
        controls = run.config.build().controls
        names = () if controls is None else tuple(public_name(each) for each in controls.names)
        taken = tuple(line for line, control in parsed.items() if control in names)
        try:
            parse_curves(taken, names, {} if controls is None else controls.categories)
            found[name] = replace(run, config=run.config.with_sampling(controls=taken)) if taken else run
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
        if rest := tuple(line for line in parsed if line not in taken):
            without[name] = rest
    for line, control in parsed.items():
        if all(line in without.get(name, ()) for name in runs):
            raise InputError(f"--control {line!r}: none of {', '.join(runs)} has a control {control!r}.")
    return found, without
