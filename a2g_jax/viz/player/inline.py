"""The page inside a notebook."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.viz.player.figure import Figure
from a2g_jax.viz.player.page import page_html


@dataclass(frozen=True)
class InlinePage:
    """A page that a notebook shows in a frame."""

    page: str
    """The HTML text."""
    height: int
    """Height of the frame, CSS pixels."""

    def _repr_html_(self) -> str:
        # The text stands in the attribute itself, so that a notebook needs no file beside it.
        source = html.escape(self.page, quote=True)
        return f'<iframe srcdoc="{source}" width="100%" height="{self.height}" style="border: 0"></iframe>'


def show_page(
    figures: Sequence[Figure], audio: Float[np.ndarray, " N"], sample_rate: int, *, height: int = 640, **described: Any
) -> InlinePage:
    """The page of :func:`a2g_jax.write_page` as the output of a notebook's cell.

    Args:
        figures: at least one.
        audio: mono samples in -1 to 1.
        sample_rate: of the audio, samples per second.
        height: of the frame, CSS pixels.
        described: ``title``, ``subtitle``, ``words``, ``lanes`` and ``footer``.

    Raises:
        InputError: what cannot be drawn.
    """
    return InlinePage(page_html(figures, audio, sample_rate, **described), height)
