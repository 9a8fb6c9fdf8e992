"""The verdict as text says the numbers of the verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.verify.description import describe
from designer.verify.judge import judge
from designer.verify.light import ViewLight
from designer.verify.verdict import Verdict
from support.closed_forms import folded_hypl_hy

LIGHT = ViewLight(
    elevations_deg=(-18.0, 1.0, 16.0),
    distances_mm=(1000.0, 5000.0),
    arrives=np.array([[0.91, 0.73], [0.2, 0.3], [0.84, 1.0]]),
    stopped_by=np.full((3, 2), "direct"),
    blur_px=np.array([[1.0, 2.0], [3.0, 6.5], [4.0, 5.0]]),
    mixed_at_ends=(0.0314, 0.0),
    mixed_in_zone=0.012,
    pixels_per_degree=np.array([4.0, 26.0, 8.0]),
)


@pytest.fixture(scope="module")
def verdict() -> Verdict:
    return judge(folded_hypl_hy())


def line_of(verdict: Verdict, light: ViewLight, word: str) -> str:
    text = describe(replace(verdict, light={"upper": light, "lower": light}))
    lines = {line for line in text.splitlines() if line.split() and line.split()[0] == word}
    assert len(lines) == 1
    return " ".join(lines.pop().split())


def test_the_least_light_at_both_ends_and_the_most_mixed_are_told(verdict):
    assert line_of(verdict, LIGHT, "light") == (
        "light 73 % of the pupil at -18 deg, 84 % at 16 deg; 3.1 % from the other view"
    )
    unknown = replace(LIGHT, mixed_at_ends=(np.nan, np.nan), mixed_in_zone=np.nan)
    assert line_of(verdict, unknown, "light").endswith("mixing unknown")


def test_the_largest_blurs_are_told_unless_some_light_finds_no_way(verdict):
    # Where a degree is least pixels: 5 / 8 and 2 / 4 of a degree; 6.5 / 26 in the middle.
    assert line_of(verdict, LIGHT, "blur") == "blur at most 6.5 px, 0.625 deg in the scene"
    unknown = replace(LIGHT, blur_px=np.where(LIGHT.blur_px > 6.0, np.nan, LIGHT.blur_px))
    assert line_of(verdict, unknown, "blur") == "blur unknown: not all of the light arrives"


def test_each_view_is_told_with_its_own_angles(verdict):
    text = describe(verdict)
    upper, lower = text.split("upper view:")[1].split("lower view:")
    for part, view in ((upper, verdict.upper), (lower, verdict.lower)):
        low, high = view.asked_elevation_deg
        assert f"{low:.2f} to {high:.2f} deg" in part
        assert f"{view.zone_psi_deg[0]:.2f} to {view.zone_psi_deg[1]:.2f} deg at the pinhole" in part
        assert f"{view.clearance_mm:.3f} mm ({view.clearance_at})" in part
