"""The files of ``a2g talk``: a generated recording, several right motions, and the page."""
