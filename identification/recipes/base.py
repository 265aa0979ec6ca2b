"""What turns recordings made by others into an experiment.

A recipe is a folder `data/recipes/NAME` with an `experiment.toml` as any experiment has and a `recipe.toml` that says where the recordings
come from and which part of which raw file becomes which record. The recordings themselves never come with the project.

A raw reader knows the layout of one data set and nothing else: it returns columns under names and in units of its choice, which the
recipe's `experiment.toml` then declares.

To add one: write a function `(folder, cut) -> columns` of the type `RawReader` in `layouts.py`, then list it in `RAW_READERS` there.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Cut:
    """One record of a recipe: a stretch of a raw file.

    Attributes:
        file: name of the record, as in the experiment file.
        source: raw file, relative to the data set's folder.
        start: first instant, s, on the raw file's clock.
        stop: last instant, s.
        options: what else the raw reader needs to know.
    """

    file: str
    source: str
    start: float
    stop: float
    options: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """A checked `recipe.toml`.

    Attributes:
        name: of the recipe.
        folder: with `recipe.toml` and `experiment.toml`.
        title: one line on the rig.
        origin: address of the recordings.
        licence: of the recordings.
        citation: of whoever made them.
        obtain: how to come by the files, in a sentence or two.
        expect: what the nominal model explains and what it does not, in a sentence.
        reader: name of the raw reader.
        data_folder: usual name of the data set's folder.
        sha256: digest of every raw file that is needed, by its path in the data set's folder.
        cuts: the records.
    """

    name: str
    folder: Path
    title: str
    origin: str
    licence: str
    citation: str
    obtain: str
    expect: str
    reader: str
    data_folder: str
    sha256: Mapping[str, str]
    cuts: tuple[Cut, ...]


RawReader = Callable[[Path, Cut], dict[str, np.ndarray]]
"""From the data set's folder and a cut to columns of equal length, `time` (s, from 0) among them."""
