"""The house rules that a machine can check: who imports whom, names, docstrings, no side effects."""

import ast
import functools
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

PACKAGES = ("vibrojax", "identification", "benchmarks")
MODULES = sorted(path.relative_to(ROOT) for package in PACKAGES for path in (ROOT / package).rglob("*.py"))


@functools.cache
def parse(module: Path) -> ast.Module:
    return ast.parse((ROOT / module).read_text(encoding="utf-8"))


def offenders(found):
    """Modules for which a rule finds something, each with what it finds."""
    return {str(module): wrong for module in MODULES if (wrong := found(module))}


def imported(tree: ast.Module) -> set[str]:
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


def test_both_packages_are_looked_at():
    assert {module.parts[0] for module in MODULES} >= {"vibrojax", "identification"}


def test_imports_go_one_way():
    """The commands know both packages; nothing imports what is not installed with it."""

    def wrong(module):
        packages = {name.split(".")[0] for name in imported(parse(module))}
        physics = module.parts[0] == "vibrojax" and module.parts[1] != "cli"
        installed = module.parts[0] in ("vibrojax", "identification")
        return packages & ({"identification", "benchmarks"} if physics else set()) | packages & (
            {"tests", "benchmarks", "data"} if installed else set()
        )

    assert not offenders(wrong)


FLOW = (
    "experiment",
    "wording",
    "guesses",
    "trajectory",
    "result",
    "estimation",
    "diagnosis",
    "estimation.estimate",
    "report",
    "commands",
)
"""Folders of `identification` in the order in which a record passes through them; a fit with effects takes them from the diagnosis."""


def test_a_record_passes_through_the_folders_in_one_direction():
    """No folder imports from a later one; `inspection` and `recipes` build on the experiment alone."""
    order = {name: place for place, name in enumerate(FLOW)} | {"inspection": 0.5, "recipes": 0.5}

    def place(name: str) -> float:
        _, folder, *inside = name.split(".")
        return order.get(".".join((folder, *inside[:1])), order[folder])

    modules = [module for module in MODULES if module.parts[0] == "identification" and len(module.parts) > 2]
    assert {module.parts[1] for module in modules} == {name.partition(".")[0] for name in order}
    back = {
        f"{module} imports {name}"
        for module in modules
        for name in imported(parse(module))
        if name.startswith("identification.") and place(name) > place(".".join(module.with_suffix("").parts))
    }
    assert not back


def test_tests_share_through_plain_modules():
    """A module of tests that is imported for its helpers runs whatever else it holds, and hides who uses them."""
    tests = sorted((ROOT / "tests").rglob("*.py"))
    borrowed = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in tests
        for name in imported(ast.parse(path.read_text(encoding="utf-8")))
        if name.startswith("tests.") and name.rpartition(".")[2].startswith("test_")
    }
    assert len(tests) > 100
    assert not borrowed


def test_a_module_is_named_after_what_it_holds():
    assert not [module for module in MODULES if module.stem in {"utils", "util", "helpers", "helper", "misc", "common"}]


def test_modules_and_public_names_have_a_docstring():
    def silent(module):
        definitions = [n for n in parse(module).body if isinstance(n, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)]
        public = [node for node in definitions if not node.name.startswith("_")]
        return ["the module"] * (not ast.get_docstring(parse(module))) + [node.name for node in public if not ast.get_docstring(node)]

    assert not offenders(silent)


def test_annotations_are_evaluated():
    """Otherwise shapes are strings that the import hook cannot check."""
    assert not offenders(lambda module: "__future__" in imported(parse(module)))


IMPORT_EVERYTHING = """
import importlib, json, os, pkgutil, sys
before = dict(os.environ)
import vibrojax
jax_came_along = "jax" in sys.modules
for found in pkgutil.walk_packages(vibrojax.__path__, "vibrojax."):
    importlib.import_module(found.name)
import jax
json.dump({"jax_came_along": jax_came_along, "x64": jax.config.jax_enable_x64, "environment_kept": before == dict(os.environ),
           "backends": list(jax._src.xla_bridge._backends)}, sys.stderr)
"""


def test_importing_has_no_side_effect(tmp_path):
    done = subprocess.run([sys.executable, "-W", "error", "-c", IMPORT_EVERYTHING], capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout == ""
    assert json.loads(done.stderr) == {"jax_came_along": False, "x64": False, "environment_kept": True, "backends": []}
    assert list(tmp_path.iterdir()) == []
