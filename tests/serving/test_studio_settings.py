"""Requests of the page as arguments of a2g generate, and its errors beside the fields."""

import numpy as np
import pytest

from a2g_jax.cli.studio import _parser, first_run, generate_take, named_runs
from a2g_jax.errors import InputError
from a2g_jax.generation.capabilities import capabilities
from a2g_jax.io.audio import write_audio
from a2g_jax.io.files import write_json
from a2g_jax.serving.studio.jobs import Job
from a2g_jax.serving.studio.readers import KINDS
from a2g_jax.serving.studio.settings import FieldError, field_of, read_request
from a2g_jax.serving.studio.uploads import Upload, Uploads
from a2g_jax.training.run import open_run
from a2g_jax.training.run_file import SHIPPED, SHIPPED_TITLES

#: Settings of all systems of these tests.
SETTINGS = ("temperature", "denoise", "edit")
SYSTEMS = {"demo": "demo", "mine": "/runs/mine"}


@pytest.fixture
def uploads(tmp_path):
    kept = Uploads(tmp_path, KINDS)
    for id, kind, name, suffix in (
        ("talk", "speech", "My talk.wav", ".wav"),
        ("wave", "clip", "wave.bvh", ".bvh"),
        ("robot", "character", "robot.vrm", ".vrm"),
    ):
        kept.add(Upload(id, kind, name, tmp_path / f"upload-{id}{suffix}"))
    return kept


def request(uploads, **changes):
    return read_request(
        {"speech": "talk", "system": "demo", "samples": 2, "seed": 5, **changes},
        SYSTEMS,
        uploads,
        lambda system: SETTINGS,
    )


def test_every_field_becomes_an_argument_of_the_command(uploads, tmp_path):
    made = request(
        uploads,
        system="mine",
        emotion="neutral@0,anger@3",
        controls={"energy": 0.9, "height": [[0, 0.2], [1.5, 0.75]], "emotion": "fear"},
        pins=[{"clip": "wave", "start": 1.25}, {"clip": "wave", "start": 4, "length": 0.5}],
        style="wave",
        style_share=0.8,
        style_with="wave",
        style_mix=0.25,
        **{"continue": "wave"},
        character="robot",
        settings={"temperature": "0.8", "denoise": True, "edit": ["a keep 3", "--out=/etc"]},
    )
    clip = tmp_path / "upload-wave.bvh"
    assert made.arguments == (
        "/runs/mine",
        f"--audio={tmp_path / 'upload-talk.wav'}",
        "--samples=2",
        "--seed=5",
        "--emotion=neutral@0,anger@3",
        "--control=energy=0.9",
        "--control=height=0.2@0.000,0.75@1.500",
        "--control=emotion=fear",
        f"--pin={clip}@1.250",
        f"--pin={clip}@4.000+0.500",
        f"--style={clip}",
        "--style-share=0.8",
        f"--style-with={clip}",
        "--style-mix=0.25",
        f"--seed-clip={clip}",
        f"--to={tmp_path / 'upload-robot.vrm'}",
        "--temperature=0.8",
        "--denoise=true",
        "--edit=a keep 3",
        "--edit=--out=/etc",
        "--formats=glb,npz",
    )
    options, extra = _parser().parse_known_args(list(made.arguments))
    assert (options.samples, options.seed, options.out, options.formats) == (2, 5, None, ("glb", "npz"))
    assert options.pin == [f"{clip}@1.250", f"{clip}@4.000+0.500"]
    assert extra == [
        "--emotion=neutral@0,anger@3",
        "--temperature=0.8",
        "--denoise=true",
        "--edit=a keep 3",
        "--edit=--out=/etc",
    ]
    assert str(tmp_path) not in made.command
    assert "'--audio=My talk.wav'" in made.command


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"system": "other"}, "system"),
        ({"system": ["demo"]}, "system"),
        ({"speech": "wave"}, "speech"),
        ({"speech": None}, "speech"),
        ({"speech": "../etc/passwd"}, "speech"),
        ({"samples": 0}, "samples"),
        ({"samples": 13}, "samples"),
        ({"samples": True}, "samples"),
        ({"samples": 2.5}, "samples"),
        ({"seed": -1}, "seed"),
        ({"emotion": "a\nb"}, "emotion"),
        ({"emotion": {"a": 1}}, "emotion"),
        ({"controls": [1]}, "controls"),
        ({"controls": {"--out": 1}}, "controls"),
        ({"controls": {"energy": None}}, "controls.energy"),
        ({"controls": {"energy": float("nan")}}, "controls.energy"),
        ({"controls": {"energy": []}}, "controls.energy"),
        ({"controls": {"energy": [[1]]}}, "controls.energy"),
        ({"controls": {"energy": [[0, 1]] * 201}}, "controls.energy"),
        ({"controls": {"emotion": "a,b@3"}}, "controls.emotion"),
        ({"pins": {}}, "pins"),
        ({"pins": [{"start": 1}]}, "pins"),
        ({"pins": [{"clip": "wave", "start": -1}]}, "pins"),
        ({"pins": [{"clip": "wave", "start": "1@2"}]}, "pins"),
        ({"pins": [{"clip": "wave", "start": 1, "length": 0}]}, "pins"),
        ({"pins": [{"clip": "wave", "start": 1, "path": "/etc"}]}, "pins"),
        ({"style": "talk"}, "style"),
        ({"style": "wave", "style_with": "talk"}, "style_with"),
        ({"style": "wave", "style_with": "wave", "style_mix": "much"}, "style_with"),
        ({"character": "wave"}, "character"),
        ({"settings": {"--out": "x"}}, "settings"),
        ({"settings": {"audio": "/etc/passwd"}}, "settings.audio"),
        ({"settings": {"to": "x"}}, "settings.to"),
        ({"settings": {"out": "x"}}, "settings.out"),
        ({"settings": {"pin-corpus": "/x"}}, "settings.pin-corpus"),
        ({"settings": {"style-with": "/etc/passwd"}}, "settings.style-with"),
        ({"settings": {"transcript": "/etc/passwd"}}, "settings.transcript"),
        ({"settings": {"temperature": ["x" * 3000]}}, "settings.temperature"),
        ({"out": "/etc"}, ""),
    ],
)
def test_a_field_of_another_form_is_refused(uploads, changes, field):
    with pytest.raises(FieldError) as caught:
        request(uploads, **changes)
    assert caught.value.field == field


@pytest.mark.parametrize("values", [None, [], "x", 3])
def test_what_is_no_request_is_refused(uploads, values):
    with pytest.raises(FieldError, match="JSON object"):
        read_request(values, SYSTEMS, uploads, lambda system: SETTINGS)


@pytest.mark.parametrize(
    ("message", "field", "shown"),
    [
        (
            "--control 'energy=0.9@9': second 9 is past the end of the speech, which lasts 2.00 s.",
            "controls.energy",
            "Second 9 is past the end of the speech, which lasts 2.00 s.",
        ),
        ("argument --samples: expected a whole number", "samples", "Expected a whole number"),
        ("--emotion 'x': the run has no emotion 'x'.", "emotion", "The run has no emotion 'x'."),
        ("--temperature: expected 0 or more; got -1.0.", "settings.temperature", "Expected 0 or more; got -1.0."),
        ("no setting --warmth; 'a2g generate demo --settings' lists them.", "", None),
        (
            "sample 0: a body cannot do it; use another --seed or speech.",
            "",
            "Sample 0: a body cannot do it; use another",
        ),
    ],
)
def test_an_error_is_shown_beside_its_field(uploads, message, field, shown):
    found = field_of(message, request(uploads))
    assert found["field"] == field
    assert shown is None or found["message"].startswith(shown)


def test_an_error_names_files_as_the_client_does(uploads, tmp_path):
    made = request(uploads, pins=[{"clip": "wave", "start": 1}])
    found = field_of(f"--pin {tmp_path}/upload-wave.bvh@1.000: ends at 9 s; pin upload-wave.bvh@0 earlier.", made)
    assert found == {"field": "pins", "message": "Ends at 9 s; pin wave.bvh@0 earlier."}
    found = field_of(f"{tmp_path}/upload-talk.wav: is silent.", made)
    assert found == {"field": "speech", "message": "My talk.wav: is silent."}


def test_runs_of_one_name_are_refused(tmp_path):
    for folder in ("a/run", "b/run", "demo"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "run.json").write_text("{}")
    assert [first_run(runs) for runs in ([], ["demo-flow"], [str(tmp_path / "a/run"), "demo"])] == [
        "demo",
        "demo-flow",
        "run",
    ]
    assert list(named_runs([str(tmp_path / "a/run"), "demo"])) == ["demo", "demo-flow", "demo-emotion", "run"]
    for folders in ([tmp_path / "a/run", tmp_path / "b/run"], [tmp_path / "demo"]):
        with pytest.raises(InputError, match="rename the folder"):
            named_runs([str(folder) for folder in folders])
    with pytest.raises(InputError, match="there is no such run"):
        named_runs([str(tmp_path / "none")])


def test_a_take_names_speech_unlike_the_training_speech(tmp_path, monkeypatch):
    write_audio(tmp_path / "tone.wav", (0.3 * np.sin(2 * np.pi * 440 * np.arange(160_000) / 16_000)), 16_000)
    write_json(tmp_path / "checks.json", {})
    monkeypatch.setattr("a2g_jax.generation.export.export", lambda *_, **__: None)  # nothing is generated
    take = generate_take(
        ["demo", f"--audio={tmp_path / 'tone.wav'}", "--formats=npz"], tmp_path, Job("take 1", lambda job: None)
    )
    assert f"{tmp_path / 'tone.wav'}: differs from the speech that demo was trained on: pitch 4" in take.warning


def test_every_shipped_run_has_a_title():
    assert set(SHIPPED_TITLES) == set(SHIPPED)


def test_the_demo_says_what_it_can_do():
    can = capabilities(open_run("demo"))
    assert can.controls == ("energy", "height", "radius", "rate", "handedness")
    assert "anger" in can.categories["emotion"]
    assert (can.emotions, can.styles, can.seed_clips, can.pins) == ((), False, False, True)
    settings = {one.name: one for one in can.settings}
    assert (settings["noise-scale"].kind, settings["sample-codes"].kind, settings["edit"].repeat) == (
        "float",
        "bool",
        True,
    )
    assert not {"control", "emotion"} & set(settings)


@pytest.mark.slow
def test_the_other_shipped_runs_say_what_they_can_do():
    flow, emotion = (capabilities(open_run(name)) for name in ("demo-flow", "demo-emotion"))
    assert (flow.styles, flow.seed_clips, emotion.styles, emotion.seed_clips) == (True, True, False, True)
    assert "anger" in emotion.emotions
    assert "emotion" not in emotion.categories  # one field for both flags
    assert {"temperature", "denoise", "style-gain"} <= {one.name for one in flow.settings}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["demo", "--audio=/none.wav", "--samples=1"], "/none.wav: there is no such file"),
        (["demo", "--audio=/none.wav", "--samples=0"], "argument --samples: expected a whole number"),
        (["demo", "--audio=/none.wav", "--warmth=3"], "no setting --warmth"),
        (["demo", "--audio=/none.wav", "--control=energy=2"], "expected quantiles"),
        (["demo", f"--audio={__file__}", "--pin=x"], "--pin x: expected a file and a second"),
        (["demo", f"--audio={__file__}", "--pin-blend=1"], "--pin-blend is for --pin"),
    ],
)
def test_the_commands_own_checks_refuse_a_request(arguments, message, tmp_path):
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        generate_take(arguments, tmp_path, Job("take 1", lambda job: None))
