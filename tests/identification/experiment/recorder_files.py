"""Files as recorders write them, made with each format's own library."""

import warnings
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

RATE, SAMPLES = 4096.0, 200
TIME = np.arange(SAMPLES) / RATE
"""Exact in binary, so that steps and stamps agree to the last bit."""


def values() -> dict[str, np.ndarray]:
    """Two channels in the units of `UNITS`."""
    rng = np.random.default_rng(3)
    return {
        "hammer": 2.0 * np.sin(40.0 * TIME) + rng.normal(0.0, 0.01, SAMPLES),
        "load cell": 0.1 + np.maximum(0.0, np.sin(60.0 * TIME)) + rng.normal(0.0, 1e-3, SAMPLES),
    }


UNITS = {"hammer": "mm", "load cell": "kN"}


def write_tdms(path: Path, channels: Mapping[str, np.ndarray], units: Mapping[str, str] = UNITS, **properties: object) -> None:
    """Write one group; `properties` come on top of those of every waveform, None takes one away."""
    from nptdms import ChannelObject, TdmsWriter

    known = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0} | properties
    objects = [
        ChannelObject("run", name, column, {k: v for k, v in {**known, "unit_string": units.get(name, "")}.items() if v is not None})
        for name, column in channels.items()
    ]
    with TdmsWriter(path) as writer:
        writer.write_segment(objects)


def write_uff(
    path: Path,
    channels: Mapping[str, np.ndarray],
    units: Mapping[str, str] = UNITS,
    *,
    time: np.ndarray = TIME,
    even: bool = True,
    binary: bool = False,
    **fields: object,
) -> None:
    """Write one data set 58 for each channel; `fields` replace those of the data sets."""
    import pyuff

    file = pyuff.UFF(str(path))
    for node, (name, column) in enumerate(channels.items(), start=1):
        axis = time[: len(column)]
        data = {
            "type": 58,
            "binary": int(binary),
            "func_type": 1,
            "id1": name,
            "rsp_node": node,
            "rsp_dir": 3,
            "ref_node": 0,
            "ref_dir": 0,
            "ord_data_type": 4,
            "num_pts": len(column),
            "abscissa_spacing": int(even),
            "abscissa_min": float(axis[0]),
            "abscissa_inc": float(axis[1] - axis[0]),
            "abscissa_spec_data_type": 17,
            "orddenom_spec_data_type": 0,
            "z_axis_spec_data_type": 0,
            "ordinate_spec_data_type": 0,
            "abscissa_axis_units_lab": "s",
            "ordinate_axis_units_lab": units.get(name, "NONE"),
            "x": axis,
            "data": column,
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # the library leaves the closing of a binary file to the interpreter
            file.write_sets([data | fields], "add")


def write_mdf4(
    path: Path, channels: Mapping[str, np.ndarray], units: Mapping[str, str] = UNITS, *, time: np.ndarray = TIME, apart: bool = False
) -> None:
    """Write one group, or `apart` one for each channel."""
    from asammdf import MDF, Signal

    signals = [
        Signal(column, time[: len(column)], name=name, unit=units.get(name, ""), encoding="utf-8") for name, column in channels.items()
    ]
    with MDF(version="4.10") as file:
        for group in [[signal] for signal in signals] if apart else [signals]:
            file.append(group)
        file.save(path, overwrite=True)


def write_excel(path: Path, channels: Mapping[str, np.ndarray], units: Mapping[str, str] = UNITS) -> None:
    """Write a workbook whose first sheet holds a remark, the second one names, units and samples, and the third one a number."""
    table = [["time", *channels], ["s", *(units.get(name, "") for name in channels)]]
    table += [list(row) for row in zip(TIME, *channels.values(), strict=False)]
    sheets = [[["Rig 7"]], table, [["calibrated", 3.0]]]
    spaces = 'xmlns="http://schemas.openxmlformats.org/{}" xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"'
    main, kinds, related = (
        spaces.format(name) for name in ("spreadsheetml/2006/main", "package/2006/content-types", "package/2006/relationships")
    )
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    numbers = range(1, len(sheets) + 1)

    def cell(value: object) -> str:
        return f"<c><v>{float(value)!r}</v></c>" if isinstance(value, float) else f'<c t="inlineStr"><is><t>{value}</t></is></c>'

    with zipfile.ZipFile(path, "w") as file:
        file.writestr(
            "[Content_Types].xml",
            f'<Types {kinds}><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
            '<Default Extension="xml" ContentType="application/xml"/></Types>',
        )
        file.writestr(
            "_rels/.rels",
            f'<Relationships {related}><Relationship Id="a" Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        )
        listed = "".join(f'<sheet name="S{number}" sheetId="{number}" r:id="b{number}"/>' for number in numbers)
        file.writestr("xl/workbook.xml", f"<workbook {main}><sheets>{listed}</sheets></workbook>")
        listed = "".join(f'<Relationship Id="b{number}" Type="{office}/worksheet" Target="worksheets/{number}.xml"/>' for number in numbers)
        file.writestr("xl/_rels/workbook.xml.rels", f"<Relationships {related}>{listed}</Relationships>")
        for number, rows in zip(numbers, sheets, strict=True):
            body = "".join(f"<row>{''.join(map(cell, row))}</row>" for row in rows)
            file.writestr(f"xl/worksheets/{number}.xml", f"<worksheet {main}><sheetData>{body}</sheetData></worksheet>")
