"""Choose the tables' settings on seeds and recordings that the tables do not report.

    python -m experiments.audio2gestures.select --corpus CORPUS --features RUN [--seeds 10,11] [--steps 1000]

Every candidate is a change of ``settings.BASE``. It is trained with seeds from 10 on and scored on the validation
split; the tables have seeds 0, 1, 2 and the test split. Of the candidates whose wrists move at least half as fast as
people's, the one with the lowest FGD is chosen; its changes are then written into ``settings.BASE``. Writes
``results/selection.md``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from a2g_jax.errors import InputError
from a2g_jax.models import find_model
from experiments.audio2gestures.settings import BASE
from experiments.tables.claims import over_seeds
from experiments.tables.markdown import compute, render
from experiments.tables.records import current, path_of
from experiments.tables.setting import Variant, arguments, setting

TABLE = "audio2gestures/selection"
#: Seeds of the tables.
REPORTED = (0, 1, 2)
#: Changes of the tables' settings.
_KL = find_model("audio2gestures").presets["tiny"].kl_specific_weight
CANDIDATES: Mapping[str, Mapping[str, Any]] = {
    "the tables' settings": {},
    "diversity x 0.2": {"diversity_weight": 0.2 * BASE["diversity_weight"]},
    "KL of I x 4": {"kl_specific_weight": 4.0 * _KL},
    "KL of I / 4": {"kl_specific_weight": 0.25 * _KL},
}
VARIANTS = {name: Variant({**BASE, **changes}) for name, changes in CANDIDATES.items()}
#: Smallest share of the truth's wrist speed.
LIVELY = 0.5


def check_seeds(seeds: Sequence[int]) -> None:
    """Refuse seeds that the tables report.

    Raises:
        InputError: at least one is reported.
    """
    if reported := sorted(set(seeds) & set(REPORTED)):
        raise InputError(f"--seeds: the tables report {', '.join(map(str, reported))}; choose by others, from 10 on.")


def chosen() -> str | None:
    """The candidate of the lowest FGD among those that move; None if none does."""
    truth = over_seeds(TABLE, "truth", "wrist_speed")
    scores = {}
    for name in CANDIDATES:
        speed, fgd = over_seeds(TABLE, name, "wrist_speed"), over_seeds(TABLE, name, "fgd")
        if truth is not None and speed is not None and fgd is not None and speed[0] >= LIVELY * truth[0]:
            scores[name] = fgd[0]
    return min(scores, key=lambda name: scores[name]) if scores else None


def main() -> None:
    """Train and score what is missing, and write the page."""
    options = arguments("Choice of the tables' settings", seeds="10,11").parse_args()
    where = replace(setting(options), split="validation")
    check_seeds(where.seeds)
    if where.corpus is not None:
        compute(TABLE, VARIANTS, where, options.only.split(",") if options.only else None)
    if not current(TABLE):
        print(f"{TABLE}: there are no records yet; give a corpus with --corpus.")
        return
    text = render(TABLE, "Choice of the tables' settings, on the validation split", list(VARIANTS), (), {})
    text += f"\nChosen: {chosen() or 'none, since no candidate moves at half the speed of people'}.\n"
    path_of(TABLE, ".md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
