"""Characters: motion for the rigs of other programs."""
