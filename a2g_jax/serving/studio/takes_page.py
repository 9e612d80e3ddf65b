"""The page of samples side by side."""

from collections.abc import Iterable

from a2g_jax.errors import InputError
from a2g_jax.generation.formats import check_page_size
from a2g_jax.serving.studio.takes import Take
from a2g_jax.viz.player.page import moved_points, page_html


def takes_page(shown: Iterable[tuple[Take, int]], title: str) -> str:
    """The page of samples side by side, of one take or several of the same speech: that of ``a2g generate``.

    Raises:
        InputError: no samples, samples of different speeches, or too many for a browser.
    """
    chosen = list(shown)
    if not chosen:
        raise InputError("choose samples to look at.")
    takes = list(dict.fromkeys(take for take, _ in chosen))
    if len({take.request.speech.id for take in takes}) > 1:
        raise InputError("samples of different speeches cannot be played together; choose takes of one speech.")
    first, several = takes[0], len(takes) > 1
    label = "take {}, sample {}" if several else "sample {1}"
    figures = [
        take.figure(sample, label.format(take.number, sample), None if several else sample) for take, sample in chosen
    ]
    check_page_size(len(figures), max(figure.motion.frames for figure in figures), moved_points(figures))
    audio, rate = first.speech()
    return page_html(
        figures,
        audio,
        rate,
        title=title,
        subtitle="" if several else first.outcome.subtitle,
        words=first.words,
        lanes=[lane for take in takes for lane in take.outcome.lanes],
    )
