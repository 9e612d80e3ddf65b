"""Clips performed in generated motion: distance, transitions, and clips made absurd on purpose."""
