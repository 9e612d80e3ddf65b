"""What each subcommand of ``a2g`` does; the command line itself is in :mod:`a2g_jax.cli`."""

import argparse
import dataclasses
import textwrap
from pathlib import Path
from typing import Any

from a2g_jax.compilations import keep_compilations
from a2g_jax.config import parse_text
from a2g_jax.data.corpus import Corpus
from a2g_jax.data.datasets import NAMES, find_data_set
from a2g_jax.data.generated import TalkerOptions
from a2g_jax.data.on_demand import OnDemand
from a2g_jax.data.prepare import prepare_data_set, prepare_talker, view_poses
from a2g_jax.data.settings import PRESETS, Features, find_features
from a2g_jax.errors import InputError
from a2g_jax.evaluation import command as evaluate_command
from a2g_jax.features.mel import MelConfig
from a2g_jax.generation import retarget_command
from a2g_jax.generation.audio2gestures.pin_report import describe
from a2g_jax.generation.audio2gestures.pinned import Pins
from a2g_jax.generation.export import check_formats, deliver
from a2g_jax.generation.stylized_flow.styled import Styling, styling_of
from a2g_jax.generation.talk.files import check_talk_formats, deliver_talk
from a2g_jax.generation.talk.request import TalkRequest, corpus_request
from a2g_jax.inspection import command as inspect_command
from a2g_jax.io.audio import read_audio
from a2g_jax.io.files import read_json
from a2g_jax.models import find_model
from a2g_jax.models.train_config import TRAIN_PRESETS, TrainConfig, training_preset
from a2g_jax.progress import progress_bar
from a2g_jax.talker.recordings import talk
from a2g_jax.talker.views.catalogue import find_view
from a2g_jax.training.loop import train
from a2g_jax.training.perceptual import load_perceptual
from a2g_jax.training.run import Run, RunConfig, demo_run, open_run

#: The demo's own speech: who says it, for how long, and from which seed (one that no training corpus uses).
DEMO_SPEECH: dict[str, Any] = {"seconds": 20.0, "seed": 20211011, "speaker": "chiara", "emotion": "neutral"}
#: What ``a2g demo --train`` trains on, minutes.
DEMO_MINUTES = 20.0


def run_prepare(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g prepare``."""
    if options.list:
        _list_data_sets()
        return
    if options.reader is None:
        raise InputError("name what to prepare: 'a2g prepare talker', or a data set ('a2g prepare --list').")
    if options.out is None:
        raise InputError("--out is needed: the folder to make.")
    corpus = _prepare_generated(options) if options.reader == "talker" else _prepare_recorded(options)
    seconds = {name: sum(part.frames for part in parts) / corpus.fps for name, parts in corpus.splits.items()}
    kinds = {"directions": "bone directions", "keypoints": "keypoints"}
    print(
        f"{corpus.path}: {len(corpus.recordings)} recordings, {corpus.frames / corpus.fps / 60:.1f} minutes,"
        f" {corpus.rows} {kinds.get(corpus.representation, 'joints')} at {corpus.fps:g} fps ("
        + ", ".join(f"{name} {value:.0f} s" for name, value in seconds.items())
        + ")"
    )
    if corpus.on_demand:
        roles = [role for part in corpus.later["parts"] for role in part]
        minutes = sum(role["seconds"] for role in roles) / 60
        print(
            f"{len(roles)} more training recordings, {minutes:.1f} minutes in {corpus.parts - 1} parts, are generated"
            " in training (a2g train --part-steps: steps on each part)"
        )


#: Flags of ``a2g prepare`` that only generated corpora have, and those that only recorded ones have.
_GENERATED = ("minutes", "speakers", "emotions", "jitter", "fingers", "view", "on_demand")
_RECORDED = ("source", "joints", "random_split", "skip_broken", "limit")


def _refuse_flags(options: argparse.Namespace, names: tuple[str, ...], reason: str) -> None:
    for name in names:
        if getattr(options, name) not in (None, False):
            raise InputError(f"--{name.replace('_', '-')} is for {reason}")


def _prepare_generated(options: argparse.Namespace) -> Corpus:
    if options.source is not None:
        raise InputError("'a2g prepare talker' takes no source; it generates its recordings.")
    _refuse_flags(options, _RECORDED, "recordings; a generated corpus has what --view and --fingers show.")
    view = options.view or "body"
    if options.pose and options.pose not in view_poses(view):
        raise InputError(f"--pose {options.pose}: the view {view!r} shows {' or '.join(view_poses(view))}.")
    return prepare_talker(
        options.out,
        talker_options(options),
        _features(options),
        workers=options.workers,
        on_demand=OnDemand() if options.on_demand else None,
    )


def _prepare_recorded(options: argparse.Namespace) -> Corpus:
    if options.source is None:
        raise InputError(f"name the folder: a2g prepare {options.reader} SOURCE --out CORPUS.")
    _refuse_flags(options, _GENERATED, "'a2g prepare talker'; recordings are prepared as they are.")
    reader = find_data_set(options.reader)
    features = _features(options)
    if options.features is None:
        features = dataclasses.replace(features, fps=options.fps or reader.fps, pose=options.pose or reader.pose)
    return prepare_data_set(
        options.reader,
        options.source,
        options.out,
        features,
        seed=options.seed,
        official=not options.random_split,
        skip_broken=options.skip_broken,
        limit=options.limit,
        workers=options.workers,
    )


def _features(options: argparse.Namespace) -> Features:
    """The settings of a paper with what the flags change."""
    features = find_features(options.features or "audio2gestures")
    asked = {name: getattr(options, name) for name in ("fps", "pose", "joints", "waveform")}
    return dataclasses.replace(features, **{name: value for name, value in asked.items() if value})


def _list_data_sets() -> None:
    for name in NAMES:
        reader = find_data_set(name)
        print(f"{name}: {reader.title}, {reader.fps:g} fps")
        if reader.about:
            print(textwrap.indent(textwrap.fill(reader.about, 96), "    "))
    print("talker: generated recordings, whose truth is known (see 'a2g talk')")
    print("\nfeatures of the papers (--features):")
    for name, features in PRESETS.items():
        mel = f"{features.mel.bands} mel bands" + (f" x {features.mel.stack}" if features.mel.stack > 1 else "")
        wave = ", waveform" if features.waveform else ""
        print(f"{name}: {features.fps:g} fps, {mel}, {features.pose}, joints: {features.joints}{wave}")


def talker_options(options: argparse.Namespace) -> TalkerOptions:
    """What the flags of ``a2g prepare talker`` ask for."""
    view = options.view or "body"
    fps = options.fps or (find_features(options.features).fps if options.features else find_view(view).fps)
    return TalkerOptions(
        minutes=options.minutes or 30.0,
        seed=options.seed,
        fps=fps,
        speakers=_names("speakers", options.speakers),
        emotions=_names("emotions", options.emotions),
        jitter=options.jitter or 0.0,
        fingers=options.fingers,
        view=view,
    )


def _names(flag: str, text: str | None) -> tuple[str, ...]:
    names = tuple(name.strip() for name in (text or "").split(",") if name.strip())
    if text is not None and not names:
        raise InputError(f"--{flag}: names nobody and nothing; leave it out for all.")
    return names


def parse_settings(pairs: list[str], model: Any, training: TrainConfig) -> tuple[Any, TrainConfig]:
    """Settings objects with command-line flags such as ``--learning-rate 3e-4`` put in."""
    fields = {field.name: owner for owner in (model, training) for field in dataclasses.fields(owner)}
    changes: dict[str, dict[str, Any]] = {"model": {}, "training": {}}
    rest = list(pairs)
    while rest:
        flag = rest.pop(0)
        if not flag.startswith("--"):
            raise InputError(f"unexpected argument {flag!r}; settings are written --name value.")
        name, equals, text = flag[2:].partition("=")
        name = name.replace("-", "_")
        if name not in fields:
            raise InputError(f"no setting --{name.replace('_', '-')}; 'a2g train MODEL --settings' lists them.")
        owner = fields[name]
        if not equals:
            if rest and not rest[0].startswith("--"):
                text = rest.pop(0)
            elif isinstance(getattr(owner, name), bool):
                text = "true"
            else:
                raise InputError(f"{flag}: needs a value.")
        changes["model" if owner is model else "training"][name] = parse_text(type(owner), name, text)
    return dataclasses.replace(model, **changes["model"]), dataclasses.replace(training, **changes["training"])


def run_train(options: argparse.Namespace, extra: list[str]) -> None:
    """``a2g train``."""
    entry = find_model(options.model)
    if options.preset not in entry.presets:
        raise InputError(f"{options.model} has no preset {options.preset!r}; there are: {', '.join(entry.presets)}.")
    published = training_preset(options.model, options.preset)
    model, training = parse_settings(extra, entry.presets[options.preset], published)
    if options.settings:
        for owner in (model, training):
            print(f"# {type(owner).__name__}")
            for field in dataclasses.fields(owner):
                value = getattr(owner, field.name)
                text = ",".join(map(str, value)) if isinstance(value, tuple) else value
                print(f"--{field.name.replace('_', '-')} {text}")
        return
    for name in ("corpus", "out"):
        if getattr(options, name) is None:
            raise InputError(f"--{name} is needed (see 'a2g train --help').")
    run = run_training(
        options.model, options.preset, model, training, options.corpus, options.out, options.resume, options.features
    )
    following = f"a2g generate {options.out} --audio speech.wav --out DIR"
    if run.config.build().sample is None:
        following = f"a2g inspect {options.out}"
    print(f"{options.out}: trained for {run.steps} steps; next: {following}")


def run_training(
    name: str,
    preset: str,
    model: Any,
    training: TrainConfig,
    corpus: str | Path,
    out: str | Path,
    resume: bool,
    features: str | Path | None = None,
) -> Run:
    """Open the corpus and the feature network, and train."""
    keep_compilations()
    opened = Corpus.open(corpus)
    perceptual = None if features is None else load_perceptual(features, opened)
    return train(RunConfig.of(name, preset, model, training, opened, perceptual), opened, out, resume=resume)


def run_evaluate(options: argparse.Namespace, extra: list[str]) -> None:
    """``a2g evaluate``."""
    keep_compilations()
    evaluate_command.run(options, extra)


def run_inspect(options: argparse.Namespace, extra: list[str]) -> int:
    """``a2g inspect``; the exit status."""
    return inspect_command.run(options, extra)


def run_retarget(options: argparse.Namespace, extra: list[str]) -> None:
    """``a2g retarget``."""
    retarget_command.run(options, extra)


def run_talk(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g talk``."""
    check_talk_formats(options.formats)
    made = ("seconds", "speaker", "emotion", "fps", "room", "fingers")
    asked = {name: getattr(options, name) for name in made if getattr(options, name) not in (None, False)}
    request = TalkRequest(seed=options.seed, sample_rate=options.sample_rate, view=options.view, **asked)
    if options.corpus is None:
        if options.recording is not None:
            raise InputError("--recording is of a corpus; name it with --corpus.")
        recording = request.recording()
    else:
        for name in asked:
            raise InputError(f"--{name} cannot be chosen for a recording of a corpus; leave it or --corpus out.")
        recording, request = corpus_request(options.corpus, options.recording, request)
    with progress_bar(options.samples, "gesturing", "motion") as bar:
        written = deliver_talk(
            recording,
            options.out,
            request=request,
            samples=options.samples,
            formats=options.formats,
            report=lambda done: bar.update(done - bar.n),
        )
    print(f"{options.out}: {', '.join(f'{count} {kind}' for kind, count in written.items())}")
    if "html" in written:
        print(f"open {Path(options.out) / 'index.html'} in a browser")


def run_generate(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g generate``."""
    check_formats(options.formats)
    styling = styling_of(options)
    keep_compilations()
    run = _controlled(_edited(open_run(options.run), options), options)
    audio = read_audio(options.audio, run.config.mel.sample_rate)
    pins = _pins(options)
    _generate(run, audio, options, Path(options.audio).name, pins=pins, styling=styling)
    for note in () if styling is None else styling.notes:
        print(note)
    if pins is not None:
        for sample, rows in enumerate(read_json(Path(options.out) / "pins.json")):
            for row in rows:
                print(f"sample {sample}, {describe(row)}")


def _edited(run: Run, options: argparse.Namespace) -> Run:
    """The run with the edits of latent bands that the flags ask for."""
    kept = (("shared", options.keep_shared), ("specific", options.keep_specific))
    edits = [f"{name} keep {count}" for name, count in kept if count is not None] + (options.edit or [])
    if not edits:
        return run
    if not hasattr(run.config.model_config, "edits"):
        raise InputError(f"{options.run}: is a run of {run.config.model}, whose codes have no DCT bands to edit.")
    settings = dataclasses.replace(run.config.model_config, edits=tuple(edits))
    return dataclasses.replace(run, config=dataclasses.replace(run.config, model_config=settings))


def _controlled(run: Run, options: argparse.Namespace) -> Run:
    """The run with the style controls that the flags ask for."""
    if not options.control:
        return run
    settings = run.config.model_config
    if not getattr(settings, "style_controls", ()):
        raise InputError(
            f"--control {options.control[0]!r}: {options.run} was trained without style controls; train one with"
            " 'a2g train stylized_flow --style-controls height,speed,radius'."
        )
    settings = dataclasses.replace(settings, control_curves=tuple(options.control))
    return dataclasses.replace(run, config=dataclasses.replace(run.config, model_config=settings))


def run_demo(options: argparse.Namespace, _extra: list[str]) -> None:
    """``a2g demo``."""
    check_formats(options.formats)
    keep_compilations()
    out = Path(options.out)
    # Bad audio should be refused before minutes of training.
    words: Any = ()
    if options.audio is not None:
        audio, title = read_audio(options.audio, MelConfig().sample_rate), Path(options.audio).name
    else:
        speech = talk(**DEMO_SPEECH)
        audio, title, words = speech.audio, "a generated speech", speech.words
    if options.train:
        if not (out / "corpus").exists():
            prepare_talker(out / "corpus", TalkerOptions(minutes=DEMO_MINUTES))
        model = find_model("audio2gestures").presets["tiny"]
        training = TRAIN_PRESETS["tiny"]
        run = run_training("audio2gestures", "tiny", model, training, out / "corpus", out / "run", resume=True)
    else:
        run = demo_run()
    _generate(run, audio, options, title, words)


def _pins(options: argparse.Namespace) -> Pins | None:
    """The clips that the flags pin."""
    if not options.pin:
        for name in ("pin_blend", "pin_shared", "pin_corpus"):
            if getattr(options, name) is not None:
                raise InputError(f"--{name.replace('_', '-')} is for --pin; name a clip and a second.")
        return None
    blend = 0.75 if options.pin_blend is None else options.pin_blend
    shared = 0.0 if options.pin_shared is None else options.pin_shared
    corpus = None if options.pin_corpus is None else Corpus.open(options.pin_corpus)
    return Pins(tuple(options.pin), blend, shared, corpus)


def _generate(
    run: Run,
    audio: Any,
    options: argparse.Namespace,
    title: str,
    words: Any = (),
    pins: Pins | None = None,
    styling: Styling | None = None,
) -> None:
    with progress_bar(options.samples, "generating", "motion") as bar:
        written = deliver(
            run,
            audio,
            options.out,
            samples=options.samples,
            seed=options.seed,
            formats=options.formats,
            title=title,
            words=words,
            pins=pins,
            styling=styling,
            report=lambda done: bar.update(done - bar.n),
        )
    kinds = ", ".join(f"{count} {kind}" for kind, count in written.items())
    print(f"{options.out}: {kinds}")
    if "html" in written:
        print(f"open {Path(options.out) / 'index.html'} in a browser")
