"""Settings of EmotionGesture and its presets."""

from dataclasses import dataclass, fields

from a2g_jax.errors import InputError
from a2g_jax.models.train_config import TrainConfig

HEADERS = ("aligned", "channels")
BRANCHES = ("emotion-beat", "none", "label")
POOLS = ("flat", "mean")
SPANS = ("frames", "clip")
PROMPTERS = ("spatial-temporal", "spatial", "predictor", "duplicate", "zero")
PROMPT_SPACES = ("features", "poses")
BEAT_FORMS = ("printed", "words")
DISCRIMINATORS = ("transformer", "patches")
#: Whole numbers that may be 0.
_MAYBE_NONE = ("smoothing", "mining_steps", "vae_steps", "sampled_steps", "continued_chunks")


@dataclass(frozen=True)
class EmotionGestureConfig:
    """Networks and losses; the defaults are the paper's (Sec. III and IV-A), and where it is silent its authors' code.

    Names of the paper's parts stand in brackets.
    """

    channels: int = 512
    """Width of all features (D)."""
    heads: int = 8
    """Heads of attention."""
    hidden: int = 2048
    """Width of the hidden layer after each attention."""
    layers: int = 3
    """Layers of the audio encoder's Transformer, and of the decoder."""
    dropout: float = 0.2
    audio_blocks: tuple[int, ...] = (3, 4, 6)
    """Residual blocks of each stage of the audio encoder."""
    audio_channels: tuple[int, ...] = (32, 64, 128)
    """Channels of each stage."""
    audio_stem: int = 1
    """Stride of its first convolution, in time and frequency."""
    header: str = "aligned"
    """How the audio encoder gets to one row a frame: 'aligned' keeps the spectrogram's time and interpolates it to the
    frames; 'channels' makes a frame of each channel of a convolution, as the authors' code."""
    branches: str = "emotion-beat"
    """'emotion-beat': emotion and beat features (EBM); for ablations 'none': features of the audio as they are, and
    'label': the same with the emotion's label beside them."""
    beat_normalised: bool = False
    """Whether beat features have mean 0 and standard deviation 1 over a clip, so that what is constant in a clip, as
    its emotion, cannot be in them."""
    emotion_span: str = "frames"
    """Whether emotion features are those of each frame, or their mean over the clip at every frame ('clip')."""
    emotion_pool: str = "flat"
    """What the emotion classifier takes: the features of all frames ('flat') or their mean ('mean')."""
    emotion_hidden: tuple[int, ...] = (512, 256, 64)
    """Hidden layers of the emotion classifier."""
    word_width: int = 300
    """Length of word vectors."""
    word_layers: int = 3
    """Blocks of the text encoder; block i reaches ``2 ** (i + 1)`` frames back."""
    word_buckets: int = 16384
    """Rows of the table of word vectors; a word has the row of its hash, and shares it with others."""
    word_vectors: str = ""
    """A text file of pretrained word vectors (word2vec's or fastText's form) that the table begins with; random vectors
    if empty."""
    clip_frames: int = 60
    """Frames of a clip, and of a chunk in generation (N)."""
    seed_frames: int = 10
    """Initial poses of a clip (M)."""
    transition_frames: int = 10
    """Poses on either side of the transition from initial to future poses (L)."""
    prompter: str = "spatial-temporal"
    """How initial poses become a prompt for all frames (STP); for ablations 'spatial' without the temporal
    reinforcement, 'predictor' without the interpolation too, and the initial poses themselves, repeated ('duplicate')
    or followed by zeros ('zero')."""
    prompt_space: str = "features"
    """Whether the prompter works on pose features, as the paper has it, or on poses, as the authors' code."""
    scaled_scores: bool = False
    """Whether the prompter's products are divided by the root of their length (Eq. 3) or by it (Eq. 4): as printed,
    sigmoid and softmax begin saturated."""
    query_positions: bool = False
    """Whether the decoder's queries have a position encoding; without one, zeros are the same query at every frame."""
    query_audio: bool = False
    """Whether the audio's features are added to the decoder's queries of the same frames, beside the attention to all
    of them."""
    hold_seed: bool = False
    """Whether the decoder's output is added to the initial poses, of which the last one is held and fades to the mean
    pose by learned shares."""
    normalise_pose: bool = False
    """Whether networks and losses have poses as z-scores; poses of other kinds than 6D always are."""
    smoothing: int = 0
    """Binomial filters over time that end the decoder."""
    discriminator: str = "transformer"
    """'transformer': of the differences between frames, as published; 'patches': convolutions over joint positions,
    speeds and the audio, with scores for overlapping stretches, given the emotion."""
    discriminator_channels: int = 128
    """Width of the discriminator's layers."""
    discriminator_rate: float = 1.0
    """Its learning rate, relative to the generator's."""
    average_decay: float = 0.0
    """Decay a step of the moving average of the generator's weights over the last stage with a discriminator, whose
    players go round each other; the averages are the run's weights. 0 for the last ones."""
    mismatched: bool = False
    """Whether recorded motion with the audio of another clip counts as false (Reed et al. 2016), so that the
    discriminator judges how motion and audio agree; only with 'patches'."""
    exchange: bool = False
    """Whether the adversarial loss also has motions with the emotion features of another clip of the batch, which the
    discriminator judges with that clip's emotion; only with 'patches' and emotion features."""
    discriminator_layers: int = 2
    discriminator_hidden: tuple[int, ...] = (2048, 1024, 256, 64, 16)
    """Hidden layers after it."""

    reconstruction_weight: float = 100.0
    """Weight of the L1 distance of poses (Eq. 7)."""
    adversarial_weight: float = 1.0
    """Weight of the adversarial loss (Eq. 8); 0 trains without a discriminator."""
    shown_emotion_weight: float = 0.0
    """Weight of the emotion of generated motion as the discriminator classifies it; only with 'patches'."""
    beat_weight: float = 0.05
    """Weight of the beat alignment (Eq. 2), which needs words; 0 trains without them."""
    emotion_weight: float = 0.1
    """Weight of the emotion classification."""
    smooth_weight: float = 0.5
    """Weight of the motion-smooth loss (Eq. 6)."""
    beat_temperature: float = 0.1
    """Temperature of the beat alignment."""
    beat_form: str = "printed"
    """'printed': one logarithm of the sum over a clip's words (Eq. 2), which the best aligned word dominates; 'words':
    the mean over words of InfoNCE."""
    smooth_temperature: float = 10.0
    """Divisor of the true motion's offsets in the motion-smooth loss."""

    mining_steps: int = 0
    """Training steps of the features of audio and text alone, before all others."""
    sampled_steps: int = 0
    """Training steps of the motion with sampled emotion features, after the VAE: with 'exchange', the emotions that the
    discriminator judges are then sampled."""
    continued_chunks: int = 0
    """Chunks that the exchanged motions continue at most, in training with sampled emotion features: their initial
    poses are then those that generation gives itself. 0 begins all with recorded poses."""
    vae_latent: int = 32
    """Length of the emotion-conditioned VAE's latent."""
    vae_channels: int = 40
    vae_steps: int = 30_000
    """Training steps of the emotion-conditioned VAE, after all others; 0 leaves it out."""
    vae_kl_weight: float = 0.003
    """Weight of its KL divergence against the relative squared error."""
    vae_emotion_weight: float = 0.0
    """Weight of the emotion that the classifier finds in features of random latents with a label."""

    def __post_init__(self) -> None:
        for name, known in (
            ("header", HEADERS),
            ("branches", BRANCHES),
            ("emotion_span", SPANS),
            ("emotion_pool", POOLS),
            ("prompter", PROMPTERS),
            ("prompt_space", PROMPT_SPACES),
            ("beat_form", BEAT_FORMS),
            ("discriminator", DISCRIMINATORS),
        ):
            if getattr(self, name) not in known:
                raise _refused(name, f"one of {', '.join(known)}", getattr(self, name))
        for name in ("audio_blocks", "audio_channels", "emotion_hidden", "discriminator_hidden"):
            if not getattr(self, name) or min(getattr(self, name)) < 1:
                raise _refused(name, "numbers above 0 such as 64,128", getattr(self, name))
        if len(self.audio_blocks) != len(self.audio_channels):
            raise _refused("audio_blocks", "as many numbers as --audio-channels has", self.audio_blocks)
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("_weight") and not 0 <= value < float("inf"):
                raise _refused(field.name, "0 or more", value)
            if field.name.endswith("_temperature") and not 0 < value < float("inf"):
                raise _refused(field.name, "a number above 0", value)
            if field.type in (int, "int") and field.name not in _MAYBE_NONE and value < 1:
                raise _refused(field.name, "1 or more", value)
        for name in _MAYBE_NONE:
            if getattr(self, name) < 0:
                raise _refused(name, "0 or more", getattr(self, name))
        if not 0 < self.discriminator_rate < float("inf"):
            raise _refused("discriminator_rate", "a number above 0", self.discriminator_rate)
        for name in ("dropout", "average_decay"):
            if not 0 <= getattr(self, name) < 1:
                raise _refused(name, "0 or more and below 1", getattr(self, name))
        for name in ("channels", "discriminator_channels"):
            if getattr(self, name) % self.heads:
                raise _refused(name, f"a multiple of the {self.heads} --heads", getattr(self, name))
        if self.clip_frames < self.seed_frames + 2:
            raise _refused(
                "clip_frames", f"at least two frames after the {self.seed_frames} seed frames", self.clip_frames
            )
        most = min(self.seed_frames, self.clip_frames - self.seed_frames)
        if not 2 <= self.transition_frames <= most:
            raise _refused("transition_frames", f"a number from 2 to {most}, as --seed-frames", self.transition_frames)

    @property
    def stride(self) -> int:
        """Frames of a chunk after its initial poses."""
        return self.clip_frames - self.seed_frames

    @property
    def mines(self) -> bool:
        """Whether there are emotion and beat features."""
        return self.branches == "emotion-beat"

    @property
    def averages(self) -> bool:
        """Whether the generator's weights are averaged over steps."""
        return self.average_decay > 0 and self.adversarial_weight > 0

    @property
    def trains_sampled(self) -> bool:
        """Whether motion is trained with sampled emotion features."""
        return self.exchanges and self.vae_steps > 0 and self.sampled_steps > 0 and self.adversarial_weight > 0

    @property
    def exchanges(self) -> bool:
        """Whether emotion features are exchanged."""
        return self.exchange and self.mines and self.discriminator == "patches"


def _refused(name: str, expected: str, value: object) -> InputError:
    return InputError(f"--{name.replace('_', '-')}: expected {expected}; got {value}.")


PRESETS: dict[str, EmotionGestureConfig] = {
    "paper": EmotionGestureConfig(),
    "authors": EmotionGestureConfig(header="channels", prompt_space="poses"),
    "tiny": EmotionGestureConfig(
        channels=96,
        heads=4,
        hidden=192,
        layers=2,
        dropout=0.1,
        audio_blocks=(1, 1, 1),
        audio_channels=(8, 16, 32),
        audio_stem=2,
        beat_normalised=True,
        emotion_span="clip",
        emotion_pool="mean",
        emotion_hidden=(64,),
        word_width=64,
        word_buckets=1024,
        scaled_scores=True,
        query_positions=True,
        query_audio=True,
        hold_seed=True,
        normalise_pose=True,
        smoothing=3,
        discriminator="patches",
        discriminator_channels=64,
        average_decay=0.998,
        mismatched=True,
        exchange=True,
        reconstruction_weight=2.5,
        emotion_weight=1.0,
        shown_emotion_weight=0.4,
        beat_form="words",
        beat_weight=0.3,
        mining_steps=3_000,
        vae_steps=600,
        sampled_steps=2_000,
        continued_chunks=7,
        vae_kl_weight=0.01,
        vae_emotion_weight=0.6,
    ),
}

TRAINING_PRESETS: dict[str, TrainConfig] = {
    # 100 epochs of the 38,814 training clips of BEAT.
    "paper": TrainConfig(steps=30_300, batch_size=128, learning_rate=2e-4),
    "authors": TrainConfig(steps=30_300, batch_size=128, learning_rate=2e-4),
    "tiny": TrainConfig(
        steps=2_000,
        batch_size=16,
        learning_rate=5e-4,
        schedule="cosine",
        warmup_steps=100,
        clip_norm=1.0,
        augmentation=1.0,
        checkpoint_every=500,
        validate_every=500,
    ),
}
