"""Generators as StableHLO programs with weights, which run without the code of their models."""
