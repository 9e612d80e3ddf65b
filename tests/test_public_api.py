"""The public names resolve, are documented, and cost nothing until they are used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import a2g_jax


@pytest.mark.smoke
@pytest.mark.parametrize("name", [name for name in a2g_jax.__all__ if name != "__version__"])
def test_every_name_is_there_and_documented(name):
    value = getattr(a2g_jax, name)
    assert value.__name__ == name
    assert value.__module__ == a2g_jax._EXPORTS[name], "exported from the module that defines it"
    # The docstring that dataclasses generate is only the signature.
    assert value.__doc__
    assert not value.__doc__.startswith(f"{name}(")
    assert name in dir(a2g_jax)


def test_type_checkers_see_the_same_names():
    tree = ast.parse(Path(a2g_jax.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
    seen = {alias.asname: node.module for node in imports for alias in node.names}
    assert seen == a2g_jax._EXPORTS


def test_unknown_names():
    with pytest.raises(AttributeError, match="no attribute 'dance'"):
        a2g_jax.dance  # noqa: B018


def test_importing_the_package_does_not_import_jax():
    code = "import a2g_jax, sys; a2g_jax.InputError; print('jax' in sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "False"
