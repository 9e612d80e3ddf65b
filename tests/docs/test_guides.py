"""Every command and program in the guides is one that the package has; ``test_guides_run.py`` runs them."""

import ast
import importlib
import importlib.util
import os
import re
from dataclasses import fields
from functools import cache

import pytest

import a2g_jax
from a2g_jax.cli.parser import COMMANDS, make_parser
from a2g_jax.cli.reference import markdown
from a2g_jax.config import flag_of, parse_flags
from a2g_jax.models.registry import find_model, model_names
from a2g_jax.models.train_config import TrainConfig
from tests.docs.guides_for_tests import PAGES, ROOT, commands, flags, inline_commands, programs

SHELL = [one for page in PAGES for one in commands(page)]
CALLS = [one for one in SHELL if one.words[:1] == ["a2g"] or one.words[:1] == [".venv/bin/a2g"]]
INLINE = [one for page in PAGES for one in inline_commands(page)]
PYTHON = [one for page in PAGES for one in programs(page)]
#: Other programs that the guides call.
PROGRAMS = {
    "a2g",
    "python",
    "python3",
    "pip",
    "export",
    "ruff",
    "mypy",
    "mkdocs",
    "jupyter",
    "blender",
    "cp",
    "srun",
    "tensorboard",
    ".",
}
#: Runs and models that the guides name, by the model whose settings they have.
MODELS = {"demo": "audio2gestures", "demo-flow": "stylized_flow", "demo-emotion": "emotion_gesture"}


def model_of(one, positional):
    """The model whose settings a call may have; None for one that is only an example."""
    if ":" in positional:
        return None
    if positional in MODELS:
        return MODELS[positional]
    if positional in model_names():
        return positional
    return {"docs/style.md": "stylized_flow", "docs/emotion.md": "emotion_gesture"}.get(one.page, "audio2gestures")


def parses(one):
    """Parse a call as the command line does, settings included."""
    words = one.words[1:]
    try:
        options, extra = make_parser().parse_known_args(words)
    except SystemExit as stop:
        raise AssertionError(f"{one}: {one.text}: refused with status {stop.code}") from None
    command = COMMANDS[options.command]
    if not extra:
        return
    assert getattr(command, "TAKES_SETTINGS", False), f"{one}: {one.text}: unknown {extra}"
    name = options.model if options.command == "train" else getattr(options, "run", "demo")
    model = model_of(one, str(name))
    if model is None:
        return
    entry = find_model(model)
    if options.command == "train":
        parse_flags(extra, entry.presets["tiny"], entry.training_preset("tiny"), hint="--settings")
    else:
        parse_flags(extra, entry.sampling(), hint="--settings")


def test_commands_are_found():
    assert len(SHELL) > 60
    assert len(CALLS) > 40
    assert len(PYTHON) > 10
    assert {"README.md", "CONTRIBUTING.md", "docs/first_motion.md"} <= {one.page for one in SHELL}


@pytest.mark.parametrize("page", PAGES)
def test_every_command_is_one_that_is_there(page):
    for one in (one for one in SHELL if one.page == page):
        words = one.words
        program = words[0].removeprefix(".venv/bin/")
        assert program in PROGRAMS, f"{one}: unknown program {program}"
        if program == "a2g":
            parses(one)
        elif program.startswith("python") and "-m" in words:
            module = words[words.index("-m") + 1]
            assert importlib.util.find_spec(module) is not None or module in ("venv", "http.server"), f"{one}: {module}"


@pytest.mark.parametrize("page", PAGES)
def test_every_command_in_the_text_names_a_command_and_its_flags(page):
    known = all_flags()
    for one in (one for one in INLINE if one.page == page):
        name = one.text.split()[1]
        assert name.isupper() or name.startswith("--") or name in COMMANDS, f"{one}: {one.text}"
        assert set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", one.text)) <= known, f"{one}: {one.text}"


@cache
def all_flags():
    """Flags of all commands, and of all settings."""
    found = {"--help", "--version"}
    for parser in command_parsers().values():
        found |= {option for action in parser._actions for option in action.option_strings}
    for name in model_names():
        entry = find_model(name)
        for owner in (entry.config, entry.sampling, TrainConfig):
            found |= {flag_of(field) for field in fields(owner)}
    return found


def command_parsers():
    (action,) = (one for one in make_parser()._actions if hasattr(one, "choices") and one.dest == "command")
    return action.choices


#: Flags on the pages of other programs, and of packages that CONTRIBUTING invents.
OTHERS = {"--strict", "--python", "--noise-scale", "--system-site-packages", "--logdir"}
#: Those of Slurm.
OTHERS |= {"--nodes", "--ntasks-per-node", "--gpus-per-node", "--cpus-per-task", "--time", "--signal", "--requeue"}


@pytest.mark.parametrize("page", PAGES)
def test_every_flag_in_the_text_is_one_of_the_package(page):
    unknown = {flag for flag in flags(page) - all_flags() - OTHERS if f'"{flag}"' not in experiments()}
    assert unknown == set()


@cache
def experiments():
    """The text of all experiments, which have flags of their own."""
    return "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "experiments").rglob("*.py"))


@pytest.mark.parametrize("page", PAGES)
def test_programs_are_python_and_import_what_is_there(page):
    for one in (one for one in PYTHON if one.page == page):
        tree = ast.parse(one.text, str(one))
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("a2g_jax"):
                module = importlib.import_module(str(node.module))
                for name in node.names:
                    found = hasattr(module, name.name) or importlib.util.find_spec(f"{node.module}.{name.name}")
                    assert found, f"{one}: {node.module} has no {name.name}"
            owner = node.value if isinstance(node, ast.Attribute) else None
            if isinstance(owner, ast.Name) and owner.id == "a2g_jax":
                assert hasattr(a2g_jax, node.attr), f"{one}: a2g_jax has no {node.attr}"


@pytest.mark.parametrize("page", PAGES)
def test_files_of_the_repository_that_commands_name_are_there(page):
    for one in (one for one in SHELL if one.page == page):
        for word in one.words:
            if word.startswith(("docs/", "experiments/", "notebooks", "tests/")):
                assert (ROOT / word).exists(), f"{one}: {word}"


@pytest.mark.skipif("A2G_FORMATS" in os.environ, reason="formats of other packages are listed, too")
def test_the_reference_of_commands_is_up_to_date():
    stored = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    assert stored == markdown(), "run: python -m a2g_jax.cli.reference > docs/commands.md"
    for name in COMMANDS:
        assert f"## a2g {name}\n" in stored
