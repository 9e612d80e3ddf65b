"""EmotionGesture's later stages: the VAE, sampled emotions, continued chunks and averaged weights."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emotion_gesture_for_tests import CONFIG, make_batch, make_data, make_params, stage

from a2g_jax.models.emotion_gesture.model import build
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_gesture.objective import continued, generate, judged


class TestVae:
    def test_the_vae_begins_with_the_scale_of_the_features(self):
        model, networks, batch = build(CONFIG, make_data()), Networks(CONFIG, make_data()), make_batch()
        params = make_params(model)
        features = np.asarray(jax.jit(networks.encode_audio)(params, batch.audio).emotion)
        measured = jax.jit(stage(model, "emotion_vae").warm_start)(params, batch)["vae"]["features"]
        np.testing.assert_allclose(measured["mean"], np.mean(features, axis=(0, 1)), rtol=1e-5)
        np.testing.assert_allclose(measured["scale"], np.std(features, axis=(0, 1)), rtol=0.1, atol=1e-3)

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


class TestSampled:
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
