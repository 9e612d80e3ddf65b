"""Problem files as people have them, each with its right outcome: ``python -m experiments.cases``."""
