"""``a2g export``: the generator of a run as StableHLO programs."""

import argparse
from dataclasses import replace

from a2g_jax.cli import sampling
from a2g_jax.cli.paths import existing_run, writable_folder
from a2g_jax.errors import InputError

DESCRIPTION = (
    "Write the generator of a run as StableHLO programs with their weights, which need no code of its model."
    " Settings of generation are flags, as of 'a2g generate', and become part of the programs."
)
#: Further flags are settings.
TAKES_SETTINGS = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g export``; those of settings are read later, since they depend on the run."""
    parser.add_argument("run", metavar="RUN", help="a run folder, or demo, demo-flow or demo-emotion")
    parser.add_argument("--out", metavar="DIR", required=True, help="folder to write to")
    parser.add_argument(
        "--conditions",
        type=_names,
        default=(),
        metavar="NAMES",
        help="what becomes an input besides the audio, comma-separated: emotion, controls or seed_poses, where the run"
        " takes them",
    )
    parser.add_argument(
        "--platforms",
        type=_names,
        metavar="NAMES",
        help="devices that the programs run on, comma-separated (default: cpu,cuda,rocm,tpu)",
    )


def run(options: argparse.Namespace, extra: list[str]) -> None:
    """Export, and print the files and their inputs.

    Args:
        extra: sampling settings, such as ``["--temperature", "0.8"]``.

    Raises:
        InputError: a run, setting, condition, device or folder that cannot be used.
    """
    existing_run(options.run)
    settings = sampling.sampling_settings(options.run, extra)
    writable_folder(options.out)

    from a2g_jax.generation.programs.manifest import MANIFEST, WINDOW
    from a2g_jax.generation.programs.writing import PLATFORMS, export_programs
    from a2g_jax.training.run import open_run

    for name in options.platforms or ():
        if name not in PLATFORMS:
            raise InputError(f"--platforms: expected some of {', '.join(PLATFORMS)}; got {name!r}.")
    opened = open_run(options.run)
    opened = replace(opened, config=replace(opened.config, sampling=settings))
    made = export_programs(opened, options.out, options.conditions, platforms=options.platforms or PLATFORMS)
    print(f"{options.out}: {', '.join((MANIFEST, *made.files))}")
    for name, port in made.programs[WINDOW]["inputs"].items():
        print(f"  {name}: {port.dtype}{list(port.shape)}{f', {port.meaning}' if port.meaning else ''}")
    print(f"next: a2g_jax.Programs({str(options.out)!r}).generate(audio, samples=5)")


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(",") if part.strip())
