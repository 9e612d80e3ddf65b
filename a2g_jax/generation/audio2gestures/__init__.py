"""Generation with a trained Audio2Gestures: its latent space, and clips pinned to the timeline."""
