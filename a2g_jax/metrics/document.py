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
splits, skeletons, numbers of samples, units, tolerances, feature networks or classifiers. `--features demo` is the
feature network that comes with the package: made by `a2g prepare talker --minutes 90 --seed 6` and `a2g train
motion_autoencoder --steps 2000`.

- **FGD falls with the number of vectors**, for equal distributions. Two samples of the same Gaussian, mean of three
  pairs, NumPy seed 0:

  | vectors in each set | 50 | 100 | 200 | 420 | 1000 | 4000 |
  |---|---|---|---|---|---|---|
  | 32 dimensions | 12.03 | 6.13 | 2.78 | 1.33 | 0.65 | 0.15 |
  | 128 dimensions | 131.09 | 83.15 | 42.62 | 20.36 | 8.49 | 2.13 |

  A report states the number of vectors beside each figure, and has a dash for fewer than two vectors for each feature:
  the covariance of one half, of as many vectors as features or fewer, would be singular. It has the distance of two
  halves of the truth as a row, the floor; and beside each figure the distance of half of the row's motion from the
  other half of the truth, for the same recordings and the same number of vectors, to compare with that floor. Learned
  scores are comparable only with the same feature network: its hash is in the report. Runs whose perceptual loss used
  that network are refused.
- **Intervals are over recordings**, 95 %, by Student's t; of shares of clips with an outcome (emotion accuracy) by
  Wilson's formula with the effective number of clips; of FGD, CHI and silhouette by the jackknife, which leaves
  recordings out: a bootstrap draws some twice, which raises a Fréchet distance. The interval of FGD is about its value
  at that number of vectors. Clips of one recording count together, and fewer than five recordings have no interval but
  a dash (JSON: null, with the reason). Intervals are about these speakers, not about others.

  [By simulation](../experiments/results/interval_coverage/interval_coverage.md) Student's t holds the mean of normal
  scores with a probability of 0.95 at every number, of log-normal ones (sigma 1) with less; the percentile bootstrap
  of version 0.1 with less still:

  | recordings | 3 | 5 | 10 | 20 | 50 |
  |---|---|---|---|---|---|
  | normal: Student's t | 0.94 | 0.96 | 0.96 | 0.95 | 0.95 |
  | normal: percentile bootstrap | 0.74 | 0.85 | 0.90 | 0.93 | 0.94 |
  | log-normal: Student's t | 0.83 | 0.82 | 0.83 | 0.87 | 0.91 |
  | log-normal: percentile bootstrap | 0.64 | 0.73 | 0.79 | 0.86 | 0.91 |

- **Runs that differ only in their seed are one row**, by everything in `run.json`: the mean over seeds with an interval
  by Student's t over seeds, from three seeds on. It is about the spread of training, not about recordings.
- **Beat alignment has no zero**: `a2g_jax.metrics.beats.with_null` compares a score with that of the same motion moved
  in time. Its tolerance is in seconds, the same at every frame rate: 1/6 s from motion to audio, or `--beat-sigma
  SECONDS`; 0.1 s from audio to motion. The papers' are constants in `a2g_jax.metrics.beats`: 0.1 and 0.3 s in BEAT and
  HA2G; 5 frames in the flow paper and 3 in AI Choreographer, which `frames_to_seconds` converts at the motion's frame
  rate: 5 are 0.333 s at 15 fps and 0.167 s at 30. `--units stylized-flow` uses them.
- **The best of 20 beats the mean of 20**, of any model and of the truth's own other motions.
- Diversity and multimodality are means over pairs; the published sums are 0.95 of them at 20 motions.
- `--units audio2gestures` and `--units stylized-flow` give the units of these papers' tables. Units of the first: L1
  distances are means over coordinates and over the 55 joints of SMPL-X (fingers count as their wrist, jaw and eyes as
  the head), on a skeleton of 120.64 cm from wrist to wrist; speeds and accelerations are centimetres per frame. STFT
  and SSIM stay as they are. Units of the second: L1 distances are means over coordinates, and the tolerance of beat
  alignment is 5 frames.
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
arrays that JAX traces (`pair`), the motions for one clip (`clip`), or the feature vectors of a split (`set`). `bounds`
are the least and greatest value, where intervals end; `outcome=True` is for shares of clips with an outcome;
`distance=True` for distances of a set, which get the dash, the floor and the halves of FGD.
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
