"""Spectra of the voice source and of the vocal tract, as functions of frequency.

Resonators are second-order sections with unit gain at zero frequency (Fant 1960; Klatt 1980):
``1 / (1 - (f/F)^2 + j f B / F^2)``. The glottal source is the anticausal resonance of Doval, d'Alessandro & Henrich
2003 followed by a spectral slope.
"""

import numpy as np
from jaxtyping import Complex, Float

_UPPER_HZ = (3450.0, 4450.0, 5500.0, 6500.0, 7500.0)  # F4 to F8 of a 17.5 cm tract
_HIGHER_POLES_DB = 6.0  # at 4 kHz
_TOP_HZ = 8000.0  # between F8 and F9: no single pole is modelled above it
_TOP_SLOPE_DB = -6.0  # dB/octave of the tract above it
_RIPPLE_DB = 5.0
_UPPER_WIDTH_HZ = (200.0, 260.0, 350.0, 450.0, 550.0)


def resonance(
    frequency: Float[np.ndarray, " F"], centre: Float[np.ndarray, " P"], width: Float[np.ndarray, " P"]
) -> Complex[np.ndarray, "P F"]:
    """Denominator of a resonator, which is the response of an antiresonator; all arguments in Hz."""
    ratio = frequency[None, :] / centre[:, None]
    response = np.empty(ratio.shape, np.complex64)
    response.real = 1.0 - ratio * ratio
    response.imag = ratio * (width / centre)[:, None]
    return response


def upper_formants(frequency: Float[np.ndarray, " F"], tract_length: float) -> Complex[np.ndarray, " F"]:
    """Response of the formants that do not move, F4 and up; above 8 kHz one ripple for each 1000 Hz of the tube."""
    centre = np.array(_UPPER_HZ, np.float32) / np.float32(tract_length)
    width = np.array(_UPPER_WIDTH_HZ, np.float32)
    # Stands for the poles above F8, whose skirts lift what lies below them (Fant's higher-pole correction).
    lift = 10.0 ** (_HIGHER_POLES_DB * (np.minimum(frequency, 8000.0) * tract_length / 4000.0) ** 2 / 20.0)
    modelled = np.minimum(frequency, _TOP_HZ / tract_length)
    response = lift / resonance(modelled.astype(np.float32), centre, width).prod(axis=0)
    above = frequency > _TOP_HZ / tract_length
    if above.any():
        ratio = frequency[above] * np.float32(tract_length / _TOP_HZ)
        # F1 to F3 fall by 36 dB/octave above it; the poles beyond F8 compensate for that and add ripples.
        ripple = 10.0 ** (_RIPPLE_DB / 20.0 * np.sin(np.pi * (ratio - 1.0) * _TOP_HZ / 1000.0) ** 2)
        response[above] *= ratio ** (6.0 + _TOP_SLOPE_DB / (20.0 * np.log10(2.0))) * ripple
    return response


def tract_response(
    frequency: Float[np.ndarray, " F"],
    formants: Float[np.ndarray, "P 3"],
    nasal: Float[np.ndarray, " P"],
    nasal_zero: Float[np.ndarray, " P"],
    upper: Complex[np.ndarray, " F"],
) -> Complex[np.ndarray, "P F"]:
    """Response from glottis to lips at P moments. Nasality adds a pole at 270 Hz and a zero, and widens formants."""
    damping = 1.0 + 0.8 * nasal
    widths = (60.0 + 0.06 * formants[:, 0], 55.0 + 0.02 * formants[:, 1], 70.0 + 0.03 * formants[:, 2])
    response = resonance(frequency, formants[:, 0], widths[0] * damping)
    for index in (1, 2):
        response *= resonance(frequency, formants[:, index], widths[index] * damping)
    rows = np.flatnonzero(nasal > 0.02)
    np.reciprocal(response, out=response)
    if len(rows):
        pole = np.full(len(rows), 270.0, np.float32)
        zero = pole + nasal[rows] * (nasal_zero[rows] - pole)
        pair = resonance(frequency, zero, 0.1 * zero + 60.0) / resonance(frequency, pole, pole * 0 + 100.0)
        response[rows] *= pair
    response *= upper[None, :]
    return response


def glottal_spectrum(
    frequency: Float[np.ndarray, " F"], f0: Float[np.ndarray, " P"], tilt: Float[np.ndarray, " P"]
) -> Complex[np.ndarray, "P F"]:
    """Spectrum of one pulse of glottal flow derivative; ``tilt`` is its slope above 500 Hz in dB/octave."""
    centre = 1.6 * f0
    spectrum = np.conj(1.0 / resonance(frequency, centre, 1.1 * centre))
    spectrum *= 1j * frequency[None, :] / centre[:, None]
    # The resonance alone falls by 6 dB/octave.
    octaves = np.log2(np.maximum(frequency, 500.0) / 500.0).astype(np.float32)
    # Below 80 Hz neither lips nor microphones pass much.
    spectrum *= frequency**2 / (frequency**2 + 80.0**2)
    extra = (tilt + 6.0) * np.float32(np.log(10.0) / 20.0)
    spectrum *= np.exp(extra[:, None] * octaves[None, :])
    return spectrum


def noise_spectrum(
    frequency: Float[np.ndarray, " F"], centre: Float[np.ndarray, " P"], width: Float[np.ndarray, " P"]
) -> Float[np.ndarray, "P F"]:
    """Magnitude of frication noise: one hump that falls off slowly, with little below it."""
    offset = (frequency[None, :] - centre[:, None]) / width[:, None]
    steepness = np.where(offset < 0.0, 1.3, 0.75).astype(np.float32)
    low = frequency[None, :] / (frequency[None, :] + 0.15 * centre[:, None])
    high = 1.0 / (1.0 + (frequency[None, :] / np.float32(14000.0)) ** 4)
    return low * high * ((1.0 + offset * offset) ** -steepness + 0.02)
