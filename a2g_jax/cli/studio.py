"""``a2g studio``: a local page that generates, compares and ranks motions, and offers their files."""

import argparse
from collections.abc import Sequence
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from a2g_jax.cli import generate, sampling
from a2g_jax.cli.argument_types import number
from a2g_jax.cli.paths import existing_run
from a2g_jax.errors import InputError
from a2g_jax.serving.run import check_extra, exposure, listen, serve
from a2g_jax.training.run_file import SHIPPED, SHIPPED_TITLES

if TYPE_CHECKING:
    from a2g_jax.generation.capabilities import Capabilities
    from a2g_jax.serving.studio.jobs import Job
    from a2g_jax.serving.studio.studio import Studio
    from a2g_jax.serving.studio.takes import Outcome
    from a2g_jax.training.run import Run

DESCRIPTION = (
    "A page in your browser that generates motions for your speech, side by side: systems, emotions, controls and clips"
    " to choose from, and files to download. It runs on this computer alone."
)
PORT = 8041
#: The recording that the page begins with.
DEMO = "demo"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g studio``."""
    parser.add_argument(
        "runs", nargs="*", metavar="RUN", help="run folders to choose from, besides the runs that come with the package"
    )
    parser.add_argument(
        "--port",
        type=number(int, 0, 65535, "a whole number from 0 to 65535"),
        default=PORT,
        help=f"port of the page (default: {PORT}; 0 for a free one)",
    )
    parser.add_argument(
        "--host", default="127.0.0.1", metavar="ADDRESS", help="address to listen on (default: this computer alone)"
    )
    parser.add_argument(
        "--allow-host", action="append", default=[], metavar="NAME", help="a further name of this server; repeatable"
    )
    parser.add_argument("--no-browser", action="store_true", help="do not open the page in a browser")


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Serve the page until Ctrl-C.

    Raises:
        InputError: a run that cannot be used, or a port that is taken.
    """
    systems = named_runs(options.runs)
    check_extra("a2g studio")
    bound = listen(options.host, options.port)
    if warning := exposure(options.host):
        print(warning)

    from a2g_jax.compilations import keep_compilations
    from a2g_jax.serving.studio.routes import studio_app

    keep_compilations()
    with make_studio(systems, first_run(options.runs)) as studio:
        add_demo_speech(studio)
        app = studio_app(studio, options.host, tuple(options.allow_host), begin=lambda: _open_first(studio))
        serve(app, bound, announce=lambda line: _announce(line, browser=not options.no_browser))


def named_runs(folders: Sequence[str]) -> dict[str, str]:
    """The shipped runs, then others, by what the page calls them.

    Raises:
        InputError: no run, or two of one name.
    """
    found = {name: name for name in SHIPPED}
    for folder in folders:
        if folder in SHIPPED:
            continue
        existing_run(folder)
        name = _page_name(folder)
        if name in found:
            raise InputError(f"{folder}: another run of the studio has the name {name!r}; rename the folder.")
        found[name] = folder
    return found


def first_run(runs: Sequence[str]) -> str:
    """The run that the page begins with, by what the page calls it: the first one of the command, else ``demo``."""
    return _page_name(runs[0]) if runs else next(iter(SHIPPED))


def _page_name(run: str) -> str:
    """What the page calls a run."""
    return run if run in SHIPPED else Path(run).resolve().name


def make_studio(systems: dict[str, str], first: str) -> "Studio":
    """A studio that generates as ``a2g generate`` does."""
    from a2g_jax.generation.capabilities import capabilities
    from a2g_jax.serving.studio.studio import Studio

    opened = lru_cache(maxsize=len(systems))(_opened)

    def describe(name: str) -> "Capabilities":
        return capabilities(opened(name))

    def make(arguments: Sequence[str], folder: Path, job: "Job") -> "Outcome":
        return generate_take(arguments, folder, job, opened(arguments[0]))

    return Studio(systems, describe, make, first=first, titles=SHIPPED_TITLES)


def add_demo_speech(studio: "Studio") -> None:
    """Offer the speech of ``a2g demo``, with its words."""
    from a2g_jax.talker.demo_speech import demo_speech

    path = Path(str(files("a2g_jax.talker").joinpath("demo", "speech.flac")))
    studio.add_speech(DEMO, "the speech of the demo", path, demo_speech().words)


class _Parser(argparse.ArgumentParser):
    """The parser of ``a2g generate`` with errors that a page can show."""

    def error(self, message: str) -> NoReturn:
        raise InputError(message)


@lru_cache(maxsize=1)
def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="a2g generate", allow_abbrev=False, add_help=False)
    generate.add_arguments(parser)
    return parser


def generate_take(arguments: Sequence[str], folder: Path, job: "Job", opened: "Run | None" = None) -> "Outcome":
    """Generate what ``a2g generate`` generates for the same arguments.

    Args:
        arguments: of the command, without ``--out``.
        folder: for the files.
        job: that progress is reported to.
        opened: the run, where it is open already.

    Raises:
        InputError: what the command refuses.
    """
    from a2g_jax.generation.checked import Checked
    from a2g_jax.generation.export import describe_findings, export, requested
    from a2g_jax.generation.ranking import read_scores
    from a2g_jax.io.audio import write_audio
    from a2g_jax.io.npz import read_motion_npz
    from a2g_jax.serving.studio.takes import SPEECH, Outcome

    options, extra = _parser().parse_known_args(list(arguments))
    job.say("reading the speech and the settings")
    settings = sampling.sampling_settings(options.run, [*extra, *sampling.control_flags(options)])
    generate.check(options, extra)
    ready = generate.prepare(options, settings, opened)
    rate = ready.run.config.mel.sample_rate
    checked = Checked(ready.run, ready.chosen.sampler)
    about = {**ready.about}
    label, lanes = about.pop("label", ""), about.pop("lanes", ())
    job.say("generating")
    export(
        ready.run,
        checked,
        ready.audio,
        folder,
        samples=options.samples,
        seed=options.seed,
        formats=options.formats,
        title=ready.title,
        label=label,
        report=lambda done: job.step(done, options.samples, "sample"),
        delivery=ready.delivery,
        order="best",
    )
    write_audio(folder / SPEECH, ready.audio, rate)
    skin = None
    if ready.delivery.character is not None:  # before the lines, which say what cannot be read of it
        skin = ready.delivery.skin(read_motion_npz(folder / "sample_00.npz").skeleton)
    described = [describe_findings(report.findings, ready.run.config.fps) for report in checked.reports]
    return Outcome(
        seconds=len(ready.audio) / rate,
        subtitle=requested(checked, options.samples, label),
        lanes=tuple(lanes),
        notes=tuple(note for note, _ in described),
        tracks=tuple(tracks for _, tracks in described),
        scores=tuple(one.score for one in sorted(read_scores(folder))),
        lines=tuple(filter(None, (*ready.lines, *checked.lines(), *ready.report(folder)))),
        plain=checked.plain(),
        warning=ready.warning,
        skin=skin,
    )


def _opened(name: str) -> "Run":
    from a2g_jax.training.run import open_run

    return open_run(name)


def _open_first(studio: "Studio") -> None:
    """Load the first system, so that the first request begins at once; a run that cannot be used is reported by it."""
    from contextlib import suppress

    with suppress(InputError):
        studio.describe(studio.first)


def _announce(line: str, browser: bool) -> None:
    """Print the line with the URL, and open it."""
    print(line, flush=True)
    url = line.partition(" ")[0]
    if browser and url.startswith("http"):
        import webbrowser

        webbrowser.open(url)
