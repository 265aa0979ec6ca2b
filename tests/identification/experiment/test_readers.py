import gzip

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from identification.experiment import ExperimentError
from identification.experiment.limits import LARGEST
from identification.experiment.readers import READERS, check_suffix, read_columns, stem_of

numbers = st.floats(-LARGEST, LARGEST, allow_nan=False, width=64).filter(lambda value: not 9.89e37 < abs(value) < 9.92e37)
"""Without the numbers that instruments write for no reading."""
samples = hnp.arrays(np.float64, st.integers(1, 40), elements=numbers)
pairs = hnp.arrays(np.float64, st.tuples(st.integers(1, 40), st.just(2)), elements=numbers)
names = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"], exclude_characters='"#,;'), min_size=1, max_size=12).filter(
    lambda name: not is_number(name) and not name.startswith("/") and name not in (".", "..") and "/" not in name
)
shared_folder = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture]
in_one_folder = settings(max_examples=40, suppress_health_check=shared_folder)


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def read(path, *wanted):
    return read_columns(path, frozenset(wanted), path.name)


def text_of(table, header, mark=",", end="\n"):
    return end.join([mark.join(header), *(mark.join(map(repr, map(float, row))) for row in table)]) + end


@in_one_folder
@given(table=pairs, name=names, mark=st.sampled_from([",", ";", "\t"]), end=st.sampled_from(["\n", "\r\n", "\r"]), mark_first=st.booleans())
def test_delimited_text_comes_back_exactly(table, name, mark, end, mark_first, tmp_path):
    header = ("time", name + "'")
    (tmp_path / "a.csv").write_bytes(text_of(table, header, mark, end).encode("utf-8-sig" if mark_first else "utf-8"))
    found = read(tmp_path / "a.csv", *header)
    assert found.names == header
    np.testing.assert_array_equal(np.stack([found.values[each] for each in header], axis=1), table)


@in_one_folder
@given(table=pairs)
def test_packed_text_comes_back_exactly(table, tmp_path):
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(text_of(table, ("t", "F")).encode()))
    np.testing.assert_array_equal(read(tmp_path / "a.csv.gz", "F").values["F"], table[:, 1])


@in_one_folder
@given(values=samples, name=names, group=st.sampled_from(["", "run/"]), packed=st.booleans())
def test_hdf5_comes_back_exactly(values, name, group, packed, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset(group + name, data=values, compression="gzip" if packed else None)
    found = read(tmp_path / "a.h5", name)
    assert found.names == (name,)
    np.testing.assert_array_equal(found.values[name], values)


@in_one_folder
@given(values=samples, packed=st.booleans(), oned_as=st.sampled_from(["row", "column"]))
def test_mat_5_comes_back_exactly(values, packed, oned_as, tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"F": values, "note": "text"}, do_compression=packed, oned_as=oned_as)
    found = read(tmp_path / "a.mat", "F")
    assert found.names == ("F", "note")
    np.testing.assert_array_equal(found.values["F"], values)


@in_one_folder
@given(values=samples, row=st.booleans())
def test_mat_73_comes_back_exactly(values, row, tmp_path):
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("F", data=values[None, :] if row else values[:, None])
        file.create_group("#refs#")
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + path.read_bytes()[512:])
    np.testing.assert_array_equal(read(path, "F").values["F"], values)


@in_one_folder
@given(values=samples, kind=st.sampled_from(["f8", "f4", "i2", "u1", ">f8"]), packed=st.booleans())
def test_npz_comes_back_exactly(values, kind, packed, tmp_path):
    with np.errstate(all="ignore"):
        stored = np.clip(values, 0.0, 200.0).astype(kind)
    (np.savez_compressed if packed else np.savez)(tmp_path / "a.npz", F=stored)
    found = read(tmp_path / "a.npz", "F").values["F"]
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, stored.astype(np.float64))


@settings(max_examples=60, suppress_health_check=shared_folder)
@given(name=st.sampled_from(["a.csv", "a.csv.gz", "a.h5", "a.mat", "a.npz"]), data=st.data())
def test_a_damaged_file_is_an_error_and_no_crash(name, data, tmp_path):
    path = tmp_path / name
    content = bytearray(intact(path))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        found = read(path, "time", "F")
    except ExperimentError as error:
        assert "\n" not in str(error)
    else:
        assert all(column.dtype == np.float64 and column.ndim == 1 for column in found.values.values())


def intact(path):
    values = {"time": np.arange(20.0), "F": np.linspace(-1.0, 1.0, 20)}
    if path.suffix == ".h5":
        with h5py.File(path, "w") as file:
            for name, column in values.items():
                file[name] = column
    elif path.suffix == ".mat":
        scipy.io.savemat(path, values)
    elif path.suffix == ".npz":
        np.savez_compressed(path, **values)
    else:
        text = text_of(np.stack(list(values.values()), axis=1), tuple(values)).encode()
        path.write_bytes(gzip.compress(text) if path.suffix == ".gz" else text)
    return path.read_bytes()


@pytest.mark.parametrize("suffix", [".csv", ".npz", ".h5", ".mat"])
def test_a_number_whose_squares_do_not_add_up_is_missing_in_every_format(suffix, tmp_path):
    values, path = np.array([1.0, LARGEST, -LARGEST, 2.0 * LARGEST, -1e308, np.inf]), tmp_path / f"a{suffix}"
    if suffix == ".csv":
        path.write_text(text_of(values[:, None], ("F",)))
    elif suffix == ".npz":
        np.savez(path, F=values)
    elif suffix == ".mat":
        scipy.io.savemat(path, {"F": values})
    else:
        with h5py.File(path, "w") as file:
            file["F"] = values
    np.testing.assert_array_equal(read(path, "F").values["F"], [1.0, LARGEST, -LARGEST, np.nan, np.nan, np.nan])


def test_comments_quotes_and_empty_cells(tmp_path):
    (tmp_path / "a.csv").write_text('# rig B\n\n"t";"LVDT #2, [mm]";note\n0;1.5;"a;b"\n# pause\n0.1;;x\n 0.2 ; nan ;y # late\n')
    found = read(tmp_path / "a.csv", "t", "LVDT #2, [mm]")
    assert found.names == ("t", "LVDT #2, [mm]", "note")
    np.testing.assert_array_equal(found.values["t"], [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(found.values["LVDT #2, [mm]"], [1.5, np.nan, np.nan])


def test_text_in_a_column_that_is_not_wanted_does_no_harm(tmp_path):
    (tmp_path / "a.csv").write_text("t,comment\n0,start\n1,end\n")
    np.testing.assert_array_equal(read(tmp_path / "a.csv", "t").values["t"], [0.0, 1.0])


def test_only_wanted_data_sets_count(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["F"] = np.arange(3)
        file["F2"] = h5py.SoftLink("/F")
        file["there"] = h5py.ExternalLink("b.h5", "F")
        file.create_dataset("picture", shape=(10**6, 10**6), dtype="f8", chunks=(8, 8))
        file["text"] = "hello"
    found = read(tmp_path / "a.h5", "F", "absent")
    assert found.names == ("F", "F2", "picture", "text", "there")
    assert list(found.values) == ["F"]
    for link in ("F2", "there"):
        with pytest.raises(ExperimentError, match=f"column '{link}' is a link: expected the data set itself in the record"):
            read(tmp_path / "a.h5", "F", link)


def test_a_link_beside_the_only_group_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["run/F"] = np.arange(3)
        file["there"] = h5py.ExternalLink("b.h5", "F")
    assert read(tmp_path / "a.h5", "F").names == ("there", "F")
    with pytest.raises(ExperimentError, match="column 'there' is a link"):
        read(tmp_path / "a.h5", "there")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.array([1 + 2j]), "holds complex128"),
        (np.array([True]), "holds bool"),
        (np.ones((2, 3)), r"has shape \(2, 3\)"),
        (np.float64(1.0), r"has shape \(\)"),
    ],
)
@pytest.mark.parametrize("suffix", [".h5", ".npz"])
def test_what_is_no_column(suffix, value, message, tmp_path):
    path = tmp_path / f"a{suffix}"
    if suffix == ".h5":
        with h5py.File(path, "w") as file:
            file["F"] = value
    else:
        np.savez(path, F=value)
    with pytest.raises(ExperimentError, match=message):
        read(path, "F")


def test_a_chunk_larger_than_its_data_set_is_a_claim_too(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("F", shape=(10,), maxshape=(None,), chunks=(100_000_000,), dtype="f8")
    with pytest.raises(ExperimentError, match="claims 800000000 bytes"):
        read(tmp_path / "a.h5", "F")


def test_mat_text_is_no_column(tmp_path):
    scipy.io.savemat(tmp_path / "a.mat", {"F": "text"})
    with pytest.raises(ExperimentError, match="'F' holds char"):
        read(tmp_path / "a.mat", "F")


@pytest.mark.parametrize(
    "file", ["a.csv", "a.CSV", "m/a.csv.gz", "a.tsv", "a.h5", "a.hdf5", "a.mat", "a.npz", "a.tdms", "a.unv", "a.uff", "a.mf4"]
)
def test_known_suffixes(file):
    assert stem_of(file) == "a"
    assert file.lower().endswith(check_suffix(file)[1])


MATLAB_5 = b"MATLAB 5.0 MAT-file" + b" " * 105 + b"\x00\x01IM"
UNIVERSAL, MDF = b"    -1\n    58\n", b"MDF     4.10    "
MAGIC = (b"", b"\x89HDF\r\n\x1a\n", MATLAB_5, b"PK\x03\x04", b"\x1f\x8b\x08", b"TDSm", UNIVERSAL, MDF, b"time,F\n0,")


@in_one_folder
@given(begin=st.sampled_from(MAGIC), rest=st.binary(max_size=300), suffix=st.sampled_from([s for each in READERS for s in each.suffixes]))
def test_any_bytes_end_in_a_result_or_in_one_line(begin, rest, suffix, tmp_path):
    (tmp_path / f"a{suffix}").write_bytes(begin + rest)
    try:
        found = read(tmp_path / f"a{suffix}", "time", "F")
    except ExperimentError as error:
        assert "\n" not in str(error)
    else:
        assert all(column.dtype == np.float64 and column.ndim == 1 for column in found.values.values())
