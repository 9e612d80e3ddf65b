"""Imports between packages point one way, and no modules import each other in a circle."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "a2g_jax"
#: Each room may import those above it in this list, and those of its own line.
LAYERS = (
    ("errors", "config", "plugins", "progress", "compilations"),
    ("geometry",),
    ("features",),
    ("io",),
    ("recording", "metrics", "viz"),
    ("talker",),
    ("data",),
    ("nn",),
    ("models",),
    ("training",),
    ("generation",),
    ("evaluation",),
    ("inspection",),
    ("serving",),
    ("cli",),
)
LEVEL = {room: number for number, rooms in enumerate(LAYERS) for room in rooms}


def modules() -> dict[str, Path]:
    """Modules of the package by name."""
    found = {}
    for path in ROOT.rglob("*.py"):
        name = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
        found[name.removesuffix(".__init__")] = path
    return found


MODULES = modules()


def imports(name: str) -> set[str]:
    """Modules of the package that a module imports, within functions and for types as well."""
    found = set()
    for node in ast.walk(ast.parse(MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= names
            if names - set(MODULES):  # a name of the package itself, not only modules in it
                found.add(node.module)
    return found & set(MODULES) - {name}


def room(name: str) -> str:
    """The package or module directly below ``a2g_jax``; empty for itself."""
    return name.split(".")[1] if "." in name else ""


def test_every_room_has_its_place():
    assert {room(name) for name in MODULES} - {""} == set(LEVEL)


@pytest.mark.parametrize("rooms", LAYERS, ids=lambda rooms: rooms[0])
def test_no_import_runs_up(rooms):
    up = [
        f"{name} imports {other}"
        for name in MODULES
        if room(name) in rooms
        for other in imports(name)
        if room(other) and LEVEL[room(other)] > LEVEL[room(name)]
    ]
    assert up == []


def test_no_modules_import_each_other():
    try:
        list(TopologicalSorter({name: imports(name) for name in MODULES}).static_order())
    except CycleError as error:
        pytest.fail(f"a circle: {' -> '.join(error.args[1])}")
