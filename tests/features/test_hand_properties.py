"""Properties of gesturing: energy, height, radius, rate of strokes and handedness."""

import jax
import jax.numpy as jnp
import numpy as np

from a2g_jax.features.hand_properties import PROPERTIES, hand_properties

FPS = 30.0
measured = jax.jit(lambda hands, root: hand_properties(hands, root, FPS))


def swinging(left=0.1, right=0.2, hertz=1.0, frames=240):
    """Hands that swing up and down, each with an amplitude in metres, 0.4 m to the sides of the root."""
    wave = np.sin(2.0 * np.pi * hertz * np.arange(frames) / FPS)
    hands = np.zeros((frames, 2, 3), np.float32)
    hands[..., 0] = 0.4, -0.4
    hands[..., 1] = 0.3 + wave[:, None] * [left, right]
    return hands, np.zeros((frames, 3), np.float32)


def properties(hands, root):
    return dict(zip(PROPERTIES, np.asarray(measured(hands, root)), strict=True))


def test_they_are_those_of_a_loop():
    rng = np.random.default_rng(0)
    hands = np.cumsum(rng.normal(scale=0.02, size=(90, 2, 3)), axis=0).astype(np.float32)
    root = np.cumsum(rng.normal(scale=0.02, size=(90, 3)), axis=0).astype(np.float32)
    local = hands - root[:, None]
    lengths = np.zeros(2)
    for before, after in zip(local, local[1:], strict=False):
        lengths += [np.linalg.norm(after[hand] - before[hand]) for hand in (0, 1)]
    found = properties(hands, root)
    np.testing.assert_allclose(found["energy"], lengths.mean() / 89 * FPS, rtol=1e-4)
    np.testing.assert_allclose(found["height"], local[..., 1].mean(), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(found["radius"], np.hypot(local[..., 0], local[..., 2]).mean(), rtol=1e-4)
    np.testing.assert_allclose(found["handedness"], lengths[1] / lengths.sum(), rtol=1e-4)


def test_every_up_and_every_down_is_a_stroke():
    for hertz in (0.5, 1.0, 1.5):
        found = properties(*swinging(hertz=hertz))
        np.testing.assert_allclose(found["rate"], 2.0 * hertz, atol=0.2)


def test_hands_that_hang_make_no_strokes_and_belong_to_neither_side():
    hands, root = swinging(0.0, 0.0)
    found = properties(hands, root)
    assert found["rate"] == 0
    assert found["energy"] == 0
    assert np.isfinite(list(found.values())).all()
    # A tremor of a millimetre is no stroke.
    assert properties(*swinging(0.001, 0.001, 4.0))["rate"] == 0


def test_walking_changes_nothing():
    hands, root = swinging()
    walk = np.linspace(0.0, 5.0, len(root), dtype=np.float32)[:, None] * np.array([1.0, 0.0, 0.5], np.float32)
    np.testing.assert_allclose(measured(hands + walk[:, None], root + walk), measured(hands, root), rtol=2e-3)


def test_handedness_is_the_share_of_the_right_hand():
    np.testing.assert_allclose(properties(*swinging(0.1, 0.3))["handedness"], 0.75, atol=1e-5)
    assert properties(*swinging(0.3, 0.0))["handedness"] == 0
    assert jnp.isfinite(measured(*swinging(0.3, 0.0))).all()
