"""Every run beside the truth and simple baselines, with the targets of a default: one table by one command.

    python -m experiments.motion                        # the shipped runs; about a minute and a half of one core
    python -m experiments.motion RUN [RUN ...]          # and these
    python -m experiments.motion --real --strips        # on real speech as well; film strips

Writes ``motion.json``, ``motion.md`` and ``motion.png`` into ``--out``. Rows are kept in ``--cache`` as soon as they
are measured, by weights, speeches, network, settings and code: the same command resumes, and measures again only what
changed.
"""

import argparse
import json
import os
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from a2g_jax import __version__
from a2g_jax.data.corpus import Corpus
from a2g_jax.errors import InputError
from a2g_jax.io.files import write_json
from a2g_jax.progress import progress_bar, say
from a2g_jax.training.run_file import SHIPPED, run_folder
from experiments.motion.measure import Bench
from experiments.motion.real import real_takes
from experiments.motion.rows import Row, feature_network, reference_rows, run_row, weights_of
from experiments.motion.speeches import MINUTES, SEED, held_out_talk, real_speeches, shared_folder, talk_of_corpus
from experiments.motion.table import real_section, render
from experiments.motion.targets import RIGHT, TRUTH, choose_default

RESULTS = Path(__file__).parent / "results"
#: Figures of weights that are no longer shipped, with the truth that they were measured against.
OLD = RESULTS / "old.json"
#: Samples on real speech: one speech needs more of them.
REAL_SAMPLES = 8


def arguments() -> argparse.ArgumentParser:
    """The flags."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", help="folders of runs, beside the shipped ones")
    parser.add_argument("--corpus", type=Path, help="use the test split of this generated corpus")
    parser.add_argument("--minutes", type=float, default=MINUTES, help="of talk (default: %(default)g)")
    parser.add_argument("--seed", type=int, default=SEED, help="of the talk (default: %(default)s)")
    parser.add_argument("--features", default="demo", help="feature network; its frame rate is that of the table")
    parser.add_argument("--samples", type=int, default=2, help="motions of each run for each speech")
    parser.add_argument("--real", action="store_true", help="also measure on the real speech in A2G_SHARED_DATA")
    parser.add_argument("--strips", action="store_true", help="also draw film strips of every run (needs Chromium)")
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--cache", type=Path, default=Path("build/motion"), help="folder of measured rows")
    parser.add_argument("--freeze", metavar="VERSION", help="keep the shipped runs' figures as those of a version")
    return parser


def main() -> None:
    """Measure what is missing; write the table, the picture and, on request, the strips."""
    options = arguments().parse_args()
    try:
        make(options)
    except InputError as error:
        raise SystemExit(f"error: {error}") from None


def make(options: argparse.Namespace) -> None:
    """The command."""
    begun = time.monotonic()
    network = feature_network(options.features)
    fps = network.run.config.fps
    if options.corpus is None:
        talk = held_out_talk(options.minutes, options.seed, fps)
        source = f"`a2g prepare talker --minutes {options.minutes:g} --seed {options.seed}`, all of it"
    else:
        talk = talk_of_corpus(Corpus.open(options.corpus), fps)
        source = f"the test split of {options.corpus.name}"
    bench = Bench(talk, network, options.samples, 0, options.cache)
    speeches = lambda: bench.speeches  # noqa: E731
    names = [*SHIPPED, *dict.fromkeys(options.runs)]
    runs = [run_row(name, speeches, fps, options.samples, 0) for name in names]
    for row in runs:
        assert row.run is not None
        talk.refuse_trained(row.name, row.run)
    if len({row.name for row in runs}) < len(runs):
        raise InputError(f"runs: two folders have the same name in {' '.join(names)}; rename one.")
    fixed = reference_rows(speeches, network, options.samples, 0)
    rows = measure(bench, [*fixed, *runs])
    for row in runs:
        perceptual = row.run.config.perceptual if row.run else None
        if perceptual is not None and perceptual.fingerprint == network.fingerprint:
            rows[row.name]["note"] = "its perceptual loss used this feature network; its FGD is not comparable"
    references = {name: rows for name in rows if name != TRUTH and "speed_p50" in rows[name]}
    weights = {row.name: weights_of(run_folder(name)) for name, row in zip(names, runs, strict=True)}
    truth = {name: rows[name] for name in (TRUTH, RIGHT)}
    real, skipped = real_rows(names, fps, options.cache) if options.real else ({}, "run with --real.")
    about = {
        "package": __version__,
        "command": command(options),
        "source": source,
        "speeches": len(talk.roles),
        "minutes": sum(role["seconds"] for role in talk.roles) / 60,
        "fps": fps,
        "samples": options.samples,
        "vectors": rows[RIGHT]["fgd"]["vectors"],
        "network": network.fingerprint[:12],
        "weights": weights,
        "bench": bench.identity,
        "intervals": "Student's t; FGD: jackknife",
        "cores": f"{os.cpu_count()} shared cores",
        "default": choose_default({row.name: rows[row.name] for row in runs}, rows),
    }
    if options.freeze:
        shipped = {name: rows[name] for name in SHIPPED}
        old = {"version": options.freeze, "about": about, "rows": {**truth, **shipped}, "real": real}
        write_json(OLD, {**old, "about": {**about, "seconds": time.monotonic() - begun}})
    rows, references = with_old(rows, references, set(weights.values()), about)
    about["seconds"] = time.monotonic() - begun
    options.out.mkdir(parents=True, exist_ok=True)
    write_json(options.out / "motion.json", {"about": about, "rows": rows, "real": real})
    text = render(about, rows, references) + "\n" + real_section(real, skipped if not real else "")
    (options.out / "motion.md").write_text(text, encoding="utf-8")
    draw_picture(options.out / "motion.png", rows, references)
    print(text)
    if options.strips:
        draw_strips(options, bench, names, fps)


def command(options: argparse.Namespace) -> str:
    """The command without folders of this machine."""
    flags = [f"--features {options.features}"] if options.features != "demo" else []
    flags += [f"--{name}" for name in ("real", "strips") if getattr(options, name)]
    return " ".join(["python -m experiments.motion", *(Path(run).name for run in options.runs), *flags])


def measure(bench: Bench, rows: list[Row]) -> dict[str, dict[str, Any]]:
    """The figures of every row, with a bar over what is missing."""
    found: dict[str, dict[str, Any]] = {}
    with progress_bar(bench.work(rows), "motion", "speech") as bar:
        for row in rows:
            bar.set_postfix_str(row.name)
            found[row.name] = bench.measure(row, lambda: bar.update())
    return found


def with_old(
    rows: Mapping[str, Any], references: Mapping[str, Any], shown: set[str], about: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """The rows with those of earlier weights, each compared with the truth that it was measured against.

    Weights that the table measures anyway are left out, and so are figures of other speeches' number or frame rate.
    """
    rows, references = dict(rows), dict(references)
    if not OLD.is_file():
        return rows, references
    old = json.loads(OLD.read_text(encoding="utf-8"))
    for name, weights in old["about"]["weights"].items():
        if weights in shown or name not in old["rows"] or old["about"]["fps"] != about["fps"]:
            continue
        label = f"{name} of {old['version']}"
        same = old["about"]["bench"] == about["bench"]
        note = "" if same else "measured with the talker and the statistics of that version, against its truth"
        rows[label] = {**old["rows"][name], **({"note": note} if note else {})}
        references[label] = old["rows"]
    return rows, references


def real_rows(names: list[str], fps: float, cache: Path) -> tuple[dict[str, Any], str]:
    """The takes of real speech, and why there are none."""
    folder = shared_folder()
    speeches = real_speeches(folder, fps) if folder.is_dir() else []
    if not speeches:
        return {}, "no recordings in the folder of A2G_SHARED_DATA."
    with progress_bar(len(speeches) * len(names), "real speech", "motion") as bar:
        rows = [run_row(name, lambda: speeches, fps, REAL_SAMPLES, 0) for name in names]
        return real_takes(speeches, rows, cache, lambda: bar.update()), ""


def draw_picture(path: Path, rows: Mapping[str, Any], references: Mapping[str, Any]) -> None:
    """The picture, where Matplotlib is installed."""
    try:
        from experiments.motion.picture import relative_picture
    except ImportError:
        say("no picture: it needs Matplotlib (pip install -e '.[experiments]').")
        return
    relative_picture(path, rows, references)


def draw_strips(options: argparse.Namespace, bench: Bench, names: list[str], fps: float) -> None:
    """Film strips for the first generated speech, and for a real one where there is one."""
    from experiments.motion.strips import film_strips

    rows = partial(run_row, fps=fps, samples=1, seed=0)
    film_strips(
        options.out / "strips_generated.png", bench.speeches[0], [rows(n, lambda: bench.speeches) for n in names]
    )
    real = [speech for speech in real_speeches(shared_folder(), fps) if speech.truth is not None]
    if real:
        film_strips(options.out / "strips_real.png", real[0], [rows(name, lambda: real) for name in names])


if __name__ == "__main__":
    main()
