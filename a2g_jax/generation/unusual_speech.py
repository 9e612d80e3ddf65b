"""What of a speech lies outside the speech that a run was trained on."""

from typing import Any

from a2g_jax.features.speech_range import Outside
from a2g_jax.generation.generator import speech_at_rate
from a2g_jax.training.run import Run


def unusual_speech(run: Run, audio: Any, sample_rate: int | None = None) -> tuple[Outside, ...]:
    """Figures of a speech outside the range of a run's training speech, such as its pitch; none for usual speech.

    The figures are pitch, level variation, rate of syllables, balance and change of the spectrum, and its distance
    from the mean spectrum, each as the median over windows of six seconds; the range goes from the 0.1st to the 99.9th
    percentile of the training speech's windows, with a margin of a tenth of its width (of pitch, a semitone).

    Example:
        >>> import a2g_jax
        >>> run, speech = a2g_jax.demo_run(), a2g_jax.talk(8.0, seed=1).audio
        >>> a2g_jax.unusual_speech(run, speech)
        ()
        >>> [one.figure for one in a2g_jax.unusual_speech(run, speech, 32000)]  # at twice its pitch
        ['pitch', 'spectrum']

    Args:
        run: without ``speech.json`` in its folder nothing is outside.
        audio: (N,), mono.
        sample_rate: of the audio, Hz; None for the run's own.

    Raises:
        InputError: the audio has several channels.
    """
    config = run.config
    if config.speech_range is None:
        return ()
    audio = speech_at_rate(run, audio, sample_rate)
    return config.speech_range.outside(audio, config.mel, config.fps)
