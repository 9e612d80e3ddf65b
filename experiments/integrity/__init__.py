"""Damage to corpora, runs and checkpoints, and kills of commands: nothing damaged is used, nothing finished is lost."""
