"""Phones of the invented language: duration, articulation and level.

Vowel formants are averages of men's vowels in the manner of Peterson & Barney 1952; consonants have an F2 locus and a
slope of the locus equation F2(onset) = slope * F2(vowel) + (1 - slope) * locus (Sussman, McCaffrey & Matthews 1991).
Frequencies are for a tract of 17.5 cm; levels are in dB relative to a full open vowel.
"""

from dataclasses import dataclass

SILENT = -48.0
"""Level of an absent source, dB relative to a full vowel: where fades start and end."""


@dataclass(frozen=True)
class Phone:
    """One sound."""

    symbol: str
    kind: str
    """'vowel', 'nasal', 'approximant', 'fricative', 'plosive' or 'affricate'."""
    spelling: str
    seconds: float
    """Duration at a neutral rate, unstressed, in the middle of a phrase."""
    elasticity: float
    """Its share in a syllable's stretch: 1 follows it, 0 keeps its duration."""
    targets: tuple[tuple[float, float, float], ...]
    """F1, F2, F3 in Hz; two rows for a diphthong. For consonants F2 is the locus."""
    slope: float = 1.0
    """Locus equation's slope: 0 keeps the locus, 1 takes over the vowel's F2. Consonants only."""
    voiced_db: float = 0.0
    """Level of the voiced sound; :data:`SILENT` for voiceless phones; the voice bar for voiced plosives."""
    noise_db: float = SILENT
    """Level of frication noise (the burst of plosives)."""
    noise_hz: float = 4000.0
    """Centre of the frication noise, Hz."""
    noise_width_hz: float = 2000.0
    """Half-width of the frication noise, Hz."""
    aspiration_db: float = SILENT
    """Level of noise at the glottis, through the formants (h, and plosives after their burst)."""
    nasal_zero_hz: float = 0.0
    """Antiformant of a nasal, Hz; 0 for oral phones."""

    @property
    def is_vowel(self) -> bool:
        """Whether it can be a syllable's nucleus."""
        return self.kind == "vowel"


def _vowel(symbol: str, spelling: str, seconds: float, level: float, *targets: tuple[float, float, float]) -> Phone:
    return Phone(symbol, "vowel", spelling, seconds, 1.0, targets, voiced_db=level)


_A, _E, _I = (730.0, 1190.0, 2440.0), (500.0, 1840.0, 2480.0), (285.0, 2250.0, 2980.0)
_O, _U, _SCHWA = (510.0, 880.0, 2410.0), (310.0, 900.0, 2240.0), (490.0, 1450.0, 2450.0)

NEUTRAL_VOWEL = _SCHWA
"""Formants of the neutral vowel, Hz: unstressed vowels move towards it."""

_NASAL = {"elasticity": 0.6, "voiced_db": -9.0}
_GLIDE = {"elasticity": 0.6, "voiced_db": -7.0}

PHONES: dict[str, Phone] = {
    phone.symbol: phone
    for phone in (
        _vowel("a", "a", 0.100, 0.0, _A),
        _vowel("e", "e", 0.092, -1.0, _E),
        _vowel("i", "i", 0.082, -3.0, _I),
        _vowel("o", "o", 0.094, -1.0, _O),
        _vowel("u", "u", 0.082, -3.0, _U),
        _vowel("@", "e", 0.060, -2.5, _SCHWA),
        _vowel("ai", "ai", 0.135, 0.0, (720.0, 1250.0, 2450.0), (360.0, 2000.0, 2600.0)),
        _vowel("au", "au", 0.135, 0.0, (730.0, 1300.0, 2450.0), (400.0, 950.0, 2350.0)),
        _vowel("ei", "ei", 0.125, -1.0, (500.0, 1800.0, 2500.0), (320.0, 2180.0, 2800.0)),
        _vowel("ou", "ou", 0.125, -1.0, (530.0, 1050.0, 2400.0), (350.0, 860.0, 2300.0)),
        _vowel("oi", "oi", 0.130, -0.5, (520.0, 900.0, 2400.0), (350.0, 2000.0, 2600.0)),
        Phone("m", "nasal", "m", 0.062, targets=((270.0, 1000.0, 2150.0),), slope=0.5, nasal_zero_hz=900.0, **_NASAL),
        Phone("n", "nasal", "n", 0.056, targets=((270.0, 1600.0, 2600.0),), slope=0.3, nasal_zero_hz=1500.0, **_NASAL),
        Phone("N", "nasal", "ng", 0.062, targets=((270.0, 1900.0, 2300.0),), slope=0.6, nasal_zero_hz=2900.0, **_NASAL),
        Phone("l", "approximant", "l", 0.058, targets=((360.0, 1200.0, 2700.0),), slope=0.35, **_GLIDE),
        Phone("r", "approximant", "r", 0.055, targets=((400.0, 1250.0, 1700.0),), slope=0.3, **_GLIDE),
        Phone("j", "approximant", "y", 0.058, targets=((285.0, 2150.0, 2950.0),), slope=0.1, **_GLIDE),
        Phone("w", "approximant", "w", 0.060, targets=((310.0, 700.0, 2200.0),), slope=0.1, **_GLIDE),
        Phone("f", "fricative", "f", 0.085, 0.6, ((340.0, 1000.0, 2150.0),), 0.6, SILENT, -20.0, 6500.0, 5000.0),
        Phone("s", "fricative", "s", 0.100, 0.6, ((320.0, 1600.0, 2600.0),), 0.3, SILENT, -10.0, 6200.0, 1300.0),
        Phone("S", "fricative", "sh", 0.105, 0.6, ((300.0, 1800.0, 2400.0),), 0.3, SILENT, -8.0, 3300.0, 900.0),
        Phone("T", "fricative", "th", 0.080, 0.6, ((320.0, 1400.0, 2500.0),), 0.4, SILENT, -21.0, 6800.0, 4000.0),
        Phone("h", "fricative", "h", 0.060, 0.6, ((500.0, 1500.0, 2500.0),), 1.0, SILENT, aspiration_db=-14.0),
        Phone("v", "fricative", "v", 0.060, 0.6, ((300.0, 1000.0, 2150.0),), 0.6, -10.0, -25.0, 6000.0, 5000.0),
        Phone("z", "fricative", "z", 0.075, 0.6, ((280.0, 1600.0, 2600.0),), 0.3, -11.0, -17.0, 6200.0, 1400.0),
        Phone("p", "plosive", "p", 0.088, 0.5, ((300.0, 900.0, 2100.0),), 0.7, SILENT, -20.0, 1200.0, 1800.0, -20.0),
        Phone("t", "plosive", "t", 0.082, 0.5, ((300.0, 1800.0, 2700.0),), 0.3, SILENT, -14.0, 4800.0, 2000.0, -19.0),
        Phone("k", "plosive", "k", 0.090, 0.5, ((300.0, 1700.0, 2200.0),), 0.8, SILENT, -13.0, 2100.0, 900.0, -18.0),
        Phone("b", "plosive", "b", 0.066, 0.5, ((220.0, 850.0, 2100.0),), 0.8, -15.0, -26.0, 1000.0, 1500.0),
        Phone("d", "plosive", "d", 0.060, 0.5, ((220.0, 1800.0, 2650.0),), 0.4, -15.0, -20.0, 4300.0, 2000.0),
        Phone("g", "plosive", "g", 0.066, 0.5, ((220.0, 1700.0, 2150.0),), 0.8, -15.0, -19.0, 2000.0, 900.0),
        Phone("tS", "affricate", "ch", 0.120, 0.6, ((300.0, 1800.0, 2450.0),), 0.3, SILENT, -9.0, 3500.0, 1100.0),
        Phone("dZ", "affricate", "dj", 0.100, 0.6, ((260.0, 1800.0, 2450.0),), 0.3, -16.0, -14.0, 3500.0, 1100.0),
    )
}
"""All phones by symbol."""
