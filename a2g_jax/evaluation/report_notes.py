"""The text of a report around its tables."""

from typing import Any

from a2g_jax.metrics.units import OURS, find_units


def condition(about: dict[str, Any], key: str) -> Any:
    """A condition of a report; reports of 0.1 are in our units."""
    return about.get(key, OURS.key if key == "units" else None)


def preface(about: dict[str, Any]) -> list[str]:
    """Heading, and what was scored."""
    return [
        f"# Evaluation on the {about['split']} split",
        "",
        f"{about['clips']} clips, {about['seconds']:.0f} s; {about['samples']} samples of each model for each clip,"
        f" seed {about['seed']}; corpus {about['corpus'][:16]} ({about['recipe'].get('reader')}); package"
        f" {about['package']}.",
    ]


def notes(about: dict[str, Any]) -> list[str]:
    """How to read the scores, with warnings."""
    units = find_units(condition(about, "units"))
    pairs = (
        ""
        if units.published_pairs
        else " Diversity and multimodality are means over pairs; the published sums are 0.95 of them at 20 samples."
    )
    few = " With few clips intervals are wide and understate the uncertainty." if about["clips"] < 10 else ""
    if about["clips"] > about["stretches"]:
        few = (
            f" The clips are pieces of {about['stretches']} recording(s), which are not independent: intervals"
            " understate the uncertainty, and do not extend to other recordings or speakers."
        )
    lines = [
        "Brackets hold 95 % intervals over clips (bootstrap)." + few,
        "`best` is the best of the samples of each clip, averaged over clips; it beats the mean by construction.",
        "↓ lower is better, ↑ higher is better, ≈ nearer to the truth is better. Beat alignment has no zero: compare"
        f" with the other rows.{pairs}",
        *([units.describe] if units.describe else []),
        "No score here measures what people prefer.",
    ]
    if about["feature_network"] is not None:
        floor = "" if about["floor"] is None else f" two halves of the truth are {about['floor']:.2f} apart;"
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


def too_few(about: dict[str, Any]) -> str:
    """Warnings about clips without a feature vector, and about too few vectors."""
    text, vectors, width = "", about["feature_vectors"], about.get("feature_width")
    if about.get("short_clips"):
        text += (
            f" **{about['short_clips']} of {about['clips']} clips are shorter than a clip of the network and are not in"
            " FGD and LPIPS.**"
        )
    if width is not None and vectors <= width:
        text += (
            f" **{vectors} vectors do not determine a covariance of {width} features: FGD is mostly the error of that"
            " estimate here, and only its difference from the rows of true motion means something.**"
        )
    return text
