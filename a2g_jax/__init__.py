"""Speech audio to many different, natural co-speech gestures, in JAX."""

__version__ = "0.1.0"
