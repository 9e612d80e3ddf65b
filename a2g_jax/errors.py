"""Errors for invalid input and interruptions, and warnings of doubtful input."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches


class A2GError(Exception):
    """Base of the package's own errors; the command line prints one as a single line and exits with status 2."""


class Interrupted(A2GError):
    """Work was interrupted from outside, after saving its state."""


class InputError(A2GError, ValueError):
    """A file or value that cannot be used: the message names it, the place in it and the fix."""


class UnknownFlag(InputError):
    """A flag that is neither one of the command nor a setting; ``flags`` are the settings that there are."""

    def __init__(self, flag: str, flags: Sequence[str], hint: str) -> None:
        """
        Args:
            hint: the command that lists the settings.
        """
        self.flag, self.flags, self.hint = flag, tuple(flags), hint
        super().__init__(f"no setting {flag}; {hint} lists them.")

    def among(self, flags: Iterable[str]) -> str:
        """The message with the most similar flag, of the settings and of others."""
        similar = get_close_matches(self.flag, [*flags, *self.flags], 1, 0.7)
        question = f"; did you mean {similar[0]}?" if similar else "."
        return f"there is no flag {self.flag}{question} Settings of the model: {self.hint}."


class OutputError(InputError):
    """A place that cannot be written to: a full or read-only disk, or missing permissions."""


class InputWarning(UserWarning):
    """A file that can be used, with a doubt; the command line prints one as a single line and continues."""


def brief(value: object, longest: int = 80) -> str:
    """A value from a file for a message: its text on one line, shortened."""
    text = " ".join(str(value).split())
    return text if len(text) <= longest else text[: longest - 3] + "..."
