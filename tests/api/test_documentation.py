"""The Python snippets of the documentation run as they stand, in order, on smaller requirements."""

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from designer import api
from support import ROOT
from support.imaging_designs import coarse_prototype
from support.shipped_problems import toml_with_coarse_pixels

SMALLER_REQUIREMENT = '\n[solve]\nstarts = 2\nconfigurations = ["folded-HyHy-Hy-*"]\n'
SMALLER_SWEEP = """
requirement = "../indoor_robot.toml"
[[axis]]
key = "envelope.height_mm"
values = [120, 130, 140]
"""


def snippets(page: str) -> list[str]:
    """The Python code blocks of a page of the documentation."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```$", text, flags=re.DOTALL | re.MULTILINE)


@pytest.fixture
def small_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the requirements that the documentation names, made small."""
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    path = tmp_path / "configs/indoor_robot.toml"
    text = toml_with_coarse_pixels(path.read_text(encoding="utf-8"))
    path.write_text(text + SMALLER_REQUIREMENT, encoding="utf-8")
    (tmp_path / "configs/sweeps/lens_and_baseline.toml").write_text(SMALLER_SWEEP, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_the_snippets_of_the_api_run(small_checkout: Path) -> None:
    blocks = snippets("api.md")
    assert len(blocks) >= 7
    names: dict[str, Any] = {}
    for block in blocks:
        if "next_version" in block:
            shutil.copytree(small_checkout / "reports/lens_and_baseline", small_checkout / "reports/next_version")
        exec(compile(block, "docs/api.md", "exec"), names)
    assert names["verdict"].passed
    assert names["checked"].passed
    assert len(names["result"].cloud.positions_mm) > 10_000
    assert names["comparison"].changed_winners.empty
    for name in ("best.json", "cross_section.svg", "raw.png", "points.ply"):
        assert (small_checkout / name).stat().st_size > 0


def test_the_snippet_for_real_sensors_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    design = coarse_prototype()
    api.write_design("design.json", design)
    api.write_image("raw.png", api.render(design, "office", samples=1, read_noise_electrons=8))
    (block,) = snippets("guide_real_sensor.md")
    names: dict[str, Any] = {}
    exec(compile(block, "docs/guide_real_sensor.md", "exec"), names)
    # The rendered camera is centred.
    assert names["placement"].center_px == pytest.approx(design.camera.principal_point_px, abs=0.1)
    assert (tmp_path / "points.ply").stat().st_size > 100_000
