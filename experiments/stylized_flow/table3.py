"""Table 3 and Fig. 8: grouping of speakers in the latent space, compared with MoGlow's.

    python -m experiments.stylized_flow.table3 --corpus TED --features FEATURES_TED --perceptual LOSS_TED \\
        [--budget MINUTES]

The runs are those of Table 1. Latents of a clip are averaged over time and brought to two dimensions by t-SNE; CHI and
silhouette are taken there, as the paper does, and in the full space, both *against the speakers* (the public code
scores the labels of its own clustering). In addition the same for speakers shuffled over the clips, and for the labels
of a clustering (k-means, as many clusters as speakers), which shows how well *any* cloud can be partitioned. Writes
``results/table3.png``.
"""

import argparse
from typing import Any

import numpy as np
from jaxtyping import Float

from a2g_jax.metrics.labels import calinski_harabasz, silhouette
from a2g_jax.training.run import Run
from experiments.stylized_flow.latents import mean_latents
from experiments.stylized_flow.settings import flow, moglow, published
from experiments.tables.claims import Claim
from experiments.tables.markdown import compute, draw
from experiments.tables.records import path_of, records
from experiments.tables.ruler import Ruler
from experiments.tables.setting import arguments, setting

TABLE = "stylized_flow/table3"
PUBLISHED, MOGLOW = "stylized flow as published", "MoGlow"
OURS, LINEAR = "stylized flow", "MoGlow with the linear layer"
VARIANTS = {
    MOGLOW: moglow("ted", predictor=False),
    LINEAR: moglow("ted", predictor=True),
    PUBLISHED: published("ted"),
    OURS: flow("ted"),
}
CLAIMS = (
    Claim("CHI is higher than MoGlow's (t-SNE)", PUBLISHED, MOGLOW, "chi", 1),
    Claim("the silhouette is higher than MoGlow's (t-SNE)", PUBLISHED, MOGLOW, "silhouette", 1),
    Claim("CHI is higher than MoGlow's (full space)", PUBLISHED, MOGLOW, "chi_full", 1),
    Claim("the silhouette is higher than MoGlow's (full space)", PUBLISHED, MOGLOW, "silhouette_full", 1),
    Claim("CHI is higher than MoGlow's, both with the linear layer (full space)", OURS, LINEAR, "chi_full", 1),
)
PAPER = {MOGLOW: "CHI 908.47, silhouette 0.443", OURS: "1149.34, 0.517"}
_SPLIT = "train"
_MOST = 600


def score(name: str, run: Run, ruler: Ruler, seed: int) -> dict[str, Any]:
    """Grouping of speakers, and the picture's points."""
    del name
    from sklearn.manifold import TSNE

    points, speakers = mean_latents(run, ruler.corpus, _SPLIT)
    chosen = np.linspace(0, len(points) - 1, min(_MOST, len(points))).round().astype(int)
    points, names = points[chosen], np.array(speakers)[chosen]
    _, labels = np.unique(names, return_inverse=True)
    flat = np.round(TSNE(2, random_state=seed, init="pca", perplexity=30).fit_transform(points), 2)
    shuffled = np.random.default_rng(seed).permutation(labels)
    values = {
        "chi": calinski_harabasz(flat, labels),
        "silhouette": silhouette(flat, labels),
        "chi_full": calinski_harabasz(points, labels),
        "silhouette_full": silhouette(points, labels),
        "chi_shuffled": calinski_harabasz(flat, shuffled),
        "silhouette_shuffled": silhouette(flat, shuffled),
        **own_clusters(flat, len(set(speakers)), seed),
    }
    return {
        "clips": len(points),
        "scores": {key: {"mean": value, "low": None, "high": None, "best": None} for key, value in values.items()},
        "points": flat.tolist(),
        "speakers": names.tolist(),
    }


def own_clusters(flat: Float[np.ndarray, "N 2"], count: int, seed: int) -> dict[str, float]:
    """Labels that the public code scores: clusters of the same points."""
    from sklearn.cluster import KMeans

    labels = KMeans(count, n_init=10, random_state=seed).fit_predict(flat)
    return {"chi_clusters": calinski_harabasz(flat, labels), "silhouette_clusters": silhouette(flat, labels)}


def picture(found: list[dict[str, Any]]) -> None:
    """Fig. 8: clips by their latents, coloured by speaker; the first seed of each model."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    first = {record["variant"]: record for record in reversed(found) if "points" in record}
    figure, axes = pyplot.subplots(1, len(first), figsize=(5.5 * len(first), 5), squeeze=False, layout="constrained")
    for axis, (name, record) in zip(axes[0], sorted(first.items()), strict=True):
        points, speakers = np.array(record["points"]), np.array(record["speakers"])
        for number, speaker in enumerate(sorted(set(speakers))):
            of = speakers == speaker
            axis.scatter(points[of, 0], points[of, 1], s=12, color=f"C{number}", label=speaker, alpha=0.8, linewidths=0)
        scores = record["scores"]
        axis.set_title(
            f"{name}: silhouette {scores['silhouette']['mean']:.2f}"
            f" (shuffled {scores['silhouette_shuffled']['mean']:.2f})",
            fontsize=10,
        )
        axis.set_xticks([])
        axis.set_yticks([])
    axes[0, -1].legend(fontsize=8, frameon=False)
    figure.savefig(path_of(TABLE, ".png"), dpi=110)


def main() -> None:
    """Train and score what is missing; render the table and the picture."""
    options: argparse.Namespace = arguments("Table 3: speakers in the space of latents", steps=600).parse_args()
    if options.corpus is not None:
        compute(TABLE, VARIANTS, setting(options), options.only.split(",") if options.only else None, score, "speakers")
    draw(TABLE, "Table 3: speakers in the space of latents", VARIANTS, CLAIMS, PAPER)
    picture(records(TABLE))


if __name__ == "__main__":
    main()
