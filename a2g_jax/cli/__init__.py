"""The ``a2g`` command; JAX and NumPy are imported once a command has checked its arguments."""

from a2g_jax.cli.parser import main as main
