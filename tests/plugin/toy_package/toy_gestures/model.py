"""The toy model: each frame is linear in the audio, an emotion, a word and the frame before, plus learned noise."""

import jax
import jax.numpy as jnp

from a2g_jax.models.base import Model, Stage, Update

BUCKETS = 16


def build(config, data, sampling):
    """The model's functions for a corpus."""
    rows, width = data.space.shape
    size, classes = rows * width, max(len(data.emotions), 1)
    statistics, channels = data.pose_statistics, config.channels

    def dense(key, before, after):
        return 0.1 * jax.random.normal(key, (before, after))

    def init(key):
        keys = jax.random.split(key, 7)
        return {
            "generator": {
                "audio": dense(keys[0], data.audio_bands, channels),
                "emotion": dense(keys[1], classes, channels),
                "word": dense(keys[2], BUCKETS, channels),
                "before": dense(keys[3], size, channels),
                "out": dense(keys[4], channels, size),
            },
            "discriminator": {"hidden": dense(keys[5], size, channels), "out": dense(keys[6], channels, 1)},
            "spread": {"log_std": jnp.zeros(size)},
        }

    def flat(pose):
        return statistics.normalise(pose).reshape(*pose.shape[:-2], size)

    def hidden(params, audio, emotion, words):
        """Share of the hidden layer that depends on no pose."""
        p = params["generator"]
        spoken = jnp.where((words > 0)[..., None], p["word"][words % BUCKETS], 0.0)
        return audio @ p["audio"] + emotion @ p["emotion"] + spoken

    def frame(params, given, before):
        p = params["generator"]
        return before + jnp.tanh(given + before @ p["before"]) @ p["out"]

    def predicted(params, batch):
        """Each frame after the first, given the true one before it."""
        values = flat(batch.pose)
        emotion = jax.nn.one_hot(batch.emotion, classes)[:, None].repeat(values.shape[1], axis=1)
        given = hidden(params, batch.audio, emotion, batch.words)
        return frame(params, given[:, 1:], values[:, :-1]), values[:, 1:]

    def judged(params, x):
        p = params["discriminator"]
        return jnp.tanh(x @ p["hidden"]) @ p["out"]

    def discriminator_loss(params, key, batch, step):
        del key, step
        made, true = predicted(params, batch)
        loss = jnp.mean((judged(params, true) - 1.0) ** 2) + jnp.mean(judged(params, made) ** 2)
        return loss, {"discriminator": loss}

    def generator_loss(params, key, batch, step):
        del key, step
        made, true = predicted(params, batch)
        terms = {"value": jnp.mean(jnp.abs(made - true)), "fooled": jnp.mean((judged(params, made) - 1.0) ** 2)}
        return terms["value"] + 0.1 * terms["fooled"], terms

    def spread_loss(params, key, batch, step):
        del key
        made, true = predicted(params, batch)
        log_std = params["spread"]["log_std"][None, None]
        loss = jnp.mean(0.5 * ((true - made) * jnp.exp(-log_std)) ** 2 + log_std)
        return loss, {"spread": loss, "stage_step": step.astype(jnp.float32)}

    def condition(params, summary, given):
        del summary
        frames = given.audio.shape[0]
        emotion = jnp.full((frames, classes), 1.0 / classes) if given.emotion is None else given.emotion
        words = jnp.zeros(frames, jnp.int32) if given.words is None else given.words
        return hidden(params, given.audio, emotion, words)

    def begin(params, summary, key, seed_poses=None):
        del params, summary, key
        return jnp.zeros(size) if seed_poses is None else flat(seed_poses)[-1]

    def proceed(params, summary, key, given, start, state):
        del summary
        keys = jax.vmap(lambda n: jax.random.fold_in(key, n.astype(jnp.uint32)))(start + jnp.arange(given.shape[0]))
        noise = jax.vmap(lambda k: jax.random.normal(k, (size,)))(keys)

        def one(before, now):
            hidden_now, drawn = now
            x = (
                frame(params, hidden_now, before)
                + 0.1 * sampling.amplitude * jnp.exp(params["spread"]["log_std"]) * drawn
            )
            return 0.9 * x, x

        state, x = jax.lax.scan(one, state, (given, noise))
        return statistics.denormalise(x.reshape(-1, rows, width)), state

    def sample(params, summary, key, given, start):
        return proceed(params, summary, key, given, start, begin(params, summary, key))[0]

    def summarise(params, key, batch):
        del params, key
        return {"first": flat(batch.pose)[:, 0]}

    return Model(
        "toy",
        config,
        config.clip_frames,
        1,
        init,
        (
            Stage(
                (
                    Update(discriminator_loss, ("discriminator",), "discriminator"),
                    Update(generator_loss, ("generator",), "generator"),
                ),
                "gan",
            ),
            Stage((Update(spread_loss, ("spread",)),), "spread", steps=config.spread_steps),
        ),
        summarise,
        batch_fields=("audio", "pose", "emotion", "words"),
        condition=condition,
        condition_fields=("audio", "emotion", "words", "seed_poses"),
        sample=sample,
        begin=begin,
        proceed=proceed,
        seed_frames=config.seed_frames,
    )
