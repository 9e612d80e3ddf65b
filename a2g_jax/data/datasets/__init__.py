"""Readers of the field's data sets, one module each; found by name with :func:`find_data_set`."""

from importlib import import_module

from a2g_jax.data.datasets.source import SPLITS as SPLITS
from a2g_jax.data.datasets.source import DataSet as DataSet
from a2g_jax.data.datasets.source import Take as Take
from a2g_jax.errors import InputError

_MODULES: dict[str, str] = {
    "folder": "folder",
}
"""Which module reads the data set of a name."""


#: All that can be asked for.
NAMES = tuple(_MODULES)


def find_data_set(name: str) -> DataSet:
    """The reader of a data set.

    Raises:
        InputError: there is none of that name.
    """
    if name not in _MODULES:
        raise InputError(f"no data set {name!r}; there are: {', '.join(_MODULES)}.")
    return import_module(f"a2g_jax.data.datasets.{_MODULES[name]}").DATASET
