"""Stores of studies that are damaged on the disk and then resumed: is every damage noticed?"""

import random
import shutil
from pathlib import Path
from typing import Any

import xarray as xr

from benchmarks.reliability.own_files import store_job
from benchmarks.resume import contents

UNNOTICED, REFUSED, REPAIRED = "unnoticed", "refused", "repaired"


def damaged_stores(count: int, seed: int, folder: Path) -> tuple[dict[str, int], list[str]]:
    """Damage a whole store so many times, each time anew.

    Returns:
        How many were refused, repaired to the same bytes, or gave other numbers, or bytes, with no word; and a line for each of the last.
    """
    from vibrojax.errors import InputError
    from vibrojax.studies.run import make

    job, rng, store = store_job(), random.Random(seed), folder / "a.zarr"
    whole = make(job, store=store)
    before = contents(store)
    found: dict[str, int] = dict.fromkeys((REFUSED, REPAIRED, UNNOTICED), 0)
    wrong: list[str] = []
    for _ in range(count):
        what = _damage(store, rng)
        try:
            again = make(job, store=store, notice=lambda text: None)
            outcome = REPAIRED if _same(again, whole) and contents(store) == before else UNNOTICED
        except InputError:
            outcome = REFUSED
        found[outcome] += 1
        wrong += [f"store: {what}"] if outcome == UNNOTICED else []
        shutil.rmtree(store)
        for name, content in before.items():
            (store / name).parent.mkdir(parents=True, exist_ok=True)
            (store / name).write_bytes(content)
    return found, wrong


def _damage(store: Path, rng: random.Random) -> str:
    """Change one file, or take an array away; in words."""
    files = sorted(path for path in store.rglob("*") if path.is_file())
    file = rng.choice(files)
    name, content = str(file.relative_to(store)), file.read_bytes()
    way = rng.choice(("bit", "cut", "deleted", "another chunk", "array deleted"))
    if way == "bit":
        place = rng.randrange(len(content))
        file.write_bytes(content[:place] + bytes([content[place] ^ 1 << rng.randrange(8)]) + content[place + 1 :])
    elif way == "cut":
        file.write_bytes(content[: rng.randrange(len(content))])
    elif way == "deleted":
        file.unlink()
    elif way == "another chunk":
        file.write_bytes(rng.choice([each for each in files if each.read_bytes() != content]).read_bytes())
    else:
        shutil.rmtree(store / rng.choice(sorted(path.name for path in store.iterdir() if path.is_dir())))
    return f"{way} {name}"


def _same(one: Any, other: Any) -> bool:
    try:
        xr.testing.assert_identical(one, other)
    except AssertionError:
        return False
    return True
