"""What a file may make this package hold, and how a refusal reads."""

from dataclasses import dataclass

from a2g_jax.errors import InputError

#: The mend that fits whatever is refused because of what it is, not because of damage.
CONVERT = "convert it where you trust it: load it there and save its arrays with numpy.savez"


@dataclass(frozen=True)
class Limits:
    """Bounds on what one file, or one value of a database, may decode to.

    Attributes:
        size: bytes of memory, roughly; what is shared within a value counts each time it is reached.
        depth: containers within containers.
    """

    size: int = 2 * 2**30
    depth: int = 50


class Budget:
    """The memory that is left for one value, and the name that its errors carry."""

    def __init__(self, name: str, limits: Limits) -> None:
        self.name = name
        self.limits = limits
        self.left = limits.size

    def charge(self, size: int, at: int) -> None:
        """Account for ``size`` more bytes, asked for at byte ``at`` of the data.

        Raises:
            InputError: that is more than the limit leaves.
        """
        self.left -= size
        if self.left < 0:
            raise self.error(
                at, f"would take more than {self.limits.size} bytes of memory; if you trust the file, raise the limit."
            )

    def error(self, at: int, message: str) -> InputError:
        """The error that names the data, the byte and the fault."""
        return InputError(f"{self.name}, byte {at}: {message}")

    def damage(self, at: int, what: str) -> InputError:
        """The error for data that contradicts itself or ends too early."""
        return self.error(at, f"is damaged ({what}); copy or download it again.")


def clip(value: object, longest: int = 80) -> str:
    """What a message shows of a value from a file: short, on one line, and never walking into containers."""
    if isinstance(value, str | bytes):
        shown = repr(value[:longest])
        return shown if len(shown) <= longest else shown[: longest - 3] + "..."
    if type(value) is tuple and len(value) <= 8 and all(type(part) is int for part in value):
        return f"({', '.join(clip(part) for part in value)})"
    if type(value) is int:
        return str(value) if abs(value) < 2**64 else "a number beyond 64 bits"
    return f"a {type(value).__name__}"
