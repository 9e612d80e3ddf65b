"""``a2g studio``: a local page that generates motions for speech, compares and ranks them, and offers their files."""
