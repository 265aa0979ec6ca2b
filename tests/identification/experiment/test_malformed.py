import pytest

from identification.experiment import ExperimentError, load_experiment
from tests.identification.experiment.malformed import MALFORMED, write_valid


def test_the_undamaged_experiment_is_valid(tmp_path):
    write_valid(tmp_path)
    assert [record.notices for record in load_experiment(tmp_path).records] == [(), ()]


def test_every_case_has_its_own_name():
    assert len({name for name, _, _ in MALFORMED}) == len(MALFORMED) >= 35


@pytest.mark.parametrize(("damage", "message"), [case[1:] for case in MALFORMED], ids=[case[0] for case in MALFORMED])
def test_a_malformed_experiment_gives_one_clear_line(damage, message, tmp_path):
    folder = tmp_path / "rig"
    write_valid(folder)
    damage(folder)
    with pytest.raises(ExperimentError, match=message) as caught:
        load_experiment(folder)
    text = str(caught.value)
    assert "\n" not in text
    assert text.isprintable()
    assert len(text) < 600


@pytest.mark.parametrize("path", ["nowhere", "nowhere/experiment.toml", "zero\0byte"])
def test_a_path_that_leads_nowhere(path, tmp_path):
    with pytest.raises(ExperimentError, match=r"expected an experiment's folder|give an experiment's folder"):
        load_experiment(tmp_path / path)


def test_a_record_is_no_experiment_file(tmp_path):
    write_valid(tmp_path)
    with pytest.raises(ExperimentError, match=r"drop\.csv is not a \.toml file"):
        load_experiment(tmp_path / "drop.csv")
