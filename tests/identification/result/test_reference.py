import tomllib

import pytest

from identification.result.reference import ABSENT, check_reference, compare, read_reference, unmatched
from tests.identification.made_result import made_result, with_unknown
from vibrojax.data_files import data_path
from vibrojax.errors import InputError

ROW = 'name = "k_i"\nsymbol = "k_i"\nvalue = 1.9e6\nunit = "N/m^n"\nsource = "figure 1"\n'
THESIS = sorted(data_path("thesis").glob("*.toml"))


@pytest.fixture(scope="module")
def result():
    return made_result(samples=300)


def written(tmp_path, *rows, head='schema = 1\ntitle = "test"\n'):
    path = tmp_path / "reference.toml"
    path.write_text(head + "".join(f"[[value]]\n{row}\n" for row in rows), encoding="utf-8")
    return path


def test_differences_in_sigma_and_per_cent(result, tmp_path):
    other = ROW.replace("k_i", "lambda_i").replace("N/m^n", "s/m").replace("1.9e6", "0.5\nstderr = 0.03")
    by_name = {row.name: row for row in compare(result, read_reference(written(tmp_path, ROW, other)))}
    assert list(by_name) == ["k_i", "n", "lambda_i", "zeta", "f_n", "k", "m"]
    assert by_name["k_i"].sigmas == pytest.approx(1e5 / 2e3)
    assert by_name["k_i"].percent == pytest.approx(100 / 19)
    assert by_name["lambda_i"].sigmas == pytest.approx(-0.1 / (0.03**2 + 4e-4**2) ** 0.5)
    assert (by_name["n"].reference, by_name["n"].sigmas, by_name["n"].remark) == (None, None, "no reference value")


def test_without_a_standard_error_there_is_no_sigma(result, tmp_path):
    row = compare(with_unknown(result, "k_i"), read_reference(written(tmp_path, ROW)))[0]
    assert (row.stderr, row.sigmas) == (None, None)
    assert row.percent == pytest.approx(100 / 19)


def test_a_value_that_is_known_to_exist_but_not_known(result, tmp_path):
    row = compare(result, read_reference(written(tmp_path, ROW.replace("1.9e6", f'"{ABSENT}"').replace("N/m^n", "N/m"))))[0]
    assert row.reference is None
    assert row.remark == "no reference value: figure 1 is not known here"


def test_rows_that_are_no_number_of_the_fit_are_reported(result, tmp_path):
    reference = read_reference(written(tmp_path, ROW, ROW.replace("k_i", "k_1")))
    assert unmatched(compare(result, reference), reference) == ("k_1",)


MALFORMED = [
    ((ROW.replace("figure 1", "\\u001b[31m"),), r"source in value 1 of reference.toml is '\\x1b\[31m': expected printable"),
    ((ROW.replace("figure 1", "\\u202eno"),), r"source in value 1 of reference.toml is '\\u202eno': expected printable"),
    ((ROW.replace("1.9e6", '"unknown"'),), "value in value 1 of reference.toml is 'unknown': expected a number"),
    ((ROW.replace("1.9e6", "nan"),), "value in value 1 .*finite"),
    ((ROW.replace("1.9e6", "true"),), "value in value 1"),
    ((ROW.replace("unit", "unti"),), "unknown key 'unti' in value 1 of reference.toml: did you mean 'unit'"),
    ((ROW.replace('source = "figure 1"', ""),), "source is missing in value 1"),
    ((ROW + "stderr = 0\n",), "stderr in value 1"),
    ((ROW, ROW), "gives 'k_i' twice"),
    ((), "holds no reference value"),
]


@pytest.mark.parametrize(("rows", "message"), MALFORMED)
def test_a_malformed_table_gives_one_clear_line(rows, message, tmp_path):
    with pytest.raises(InputError, match=message) as caught:
        read_reference(written(tmp_path, *rows))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ('schema = 2\ntitle = "test"\n', "schema in reference.toml is 2: expected 1"),
        ("schema = 1\n", "title is missing"),
        ('schema = 1\ntitle = "test"\nvalues = 3\n', "unknown key 'values'"),
        ('schema = 1\ntitle = "test"\nvalue = 3\n', "holds no reference value|not valid TOML"),
        ("schema = \n", "not valid TOML"),
    ],
)
def test_a_malformed_head_gives_one_clear_line(head, message, tmp_path):
    with pytest.raises(InputError, match=message):
        read_reference(written(tmp_path, *(() if "value = 3" in head else (ROW,)), head=head))


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_reference(tmp_path / "none.toml")


def test_another_unit_is_refused(result, tmp_path):
    reference = read_reference(written(tmp_path, ROW.replace("N/m^n", "kN/m")))
    with pytest.raises(InputError, match=r"reference.toml gives k_i in 'kN/m': expected 'N/m\^n'; convert it"):
        compare(result, reference)


def test_a_table_without_any_parameter_is_refused(tmp_path):
    reference = read_reference(written(tmp_path, ROW.replace("k_i", "speed")))
    with pytest.raises(InputError, match="no row for any parameter of this fit: expected names among k_i, n"):
        check_reference(reference, {"k_i": "N/m^n", "n": "1"})


def test_the_one_full_set_of_the_thesis_compares_with_a_fit(result):
    rows = {row.name: row.reference for row in compare(result, read_reference(data_path("thesis", "figure_3_3.toml")))}
    assert {name: value for name, value in rows.items() if value is not None} == {"k_i": 2.1e8, "n": 1.6, "lambda_i": 0.6, "m": 2.0}


@pytest.mark.parametrize("path", THESIS, ids=lambda path: path.stem)
def test_every_thesis_file_reads(path):
    assert read_reference(path).values


def test_no_number_stands_for_a_table_of_the_thesis():
    tables = [path for path in THESIS if path.stem.startswith("table_")]
    assert [path.stem for path in tables] == [f"table_{n}" for n in ("2_1", "2_2", "2_3", "2_4", "2_5", "3_1", "3_2", "3_3")]
    assert all(row.value is None for path in tables for row in read_reference(path).values)
    known = [row for path in THESIS if path not in tables for row in read_reference(path).values]
    assert not [row for row in known if "table" in row.source]
    assert all(row.value is not None for row in known)


SECTIONS = {
    "figure_3_3": "figure_3_3",
    "notation": "notation",
    "rig_wires": "rig_wires",
    "rig_beam": "rig_beam",
    "frank_jr": "drilling_rig",
}


def numbers(facts):
    if isinstance(facts, dict):
        return set().union(*(numbers(value) for value in facts.values()))
    if isinstance(facts, list):
        return set().union(*(numbers(value) for value in facts))
    return {float(facts)} if isinstance(facts, int | float) else set()


@pytest.mark.parametrize("section", SECTIONS)
def test_every_number_that_the_front_matter_states_is_here(section, shared):
    facts = tomllib.loads((shared / "thesis" / "facts.toml").read_text(encoding="utf-8"))
    assert set(facts) == set(SECTIONS) | {"not_in_the_seed"}
    here = {row.value for row in read_reference(data_path("thesis", f"{SECTIONS[section]}.toml")).values}
    assert numbers(facts[section]) <= here
