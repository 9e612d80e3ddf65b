"""Memory limits of untrusted files, and the messages of refusals."""

from dataclasses import dataclass

from a2g_jax.errors import InputError
from a2g_jax.io.untrusted.refused import RefusedError

#: Remedy for content that is refused although the file is not damaged.
CONVERT = "convert it where you trust it: load it there and save its arrays with numpy.savez"


@dataclass(frozen=True)
class Limits:
    """Bounds on what one file, or one value of a database, may decode to.

    Attributes:
        size: bytes of memory, roughly; a part that is shared within a value counts once for each reference.
        depth: levels of nested containers.
        steps: opcodes and elements of containers, which bounds the time to about two seconds.
    """

    size: int = 2 * 2**30
    depth: int = 50
    steps: int = 2_000_000


class Budget:
    """Memory left for one value, and the name of its source for errors."""

    def __init__(self, name: str, limits: Limits) -> None:
        self.name = name
        self.limits = limits
        self.left = limits.size
        self.most = limits.size
        self.steps = limits.steps

    def bound(self, size: int) -> None:
        """Lower the limit to ``size`` bytes."""
        self.left = self.most = min(self.most, size)

    def charge(self, size: int, at: int) -> None:
        """Account for ``size`` more bytes, needed at byte ``at`` of the data.

        Raises:
            InputError: the limit is exceeded.
        """
        self.left -= size
        if self.left < 0:
            raise self.error(
                at, f"would take more than {self.most} bytes of memory; if you trust the file, raise the limit."
            )

    def work(self, steps: int, at: int) -> None:
        """Account for ``steps`` more elements to be visited.

        Raises:
            InputError: the limit is exceeded.
        """
        self.steps -= steps
        if self.steps < 0:
            raise self.error(
                at, f"takes more than {self.limits.steps} steps to read; if you trust the file, raise the limit."
            )

    def refused(self, at: int, message: str) -> RefusedError:
        """An error for content that is not built."""
        return RefusedError(str(self.error(at, message)))

    def error(self, at: int, message: str) -> InputError:
        """An error that names the data, the byte and the fault."""
        return InputError(f"{self.name}, byte {at}: {message}")

    def damage(self, at: int, what: str) -> InputError:
        """An error for data that is inconsistent or ends too early."""
        return self.error(at, f"is damaged ({what}); copy or download it again.")


def clip(value: object, longest: int = 80) -> str:
    """A value from a file for a message: short, on one line, and without the content of containers."""
    if isinstance(value, str | bytes):
        shown = repr(value[:longest])
        return shown if len(shown) <= longest else shown[: longest - 3] + "..."
    if type(value) is tuple and len(value) <= 8 and all(type(part) is int for part in value):
        return f"({', '.join(clip(part) for part in value)})"
    if type(value) is int:
        return str(value) if abs(value) < 2**64 else "a number beyond 64 bits"
    return f"a {type(value).__name__}"
