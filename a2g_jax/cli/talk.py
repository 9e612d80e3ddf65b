"""``a2g talk``: a generated recording with several right motions and their ground truth."""

import argparse

from a2g_jax.cli.argument_types import count, formats, frame_rate, number, sample_rate, seed
from a2g_jax.cli.paths import existing_corpus, writable_folder
from a2g_jax.cli.sampling import print_written
from a2g_jax.errors import InputError
from a2g_jax.generation.formats import talk_formats

DESCRIPTION = "A generated recording, several valid motions for it, and their ground truth."
#: Flags that choose a recording to generate, and cannot be combined with one of a corpus.
_GENERATED = ("seconds", "speaker", "emotion", "fps", "room", "fingers", "language")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of ``a2g talk``."""
    parser.add_argument(
        "--out", required=True, metavar="DIR", help="folder to write to; files of an earlier call in it are replaced"
    )
    parser.add_argument("--seconds", type=number(float, 2, 600, "a number from 2 to 600"), help="length (default: 20)")
    parser.add_argument("--speaker", metavar="NAME", help="the speaker (default: ada)")
    parser.add_argument("--emotion", metavar="NAME", help="the emotion (default: neutral)")
    parser.add_argument(
        "--language",
        metavar="NAME",
        help="invented, en, de, es, fr or it (default: invented; others need a2g_jax[voices])",
    )
    parser.add_argument("--seed", type=seed, default=0, help="seed of the random numbers (default: 0)")
    parser.add_argument("--samples", type=count, default=5, help="number of valid motions (default: 5)")
    parser.add_argument("--fps", type=frame_rate, help="frames per second (default: 30; 15 with --view beat)")
    parser.add_argument(
        "--sample-rate", type=sample_rate, default=16000, metavar="HZ", help="of the audio (default: 16000)"
    )
    parser.add_argument("--fingers", action="store_true", help="52 joints with fingers instead of the 22 of the body")
    parser.add_argument("--room", action="store_true", help="with the response of a microphone and a room")
    parser.add_argument(
        "--view", choices=("body", "beat"), default="body", help="beat: BEAT's 47 upper-body joints (default: body)"
    )
    parser.add_argument("--corpus", metavar="CORPUS", help="show a recording of this generated corpus instead")
    parser.add_argument("--recording", metavar="NAME", help="the recording of the corpus (default: the first)")
    parser.add_argument(
        "--formats",
        type=formats(talk_formats()),
        default=",".join(talk_formats()),
        help=f"any of {', '.join(talk_formats())}, comma-separated (default: all)",
    )


def run(options: argparse.Namespace, _extra: list[str]) -> None:
    """Generate or open the recording, and write it with its motions.

    Raises:
        InputError: flags that exclude each other, an unknown name, or a corpus or folder that cannot be used.
    """
    chosen = {name: getattr(options, name) for name in _GENERATED if getattr(options, name) not in (None, False)}
    if options.corpus is None and options.recording is not None:
        raise InputError("--recording is of a corpus; name it with --corpus.")
    if options.corpus is not None and chosen:
        name = next(iter(chosen))
        raise InputError(f"--{name} cannot be chosen for a recording of a corpus; leave it or --corpus out.")
    existing_corpus(options.corpus)
    writable_folder(options.out)

    from a2g_jax.generation.talk.files import deliver_talk
    from a2g_jax.generation.talk.request import TalkRequest, corpus_request
    from a2g_jax.progress import progress_bar

    request = TalkRequest(seed=options.seed, sample_rate=options.sample_rate, view=options.view, **chosen)
    if options.corpus is None:
        recording = request.recording()
    else:
        recording, request = corpus_request(options.corpus, options.recording, request)
    with progress_bar(options.samples, "generating", "motion") as bar:
        written = deliver_talk(
            recording,
            options.out,
            request=request,
            samples=options.samples,
            formats=options.formats,
            report=lambda done: bar.update(done - bar.n),
        )
    print_written(options.out, written)
