"""How files are built elsewhere: structs, heads of twenty lines, tables without a head, tracked points, shakers."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from identification.experiment import ExperimentError, load_experiment
from identification.inspection import inspect_path, propose

TIME = np.arange(1000) / 2000.0
SWING = 5.0 * np.exp(-2.0 * TIME) * np.cos(30.0 * TIME) + np.random.default_rng(3).normal(0.0, 1e-3, TIME.size)
PUSH = sum(40.0 * np.exp(-(((TIME - at) / 2e-3) ** 2)) for at in (0.1, 0.25, 0.4)) + np.random.default_rng(4).normal(0.0, 0.1, TIME.size)


def rows(*columns, mark=","):
    return "".join(mark.join(f"{value:.6f}" for value in row) + "\n" for row in zip(*columns, strict=True))


def loaded(folder, instead=None):
    text = propose(inspect_path(folder), folder).replace("# mass = 0.4", "mass = 0.4").replace("# gap = 0.0", "gap = 0.001")
    for proposed, other in (instead or {}).items():
        assert proposed in text
        text = text.replace(proposed, other)
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    return load_experiment(folder).records[0]


def test_fields_of_a_matlab_struct_are_columns_by_dotted_name(tmp_path):
    savemat(tmp_path / "a.mat", {"data": {"time": TIME, "laser": {"value": SWING, "unit": "mm"}, "force": PUSH, "note": "x"}, "gain": 2.0})
    text = propose(inspect_path(tmp_path), tmp_path)
    assert 'columns = { hammer_displacement = "data.laser.value", impact_force = "data.force", time = "data.time" }' in text
    assert 'unit = "mm" # as a.mat states' in text
    record = loaded(tmp_path)
    np.testing.assert_allclose(record.channels["hammer_displacement"], 1e-3 * SWING, rtol=1e-12)
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)


def test_groups_in_groups_are_columns_by_dotted_name(tmp_path):
    with h5py.File(tmp_path / "a.mat", "w") as file:
        file["data/time"], file["data/laser"], file["data/cell/force"] = TIME[None], SWING[None], PUSH[None]
        file["data/again"] = file["data"]  # a hard link back to its own group
    record = loaded(tmp_path)
    np.testing.assert_allclose(record.channels["impact_force"], PUSH, rtol=1e-12)
    assert 'impact_force = "cell.force"' in (tmp_path / "experiment.toml").read_text()


def tracked(folder, angle, length=0.5):
    text = "mass_A\t\t\nt\tx\ty\n" + rows(TIME, length * np.sin(angle), -length * np.cos(angle), mark="\t")
    (folder / "a.txt").write_text(text)


def test_a_mark_in_a_tracked_column_leaves_the_angle_out(tmp_path):
    tracked(tmp_path, 1.2 * np.cos(7.0 * TIME))
    loaded(tmp_path)
    settings = tmp_path / "experiment.toml"
    settings.write_text(settings.read_text().replace("[[record]]", "[[record]]\nmissing = -777.0"))
    lines = (tmp_path / "a.txt").read_text().splitlines()
    lines[30] = lines[30].rpartition("\t")[0] + "\t-777"
    (tmp_path / "a.txt").write_text("\n".join(lines) + "\n")
    record = load_experiment(tmp_path).records[0]
    assert np.flatnonzero(np.isnan(record.channels["relative_displacement"])).tolist() == [28]


def test_the_angle_of_a_tracked_bob_is_the_arctangent_of_two_columns(tmp_path):
    angle = 1.2 * np.cos(7.0 * TIME)
    tracked(tmp_path, angle)
    record = loaded(tmp_path)
    assert 'relative_displacement = "atan2(x, -y)"' in (tmp_path / "experiment.toml").read_text()
    np.testing.assert_allclose(record.channels["relative_displacement"], angle, atol=5e-6)
    tracked(tmp_path, 3.0 * angle)  # over the top
    shown = load_experiment(tmp_path).records[0].channels["relative_displacement"]
    np.testing.assert_allclose(shown - shown[0], 3.0 * (angle - angle[0]), atol=1e-5)
    tracked(tmp_path, angle)
    with pytest.raises(ExperimentError, match=r"has no column 'z' for atan2\(x, z\): expected it among t, x, y"):
        loaded(tmp_path, {"atan2(x, -y)": "atan2(x, z)"})


def test_a_point_that_keeps_no_distance_from_the_origin_is_no_bob(tmp_path):
    (tmp_path / "a.txt").write_text("t\tx\ty\n" + rows(TIME, SWING, PUSH, mark="\t"))
    assert "atan2" not in propose(inspect_path(tmp_path), tmp_path)


@pytest.mark.parametrize("name", ["Shaker force (N)", "Stinger load cell (N)", "Erregerkraft (N)", "Exciter [N]", "Drive force (N)"])
def test_the_force_of_a_shaker_drives_and_is_no_impact(name, tmp_path):
    force = 2.0 * np.sin(40.0 * TIME) + np.random.default_rng(5).normal(0.0, 0.01, TIME.size)
    (tmp_path / "a.csv").write_text(f"Time (s),Laser (mm),{name}\n" + rows(TIME, SWING, force))
    text = propose(inspect_path(tmp_path), tmp_path)
    assert 'kind = "forced" # guess: an applied force is recorded and no cart moves' in text
    np.testing.assert_allclose(loaded(tmp_path).channels["applied_force"], force, atol=1e-6)


HEAD = """\
Model,MSO4034
Firmware Version,2.97
,
Point Format,Y,
Horizontal Units,s,
Horizontal Scale,0.004,
Sample Interval,0.0005,
Filter Frequency,5e+08,
Record Length,1000,
Gating,0.0% to 100.0%,
Probe Attenuation,1,1
Vertical Units,V,V
Vertical Offset,0,0
Vertical Scale,0.2,0.5
Label,,
TIME,CH1,CH2
"""


def test_an_oscilloscopes_head_is_passed_over_but_for_its_units(tmp_path):
    (tmp_path / "a.csv").write_text(HEAD + rows(TIME, 0.1 * SWING, 0.01 * PUSH))
    (one,) = inspect_path(tmp_path).files
    assert (one.found.time.name, one.found.time_unit) == ("TIME", "s")
    assert [(column.name, column.unit) for column in one.found.columns] == [("CH1", "V"), ("CH2", "V")]
    assert "for CH1 in V, CH2 in V" in propose(inspect_path(tmp_path), tmp_path)


def test_a_table_without_a_head_has_numbered_columns(tmp_path):
    (tmp_path / "a.txt").write_text(rows(TIME, SWING, PUSH, mark="\t"))
    (one,) = inspect_path(tmp_path).files
    assert (one.found.time.name, [column.name for column in one.found.columns]) == ("column 1", ["column 2", "column 3"])
