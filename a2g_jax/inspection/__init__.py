"""Contents of files, folders, corpora and runs, with their faults: ``a2g inspect``."""
