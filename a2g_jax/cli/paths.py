"""Checks that inputs exist and outputs can be written, before anything heavy is imported; the library checks the rest.

The messages are those of :func:`~a2g_jax.io.files.check_readable`, :func:`~a2g_jax.training.run.load_run` and
:meth:`~a2g_jax.data.corpus.Corpus.open`.
"""

from collections.abc import Collection
from pathlib import Path

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_folder_writable
from a2g_jax.training.run_file import SHIPPED, SHIPPED_FEATURES, no_run


def existing_file(path: str | None, remedy: str = "check the path") -> None:
    """Refuse a file that does not exist; None passes.

    Raises:
        InputError: there is no such file or folder.
    """
    if path is not None and _missing(Path(path)):
        raise InputError(f"{Path(path)}: there is no such file; {remedy}.")


def existing_folder(path: str) -> None:
    """Refuse a folder that does not exist.

    Raises:
        InputError: there is no such file or folder.
    """
    if _missing(Path(path)):
        raise InputError(f"{Path(path)}: there is no such folder; check the path.")


def existing_run(name: str | None, shipped: Collection[str] = SHIPPED) -> None:
    """Refuse what is neither a run folder nor the name of a run that comes with the package; None passes.

    Raises:
        InputError: no ``run.json`` in the folder.
    """
    if name is not None and name not in shipped and not (Path(name) / "run.json").is_file():
        raise no_run(Path(name), shipped)


def existing_features(name: str | None) -> None:
    """Refuse what is neither a run folder nor the feature network that comes with the package; None passes.

    Raises:
        InputError: no ``run.json`` in the folder.
    """
    existing_run(name, SHIPPED_FEATURES)


def existing_corpus(path: str | None) -> None:
    """Refuse what is not a corpus folder; None passes.

    Raises:
        InputError: no ``manifest.json`` in the folder.
    """
    if path is not None and not (Path(path) / "manifest.json").is_file():
        raise InputError(f"{Path(path)}: is not a corpus (no manifest.json in it); make one with 'a2g prepare'.")


def existing_report(folder: str) -> None:
    """Refuse what is not a report folder.

    Raises:
        InputError: no ``report.json`` in the folder.
    """
    if not (Path(folder) / "report.json").is_file():
        raise InputError(f"{Path(folder)}: is no report (no report.json in it); make one with 'a2g evaluate RUN ...'.")


def writable_folder(path: str | None) -> None:
    """Refuse a folder for output that cannot be written to or created; None passes.

    Raises:
        InputError: it or one of its parents is a file.
        OutputError: nothing can be written there.
    """
    if path is not None:
        check_folder_writable(path)


def writable_file(path: str | None) -> None:
    """Refuse a file for output whose folder cannot be written to; None passes.

    Raises:
        InputError: it is a folder, or its folder is a file.
        OutputError: nothing can be written there.
    """
    if path is None:
        return
    if Path(path).is_dir():
        raise InputError(f"{Path(path)}: is a folder; name a file in it.")
    check_folder_writable(Path(path).parent)


def _missing(path: Path) -> bool:
    try:
        path.stat()
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        # The library's message says what is wrong: a folder without permission, a null character.
        return False
    return False
