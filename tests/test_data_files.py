"""The project's data are found in the repository, and in a wheel that was unpacked elsewhere."""

import shutil
import subprocess
import sys
import tarfile
import tomllib

import pytest

from vibrojax.data_files import data_path


def test_the_repository_s_data_are_found(root):
    assert data_path() == root / "data"
    assert data_path("README.md").is_file()


def test_what_is_not_there_is_named():
    with pytest.raises(FileNotFoundError, match="no 'no/such.csv' in the project's data folder"):
        data_path("no", "such.csv")


def test_a_wheel_carries_the_data(root, tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    for name in ("vibrojax", "identification", "data"):
        shutil.copytree(root / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(root / name, source / name)
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=source, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    shutil.unpack_archive(wheel, tmp_path / "site", "zip")
    code = "import sys; sys.path.insert(0, '.'); from vibrojax.data_files import data_path; print(data_path('README.md').read_text())"
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path / "site", check=True, capture_output=True, text=True)
    assert found.stdout.rstrip() == (root / "data" / "README.md").read_text().rstrip()
    carried = tmp_path / "site" / "vibrojax" / "_data"
    assert {path.relative_to(carried) for path in carried.rglob("*")} == {
        path.relative_to(source / "data") for path in (source / "data").rglob("*")
    }


def test_a_source_distribution_carries_what_its_tests_need(root, tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "--target", "sdist", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=root, check=True, capture_output=True)
    (source,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(source) as archive:
        carried = {name.partition("/")[2] for name in archive.getnames()}
    for folder in ("vibrojax", "identification", "data", "tests", "benchmarks", "docs", "notebooks"):
        files = [path for path in (root / folder).rglob("*") if path.suffix in (".py", ".ipynb", ".toml", ".html", ".md")]
        assert files and {path.relative_to(root).as_posix() for path in files} <= carried


def test_the_extra_for_tests_brings_what_builds_the_project(root):
    project = tomllib.loads((root / "pyproject.toml").read_text())
    assert set(project["build-system"]["requires"]) <= set(project["project"]["optional-dependencies"]["test"])
