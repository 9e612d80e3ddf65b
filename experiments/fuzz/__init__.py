"""Damaged and hostile files, each read in a process of its own: what comes of them, and what they cost."""
