"""Network layers, as Flax Linen modules used through ``init`` and ``apply`` only."""
