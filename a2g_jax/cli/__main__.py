"""``python -m a2g_jax.cli``."""

import sys

from a2g_jax.cli.parser import main

sys.exit(main())
