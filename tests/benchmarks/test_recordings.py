import json

import pytest

from benchmarks.recordings import __main__ as command
from benchmarks.recordings import runs
from benchmarks.recordings.known import KNOWN
from benchmarks.recordings.page import BEGIN, END, row, write_page
from benchmarks.recordings.runs import Run, finished, run
from identification.recipes.load import recipe_names
from vibrojax.effects import EFFECTS

DOCUMENT = {
    "verdict": "missing",
    "sentences": ["Dry friction explains 80 % of it.", "The error falls."],
    "warnings": ["the last fit stopped early"],
    "effects": [{"name": "coulomb_friction", "parameters": {"friction_force": {"value": 9400.0, "stderr": 120.0, "unit": "N"}}}],
    "nominal": {"held_out_nrmse": 0.64, "chi2_reduced": 1.08e5, "held_back": {"later.npz": {"reaction_force": 0.64}}},
    "augmented": {"held_out_nrmse": 0.21, "chi2_reduced": 4.54, "held_back": {"later.npz": {"reaction_force": None}}},
}
FRICTION = next(known for known in KNOWN if known.recipe == "friction_backlash")


def made(folder, document=DOCUMENT, failure=""):
    return Run(
        recipe="friction_backlash",
        folder=folder,
        document=document,
        failure=failure,
        seconds=61.2,
        cpu_seconds=40.0,
        peak_mb=903.4,
        budget_minutes=5.0,
        revision="abc1234",
    )


def test_what_is_known_is_of_recipes_and_effects_that_there_are():
    names = [known.recipe for known in KNOWN]
    assert len(set(names)) == len(names) and set(names) <= set(recipe_names())
    assert {effect for known in KNOWN for group in known.expected for effect in group} <= set(EFFECTS)
    assert all(known.question.endswith(("?", ".")) and known.cannot.endswith(".") and not known.truth.endswith(".") for known in KNOWN)


def test_what_no_effect_stands_for_is_not_held_against_a_diagnosis():
    assert next(known for known in KNOWN if not known.expected).agreement({"coulomb_friction"}) == "not on the list"


def test_a_diagnosis_without_a_name_abstains():
    assert FRICTION.agreement(set()) == "abstained" and FRICTION.agreement({"gap_step"}) == "no"


def test_a_row_holds_errors_effects_and_what_is_known(tmp_path):
    cells = [cell.strip() for cell in row(FRICTION, made(tmp_path)).strip("|").split("|")]
    assert cells[:3] == ["`friction_backlash`", "0.64 → 0.21", "1.08e+05 → 4.54"]
    assert cells[3].startswith("missing: coulomb_friction (F_c = 9400 ± 120 N")
    assert cells[4:] == [FRICTION.truth, "yes", "61", "903"]


@pytest.mark.parametrize(
    ("gaps", "place"), [((1.0, 1.0), "u_stop = 0.006000 ± 0.000010 m"), ((1.0, 0.5), "gap_0 = −0.994000 ± 0.000010 m")]
)
def test_a_stop_stands_where_it_is_if_all_records_have_one_gap(tmp_path, gaps, place):
    stop = {"name": "missing_stop", "parameters": {"gap_offset": {"value": -0.994, "stderr": 1e-5, "unit": "m"}}}
    nominal = DOCUMENT["nominal"] | {"records": {f"{number}.csv": {"gap": gap} for number, gap in enumerate(gaps)}}
    assert f"missing_stop ({place})" in row(FRICTION, made(tmp_path, DOCUMENT | {"effects": [stop], "nominal": nominal}))


def test_a_learned_term_stands_where_no_effect_is_named_and_breaks_no_cell(tmp_path):
    document = DOCUMENT | {"verdict": "unlisted", "effects": [], "free_form": "force = -0.1 N |u'| u'"}
    assert "| unlisted; learned: force = -0.1 N \\|u'\\| u' |" in row(FRICTION, made(tmp_path, document))


def test_a_failure_stays_in_the_table(tmp_path):
    cells = row(FRICTION, made(tmp_path, document=None, failure="no convergence")).split("|")
    assert "failed: no convergence" in cells[4] and cells[6].strip() == "no"


def test_the_page_is_written_between_its_marks_and_again(tmp_path):
    (tmp_path / "record-01-before-after.png").write_bytes(b"a picture")
    page = tmp_path / "docs" / "recordings.md"
    page.parent.mkdir()
    page.write_text(f"# Before\n{BEGIN}\nold\n{END}\nAfter\n")
    for _ in range(2):
        write_page(page, [(FRICTION, made(tmp_path))])
    text = page.read_text()
    assert text.startswith("# Before\n") and text.endswith("After\n") and "old" not in text
    assert text.count("## friction_backlash") == 1
    assert "> Dry friction explains 80 % of it. The error falls." in text
    assert (page.parent / "images" / "recordings" / "friction_backlash.png").read_bytes() == b"a picture"
    page.write_text("no marks")
    with pytest.raises(SystemExit, match="lacks the lines"):
        write_page(page, [])
    assert page.read_text() == "no marks"


def test_what_is_finished_is_kept_and_what_failed_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(
        runs, "_VIBROJAX", "import sys, pathlib; out = pathlib.Path(sys.argv[-1]); out.mkdir(); (out / 'diagnosis.json').write_text('{}')"
    )
    assert finished("silverbox", tmp_path) is None
    done = run("silverbox", tmp_path, tmp_path / "out", budget_minutes=1.0)
    assert done.document == {} and done.peak_mb > 1.0
    assert finished("silverbox", tmp_path / "out") == done
    monkeypatch.setattr(runs, "_VIBROJAX", "raise SystemExit('recordings are not there')")
    failed = run("pcb_shock", tmp_path, tmp_path / "out", budget_minutes=1.0)
    assert failed.document is None and failed.failure == "recordings are not there"
    assert finished("pcb_shock", tmp_path / "out") is None


def test_the_command_goes_on_where_it_stopped(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(command, "finished", lambda recipe, out: made(tmp_path) if recipe == "friction_backlash" else None)
    monkeypatch.setattr(command, "run", lambda recipe, *a, **k: made(tmp_path, None, "x") if recipe == "silverbox" else pytest.fail(recipe))
    arguments = ["recordings", "--data", "d", "--out", "o", "--json", str(tmp_path / "x.json"), "friction_backlash", "silverbox"]
    monkeypatch.setattr("sys.argv", arguments)
    command.main()
    rows = json.loads((tmp_path / "x.json").read_text())["recordings"]
    assert rows["friction_backlash"]["agrees"] == "yes" and rows["silverbox"]["failure"] == "x"
    assert capsys.readouterr().out.count("\n") == 2


def test_the_page_keeps_what_is_not_named_and_another_budget_is_another_run(tmp_path, monkeypatch, capsys):
    ran = []
    monkeypatch.setattr(command, "finished", lambda recipe, out: made(tmp_path))
    monkeypatch.setattr(command, "run", lambda recipe, *a, **k: ran.append(recipe) or made(tmp_path))
    page = tmp_path / "page.md"
    page.write_text(f"{BEGIN}\n{END}\n")
    arguments = ["recordings", "--data", "d", "--out", "o", "--page", str(page)]
    for more, expected in ((["silverbox"], []), (["silverbox", "--budget-minutes", "9"], ["silverbox"]), (["--only-page"], [])):
        ran.clear()
        monkeypatch.setattr("sys.argv", [*arguments, *more])
        command.main()
        assert ran == expected
        assert page.read_text().count("## friction_backlash") == len(KNOWN)
    monkeypatch.setattr("sys.argv", [*arguments, "cyberdiver_damped"])
    with pytest.raises(SystemExit):
        command.main()
    assert "invalid choice: 'cyberdiver_damped'" in capsys.readouterr().err
