"""One record in the layouts in which recorders and spreadsheets write it; imitated after their formats."""

import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np

RATE = 2048.0
TIME = np.arange(2048) / RATE
NUMBERS = ("hammer_displacement", "cart_displacement", "impact_force", "hammer_acceleration")


@functools.cache
def record() -> dict[str, np.ndarray]:
    """One second of a driven rig, SI: a hammer of 0.4 kg on a spring of 5 Hz, a stop 1 mm away, a cart that moves as a sine of 6.25 Hz."""
    mass, omega, drive, steps = 0.4, 2.0 * np.pi * 5.0, 2.0 * np.pi * 6.25, 20
    x, v, found = 0.0, 0.0, np.empty((TIME.size, 3))
    for step, t in enumerate(np.arange(steps * TIME.size) / (steps * RATE)):
        y = 2e-3 * np.sin(drive * t + 0.3)
        push = 3e4 * max(x - y - 1e-3, 0.0)
        felt = -(omega**2) * (x - y) - push / mass
        if step % steps == 0:
            found[step // steps] = x, push, felt
        v += felt / (steps * RATE)
        x += v / (steps * RATE)
    rng = np.random.default_rng(5)
    hammer, push, felt = found.T
    return {
        "hammer_displacement": hammer + rng.normal(0.0, 1e-6, TIME.size),
        "cart_displacement": 2e-3 * np.sin(drive * TIME + 0.3) + rng.normal(0.0, 1e-6, TIME.size),
        "impact_force": push + rng.normal(0.0, 0.02, TIME.size),
        "hammer_acceleration": felt + rng.normal(0.0, 0.02, TIME.size),
    }


def rows(factors=(1e3, 1e3, 1.0, 1.0), *, time: np.ndarray | None = TIME, mark=";", decimal=",", digits=9) -> list[str]:
    """The samples as lines of text; without a column of time where it is None."""
    columns = [factor * values for factor, values in zip(factors, record().values(), strict=True)]
    table = np.column_stack([*([] if time is None else [time]), *columns])
    return [mark.join(f"{value:.{digits}g}".replace(".", decimal) for value in row) for row in table]


def excel_german(path: Path) -> None:
    """Excel in German: semicolons, decimal commas, Windows-1252, units in the names."""
    head = "Zeit [s];Weg Hammer [mm];Weg Schlitten [mm];Kraftmessdose [N];Beschleunigung Hammer [m/s²]"
    path.write_bytes("\r\n".join([head, *rows(), ";;;;", ""]).encode("cp1252"))


def units_below(path: Path) -> None:
    """A row of units below the header, comments above it."""
    head = ["# Versuch 12, Prüfstand 3", "Zeit;Hammer Laser;Tisch Laser;Kraft;Hammer Beschl.", "ms;µm;µm;kN;g"]
    body = rows((1e6, 1e6, 1e-3, 1.0 / 9.80665), time=1e3 * TIME)
    path.write_bytes("\n".join([*head, *body]).encode("latin-1"))


def labview(path: Path) -> None:
    """LabVIEW measurement file with one abscissa; the samples lack the comment's cell."""
    head = """LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t,
Multi_Headings\tNo
X_Columns\tOne
Time_Pref\tRelative
Operator\tLabor
Date\t2024/03/01
Time\t10:11:12,3456789012345678901
***End_of_Header***\t
\t
Channels\t4\t\t\t\t
Samples\t2048\t2048\t2048\t2048\t
Date\t2024/03/01\t2024/03/01\t2024/03/01\t2024/03/01\t
Time\t10:11:12,34\t10:11:12,34\t10:11:12,34\t10:11:12,34\t
Y_Unit_Label\tmm\tmm\tNewtons\tm/s^2\t
X_Dimension\tTime\tTime\tTime\tTime\t
X0\t0,0000000000000000E+0\t0,0E+0\t0,0E+0\t0,0E+0\t
Delta_X\t0,000488281250\t0,000488281250\t0,000488281250\t0,000488281250\t
***End_of_Header***\t\t\t\t\t
X_Value\tHammer LVDT\tBase LVDT\tLoad cell\tHammer accel\tComment"""
    path.write_text("\r\n".join([*head.split("\n"), *rows(mark="\t"), ""]), encoding="cp1252", newline="")


def labview_without_abscissa(path: Path) -> None:
    """The same without abscissa: its cells are empty, and the time follows from Delta_X."""
    labview(path)
    lines = path.read_text(encoding="cp1252").split("\n")
    begin = next(place for place, line in enumerate(lines) if line.startswith("X_Value")) + 1
    body = ["\t" + line.partition("\t")[2] if line.strip() else line for line in lines[begin:]]
    path.write_text("\n".join([*lines[:begin], *body]).replace("X_Columns\tOne", "X_Columns\tNo"), encoding="cp1252")


def labview_with_abscissae(path: Path) -> None:
    """The same with an abscissa for each channel: an empty cell between the entries of two channels, and a comment in the first row."""
    labview(path)
    lines = path.read_text(encoding="cp1252").replace("X_Columns\tOne", "X_Columns\tMulti").split("\n")
    begin = next(place for place, line in enumerate(lines) if line.startswith("X_Value"))
    block = next(place for place, line in enumerate(lines) if line.startswith("Samples"))
    head = [line.replace("\t", "\t\t").replace("\t\t", "\t", 1) for line in lines[block:begin]]
    name, *names, comment = lines[begin].split("\t")
    cells = [line.split("\t") for line in lines[begin + 1 :] if line.strip()]
    body = ["\t".join(f"{time}\t{value}" for value in values) for time, *values in cells]
    body[0] += "\tRun 1"
    lines = [*lines[:block], *head, "\t".join(f"{name}\t{one}" for one in names) + f"\t{comment}", *body, ""]
    path.write_text("\n".join(lines), encoding="cp1252")


def catman(path: Path) -> None:
    """Text export of HBM catman: tabs, Windows-1252, names, units, and a row on the sampling."""
    head = [
        "HBM_CATMAN_EXPORT",
        "T0 = 01.03.2024 10:11:12",
        "Kommentar:\tAnschlag 3, Spalt 0,5 mm",
        "",
        "Zeit  1 - Standardmessrate\tWeg_Hammer\tWeg_Wagen\tKraft_Anschlag\tBeschl_Hammer",
        "s\tmm\tmm\tN\tm/s²",
        "Standard\tMX840B_CH1\tMX840B_CH2\tMX840B_CH3\tMX840B_CH4",
    ]
    path.write_bytes("\r\n".join([*head, *rows(mark="\t"), ""]).encode("cp1252"))


def dewesoft(path: Path) -> None:
    """Text export of Dewesoft: information first, units in round brackets."""
    head = [
        "Filename:\trig 7.dxd",
        "Start time:\t3/1/2024 10:11:12.345 AM",
        "Number of channels:\t4",
        "Sample rate:\t2048 Hz",
        "",
        "Time (s)\tImpactor LVDT (mm)\tShaker LVDT (mm)\tForce (N)\tImpactor Accel (m/s2)",
    ]
    path.write_text("\r\n".join([*head, *rows(mark="\t", decimal="."), ""]), newline="")


def flexlogger(path: Path) -> None:
    """CSV of a National Instruments logger: times of day, quotation marks."""
    head = ["Log file,rig7", "Operator,lab", '"Time","Hammer Laser (mm)","Base Laser (mm)","Load Cell (N)","Hammer Accel (m/s^2)"']
    stamps = [f'"03/01/2024 23:59:{59 + t:09.6f}"' if t < 1.0 else f'"03/02/2024 00:00:{t - 1.0:09.6f}"' for t in TIME]
    path.write_text("\n".join([*head, *(f"{s},{row}" for s, row in zip(stamps, rows(time=None, mark=",", decimal="."), strict=True))]))


def portuguese(path: Path) -> None:
    """A spreadsheet in Portuguese, UTF-8."""
    head = "Tempo (s);Deslocamento do martelo (mm);Deslocamento do carrinho (mm);Célula de carga (N);Aceleração do martelo (m/s²)"
    path.write_text("\n".join([head, *rows()]), encoding="utf-8-sig")


def unicode_text(path: Path) -> None:
    """ "Unicode text" of a spreadsheet: UTF-16, tabs."""
    head = "t\tHammer position [mm]\tCart position [mm]\tForce [N]\tHammer acc [m/s²]"
    path.write_text("\n".join([head, *rows(mark="\t", decimal=".")]), encoding="utf-16")


def savetxt(path: Path) -> None:
    """NumPy's savetxt: blanks, names and units behind comment marks."""
    head = ["# rig 7", "# time x y F hammer_acceleration", "# s mm mm N m/s^2"]
    path.write_text("\n".join([*head, *rows(mark=" ", decimal=".")]) + "\n")


def wide_blanks(path: Path) -> None:
    """Fixed columns of a text export: blanks, names of two words apart by more than one."""
    head = "Time [s]   Hammer disp [mm]   Cart disp [mm]   Contact force [N]   Hammer accel [m/s^2]"
    path.write_text("\n".join([head, *("  " + row for row in rows(mark="   ", decimal="."))]))


def pandas_index(path: Path) -> None:
    """pandas' to_csv: a nameless index first, the program's own names."""
    head = ",time," + ",".join(NUMBERS)
    body = rows((1.0, 1.0, 1.0, 1.0), mark=",", decimal=".", digits=12)
    path.write_text("\n".join([head, *(f"{place},{row}" for place, row in enumerate(body))]))


def rate_in_comment(path: Path) -> None:
    """No time stamps; a comment states the sampling rate."""
    head = ["# sampling rate: 2,048 kHz", "Hammer Weg [mm];Wagen Weg [mm];Kraft [N];Hammer Beschl [m/s²]"]
    path.write_text("\n".join([*head, *rows(time=None)]), encoding="utf-8")


def control_desk(path: Path) -> None:
    """dSPACE ControlDesk: a row of names, one of units and one of a single word."""
    head = ["filetype,CSV,version,1.0", "creator,ControlDesk", "Trace name,x,y,F,Hammer acc", "Unit,mm,mm,N,m/s^2", "trace_values"]
    path.write_text("\n".join([*head, *rows(mark=",", decimal=".")]))


def capstone(path: Path) -> None:
    """PASCO Capstone: units in brackets before the number of the run."""
    names = "Time (s)", "Hammer Position (mm)", "Cart Position (mm)", "Force (N)", "Hammer Acceleration (m/s²)"
    path.write_text("\n".join([",".join(f"{name} Run #1" for name in names), *rows(mark=",", decimal=".")]), encoding="utf-8")


def thousands(path: Path) -> None:
    """A spreadsheet whose cells are formatted: a separator stated, points between thousands, decimal commas."""
    columns = [1e6 * TIME, *(factor * one for factor, one in zip((1e6, 1e6, 1e3, 1e3), record().values(), strict=True))]
    cells = [[f"{value:,.12f}".translate(str.maketrans(",.", ".,")) for value in column] for column in columns]
    body = [";".join(row) for row in zip(*cells, strict=True)]
    head = ["sep=;", "t;Hammer Weg;Wagen Weg;Kraft;Hammer Beschl", "[µs];[µm];[µm];[mN];[mm/s²]"]
    path.write_text("\r\n".join([*head, *body]), encoding="utf-8-sig", newline="")


def database(path: Path) -> None:
    """A time series database: rows on groups and types, stamps with a date and a zone."""
    head = [
        "#group,false,false,false,false,false",
        "#datatype,dateTime:RFC3339,double,double,double,double",
        "_time,x_mm,y_mm,F_N,hammer_acc_g",
    ]
    body = rows((1e3, 1e3, 1.0, 1.0 / 9.80665), time=None, mark=",", decimal=".")
    path.write_text("\n".join([*head, *(f"2026-11-27T10:22:{3 + t:012.9f}Z,{row}" for t, row in zip(TIME, body, strict=True))]))


def fortran(path: Path) -> None:
    """Fixed columns of a Fortran program: exponents with a D, the header behind a comment mark, remarks between the samples."""
    body = [
        " ".join(f"{value:.12E}".replace("E", "D") for value in map(float, row.split())) for row in rows(mark=" ", decimal=".", digits=12)
    ]
    body.insert(700, "% stop tightened")
    path.write_text("\n".join(["% t/s x/mm y/mm F/N hammer_acceleration", *body]))


def further_run(path: Path) -> None:
    """Runs appended to one file, each below the header: the first is the longest."""
    head, body = "time,x_mm,y_mm,F_N,hammer_acceleration", rows(mark=",", decimal=".")
    path.write_text("\n".join([head, *body, head, *body[:500]]))


LAYOUTS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "Excel, German": ("a.csv", excel_german),
    "units below the header": ("a.txt", units_below),
    "LabVIEW": ("a.lvm", labview),
    "LabVIEW without abscissa": ("a.lvm", labview_without_abscissa),
    "LabVIEW with an abscissa for each channel": ("a.lvm", labview_with_abscissae),
    "HBM catman": ("a.asc", catman),
    "Dewesoft": ("a.txt", dewesoft),
    "National Instruments": ("a.csv", flexlogger),
    "Portuguese": ("a.csv", portuguese),
    "Unicode text": ("a.txt", unicode_text),
    "NumPy savetxt": ("a.txt", savetxt),
    "fixed columns": ("a.txt", wide_blanks),
    "pandas": ("a.csv", pandas_index),
    "rate in a comment": ("a.csv", rate_in_comment),
    "ControlDesk": ("a.csv", control_desk),
    "Capstone": ("a.csv", capstone),
    "marks between thousands": ("a.csv", thousands),
    "time series database": ("a.csv", database),
    "Fortran": ("a.dat", fortran),
    "runs appended": ("a.csv", further_run),
}
"""Name of the layout, name of the file, and what writes it."""


def qualisys(path: Path, *, header: bool) -> None:
    """Qualisys Track Manager: a block of keys, then coordinates in mm, with or without a header row."""
    found, columns = record(), ["hammer", "cart"]
    place = np.column_stack(
        [1e3 * found["hammer_displacement"], 0 * TIME, 500 + 0 * TIME, 1e3 * found["cart_displacement"], 0 * TIME, 1 + 0 * TIME]
    )
    head = [
        f"NO_OF_FRAMES\t{TIME.size}",
        "NO_OF_CAMERAS\t8",
        "NO_OF_MARKERS\t2",
        "FREQUENCY\t2048",
        "NO_OF_ANALOG\t0",
        "ANALOG_FREQUENCY\t0",
        "DESCRIPTION\t--",
        "TIME_STAMP\t2024-03-01, 10:11:12.345\t94247.45402301",
        "DATA_INCLUDED\t3D",
        "MARKER_NAMES\t" + "\t".join(columns),
        "TRAJECTORY_TYPES\tMeasured\tMeasured",
    ]
    body = ["\t".join(f"{value:.6f}" for value in row) for row in place]
    if header:
        head.append("Frame\tTime\t" + "\t".join(f"{name} {axis}" for name in columns for axis in "XYZ"))
        body = [f"{number + 1}\t{t:.9f}\t{row}" for number, (t, row) in enumerate(zip(TIME, body, strict=True))]
    path.write_text("\r\n".join([*head, *body, ""]), newline="")


SCOPES = {
    "Tektronix": (
        "Model,MSO24\n\nSample Interval,0.001\nVertical Units,V,V\nHorizontal Units,s\n,,\nLabel,laser,cell\nTIME,CH1,CH2\n",
        "{t:.3e},{a},{b}",
        ("CH1", "CH2"),
        "V",
    ),
    "Rigol": ("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-3.0e-01,1.0e-03\n", "{i},{a},{b},", ("CH1", "CH2"), "Volt"),
    "Rigol, stamps": ("Time(s),CH1(V),CH2(V),t0 = -3.0e-01, tInc = 1.0e-03,\n", "{t:.3e},{a},{b},,", ("CH1(V)", "CH2(V)"), "V"),
    "Siglent": (
        "Record Length,Analog:3\nSerial Number,SDS7\nSource,CH1,CH2\nSecond,Volt,Volt\n",
        "{t:.4f},{a},{b}",
        ("CH1", "CH2"),
        "Volt",
    ),
    "PicoScope": ("Zeit;Kanal A;Kanal B\n(ms);(mV);(mV)\n\n", "{ms};{a};{b}", ("Kanal A", "Kanal B"), "mV"),
    "SignalExpress": ("channel names: \nai0\tai1\nstart times:\n10:22\t10:22\ndt:\n0.001\t0.001\ndata:\n", "{a}\t{b}", ("ai0", "ai1"), ""),
    "PULSE": ("Version:\t21\nX-Axis unit:\ts\nX-Axis delta:\t0.001\nX-Axis size:\t3\n\n", "{j}\t{a}\t{b}", ("column 2", "column 3"), ""),
    "phyphox": ('"Time (s)";"x (m/s^2)";"y (m/s^2)"\n', "{t:.9E};{a};{b}", ("x (m/s^2)", "y (m/s^2)"), "m/s^2"),
}
"""Head, row, names of the columns and their unit, of a record at 1 kHz; the time may be a number of the sample."""
