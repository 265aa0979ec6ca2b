"""The command line's reference as Markdown, read off the commands themselves."""

from collections.abc import Iterator

import typer
from typer.core import TyperArgument, TyperCommand, TyperGroup, TyperOption

from vibrojax.cli import main


def commands() -> str:
    """A section for every command of `vibrojax`."""
    return "\n".join(_section(name, command) for name, command in leaves("vibrojax", typer.main.get_command(main.app)))


def leaves(name: str, command: TyperCommand | TyperGroup) -> Iterator[tuple[str, TyperCommand]]:
    """Every command that does work, under its full name."""
    if isinstance(command, TyperGroup):
        for part, below in command.commands.items():
            yield from leaves(f"{name} {part}", below)
    else:
        yield name, command


def _section(name: str, command: TyperCommand | TyperGroup) -> str:
    arguments = [p for p in command.params if isinstance(p, TyperArgument)]
    options = [p for p in command.params if isinstance(p, TyperOption) and not p.hidden]
    required = [f"{option.opts[0]} {option.metavar}" for option in options if option.required]
    more_options = [] if len(required) == len(options) else ["[OPTIONS]"]
    usage = " ".join([name, *(_argument(argument) for argument in arguments), *required, *more_options])
    about, *more = (command.help or "").strip().split("\n\n")
    lines = [f"## {name}", "", about, "", f"```text\n{usage}\n```", "", *(f"{part}\n" for part in more)]
    lines += [
        "| option | value | what it does |",
        "|---|---|---|",
        *(_row(f"`{_argument(a)}`", "", getattr(a, "help", "")) for a in arguments),
    ]
    lines += [_row(", ".join(f"`{spelled}`" for spelled in option.opts), _value(option), option.help) for option in options]
    return "\n".join([*lines, "", *_example(command.epilog), ""])


def _argument(argument: TyperArgument) -> str:
    shown = (argument.metavar or (argument.name or "").upper()).strip("[]")
    return shown if argument.required else f"[{shown}]"


def _value(option: TyperOption) -> str:
    """What follows the option, and its default."""
    if option.is_flag:
        return ""
    value = f"`{option.metavar or 'VALUE'}`"
    if option.required:
        return f"{value}, required"
    default = " ".join(map(str, option.default)) if isinstance(option.default, tuple) else option.default
    return value if default is None else f"{value}, default {default}"


def _row(*cells: str | None) -> str:
    return "| " + " | ".join((cell or "").replace("|", "\\|") for cell in cells) + " |"


def _example(epilog: str | None) -> list[str]:
    return [] if not epilog else [f"```sh\n{epilog.removeprefix('Example:').strip()}\n```"]
