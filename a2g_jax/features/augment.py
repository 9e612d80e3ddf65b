"""Data augmentation of log-mel features: other microphones, rooms and background noise."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key, Scalar


def augment_log_mel(
    key: Key[Array, ""], decibels: Float[Array, "T bands"], strength: float | Float[Scalar, ""] = 1.0
) -> Float[Array, "T bands"]:
    """A clip with random gain, equaliser and background noise, as from another microphone in another room.

    All of them are drawn once for the clip and constant in time, so the rhythm stays the same.

    Args:
        strength: 0 for no change; 1 for a gain of +-3 dB, an equaliser of three smooth bumps of +-6 dB with a tilt of
            +-6 dB, and noise of up to 15 dB above the clip's floor.
    """
    gain_key, tilt_key, bump_key, noise_key, colour_key = jax.random.split(key, 5)
    bands = decibels.shape[1]
    place = jnp.linspace(-1.0, 1.0, bands)
    gain = 3.0 * jax.random.uniform(gain_key, minval=-1.0)
    tilt = 6.0 * jax.random.uniform(tilt_key, minval=-1.0) * place
    waves = jnp.stack([jnp.cos(jnp.pi * n * place) for n in (1, 2, 3)])
    bumps = 2.0 * jax.random.uniform(bump_key, (3,), minval=-1.0) @ waves
    changed = decibels + strength * (gain + tilt + bumps)[None]
    # Noise is added to power, not to decibels.
    floor = jnp.min(decibels) + strength * 15.0 * jax.random.uniform(noise_key)
    colour = 4.0 * strength * jax.random.uniform(colour_key, minval=-1.0) * place
    return (
        10.0
        / jnp.log(10.0)
        * jnp.logaddexp(
            changed * (jnp.log(10.0) / 10.0),
            jnp.broadcast_to((floor + colour)[None], changed.shape) * (jnp.log(10.0) / 10.0),
        )
    )
