"""The names a notebook needs are there, and cost nothing until they are used."""

import subprocess
import sys

import pytest

import a2g_jax


@pytest.mark.smoke
@pytest.mark.parametrize("name", a2g_jax.__all__)
def test_every_name_is_there(name):
    assert getattr(a2g_jax, name) is not None
    assert name in dir(a2g_jax)


def test_unknown_names():
    with pytest.raises(AttributeError, match="no attribute 'dance'"):
        a2g_jax.dance  # noqa: B018


def test_importing_the_package_does_not_import_jax():
    code = "import a2g_jax, sys; print('jax' in sys.modules)"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "False"
