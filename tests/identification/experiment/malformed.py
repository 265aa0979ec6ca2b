"""Malformed experiments: each a small damage to a valid one, and what the one-line message must say."""

import gzip
import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

Damage = Callable[[Path], None]

EXPERIMENT = """\
schema = 1
[experiment]
name = "valid"
[hammer]
mass = 0.5
[suspension]
kind = "linear"
[sensors.hammer_displacement]
unit = "m"
noise = 1.0e-5
[sensors.cart_displacement]
unit = "mm"
noise = 1.0e-5
[sensors.impact_force]
unit = "N"
noise = 0.15
[[record]]
file = "drop.csv"
kind = "drop-test"
gap = 0.0
[[record]]
file = "cart1.csv"
kind = "cart-excitation"
gap = 0.001
excitation_frequency = 6.25
"""
HEADER = "time,hammer_displacement,cart_displacement,impact_force"
SAMPLES = 64


def columns() -> dict[str, np.ndarray]:
    """The record that every file of the valid experiment holds, in the file's units."""
    time = np.arange(SAMPLES) / 4000.0
    rng = np.random.default_rng(7)
    cart = 1.5 * np.sin(40.0 * time) + rng.normal(0.0, 0.01, SAMPLES)
    hammer = 3e-3 * np.sin(60.0 * time) + rng.normal(0.0, 1e-5, SAMPLES)
    push = rng.normal(0.0, 0.15, SAMPLES) + 30.0 * np.exp(-(((np.arange(SAMPLES) - 40.0) / 3.0) ** 2))
    return {"time": time, "hammer_displacement": hammer, "cart_displacement": cart, "impact_force": push}


def csv_lines() -> list[str]:
    """The same as lines of a CSV file, header first."""
    rows = zip(*columns().values(), strict=True)
    return [HEADER, *(",".join(f"{value:.6e}" for value in row) for row in rows)]


def write_valid(folder: Path) -> None:
    """Write an experiment that loads without a complaint: a drop test and a cart excitation, 64 samples each."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")
    for name in ("drop.csv", "cart1.csv"):
        (folder / name).write_text("\n".join(csv_lines()) + "\n", encoding="utf-8")


def edit(old: str, new: str) -> Damage:
    """Replace a passage of the experiment file."""

    def damage(folder: Path) -> None:
        file = folder / "experiment.toml"
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new), encoding="utf-8")

    return damage


def parameter(lines: str) -> Damage:
    """Add a table of wishes for the contact exponent."""
    return edit("[hammer]", f"[parameters.n]\n{lines}\n[hammer]")


def without_sensors(folder: Path) -> None:
    """Leave no channel declared."""
    file = folder / "experiment.toml"
    head, _, rest = file.read_text(encoding="utf-8").partition("[sensors.hammer")
    file.write_text(head + "[[record]]" + rest.partition("[[record]]")[2], encoding="utf-8")


def without_force(folder: Path) -> None:
    """Ask for the mass where no channel determines it."""
    edit("mass = 0.5", "mass = 0.5\nestimate_mass = true")(folder)
    edit('[sensors.impact_force]\nunit = "N"\nnoise = 0.15\n', "")(folder)


def without_motion(folder: Path) -> None:
    """Leave cart and load cell alone."""
    edit('[sensors.hammer_displacement]\nunit = "m"\nnoise = 1.0e-5\n', "")(folder)


def add(text: str) -> Damage:
    """Append to the experiment file, that is to the table of cart1.csv."""
    return edit("excitation_frequency = 6.25\n", "excitation_frequency = 6.25\n" + text + "\n")


def toml_bytes(content: bytes) -> Damage:
    """Replace the experiment file."""
    return lambda folder: (folder / "experiment.toml").write_bytes(content) and None


def line(number: int, text: str) -> Damage:
    """Replace one line (from 1) of cart1.csv."""

    def damage(folder: Path) -> None:
        lines = csv_lines()
        lines[number - 1] = text
        (folder / "cart1.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    return damage


def csv(change: Callable[[list[str]], list[str]]) -> Damage:
    """Rewrite cart1.csv."""
    return lambda folder: (folder / "cart1.csv").write_text("\n".join(change(csv_lines())) + "\n", encoding="utf-8") and None


def swapped(name: str, write: Callable[[Path], None]) -> Damage:
    """Put another file in the place of cart1.csv."""

    def damage(folder: Path) -> None:
        edit('"cart1.csv"', f'"{name}"')(folder)
        (folder / "cart1.csv").unlink()
        write(folder / name)

    return damage


def missing(name: str) -> Damage:
    """Remove a file."""
    return lambda folder: (folder / name).unlink()


def link_out(folder: Path) -> None:
    """Let a link lead out of the folder."""
    outside = folder.parent / f"{folder.name}-outside.csv"
    (folder / "cart1.csv").rename(outside)
    (folder / "cart1.csv").symlink_to(outside)


def folder_for_file(folder: Path) -> None:
    """A folder bears the record's name."""
    (folder / "cart1.csv").unlink()
    (folder / "cart1.csv").mkdir()


def short_gzip(path: Path) -> None:
    """A gzip file that ends too early."""
    path.write_bytes(gzip.compress("\n".join(csv_lines()).encode())[:-40])


def gzip_bomb(path: Path) -> None:
    """A hundred kilobytes that unfold to a hundred million."""
    path.write_bytes(gzip.compress((HEADER + "\n").encode() + b"0" * 100_000_000, compresslevel=9))


def huge_hdf5(path: Path) -> None:
    """A data set that claims 240 GB and stores nothing."""
    with h5py.File(path, "w") as file:
        file.create_dataset("time", shape=(30_000_000_000,), dtype="f8", chunks=(1024,))


def sparse_hdf5(path: Path) -> None:
    """A data set that claims 320 MB and stores nothing."""
    with h5py.File(path, "w") as file:
        file.create_dataset("time", shape=(40_000_000,), dtype="f8", chunks=(1024,))


def linked_hdf5(path: Path) -> None:
    """Data sets that lie in another file."""
    with h5py.File(path, "w") as file:
        file["time"] = np.arange(64.0)
        file.create_dataset("hammer_displacement", shape=(64,), dtype="f8", external=[("elsewhere.bin", 0, 512)])


def two_groups(path: Path) -> None:
    """Two groups, and nothing says which one is meant."""
    with h5py.File(path, "w") as file:
        file["run1/time"] = file["run2/time"] = np.arange(64.0)


def object_npz(path: Path) -> None:
    """Pickled objects."""
    np.savez(path, **{**columns(), "impact_force": np.array([{}] * SAMPLES, dtype=object)})


def matrix_npz(path: Path) -> None:
    """A matrix where a column should be."""
    np.savez(path, **{**columns(), "impact_force": np.ones((SAMPLES, 2))})


def claiming_npz(path: Path) -> None:
    """An array whose header claims 320 MB over 64 samples."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (40_000_000,)})
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("time.npy", stream.getvalue() + np.arange(64.0).tobytes())


def garbage(path: Path) -> None:
    """Bytes that are no format at all."""
    path.write_bytes(bytes(range(256)) * 8)


def shortened(key: str) -> Callable[[Path], None]:
    """An archive whose channel `key` is one sample short."""
    return lambda path: np.savez(path, **{**columns(), key: columns()[key][:-1]})


def silent_force(folder: Path) -> None:
    """A force channel that is zero throughout and has no declared noise."""
    edit('unit = "N"\nnoise = 0.15', 'unit = "N"')(folder)
    silent = [text if place == 0 else text.rpartition(",")[0] + ",0" for place, text in enumerate(csv_lines())]
    for name in ("drop.csv", "cart1.csv"):
        (folder / name).write_text("\n".join(silent), encoding="utf-8")


CART1 = '[[record]]\nfile = "cart1.csv"\nkind = "cart-excitation"\ngap = 0.001\nexcitation_frequency = 6.25\n'
DROP = '[[record]]\nfile = "drop.csv"\nkind = "drop-test"\ngap = 0.0\n'

MALFORMED: tuple[tuple[str, Damage, str], ...] = (
    # the experiment file as text
    ("no experiment file", missing("experiment.toml"), r"holds no experiment\.toml"),
    ("syntax error", edit("mass = 0.5", "mass = "), r"not valid TOML: .*line 5"),
    ("name with an escape", edit('name = "valid"', 'name = "a\\u001bb"'), r"the name of the experiment is 'a\\x1bb': expected printable"),
    ("unclosed string", toml_bytes(b'schema = 1\n[experiment]\nname = "a'), r"not valid TOML: .*\(line 3 is the last\)"),
    ("key given twice", edit("mass = 0.5", "mass = 0.5\nmass = 0.5"), r"not valid TOML: .*line 6"),
    ("deeply nested", toml_bytes(b"schema = 1\nx = " + b"[" * 100_000), r"not valid TOML"),
    ("key of many parts", toml_bytes(b"schema = 1\n" + b"a." * 100_000 + b"a = 1"), r"a dotted key has more than 16 parts \(at line 2\)"),
    ("key of quoted parts", toml_bytes(b"x = { 'a' . " + b'"b.c".' * 20 + b"d = 1 }"), r"a dotted key has more than 16 parts"),
    ("table of many parts", toml_bytes(b"[" + b"a." * 100_000 + b"a]"), r"a dotted key has more than 16 parts"),
    ("experiment file not UTF-8", toml_bytes(b'schema = 1\n[experiment]\nname = "\xe9"\n'), r"not UTF-8 text \(line 3\)"),
    ("experiment file too large", toml_bytes(b"#" * 4_000_001), r"larger than 4000000 bytes"),
    # its keys
    ("no schema", edit("schema = 1\n", ""), r"schema is missing"),
    ("other schema", edit("schema = 1", "schema = 2"), r"schema in experiment\.toml is 2: expected 1"),
    ("schema true", edit("schema = 1", "schema = true"), r"schema in experiment\.toml is True: expected 1"),
    (
        "misspelt key",
        edit("excitation_frequency", "exitation_frequency"),
        r"unknown key 'exitation_frequency' in record 'cart1\.csv': did you mean 'excitation_frequency'\?",
    ),
    ("key unlike any", edit("mass = 0.5", "mass = 0.5\nzzz = 1"), r"unknown key 'zzz' in \[hammer\]: expected one of mass"),
    ("misspelt table", edit("[hammer]", "[hamer]"), r"unknown key 'hamer' in experiment\.toml: did you mean 'hammer'"),
    ("misspelt channel", edit("sensors.impact_force", "sensors.impact_forse"), r"unknown channel 'impact_forse'.*'impact_force'"),
    ("key with a line break", edit("mass = 0.5", 'mass = 0.5\n"ma\\nss" = 1'), r"unknown key 'ma\\nss' in \[hammer\]"),
    ("no suspension", edit('[suspension]\nkind = "linear"', ""), r"kind is missing in \[suspension\]"),
    ("sensor a number", edit('[sensors.impact_force]\nunit = "N"\nnoise = 0.15', "[sensors]\nimpact_force = 3"), r"expected a table"),
    # the rig
    ("no mass", edit("mass = 0.5\n", ""), r"mass is missing in \[hammer\]: expected a finite number above 0 in kg"),
    ("mass zero", edit("mass = 0.5", "mass = 0.0"), r"mass in \[hammer\] is 0\.0: expected a finite number above 0"),
    ("mass infinite", edit("mass = 0.5", "mass = inf"), r"mass in \[hammer\] is inf"),
    ("mass beyond all numbers", edit("mass = 0.5", "mass = 1" + "0" * 400), r"mass in \[hammer\] is 10+…: expected a finite"),
    ("mass true", edit("mass = 0.5", "mass = true"), r"mass in \[hammer\] is True: .*write the bare number"),
    ("mass in quotes", edit("mass = 0.5", 'mass = "0.5"'), r"mass in \[hammer\] is '0\.5': .*write the bare number"),
    ("flag in quotes", edit("mass = 0.5", 'mass = 0.5\nestimate_mass = "yes"'), r"estimate_mass .* expected true or false"),
    ("unknown suspension", edit('"linear"', '"liner"'), r"unknown kind 'liner' in \[suspension\]: did you mean 'linear'"),
    ("pendulum without length", edit('"linear"', '"pendulum"'), r"length is missing in \[suspension\]: .* above 0 in m"),
    ("pendulum of no length", edit('"linear"', '"pendulum"\nlength = 0'), r"length in \[suspension\] is 0"),
    ("length without pendulum", edit('"linear"', '"linear"\nlength = 0.1'), r"length in \[suspension\] .* only with pendulum, pivot"),
    ("law a number", edit("[hammer]", "[contact]\nlaw = 3\n[hammer]"), r"law in \[contact\] is 3: expected a text"),
    ("parameter start in quotes", edit("[hammer]", '[parameters.n]\nstart = "1.5"\n[hammer]'), r"start in \[parameters\.n\]"),
    ("parameter fixed nowhere", edit("[hammer]", "[parameters.n]\nfixed = true\n[hammer]"), r"\[parameters\.n\] is fixed without"),
    ("prior of a fixed parameter", parameter("start = 1.5\nfixed = true\nprior = { mean = 1.5, std = 0.1 }"), "is fixed and has 'prior'"),
    ("a fixed parameter that varies", parameter("start = 1.5\nfixed = true\nvaries = true"), "is fixed and has 'varies'"),
    ("start outside bounds", parameter("start = 3.0\nbounds = [1.0, 2.0]"), "the start in .* is 3, outside its bounds 1 to 2"),
    (
        "prior outside bounds",
        parameter("bounds = [1, 2]\nprior = { mean = 3, std = 1 }"),
        "the mean of the prior in .* is 3, outside its bounds",
    ),
    ("bounds the wrong way round", parameter("bounds = [2.0, 1.0]"), "bounds in .* expected the lower number first"),
    ("one bound", parameter("bounds = [2.0]"), "bounds in .* expected two numbers in the parameter's unit"),
    ("prior without a width", parameter("prior = { mean = 1.5 }"), r"std is missing in prior of \[parameters\.n\]"),
    ("prior of no width", parameter("prior = { mean = 1.5, std = 0.0 }"), "std in prior of .* is 0.0: expected a finite number above 0"),
    ("prior that is a number", parameter("prior = 1.5"), r"prior of \[parameters\.n\] is 1.5: expected a table"),
    # sensors
    ("no unit", edit('unit = "N"\n', ""), r"unit is missing in \[sensors\.impact_force\]"),
    ("unknown unit", edit('"mm"', '"furlong"'), r"unit 'furlong' .* not a known unit: expected one of displacement, that is m, mm"),
    ("unit of another dimension", edit('unit = "N"', 'unit = "mm"'), r"unit 'mm' .* displacement: expected one of force, that is N, kN"),
    ("noise zero", edit("noise = 0.15", "noise = 0"), r"noise in \[sensors\.impact_force\] is 0: expected a finite number above 0 in N"),
    ("noise negative", edit("noise = 0.15", "noise = -0.1"), r"noise in \[sensors\.impact_force\] is -0\.1"),
    ("range falling", edit("noise = 0.15", "noise = 0.15\nrange = [5, -5]"), r"range .* expected the lower number first"),
    ("range of one", edit("noise = 0.15", "noise = 0.15\nrange = [5]"), r"range .* expected two numbers in N"),
    # records as declared
    ("no record", edit(DROP + CART1, ""), r"has no record"),
    ("one record without brackets", edit(DROP + CART1, CART1.replace("[[record]]", "[record]")), r"write \[\[record\]\]"),
    ("no file", edit('file = "cart1.csv"\n', ""), r"file is missing in record number 2"),
    ("no kind", edit('kind = "drop-test"\n', ""), r"kind is missing in record 'drop\.csv': expected one of drop-test"),
    ("unknown kind", edit('"drop-test"', '"droptest"'), r"unknown kind 'droptest' in record 'drop\.csv': did you mean 'drop-test'"),
    ("no gap", edit("gap = 0.001\n", ""), r"gap is missing in record 'cart1\.csv'"),
    (
        "no gap anywhere",
        edit(DROP + CART1, (DROP + CART1).replace("gap = 0.001\n", "").replace("gap = 0.0\n", "")),
        r"gap is missing in 2 records of experiment\.toml \(drop\.csv, cart1\.csv\): .*to each",
    ),
    (
        "drive of a drop test",
        edit('kind = "drop-test"', 'kind = "drop-test"\nexcitation_frequency = 6.25'),
        r"excitation_frequency in record 'drop\.csv' is given for kind 'drop-test', in which the cart rests: expected none; remove it",
    ),
    (
        "drive faster than the samples",
        edit("excitation_frequency = 6.25", "excitation_frequency = 6250"),
        r"excitation_frequency of record 'cart1\.csv' is 6250 Hz, and its samples come at 4000 Hz: expected at most half",
    ),
    ("gap not finite", edit("gap = 0.001", "gap = nan"), r"gap in record 'cart1\.csv' is nan"),
    ("no frequency", edit("excitation_frequency = 6.25\n", ""), r"excitation_frequency is missing in record 'cart1\.csv'"),
    ("frequency negative", edit("6.25", "-6.25"), r"excitation_frequency .* is -6\.25: expected a finite number above 0 in Hz"),
    ("unknown base", add('base = "sin"'), r"unknown base 'sin' .* did you mean 'sine'"),
    ("unknown time unit", add('time_unit = "h"'), r"unit 'h' .* expected one of time, that is s, ms"),
    ("record twice", edit('"drop.csv"', '"cart1.csv"'), r"record 'cart1\.csv' is there twice"),
    ("record twice by another path", edit('"drop.csv"', '"./cart1.csv"'), r"record 'cart1\.csv' is there twice"),
    ("two records of one name", edit('"drop.csv"', '"march/cart1.h5"'), r"have one name but for folder or suffix"),
    ("unknown suffix", edit('"cart1.csv"', '"cart1.docx"'), r"'cart1\.docx' has an unknown suffix: expected one of \.csv"),
    ("nothing before the suffix", edit('"cart1.csv"', '".csv"'), r"no name before its suffix"),
    ("absolute path", edit('"cart1.csv"', '"/tmp/cart1.csv"'), r"lies outside the experiment's folder"),
    ("path of another drive", edit('"cart1.csv"', "'C:cart1.csv'"), r"lies outside the experiment's folder"),
    ("path that climbs out", edit('"cart1.csv"', '"../cart1.csv"'), r"lies outside the experiment's folder"),
    ("path with a zero byte", edit('"cart1.csv"', '"ca\\u0000rt1.csv"'), r"is not a usable path"),
    ("path with an escape", edit('"cart1.csv"', '"ca\\u001brt1.csv"'), r"the path of a record is 'ca\\x1brt1\.csv': expected printable"),
    ("link that leads out", link_out, r"leads out of the experiment's folder"),
    ("folder for a file", folder_for_file, r"record 'cart1\.csv' is not a file"),
    ("missing record", missing("cart1.csv"), r"the file of record 'cart1\.csv' is missing"),
    ("forced without force", edit("cart-excitation", "forced"), r"is 'forced' and has no applied_force"),
    ("columns of an unknown channel", add('columns = { imact_force = "F" }'), r"unknown channel 'imact_force' .* 'impact_force'"),
    ("columns of a channel without sensor", add('columns = { applied_force = "F" }'), r"expected its table \[sensors\.applied_force\]"),
    ("no channel declared", without_sensors, r"no channel is declared for record 'drop.csv'.*expected a table \[sensors.CHANNEL\]"),
    ("mass to estimate without a force", without_force, r"the mass is to be estimated, and no fitted record holds a force"),
    ("no motion of the hammer", without_motion, r"record 'drop.csv' shows no motion of the hammer, only .*impact_force: expected one of"),
    ("units of a channel without sensor", add('units = { applied_force = "kN" }'), r"expected its table \[sensors\.applied_force\]"),
    (
        "unit of a channel that the record lacks",
        edit(
            '[[record]]\nfile = "drop.csv"',
            '[sensors.applied_force]\nunit = "N"\n[[record]]\nunits = { applied_force = "furlong" }\nfile = "drop.csv"',
        ),
        r"unit 'furlong' in units of .* is not a known unit",
    ),
    ("column named twice", add('columns = { impact_force = "F", cart_displacement = "F" }'), r"column 'F' .* is named twice"),
    ("column of two channels", add('columns = { impact_force = "time" }'), r"column 'time' .* serves time and another channel"),
    ("column that is not there", add('columns = { impact_force = "F" }'), r"no column 'F' for impact_force: expected it among time, "),
    # records as files
    ("empty file", csv(lambda lines: []), r"the file holds no text"),
    ("header alone", csv(lambda lines: lines[:1]), r"no samples, it is empty: expected at least 16"),
    ("too few samples", csv(lambda lines: lines[:16]), r"only 15 samples: expected at least 16"),
    (
        "no header row",
        csv(lambda lines: lines[1:]),
        r"no column 'time' for time: expected it among column 1, column 2, column 3, .*name the right one",
    ),
    ("numbers in the header row", line(1, "time,hammer_displacement,3,4"), r"line 1 holds numbers where the header row should be"),
    (
        "no delimiter",
        csv(lambda lines: [text.replace(",", "|") for text in lines]),
        r"has one column only: .* tab, semicolon, comma, blanks",
    ),
    ("column without a name", line(1, "time,,cart_displacement,impact_force"), r"column 2 has no name in line 1"),
    (
        "two columns of one name",
        line(1, "time,time,cart_displacement,impact_force"),
        r"no column 'time' for time: expected it among time \(column 1\), time \(column 2\)",
    ),
    ("no time column", line(1, HEADER.replace("time", "tme")), r"no column 'time' for time: expected it among tme"),
    ("no channel", line(1, "time,a,b,c"), r"no recorded channel, only time, a, b, c"),
    ("text for a number", line(12, "2.5e-3,0.001,oops,0.0"), r"line 12, column 'cart_displacement': 'oops' is not a number"),
    ("number with an underscore", line(12, "2.5e-3,0.001,1_0,0.0"), r"line 12, column 'cart_displacement': '1_0' is not"),
    (
        "mark between thousands",
        csv(lambda lines: [text.replace(",", ";").replace(".", ",") for text in [*lines[:11], "2.5e-3,0.001,1.000.0,0.0", *lines[12:]]]),
        r"line 12, column 'cart_displacement': '1,000,0' is not a number: expected one such as 1,5e-3; write a decimal comma as in",
    ),
    ("short row", line(12, "2.5e-3,0.001"), r"line 12 has 2 cells: expected 4"),
    ("long row", line(12, "2.5e-3,0.001,0,0,0"), r"line 12 has 5 cells: expected 4"),
    ("time not growing", line(12, "1e-3,0,0,0"), r"does not grow at sample 11 \(0\.00225 s is followed by 0\.001 s\)"),
    ("time repeated", line(12, "2.25e-3,0,0,0"), r"does not grow at sample 11"),
    ("time not finite", line(12, "nan,0,0,0"), r"time of record 'cart1\.csv' is not finite at sample 11"),
    ("time empty", line(12, ",0,0,0"), r"time of record 'cart1\.csv' is not finite at sample 11"),
    (
        "every channel missing",
        csv(lambda lines: [lines[0], *(text.split(",")[0] + ",,," for text in lines[1:])]),
        r"no usable sample in any channel",
    ),
    (
        "record in no encoding",
        lambda folder: (folder / "cart1.csv").write_bytes(b"time,\x81m\n1,2\n") and None,
        r"line 1 is not UTF-8 text",
    ),
    ("record in UTF-16", lambda folder: (folder / "cart1.csv").write_text(HEADER, "utf-16") and None, r"no samples, it is empty"),
    ("record with an escape", line(1, HEADER + "\x1b"), r"holds a control character, '\\x1b', in line 1"),
    ("record with zero bytes", lambda folder: (folder / "cart1.csv").write_bytes(bytes(64)) and None, r"holds zero bytes"),
    ("truncated gzip", swapped("cart1.csv.gz", short_gzip), r"cannot be read as delimited text"),
    ("gzip that is none", swapped("cart1.csv.gz", garbage), r"cannot be read as delimited text \(Not a gzipped file"),
    ("gzip bomb", swapped("cart1.csv.gz", gzip_bomb), r"unfolds to more than \d+ bytes"),
    ("HDF5 that is none", swapped("cart1.h5", garbage), r"cannot be read as HDF5"),
    ("HDF5 of 240 GB", swapped("cart1.h5", huge_hdf5), r"claims 30000000000 samples: expected at most 50000000"),
    ("HDF5 of nothing", swapped("cart1.h5", sparse_hdf5), r"claims 320000000 bytes in a file of \d+ bytes"),
    ("HDF5 with data elsewhere", swapped("cart1.h5", linked_hdf5), r"'hammer_displacement' is stored in another file"),
    ("HDF5 with two groups", swapped("cart1.h5", two_groups), r"no column 'time' for time: expected it among run1\.time, run2\.time; name"),
    ("MAT that is none", swapped("cart1.mat", garbage), r"cannot be read as MATLAB"),
    ("NPZ that is none", swapped("cart1.npz", garbage), r"cannot be read as NumPy archive"),
    ("NPZ of objects", swapped("cart1.npz", object_npz), r"'impact_force' holds Python objects"),
    ("NPZ of a matrix", swapped("cart1.npz", matrix_npz), r"'impact_force' has shape \(64, 2\): expected one dimension"),
    ("NPZ that claims more", swapped("cart1.npz", claiming_npz), r"'time' claims 320000000 bytes and holds 512"),
    ("channel too short", swapped("cart1.npz", shortened("impact_force")), r"64 time stamps and 63 samples of impact_force"),
    ("recorder's own format", swapped("cart1.tdms", garbage), r"record 'cart1\.tdms'.*(cannot be read as TDMS|pip install)"),
    ("noise that cannot be estimated", silent_force, r"impact_force stands still in record 'drop\.csv', so its noise cannot be estimated"),
)
"""Name of the case, the function that damages the valid experiment in a folder, and a pattern of the message."""
