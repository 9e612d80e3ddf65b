"""Errors for invalid input and interruptions, and warnings of doubtful input."""


class A2GError(Exception):
    """Base of the package's own errors; the command line prints one as a single line and exits with status 2."""


class Interrupted(A2GError):
    """Work was interrupted from outside, after saving its state."""


class InputError(A2GError, ValueError):
    """A file or value that cannot be used: the message names it, the place in it and the fix."""


class OutputError(InputError):
    """A place that cannot be written to: a full or read-only disk, or missing permissions."""


class InputWarning(UserWarning):
    """A file that can be used, with a doubt; the command line prints one as a single line and goes on."""


def brief(value: object, longest: int = 80) -> str:
    """A value from a file for a message: its text on one line, shortened."""
    text = " ".join(str(value).split())
    return text if len(text) <= longest else text[: longest - 3] + "..."
