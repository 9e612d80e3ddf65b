"""Names of data sets. Imports no reader, so that the command line can check a name at once."""

from a2g_jax.plugins import DATA_SETS, entry_points_of

MODULES: dict[str, str] = {
    "folder": "folder",
    "trinity": "trinity",
    "genea2022": "genea2022",
    "genea2023": "genea2023",
    "beat": "beat",
    "beat2": "beat2",
    "zeroeggs": "zeroeggs",
    "ted": "ted",
    "ted-expressive": "ted_expressive",
    "ted-emotion": "ted_emotion",
    "s2g": "s2g",
    "pats": "pats",
    "show": "show",
}
"""Modules of :mod:`a2g_jax.data.datasets` by the name of the data set that they read."""

NAMES = tuple(MODULES)
"""Data sets of this package."""


def all_names() -> tuple[str, ...]:
    """Data sets of this package, then those of other packages (entry points of ``a2g_jax.data_sets``)."""
    return (*NAMES, *(name for name in entry_points_of(DATA_SETS) if name not in (*NAMES, "talker")))


def is_reference(text: str) -> bool:
    """Whether it refers to a reader outside the list: a Python file, or ``module:name``."""
    return text.endswith(".py") or ":" in text
