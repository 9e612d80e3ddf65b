"""Hands on a plain path, whose height, speed and radius are known; shares of the way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from a2g_jax.metrics.style import PELVIS, WRISTS, HandStyle, hand_style, share_of_the_way


def circling(radius=0.4, height=0.3, turns_per_second=0.5, fps=30.0, walking=1.0):
    """Both wrists circle about the vertical through a pelvis that walks."""
    angle = 2 * np.pi * turns_per_second * np.arange(120) / fps
    positions = np.zeros((120, 22, 3))
    positions[:, :, 0] = walking * np.arange(120)[:, None] / fps
    positions[:, :, 1] = 0.9
    circle = np.stack([radius * np.cos(angle), np.full(120, height), radius * np.sin(angle)], axis=-1)
    positions[:, WRISTS[0]] += circle
    positions[:, WRISTS[1]] += circle * [-1.0, 1.0, -1.0]
    return positions


def test_hands_that_circle():
    style = hand_style(circling(), 30.0)
    assert style.height == pytest.approx(0.3, abs=1e-5)
    assert style.radius == pytest.approx(0.4, abs=1e-5)
    # A chord of the circle for every frame: next to its arc.
    assert style.speed == pytest.approx(2 * np.pi * 0.5 * 0.4, rel=1e-2)


def test_other_joints_and_other_rates():
    places = circling()[:, [WRISTS[1], PELVIS, WRISTS[0]]]
    same = hand_style(places, 30.0, wrists=(0, 2), pelvis=1)
    np.testing.assert_allclose(same, hand_style(circling(), 30.0), atol=1e-6)
    # Of the same frames shown twice as fast, only the speed is another.
    fast = hand_style(circling(), 60.0)
    np.testing.assert_allclose(fast, np.array(same) * [1.0, 2.0, 1.0], rtol=1e-5)
    assert hand_style(places, 30.0, wrists=(0,), pelvis=1).height == pytest.approx(0.3, abs=1e-5)


def test_one_frame_tells_no_speed():
    with pytest.raises(ValueError, match="2 frames or more; got 1"):
        hand_style(circling()[:1], 30.0)


@given(st.floats(-1.0, 2.0), st.floats(-1.0, 1.0), st.floats(0.1, 2.0))
def test_a_share_is_where_the_made_stand_between(share, start, way):
    source, target = HandStyle(start, 0.2, start), HandStyle(start + way, 0.2, start - way)
    made = HandStyle(*(a + share * (b - a) for a, b in zip(source, target, strict=True)))
    found = share_of_the_way(source, target, made)
    np.testing.assert_allclose([found.height, found.radius], share, atol=1e-9)
    assert np.isnan(found.speed)
