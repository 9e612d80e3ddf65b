"""Export of a run: its generator as StableHLO, compiled from model code that is then no longer needed."""

import os
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from flax.traverse_util import flatten_dict, unflatten_dict
from jax import export as jax_export
from jax.interpreters import partial_eval
from safetensors.numpy import save

from a2g_jax.errors import InputError
from a2g_jax.generation.engine import LANES, WINDOW, Engine
from a2g_jax.generation.programs import manifest as files
from a2g_jax.generation.programs.manifest import Manifest, Port, Ports, check_flatbuffers
from a2g_jax.io.files import atomic_path, make_folder, sha256_file
from a2g_jax.models.base import Condition
from a2g_jax.training.run import Run

#: Devices that the programs run on.
PLATFORMS = ("cpu", "cuda", "rocm", "tpu")
#: Meanings of inputs, for the manifest.
_MEANINGS = {
    "seed": "seed of the random numbers",
    "numbers": "number of each sample",
    "start": "first frame, context included, in the whole motion",
    "audio": "log-mel features minus statistics/audio/mean over statistics/audio/std, context included",
    "waveform": "samples from -1 to 1 of these frames, context included",
    "emotion": "weight of each emotion",
    "speaker": "index of the speaker",
    "words": "id of the word at each frame, 0 for none",
    "seed_poses": "poses before the first frame",
    "controls": "requested quantiles from 0 to 1, NaN for free ones",
    "style": "style code of a clip",
}

_Tree = dict[str, Any]


def export_programs(
    run: Run,
    out: str | os.PathLike[str],
    conditions: Sequence[str] = (),
    *,
    window: int = WINDOW,
    platforms: Sequence[str] = PLATFORMS,
) -> Manifest:
    """Write the programs of a run, the weights that they need, and a manifest.

    Args:
        out: folder, made if it does not exist.
        conditions: fields of :class:`~a2g_jax.models.base.Condition` besides the audio that become inputs.
        window: frames of a call, a multiple of 128.
        platforms: that the programs can run on, as JAX names them.

    Raises:
        InputError: a run that does not generate a skeleton's motion from audio, or conditions that it does not take.
        OutputError: the folder cannot be written.
    """
    check_flatbuffers()
    _ = run.config.skeleton
    engine = Engine(run, window)
    cut = example_condition(engine, conditions)
    begin, step, weights, inputs = _functions(engine, cut)
    programs = {} if begin is None else {files.BEGIN: (begin, {name: inputs[name] for name in _of_begin(inputs)})}
    if begin is not None:
        inputs |= jax.eval_shape(begin, weights, programs[files.BEGIN][1])
    programs[files.WINDOW] = (step, inputs)

    folder = make_folder(out)
    (folder / files.MANIFEST).unlink(missing_ok=True)  # which belongs to other files from here on
    used = {name for function, given in programs.values() for name in _used(function, weights, given)}
    kept = {name: value for name, value in weights.items() if name in used}
    ports: dict[str, dict[str, Ports]] = {}
    for name, (function, given) in programs.items():
        small = jax.jit(_without(function, weights, kept))
        exported = jax_export.export(small, platforms=list(platforms))(_shapes(kept), _shapes(given))
        with atomic_path(folder / name) as temporary:
            temporary.write_bytes(exported.serialize())
        outputs = jax.eval_shape(function, weights, given)
        ports[name] = {"inputs": _described(given), "outputs": _described(outputs)}
    arrays = {name: np.require(value, requirements="C") for name, value in (kept | _finish(run)).items()}
    with atomic_path(folder / files.WEIGHTS) as temporary:
        temporary.write_bytes(save(arrays))  # save_file makes files that nobody else may read
    made = Manifest(
        model=run.config.model,
        run={"preset": run.config.preset, "steps": run.steps},
        fps=run.config.fps,
        mel=run.config.mel,
        space=run.config.space,
        window=window,
        halo=engine.halo,
        lanes=1 if begin is None else LANES,
        programs=ports,
        files={name: sha256_file(folder / name) for name in (*programs, files.WEIGHTS)},
    )
    made.write(folder)
    return made


def example_condition(engine: Engine, names: Sequence[str]) -> Condition:
    """A condition of one window with the audio, and with the named fields.

    Raises:
        InputError: a field that the model does not take.
    """
    model, data, frames = engine.model, engine.run.config.data(), engine.window
    takes = [name for name in model.condition_fields if name != "audio"]
    for name in names:
        if name not in takes:
            accepted = ", ".join(takes) or "audio alone"
            raise InputError(f"{name}: is no condition of {engine.run.config.model}, which takes {accepted}.")
    examples: dict[str, Any] = {}
    for name in names:
        if name == "emotion":
            examples[name] = np.full((frames, len(data.emotions)), 1 / max(1, len(data.emotions)), np.float32)
        elif name == "controls" and model.controls is not None:
            examples[name] = np.full((frames, len(model.controls.names)), np.nan, np.float32)
        elif name == "seed_poses":
            mean = np.asarray(engine.run.config.statistics["pose"].mean, np.float32)
            examples[name] = np.repeat(mean[None], model.seed_frames, axis=0)
        elif name == "speaker":
            examples[name] = np.int32(0)
        elif name == "words":
            examples[name] = np.zeros(frames, np.int32)
        elif name == "waveform":
            examples[name] = np.zeros(round(frames * data.sample_rate / data.fps), np.float32)
        else:
            raise InputError(f"{name}: cannot be an input of exported programs; export the run without it.")
    given = Condition(np.zeros((frames, data.audio_bands), np.float32), **examples)  # type: ignore[arg-type]
    requested = {} if model.requested is None else model.requested(frames)
    fixed = [name for name, value in requested.items() if value is not None and getattr(given, name) is None]
    if fixed or (engine.lines and given.controls is None):
        name = fixed[0] if fixed else "controls"
        raise InputError(f"{name}: the run's settings request values over time; export it with --conditions {name}.")
    ((_, cut),) = engine.cuts(given)
    return cut


def _functions(engine: Engine, cut: Condition) -> tuple[Any, Any, _Tree, _Tree]:
    """The two programs as functions of weights and inputs, both by name, the weights, and inputs of a window."""
    run, model = engine.run, engine.model
    weights = {"/".join(("params", *path)): np.asarray(value) for path, value in flatten_dict(run.params).items()}
    weights |= {f"summary/{name}": np.asarray(value) for name, value in run.summary.items()}
    inputs: _Tree = {name: np.asarray(value) for name, value in cut._asdict().items() if value is not None}
    lanes = 1 if model.begin is None else LANES
    inputs |= {"seed": np.uint32(0), "numbers": np.arange(lanes, dtype=np.uint32), "start": np.int32(0)}

    def trees(flat: _Tree) -> tuple[Any, Any]:
        nested = unflatten_dict({tuple(name.split("/")): value for name, value in flat.items()})
        return nested["params"], nested.get("summary", {})

    def keys(given: _Tree) -> Any:
        return jax.vmap(lambda number: jax.random.fold_in(jax.random.key(given["seed"]), number))(given["numbers"])

    def condition(params: Any, summary: Any, given: _Tree) -> Any:
        fields = {name: given[name] for name in Condition._fields if name in given}
        assert model.condition is not None
        return model.condition(params, summary, Condition(**fields))

    if model.begin is None:

        def window(flat: _Tree, given: _Tree) -> _Tree:
            params, summary = trees(flat)
            pose = engine.sample(params, summary, keys(given)[0], condition(params, summary, given), given["start"])
            return {"pose": pose[None]}

        return None, window, weights, inputs

    def state_before(flat: _Tree, given: _Tree) -> Any:
        return engine.begin(*trees(flat), keys(given), given.get("seed_poses"))

    of_begin = {name: inputs[name] for name in _of_begin(inputs)}
    structure = jax.tree.structure(jax.eval_shape(state_before, weights, of_begin))

    def named(state: Any) -> _Tree:
        return {f"{files.STATE}{number:02d}": leaf for number, leaf in enumerate(jax.tree.leaves(state))}

    def begin(flat: _Tree, given: _Tree) -> _Tree:
        return named(state_before(flat, given))

    def advance(flat: _Tree, given: _Tree) -> _Tree:
        params, summary = trees(flat)
        parts = [given[name] for name in sorted(given) if name.startswith(files.STATE)]
        before = jax.tree.unflatten(structure, parts)
        shared = condition(params, summary, given)
        pose, after = engine.advance(params, summary, keys(given), shared, given["start"], before)
        return {"pose": pose, **named(after)}

    return begin, advance, weights, inputs


def _of_begin(inputs: _Tree) -> list[str]:
    return [name for name in ("seed", "numbers", "seed_poses") if name in inputs]


def _used(function: Any, weights: _Tree, given: _Tree) -> list[str]:
    """Names of the weights that a function depends on."""
    names = sorted(weights)

    def of_list(values: Sequence[Any], given: _Tree) -> _Tree:
        result: _Tree = function(dict(zip(names, values, strict=True)), given)
        return result

    jaxpr = jax.make_jaxpr(of_list)([weights[name] for name in names], given).jaxpr
    _, used = partial_eval.dce_jaxpr(jaxpr, [True] * len(jaxpr.outvars))
    return [name for name, is_used in zip(names, used, strict=False) if is_used]


def _without(function: Any, weights: _Tree, kept: _Tree) -> Any:
    """The function of the kept weights alone; the others, which it does not depend on, are zeros."""
    left_out = {name: (np.shape(value), np.asarray(value).dtype) for name, value in weights.items() if name not in kept}

    def small(flat: _Tree, given: _Tree) -> _Tree:
        zeros = {name: jnp.zeros(*about) for name, about in left_out.items()}
        result: _Tree = function(flat | zeros, given)
        return result

    return small


def _finish(run: Run) -> _Tree:
    """Arrays of the work after the programs."""
    arrays = {}
    for name, statistics in run.config.statistics.items():
        arrays[f"{files.STATISTICS}{name}/mean"] = np.asarray(statistics.mean)
        arrays[f"{files.STATISTICS}{name}/std"] = np.asarray(statistics.std)
    if run.dynamics is not None:
        arrays |= {f"{files.DYNAMICS}{name}": value for name, value in run.dynamics.arrays().items()}
    return arrays


def _shapes(values: _Tree) -> _Tree:
    return {name: jax.ShapeDtypeStruct(np.shape(value), value.dtype) for name, value in values.items()}


def _described(values: _Tree) -> Ports:
    return {
        name: Port(tuple(np.shape(value)), str(np.dtype(value.dtype)), _MEANINGS.get(name, ""))
        for name, value in values.items()
    }
