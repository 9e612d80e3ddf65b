"""``a2g serve``: live motion over a WebSocket, and a page with a microphone."""

import argparse
from dataclasses import replace
from typing import Any

from a2g_jax.cli import sampling
from a2g_jax.cli.argument_types import count, number
from a2g_jax.cli.paths import existing_file, existing_run
from a2g_jax.errors import InputError
from a2g_jax.io.character import character_suffix
from a2g_jax.serving.run import check_extra, exposure, listen, serve

DESCRIPTION = (
    "Serve live motion on this computer: a page with a microphone, and a WebSocket that takes audio and gives frames"
    " (docs/live.md). Every setting of the model's generation is a flag too, such as --temperature."
)
#: Further flags are settings.
TAKES_SETTINGS = True
#: The port, and seconds of the look-ahead, where no others are named.
PORT, LOOKAHEAD = 8765, 0.5


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g serve``; those of settings are read later, since they depend on the run."""
    parser.add_argument("run", metavar="RUN", help="a run folder, or 'demo', 'demo-flow' or 'demo-emotion'")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: 127.0.0.1, this computer)")
    port = number(int, 0, 65535, "a number from 0 to 65535")
    parser.add_argument("--port", type=port, default=PORT, help=f"default: {PORT}; 0 for one that is free")
    parser.add_argument(
        "--allow-host",
        action="append",
        default=[],
        metavar="NAME",
        help="another name of this computer in the address bar, such as that of a proxy; may be repeated",
    )
    parser.add_argument(
        "--lookahead",
        type=number(float, 0, 60, "0 to 60 seconds"),
        default=LOOKAHEAD,
        metavar="S",
        help=f"seconds of speech that frames wait for, unless a client names others (default: {LOOKAHEAD})",
    )
    parser.add_argument(
        "--clients", type=count, default=8, metavar="N", help="at a time, further ones are refused (default: 8)"
    )
    parser.add_argument(
        "--idle",
        type=number(float, 1, 86400, "1 to 86400 seconds"),
        default=30.0,
        metavar="S",
        help="seconds of a silent connection before it is closed (default: 30)",
    )
    parser.add_argument(
        "--pace",
        type=number(float, 1, 1000, "a number from 1 to 1000"),
        default=4.0,
        metavar="X",
        help="times real time at which audio is read from a client (default: 4)",
    )
    parser.add_argument("--to", metavar="CHARACTER", help="a BVH, GLB or VRM file whose joints the frames move")
    parser.add_argument(
        "--fingers", choices=("relaxed", "none"), help="fingers of the character that the run does not move"
    )


def run(options: argparse.Namespace, extra: list[str]) -> None:
    """Load, compile, and answer until Ctrl-C.

    Raises:
        InputError: a run, a character or a port that cannot be used, or missing packages.
    """
    check_extra("a2g serve")
    existing_run(options.run)
    settings = sampling.sampling_settings(options.run, extra)
    if options.to is not None:
        character_suffix(options.to)
        existing_file(options.to)
    elif options.fingers is not None:
        raise InputError("--fingers is for the fingers of a character; name it with --to.")
    bound = listen(options.host, options.port)
    try:
        if (warning := exposure(options.host)) is not None:
            print(warning)
        app, server_options = _application(options, settings)
    except BaseException:
        bound.close()
        raise
    serve(app, bound, lambda line: print(line, flush=True), **server_options)


def _application(options: argparse.Namespace, settings: Any) -> tuple[Any, dict[str, Any]]:
    """The application, and settings of the process that runs it."""
    from a2g_jax.compilations import keep_compilations
    from a2g_jax.generation.delivery import Delivery
    from a2g_jax.io.character import read_character
    from a2g_jax.serving.app import make_app
    from a2g_jax.serving.live.page import lifespan, routes
    from a2g_jax.serving.live.service import SERVER_OPTIONS, Limits, Service
    from a2g_jax.serving.security import Security
    from a2g_jax.training.run import open_run

    keep_compilations()
    opened = open_run(options.run)
    trained = replace(opened, config=replace(opened.config, sampling=settings))
    character = None if options.to is None else read_character(options.to)
    delivery = Delivery(character=character, fingers=options.fingers != "none")
    limits = Limits(clients=options.clients, idle=options.idle, pace=options.pace)
    service = Service(trained, limits, options.lookahead, delivery)
    print("compiling; a minute the first time, seconds later", flush=True)
    service.warm_up()
    security = Security(options.host, tuple(options.allow_host))
    answers = routes(service, options.run)
    for line in delivery.lines():  # once the page has been made, for which the mesh is read
        print(line, flush=True)
    return make_app(answers, security, lifespan(service)), SERVER_OPTIONS
