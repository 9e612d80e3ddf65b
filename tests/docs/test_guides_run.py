"""The commands and programs of the guides run, in order, in a folder with the files that they name.

Trainings take a few steps and generated corpora a minute, which changes nothing about what is tested: that each command
does its work with the files that the ones before it left.
"""

import re
import shutil
from contextlib import redirect_stdout
from dataclasses import replace

import pytest

import a2g_jax
from a2g_jax.cli import main
from a2g_jax.viz.mannequin_glb import write_mannequin_glb
from tests.docs.guides_for_tests import PAGES, commands, programs

#: Why a command is not run, by what it contains.
NOT_HERE = {
    "pip ": "installs packages from the network",
    "python3 -m venv": "installs packages from the network",
    ".venv/bin/": "installs packages from the network",
    "blender ": "needs Blender; tests/io/test_blender_characters.py runs it",
    "jupyter ": "starts a server; tests/notebooks run the notebooks",
    "mkdocs ": "builds the site, as CI does",
    "ruff ": "as CI does",
    "mypy": "as CI does",
    "srun ": "needs a cluster",
    "--devices": "needs several devices; tests/training/test_processes.py makes some",
    "--shard": "tests/data/test_shards.py prepares parts and merges them",
    "--merge": "tests/data/test_shards.py prepares parts and merges them",
    "/data/": "needs several hosts",
    "tensorboard ": "starts a server",
    "--tensorboard": "needs an extra that tests do not install",
    "run_seed": "needs runs of several seeds; tests/evaluation/test_seeds.py has them",
    "jax.devices()": "prints the devices of the machine",
    "pytest": "is this",
    "experiments.": "takes minutes; tests/experiments test its parts",
    "cp ": "replaces the weights of the package",
    " beat BEAT": "needs a published data set; tests/data/datasets have its layout",
    " ted TED": "needs a published data set",
    " ted-expressive TED": "needs a published data set",
    " ted-emotion TED": "needs a published data set",
    "--corpus beat": "needs a published data set",
    "classifiers --": "needs a published data set",
    "evaluate audio-classifier": "needs a published data set",
    "CLASSIFIER": "needs a published data set",
    "--formats mp4": "needs a browser; tests/viz/test_video.py writes one",
    "my_package": "is of a package that CONTRIBUTING invents; tests/plugin has one",
    "A2G_MODELS": "is of a package that CONTRIBUTING invents",
    "http.server": "starts a server",
    " PATH": "stands for any path",
    "--score": "needs Matplotlib and minutes; tests/inspection run it",
    "demo-emotion": "is run by tests/test_demo_emotions.py",
    "--emotions": "is run by tests/test_demo_emotions.py",
    "--compare": "is run by tests/test_demo_compare.py",
    "--style": "is run by tests/generation/test_style_clips.py",
}
#: Pages of CONTRIBUTING's kind, whose programs are modules of other packages.
MODULES = ("def build(", "ENTRY", "DATASET", "MotionFormat", "Metric(", "def write_csv", "LinearConfig")
#: The smallest trainings and corpora.
SMALL = ["--steps", "4", "--batch-size", "2", "--log-every", "2", "--validate-every", "4", "--checkpoint-every", "4"]
#: Further stages of a model, whose steps are settings of their own.
SMALL_STAGES = {
    "audio2gestures": ["--adversarial-steps", "2"],
    "emotion_gesture": ["--mining-steps", "2", "--vae-steps", "2", "--sampled-steps", "2"],
}


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A folder with what the guides name: speech, takes, characters, a corpus and runs."""
    folder = tmp_path_factory.mktemp("files")
    takes = [a2g_jax.talk(12.0, seed, fingers=True) for seed in range(3)]
    for name, take in zip(("take", "clip", "shaking"), takes, strict=True):
        a2g_jax.write_bvh(folder / f"{name}.bvh", take.motion)
        a2g_jax.write_audio(folder / f"{name}.wav", take.audio, take.sample_rate)
    a2g_jax.write_audio(folder / "speech.wav", a2g_jax.talk(14.0, 9).audio, 16000)
    still = replace(takes[0].motion, rotations=takes[0].motion.rotations[:40], root=takes[0].motion.root[:40])
    for name in ("wave", "point"):
        a2g_jax.write_bvh(folder / f"{name}.bvh", still)
    a2g_jax.write_bvh(folder / "character.bvh", takes[1].motion)
    for name in ("character.glb", "avatar.vrm"):
        write_mannequin_glb(folder / name, still)
    longer = [a2g_jax.talk(45.0, seed) for seed in range(2)]  # their test split has a stretch to score
    for recordings in ("RECORDINGS", "TAKES"):
        for number, take in enumerate(longer):
            a2g_jax.write_bvh(folder / recordings / f"take{number}.bvh", take.motion)
            a2g_jax.write_audio(folder / recordings / f"take{number}.wav", take.audio, take.sample_rate)
    return folder


@pytest.fixture
def here(files, tmp_path, monkeypatch):
    """The test's own copy of it, as the current folder."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def reason(text):
    """Why a command is not run; empty if it is."""
    return next((why for part, why in NOT_HERE.items() if part in text), "")


def shortened(words):
    """The call with a small training or corpus."""
    if words[0] == "train" and "--settings" not in words and ("--resume" not in words or "--seeds" in words):
        words = re.sub(r" --(steps|batch-size) \d+", "", " ".join(words)).split()
        return [*words, *SMALL, *([] if "--from" in words else SMALL_STAGES.get(words[1], []))]
    if words[0] == "train" and "--resume" in words and "--steps" in words:
        words[words.index("--steps") + 1] = "6"  # two more than the others
    if "--minutes" in words:
        words[words.index("--minutes") + 1] = "1"
    if words[0] == "evaluate" and "--samples" not in words and "--compare" not in words:
        words += ["--samples", "2"]
    if words[0] in ("generate", "demo") and "--samples" not in words and "--settings" not in words:
        words += ["--samples", "1"]
    return words


PAGES_WITH_COMMANDS = [page for page in PAGES if any(one.words[0] == "a2g" for one in commands(page))]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in PAGES_WITH_COMMANDS if "MODEL_CARD" not in page and page != "CONTRIBUTING.md"]
)
def test_commands_run_in_order(page, here):
    ran = 0
    for one in commands(page):
        if one.words[0] != "a2g" or reason(one.text):
            continue
        before(one.text, here)
        words = shortened(one.words[1:])
        status = main(words)
        assert status == 0, f"{one}: a2g {' '.join(words)}: status {status}"
        ran += 1
    if ran == 0:
        pytest.skip("; ".join(sorted({reason(one.text) for one in commands(page)})))


def before(text, here):
    """Make what a page takes from another one; remove what a page makes in two ways."""
    out = re.search(r"--out (\S+)", text)
    if out and re.match(r"a2g (prepare|train)\b", text) and "--resume" not in text:
        shutil.rmtree(here / out[1], ignore_errors=True)
    if "--config settings.toml" in text:
        with (here / "settings.toml").open("w") as file, redirect_stdout(file):
            assert main(["train", "audio2gestures", "--settings", "--toml"]) == 0
    if "--corpus corpus" in text and not (here / "corpus").exists():
        assert main(["prepare", "talker", "--minutes", "4", "--out", "corpus"]) == 0
    needs_run = re.search(r"(generate|evaluate) run\b", text) or "--resume" in text
    if needs_run and not (here / "run").exists():
        assert main(shortened(["train", "audio2gestures", "--corpus", "corpus", "--out", "run"])) == 0


def test_every_command_is_run_or_has_a_reason():
    """No command falls between: what is no ``a2g`` has a reason."""
    for page in PAGES:
        for one in commands(page):
            assert one.words[0] in ("a2g", "export", ".") or reason(one.text), str(one)


RUN = [one for page in PAGES for one in programs(page) if not any(part in one.text for part in MODULES)]


@pytest.mark.slow
@pytest.mark.parametrize("one", RUN, ids=map(str, RUN))
def test_programs_run(one, here):
    names = {"__name__": "guide"}
    if one.page == "docs/style.md":
        pytest.skip("continues with motions of one's own; tests/generation/test_style.py runs it")
    exec(compile(one.text, str(one), "exec"), names)
