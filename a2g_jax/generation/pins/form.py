"""The form of a pin on the command line; importable without JAX, so that a typing error is found at once."""

import re
from pathlib import Path

from a2g_jax.errors import InputError

#: A file, a second from 0 on, and optionally the length in seconds.
_FORM = re.compile(r"(?P<path>.+)@(?P<start>\d+\.?\d*|\.\d+)(\+(?P<length>\d+\.?\d*|\.\d+))?")


def parse_pin(text: str) -> tuple[Path, float, float | None]:
    """File, second and length of ``wave.bvh@3.2`` (the whole clip) or ``wave.bvh@3.2+1.5`` (its first 1.5 seconds).

    Raises:
        InputError: another form.
    """
    found = _FORM.fullmatch(text)
    if found is None:
        raise InputError(
            f"--pin {text}: expected a file and a second from 0 on, such as wave.bvh@3.2, or wave.bvh@3.2+1.5 for the"
            " clip's first 1.5 seconds."
        )
    length = found["length"]
    return Path(found["path"]), float(found["start"]), None if length is None else float(length)
