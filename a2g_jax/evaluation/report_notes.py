"""The text of a report around its tables."""

from typing import Any

from a2g_jax.evaluation.report_cells import condition, counted, reasons
from a2g_jax.metrics.units import find_units


def preface(about: dict[str, Any]) -> list[str]:
    """Heading, and what was scored."""
    return [
        f"# Evaluation on the {about['split']} split",
        "",
        f"{about['clips']} clips, {about['seconds']:.0f} s; {about['samples']} samples of each model for each clip,"
        f" seed {about['seed']}; corpus {about['corpus'][:16]} ({about['recipe'].get('reader')}); package"
        f" {about['package']}.",
    ]


def notes(result: dict[str, Any]) -> list[str]:
    """How to read the scores, with warnings."""
    about = result["about"]
    units = find_units(condition(about, "units"))
    pairs = (
        ""
        if units.published_pairs
        else " Diversity and multimodality are means over pairs; the published sums are 0.95 of them at 20 samples."
    )
    sigma = about.get("beat_sigma")
    beats = "" if sigma is None else f" sigma is {sigma:.3f} s from motion to audio;"
    lines = [
        *_intervals(result),
        "`best` is the best of the samples of each clip, averaged over clips; it beats the mean by construction.",
        f"↓ lower is better, ↑ higher is better, ≈ nearer to the truth is better. Beat alignment:{beats} it has no"
        f" zero, compare with the other rows.{pairs}",
        *([units.describe] if units.describe else []),
        "No score here measures what people prefer.",
    ]
    if about["feature_network"] is not None:
        floor = ""
        if about["floor"] is not None:
            floor = (
                f" two halves of the truth are {about['floor']:.2f} apart, the floor; beside it stands the distance of"
                " half of a row's motion from the other half of the truth, of the same number of vectors;"
            )
        lines.append(
            f"FGD and LPIPS use the feature network {about['feature_network'][:16]}, with {about['feature_vectors']}"
            f" vectors in a set;{floor} FGD falls with n.{too_few(about)}"
            + (
                ""
                if about.get("own_features", True)
                else " The network was trained on another corpus: movement that is rare there has too much weight here."
            )
        )
    if chance := about.get("emotion_chance"):
        lines.append(
            f"Emotion accuracy by chance: {chance['uniform']:.3f} for a random emotion, {chance['commonest']:.3f} for"
            " always the commonest one; the truth's row is what the classifier itself reaches."
        )
    return [f"- {note}" for note in lines]


def _intervals(result: dict[str, Any]) -> list[str]:
    """What the brackets are, and why some are missing."""
    about = result["about"]
    if "recordings" not in about:  # of before 0.2
        few = " With few clips intervals are wide and understate the uncertainty." if about["clips"] < 10 else ""
        return ["Brackets hold 95 % intervals over clips (percentile bootstrap)." + few]
    over = counted(about["recordings"], "recording")
    lines = [
        f"Brackets hold 95 % intervals over {over} by Student's t (emotion accuracy:"
        " Wilson's; FGD, CHI, silhouette: jackknife). They are about these speakers. Coverage by simulation: 0.95 for"
        " normal scores; for log-normal ones, very skewed, 0.82 with 5 recordings, 0.83 with 10, 0.91 with 50."
    ]
    if about["clips"] > about["recordings"]:
        lines[0] += " Clips of one recording count together: they are not independent."
    if any("seeds" in row for row in result["rows"]):
        lines.append(
            "Rows of several seeds are means over runs that differ in nothing else, with intervals over seeds by"
            " Student's t; they hold the spread of training, not that of recordings."
        )
    lines += [f"A dash: {reason}." for reason in reasons(result)]
    return lines


def too_few(about: dict[str, Any]) -> str:
    """Warnings about clips without a feature vector, and about too few vectors."""
    text, vectors, width = "", about["feature_vectors"], about.get("feature_width")
    if about.get("short_clips"):
        text += (
            f" **{about['short_clips']} of {about['clips']} clips are shorter than a clip of the network and are not in"
            " FGD and LPIPS.**"
        )
    if "recordings" not in about and width is not None and vectors <= width:
        text += (
            f" **{vectors} vectors do not determine a covariance of {width} features: FGD is mostly the error of that"
            " estimate here, and only its difference from the rows of true motion means something.**"
        )
    return text
