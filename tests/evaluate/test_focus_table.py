"""The focus that ``designer evaluate`` prints against pencils of traced rays, and what it says where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from designer.cli.focus import describe_focus
from designer.design import Design, read_design
from designer.evaluate.focus_table import FocusTable, focus_table
from designer.evaluate.score import evaluate_design
from designer.trace.pencils import pencil_images
from support import DATA
from support.studied_designs import NAMES, studied_design

PROTOTYPE = DATA / "folded_hypl_hy.json"


def table_of(design: Design) -> FocusTable:
    table = focus_table(design)
    assert table is not None
    return table


def traced_blur_px(design: Design, view: str, elevation_deg: float, distances_mm: list[float], focus: float):
    """Diameters of the blur from the mean of the tangential and sagittal images; 1/u given."""
    images = pencil_images(design, view, [elevation_deg], distances_mm)
    depth = (images.tangential + images.sagittal)[0] / 2.0 / np.cos(images.psi[0])
    camera = design.camera
    return np.abs(2.0 * camera.pupil_radius_mm * camera.focal_length_mm * (focus - depth)) / camera.pixel_pitch_mm


@pytest.mark.parametrize("name", ["prototype", *NAMES])
def test_blur_is_that_of_traced_pencils(name: str) -> None:
    design = read_design(PROTOTYPE) if name == "prototype" else studied_design(name)
    table = table_of(design)
    focus = 1.0 / table["focus_distance_mm"] if table["focus_distance_mm"] else 0.0
    assert [row["view"] for row in table["elevations"]] == ["upper", "upper", "lower", "lower"]
    for row in table["elevations"]:
        traced = traced_blur_px(design, row["view"], row["elevation_deg"], table["distances_mm"], focus)
        np.testing.assert_allclose(row["blur_px"], traced, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_traced_light_is_as_wide_as_said_where_sharpness_ends(name: str) -> None:
    design = studied_design(name)
    table = table_of(design)
    focus = 1.0 / table["focus_distance_mm"] if table["focus_distance_mm"] else 0.0
    for row in table["elevations"]:
        px_per_deg = row["blur_px"][0] / row["blur_deg"][0]
        ends = [end for end in (row["sharp_from_mm"], row["sharp_to_mm"]) if end is not None]
        # What lies behind the mirror is no end of sharpness.
        ends = [end for end in ends if end > design.diameter_mm]
        if ends:
            traced = traced_blur_px(design, row["view"], row["elevation_deg"], ends, focus) / px_per_deg
            np.testing.assert_allclose(traced, table["sharp_blur_deg"], rtol=1e-4)


def test_lines_say_what_is_sharp_and_what_is_not() -> None:
    table = table_of(read_design(PROTOTYPE))
    assert table["best_focus_distance_mm"] is not None
    text = "\n".join(describe_focus(table))
    assert "focused at infinity" in text
    assert text.count("nowhere") == 4
    best = read_design(PROTOTYPE)
    camera = best.camera.model_copy(update={"focus_distance_mm": table["best_focus_distance_mm"], "f_number": 32.0})
    sharp = table_of(best.model_copy(update={"camera": camera}))
    assert sharp["largest_blur_px"] < table["largest_blur_at_best_focus_px"] / 3.0
    assert "infinity" in "\n".join(describe_focus(sharp))


def test_three_mirrors_in_a_view_have_no_table() -> None:
    design = read_design(PROTOTYPE)
    upper = design.views.upper.model_copy(update={"path": tuple(mirror.name for mirror in design.mirrors)})
    assert len(upper.path) > 2
    three = design.model_copy(update={"views": design.views.model_copy(update={"upper": upper})})
    assert focus_table(three) is None
    assert evaluate_design(three).focus is None
