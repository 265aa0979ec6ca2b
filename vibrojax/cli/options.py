"""Options that several commands share: of experiments, and of studies (rig, values, place, style, how a long one is carried, and more)."""

import dataclasses
import functools
import inspect
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from identification.wording import STYLE_NAMES
from vibrojax.cli.source import check_file
from vibrojax.errors import InputError
from vibrojax.figure_style import FIGURE_STYLES, SCREEN

Experiment = Annotated[
    Path | None,
    typer.Argument(metavar="[EXPERIMENT]", help="Folder of the experiment, or its experiment.toml. Left out: the embedded example."),
]
Recipe = Annotated[
    str | None, typer.Option(metavar="NAME", help="Use recordings published by others, read as this recipe says; with --data.")
]
Data = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of the recipe's recordings.")]


def one_of(known: Collection[str], what: str, remedy: str = "") -> Callable[[Any], Any]:
    """A callback that refuses a name, or one of several, that is not among the known ones."""

    def check(given: Any) -> Any:
        for name in [given] if isinstance(given, str) else given or ():
            if name not in known:
                raise typer.BadParameter(f"{name!r} is no {what}{remedy}")
        return given

    return check


Style = Annotated[
    str,
    typer.Option(
        metavar="|".join(STYLE_NAMES),
        help="Page and plots in colours, or in black and white for paper, with a PDF file of each plot.",
        callback=one_of(STYLE_NAMES, "style"),
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")]


Term = Annotated[
    list[str] | None,
    typer.Option(
        "--term",
        metavar="[NAME=]FORMULA",
        help="Force on the hammer, N, positive towards the stop, such as -a*u_dot*abs(u_dot); names other than u, u_dot, t, delta,"
        " delta_dot and pi are estimated. May be repeated.",
    ),
]
Start = Annotated[
    list[str] | None,
    typer.Option(
        "--start",
        metavar="NAME=VALUE",
        help="First value, SI, of a parameter of a --term; a factor in front of it needs none. May be repeated.",
    ),
]


_HELP = "How a long study is carried, and uncertainty"
PRESETS = ("wires", "beam_170", "beam_150", "beam_135", "drilling_hammer")
"""As `vibrojax.presets.NAMES`, which loads more."""


def _extra(*names: str, metavar: str, text: str, **more: Any) -> Any:
    return typer.Option(*names, metavar=metavar, help=text, rich_help_panel=_HELP, **more)


Preset = Annotated[
    str | None,
    typer.Option(
        "--preset",
        metavar="NAME",
        help="A rig of the thesis in place of --model (see vibrojax presets list); brings A0, gaps, and what is swept, where not given.",
        callback=one_of(PRESETS, "preset", f": expected one of {', '.join(PRESETS)}; see vibrojax presets list"),
    ),
]
Amplitude = Annotated[float | None, typer.Option("--base-amplitude", "--amplitude", metavar="M", help="Amplitude A0 of the cart, m.")]
Sweep = Annotated[
    list[str] | None,
    typer.Option(
        "--sweep",
        metavar="[NAME=]A:B:N",
        help="What is swept: N values from A to B, SI (frequency in Hz); of a preset also NAME alone. Repeat it for two axes.",
    ),
]
Gaps = Annotated[str | None, typer.Option("--gap", "--gaps", metavar="M,M,...", help="Gap, m; one or several.")]
Frequencies = Annotated[str | None, typer.Option("--frequency", metavar="HZ,HZ,...", help="Excitation frequency, Hz; one or several.")]
Vary = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="NAME=A,B,...",
        help="Further values to make the study for, such as k_i=1e6,1e7 or f_n=4.5,6. Repeat it for another.",
    ),
]
FigureLook = Annotated[
    str,
    typer.Option(
        "--style",
        metavar="|".join(FIGURE_STYLES),
        help="Sizes of the figure: for the screen; 84 or 174 mm wide for a paper or thesis; 160 or 300 mm wide for a talk.",
        callback=one_of(FIGURE_STYLES, "style"),
    ),
]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Shared:
    """What the shared options say."""

    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for data set, figure and caption.")]
    model: Annotated[Path | None, typer.Option("--model", metavar="MODEL.json", help="A model.json of a fit, a diagnosis or a preset.")] = (
        None
    )
    preset: Preset = None
    base_amplitude: Amplitude = None
    sweep: Sweep = None
    gap: Gaps = None
    frequency: Frequencies = None
    vary: Vary = None
    style: FigureLook = SCREEN.name
    fit: Annotated[
        Path | None,
        _extra("--fit", metavar="FIT_DIR", text="Folder of a fit, in place of --model: the study is made for draws of its parameters."),
    ] = None
    draws: Annotated[int | None, _extra("--draws", metavar="N", text="How many draws. Left out: 100.", min=1)] = None
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of the draws.", min=0, rich_help_panel=_HELP)] = 0
    store: Annotated[
        Path | None, _extra("--store", metavar="DIR.zarr", text="Zarr store for the study as it grows; the same command resumes it.")
    ] = None
    tile: Annotated[int | None, _extra("--tile", metavar="N", text="Operating points that are made and stored at a time.", min=1)] = None
    cluster: Annotated[
        str | None,
        _extra("--cluster", metavar="ADDRESS", text="Dask scheduler whose workers make the tiles; needs --store on a shared disk."),
    ] = None
    quiet: Quiet = False

    def check(self) -> None:
        """Refuse what cannot be, before anything is imported.

        Raises:
            InputError: none or several of --model, --preset and --fit, --draws without --fit, --cluster or --tile without --store; no
                model there.
        """
        check_rig({"--model": self.model, "--preset": self.preset, "--fit": self.fit})
        if self.draws is not None and self.fit is None:
            raise InputError("--draws is given without --fit: expected the fit whose parameters are drawn; add --fit FIT_DIR")
        for name, value in (("--cluster", self.cluster), ("--tile", self.tile)):
            if value is not None and self.store is None:
                raise InputError(f"{name} is given without --store: expected the place where tiles are put; add --store DIR.zarr")
        if self.model is not None:
            check_file(self.model, "the model.json that a fit or a preset wrote")
        if self.fit is not None:
            for name in ("model.json", "fit.json"):
                check_file(self.fit / name, "the folder that a fit wrote, with its model.json and fit.json")


def check_rig(given: dict[str, Any]) -> None:
    """Refuse a command line that names no rig, or several.

    Example:
        >>> check_rig({"--model": None, "--preset": None})
        Traceback (most recent call last):
        vibrojax.errors.InputError: none of --model and --preset is given: expected one of them; add one
    """
    *first, last = given
    chosen = [name for name, value in given.items() if value is not None]
    if not chosen:
        raise InputError(f"none of {', '.join(first)} and {last} is given: expected one of them; add one")
    if len(chosen) > 1:
        raise InputError(f"both {chosen[0]} and {chosen[1]} are given: expected one of them; leave one out")


def with_shared(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose first argument `shared` stands on the command line as the options of `Shared`."""

    @functools.wraps(command)
    def called(**given: Any) -> None:
        shared = Shared(**{field.name: given.pop(field.name) for field in dataclasses.fields(Shared)})
        shared.check()
        command(shared, **given)

    def option(field: dataclasses.Field[Any]) -> inspect.Parameter:
        default = inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default
        return inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=field.type)

    options = [option(field) for field in dataclasses.fields(Shared)]
    own = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in list(inspect.signature(command).parameters.values())[1:]]
    cut = 1 + [p.name for p in options].index("style")
    parameters = [*options[:cut], *own, *options[cut:]]
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {p.name: p.annotation for p in parameters}
    return called


@dataclasses.dataclass(frozen=True, kw_only=True)
class Over:
    """What is asked for by options; nothing where left out.

    Attributes:
        borders: of a Peterka map, the `borders.csv` of `vibrojax continue --along`.
        branches: of a bifurcation diagram, tables of `vibrojax continue`.
        manifolds: of basins, cycles of the longest saddle orbit whose manifolds are drawn.
    """

    borders: Path | None = None
    branches: Sequence[Path] = ()
    manifolds: int | None = None

    def check(self, jobs: Sequence[Any]) -> None:
        """Refuse what cannot be drawn over the studies, before they are made.

        Raises:
            InputError: several diagrams for branches of one rig, files that are no branches, or basins that have no manifolds
                (`basin_manifolds.checked_rig`).
        """
        if self.branches and len(jobs) > 1:
            raise InputError(f"--branches is given with {len(jobs)} diagrams: expected one, that of the branches; give one value of each")
        if self.branches:
            from vibrojax.studies.continuation_lines import read_branches

            read_branches(self.branches, jobs[0].settings["parameter"])
        if self.manifolds is not None:
            from vibrojax.studies.basin_manifolds import checked_rig

            for job in jobs:
                checked_rig(job.model, self.manifolds, job.axes["u0"], job.axes["v0"], job.settings)

    def drawn(self, data: Any, model: Any, say: Callable[[str], None]) -> Any:
        """The study with what is drawn over it."""
        if self.borders is not None:
            from vibrojax.studies.continuation_lines import with_borders

            data = with_borders(data, model, self.borders)
        if self.branches:
            from vibrojax.studies.continuation_lines import with_branches

            data = with_branches(data, self.branches)
        if self.manifolds is not None:
            from vibrojax.studies.basin_manifolds import with_manifolds

            data = with_manifolds(data, model, self.manifolds, say)
        return data


NOTHING_OVER = Over()
