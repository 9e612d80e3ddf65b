"""Readers of the field's data sets, one module each, and of those in other packages; see :func:`find_data_set`."""

import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from a2g_jax.data.data_set_names import MODULES, all_names, is_reference
from a2g_jax.data.data_set_names import NAMES as NAMES
from a2g_jax.data.datasets.source import SPLITS as SPLITS
from a2g_jax.data.datasets.source import DataSet as DataSet
from a2g_jax.data.datasets.source import LabelRule as LabelRule
from a2g_jax.data.datasets.source import Take as Take
from a2g_jax.errors import InputError
from a2g_jax.plugins import DATA_SETS, describe, entry_points_of, load_entry_point, load_object


def find_data_set(name: str) -> DataSet:
    """The reader of a data set.

    Args:
        name: one of :data:`NAMES`, an entry point of the group ``a2g_jax.data_sets``, a Python file that defines
            ``DATASET``, or ``module:name``. Entry points and references lead to a :class:`DataSet` or to a module that
            defines ``DATASET``.

    Raises:
        InputError: there is none of that name, or it cannot be loaded.
    """
    if name in MODULES:
        return import_module(f"a2g_jax.data.datasets.{MODULES[name]}").DATASET
    if name.endswith(".py"):
        return _of_file(Path(name))
    if is_reference(name):
        return _data_set(load_object(name, "data set"), f"data set {name}")
    point = entry_points_of(DATA_SETS).get(name)
    if point is None:
        raise InputError(
            f"no data set {name!r}; there are: {', '.join(all_names())}, or your own reader.py or module:name."
        )
    return _data_set(load_entry_point(point, "data set"), describe(point, "data set"))


def data_set_lines() -> Iterator[tuple[str, str]]:
    """A line and the details of every data set, as ``a2g prepare --list`` prints them.

    A data set of another package that cannot be loaded has the error as its line, and the others follow.
    """
    for name in all_names():
        try:
            reader = find_data_set(name)
        except InputError as error:
            yield f"{name}: not available: {error}", ""
        else:
            yield f"{name}: {reader.title}, {reader.fps:g} fps", reader.about


def _data_set(found: Any, place: str) -> DataSet:
    if isinstance(found, ModuleType):
        found = getattr(found, "DATASET", found)
    if not isinstance(found, DataSet):
        kind = f"module {found.__name__} without DATASET" if isinstance(found, ModuleType) else type(found).__name__
        raise InputError(f"{place}: expected a DataSet; got {kind}; see docs/your_data_set.md.")
    return found


def _of_file(path: Path) -> DataSet:
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; name a Python file that defines DATASET.")
    # Under a name of its own, so that worker processes find the reader's functions again.
    name = f"a2g_reader_{path.stem}"
    module = sys.modules.get(name)
    if module is None or module.__file__ != str(path.resolve()):
        spec = spec_from_file_location(name, path.resolve())
        assert spec is not None
        assert spec.loader is not None
        module = module_from_spec(spec)
        sys.modules[name] = module
        try:
            spec.loader.exec_module(module)
        except Exception as error:
            del sys.modules[name]
            raise InputError(f"{path}: does not run ({type(error).__name__}: {error}); fix it.") from error
    found = getattr(module, "DATASET", None)
    if not isinstance(found, DataSet):
        raise InputError(f"{path}: defines no DATASET = DataSet(...); see docs/your_data_set.md.")
    return found
