"""Names of the file formats that ``a2g generate`` and ``a2g talk`` write; importable without JAX."""

from a2g_jax.errors import InputError

FORMATS = ("bvh", "npz", "html")
TALK_FORMATS = ("wav", "textgrid", "json", "bvh", "npz", "html")


def check_formats(text: str, known: tuple[str, ...] = FORMATS) -> tuple[str, ...]:
    """The formats in a comma-separated list.

    Args:
        text: such as ``"bvh,npz"``.
        known: the names that may be in it.

    Raises:
        InputError: no format, or an unknown one.
    """
    formats = tuple(part.strip().lower() for part in text.split(",") if part.strip())
    for name in formats:
        if name not in known:
            raise InputError(f"no format {name!r}; there are: {', '.join(known)}.")
    if not formats:
        raise InputError(f"no format in {text!r}; name at least one of {', '.join(known)}.")
    return formats
