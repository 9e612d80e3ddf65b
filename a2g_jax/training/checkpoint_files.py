"""The files of a checkpoint with their hashes, in a file beside it."""

from pathlib import Path
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.io.hashes import sha256_blocks
from a2g_jax.io.sealed import read_sealed, write_sealed

_FORMAT = "a2g_jax checkpoint"


def list_path(checkpoint: Path) -> Path:
    """The file with the hashes of a checkpoint's files."""
    return checkpoint.with_name(f"{checkpoint.name}.json")


def write_list(folder: Path, checkpoint: Path) -> None:
    """Write the sizes and hashes of the files in ``folder``, which are to be, or are, those of ``checkpoint``."""
    write_sealed(list_path(checkpoint), {"format": _FORMAT, "files": _files(folder)})


def check_files(checkpoint: Path) -> None:
    """Compare a checkpoint's files with the list.

    Raises:
        InputError: the list is missing or damaged, or the first file that is changed, missing or added.
    """
    place = list_path(checkpoint)
    if not place.is_file():
        raise _unusable(checkpoint, f"{place.name}, the list of its files, is missing")
    try:
        listed: Any = read_sealed(place, ("files",)).get("files")
        expected = {str(name): [int(one[0]), str(one[1])] for name, one in listed.items()}
    except InputError as error:
        raise _unusable(checkpoint, str(error).rstrip(".")) from None
    except (AttributeError, TypeError, ValueError, IndexError, KeyError):
        raise _unusable(checkpoint, f"{place.name}, the list of its files, is damaged") from None
    sizes = {path.relative_to(checkpoint).as_posix(): path.stat().st_size for path in _paths(checkpoint)}
    for name in sorted({*expected, *sizes}):
        if name not in sizes:
            raise _unusable(checkpoint, f"{name} is missing")
        if name not in expected:
            raise _unusable(checkpoint, f"{name} is none of its files")
        if sizes[name] != expected[name][0]:
            raise _unusable(checkpoint, f"{name} has {sizes[name]} bytes in place of {expected[name][0]}")
        if sha256_blocks(checkpoint / name) != expected[name][1]:
            raise _unusable(checkpoint, f"{name} differs from its hash")


def _files(folder: Path) -> dict[str, list[Any]]:
    return {path.relative_to(folder).as_posix(): [path.stat().st_size, sha256_blocks(path)] for path in _paths(folder)}


def _paths(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if not path.is_dir())


def _unusable(checkpoint: Path, reason: str) -> InputError:
    return InputError(
        f"{checkpoint}: cannot be resumed from ({reason}); restore it, remove this folder to resume from the one before"
        " it, or start again without --resume."
    )
