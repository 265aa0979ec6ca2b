"""`python notebooks/builder [NAME ...]`: run the percent scripts beside this folder and write each as `.ipynb` with its outputs."""

import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).resolve().parent.parent
LARGEST = 300_000
"""Bytes of one built notebook, which is committed."""


def main(names: list[str]) -> None:
    """Build the named notebooks, or all."""
    for script in [NOTEBOOKS / f"{name}.py" for name in names] or sorted(NOTEBOOKS.glob("*.py")):
        print(f"{script.name} ...", flush=True)
        target = build(script)
        print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB", flush=True)


def build(script: Path) -> Path:
    """Run one script from the root of the repository; the old `.ipynb` stays if a cell fails or the new one is too large."""
    notebook = jupytext.read(script)
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    client = NotebookClient(notebook, timeout=None, resources={"metadata": {"path": str(NOTEBOOKS.parent)}}, record_timing=False)
    client.execute()
    for number, cell in enumerate(notebook.cells, start=1):
        cell["id"] = f"cell-{number}"
    notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"]}
    text = nbformat.writes(notebook) + "\n"
    if len(text) > LARGEST:
        raise SystemExit(f"{script.name} would be built to {len(text)} bytes: expected at most {LARGEST}; make its figures smaller")
    target = script.with_suffix(".ipynb")
    target.write_text(text, encoding="utf-8")
    return target


if __name__ == "__main__":
    main(sys.argv[1:])
