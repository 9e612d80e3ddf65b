"""Two hundred generations with all options, and whether any frame outside the bounds of a body was not reported.

    python -m experiments.bodies            # ten minutes to half an hour of one core
    python -m experiments.bodies --every 3  # every third case
    python -m experiments.bodies --render   # the table again, from what is measured

Runs ``a2g generate`` for all shipped runs, speeches (generated, that of the demo, real ones in ``A2G_SHARED_DATA``) and
options (seeds, settings, controls, pins, styles; real clips and absurd ones), and judges the files it writes by bounds
implemented a second time (:mod:`experiments.bodies.judge`). Then the same bounds on motion that is not generated:
held-out talk, in which findings are false alarms, and the takes of real people on the run's body. Writes
``results/bodies.json`` and ``results/bodies.md``. Cases are kept in ``--cache`` as soon as they are measured, by
weights and options; empty the folder after a change of the package's code.
"""

import argparse
import contextlib
import hashlib
import io
import re
import shutil
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from a2g_jax import __version__
from a2g_jax.cli import main as command_line
from a2g_jax.generation.clips import read_on_skeleton
from a2g_jax.generation.generator import Generator, plant_rotations
from a2g_jax.geometry.retarget.onto import face
from a2g_jax.io.files import read_json, sha256_file, write_json
from a2g_jax.metrics.body.bounds import anybody
from a2g_jax.metrics.body.check import check_motion, frames_outside
from a2g_jax.progress import progress_bar
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.speakers import SPEAKERS
from a2g_jax.training.run import Run, open_run
from a2g_jax.training.run_file import SHIPPED, WEIGHTS_FILE, run_folder
from experiments.bodies.cases import REAL_CLIPS, Case, cases, write_speeches
from experiments.bodies.clips import write_clips
from experiments.bodies.judge import Judge, unreported
from experiments.bodies.table import render
from experiments.motion.speeches import shared_folder

RESULTS = Path(__file__).parent / "results"
#: Minutes and first seed of the held-out talk.
TRUTH_MINUTES, TRUTH_SEED = 12, 4100


def main() -> None:
    """Measure what is missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, default=Path("build/bodies"))
    parser.add_argument("--out", type=Path, default=RESULTS)
    parser.add_argument("--every", type=int, default=1, metavar="N", help="every N-th case (default: all)")
    parser.add_argument("--render", action="store_true", help="only write bodies.md from bodies.json")
    options = parser.parse_args()
    if not options.render:
        options.out.mkdir(parents=True, exist_ok=True)
        write_json(options.out / "bodies.json", measure(options.cache, options.every))
    found = read_json(options.out / "bodies.json")
    (options.out / "bodies.md").write_text(render(found), encoding="utf-8")


def measure(cache: Path, every: int = 1) -> dict[str, Any]:
    """Records of every n-th case, of true and real motion, and the time that a check takes."""
    shared = shared_folder()
    real = shared if shared.is_dir() else None
    runs = {name: open_run(name) for name in SHIPPED}
    speeches = write_speeches(cache / "speeches", real)
    clips = {name: real / path for name, path in REAL_CLIPS.items()} if real is not None else {}
    clips |= write_clips(cache / "clips")
    planned = list(cases(runs, speeches, clips))[::every]
    judges = {name: Judge(run) for name, run in runs.items()}
    rows = []
    with progress_bar(len(planned), "generating", "case") as bar:
        for case in planned:
            rows.append(_kept(case, speeches, judges[case.run], cache))
            bar.update(1)
    return {
        "package": __version__,
        "every": every,
        "runs": {name: sha256_file(run_folder(name) / WEIGHTS_FILE)[:16] for name in runs},
        "cases": rows,
        "truth": {name: _truth(run) for name, run in runs.items()},
        "people": {name: _people(run, real) for name, run in runs.items()} if real is not None else {},
        "cost": {name: _cost(run) for name, run in runs.items()},
    }


def _kept(case: Case, speeches: dict[str, Path], judge: Judge, cache: Path) -> dict[str, Any]:
    """The record of a case, measured once for these weights and options."""
    weights = sha256_file(run_folder(case.run) / WEIGHTS_FILE)
    key = hashlib.sha256(f"{case}{weights}".encode()).hexdigest()[:16]
    path = cache / "cases" / f"{key}.json"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        write_json(path, _generated(case, speeches, judge, cache / "out"))
    found: dict[str, Any] = read_json(path)
    return found


def _generated(case: Case, speeches: dict[str, Path], judge: Judge, out: Path) -> dict[str, Any]:
    shutil.rmtree(out, ignore_errors=True)
    command = ["generate", case.run, "--audio", str(speeches[case.speech]), "--out", str(out), "--formats", "npz"]
    command += ["--samples", str(case.samples), "--seed", str(case.seed), *case.flags]
    printed, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(errors):
        status = command_line(command)
    row: dict[str, Any] = {"case": case.name, "run": case.run, "group": case.group, "status": status}
    if status != 0:
        last = errors.getvalue().strip().splitlines()[-1:]
        # Folders differ from machine to machine.
        return row | {"refused": re.sub(r"\S*/", "", last[0].split("\r")[-1]) if last else ""}
    reports = read_json(out / "checks.json")["samples"]
    outside, missing = unreported(out, judge)
    lines = [line for line in printed.getvalue().splitlines() if line.startswith("sample ") and "BODY" in line]
    return row | {
        "samples": len(reports),
        "at_once": sum(report["draws"] == 1 and not report["eased"] and not report["findings"] for report in reports),
        "eased": sum(bool(report["eased"]) and not report["findings"] for report in reports),
        "drawn_again": sum(report["draws"] > 1 for report in reports),
        "reported": sum(bool(report["findings"]) for report in reports),
        "before": _count(finding for report in reports for finding in report["first_draw"]),
        "outside": outside,
        "unreported": missing,
        "lines": lines,
    }


def _count(findings: Any) -> dict[str, int]:
    return dict(Counter(f"{finding['figure']} {finding['joint']}" for finding in findings).most_common())


def _truth(run: Run) -> dict[str, Any]:
    """Findings on held-out talk, which are false alarms."""
    frames, found = 0, []
    for minute in range(TRUTH_MINUTES):
        motion = talk(
            60.0, TRUTH_SEED + minute, speaker=tuple(SPEAKERS)[minute % len(SPEAKERS)], fps=run.config.fps
        ).motion
        frames += motion.frames
        found += [str(one) for one in check_motion(motion, run.config.body_bounds)]
    return {"frames": frames, "findings": found}


def _people(run: Run, folder: Path) -> dict[str, Any]:
    """Findings on the takes of real people on the run's body: against its bounds, and against those of any person.

    Their feet are planted as those of all generated motion; the root of BEAT's takes does not stand on a floor.
    """
    config, found = run.config, {}
    facing = np.asarray(config.space.mean_rotations(config.statistics["pose"].mean)[0], np.float64)
    for name, path in REAL_CLIPS.items():
        take = face(read_on_skeleton(folder / path, config.skeleton, config.fps), facing)[0]
        motion = plant_rotations(run, np.asarray(take.rotations))
        for source, bounds in (("run", config.body_bounds), ("any person", anybody(config.body_reference))):
            findings = check_motion(motion, bounds)
            found[f"{name}, {source}"] = {
                "frames": motion.frames,
                "outside": frames_outside(findings, motion.frames),
                "findings": _count(one.to_json() for one in findings),
            }
    return found


def _cost(run: Run) -> dict[str, float]:
    """Seconds of generating and of checking a sample of 12 s, medians of five, everything compiled."""
    generator, audio = Generator(run), talk(12.0, TRUTH_SEED).audio
    times: dict[str, list[float]] = {"generate": [], "check": []}
    for _ in range(6):
        begun = time.perf_counter()
        motion = generator.generate(audio, 1)[0]
        drawn = time.perf_counter()
        check_motion(motion, run.config.body_bounds)
        times["generate"].append(drawn - begun)
        times["check"].append(time.perf_counter() - drawn)
    return {name: float(np.median(values[1:])) for name, values in times.items()}


if __name__ == "__main__":
    main()
