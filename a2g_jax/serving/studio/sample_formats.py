"""Formats of the files of a sample."""

from a2g_jax.errors import InputError
from a2g_jax.generation.formats import PAGE, known_formats, motion_format
from a2g_jax.plugins import load_object


def formats() -> tuple[str, ...]:
    """Formats of a sample's files."""
    return tuple(name for name in known_formats() if name != PAGE)


def slow_formats() -> tuple[str, ...]:
    """Formats that other programs write, which takes minutes: they are jobs."""
    return tuple(name for name in formats() if (found := motion_format(name)) is not None and found.check)


def missing_programs() -> dict[str, str]:
    """Why formats cannot be written here, by format."""
    reasons = {}
    for name in slow_formats():
        found = motion_format(name)
        assert found is not None
        try:
            load_object(found.check, "check")()
        except InputError as error:
            reasons[name] = str(error)
    return reasons
