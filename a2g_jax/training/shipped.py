"""Names of the trained networks that come with the package; importable without JAX."""

#: Runs that :func:`~a2g_jax.training.run.open_run` opens by name.
SHIPPED_RUNS = ("demo", "demo-flow")
#: The run of ``motion_autoencoder`` that :func:`~a2g_jax.training.perceptual.load_feature_run` opens by name.
SHIPPED_FEATURES = "demo"
