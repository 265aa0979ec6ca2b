import dataclasses
import io

from rich.console import Console

from identification.report import fit_summary
from identification.result.reference import read_reference
from identification.result.result import Unfitted
from tests.identification.made_result import with_unknown
from vibrojax.data_files import data_path


def printed(result, width=140, **options):
    stream = io.StringIO()
    Console(file=stream, width=width, force_terminal=False).print(fit_summary(result, **options))
    return stream.getvalue()


def test_what_an_experimenter_needs_is_there(good):
    text = printed(good)
    for piece in (
        "explains the records",
        "2.0000e6",
        "0.0020e6",
        "0.10 %",
        "1.9960 … 2.0040e6",
        "N/mⁿ",
        "lambda_i",
        "s/m",
        "ok",
    ):
        assert piece in text
    assert "derived: k = 710.60 ± 0.50 N/m" in text
    assert "correlations above 0.1: n–kᵢ +0.999" in text
    assert "cart1.csv" in text


def test_a_missing_error_has_its_reason_and_brackets_are_no_markup(good, poor):
    assert "ζ: not identifiable from these records: nothing <moves> it" in printed(with_unknown(good, "zeta"))
    assert "drop.csv: impact_force: one <odd> sample" in printed(poor)


def test_windows_that_were_not_fitted_are_stated_with_those_that_failed(good):
    rest = Unfitted(windows=12, failed=0, samples=9000, chi2_reduced=1.04, of_fitted=0.99)
    said = (
        "12 windows that were not fitted are predicted with a median chi-square of 1.04 (0.990 in the fitted ones), with nothing but their "
    )
    assert f"{said}initial states estimated." in printed(dataclasses.replace(good, unfitted=rest), width=200)
    rest = dataclasses.replace(rest, failed=1)
    assert "states estimated; 1 could not be integrated." in printed(dataclasses.replace(good, unfitted=rest), width=200)
    assert "not fitted are" not in printed(good)


def test_it_stands_beside_a_reference(good):
    text = printed(good, reference=read_reference(data_path("thesis", "figure_3_3.toml")))
    assert "figure 3.3" in text
    assert "2.1e8" in text
    assert "ζ, fₙ and k: no reference value" in text


def test_a_narrow_terminal_loses_no_number(good):
    text = printed(good, width=80)
    assert max(map(len, text.splitlines())) <= 80
    for piece in ("2.0000e6", "1.9960 …", "2.0040e6", "cart-excitation", "hammer displacement"):
        assert piece in text
