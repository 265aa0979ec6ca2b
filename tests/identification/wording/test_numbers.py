import math

import pytest

from identification.wording.names import prose_html, symbol_html, symbol_text
from identification.wording.numbers import percent, rounded, significant, unit_text

VALUES = [
    (1234567.0, 1234.0, "(1.2346 ± 0.0012) × 10⁶"),
    (2.1e8, 3.3e5, "(2.1000 ± 0.0033) × 10⁸"),
    (1.6, 1e-5, "1.600000 ± 0.000010"),
    (12.3456, 0.0996, "12.35 ± 0.10"),
    (12345.0, 130.0, "12340 ± 130"),
    (-0.00012, 3e-5, "(−1.20 ± 0.30) × 10⁻⁴"),
    (-0.001, 1.0, "0.0 ± 1.0"),
    (0.0, 0.01, "0.000 ± 0.010"),
    (5e-7, 2e-4, "(0.0 ± 2.0) × 10⁻⁴"),
    (0.5, None, "0.5"),
    (1e6, None, "1 × 10⁶"),
    (-2.5, math.nan, "−2.5"),
    (math.nan, 1.0, "–"),
    (math.inf, None, "–"),
]


@pytest.mark.parametrize(("value", "error", "text"), VALUES)
def test_as_many_digits_as_the_error_warrants(value, error, text):
    assert rounded(value, error).text == text


def test_the_ends_of_an_interval_are_rounded_like_the_value():
    shown = rounded(1234567.0, 1234.0)
    assert (shown.alike(1232148.0), shown.alike(math.inf)) == ("1.2321", "–")


@pytest.mark.parametrize(
    ("number", "text"),
    [(0.0123456, "0.0123"), (123456.0, "1.23 × 10⁵"), (9.999, "10.0"), (0.0, "0"), (1e-9, "1.00 × 10⁻⁹"), (None, "–"), (math.nan, "–")],
)
def test_significant_digits(number, text):
    assert significant(number) == text


def test_shares_units_and_symbols():
    assert (percent(0.01, 3.0), percent(None, 3.0), percent(0.1, 0.0)) == ("0.33 %", "–", "–")
    assert [unit_text(u) for u in ("N/m^n", "m/s^2", "1", "Hz", "s m^(n-n_2-1)")] == ["N/mⁿ", "m/s²", "", "Hz", "s m^(n-n_2-1)"]
    assert [symbol_text(s) for s in ("λ_i", "f_n", "ζ", "e_long")] == ["λᵢ", "fₙ", "ζ", "e_long"]
    assert str(symbol_html("<_i")) == "<i>&lt;</i><sub>i</sub>"
    assert str(symbol_html("<")) == "<i>&lt;</i>"


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ("f_n will not (k_3 = 2)", "<i>f</i><sub>n</sub> will not (<i>k</i><sub>3</sub> = 2)"),
        ("gap_b and d_ad.", "<i>gap</i><sub>b</sub> and <i>d</i><sub>ad</sub>."),
        ("second_mode in a_1.csv <b>", "second_mode in a_1.csv &lt;b&gt;"),
        ("run.k_3 of time_offset", "run.k_3 of time_offset"),
        ("m_2-low.csv, f_n/a.csv, low-k_i.csv and x_2 b.csv", "m_2-low.csv, f_n/a.csv, low-k_i.csv and x_2 b.csv"),
        ("a stop at u_stop = 28 mm", "a stop at <i>u</i><sub>stop</sub> = 28 mm"),
    ],
)
def test_symbols_in_a_sentence_have_lowered_indices_and_names_of_files_and_effects_have_not(said, shown):
    assert str(prose_html(said)) == shown
