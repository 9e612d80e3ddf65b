"""EmotionGesture: size, independence of samples, the prompts, what emotions do, and the settings that are refused.

Networks run as one compiled program each: operation by operation, they take several times as long to compile.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emotion_gesture_for_tests import CONFIG, EMOTIONS, JOINTS, make_batch, make_data, make_params, stage

from a2g_jax.errors import InputError
from a2g_jax.models.base import Condition, finished
from a2g_jax.models.emotion_gesture.chunks import sample_emotion
from a2g_jax.models.emotion_gesture.config import PRESETS
from a2g_jax.models.emotion_gesture.mining import AudioEncoder, standardised
from a2g_jax.models.emotion_gesture.model import build
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_gesture.objective import continued, generate, judged
from a2g_jax.models.emotion_gesture.prompter import interpolate, reinforce
from a2g_jax.models.emotion_gesture.sampling import EmotionGestureSampling
from a2g_jax.models.registry import find_model
from a2g_jax.nn.rates import resized
from a2g_jax.nn.transformer import sinusoids
from a2g_jax.training.stages import stage_spans
from a2g_jax.training.state import joint_loss

#: Terms of the discriminator's side.
JUDGED = ("discriminator", "recorded_emotion")
VARIANTS = {
    "tiny": CONFIG,
    "authors": replace(CONFIG, header="channels", prompt_space="poses", emotion_pool="flat", scaled_scores=False),
    "zero": replace(CONFIG, prompter="zero", branches="none"),
    "duplicate": replace(CONFIG, prompter="duplicate", branches="label"),
    "spatial": replace(CONFIG, prompter="spatial", query_positions=False, normalise_pose=False, hold_seed=False),
    "raw": replace(CONFIG, normalise_pose=False),
}


def size(tree) -> int:
    """Number of parameters."""
    return sum(int(np.prod(leaf.shape)) for leaf in jax.tree.leaves(tree))


class TestSize:
    def counted(self, name, joints=47):
        model = build(PRESETS[name], make_data(joints, tuple("abcdefgh"), 128, 2))
        params = jax.eval_shape(model.init, jax.random.key(0))
        words = int(np.prod(params["generator"]["text"]["vectors"].shape))
        return size(params["generator"]) - words, params

    def test_paper_is_that_of_the_paper(self):
        generator, params = self.counted("paper")
        assert 47e6 < generator < 50e6
        assert 0.2e6 < size(params["vae"]) < 0.3e6

    def test_authors_is_the_published_structure(self):
        """Counted part by part from the published code; weights that it makes and never uses are left out."""
        linear = lambda before, after: before * after + after  # noqa: E731
        d, n, c, chunk = 512, 60, 282, 10

        def squeeze(channels):
            return linear(channels, channels // 8) + linear(channels // 8, channels)

        def block(before, after, changes):
            convolutions = 9 * before * after + 9 * after * after + 4 * after
            return convolutions + squeeze(after) + (before * after + 2 * after if changes else 0)

        encoder = 9 * 32 + 32 + 64 + 3 * block(32, 32, False)
        encoder += block(32, 64, True) + 3 * block(64, 64, False) + block(64, 128, True) + 5 * block(128, 128, False)
        # 120 spectra in place of their 124: 30 columns remain of 31.
        encoder += 9 * 128 * n + n + 2 * n + linear(32 * 30, d) + linear(d, d)
        # Weight normalisation and a layer over time are not in ours.
        text = 6 * (2 * 300 * 300 + 300) + linear(300, d)
        projectors = 3 * 2 * linear(d, d)
        classifier = linear(n * d, d) + linear(d, 256) + linear(256, 64) + linear(64, 8)
        layer = 4 * d * d + 2 * d + linear(d, 2048) + linear(2048, d) + 2 * d
        predictor = 3 * 10 * 50 + 50 + 3 * 50 * 50 + 50 + 4 * 50
        spatial = linear(chunk * c, c) + linear(c, c)
        temporal = linear(chunk * c, chunk) + linear(chunk, chunk)
        prompter = predictor + 2 * spatial + temporal + linear(c, d) + linear(d, d)
        decoder = 3 * layer + linear(d, 4 * d) + linear(4 * d, d) + linear(d, c) + linear(c, c)
        expected = encoder + text + projectors + classifier + 3 * layer + prompter + decoder
        generator, _ = self.counted("authors")
        assert generator == expected
        # Their decoder also makes three self-attentions, which are not called: 48.2 million in all.
        assert 48.0e6 < expected + 3 * (4 * d * d + 2 * d) < 48.4e6

    def test_tiny(self):
        model = build(PRESETS["tiny"], make_data(22, tuple("abcdefgh"), 128, 2))
        assert 1.2e6 < size(jax.eval_shape(lambda key: finished(model, model.init(key)), jax.random.key(0))) < 2e6


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "raw" else name for name in VARIANTS]
)
def test_a_sample_does_not_depend_on_the_others_of_its_batch(name):
    config = VARIANTS[name]
    networks = Networks(config, make_data())
    params = make_params(build(config, make_data()))
    made = jax.jit(lambda batch: generate(networks, params, batch)[1])
    batch, other = make_batch(), make_batch(seed=9)
    mixed = jax.tree.map(lambda ours, theirs: np.concatenate([ours[:1], theirs[1:]]), batch, other)
    np.testing.assert_array_equal(made(batch)[0], made(mixed)[0])
    assert np.abs(made(batch)[1] - made(mixed)[1]).max() > 1e-3
    alone = made(jax.tree.map(lambda array: array[:1], batch))
    np.testing.assert_allclose(alone[0], made(batch)[0], atol=1e-5)
    assert made(batch).shape == (3, config.clip_frames, JOINTS * 6)


@pytest.mark.parametrize("header", ["aligned", "channels"])
@pytest.mark.parametrize("frames", [12, 15])
def test_both_headers_give_a_row_a_frame(header, frames):
    encoder = AudioEncoder((1, 1), (4, 6), 1, 8, header, 2, 0.0)
    audio = jnp.zeros((2, frames, 12))
    rows, _ = jax.eval_shape(lambda key: encoder.init_with_output(key, audio, True), jax.random.key(0))
    assert rows.shape == (2, frames, 8)


def test_the_aligned_header_keeps_time():
    """A click moves the features near it most; with the authors' header it does not matter where it is."""
    frames, width = 32, 12
    audio = np.zeros((2, frames, width), np.float32)
    audio[1, 24] = 5.0
    changes = {}
    for header in ("aligned", "channels"):
        encoder = AudioEncoder((1, 1), (4, 6), 1, 8, header, 2, 0.0)
        encode = jax.jit(lambda key, one=encoder: one.init_with_output(key, jnp.asarray(audio), True)[0])
        silent, click = np.asarray(encode(jax.random.key(1)))
        changes[header] = np.linalg.norm(click - silent, axis=-1)
    near = changes["aligned"][22:27].mean() / changes["aligned"][:12].mean()
    assert near > 1.5
    assert near > 1.2 * changes["channels"][22:27].mean() / changes["channels"][:12].mean()


class TestPrompts:
    @pytest.fixture
    def arrays(self):
        random = np.random.default_rng(6)
        return random.normal(size=(2, 3, 5)), random.normal(size=(2, 5)), random.normal(size=(2, 3))

    def test_interpolation_is_the_loop(self, arrays, x64):
        near, spatial, _ = arrays
        ours = interpolate(jnp.asarray(near), jnp.asarray(spatial)[:, None], 2.0)
        for clip in range(2):
            for frame in range(3):
                share = 1 / (1 + np.exp(-spatial[clip] @ near[clip, frame] / 2.0))
                expected = share * near[clip, frame] + (1 - share) * spatial[clip]
                np.testing.assert_allclose(ours[clip, frame], expected)

    def test_reinforcement_is_the_product_of_matrices_of_one_sample(self, arrays, x64):
        near, spatial, temporal = arrays
        ours = reinforce(jnp.asarray(near), jnp.asarray(spatial), jnp.asarray(temporal), 3.0)
        for clip in range(2):
            row, column = spatial[clip][None], temporal[clip][:, None]
            product = (column @ row) @ row.T / 3.0
            weights = np.exp(product) / np.exp(product).sum()
            np.testing.assert_allclose(ours[clip], near[clip] + near[clip] * weights)

    def test_initial_poses_stay_in_the_prompt_and_the_end_does_not_change(self):
        """The prompts change only the first L poses after the initial ones."""
        made = {}
        seed = jnp.asarray(np.random.default_rng(7).normal(size=(1, CONFIG.seed_frames, JOINTS * 6)), jnp.float32)
        params = make_params(build(CONFIG, make_data()))
        own = {"params": params["generator"]["prompter"]}
        for kind in ("spatial-temporal", "spatial", "predictor"):
            networks = Networks(replace(CONFIG, prompter=kind), make_data())
            prompter = networks._generator["prompter"]
            made[kind] = np.asarray(jax.jit(lambda one, apply=prompter.apply: apply(one, seed, True))(own))[0]
        m, length = CONFIG.seed_frames, CONFIG.transition_frames
        for kind in ("spatial", "predictor"):
            changed = np.abs(made["spatial-temporal"] - made[kind]).max(axis=-1) > 1e-6
            assert not changed[:m].any()
            assert changed[m : m + length].all()
            assert not changed[m + length :].any()


def test_interpolated_time():
    steps = jnp.arange(4.0)[None, :, None]
    np.testing.assert_allclose(resized(steps, 4)[0, :, 0], [0, 1, 2, 3])
    np.testing.assert_allclose(resized(steps, 8)[0, :, 0], [0, 0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3], atol=1e-6)
    np.testing.assert_allclose(resized(jnp.ones((1, 31, 2)), 60), 1.0, atol=1e-6)


@pytest.mark.parametrize("normalise", [True, False])
def test_the_held_pose_fades_to_the_mean_pose(normalise):
    """With a decoder of zeros the motion is the seed poses, then a pose that comes to rest and leaves for the mean."""
    config, data = replace(CONFIG, normalise_pose=normalise), make_data()
    networks = Networks(config, data)
    params = make_params(build(config, data))
    generator = dict(params["generator"])
    generator["decoder"] = jax.tree.map(np.zeros_like, generator["decoder"])
    generator["hold"] = jax.tree.map(np.zeros_like, generator["hold"])
    batch = make_batch()
    made = jax.jit(lambda params: networks.pose(generate(networks, params, batch)[1]))
    pose = np.asarray(made({**params, "generator": generator}))[0]
    seed = np.asarray(batch.pose[0, : config.seed_frames])
    np.testing.assert_allclose(pose[: config.seed_frames], seed, atol=1e-5)
    place = seed[-1]
    for frame in range(config.stride):
        place = place + 0.6 ** (frame + 1) * (seed[-1] - seed[-2])
        share = 1 / (1 + np.exp(-5 * np.exp(-frame / 4)))
        between = share * place + (1 - share) * data.pose_statistics.mean
        np.testing.assert_allclose(pose[config.seed_frames + frame], between, atol=1e-5)


def test_beat_features_hold_nothing_that_is_constant_in_a_clip():
    features = jax.random.normal(jax.random.key(0), (2, 30, 4))
    moved = standardised(3.0 * features + jnp.arange(4.0)[None, None])
    np.testing.assert_allclose(moved, standardised(features), atol=1e-4)
    np.testing.assert_allclose(jnp.mean(moved, axis=1), 0.0, atol=1e-5)
    np.testing.assert_allclose(standardised(jnp.ones((1, 5, 2))), 0.0)


def test_positions_are_those_of_the_formula():
    table = sinusoids(7, 6)
    for frame in range(7):
        for pair in range(3):
            angle = frame / 10000 ** (2 * pair / 6)
            np.testing.assert_allclose(table[frame, 2 * pair : 2 * pair + 2], [np.sin(angle), np.cos(angle)], atol=1e-6)


class TestObjective:
    @pytest.fixture(scope="class")
    def sides(self):
        """Values and gradients of any weighting of the terms, in double precision."""
        config = replace(CONFIG, reconstruction_weight=2.0, smooth_weight=0.7, emotion_weight=0.4, beat_weight=0.6)
        config = replace(config, shown_emotion_weight=1.0)
        with jax.enable_x64(True):
            model = build(config, make_data())
            # On the host: changes of parameters and comparisons with zero are then no programs.
            params, batch = jax.device_get(make_params(model, np.float64)), make_batch(dtype=np.float64)
        weights = {
            "reconstruction": 2.0,
            "smooth": 0.7,
            "emotion": 0.4,
            "beat": 0.6,
            "adversarial": 1.0,
            "shown_emotion": 1.0,
            "discriminator": 1.0,
            "recorded_emotion": 1.0,
        }

        def mixed(params, chosen):
            total, terms = joint_loss(stage(model, "main"))(params, jax.random.key(0), batch, jnp.int32(0))
            return chosen["total"] * total + sum(chosen[name] * terms[name] for name in weights)

        compiled = jax.jit(jax.value_and_grad(mixed))
        function = lambda params, chosen: jax.device_get(compiled(params, chosen))  # noqa: E731
        choose = lambda *names: {n: np.float64(n in names) for n in (*weights, "total")}  # noqa: E731
        return function, params, choose, weights

    def test_each_side_moves_its_own_network(self, sides, x64):
        function, params, choose, weights = sides
        largest = lambda tree: max(np.abs(leaf).max() for leaf in jax.tree.leaves(tree))  # noqa: E731
        game = function(params, choose(*JUDGED))[1]
        assert largest(game["generator"]) == 0
        assert largest(game["discriminator"]) > 0
        rest = function(params, choose(*[name for name in weights if name not in JUDGED]))[1]
        assert largest(rest["discriminator"]) == 0
        assert largest(rest["vae"]) == largest(game["vae"]) == 0

    def test_the_total_is_the_weighted_sum(self, sides, x64):
        function, params, choose, weights = sides
        total = function(params, choose("total"))[0]
        parts = sum(weight * function(params, choose(name))[0] for name, weight in weights.items())
        np.testing.assert_allclose(total, parts, rtol=1e-12)

    def test_every_term_moves_the_part_that_it_is_for(self, sides, x64):
        function, params, choose, _ = sides
        moved = {
            "beat": {"audio", "beat", "text"},
            "emotion": {"audio", "emotion", "classifier"},
            "smooth": {"audio", "emotion", "beat", "fusion", "encoder", "prompter", "decoder", "hold"},
        }
        for name, expected in moved.items():
            gradient = function(params, choose(name))[1]["generator"]
            found = {
                part for part, tree in gradient.items() if any(np.any(leaf != 0) for leaf in jax.tree.leaves(tree))
            }
            assert found == expected, name

    @pytest.mark.parametrize("network", ["generator", "discriminator"])
    def test_the_gradient_is_the_numerical_one(self, sides, x64, network):
        function, params, choose, _ = sides
        gradient = function(params, choose("total"))[1][network]
        random = np.random.default_rng(5)
        way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params[network])
        step = 1e-7
        ahead, behind = (
            function(
                params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)},
                choose("total"),
            )[0]
            for sign in (1, -1)
        )
        expected = (ahead - behind) / (2 * step)
        if network == "generator":
            # The discriminator's loss depends on the generator too, but does not train it.
            ahead, behind = (
                function(
                    params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)},
                    choose("discriminator"),
                )[0]
                for sign in (1, -1)
            )
            expected -= (ahead - behind) / (2 * step)
        else:
            ahead, behind = (
                function(
                    params | {network: jax.tree.map(lambda p, w, s=sign: p + s * step * w, params[network], way)},
                    choose("adversarial", "shown_emotion"),
                )[0]
                for sign in (1, -1)
            )
            expected -= (ahead - behind) / (2 * step)
        inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(np.asarray(g) * w), gradient, way)))
        assert abs(expected) > 1e-3
        np.testing.assert_allclose(inner, expected, rtol=1e-4)

    @pytest.mark.parametrize("discriminator", ["patches", "transformer"])
    def test_the_discriminators(self, discriminator):
        """Patches are judged with audio and emotion, from the last initial pose on; as published, all differences."""
        config = replace(CONFIG, discriminator=discriminator)
        networks, batch = Networks(config, make_data()), make_batch()
        params = make_params(build(config, make_data()))
        motion, label = np.asarray(networks.flat(batch.pose)), np.eye(3, dtype=np.float32)[batch.emotion]
        judge = jax.jit(networks.judge)
        logits, emotions = judge(params, motion, batch.audio, label)
        assert logits.shape == (3,)
        patches = discriminator == "patches"
        assert (None if emotions is None else emotions.shape) == ((3, 3) if patches else None)
        changed = {
            "audio": judge(params, motion, -batch.audio, label)[0],
            "label": judge(params, motion, batch.audio, np.roll(label, 1, axis=1))[0],
            "first": judge(params, np.concatenate([2 * motion[:, :2], motion[:, 2:]], axis=1), batch.audio, label)[0],
        }
        expected = {"audio": patches, "label": patches, "first": not patches}
        assert {name: bool(np.any(np.asarray(value) != logits)) for name, value in changed.items()} == expected

    def test_motion_with_the_audio_of_another_clip_counts_as_false(self, sides):
        networks, batch = Networks(CONFIG, make_data()), make_batch()
        model = build(replace(CONFIG, mismatched=False), make_data())
        params = make_params(model)

        @jax.jit
        def scores(params):
            label, recorded = jax.nn.one_hot(batch.emotion, 3), networks.flat(batch.pose)
            true = networks.judge(params, recorded, batch.audio, label)[0]
            other = networks.judge(params, recorded, jnp.roll(batch.audio, 1, axis=0), label)[0]
            audio, made, _ = generate(networks, params, batch)
            return true, other, networks.judge(params, *judged(networks, params, batch, audio, made, None))[0]

        true, other, made = map(np.asarray, scores(params))
        real, mismatched, false = (np.mean(np.logaddexp(0, score)) for score in (-true, other, made))
        # The fixture's model has them. Six generated motions and three mismatched pairs: the mean is over nine.
        assert CONFIG.mismatched
        function, own, choose, _ = sides
        with jax.enable_x64(True):
            found = function(own, choose("discriminator"))[0]
        np.testing.assert_allclose(found, real + (6 * false + 3 * mismatched) / 9, atol=1e-5)
        loss = jax.jit(stage(model, "main").updates[0].loss)
        without = loss(params, jax.random.key(0), batch, jnp.int32(0))[1]["discriminator"]
        np.testing.assert_allclose(without, real + false, atol=1e-5)

    def test_audio_joins_the_queries_of_its_frames(self):
        moved = {}
        for joined in (False, True):
            config = replace(CONFIG, query_audio=joined)
            networks, batch = Networks(config, make_data()), make_batch()
            params = make_params(build(config, make_data()))

            @jax.jit
            def change(params, networks=networks, batch=batch):
                audio = networks.encode_audio(params, batch.audio)
                seed = networks.flat(batch.pose)[:, : CONFIG.seed_frames]
                bumped = audio._replace(beat=audio.beat.at[:, 9].add(1.0))
                return networks.decode(params, bumped, seed) - networks.decode(params, audio, seed)

            moved[joined] = np.abs(change(params))
        assert moved[True][:, 9].mean() > 2.0 * moved[True][:, :6].mean()

    def test_emotion_features_are_exchanged_with_their_labels(self):
        networks, batch = Networks(CONFIG, make_data()), make_batch()
        params = make_params(build(CONFIG, make_data()))

        @jax.jit
        def exchanged(params):
            audio, made, target = generate(networks, params, batch)
            mixed = audio._replace(emotion=audio.emotion[jnp.array([2, 0, 1])])
            own = networks.decode(params, mixed, target[:, : CONFIG.seed_frames])
            return made, judged(networks, params, batch, audio, made, None), own

        made, both, own = jax.device_get(exchanged(params))
        np.testing.assert_array_equal(both.motion[:3], made)
        np.testing.assert_array_equal(both.label[3:], np.roll(both.label[:3], 1, axis=0))
        np.testing.assert_array_equal(both.audio[3:], both.audio[:3])
        np.testing.assert_allclose(both.motion[3:], own, atol=1e-6)
        assert np.abs(both.motion[3:] - made).max() > 1e-3
        for config in (replace(CONFIG, exchange=False), replace(CONFIG, discriminator="transformer")):
            without = Networks(config, make_data())

            def alone(params, networks=without):
                audio, made, _ = generate(networks, params, batch)
                return judged(networks, params, batch, audio, made, None)

            assert len(jax.eval_shape(alone, params).motion) == 3

    def test_the_vae_has_the_numerical_gradient_and_trains_alone(self, x64):
        model = build(CONFIG, make_data())
        params, batch = jax.device_get(make_params(model, np.float64)), make_batch(dtype=np.float64)
        function = jax.jit(
            jax.value_and_grad(
                lambda p: stage(model, "emotion_vae").updates[0].loss(p, jax.random.key(1), batch, jnp.int32(0))[0]
            )
        )
        gradient = jax.device_get(function(params)[1])
        assert all(np.all(leaf == 0) for leaf in jax.tree.leaves(gradient["generator"]))
        random = np.random.default_rng(8)
        way = jax.tree.map(lambda leaf: random.normal(size=leaf.shape), params["vae"])
        # Measured once, and constants from then on.
        way["features"] = jax.tree.map(np.zeros_like, params["vae"]["features"])
        assert all(np.all(leaf == 0) for leaf in jax.tree.leaves(gradient["vae"]["features"]))
        ahead, behind = (
            function(params | {"vae": jax.tree.map(lambda p, w, s=sign: p + s * 1e-7 * w, params["vae"], way)})[0]
            for sign in (1, -1)
        )
        inner = sum(jax.tree.leaves(jax.tree.map(lambda g, w: np.sum(np.asarray(g) * w), gradient["vae"], way)))
        np.testing.assert_allclose(inner, (ahead - behind) / 2e-7, rtol=1e-4)

    def test_sampled_emotions_are_exchanged_and_features_are_constants(self):
        model, networks, batch = build(CONFIG, make_data()), Networks(CONFIG, make_data()), make_batch()
        params = make_params(model)

        @jax.jit
        def exchanged(params):
            audio, made, target = generate(networks, params, batch)
            latent = jax.random.normal(jax.random.key(3), (3, CONFIG.vae_latent))
            both = judged(networks, params, batch, audio, made, None, latent)
            features = networks.decode_emotion(params, latent, both.label[3:])
            seed = continued(networks, params, audio, features, target[:, : CONFIG.seed_frames], None)
            return both.motion[3:], networks.decode(params, audio._replace(emotion=features), seed)

        found, own = exchanged(params)
        np.testing.assert_allclose(found, own, atol=1e-6)
        generator = stage(model, "sampled").updates[1].loss
        gradient = jax.jit(jax.grad(lambda p: generator(p, jax.random.key(0), batch, jnp.int32(0))[0]))(params)
        gradient = jax.device_get(gradient)
        moved = {
            name
            for name, tree in gradient["generator"].items()
            if any(np.any(leaf != 0) for leaf in jax.tree.leaves(tree))
        }
        assert moved == {"fusion", "encoder", "prompter", "decoder", "hold"}
        assert all(np.all(leaf == 0) for leaf in jax.tree.leaves(gradient["vae"]))

    @pytest.mark.slow
    def test_the_run_has_the_average_of_the_generator(self):
        """Over the last stage with a discriminator, from its beginning on."""
        config = replace(CONFIG, average_decay=0.75)
        model, batch = build(config, make_data()), make_batch()
        assert ["average" in [one.name for one in each.updates] for each in model.stages] == [False, False, False, True]
        last = stage(model, "sampled")
        params = last.warm_start(make_params(model), batch)
        mean = params["generator"]
        assert all(np.array_equal(a, b) for a, b in zip(*map(jax.tree.leaves, (mean, params["average"])), strict=True))
        update = last.updates[2]
        optimiser, state = update.optimiser(None), None
        for number in range(3):
            moved = jax.tree.map(lambda leaf, n=number: leaf + 0.1 * (n + 1), params["generator"])
            params = params | {"generator": moved}
            loss = lambda own, p=params: update.loss({**p, **own}, jax.random.key(0), batch, jnp.int32(0))[0]  # noqa: E731
            value, gradient = jax.value_and_grad(loss)({"average": params["average"]})
            assert value == 0
            state = optimiser.init(gradient) if state is None else state
            changes, state = optimiser.update(gradient, state)
            params = params | {"average": jax.tree.map(jnp.add, params["average"], changes["average"])}
            mean = jax.tree.map(lambda old, new: 0.75 * old + 0.25 * new, mean, moved)
        run = model.finish(params)
        assert set(run) == {"generator", "discriminator", "vae"}
        for found, expected in zip(*map(jax.tree.leaves, (run["generator"], mean)), strict=True):
            np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)
        assert build(CONFIG, make_data()).finish is None
        without = build(replace(config, sampled_steps=0), make_data())
        assert [update.name for update in stage(without, "main").updates] == ["discriminator", "generator", "average"]

    def test_exchanged_motions_continue_the_chunks_of_generation(self):
        config = replace(CONFIG, continued_chunks=2)
        networks, batch = Networks(config, make_data()), make_batch()
        params = make_params(build(config, make_data()))
        first = slice(config.seed_frames)

        def proceed(params, networks=networks):
            audio, _, target = generate(networks, params, batch)
            return continued(networks, params, audio, audio.emotion, target[:, first], None)

        @jax.jit
        def expectation(params):
            """The initial poses after no, one and two chunks."""
            audio, _, target = generate(networks, params, batch)
            poses = [target[:, first]]
            for before in ([2, 0, 1], [1, 2, 0]):
                mixed = audio._replace(beat=audio.beat[jnp.array(before)])
                made = networks.pose(networks.decode(params, mixed, poses[-1])[:, -config.seed_frames :])
                poses.append(networks.flat(networks.data.space.valid(made)))
            return poses

        found, expected = np.asarray(jax.jit(proceed)(params)), expectation(params)
        np.testing.assert_array_equal(found[0], expected[0][0])
        for chunk in (1, 2):
            np.testing.assert_allclose(found[chunk], expected[chunk][chunk], atol=1e-5)
        gradient = jax.device_get(jax.jit(jax.grad(lambda params: jnp.sum(proceed(params))))(params))
        assert all(np.all(leaf == 0) for leaf in jax.tree.leaves(gradient))
        none = Networks(replace(config, continued_chunks=0), make_data())
        np.testing.assert_array_equal(jax.jit(lambda params: proceed(params, none))(params), expected[0])

    def test_the_vae_begins_with_the_scale_of_the_features(self):
        model, networks, batch = build(CONFIG, make_data()), Networks(CONFIG, make_data()), make_batch()
        params = make_params(model)
        features = np.asarray(jax.jit(networks.encode_audio)(params, batch.audio).emotion)
        measured = jax.jit(stage(model, "emotion_vae").warm_start)(params, batch)["vae"]["features"]
        np.testing.assert_allclose(measured["mean"], np.mean(features, axis=(0, 1)), rtol=1e-5)
        np.testing.assert_allclose(measured["scale"], np.std(features, axis=(0, 1)), rtol=0.1, atol=1e-3)


class TestSettings:
    def test_parts_come_and_go_with_their_weights(self):
        config = replace(CONFIG, adversarial_weight=0.0, beat_weight=0.0, vae_steps=0)
        model = build(config, make_data())
        assert set(jax.eval_shape(model.init, jax.random.key(0))) == {"generator"}
        assert model.batch_fields == ("audio", "pose", "emotion")
        assert [each.name for each in model.stages] == ["mining", "main"]
        assert [update.name for update in stage(model, "main").updates] == ["generator"]

    def test_stages(self):
        model = build(CONFIG, make_data())
        assert model.batch_fields == ("audio", "pose", "emotion", "words", "word_starts")
        spans = stage_spans(model, find_model("emotion_gesture").training["tiny"])
        assert [(span.stage.name, span.config.steps) for span in spans] == [
            *(("mining", 5), ("main", find_model("emotion_gesture").training["tiny"].steps)),
            *(("emotion_vae", 8), ("sampled", 6)),
        ]

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"header": "time"}, "--header: expected one of aligned, channels; got time."),
            ({"prompter": "none"}, "--prompter: expected one of spatial-temporal"),
            ({"transition_frames": 5}, "--transition-frames: expected a number from 2 to 4, as --seed-frames; got 5."),
            ({"transition_frames": 1}, "--transition-frames: expected a number from 2 to 4"),
            ({"clip_frames": 5}, "--clip-frames: expected at least two frames after the 4 seed frames; got 5."),
            ({"channels": 9}, "--channels: expected a multiple of the 2 --heads; got 9."),
            ({"audio_blocks": (1,)}, "--audio-blocks: expected as many numbers as --audio-channels has; got (1,)."),
            ({"smooth_weight": -1.0}, "--smooth-weight: expected 0 or more; got -1.0."),
            ({"beat_temperature": 0.0}, "--beat-temperature: expected a number above 0; got 0.0."),
            ({"dropout": 1.0}, "--dropout: expected 0 or more and below 1; got 1.0."),
            ({"layers": 0}, "--layers: expected 1 or more; got 0."),
            ({"vae_steps": -1}, "--vae-steps: expected 0 or more; got -1."),
            ({"sampled_steps": -2}, "--sampled-steps: expected 0 or more; got -2."),
            ({"smoothing": -1}, "--smoothing: expected 0 or more; got -1."),
            ({"discriminator_rate": 0.0}, "--discriminator-rate: expected a number above 0; got 0.0."),
            ({"discriminator": "cnn"}, "--discriminator: expected one of transformer, patches; got cnn."),
        ],
    )
    def test_refused(self, changes, message):
        with pytest.raises(InputError) as error:
            replace(CONFIG, **changes)
        assert message in str(error.value)

    def test_emotions_that_a_run_cannot_show(self):
        with pytest.raises(InputError, match="the run has no emotion 'hapiness'; it has: anger, happiness, neutral"):
            build(CONFIG, make_data(), EmotionGestureSampling(emotion="hapiness"))
        for config in (replace(CONFIG, vae_steps=0), replace(CONFIG, branches="none")):
            for emotion in ("anger", "sample"):
                with pytest.raises(InputError, match="the run has no emotion-conditioned VAE"):
                    build(config, make_data(), EmotionGestureSampling(emotion=emotion))
        build(replace(CONFIG, branches="label"), make_data(), EmotionGestureSampling(emotion="anger"))
        with pytest.raises(InputError, match="the corpus has no emotions"):
            build(CONFIG, make_data(emotions=()))


class TestEmotions:
    def test_weights_mix_the_features_of_the_emotions(self):
        networks = Networks(CONFIG, make_data())
        params = make_params(build(CONFIG, make_data()))
        frames = CONFIG.clip_frames
        draw = jax.jit(lambda weights: sample_emotion(networks, params, jax.random.key(4), 1.0, weights))
        pure = [draw(np.tile(row, (frames, 1)).astype(np.float32)) for row in np.eye(3)]
        blend = np.linspace(0, 1, frames, dtype=np.float32)[:, None]
        mixed = draw(np.concatenate([1 - blend, blend, np.zeros_like(blend)], axis=1))
        np.testing.assert_allclose(mixed, (1 - blend) * pure[0] + blend * pure[1], atol=1e-5)
        assert np.abs(pure[0] - pure[1]).max() > 1e-2

    def test_a_run_takes_emotions_only_if_its_settings_say_so(self):
        fields = lambda emotion: build(CONFIG, make_data(), EmotionGestureSampling(emotion)).condition_fields  # noqa: E731
        assert fields("audio") == fields("sample") == ("audio", "seed_poses", "controls")
        assert fields("label") == fields("anger") == ("audio", "seed_poses", "emotion", "controls")

    def test_the_settings_request_weights(self):
        model = build(CONFIG, make_data(), EmotionGestureSampling("neutral@0,anger@1"))
        rows = model.requested(40)["emotion"]
        assert rows.shape == (40, len(EMOTIONS))
        np.testing.assert_allclose(rows[[0, -1]], [[0, 0, 1], [1, 0, 0]])
        with pytest.raises(InputError, match="second 1 is past the end of the speech, which lasts 0.67 s"):
            model.requested(10)
        assert build(CONFIG, make_data()).requested(10) == {}

    def test_audio_is_delayed_for_the_initial_poses(self):
        model = build(CONFIG, make_data())
        audio = jnp.arange(20.0)[:, None] * jnp.ones((1, 12))
        given = model.condition({}, {}, Condition(audio))
        np.testing.assert_array_equal(given.before[:, 0], [*[0] * 4, *range(16)])
        assert np.isnan(given.emotion).all()
