"""Results show themselves in a notebook as short tables, and nothing that a user wrote becomes markup."""

import dataclasses
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from designer import api
from designer.imaging.endtoend.bands import Band
from designer.imaging.endtoend.check import EndToEndCheck
from designer.imaging.endtoend.noise import Noise
from designer.notebook_html import percent, text_of
from designer.study.compare import StudyComparison
from support import ROOT
from support.analytic_room import Waves, eccentric_wall, raw_image
from support.imaging_designs import coarse_prototype, prototype

HOSTILE = "<script>alert('&')</script>"
HOSTILE_DESIGN = coarse_prototype().model_copy(update={"configuration": HOSTILE})


class Page(HTMLParser):
    """What a browser would make of a result: elements and text."""

    def __init__(self, result: Any) -> None:
        super().__init__()
        self.elements: list[str] = []
        self.text = ""
        html = result._repr_html_()
        self.length = len(html)
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert not attrs
        self.elements.append(tag)

    def handle_data(self, data: str) -> None:
        self.text += data + "\n"


def study_result() -> api.StudyResult:
    requirement = api.requirement(ROOT / "configs/indoor_robot.toml", title=HOSTILE)
    row = {
        "configuration": HOSTILE, "status": "feasible", "depth_error_rms": 0.0123456, "limit_ratio": np.nan,
        "baseline_mm": 100.0, "height_mm": 120.0, "diameter_mm": 60.0, "largest_blur_px": 4.0, "reason": "not shown",
    }  # fmt: skip
    return api.StudyResult(requirement, pd.DataFrame([row] * 44), {}, pd.DataFrame(), pd.DataFrame())


def sweep_result() -> api.SweepResult:
    table = study_result().table.assign(point=range(44), **{"asked.camera.name": HOSTILE})
    return api.SweepResult(Path("reports"), table, table)


def checked() -> EndToEndCheck:
    band = Band(
        (1000.0, 1500.0),
        9000,
        8000,
        kept=0.9,
        bias=0.001,
        error=0.02,
        error_ratio=1.0,
        worst_part_ratio=1.2,
        predicted=0.02,
    )
    nothing = cast(Any, None)
    noise = Noise(np.empty((0, 3)), np.empty(0), np.ones(1), np.ones(1))
    bands = (band, dataclasses.replace(band, kept=float("nan")), dataclasses.replace(band, pixels=1))
    return EndToEndCheck("x", HOSTILE, "rich", noise, bands, *([nothing] * 9), lens=None)


def results() -> dict[str, Any]:
    empty = pd.DataFrame({"configuration_a": [], "configuration_b": [], "status_a": [], "status_b": []})
    evaluation = api.evaluate(prototype())
    evaluation = dataclasses.replace(
        evaluation, score=dataclasses.replace(evaluation.score, fabrication_notes=(HOSTILE,))
    )
    raw = raw_image(coarse_prototype(), eccentric_wall(1700.0, 0.6), Waves(finest_deg=1.6, coarsest_deg=24.0, count=20))
    return {
        "study": study_result(),
        "sweep": sweep_result(),
        "verdict": dataclasses.replace(api.trace(prototype()), configuration=HOSTILE, problems=(HOSTILE,)),
        "evaluation": evaluation,
        "check": checked(),
        "comparison": StudyComparison((("title", HOSTILE, None),), empty, empty),
        "reconstruction": api.reconstruct(api.stereo_rig(HOSTILE_DESIGN, columns=450), raw),
    }


@pytest.fixture(scope="module")
def pages() -> dict[str, Page]:
    return {name: Page(result) for name, result in results().items()}


KINDS = ("study", "sweep", "verdict", "evaluation", "check", "comparison", "reconstruction")


@pytest.mark.parametrize("kind", KINDS)
def test_a_result_is_a_short_table_and_text_of_users_stays_text(pages: dict[str, Page], kind: str) -> None:
    page = pages[kind]
    assert set(page.elements) <= {"p", "b", "table", "thead", "tbody", "tr", "th", "td"}
    assert HOSTILE in page.text
    assert 2 <= page.elements.count("tr") <= 14
    assert page.length < 6000


def test_the_tables_say_what_was_found(pages: dict[str, Page]) -> None:
    assert "0.01235\n–\n100\n" in pages["study"].text
    assert "and 34 more" in pages["study"].text
    assert "not shown" not in pages["study"].text
    assert "44 requirements, 44 with a feasible design" in pages["sweep"].text
    assert "asked.camera.name" in pages["sweep"].text
    assert "FAILED" in pages["check"].text
    assert "1000 to 1500" in pages["check"].text
    assert "90 %\n0.1 %\n2 %\n2 %\nnone\n" in pages["check"].text
    assert "too few pixels to judge" in pages["check"].text
    verdict = api.trace(prototype())
    assert f"{verdict.upper.clearance_mm:.4g}" in pages["verdict"].text
    assert percent(api.evaluate(prototype()).depth_error_rms) in pages["evaluation"].text
    assert "kept" in pages["reconstruction"].text


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (float("nan"), "–"), (True, "yes"), (12345.678, "1.235e+04"), (0.5, "0.5"), (7, "7"), ("a", "a")],
)
def test_cells_read_well(value: object, text: str) -> None:
    assert text_of(value) == text
