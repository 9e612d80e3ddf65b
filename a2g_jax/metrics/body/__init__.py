"""Whether a motion stays within what a body does: figures of each frame, bounds, and findings outside them."""
