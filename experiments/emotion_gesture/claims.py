"""Claims of EmotionGesture, each judged on records over seeds with its nulls; writes one page.

python -m experiments.emotion_gesture.table2 --corpus CORPUS --features RUN --judge RUN      # also table3, table4
python -m experiments.emotion_gesture.mining --corpus CORPUS
python -m experiments.emotion_gesture.jitter --corpus JITTERED --clean CORPUS
python -m experiments.emotion_gesture.claims
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from experiments.emotion_gesture import jitter, mining, table2, table3, table4
from experiments.emotion_gesture.bench import HELD, MEAN, OTHER, RIGHT, TRUTH
from experiments.emotion_gesture.page import METRICS
from experiments.emotion_gesture.table1 import EMOTIONS
from experiments.tables.claims import interval, judge, over_seeds, stands_still
from experiments.tables.records import current, results

Pair = tuple[float, float]
#: Seeds that a verdict needs.
_LEAST = 3


def verdict(differences: Sequence[float], scale: float = 1.0) -> str:
    """``holds``, ``does not hold`` or ``undecided``, with the interval of differences claimed to be positive."""
    found = interval(differences)
    if found is None or found[2] < _LEAST:
        return f"undecided: fewer than {_LEAST} seeds"
    mean, half, count = found
    word = "undecided" if abs(mean) <= half else "holds" if mean > 0 else "does not hold"
    return f"{word}: {scale * mean:+.3g} +- {scale * half:.2g} over {count} seeds"


def pairs(table: str, variant: str, first: str, second: str | float) -> list[Pair]:
    """Two scores of one row, or a score and a constant, for each seed."""
    found = []
    for record in current(table):
        scores = record["scores"]
        if record["variant"] == variant and first in scores and (isinstance(second, float) or second in scores):
            other = second if isinstance(second, float) else scores[second]["mean"]
            found.append((scores[first]["mean"], other))
    return found


def within(text: str, table: str, variant: str, first: str, second: str | float, scale: float = 1.0) -> str:
    """A line on the claim that a row scores more by one metric than by another, or than a constant."""
    found = pairs(table, variant, first, second)
    said = verdict([a - b for a, b in found], scale)
    if said.startswith("holds") and stands_still(table, variant):
        said = f"not decided ({variant} stands still)" + said.removeprefix("holds")
    return f"- {text}: **{said}**"


def nulls(table: str, metric: str, names: Sequence[str], scale: float = 1.0, digits: int = 1) -> str:
    """A line with a score of other rows, to read the claims against."""
    parts = []
    for name in names:
        found = over_seeds(table, name, metric)
        if found is not None:
            half = "" if found[2] < 2 else f" +- {scale * found[1]:.{digits}f}"
            parts.append(f"{name} {scale * found[0]:.{digits}f}{half}")
    return f"  Beside it: {', '.join(parts)}." if parts else ""


def chance(table: str) -> float | None:
    """Emotion accuracy, mean over emotions, of motion that has nothing to do with the emotion."""
    cells = [record["scores"].get("emotion_balanced") for record in current(table)]
    return next((one["chance"] for one in cells if one is not None), None)


def request_chance(table: str) -> float | None:
    """Accuracy of requests where nothing is shown: one over the number of requested emotions."""
    counts = [record["requests"] for record in current(table) if record.get("requests")]
    return None if not counts else 1.0 / sum(1 for row in counts[0] if sum(row))


def emotion_of_the_speech() -> list[str]:
    """Emotion accuracy is above chance, and above that of the emotion of other speech."""
    table, lines = table2.TABLE.name, []
    level = chance(table)
    if level is None:
        return []
    for name in (table2.CONSTANT, table2.DIVERSE):
        text = f"{name}: gestures show the emotion of the speech above chance ({100 * level:.1f} %)"
        lines.append(within(text, table, name, "emotion_balanced", level, 100))
        text = f"{name}: more than gestures for another recording's speech do"
        lines.append(within(text, table, name, "emotion_balanced", "emotion_balanced shuffled", 100))
    rows = (TRUTH, RIGHT, OTHER, HELD, MEAN, table2.S2G, table2.A2G, table2.FLOW)
    return [*lines, nulls(table, "emotion_balanced", rows, 100)]


def emotion_on_request() -> list[str]:
    """Requested emotions are shown, and more than a one-hot label shows them."""
    table, lines = table3.TABLE.name, []
    level = request_chance(table)
    if level is None:
        return []
    for name in (table3.OURS, table3.OURS_LABEL, table3.SAMPLING, table3.LABEL):
        text = f"{name}: an emotion other than the speech's is shown above chance ({100 * level:.1f} %)"
        lines.append(within(text, table, name, "requested_other_accuracy", level, 100))
    lines += _claims(table3, ["(ours) requests"])
    return [*lines, nulls(table, "requested_other_accuracy", (TRUTH,), 100)]


def apart_from_neutral() -> list[str]:
    """Each emotion is classified as more probable than neutral in more than half of the clips."""
    table, lines = table3.TABLE.name, []
    for name in (table3.OURS, table3.OURS_LABEL, TRUTH):
        for emotion in EMOTIONS:
            key, level = (f"above_neutral {emotion}", 0.5) if emotion != "neutral" else ("kept neutral", 0.125)
            found = pairs(table, name, key, level)
            if not found:
                continue
            what = "more probable than neutral in" if emotion != "neutral" else "the most probable of all in"
            mean = 100 * sum(a for a, _ in found) / len(found)
            own = [
                record["scores"][key].get("null")
                for record in current(table)
                if key in record["scores"] and record["variant"] == name
            ]
            null = f" ({100 * sum(own) / len(own):.0f} % of neutral's)" if own and None not in own else ""
            said = (
                "" if name == TRUTH else f"; above {100 * level:.3g} %: **{verdict([a - b for a, b in found], 100)}**"
            )
            lines.append(f"- {name}: {emotion} is {what} {mean:.0f} % of its clips{null}{said}")
    return lines


def probes() -> list[str]:
    """Word onsets are in beat features and the emotion in emotion features."""
    table, lines = mining.TABLE.name, []
    texts = (
        (
            "word onsets are found better in beat features than in emotion features, AUC",
            "onset_beat",
            "onset_emotion",
            1,
        ),
        (
            "the emotion is found better in emotion features than in beat features, %",
            "emotion_emotion",
            "emotion_beat",
            100,
        ),
    )
    for name in (mining.ALIGNED, mining.OURS):
        for text, first, second, scale in texts:
            found = pairs(table, name, first, second)
            if found:
                means = [scale * sum(values) / len(found) for values in zip(*found, strict=True)]
                said = verdict([a - b for a, b in found], scale)
                lines.append(f"- {name}: {text}: {means[0]:.3g} and {means[1]:.3g}; **{said}**")
    untrained = [f"{name}, {mining.UNTRAINED}" for name in (mining.ALIGNED, mining.OURS)]
    for _, first, second, scale in texts:
        for key in (first, second):
            line = nulls(table, key, untrained, scale, 3 if scale == 1 else 1)
            lines.append(line.replace("Beside it", f"Beside it, {METRICS[key].title}"))
    return lines


def header() -> list[str]:
    """The audio encoder's header that keeps time in place, and the authors'."""
    return _claims(mining)


def smooth_loss() -> list[str]:
    """The motion-smooth loss lowers jerk toward the clean motion's where training poses are jittered."""
    rows = (*jitter.VARIANTS, TRUTH, jitter.JITTERED)
    return [*_claims(jitter), nulls(jitter.TABLE.name, "jerk_ratio", rows, digits=2)]


def seam() -> list[str]:
    """Prompts beat padding where the given poses end."""
    rows = (*table4.VARIANTS, HELD, MEAN)
    lines = _claims(table4, [f"{whose}the {what}" for whose in ("", "(ours) ") for what in ("speed", "jerk")])
    return [
        *lines,
        *(
            nulls(table4.TABLE.name, f"seam_{what}", rows, digits=2).replace(
                "Beside it", f"Beside it, ratios of {what}"
            )
            for what in ("speed", "jerk")
        ),
    ]


def listens() -> list[str]:
    """Beats and poses follow the speech: less so with another recording's."""
    table, lines = table2.TABLE.name, []
    for name in (table2.CONSTANT, table2.DIVERSE, table2.S2G, table2.A2G, table2.FLOW):
        if pairs(table, name, "beat_alignment", "beat_alignment shuffled"):
            text = f"{name}: beats are nearer to its own speech than to another recording's"
            lines.append(within(text, table, name, "beat_alignment", "beat_alignment shuffled"))
            text = f"{name}: L2 is lower with its own speech, cm"
            lines.append(within(text, table, name, "position_l2 shuffled", "position_l2"))
    return [*lines, nulls(table, "beat_alignment", (TRUTH, RIGHT, OTHER), digits=3)]


def _claims(module: Any, starts: Sequence[str] = ("",)) -> list[str]:
    table = module.TABLE
    if not current(table.name):
        return []
    chosen = [claim for claim in table.claims if claim.text.startswith(tuple(starts))]
    return [f"- {claim.text}: **{judge(table.name, claim)}**" for claim in chosen]


#: Sections of the page, in its order.
SECTIONS: Mapping[str, Callable[[], list[str]]] = {
    "The emotion of the speech": emotion_of_the_speech,
    "Requested emotions": emotion_on_request,
    "Each emotion beside neutral": apart_from_neutral,
    "What beat and emotion features hold": probes,
    "Time in place, or in channels": header,
    "The motion-smooth loss": smooth_loss,
    "The seam to the given poses": seam,
    "The speech": listens,
}


def page() -> str:
    """Return the page as Markdown."""
    lines = [
        "# Claims about EmotionGesture on the generated corpus",
        "",
        "Differences are paired by seed; a claim holds where the 95 % interval over seeds is above 0, and does not hold"
        " where it is below. Emotion accuracies are means over emotions.",
    ]
    for title, section in SECTIONS.items():
        found = [line for line in section() if line]
        lines += ["", f"## {title}", "", *(found or ["No records yet."])]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    text = page()
    (results("emotion_gesture") / "claims.md").write_text(text, encoding="utf-8")
    print(text)
