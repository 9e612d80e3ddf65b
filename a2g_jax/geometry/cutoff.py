"""The usual cutoff of a low-pass filter on motion; apart, so that the command line starts without SciPy."""

CUTOFF = 6.0
"""Hz: gestures have almost all of their energy below."""
