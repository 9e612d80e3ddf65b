"""Several files that take the place of earlier ones together, once all of them are written."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from a2g_jax.errors import InputError, OutputError
from a2g_jax.io.files import make_folder, unwritable
from a2g_jax.io.temporary import remove, temporary_path


@contextmanager
def staged(
    out: str | os.PathLike[str],
    replaced: Callable[[str], bool] = lambda name: False,
    keep: tuple[type[BaseException], ...] = (),
) -> Iterator[Path]:
    """Write files into a hidden folder, which move to ``out`` when the block ends well; else ``out`` stays as it was.

    Args:
        out: the folder, made if needed, and removed again if nothing comes into it.
        replaced: whether a file of that name in ``out`` belongs to an earlier call, and is removed.
        keep: errors after which the files that are there move as well, unless the disk is full.

    Yields:
        The hidden folder.

    Raises:
        InputError: ``out`` is no folder; and errors of the block, in which ``out`` stands for the hidden folder.
        OutputError: a full disk, or a folder that cannot be written to.
    """
    new = not Path(out).exists()
    folder = make_folder(out)
    hidden = temporary_path(folder / "files")
    try:
        hidden.mkdir()
        try:
            yield hidden
        except keep as error:
            if not isinstance(error, OutputError) and any(hidden.iterdir()):
                _move(hidden, folder, replaced)
            raise
        _move(hidden, folder, replaced)
    except InputError as error:
        if str(hidden) not in str(error):
            raise
        raise type(error)(str(error).replace(str(hidden), str(folder))) from error
    except OSError as error:
        raise unwritable(out, error) from error
    finally:
        remove(hidden)
        if new:
            with suppress(OSError):  # files are in it
                folder.rmdir()


def _move(hidden: Path, folder: Path, replaced: Callable[[str], bool]) -> None:
    # A page is last, since it shows the others.
    new = sorted(hidden.iterdir(), key=lambda path: (path.suffix == ".html", path.name))
    names = {path.name for path in new}
    for old in list(folder.iterdir()):
        if old.name not in names and replaced(old.name) and not old.is_dir():
            old.unlink()
    for path in new:
        path.replace(folder / path.name)
