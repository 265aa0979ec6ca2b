"""From many cases to shares: the headline figures first, then what they depend on."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.stats import binomtest

from benchmarks.concealed.outcome import OPEN, PROGRAM, UNLISTED, VERDICTS, Outcome, outcome

_STRENGTH_EDGES = (0.0, 0.4, 0.7, 1.0, 1.3)
LIMIT = 180.0
"""Seconds that a diagnosis should take at most."""
_SINGLE = ("null", "listed", "off-list")
_GROUPS = (*_SINGLE, "pair", "weak")


def summary(trials: Sequence[Mapping]) -> dict:
    """Figures of the program, those of the baselines in the same form, and every failure."""
    methods = sorted({name for trial in trials for name in trial.get("baselines", {})})
    seconds = [trial["seconds"] for trial in trials if "diagnosis" in trial]
    return {
        **verdicts(trials, PROGRAM),
        "held_out_ratio": held_out(trials)["displacement"]["median"],
        "seconds_per_case": float(np.median(seconds)) if seconds else None,
        "null_gains": null_gains(trials),
        "held_out": held_out(trials),
        "detail": detail(trials),
        "gap_step_located": located(trials),
        "time": time(trials),
        "baselines": {name: verdicts([t for t in trials if name in t.get("baselines", {})], name) for name in methods},
        "cases": len(trials),
        "revisions": sorted({trial["revision"] for trial in trials if trial.get("revision")}),
        "failures": failures(trials),
    }


def null_gains(trials: Sequence[Mapping]) -> list[float]:
    """Largest gain of twice the log-likelihood on every complete rig, the largest first: what the level of the decision has to exceed."""
    found = [t["diagnosis"]["largest_gain"] for t in trials if t["group"] == "null" and "diagnosis" in t]
    return sorted((gain for gain in found if gain is not None), reverse=True)


def failures(trials: Sequence[Mapping]) -> dict[str, str]:
    """What went wrong, by case, or by case and baseline."""
    found = {trial["key"]: trial["failure"] for trial in trials if "failure" in trial}
    for trial in trials:
        answers = trial.get("baselines", {})
        found |= {f"{trial['key']}, {name}": answer["failure"] for name, answer in answers.items() if "failure" in answer}
    return found


def verdicts(trials: Sequence[Mapping], method: str) -> dict:
    """How often is something claimed where nothing is concealed; how often is the truth named.

    A case that failed or stayed undecided counts as not named. Among complete models, and for wrong names among all cases, only those with
    a verdict count; the others are counted with the verdicts. On a rig with unrest
    "restless" is no false alarm, and right for what is on no list.
    """
    by_group = {group: [outcome(t, method) for t in trials if t["group"] == group] for group in _GROUPS}
    null = [found for found in by_group["null"] if found.verdict not in OPEN]
    listed, pairs, off_list = by_group["listed"], by_group["pair"], by_group["off-list"]
    answered = [found for group in by_group.values() for found in group if found.verdict not in OPEN]
    return {
        "false_alarm": _count(null, lambda found: found.false_alarm),
        "named": _share(listed, lambda found: found.named),
        "named_or_twin": _share(listed, lambda found: found.named_or_twin),
        "unlisted": _share(off_list, lambda found: found.refrained),
        "wrong_names": _count(answered, lambda found: found.wrong_name),
        "verdicts": {group: given(found) for group, found in by_group.items() if found},
        "confusion": confusion([found for group in _SINGLE for found in by_group[group]]),
        "named_counts": _count(listed, lambda found: found.named),
        "named_alone": _share(listed, lambda found: found.named_alone),
        "unlisted_counts": _count(off_list, lambda found: found.refrained),
        "pairs": {"of": len(pairs), "both": _share(pairs, lambda p: p.all_named), "one": _share(pairs, lambda p: p.named_or_twin)},
        "pairs_alone": _count(pairs, lambda found: found.named_alone),
    }


def given(outcomes: Sequence[Outcome]) -> dict[str, int]:
    """How often each verdict was given."""
    return {verdict: sum(found.verdict == verdict for found in outcomes) for verdict in VERDICTS}


def confusion(outcomes: Sequence[Outcome]) -> dict[str, dict[str, int]]:
    """By truth ("none" where nothing is concealed): how often each verdict or first name was given."""
    found: dict[str, Counter] = {}
    for each in outcomes:
        found.setdefault(each.truth[0] if each.truth else "none", Counter())[each.claim] += 1
    return {truth: dict(sorted(counts.items(), key=lambda item: -item[1])) for truth, counts in sorted(found.items())}


def detail(trials: Sequence[Mapping]) -> dict:
    """The program's shares by what varies from case to case; weak and ordinary cases of listed effects together by strength."""
    listed = [t for t in trials if t["group"] == "listed"]
    graded = [t for t in trials if t["group"] in ("listed", "weak")]
    return {
        "effect": _by(listed, lambda t: t["effects"][0]["name"]),
        "strength": _by(graded, lambda t: _bin(t["effects"][0]["strength"])),
        "weak": _by([t for t in trials if t["group"] == "weak"], lambda t: f"{t['effects'][0]['strength']:g}"),
        "off_list": _by([t for t in trials if t["group"] == "off-list"], lambda t: t["effects"][0]["name"]),
        "noise": _by(listed, lambda t: f"{t['noise']:g}"),
        "channels": _by(listed, lambda t: t["channels"]),
        "driven": _by(listed, lambda t: str(t["driven"])),
        "kind": _by(listed, lambda t: t["kind"]),
    }


def held_out(trials: Sequence[Mapping]) -> dict:
    """Error of the augmented model over that of the nominal one along the sealed records: listed cases in which something is named."""
    found = [t["diagnosis"] for t in trials if t["group"] == "listed" and t.get("diagnosis", {}).get("verdict") == "missing"]
    result = {}
    for kind in ("displacement", "peaks"):
        pairs = [(d["sealed_augmented"][kind], d["sealed_nominal"][kind]) for d in found]
        ratios = [after / before for after, before in pairs if before > 0.0]
        low, median, high = np.quantile(ratios, (0.25, 0.5, 0.75)).tolist() if ratios else (None, None, None)
        result[kind] = {"median": median, "quartiles": [low, high], "of": len(ratios)}
    return result


def located(trials: Sequence[Mapping]) -> dict:
    """Whether a jump of the gap that is named is also placed: the right record, and the time in s."""
    found = [
        (t["diagnosis"]["location"], t["where"])
        for t in trials
        if t["group"] == "listed" and t.get("where") and "gap_step" in t.get("diagnosis", {}).get("effects", ())
    ]
    right = [(place, truth) for place, truth in found if place.get("record") == truth["record"]]
    errors = [abs(place["time"] - truth["time"]) for place, truth in right if place.get("time") is not None]
    return {
        "of": len(found),
        "record": len(right),
        "time_error_median": float(np.median(errors)) if errors else None,
        "time_error_most": max(errors, default=None),
    }


def time(trials: Sequence[Mapping]) -> dict[str, dict]:
    """Seconds of a diagnosis by group: of the processor, the median; of the wall clock, the longest and how many exceed the limit."""
    groups: dict[str, list[Mapping]] = {}
    for trial in trials:
        if "diagnosis" in trial and "cpu_seconds" in trial:
            groups.setdefault(trial["group"], []).append(trial)
    return {
        group: {
            "of": len(cases),
            "cpu_median": float(np.median([case["cpu_seconds"] for case in cases])),
            "longest": max(case["seconds"] for case in cases),
            "over_limit": sum(case["seconds"] > LIMIT for case in cases),
        }
        for group, cases in groups.items()
    }


def _by(trials: Sequence[Mapping], key: Callable[[Mapping], str]) -> dict[str, dict]:
    """Shares of the cases that have a key in common."""
    groups: dict[str, list[Outcome]] = {}
    for trial in trials:
        groups.setdefault(key(trial), []).append(outcome(trial))
    return {
        name: {
            "of": len(found),
            "detected": _share(found, lambda each: each.detected),
            "named": _share(found, lambda each: each.named),
            "named_or_twin": _share(found, lambda each: each.named_or_twin),
            "unlisted": _share(found, lambda each: each.verdict == UNLISTED),
            "refrained": _share(found, lambda each: each.refrained),
        }
        for name, found in sorted(groups.items())
    }


def _bin(strength: float) -> str:
    """Between which of the edges a strength lies."""
    for low, high in zip(_STRENGTH_EDGES[:-1], _STRENGTH_EDGES[1:], strict=True):
        if strength < high:
            return f"{low:g} to {high:g}"
    return f"{_STRENGTH_EDGES[-1]:g} and more"


def _share(outcomes: Sequence[Outcome], right: Callable[[Outcome], bool]) -> float | None:
    """Share of the outcomes that are so; None without any."""
    return sum(map(right, outcomes)) / len(outcomes) if outcomes else None


def _count(outcomes: Sequence[Outcome], so: Callable[[Outcome], bool]) -> dict:
    """How many are so, with the exact 95 % binomial interval of the share."""
    count = sum(map(so, outcomes))
    interval = binomtest(count, len(outcomes)).proportion_ci(0.95) if outcomes else None
    return {"count": count, "of": len(outcomes), "ci95": [float(interval.low), float(interval.high)] if interval else None}
