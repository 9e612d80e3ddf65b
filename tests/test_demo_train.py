"""``a2g demo --train``, made small: generates its corpus, trains on it, and shows what came out."""

import dataclasses

from a2g_jax.cli import demo, main
from a2g_jax.models import find_model
from a2g_jax.talker import recordings
from tests.toy_model_for_tests import TOY_MODEL


def test_demo_trains(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(demo, "DEMO_MINUTES", 0.3)
    monkeypatch.setattr(recordings, "RECORDING_SECONDS", 6.0)
    entry = find_model("audio2gestures")
    # The preset's own structure: codes of training clips at a low rate, and two stages of training.
    changes = {"specific_frames": 4, "specific_jitter": 2, "smoothing": 2, "stored_codes": True, "adversarial_steps": 2}
    # One block of each network: compiling is most of the time.
    changes |= dict.fromkeys(("audio_channels", "motion_channels", "decoder_channels", "discriminator_channels"), (8,))
    toy = dataclasses.replace(entry.presets["tiny"], **{**TOY_MODEL, **changes})
    monkeypatch.setitem(entry.presets, "tiny", toy)
    small = dataclasses.replace(entry.training["tiny"], steps=4, batch_size=2, checkpoint_every=3)
    monkeypatch.setitem(entry.training, "tiny", small)
    out = tmp_path / "demo"
    command = ["demo", "--train", "--out", str(out), "--samples", "1", "--formats", "npz"]
    assert main(command) == 0
    assert {"corpus", "run", "sample_00.npz"} <= {path.name for path in out.iterdir()}
    first = (out / "sample_00.npz").read_bytes()
    # Again, it finds its corpus and its run.
    assert main(command) == 0
    assert (out / "sample_00.npz").read_bytes() == first
