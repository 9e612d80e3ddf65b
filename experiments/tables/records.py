"""Measurements as lines of JSON: one for each variant and seed.

A table is named by its paper and its own name, ``audio2gestures/table2``; its records lie in
``experiments/audio2gestures/results/table2.jsonl``, so that an experiment is resumable and a table can be rendered from
existing records.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from a2g_jax.data.corpus import Corpus

#: Field that names the classifier of emotions.
_CLASSIFIER = "emotion_classifier"
#: Fields that the records of one table share, in addition to the steps of trained ones.
_SHARED = ("corpus", "feature_network", "samples", "units", "split")
#: Beginnings of the names of scores that depend on the classifier.
_CLASSIFIED = ("emotion_", "requested_", "above_neutral", "kept neutral")

EXPERIMENTS = Path(__file__).parents[1]

#: Fields that identify a record of a table.
_IDENTITY = ("variant", "seed", "steps", _CLASSIFIER, *_SHARED)


def name_of(corpus: Corpus) -> str:
    """Name of a corpus in records: a digest of its arrays, or of its recipe if it was generated.

    The same recipe gives the same recordings everywhere, but processors differ in the last bits of a sum.
    """
    if corpus.recipe.get("reader") != "talker":
        return corpus.fingerprint[:16]
    recipe = {key: value for key, value in corpus.recipe.items() if key in _RECIPE}
    about = [recipe, corpus.space.kind, corpus.fps, asdict(corpus.mel)]
    return f"talker {hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()[:9]}"


#: Fields of a recipe that determine the recordings.
_RECIPE = frozenset(
    {
        *("minutes", "seed", "fps", "speakers", "emotions", "jitter", "fingers", "view"),
        *("equal_emotions", "languages", "synthesizer"),
    }
)


def results(paper: str) -> Path:
    """The folder of a paper's results."""
    return EXPERIMENTS / paper / "results"


def path_of(table: str, ending: str = ".jsonl") -> Path:
    """A file of a table."""
    paper, name = table.split("/")
    return results(paper) / f"{name}{ending}"


def all_tables(paper: str) -> Iterator[str]:
    """Names of the tables of a paper that have records."""
    for path in sorted(results(paper).glob("*.jsonl")):
        yield f"{paper}/{path.stem}"


def records(table: str) -> list[dict[str, Any]]:
    """Records of a table so far."""
    path = path_of(table)
    if not path.exists():
        return []
    found = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    # Two concurrent processes may both have scored the untrained rows.
    return list({tuple(record.get(name) for name in _IDENTITY): record for record in found}.values())


def current(table: str) -> list[dict[str, Any]]:
    """Records that fit into one table: those with the corpus, feature network, samples and steps of the last trained
    one, and untrained rows on the same corpus and network.

    Trained again on another processor, a classifier of emotions is another one. Emotions are those of the classifier
    with the most trained records; the others keep their scores that do not depend on it.
    """
    found = records(table)
    trained = [record for record in found if record["steps"] > 0]
    if not trained:
        return found
    last = trained[-1]
    same = [record for record in found if all(record.get(name) == last.get(name) for name in _SHARED)]
    same = [record for record in same if record["steps"] in (0, last["steps"])]
    classifiers = Counter(record.get(_CLASSIFIER) for record in same if record["steps"] > 0)
    most = max(classifiers, key=lambda name: classifiers[name])
    kept = [record for record in same if record.get(_CLASSIFIER) == most]
    there = {_row(record) for record in kept}
    for record in same:
        if _row(record) not in there:
            kept.append(_without_emotions(record))
            there.add(_row(record))
    return kept


def _row(record: Mapping[str, Any]) -> tuple[Any, Any]:
    return record["variant"], record["seed"]


def _without_emotions(record: Mapping[str, Any]) -> dict[str, Any]:
    """The record without what the classifier found."""
    scores = {name: score for name, score in record["scores"].items() if not name.startswith(_CLASSIFIED)}
    fields = {name: value for name, value in record.items() if name not in ("emotions", "requests")}
    return {**fields, "scores": scores}


def append(table: str, record: Mapping[str, Any]) -> None:
    """Add a record to a table's file."""
    path = path_of(table)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")
