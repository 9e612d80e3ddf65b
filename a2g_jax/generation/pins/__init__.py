"""Clips pinned to moments of a generated motion, for runs of any model that moves a skeleton."""
