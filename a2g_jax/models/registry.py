"""The models, by the names of the command line; importable without JAX.

A model of another package is found through an entry point of the group ``a2g_jax.models``, or is named
``package.module:ENTRY`` on the command line. A run folder imports no other code: the model that it names has to be
of this package or an entry point, or be allowed by
``A2G_MODELS=package.module:ENTRY`` (comma-separated) in the environment.
"""

import os
from importlib import import_module

from a2g_jax.errors import InputError, brief
from a2g_jax.models.entry import Entry
from a2g_jax.plugins import MODELS as GROUP
from a2g_jax.plugins import entry_points_of, load_entry_point, load_object

#: The folder of each model, whose ``ENTRY`` describes it.
MODELS: dict[str, str] = {
    "audio2gestures": "a2g_jax.models.audio2gestures",
    "speech2gesture": "a2g_jax.models.speech2gesture",
    "stylized_flow": "a2g_jax.models.stylized_flow",
    "emotion_gesture": "a2g_jax.models.emotion_gesture",
    "motion_autoencoder": "a2g_jax.models.motion_autoencoder",
    "emotion_classifier": "a2g_jax.models.emotion_classifier",
}


def model_names() -> tuple[str, ...]:
    """Names of the models of this package and of others that are installed."""
    return (*MODELS, *(name for name in entry_points_of(GROUP) if name not in MODELS))


def find_model(name: str) -> Entry:
    """The entry of a model that the user names; see :func:`find_trained_model` for names in files.

    Args:
        name: of this package's models, of an entry point, or ``package.module:ENTRY``, which is imported.

    Raises:
        InputError: no model of that name, or another package's that cannot be imported.
    """
    if name in MODELS:
        entry: Entry = import_module(MODELS[name]).ENTRY
        return entry
    if ":" in name:
        found = load_object(name, "model")
        _allowed.add(name)
    elif name in (others := entry_points_of(GROUP)):
        found = load_entry_point(others[name], "model")
    else:
        raise InputError(
            f"no model {brief(repr(name))}; there are: {', '.join(model_names())}, or package.module:ENTRY."
        )
    if not isinstance(found, Entry):
        raise InputError(f"model {name}: expected an a2g_jax.models.entry.Entry; got {type(found).__name__}.")
    return found


#: References that the command line has named in this process.
_allowed: set[str] = set()


def find_trained_model(name: str, where: str) -> Entry:
    """The entry of a model that a file names.

    Args:
        where: the file, for the error.

    Raises:
        InputError: no model of that name, or a reference to another package that is not allowed.
    """
    allowed = {*_allowed, *(part.strip() for part in os.environ.get("A2G_MODELS", "").split(","))}
    if ":" in name and name not in allowed:
        raise InputError(
            f"{where}: is of the model {brief(name)}, code of another package; if you trust it, set"
            f" A2G_MODELS={brief(name)}."
        )
    try:
        return find_model(name)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
