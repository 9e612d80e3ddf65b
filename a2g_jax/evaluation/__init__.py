"""Scores of models on a held-out split, each beside what trivial and true motions score: ``a2g evaluate``."""
