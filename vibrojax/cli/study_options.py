"""The options that all studies share: which model, where to, and how a long one is carried."""

import dataclasses
import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from vibrojax.cli.paths import check_file
from vibrojax.errors import InputError

_HELP = "How a long study is carried, and uncertainty"


def _extra(*names: str, metavar: str, text: str, **more: Any) -> Any:
    return typer.Option(*names, metavar=metavar, help=text, show_default=False, rich_help_panel=_HELP, **more)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Shared:
    """What the shared options say."""

    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the data set and the figure.", show_default=False)]
    model: Annotated[
        Path | None,
        typer.Option("--model", metavar="MODEL.json", help="A model.json of a fit, a diagnosis or a preset.", show_default=False),
    ] = None
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
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing unless something is wrong.")] = False

    def check(self) -> None:
        """Refuse what cannot be, before anything is imported.

        Raises:
            InputError: neither or both of --model and --fit, --draws without --fit, --cluster or --tile without --store; no model there.
        """
        if (self.model is None) == (self.fit is None):
            given = "neither --model nor --fit is" if self.model is None else "both --model and --fit are"
            raise InputError(f"{given} given: expected one of the two; name a MODEL.json, or the folder of a fit")
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


def with_shared(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose first argument `shared` stands on the command line as the options of `Shared`."""

    @functools.wraps(command)
    def called(**given: Any) -> None:
        shared = Shared(**{field.name: given.pop(field.name) for field in dataclasses.fields(Shared)})
        shared.check()
        command(shared, **given)

    options = [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default,
            annotation=field.type,
        )
        for field in dataclasses.fields(Shared)
    ]
    own = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in list(inspect.signature(command).parameters.values())[1:]]
    after = [p for p in options if p.name not in ("model", "out")]
    parameters = [*(p for p in options if p.name in ("model", "out")), *own, *after]
    called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    called.__annotations__ = {p.name: p.annotation for p in parameters}
    return called
