"""EmotionGesture's main stage: what each term trains, numerical gradients, and the discriminator."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from emotion_gesture_for_tests import CONFIG, make_batch, make_data, make_params, stage

from a2g_jax.models.emotion_gesture.model import build
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_gesture.objective import generate, judged
from a2g_jax.training.state import joint_loss

#: Terms of the discriminator's side.
JUDGED = ("discriminator", "recorded_emotion")


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


class TestDiscriminator:
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
