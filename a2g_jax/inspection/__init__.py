"""What is in a file, a folder, a corpus or a run, and what may be wrong with it: ``a2g inspect``."""
