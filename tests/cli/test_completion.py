"""The shell completes commands and options without loading anything heavy, and every command's help ends with an example."""

import os
import subprocess
import sys

import pytest
import typer
from typer.core import TyperGroup

from vibrojax.cli import fit, main


@pytest.mark.parametrize(
    ("module", "words", "expected"), [("main", "vibrojax ins", "inspect"), ("main", "vibrojax fit --refe", "--reference")]
)
def test_bash_completes_commands_and_options(module, words, expected):
    code = f"import sys\nsys.argv[0] = 'vibrojax'\nfrom vibrojax.cli.{module} import main\nmain()"
    asked = {"_VIBROJAX_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=os.environ | asked)
    assert done.stdout.split() == [expected]


@pytest.mark.parametrize("app", [main.app, fit.app], ids=["vibrojax", "fit-parameters"])
def test_completion_can_be_shown_and_installed(app):
    offered = {option for parameter in typer.main.get_command(app).params for option in parameter.opts}
    assert {"--show-completion", "--install-completion"} <= offered


def commands(command, name):
    """A command and all below it."""
    yield name, command
    if isinstance(command, TyperGroup):
        for word, below in command.commands.items():
            yield from commands(below, f"{name} {word}")


@pytest.mark.parametrize(
    ("name", "command"), list(commands(typer.main.get_command(main.app), "vibrojax")), ids=lambda value: str(value)[:40]
)
def test_help_of_every_command_ends_with_its_example(name, command):
    """A group shows one of its commands."""
    assert f"{command.epilog} ".startswith(f"Example:  {name} ")
    assert "\n" not in command.epilog
