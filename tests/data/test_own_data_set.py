"""The documentation's example of a reader of one's own works as it is printed."""

import re
from pathlib import Path

import numpy as np

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.io.audio import write_audio
from a2g_jax.io.bvh import write_bvh
from a2g_jax.io.textgrid import write_words
from a2g_jax.talker.recordings import talk

PAGE = Path(__file__).parents[2] / "docs" / "your_data_set.md"


def test_the_example_prepares_a_corpus(tmp_path, capsys):
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S)
    assert len([line for line in code.splitlines() if line.strip()]) <= 40
    reader = tmp_path / "my_reader.py"
    reader.write_text(code)
    source = tmp_path / "recordings"
    for number, speaker in enumerate(("anna", "ben", "ben", "cleo")):
        take = talk(3.0, number)
        folder = source / speaker / f"{number:03d}"
        write_audio(folder / "speech.wav", take.audio, 16000)
        write_bvh(folder / "body.bvh", take.motion)
        write_words(folder / "words.TextGrid", take.words, 3.0)
    out = tmp_path / "corpus"
    assert main(["prepare", str(reader), str(source), "--out", str(out), "--workers", "2"]) == 0, (
        capsys.readouterr().err
    )
    corpus = Corpus.open(out)
    assert [entry.name for entry in corpus.recordings] == ["anna/000", "ben/001", "ben/002", "cleo/003"]
    assert {segment.recording for segment in corpus.splits["test"]} == {0}
    assert corpus.recordings[3].speaker == "cleo"
    expected = talk(3.0, 1)
    assert [word["text"] for word in corpus.annotations(1)["words"]] == [word.text for word in expected.words]
    np.testing.assert_allclose(corpus.motion(90, 180).positions(), expected.motion.positions(), atol=0.02)


def test_readers_that_are_none(tmp_path, capsys):
    broken, empty = tmp_path / "broken.py", tmp_path / "empty.py"
    broken.write_text("import no_such_module_anywhere\n")
    empty.write_text("x = 1\n")
    for name, message in ((broken, "does not run (ModuleNotFoundError"), (empty, "defines no DATASET")):
        assert main(["prepare", str(name), str(tmp_path), "--out", str(tmp_path / "c")]) == 2
        assert message in capsys.readouterr().err
    assert main(["prepare", str(tmp_path / "none.py"), str(tmp_path), "--out", str(tmp_path / "c")]) == 2
    assert "there is no such file" in capsys.readouterr().err
