import dataclasses
import io

from rich.console import Console

from identification.report import fit_summary
from identification.result.evidence import Unrest
from identification.result.reference import read_reference
from identification.result.result import Horizon
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


def test_the_misfit_is_shared_out_between_force_and_readings(good):
    assert "The whole misfit is put down to errors of the readings" in printed(good, width=200)
    force = Unrest(force_rms=(0.02, 1e-3), memory=(8e-3, 1e-3), share=0.012, reference="the spring's force", gain=40.0)
    text = printed(dataclasses.replace(good, unrest=force, force_share=0.87), width=200)
    assert "Of the squared misfit 87 % goes away with the random force on the hammer; 13 % is errors of the readings" in text
    assert "autocorrelated, order 3" in text


def test_forecasts_are_shown_by_how_far_they_reach(good):
    far = (
        Horizon(periods=0.25, seconds=0.04, nrmse={"impact_force": 0.02}),
        Horizon(periods=None, seconds=0.7, nrmse={"impact_force": 0.3}),
    )
    held = dataclasses.replace(good.records[1], file="last.csv", horizons=far)
    text = printed(dataclasses.replace(good, held_back=(held,)), width=200)
    assert "0.250 period" in text and "all of it" in text and "impact force 30 %" in text


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
