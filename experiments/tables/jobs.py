"""The commands behind the papers' tables, with what each one needs and makes.

Every job is a command of this repository; corpora and runs lie in a work folder. Prepared corpora and finished runs are
kept, and tables compute only records that are missing, so that the same jobs resume.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from a2g_jax.training.run_file import RUN_FILE, read_description

_FEATURES = "experiments/features"
_EMOTION = "--features emotion-gesture --equal-emotions --languages invented,en"


class Job(NamedTuple):
    """A command with its place in the plan."""

    name: str
    paper: str
    command: str
    """Arguments of ``python -m``; ``{work}`` is the work folder, ``{runs}`` that of trained rows."""
    needs: tuple[str, ...] = ()
    """Names of the jobs before it."""
    makes: str = ""
    """File below the work folder that exists once the job is finished; empty for tables, which resume themselves."""
    steps: int = 0
    """Training steps that the description of a run states once the job is finished; 0 for no training."""

    def arguments(self, work: Path) -> list[str]:
        """The arguments with their folders."""
        places = {"work": str(work), "runs": str(work / "runs"), "features": _FEATURES}
        return [argument.format(**places) for argument in self.command.split()]

    def finished(self, work: Path) -> bool:
        """Whether what it makes is there, and whole."""
        if not self.makes or not (work / self.makes).is_file():
            return False
        # Runs have weights from their first checkpoint on.
        return not self.steps or read_description(work / self.name).get("steps") == self.steps


def _corpus(name: str, paper: str, flags: str) -> Job:
    return Job(name, paper, f"a2g_jax.cli prepare talker --out {{work}}/{name} {flags}", (), f"{name}/manifest.json")


def _network(name: str, paper: str, model: str, corpus: str, steps: int, flags: str) -> Job:
    command = (
        f"a2g_jax.cli train {model} --corpus {{work}}/{corpus} --out {{work}}/{name} --resume --steps {steps} {flags}"
    )
    return Job(name, paper, command, (corpus,), f"{name}/{RUN_FILE}", steps)


def _audio2gestures() -> Iterable[Job]:
    paper = "audio2gestures"
    yield _corpus("talk", paper, "--minutes 90 --seed 6")
    yield _corpus("talk_2d", paper, "--minutes 60 --seed 6 --view s2g --features audio2gestures-2d")
    yield _network("talk_loss", paper, "motion_autoencoder", "talk", 2000, "--seed 1")
    scored = "--corpus {work}/talk --features {features}/talker --runs {runs}"
    for number in range(1, 7):
        flags, needs = scored, ("talk",)
        if number == 1:
            flags += " --corpus-2d {work}/talk_2d --features-2d {features}/talker_2d"
            needs = ("talk", "talk_2d")
        if number == 4:
            flags += " --perceptual {work}/talk_loss"
            needs = ("talk", "talk_loss")
        yield Job(f"{paper}.table{number}", paper, f"experiments.{paper}.table{number} {flags}", needs)


def _stylized_flow() -> Iterable[Job]:
    paper = "stylized_flow"
    yield _corpus("flow", paper, "--minutes 90 --seed 6 --features stylized-flow")
    yield _corpus("ted", paper, "--minutes 90 --seed 6 --view ted --features stylized-flow-ted")
    yield _network("flow_score", paper, "motion_autoencoder", "flow", 2000, "--clip-frames 47")
    yield _network("flow_loss", paper, "motion_autoencoder", "flow", 2000, "--clip-frames 47 --seed 1")
    yield _network("ted_loss", paper, "motion_autoencoder", "ted", 2000, "--clip-frames 30 --seed 1")
    ted = "{work}/ted", "{features}/talker_ted", "{work}/ted_loss"
    trinity = "--corpus {work}/flow --features {work}/flow_score --perceptual {work}/flow_loss"
    both = f"{trinity} --corpus-ted {ted[0]} --features-ted {ted[1]} --perceptual-ted {ted[2]} --runs {{runs}}"
    needs = ("flow", "flow_score", "flow_loss", "ted", "ted_loss")
    yield Job(f"{paper}.table1", paper, f"experiments.{paper}.table1 {both}", needs)
    alone = f"--corpus {ted[0]} --features {ted[1]} --perceptual {ted[2]} --runs {{runs}}"
    yield Job(f"{paper}.table2", paper, f"experiments.{paper}.table2 {alone}", ("ted", "ted_loss"))
    # Its rows are the runs of Table 1.
    yield Job(f"{paper}.table3", paper, f"experiments.{paper}.table3 {alone}", (f"{paper}.table1",))


def _emotion_gesture() -> Iterable[Job]:
    paper = "emotion_gesture"
    yield _corpus("emotions", paper, f"--minutes 240 --seed 5 {_EMOTION}")
    yield _corpus("others", paper, f"--minutes 160 --seed 9 {_EMOTION}")
    yield _corpus("jittered", paper, f"--minutes 240 --seed 5 --jitter 2 {_EMOTION}")
    yield _network("emotion_features", paper, "motion_autoencoder", "others", 1500, "--clip-frames 50")
    own = "--corpus {work}/emotions --runs {runs}"
    # The classifier is kept, since another processor trains another one, whose records do not continue a table:
    # a2g train emotion_classifier --corpus others --steps 800 --batch-size 32 --clip-frames 50
    scored = f"{own} --features {{work}}/emotion_features --judge {{features}}/emotions"
    needs = ("emotions", "emotion_features")
    yield Job(f"{paper}.table1", paper, f"experiments.{paper}.table1 {own} --steps 800", ("emotions",))
    for table in ("table3", "table4", "table2"):
        yield Job(f"{paper}.{table}", paper, f"experiments.{paper}.{table} {scored}", needs)
    # Its rows are runs of Table III.
    yield Job(f"{paper}.mining", paper, f"experiments.{paper}.mining {own}", (f"{paper}.table3",))
    jitter = "--corpus {work}/jittered --clean {work}/emotions --runs {runs}"
    yield Job(f"{paper}.jitter", paper, f"experiments.{paper}.jitter {jitter}", ("jittered", "emotions"))
    tables = tuple(f"{paper}.{name}" for name in ("table2", "table3", "table4", "mining", "jitter"))
    yield Job(f"{paper}.claims", paper, f"experiments.{paper}.claims", tables)
    yield Job(f"{paper}.strips", paper, f"experiments.{paper}.strips {own}", (f"{paper}.table2",))


#: All jobs; each comes after those that it needs.
JOBS: tuple[Job, ...] = (*_audio2gestures(), *_stylized_flow(), *_emotion_gesture())
PAPERS = tuple(dict.fromkeys(job.paper for job in JOBS))


def ready(jobs: Sequence[Job], done: set[str], begun: set[str], running: set[str]) -> list[Job]:
    """Jobs that can begin: not begun yet, with all that they need done; tables of one paper one at a time.

    Tables of a paper take records from each other, and two at once would train the same row twice.
    """
    busy = {job.paper for job in jobs if job.name in running and not job.makes}
    found = []
    for job in jobs:
        if job.name in begun or not set(job.needs) <= done:
            continue
        if not job.makes:
            if job.paper in busy:
                continue
            busy.add(job.paper)
        found.append(job)
    return found
