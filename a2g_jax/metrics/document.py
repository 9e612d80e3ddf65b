"""``docs/metrics.md``, made from :data:`~a2g_jax.metrics.catalogue.METRICS`."""

import textwrap
from collections.abc import Iterable

from a2g_jax.metrics.registry import Metric

#: Writes the document.
COMMAND = "python -m a2g_jax.metrics > docs/metrics.md"

_HEAD = """\
# Reading the scores

`a2g evaluate` prints these beside the scores of the truth, other right motions, noise, a neighbour's motion, another
clip's motion, a held pose and the mean pose. Formulas and shapes are in the docstrings of `a2g_jax.metrics`. The root
is at the origin, so walking does not count. ≈ means that a value near that of the truth is better.
"""

_GENERAL = """\
## Conditions

Corpora of keypoints are scored in their own unit; bone directions laid end to end in metres where bone lengths are
known, otherwise as directions. Onsets in a report come from the corpus's log-mel rows. Emotion accuracy needs a
classifier trained on motion: `a2g train emotion_classifier --input motion --corpus CORPUS --out RUN`. Read it beside
the truth's row and chance, which a report states: where half of the clips are neutral, that answer is right for half.

`a2g evaluate --compare REPORT REPORT ... --out DIR` puts reports side by side, and refuses those of other corpora,
splits, skeletons, numbers of samples, units, feature networks or classifiers. `--features demo` is the feature network
that comes with the package: made by `a2g prepare talker --minutes 90 --seed 6` and `a2g train motion_autoencoder
--steps 2000`.

- **FGD falls with the number of vectors**, for equal distributions. Two samples of the same Gaussian, mean of three
  pairs, NumPy seed 0:

  | vectors in each set | 50 | 100 | 200 | 420 | 1000 | 4000 |
  |---|---|---|---|---|---|---|
  | 32 dimensions | 12.03 | 6.13 | 2.78 | 1.33 | 0.65 | 0.15 |
  | 128 dimensions | 131.09 | 83.15 | 42.62 | 20.36 | 8.49 | 2.13 |

  A report states the number of vectors beside each figure, marks figures of too few, refuses those of fewer than two,
  and has the distance of two halves of the truth as a row. Learned scores are comparable only with the same feature
  network: its hash is in the report. Runs whose perceptual loss used that network are refused.
- **Beat alignment has no zero**: `a2g_jax.metrics.beats.with_null` compares a score with that of the same motion moved
  in time.
- **The best of 20 beats the mean of 20**, of any model and of the truth's own other motions.
- Diversity and multimodality are means over pairs; the published sums are 0.95 of them at 20 motions.
- `--units audio2gestures` and `--units stylized-flow` give the units of these papers' tables. Units of the first: L1
  distances are means over coordinates and over the 55 joints of SMPL-X (fingers count as their wrist, jaw and eyes as
  the head), on a skeleton of 120.64 cm from wrist to wrist; speeds and accelerations are centimetres per frame. STFT
  and SSIM stay as they are. Units of the second: L1 distances are means over coordinates.
- NaN in a motion gives NaN; nothing is left out silently.

[Response of each metric](../experiments/results/metric_audit/metric_audit.png) to motion that is noisy, late, slow,
frozen, shuffled or mirrored.

Also in `a2g_jax.metrics`, for use from Python: SRGR as in BEAT's code, confusion matrices, share of rest, and foot
skate, which a report leaves out because the models do not move the root: generated motion gets a root that plants its
feet.

## Your own metric

A metric is a record with a function, in any package:

```python
from a2g_jax.metrics.context import MotionContext
from a2g_jax.metrics.registry import Metric


def _reach(context: MotionContext) -> float:
    return context.scale * float(abs(context.wrists).max())


REACH = Metric("reach", "cm", "truth", "ours", 1, key="reach", function=_reach)
```

Name it with `a2g evaluate ... --metric my_package.metrics:REACH`, or offer it to every evaluation as an entry point:

```toml
[project.entry-points."a2g_jax.metrics"]
reach = "my_package.metrics:REACH"
```

`scope` decides what the function gets (`a2g_jax.metrics.context`): a motion with its target (`motion`), their points as
arrays that JAX traces (`pair`), the motions for one clip (`clip`), or the feature vectors of a split (`set`).
"""


def markdown(metrics: Iterable[Metric]) -> str:
    """The document."""
    metrics = tuple(metrics)
    lines = [f"<!-- Made by `{COMMAND}`; edit a2g_jax/metrics/catalogue.py and document.py instead. -->", "", _HEAD]
    lines += ["| metric | unit | better | source |", "|---|---|---|---|"]
    for metric in metrics:
        better = "≈" if metric.better == "truth" else metric.better
        lines.append(f"| {_escaped(metric.title)} | {metric.unit} | {better} | {metric.source} |")
    lines += ["", "## What each measures, and what it does not see", ""]
    for metric in metrics:
        text = f"- **{_escaped(metric.title)}** (`{metric.key}`). {metric.measures} *{metric.blind_spots}*"
        lines += textwrap.wrap(text, 120, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join([*lines, "", _GENERAL])


def _escaped(text: str) -> str:
    return text.replace("*", "\\*")
