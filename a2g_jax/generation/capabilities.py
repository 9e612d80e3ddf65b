"""What can be requested of a run: controls, emotions, styles, seed clips, pins and sampling settings.

Programs with a form, such as ``a2g studio``, show the fields that a run has a use for.
"""

import dataclasses
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from a2g_jax.config import describe_settings, flag_of
from a2g_jax.errors import InputError
from a2g_jax.generation.controls import controls_of
from a2g_jax.generation.engine import check_generates
from a2g_jax.models.control_curves import public_name
from a2g_jax.training.run import Run

#: Settings that have fields of their own in every form.
_OWN = ("controls", "emotion")


@dataclass(frozen=True)
class Setting:
    """A sampling setting of a run."""

    name: str
    """Of its flag, without dashes."""
    value: Any
    """That of the run."""
    kind: str
    """``bool``, ``int``, ``float`` or ``str``."""
    optional: bool
    """Whether it can be none."""
    repeat: bool
    """Whether it is a list."""
    about: str


@dataclass(frozen=True)
class Capabilities:
    """What can be requested of a run."""

    title: str = ""
    """Model and frame rate."""
    controls: tuple[str, ...] = ()
    """Names of controls with quantiles from 0 to 1 as values."""
    categories: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)
    """Names of controls with other values, and those."""
    emotions: tuple[str, ...] = ()
    """Values of the sampling setting ``emotion``, besides blends and timelines of them."""
    styles: bool = False
    """Whether motions can take on the style of a clip."""
    seed_clips: bool = False
    """Whether motions can continue a clip."""
    pins: bool = True
    """Whether clips can be performed in the motions."""
    settings: tuple[Setting, ...] = ()


def capabilities(run: Run) -> Capabilities:
    """What can be requested of a run.

    Raises:
        InputError: the run generates no motion of a skeleton from audio.
    """
    config = run.config
    _ = config.skeleton
    model = check_generates(run)
    names: tuple[str, ...] = ()
    categories: Mapping[str, tuple[str, ...]] = {}
    try:
        controls = controls_of(run)
        names, categories = controls.names, {public_name(name): values for name, values in controls.categories.items()}
    except InputError:
        pass  # none, or weights that store too little for them
    stored = config.sampling_settings
    has_emotion = any(field.name == "emotion" for field in dataclasses.fields(stored))
    emotions = tuple(config.corpus.get("emotions", ())) if has_emotion else ()
    # Where there is a setting, the control of its name sets the same.
    choices = {name: values for name, values in categories.items() if name != "emotion" or not emotions}
    return Capabilities(
        title=f"{config.model}, {config.fps:g} frames a second",
        controls=tuple(public_name(name) for name in names if public_name(name) not in categories),
        categories=choices,
        emotions=emotions,
        styles=model.encode is not None,
        seed_clips=model.seed_frames > 0,
        settings=tuple(_settings(stored, dataclasses.asdict(config.model_config))),
    )


def _settings(stored: Any, model: Mapping[str, Any]) -> list[Setting]:
    """Those with an effect on the run."""
    hints, about = typing.get_type_hints(type(stored)), describe_settings(type(stored))
    found = []
    for field in dataclasses.fields(stored):
        needs = field.metadata.get("needs")
        if field.name in _OWN or (needs and not model.get(needs)):
            continue
        parts = [kind for kind in typing.get_args(hints[field.name]) if kind is not type(None)]
        optional = type(None) in typing.get_args(hints[field.name])
        kind = parts[0] if parts else hints[field.name]
        found.append(
            Setting(
                name=flag_of(field).removeprefix("--"),
                value=getattr(stored, field.name),
                kind=getattr(kind, "__name__", "str"),
                optional=optional,
                repeat=typing.get_origin(hints[field.name]) is tuple,
                about=about.get(field.name, ""),
            )
        )
    return found
