"""Characters: files with the rig that motions are written for."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from a2g_jax.errors import InputError

if TYPE_CHECKING:
    from a2g_jax.geometry.motion import Motion
    from a2g_jax.geometry.retarget import Rig
    from a2g_jax.io.gltf.figure import Surface

#: Suffixes of the files that are read, with what is written for each.
SUFFIXES = {".bvh": ".bvh", ".glb": ".glb", ".vrm": ".glb"}
#: Metres in one unit of a file.
UNITS = {"cm": 0.01, "m": 1.0}


@runtime_checkable
class Character(Protocol):
    """The interface of a file with a rig."""

    path: Path
    suffix: str
    """Of the files that are written."""
    rig: "Rig"
    metres: float
    """In one unit of the rig's lengths."""

    def notes(self) -> list[str]:
        """What is to be noticed about the file, a sentence each."""
        ...

    def surfaces(self) -> "list[Surface]":
        """The meshes in the rig's reference pose, in the plain axes of
        :func:`~a2g_jax.geometry.retarget.upright.upright_motion` and metres; empty for a kind of file without meshes.

        Raises:
            InputError: there are none, or they cannot be read.
        """
        ...

    def write(self, path: Path, motion: "Motion") -> dict[str, float]:
        """Write a motion of the rig's skeleton; returns the largest error in degrees of joints that have too few
        channels for it."""
        ...


def character_suffix(path: str | os.PathLike[str]) -> str:
    """The suffix of what is written for a character, by its file's name alone.

    Raises:
        InputError: a kind of file that is not read.
    """
    suffix = Path(path).suffix.lower()
    if suffix in SUFFIXES:
        return SUFFIXES[suffix]
    remedy = {
        ".fbx": "convert it in Blender to .glb (glTF Binary), as docs/character.md describes",
        ".blend": "export it from Blender as .glb (glTF Binary)",
        ".gltf": "export it as one binary file, .glb (glTF Binary)",
        ".vrma": "give the character (.vrm) and not an animation",
    }.get(suffix, "give a BVH, GLB or VRM file")
    raise InputError(f"{Path(path)}: characters are read from .bvh, .glb and .vrm files; {remedy}.")


def read_character(path: str | os.PathLike[str], scale: str = "auto") -> Character:
    """Read the rig of a character.

    Args:
        scale: unit of the BVH files that are written: ``cm``, ``m`` or ``auto``, that of the character's file. A GLB
            file comes back in its own unit, which is metres.

    Raises:
        InputError: it cannot be read, has no human body, or another unit is requested of a GLB file.
    """
    metres = UNITS.get(scale)
    if character_suffix(path) == ".bvh":
        from a2g_jax.io.bvh_character import BvhCharacter

        return BvhCharacter(path, metres)
    from a2g_jax.io.gltf.character import GlbCharacter

    character = GlbCharacter(path)
    own = character.metres
    if metres is not None and abs(own / metres - 1) > 0.01:
        unit = "metres" if own == 1 else f"units of {own:g} m"
        raise InputError(
            f"{Path(path)}: its lengths are {unit}, and a GLB file comes back with its own mesh in its own unit; leave"
            " --scale out, or scale the character in your program and export it again."
        )
    return character
