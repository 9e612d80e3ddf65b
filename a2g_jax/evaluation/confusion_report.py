"""Confusion matrices of classifiers as JSON, Markdown and a picture."""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax.evaluation.report_cells import describe
from a2g_jax.io.staging import staged
from a2g_jax.metrics.intervals import LEAST


def write_confusion(result: dict[str, Any], out: Path) -> list[Path]:
    """Write ``confusion.json``, ``confusion.md`` and, where Matplotlib is installed, ``confusion.png``.

    Args:
        result: of :func:`a2g_jax.evaluation.confusion.classify_split`.
    """
    texts = {"confusion.json": json.dumps(result, indent=1) + "\n", "confusion.md": markdown(result)}
    written = list(texts)
    with staged(out) as folder:
        for name, text in texts.items():
            (folder / name).write_text(text, encoding="utf-8")
        if find_spec("matplotlib") is not None:
            from a2g_jax.viz.confusion import Panel, save_confusion

            panels = [
                Panel(
                    f"{name}, {one['input']}: {100 * one['accuracy']['mean']:.1f} %",
                    one["emotions"],
                    np.array(one["confusion"]),
                )
                for name, one in result["classifiers"].items()
            ]
            save_confusion(folder / "confusion.png", panels)
            written.append("confusion.png")
    return [out / name for name in written]


def markdown(result: dict[str, Any]) -> str:
    """A table of accuracies, and the matrix of each classifier."""
    about = result["about"]
    lines = [
        f"# Classifiers of emotions on the {about['split']} split",
        "",
        f"Corpus {about['corpus'][:16]} ({about['recipe'].get('reader')}); package {about['package']}.",
        "",
        "| | input | clips | recordings | accuracy | balanced | uniform | commonest | shuffled |",
        "|" + " --- |" * 9,
    ]
    for name, one in result["classifiers"].items():
        accuracy, chance = one["accuracy"], one["chance"]
        interval = " [-]" if accuracy["low"] is None else f" [{accuracy['low']:.3f}, {accuracy['high']:.3f}]"
        cells = [name, one["input"], str(one["clips"]), str(one["recordings"]), f"{accuracy['mean']:.3f}{interval}"]
        cells += [
            f"{value:.3f}" for value in (one["balanced"], *(chance[k] for k in ("uniform", "commonest", "shuffled")))
        ]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        "Brackets hold 95 % intervals over recordings (Wilson's, with the effective number of clips by the spread over",
        f"recordings; a dash for fewer than {LEAST} recordings). Balanced is the mean over emotions. The last three",
        "columns are chance: a random emotion, always the commonest one, the classifier's own answers in random order.",
    ]
    for name, one in result["classifiers"].items():
        names = one["emotions"]
        lines += ["", f"## {name}", "", describe({"name": one["input"], "run": one["run"]}) + ".", ""]
        lines += ["| is \\ classified as | " + " | ".join(names) + " | recall |"]
        lines.append("|" + " --- |" * (len(names) + 2))
        for emotion, counts, recall in zip(names, one["confusion"], one["recall"], strict=True):
            share = "-" if recall is None else f"{recall:.3f}"
            lines.append(f"| {emotion} | " + " | ".join(str(count) for count in counts) + f" | {share} |")
        if one["left_out"]:
            lines += ["", f"{one['left_out']} clips are left out: the classifier does not have their emotion."]
    return "\n".join([*lines, ""])
