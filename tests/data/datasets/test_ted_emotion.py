"""TED Emotion: clips of TED-Expressive with a table of emotions, from made-up files."""

import numpy as np
import pytest
from datasets_ted_tree import write_ted
from test_ted_expressive import clip, unit_vectors

from a2g_jax.cli import main
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.datasets.ted_emotion import DATASET, EMOTIONS
from a2g_jax.data.emotion_table import COLUMNS, WindowLabel, table_lines


def write_table(path, labels):
    path.write_text(",".join(COLUMNS) + "\n" + table_lines(labels), encoding="utf-8")


def test_clips_with_a_table(tmp_path, capsys):
    """Seven clips of eight seconds; pieces keep words, poses and sound of their place."""
    ted = tmp_path / "ted"
    ted.mkdir()
    names = [f"o1rERZRFyqE_{n}_4_0" for n in range(7)]
    for n, name in enumerate(names):
        np.savez(ted / f"{name}.npz", **clip(120, dir_vec=unit_vectors(120, seed=n).reshape(120, 126)))
    labels = [WindowLabel(name, 2.0 * n, 2.0 * n + 4.0, "fear", 0.95) for name in names[:5] for n in range(3)]
    labels += [WindowLabel(names[5], 2.0, 6.0, "surprise", 0.92), WindowLabel(names[5], 4.0, 8.0, "contempt", 0.99)]
    labels += [WindowLabel(names[6], 0.0, 4.0, "anger", 0.89)]
    command = ["prepare", "ted-emotion", str(ted), "--features", "emotion-gesture-ted", "--workers", "1", "--waveform"]
    assert main([*command, "--out", str(tmp_path / "none")]) == 2
    assert "emotions.csv: there is no such table of emotions; make it with 'a2g label'" in capsys.readouterr().err
    write_table(ted / "emotions.csv", labels)
    assert main([*command, "--out", str(tmp_path / "corpus")]) == 0
    error = capsys.readouterr().err
    assert "16 of 18 windows have an emotion, in 6 pieces; left out: 1 below the confidence, 1 of other" in error
    corpus = Corpus.open(tmp_path / "corpus")
    assert (corpus.fps, corpus.pose.shape[1:], corpus.emotions) == (15.0, (42, 3), ("fear", "surprise"))
    assert set(corpus.emotions) <= set(EMOTIONS)
    assert [entry.name for entry in corpus.recordings] == [f"{name}@0" for name in names[:5]] + [f"{names[5]}@2"]
    assert [entry.frames for entry in corpus.recordings] == [120] * 5 + [60]
    last = corpus.recordings[5]
    with np.load(ted / f"{names[5]}.npz") as arrays:
        expected = arrays["dir_vec"].reshape(120, 42, 3)[30:90]
        sound = arrays["audio"][2 * 16000 : 6 * 16000]
    np.testing.assert_allclose(corpus.pose[last.first :], expected, atol=1e-6)
    np.testing.assert_allclose(corpus.waveform[last.first_sample :], sound, atol=2)
    assert corpus.annotations(5)["piece"] == {"from": 2.0, "confidence": 0.92}
    made = corpus.recipe["labels"]
    assert (made["confidence"], made["kept"], made["doubtful"], made["other"]) == (0.9, 16, 1, {"contempt": 1})
    # The rule can be changed, and any data set can have a table.
    table = ["--labels", str(ted / "emotions.csv")]
    assert main([*command, "--confidence", "0.8", "--out", str(tmp_path / "more")]) == 0
    assert Corpus.open(tmp_path / "more").emotions == ("anger", "fear", "surprise")
    command[1] = "ted-expressive"
    assert main([*command, *table, "--out", str(tmp_path / "all")]) == 0
    assert Corpus.open(tmp_path / "all").emotions == ("fear", "surprise")
    assert main([*command, "--confidence", "0.8", "--out", str(tmp_path / "no")]) == 2
    assert "--confidence is for tables of emotions; add --labels TABLE" in capsys.readouterr().err


def test_pieces_of_databases_keep_their_part(tmp_path):
    """LMDB databases have the authors' split; words of a piece are relative to its start."""
    write_ted(tmp_path / "ted", 43, clips=2)
    takes = DATASET.find(tmp_path / "ted")
    labels = [WindowLabel(take.name, 0.5, 2.0, EMOTIONS[n % 6], 1.0) for n, take in enumerate(takes)]
    write_table(tmp_path / "ted" / "emotions.csv", labels)
    out = tmp_path / "corpus"
    assert main(["prepare", "ted-emotion", str(tmp_path / "ted"), "--out", str(out), "--workers", "1"]) == 0
    corpus = Corpus.open(out)
    assert [entry.split for entry in corpus.recordings] == [take.split for take in takes]
    held = {corpus.recordings[s.recording].name for s in corpus.splits["test"]}
    assert held == {f"{take.name}@0.5" for take in takes if take.split == "test"}
    words = corpus.annotations(0)["words"]
    assert words[0]["text"] == "here"
    assert (words[0]["start"], words[0]["end"]) == pytest.approx((0.0, 0.25), abs=1e-6)


def test_no_recording_is_in_two_splits(tmp_path):
    """Pieces of a recording stay together where the split is drawn."""
    ted = tmp_path / "ted"
    ted.mkdir()
    labels = []
    for n in range(8):
        np.savez(ted / f"take{n}.npz", **clip(180))
        labels += [WindowLabel(f"take{n}", 4.0 * k, 4.0 * k + 4.0, ("fear", "anger")[k % 2], 1.0) for k in range(3)]
    write_table(ted / "emotions.csv", labels)
    out = tmp_path / "corpus"
    assert main(["prepare", "ted-emotion", str(ted), "--out", str(out), "--workers", "1"]) == 0
    corpus = Corpus.open(out)
    assert len(corpus.recordings) == 24
    parts = [
        {corpus.recordings[s.recording].name.split("@")[0] for s in segments} for segments in corpus.splits.values()
    ]
    assert sum(len(part) for part in parts) == 8
    assert all(parts)
