"""The figures for reading."""

from rich.table import Table

from benchmarks.concealed.outcome import PROGRAM


def methods_table(result: dict) -> Table:
    """The program beside the simpler methods."""
    columns = ("method", "false alarms", "named", "or its twin", "nothing but it", "unlisted", "both of a pair")
    shown = Table(*columns, title=f"{result['cases']} cases")
    for name, found in {PROGRAM: result, **result["baselines"]}.items():
        alarm = found["false_alarm"]
        interval = " ({:.1%} … {:.1%})".format(*alarm["ci95"]) if alarm["ci95"] else ""
        shares = (found["named"], found["named_or_twin"], found["named_alone"], found["unlisted"], found["pairs"]["both"])
        shown.add_row(name, f"{alarm['count']} of {alarm['of']}{interval}", *map(percent, shares))
    return shown


def effects_table(result: dict) -> Table:
    """What was said about each effect."""
    shown = Table("concealed", "cases", "named", "or its twin", "said instead", title="The program's verdicts")
    rows = result["detail"]["effect"] | result["detail"]["off_list"]
    for truth, said in result["confusion"].items():
        row = rows.get(truth, {})
        others = ", ".join(f"{name} {count}" for name, count in said.items() if name != truth)
        right = row.get("unlisted") if truth.startswith("x_") else row.get("named")
        shown.add_row(truth, str(sum(said.values())), percent(right), percent(row.get("named_or_twin")), others)
    return shown


def percent(share: float | None) -> str:
    """A share, or a dash."""
    return "-" if share is None else f"{share:.0%}"
