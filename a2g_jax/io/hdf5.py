"""Arrays in HDF5 files, the format of PATS; needs the optional package h5py.

HDF5 files can refer to other files (external links, external storage, virtual data sets) and to filters that the
library loads as code. All of these are refused here before anything is read, as are sizes beyond the limits: the
headers of all arrays are read first. The C library parses the file's structure without a check from Python, and
changed bytes can crash it (in 2 of 4 trials with 700 damaged files each, h5py 3.16), so it runs in a process of its
own (:mod:`a2g_jax.io.hdf5_process`).
"""

import os
from collections.abc import Sequence
from importlib.util import find_spec

import numpy as np

from a2g_jax.errors import InputError
from a2g_jax.io.files import check_readable
from a2g_jax.io.hdf5_process import read_apart
from a2g_jax.io.untrusted.budget import Limits

#: Memory that a file may take: this, and so much for each of its bytes.
_LEAST, _TIMES = 2**28, 100


def read_hdf5(
    path: str | os.PathLike[str], names: Sequence[str], limits: Limits | None = None
) -> dict[str, np.ndarray]:
    """Arrays of numbers, booleans or text in an HDF5 file.

    Args:
        path: the file.
        names: paths of data sets in it, such as ``pose/data``.
        limits: bounds on all of them together.

    Returns:
        The arrays by name; text (of fixed length only) as NumPy text.

    Raises:
        InputError: h5py is missing; no such file, not an HDF5 file, damaged, or a data set that is missing, stored
            elsewhere, of other types, packed by other filters or beyond the limits.
    """
    path = check_readable(path, "an HDF5 file")
    if not find_spec("h5py"):
        raise InputError(f'{path}: is read with h5py, which is missing; run pip install "a2g_jax[hdf5]".')
    return read_apart(path, names, limits or Limits(size=min(Limits().size, _LEAST + _TIMES * path.stat().st_size)))
