"""The losses of EmotionGesture against loops in NumPy, their edge cases and their gradients."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from a2g_jax.models.emotion_gesture import losses, vae

CLIPS, FRAMES, WIDTH = 4, 9, 5


@pytest.fixture
def features():
    """Text and beat features, and start frames: no word, one, several, one on the last frame."""
    random = np.random.default_rng(0)
    text, beat = random.normal(size=(2, CLIPS, FRAMES, WIDTH))
    starts = np.zeros((CLIPS, FRAMES), bool)
    starts[1, 3] = True
    starts[2, [0, 2, 3, 7]] = True
    starts[3, FRAMES - 1] = True
    return text, beat, starts


def looped(text, beat, starts, temperature, form):
    """Eq. 2 and InfoNCE, clip by clip, word by word."""
    total = 0.0
    for clip in range(CLIPS):
        words = [frame for frame in range(FRAMES) if starts[clip, frame]]
        if not words:
            continue
        ratios = []
        for word in words:
            anchor = text[clip, word]
            similar = [
                np.dot(anchor, one) / (np.linalg.norm(anchor) * np.linalg.norm(one)) / temperature for one in beat[clip]
            ]
            others = sum(np.exp(similar[frame]) for frame in range(FRAMES) if form == "words" or frame != word)
            ratios.append(np.exp(similar[word]) / others)
        total += -np.log(sum(ratios)) if form == "printed" else -np.mean(np.log(ratios))
    return total / CLIPS


class TestBeatAlignment:
    @pytest.mark.parametrize("form", ["printed", "words"])
    def test_is_the_loop(self, features, x64, form):
        text, beat, starts = features
        ours = losses.beat_alignment(jnp.asarray(text), jnp.asarray(beat), jnp.asarray(starts), 0.1, form)
        np.testing.assert_allclose(ours, looped(text, beat, starts, 0.1, form), rtol=1e-6)

    @pytest.mark.parametrize("form", ["printed", "words"])
    def test_clips_without_words_have_neither_loss_nor_gradient(self, features, form):
        text, beat, _ = (jnp.asarray(array, jnp.float32) for array in features)
        none = jnp.zeros((CLIPS, FRAMES), bool)
        value, gradient = jax.value_and_grad(losses.beat_alignment, (0, 1))(text, beat, none, 0.1, form)
        assert value == 0
        assert all(np.all(part == 0) for part in gradient)

    @pytest.mark.parametrize("form", ["printed", "words"])
    def test_only_frames_of_the_same_clip_count(self, features, form):
        text, beat, starts = (jnp.asarray(array) for array in features)

        def one(clip):
            rows = slice(clip, clip + 1)
            return losses.beat_alignment(text[rows], beat[rows], starts[rows], 0.1, form)

        together = losses.beat_alignment(text, beat, starts, 0.1, form)
        np.testing.assert_allclose(together, np.mean([one(clip) for clip in range(CLIPS)]), rtol=1e-5)

    def test_zero_features_are_finite(self):
        zeros, starts = jnp.zeros((1, 4, 3)), jnp.ones((1, 4), bool)
        for form in ("printed", "words"):
            value, gradient = jax.value_and_grad(losses.beat_alignment)(zeros, zeros, starts, 0.1, form)
            assert np.isfinite(value)
            assert np.all(np.isfinite(gradient))

    def test_features_at_the_words_lower_it(self, features):
        text, beat, starts = (jnp.asarray(array) for array in features)
        aligned = jnp.where(starts[..., None], text, -text)
        for form in ("printed", "words"):
            assert losses.beat_alignment(text, aligned, starts, 0.1, form) < losses.beat_alignment(
                text, beat, starts, 0.1, form
            )


class TestMotionSmooth:
    def test_is_the_loop(self, x64):
        target, made = np.random.default_rng(1).normal(size=(2, 2, 6, 3))
        total = 0.0
        for clip in range(2):
            for channel in range(3):
                true, ours = (np.diff(motion[clip, :, channel]) for motion in (target, made))
                p, q = np.exp(true / 10) / np.exp(true / 10).sum(), np.exp(ours) / np.exp(ours).sum()
                total += np.sum(p * np.log(p / q))
        np.testing.assert_allclose(losses.motion_smooth(jnp.asarray(target), jnp.asarray(made), 10.0), total / 6)

    def test_is_zero_if_and_only_if_offsets_agree_up_to_a_constant_of_each_channel(self, x64):
        target = np.random.default_rng(2).normal(size=(2, 7, 3))
        drift = np.arange(7)[None, :, None] * np.array([0.4, -1.0, 2.0])[None, None]
        same = losses.motion_smooth(jnp.asarray(target), jnp.asarray(target / 10.0 + drift + 5.0), 10.0)
        assert abs(same) < 1e-12
        # The same change at every frame is invisible, a change at one frame is not, nor an offset that varies.
        for frame in range(7):
            moved = (target / 10.0).copy()
            moved[0, frame, 1] += 0.01
            assert losses.motion_smooth(jnp.asarray(target), jnp.asarray(moved), 10.0) > 1e-9
        assert losses.motion_smooth(jnp.asarray(target), jnp.asarray(target), 10.0) > 1e-3

    def test_is_never_negative(self):
        random = np.random.default_rng(3)
        for _ in range(20):
            target, made = random.normal(scale=random.uniform(0.1, 5), size=(2, 1, 5, 2))
            assert losses.motion_smooth(jnp.asarray(target), jnp.asarray(made), 10.0) >= -1e-6


class TestVae:
    def test_divergence_is_that_of_normal_distributions(self, x64):
        assert vae.divergence(jnp.zeros((3, 2)), jnp.zeros((3, 2))) == 0
        # One dimension: KL(N(m, s^2) || N(0, 1)) = (s^2 + m^2 - 1) / 2 - log s
        value = vae.divergence(jnp.full((1, 1), 0.7), jnp.full((1, 1), 2 * np.log(0.3)))
        np.testing.assert_allclose(value, (0.09 + 0.49 - 1) / 2 - np.log(0.3))

    def test_the_relative_error_of_the_mean_is_one(self, x64):
        target = jnp.asarray(np.random.default_rng(4).normal(size=(3, 5, 2)) * np.array([100.0, 0.1]))
        mean = jnp.broadcast_to(jnp.mean(target, axis=(0, 1), keepdims=True), target.shape)
        scale = jnp.std(target, axis=(0, 1))
        np.testing.assert_allclose(vae.relative_error(target, mean, scale), 1.0, rtol=1e-6)
        np.testing.assert_allclose(vae.relative_error(target, target, scale), 0.0)


def _numerical(function, inputs, rng):
    """Slopes of a function along random directions, by central differences and by its gradient."""
    ways = [rng.normal(size=array.shape) for array in inputs]
    step = 1e-6
    ahead, behind = (
        function(*(a + sign * step * way for a, way in zip(inputs, ways, strict=True))) for sign in (1, -1)
    )
    gradient = jax.grad(function, tuple(range(len(inputs))))(*inputs)
    return (ahead - behind) / (2 * step), sum(np.sum(g * way) for g, way in zip(gradient, ways, strict=True))


@pytest.mark.parametrize(
    "name", ["printed", "words", "smooth", "reconstruction", "generator", "discriminator", "divergence", "error"]
)
def test_gradients_are_the_numerical_ones(features, x64, name):
    text, beat, starts = (jnp.asarray(array) for array in features)
    scale = jnp.linspace(0.5, 2.0, WIDTH)
    cases = {
        "printed": (lambda a, b: losses.beat_alignment(a, b, starts, 0.1, "printed"), (text, beat)),
        "words": (lambda a, b: losses.beat_alignment(a, b, starts, 0.1, "words"), (text, beat)),
        "smooth": (lambda a, b: losses.motion_smooth(a, b, 10.0), (text, beat)),
        "reconstruction": (losses.reconstruction, (text, beat)),
        "generator": (losses.generator_adversarial, (text[0, 0],)),
        "discriminator": (losses.discriminator_adversarial, (text[0, 0], beat[0, 0])),
        "divergence": (vae.divergence, (text[0], beat[0])),
        "error": (lambda a, b: vae.relative_error(a, b, scale), (text, beat)),
    }
    expected, found = _numerical(*cases[name], np.random.default_rng(5))
    assert abs(expected) > 1e-4
    np.testing.assert_allclose(found, expected, rtol=1e-5)
