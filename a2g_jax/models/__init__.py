"""Generative models, and networks for metrics: a folder each, and one line in the registry."""

from a2g_jax.models.registry import MODELS as MODELS
from a2g_jax.models.registry import find_model as find_model
