"""Sampling settings as arguments of generation in Python."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from a2g_jax.errors import InputError
from a2g_jax.generation.generator import Generator
from a2g_jax.talker.recordings import talk
from a2g_jax.training.run import Run

SPEECH = talk(2.0, 5).audio


@pytest.fixture(scope="module")
def generator(toy_run_config):
    """An untrained run of a very small model, which the noise moves."""
    config = toy_run_config()
    params = jax.device_get(config.build().init(jax.random.key(0)))
    codes = np.ones((3, config.model_config.code_channels), np.float32)
    return Generator(Run(config, params, {"specific_mean": codes, "specific_std": codes}, 0), window=128)


def test_settings_are_those_of_a_run_with_them(generator):
    (given,) = generator.generate(SPEECH, 1, noise_scale=0.3)
    config = generator.run.config.with_sampling(noise_scale=0.3)
    (other,) = Generator(replace(generator.run, config=config), window=128).generate(SPEECH, 1)
    (plain,) = generator.generate(SPEECH, 1)
    np.testing.assert_array_equal(given.rotations, other.rotations)
    assert np.abs(given.rotations - plain.rotations).max() > 1e-3


def test_compiled_programs_are_kept_for_the_last_settings(generator):
    first = generator.with_sampling(noise_scale=0.3)
    assert generator.with_sampling(noise_scale=0.3) is first
    assert generator.with_sampling() is generator
    for scale in (0.1, 0.2, 0.4, 0.5):
        generator.with_sampling(noise_scale=scale)
    assert generator.with_sampling(noise_scale=0.3) is not first


def test_lists_and_text_are_settings(generator):
    edited = generator.with_sampling(edits=["shared keep 10"])
    assert edited.run.config.sampling_settings.edits == ("shared keep 10",)
    assert edited is generator.with_sampling(edits=("shared keep 10",))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"loudness": 2.0}, "has no sampling setting 'loudness'"),
        ({"temperature": 0.5}, "has no sampling setting 'temperature'"),
        ({"noise_scale": -1.0}, "--noise-scale: expected 0 or more"),
        ({"emotion": np.zeros((60, 8), np.float32)}, "takes no emotion"),
    ],
)
def test_what_does_not_fit_is_refused(generator, given, message):
    with pytest.raises(InputError, match=message):
        generator.generate(SPEECH, 1, **given)
