"""Readers of the field's data sets, one module each; found by name with :func:`find_data_set`."""

import sys
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from a2g_jax.data.datasets.source import SPLITS as SPLITS
from a2g_jax.data.datasets.source import DataSet as DataSet
from a2g_jax.data.datasets.source import Take as Take
from a2g_jax.errors import InputError

_MODULES: dict[str, str] = {
    "folder": "folder",
    "trinity": "trinity",
    "genea2022": "genea2022",
    "genea2023": "genea2023",
    "beat": "beat",
    "beat2": "beat2",
    "zeroeggs": "zeroeggs",
    "ted": "ted",
    "ted-expressive": "ted_expressive",
    "s2g": "s2g",
    "pats": "pats",
    "show": "show",
}
"""Which module reads the data set of a name."""


#: All that can be asked for.
NAMES = tuple(_MODULES)


def find_data_set(name: str) -> DataSet:
    """The reader of a data set.

    Args:
        name: one of :data:`NAMES`, or a Python file of your own that defines ``DATASET``.

    Raises:
        InputError: there is none of that name, or the file does not define one.
    """
    if name.endswith(".py"):
        return _own_reader(Path(name))
    if name not in _MODULES:
        raise InputError(f"no data set {name!r}; there are: {', '.join(_MODULES)}, or a Python file of your own.")
    return import_module(f"a2g_jax.data.datasets.{_MODULES[name]}").DATASET


def _own_reader(path: Path) -> DataSet:
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
            raise InputError(f"{path}: does not run ({type(error).__name__}: {error}); mend it.") from error
    found = getattr(module, "DATASET", None)
    if not isinstance(found, DataSet):
        raise InputError(f"{path}: defines no DATASET = DataSet(...); see docs/your_data_set.md.")
    return found
