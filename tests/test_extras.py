"""What works without the optional parts of the installation, and what asks for them in one line."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from designer.extras import MODULES, PACKAGES

ROOT = Path(__file__).parents[1]
DESIGN = ROOT / "tests" / "data" / "folded_hypl_hy.json"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PROJECT, GROUPS = PYPROJECT["project"], PYPROJECT["dependency-groups"]

# Nothing that an extra brings can be found or imported.
CORE_ONLY = f"""
import sys
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {sorted({module for modules in MODULES.values() for module in modules})!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Absent())
import importlib.util
found = importlib.util.find_spec
def find_spec(name, package=None):
    try:
        return found(name, package)
    except ModuleNotFoundError:
        return None
importlib.util.find_spec = find_spec
"""


def run(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """The command line in a process of its own, with the core alone."""
    program = CORE_ONLY + "from designer.__main__ import main\nmain()\n"
    return subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, cwd=folder, check=False
    )


def test_every_extra_of_the_project_has_its_modules():
    assert set(MODULES) == (set(PROJECT["optional-dependencies"]) - {"dev"}) | set(PACKAGES)
    for group, package in PACKAGES.items():
        assert any(line.startswith(f"{package}>=") for line in GROUPS[group])


def test_a_study_without_checks_and_pdf_needs_no_extra(tmp_path):
    configuration = "folded-HyHy-Hy-upper_outer"
    requirement = str(ROOT / "configs" / "indoor_robot.toml")
    options = ["--no-pdf", "--checks", "0", "--jobs", "1", "--only", configuration, "--out", "found"]
    ended = run("study", requirement, *options, folder=tmp_path)
    assert ended.returncode == 0, ended.stderr
    design = tmp_path / "found" / "designs" / f"{configuration}.json"
    assert json.loads(design.read_text(encoding="utf-8"))["configuration"] == configuration
    assert configuration in (tmp_path / "found" / "study.html").read_text(encoding="utf-8")
    for arguments in (
        ["trace", str(design)],
        ["evaluate", str(design)],
        ["export", str(design), "--to", "sag", "-o", "sag"],
    ):
        ended = run(*arguments, folder=tmp_path)
        assert ended.returncode == 0, ended.stderr


@pytest.mark.parametrize(
    ("arguments", "extra"),
    [
        (["study", str(ROOT / "configs" / "indoor_robot.toml")], "report"),
        (["study", str(ROOT / "configs" / "indoor_robot.toml"), "--no-pdf"], "imaging"),
        (["report", "."], "report"),
        (["check", str(DESIGN)], "imaging"),
        (["render", str(DESIGN), "-o", "raw.png"], "imaging"),
        (["stereo", str(DESIGN), "raw.png", "-o", "found"], "imaging"),
        (["sweep", str(ROOT / "configs" / "sweeps" / "lens_and_baseline.toml")], "report"),
        (["export", str(DESIGN), "--to", "dxf", "-o", "mirrors.dxf"], "dxf"),
        (["export", str(DESIGN), "--to", "drawing", "-o", "sheets"], "drawing"),
        (["order", str(DESIGN), "-o", "order"], "drawing"),
        (["export", str(DESIGN), "--to", "step", "-o", "solids"], "step"),
    ],
    ids=lambda value: " ".join(value[:1]) if isinstance(value, list) else value,
)
def test_what_needs_an_extra_says_which_before_any_work(arguments, extra, tmp_path):
    ended = run(*arguments, folder=tmp_path)
    assert ended.returncode == 2
    assert ended.stdout == ""
    assert ended.stderr.count("\n") == 1
    assert f"pip install {PACKAGES.get(extra, repr(f'catadioptric-designer[{extra}]'))}" in ended.stderr
    assert list(tmp_path.iterdir()) == []
