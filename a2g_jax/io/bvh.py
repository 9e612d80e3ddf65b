"""BVH motion files: :func:`read_bvh` and :func:`write_bvh`, and with the layout of another file."""

from a2g_jax.io.bvh_hierarchy import Layout as Layout
from a2g_jax.io.bvh_reader import read_bvh as read_bvh
from a2g_jax.io.bvh_reader import read_with_layout as read_with_layout
from a2g_jax.io.bvh_writer import write_bvh as write_bvh
from a2g_jax.io.bvh_writer import write_like as write_like
