import pytest
from hypothesis import given
from hypothesis import strategies as st

from a2g_jax.io.frame_rate import rate_from_frame_time


@pytest.mark.parametrize(
    ("printed", "rate"),
    [
        ("0.066666667", 15),
        ("0.0666667", 15),
        ("0.0667", 15),
        ("0.03333333333333333", 30),
        ("0.0333333", 30),
        ("0.033333", 30),
        ("0.0333", 30),
        ("0.033", 30),
        (".0333333", 30),
        ("3.33333e-02", 30),
        ("0.0333667", 30000 / 1001),
        ("0.033367", 30000 / 1001),
        ("0.041708", 24000 / 1001),
        ("0.0417", 24),
        ("0.041667", 24),
        ("0.016667", 60),
        ("0.0166667", 60),
        ("0.0166", 60),
        ("0.01668333", 60000 / 1001),
        ("0.008333", 120),
        ("0.0083333", 120),
        ("0.00833", 120),
        ("0.0083", 120),
        ("0.011111", 90),
        ("0.04", 25),
        ("0.01", 100),
        ("0.05", 20),
        ("0.1", 10),
        ("1", 1),
        ("1.0", 1),
        ("0.03", 1 / 0.03),
        ("0.00625", 160),
        ("0.0285714", 35),
        ("0.027", 1 / 0.027),
        ("0.3", 1 / 0.3),
        ("0.08", 12.5),
        ("5", 0.2),
    ],
)
def test_table(printed, rate):
    assert rate_from_frame_time(printed) == pytest.approx(rate, rel=1e-12)


@given(st.integers(1, 1000), st.integers(6, 12))
def test_whole_rates_survive_printing(rate, decimals):
    printed = f"{1 / rate:.{decimals}f}"
    if rate <= 240 or decimals >= 9:
        assert rate_from_frame_time(printed) == rate


@given(st.floats(0.2, 10_000))
def test_any_rate_is_read_within_one_percent_of_a_percent(rate):
    assert rate_from_frame_time(f"{1 / rate:.12f}") == pytest.approx(rate, rel=1.01e-4)
