"""Readers of untrusted files: pickles, pyarrow payloads, LMDB databases and NumPy archives.

No reader executes anything from a file. Each builds plain values only (numbers, text, bytes, lists, tuples,
dictionaries, sets and NumPy arrays), refuses everything else by name, and stops at :class:`Limits`. In pickles, a
placeholder that cannot be used takes the place of what is refused.
"""

from a2g_jax.io.untrusted.arrow import decode_arrow as decode_arrow
from a2g_jax.io.untrusted.budget import Limits as Limits
from a2g_jax.io.untrusted.lmdb import LmdbFile as LmdbFile
from a2g_jax.io.untrusted.numpy_files import read_npy as read_npy
from a2g_jax.io.untrusted.numpy_files import read_npz as read_npz
from a2g_jax.io.untrusted.pickles import decode_pickle as decode_pickle
from a2g_jax.io.untrusted.pickles import read_pickle as read_pickle
from a2g_jax.io.untrusted.refused import check_read as check_read
