"""Layers of a conditional normalising flow over time (Glow, MoGlow): forward, inverse and log-determinant.

Parameters are dictionaries of arrays; log-determinants are per frame.
"""
