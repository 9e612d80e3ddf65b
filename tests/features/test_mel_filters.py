"""Filters and windows equal librosa's and SciPy's to the last bit, so that features do not change."""

import numpy as np
import pytest
from scipy import signal

from a2g_jax.features.mel_filters import hann, mel_edges, mel_filters


@pytest.mark.parametrize(
    "settings",
    [
        (16000, 2048, 64, 0.0, None),
        (16000, 1024, 128, 0.0, None),
        (16000, 2048, 27, 0.0, None),
        (22050, 2048, 128, 20.0, 8000.0),
        (48000, 4096, 80, 0.0, None),
        (16000, 1024, 64, 500.0, 4000.0),
    ],
)
def test_filters_are_those_of_librosa(settings):
    librosa = pytest.importorskip("librosa")
    rate, window, bands, low, high = settings
    expected = librosa.filters.mel(sr=rate, n_fft=window, n_mels=bands, fmin=low, fmax=high).astype(np.float32)
    np.testing.assert_array_equal(mel_filters(*settings), expected)


@pytest.mark.parametrize("size", [2, 32, 333, 400, 512, 640, 1024, 2048, 4096])
def test_windows_are_those_of_scipy(size):
    np.testing.assert_array_equal(hann(size), signal.get_window("hann", size).astype(np.float32))


def test_edges_rise_and_end_where_asked():
    edges = mel_edges(64, 50.0, 7600.0)
    assert edges[[0, -1]] == pytest.approx([50.0, 7600.0])
    assert np.all(np.diff(edges) > 0)
