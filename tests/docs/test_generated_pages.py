"""The parts of the pages that are generated: complete, and in the places that are marked for them."""

import re
from pathlib import Path

import pytest
import typer

from benchmarks.fingerprints import FINGERPRINTS, effect_of
from vibrojax.cli import main
from vibrojax.effects import EFFECTS

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture
def pages(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "generate"))
    import pages

    return pages


def test_every_command_and_option_is_on_the_page(pages):
    text = pages.filled("cli.md", (DOCS / "cli.md").read_text(encoding="utf-8"))
    sections = dict(re.findall(r"^## (vibrojax [^\n]+)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    app = typer.main.get_command(main.app)
    below = {**app.commands, **{f"presets {name}": command for name, command in app.commands["presets"].commands.items()}}
    expected = {f"vibrojax {name}": command for name, command in below.items() if name != "presets"}
    assert set(sections) == set(expected)
    for name, command in expected.items():
        options = [
            option
            for parameter in command.params
            if not getattr(parameter, "hidden", False)
            for option in parameter.opts
            if option.startswith("--")
        ]
        assert [option for option in options if f"`{option}`" not in sections[name]] == []


def test_every_effect_is_on_the_page(pages):
    text = pages.filled("effects.md", (DOCS / "effects.md").read_text(encoding="utf-8"))
    assert re.findall(r"^## `(\w+)`$", text, re.MULTILINE) == list(EFFECTS)
    for effect in EFFECTS.values():
        assert effect.equation in text
        assert all(f"`{p.name}`" in text for p in effect.parameters)


def test_pictures_are_those_of_listed_effects():
    assert set(EFFECTS) >= set(FINGERPRINTS) == {path.stem for path in (DOCS / "images" / "effects").glob("*.png")}


def test_an_effect_without_a_picture_is_on_the_page_too(pages, monkeypatch):
    text = pages.filled("effects.md", "<!-- catalogue -->")
    monkeypatch.delitem(FINGERPRINTS, "quadratic_drag")
    without = pages.filled("effects.md", "<!-- catalogue -->")
    assert re.findall(r"images/effects/(\w+)", without) == [name for name in EFFECTS if name in FINGERPRINTS]
    assert re.findall(r"^## `(\w+)`$", without, re.MULTILINE) == re.findall(r"^## `(\w+)`$", text, re.MULTILINE)


@pytest.mark.parametrize("name", FINGERPRINTS)
def test_a_picture_shows_its_effect(name):
    assert effect_of(name).name == name


def test_a_page_without_its_mark_is_refused(pages):
    with pytest.raises(ValueError, match="holds 0 marks"):
        pages.filled("cli.md", "# Command line\n")
