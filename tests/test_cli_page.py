"""The page of ``a2g generate``: the words of a transcript, and links to the files beside it."""

import json
import re

import pytest

from a2g_jax.cli import main
from a2g_jax.io.audio import write_audio
from a2g_jax.talker.recordings import talk


@pytest.fixture(scope="module")
def speech(tmp_path_factory):
    """Two seconds of talk, and a transcript with words before and after its end."""
    folder = tmp_path_factory.mktemp("speech")
    write_audio(folder / "speech.wav", talk(2.0, 3).audio, 16000)
    (folder / "words.tsv").write_text("0.2\t0.50000000000000000\thello\n0.7\t1.2\tthere\n2.5\t2.9\tlater\n")
    (folder / "late.tsv").write_text("200\t500\thello\n700\t1200\tthere\n")
    return folder


def test_the_page_has_words_and_links_to_its_files(speech, tmp_path):
    flags = ["--audio", str(speech / "speech.wav"), "--transcript", str(speech / "words.tsv"), "--out", str(tmp_path)]
    assert main(["generate", "demo", *flags, "--samples", "2", "--formats", "bvh,html"]) == 0
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    data = json.loads(found.group(1))
    assert data["words"] == [["hello", 0.2, 0.5], ["there", 0.7, 1.2]]
    assert [figure["files"] for figure in data["figures"]] == [["sample_00.bvh"], ["sample_01.bvh"]]
    assert all((tmp_path / name).exists() for figure in data["figures"] for name in figure["files"])


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (["generate", "demo", "--audio", "speech.wav", "--transcript", "late.tsv"], "late.tsv: all words start after"),
        (["generate", "demo", "--audio", "speech.wav", "--transcript", "no.tsv"], "no.tsv: there is no such file"),
        (["demo", "--audio", "speech.wav", "--transcript", "speech.wav"], "speech.wav"),
        (["demo", "--audio", "speech.wav", "--tier", "words"], "--tier: belongs to a transcript"),
        (
            ["generate", "demo", "--audio", "speech.wav", "--transcript", "words.tsv", "--formats", "bvh"],
            "--transcript: its words are shown on the page; add html to --formats",
        ),
        (["demo", "--transcript", "words.tsv"], "name it with --audio"),
    ],
)
def test_transcripts_that_cannot_be_used_are_refused(speech, tmp_path, capsys, monkeypatch, flags, message):
    monkeypatch.chdir(speech)
    assert main([*flags, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
