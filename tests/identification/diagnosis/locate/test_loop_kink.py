"""Where the contact law has a kink, from loops of known laws along the example's motion, and what is said and drawn of it."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.diagnosis import UNLISTED, LoopKink
from identification.diagnosis.locate.loop_kink import loop_kink
from identification.diagnosis.score.force_loops import SeenLoops, Shown
from identification.diagnosis.sentences import sentences
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.diagnosis.made_loops import FRONT, with_loops
from tests.identification.made_result import made_result
from vibrojax.contact import HuntCrossley
from vibrojax.effects.deep_stop import Backed


@pytest.fixture(scope="module")
def diagnosis():
    return made_diagnosis(made_result(samples=300), UNLISTED)


def deepest_of(scored) -> dict[str, float]:
    """By file, m."""
    prepared = scored.fitted.prepared
    pairs = zip(prepared.experiment.records, prepared.motions, strict=True)
    return {record.file: float(motion.u.max()) - record.gap for record, motion in pairs if motion.touching.any()}


def test_the_depth_and_the_records_beyond_it_are_stated_however_the_gaps_are_set(motion):
    at = []

    def kinked(deepest: float) -> Backed:
        at.append(0.85 * deepest)
        return Backed(FRONT, 5e7, at[0], 0.5)

    for too_small in (0.0, 3e-4):
        scored = with_loops(motion, kinked, too_small=too_small)
        found = loop_kink(scored)
        beyond = [file for file, reached in deepest_of(scored).items() if reached - too_small > found.depth]
        assert found.depth == pytest.approx(at[0], rel=0.03)
        assert list(found.deeper) == beyond
        assert 0 < len(beyond) < len(found.files)


def test_both_laws_are_those_of_the_samples(motion):
    found = loop_kink(with_loops(motion, lambda deepest: Backed(FRONT, 5e7, 0.85 * deepest, 0.5)))
    beyond = found.indentation > found.depth
    rms = {name: np.sqrt(np.mean((getattr(found, name) - found.force)[beyond] ** 2)) for name in ("without_kink", "with_kink")}
    assert rms["with_kink"] < 0.3 * rms["without_kink"]
    assert rms["with_kink"] < 0.05 * found.force.max()


@pytest.mark.parametrize("law", [FRONT, HuntCrossley(2e7, 2.2, 0.8)])
def test_a_law_of_the_kind_that_was_fitted_has_no_kink(motion, law):
    assert loop_kink(with_loops(motion, lambda deepest: law)) is None


@pytest.mark.parametrize(
    ("depth", "all_pass", "is_found"),
    [(0.45, False, False), (0.55, False, True), (0.55, True, False), (1.01, False, False)],
    ids=["shallow", "deep", "passed by all", "passed by none"],
)
def test_a_kink_is_deep_and_some_records_stay_in_front_of_it(motion, monkeypatch, depth, all_pass, is_found):
    """Loops that show a kink just there; only some records come to half of the deepest indentation, but for the deepest alone."""

    def shown_at(self, effect):
        loops = self._read(load_cell=True)
        deepest = np.argmax(loops.indentation)
        kept = (loops.record == loops.record[deepest]) | (not all_pass)
        samples = {name: getattr(loops, name)[kept] for name in ("record", "contact", "indentation", "force", "modelled")}
        at = {f"{effect.name}.{effect.probe.kink}": depth * float(loops.indentation[deepest])}
        straight = dataclasses.replace(loops, **samples)
        return Shown(without_kink=straight, with_kink=dataclasses.replace(straight, values=loops.values | at))

    monkeypatch.setattr(SeenLoops, "shown", shown_at)
    found = loop_kink(with_loops(motion, lambda deepest: FRONT))
    assert (found is not None) == is_found


def made(deeper: int) -> LoopKink:
    """Of six records, some of which go beyond 28 mm."""
    reached = np.where(np.arange(6) < deeper, 0.031, 0.02)
    none = np.zeros(6)
    files = tuple(f"drop{k}.csv" for k in range(1, 7))
    return LoopKink(
        depth=0.0277,
        files=files,
        record=np.arange(6),
        contact=np.arange(6),
        indentation=reached,
        force=none,
        without_kink=none,
        with_kink=none,
    )


@pytest.mark.parametrize(
    ("deeper", "words"),
    [
        (1, "; only drop1.csv came that deep"),
        (3, "; only drop1.csv, drop2.csv and drop3.csv came that deep"),
        (4, "; 4 of 6 records came that deep"),
    ],
)
def test_the_sentence_says_where_and_in_which_records(diagnosis, deeper, words):
    location = dataclasses.replace(diagnosis.location, kink=made(deeper))
    said = sentences(UNLISTED, (), (), location, diagnosis.nominal, diagnosis.nominal, "")
    assert said[1] == location.sentence
    assert "rises faster beyond 28 mm than before" in said[2]
    assert words in said[2]


def test_without_a_kink_nothing_is_said(diagnosis):
    location = dataclasses.replace(diagnosis.location, kink=None)
    assert "came that deep" not in " ".join(sentences(UNLISTED, (), (), location, diagnosis.nominal, diagnosis.nominal, ""))
