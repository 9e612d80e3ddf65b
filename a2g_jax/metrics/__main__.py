"""Print ``docs/metrics.md``: ``python -m a2g_jax.metrics > docs/metrics.md``."""

from a2g_jax.metrics.catalogue import METRICS
from a2g_jax.metrics.document import markdown

if __name__ == "__main__":
    print(markdown(METRICS.values()), end="")
