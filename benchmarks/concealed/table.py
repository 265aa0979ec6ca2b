"""The figures for reading."""

from rich.table import Table

from benchmarks.concealed.outcome import PROGRAM, VERDICTS
from benchmarks.concealed.summary import LIMIT


def methods_table(result: dict) -> Table:
    """The program beside the simpler methods."""
    columns = ("method", "false alarms", "named", "or its twin", "nothing but it", "unlisted", "both of a pair", "wrong names")
    shown = Table(*columns, title=f"{result['cases']} cases")
    for name, found in {PROGRAM: result, **result["baselines"]}.items():
        shares = (found["named"], found["named_or_twin"], found["named_alone"], found["unlisted"], found["pairs"]["both"])
        shown.add_row(name, counted(found["false_alarm"]), *map(percent, shares), counted(found["wrong_names"]))
    return shown


def verdicts_table(result: dict) -> Table:
    """How often the program gave each verdict."""
    shown = Table("cases", *VERDICTS, title="Verdicts")
    for group, counts in result["verdicts"].items():
        shown.add_row(group, *(str(counts[verdict]) for verdict in VERDICTS))
    return shown


def effects_table(result: dict) -> Table:
    """What was said about each effect."""
    shown = Table("concealed", "cases", "named", "or its twin", "said instead", title="The program's verdicts")
    rows = result["detail"]["effect"] | result["detail"]["off_list"]
    for truth, said in result["confusion"].items():
        row = rows.get(truth, {})
        others = ", ".join(f"{name} {count}" for name, count in said.items() if name != truth)
        right = row.get("refrained") if truth.startswith("x_") else row.get("named")
        shown.add_row(truth, str(sum(said.values())), percent(right), percent(row.get("named_or_twin")), others)
    return shown


def time_table(result: dict) -> Table:
    """How long the program took."""
    shown = Table("cases", "of", "median, s of processor", "longest, s", f"above {LIMIT:g} s", title="Time of a diagnosis")
    for group, found in result["time"].items():
        shown.add_row(group, str(found["of"]), f"{found['cpu_median']:.0f}", f"{found['longest']:.0f}", str(found["over_limit"]))
    return shown


def counted(found: dict) -> str:
    """A count, and the interval of its share."""
    interval = " ({:.1%} … {:.1%})".format(*found["ci95"]) if found["ci95"] else ""
    return f"{found['count']} of {found['of']}{interval}"


def percent(share: float | None) -> str:
    """A share, or a dash."""
    return "-" if share is None else f"{share:.0%}"
