"""EmotionGesture: size, independence of samples, what emotions do, and the settings that are refused.

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
from a2g_jax.models.emotion_gesture.model import build
from a2g_jax.models.emotion_gesture.networks import Networks
from a2g_jax.models.emotion_gesture.objective import generate
from a2g_jax.models.emotion_gesture.sampling import EmotionGestureSampling
from a2g_jax.models.registry import find_model
from a2g_jax.training.stages import stage_spans

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
