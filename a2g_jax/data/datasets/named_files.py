"""The files of a data set by the names of its recordings, in any folders."""

import os
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from a2g_jax.errors import InputError

#: The files of recordings: by the recording's name, then by suffix (in lower case).
NamedFiles = dict[str, dict[str, Path]]


def list_files(folder: Path, expected: str) -> list[Path]:
    """Every file under a folder, sorted by path; links are followed, hidden files and folders are not.

    Args:
        expected: the folder that the user should name, for the message.

    Raises:
        InputError: no such folder, or no permission to read a folder in it.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; name {expected}.")

    def refuse(error: OSError) -> None:
        raise InputError(f"{error.filename}: cannot be read ({error.strerror}); change its permissions.")

    result: list[Path] = []
    visited: set[str] = set()
    for place, folders, names in os.walk(folder, onerror=refuse, followlinks=True):
        real = os.path.realpath(place)
        if real in visited:  # links that form a circle, or lead twice to one place
            folders.clear()
            continue
        visited.add(real)
        folders[:] = sorted(name for name in folders if not name.startswith((".", "__MACOSX")))
        result += [Path(place, name) for name in names if not name.startswith(".")]
    return sorted(result)


def files_by_name(files: Sequence[Path], name_of: Callable[[str], str | None], suffixes: Collection[str]) -> NamedFiles:
    """The files of each recording, in the order of the recordings' names; other files are left out.

    Args:
        name_of: the recording's name from a file's name without its suffix, None for a file of something else.
        suffixes: those of recordings, in lower case with their dot.

    Raises:
        InputError: two files of one recording and suffix.
    """
    result: NamedFiles = {}
    for path in files:
        suffix = path.suffix.lower()
        name = name_of(path.stem) if suffix in suffixes else None
        if name is None:
            continue
        other = result.setdefault(name, {}).setdefault(suffix, path)
        if other is not path:
            raise InputError(
                f"{other} and {path}: are both {name}; remove one, or name a folder that holds one of them."
            )
    return dict(sorted(result.items()))


def require(files: Mapping[str, Path], suffix: str, kind: str) -> Path:
    """The file of a recording with a suffix.

    Raises:
        InputError: there is none; the message names another file of the recording.
    """
    if suffix not in files:
        raise InputError(f"{min(files.values())}: has no {kind} of the same name; add or remove it.")
    return files[suffix]


def without_motion(files: NamedFiles, is_test: Callable[[str], bool]) -> set[str]:
    """Names of the test recordings, if none of them has motion, as when challenges first release their test set.

    A warning counts them. Where only some lack motion, files are missing, and the result is empty.
    """
    tests = {name for name in files if is_test(name)}
    if not tests or any(".bvh" in files[name] for name in tests):
        return set()
    warnings.warn(f"{len(tests)} test recordings have no motion and are left out: {min(tests)} ...", stacklevel=3)
    return tests
