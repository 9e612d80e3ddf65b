"""BVH motion files: :func:`read_bvh` and :func:`write_bvh`."""

from a2g_jax.io.bvh_reader import read_bvh as read_bvh
from a2g_jax.io.bvh_writer import write_bvh as write_bvh
