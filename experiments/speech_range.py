"""The range of the speech of generated corpora, written into the folders of shipped runs as ``speech.json``.

    python -m experiments.speech_range demo demo-flow demo-emotion

Training measures it itself. This command needs no corpus: it speaks 60 of the run's recordings again, by their roles in
``run.json`` (about four minutes of a core a run, with the extra ``voices``).
"""

import argparse

import numpy as np

from a2g_jax.features.mel import log_mel
from a2g_jax.features.speech_range import range_of_speech
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import open_run
from a2g_jax.training.run_file import run_folder
from a2g_jax.training.speech_range import write_speech_range

RECORDINGS, SEED = 60, 0


def measure(name: str) -> None:
    """Write the range of a run that was trained on generated talk."""
    config = open_run(name).config
    roles, rate = config.corpus["recipe"]["roles"], config.mel.sample_rate
    chosen = np.random.default_rng(SEED).permutation(len(roles))[:RECORDINGS]
    speeches = [talk(**roles[number], sample_rate=rate).audio for number in chosen]
    rows = (log_mel(one, config.mel, config.fps, round(len(one) / rate * config.fps)) for one in speeches)
    found = range_of_speech(rows, speeches, config.mel, config.fps)
    write_speech_range(run_folder(name), found)
    print(name, found and found.to_json()["ranges"])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+")
    for run in parser.parse_args().runs:
        measure(run)
