"""The length of the blocks in which generation draws noise and cuts windows; importable without JAX."""

#: Windows of generation start at multiples of this many frames, and noise is drawn in blocks of as many.
BLOCK = 128
