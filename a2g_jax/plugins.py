"""Objects of other packages, found by entry point or as ``module:name``.

Loading one runs its package's code. References therefore come from the command line or from installed packages, never
from a corpus, a run or another file.
"""

from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from a2g_jax.errors import InputError

DATA_SETS = "a2g_jax.data_sets"
MODELS = "a2g_jax.models"
METRICS = "a2g_jax.metrics"


def entry_points_of(group: str) -> dict[str, EntryPoint]:
    """Entry points of installed packages by name, sorted; nothing is imported.

    Where two packages offer the same name, the first on ``sys.path`` counts, as for imports.

    Args:
        group: such as :data:`DATA_SETS`.
    """
    found: dict[str, EntryPoint] = {}
    for point in entry_points(group=group):
        found.setdefault(point.name, point)
    return dict(sorted(found.items()))


def load_entry_point(point: EntryPoint, what: str) -> Any:
    """The object or module of an entry point.

    Args:
        what: its kind for messages, such as ``"data set"``.

    Raises:
        InputError: it cannot be loaded; the message names the package.
    """
    try:
        return point.load()
    except Exception as error:
        raise InputError(f"{describe(point, what)}: cannot be loaded ({_line(error)}); fix or remove it.") from error


def describe(point: EntryPoint, what: str) -> str:
    """Where an entry point comes from, for messages: its kind, name, package and reference."""
    package = f"the package {point.dist.name} {point.dist.version}" if point.dist else "an installed package"
    return f"{what} {point.name!r} of {package} ({point.value})"


def load_object(reference: str, what: str) -> Any:
    """The object of a reference ``module:name``, or the module of a reference without a name.

    Args:
        reference: dots in ``name`` are attributes of attributes.
        what: its kind for messages, such as ``"data set"``.

    Raises:
        InputError: no such module or name, or the module cannot be imported.
    """
    module_name, _, name = reference.partition(":")
    try:
        found: Any = import_module(module_name)
    except Exception as error:
        missing = error.name if isinstance(error, ModuleNotFoundError) else None
        if missing and f"{module_name}.".startswith(f"{missing}."):
            raise InputError(
                f"{what} {reference}: there is no module {missing!r}; install its package, or add its folder to"
                " PYTHONPATH."
            ) from None
        raise InputError(f"{what} {reference}: {module_name} cannot be imported ({_line(error)}); fix it.") from error
    for part in name.split(".") if name else ():
        if not hasattr(found, part):
            raise InputError(f"{what} {reference}: {module_name} defines no {name}; check the name.")
        found = getattr(found, part)
    return found


def _line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
