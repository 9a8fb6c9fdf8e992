"""What is said against a design's light: too little of it, two views mixed, blur; and nothing within the tolerances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from designer.design import Sharpness
from designer.verify.light import ViewLight
from designer.verify.light_verdict import light_problems
from support.closed_forms import folded_hypl_hy

# A degree is 10 pixels at the lowest, 20 at the middle and 40 at the highest elevation.
GOOD = ViewLight(
    elevations_deg=(-20.0, 0.0, 20.0),
    distances_mm=(500.0, 3000.0),
    arrives=np.ones((3, 2)),
    stopped_by=np.full((3, 2), "", dtype="<U9"),
    blur_px=np.zeros((3, 2)),
    mixed_at_ends=(0.0, 0.0),
    mixed_in_zone=0.0,
    pixels_per_degree=np.array([10.0, 20.0, 40.0]),
)


def problems(light: ViewLight, **asked: float | None) -> list[str]:
    sharpness = Sharpness(**{"max_blur_px": None, "max_blur_deg": None, "least_light_percent": 50.0, **asked})
    design = folded_hypl_hy().model_copy(update={"sharpness": sharpness})
    return light_problems(design, {"upper": GOOD, "lower": light})


def with_number(values: np.ndarray, place: tuple[int, int], number: float | str) -> np.ndarray:
    changed = values.copy()
    changed[place] = number
    return changed


def test_good_light_is_not_spoken_against():
    assert problems(GOOD, max_blur_px=3.0, max_blur_deg=0.1) == []


def test_nothing_is_said_where_nothing_was_asked():
    dark = replace(GOOD, arrives=np.zeros((3, 2)), blur_px=np.full((3, 2), np.nan), mixed_in_zone=1.0)
    assert light_problems(folded_hypl_hy(), {"upper": dark, "lower": dark}) == []


@pytest.mark.parametrize(("place", "elevation"), [((0, 1), "-20 deg"), ((2, 0), "20 deg")])
def test_too_little_light_at_either_end_is_told_with_what_stops_it(place, elevation):
    stopped_by = with_number(GOOD.stopped_by, place, "secondary")
    light = replace(GOOD, arrives=with_number(GOOD.arrives, place, 0.494), stopped_by=stopped_by)
    (said,) = problems(light)
    assert said.startswith("lower view, full pupil: 49 % of the light arrives at " + elevation)
    assert "at least 50 % required" in said
    assert said.endswith("ends at secondary")


@pytest.mark.parametrize(("place", "share"), [((0, 0), 0.5), ((2, 1), 0.5), ((1, 0), 0.1)])
def test_as_much_light_as_asked_is_enough_and_the_middle_of_a_range_is_not_asked(place, share):
    assert problems(replace(GOOD, arrives=with_number(GOOD.arrives, place, share))) == []


def test_light_that_is_no_number_is_too_little():
    assert len(problems(replace(GOOD, arrives=with_number(GOOD.arrives, (0, 0), np.nan)))) == 1


@pytest.mark.parametrize(
    ("mixed_at_ends", "mixed_in_zone", "said"),
    [
        ((0.0, 0.0), 0.01, None),
        ((0.01, 0.01), 0.0, None),
        ((np.nan, np.nan), np.nan, None),
        ((0.0, 0.0), 0.0123, "1.2 %"),
        ((0.0123, np.nan), np.nan, "1.2 %"),
        ((0.002, 0.25), 0.0123, "25 %"),
    ],
)
def test_a_hundredth_of_the_light_may_come_through_the_other_view(mixed_at_ends, mixed_in_zone, said):
    found = problems(replace(GOOD, mixed_at_ends=mixed_at_ends, mixed_in_zone=mixed_in_zone))
    assert [one.split("pupil: ")[1].split(" of the light")[0] for one in found] == ([said] if said else [])


@pytest.mark.parametrize("place", [(0, 0), (1, 1), (2, 0)])
def test_traced_blur_may_exceed_the_bound_by_a_twentieth_and_half_a_pixel(place):
    degree = GOOD.pixels_per_degree[place[0]]
    for asked, most_px in (({"max_blur_px": 4.0}, 4.0), ({"max_blur_deg": 0.3}, 0.3 * degree)):
        allowed = 1.05 * most_px + 0.5
        assert problems(replace(GOOD, blur_px=with_number(GOOD.blur_px, place, allowed - 1e-6)), **asked) == []
        (said,) = problems(replace(GOOD, blur_px=with_number(GOOD.blur_px, place, allowed + 1e-6)), **asked)
        assert f"{GOOD.elevations_deg[place[0]]:g} deg and {GOOD.distances_mm[place[1]]:g} mm" in said
        shown = f"{allowed:.3g} px" if "max_blur_px" in asked else f"{allowed / degree:.3g} deg"
        assert f"blur of {shown}" in said


def test_the_worst_blur_is_named_and_one_that_is_unknown_before_all():
    blur = np.array([[6.0, 5.0], [9.0, 5.5], [5.0, 5.0]])
    (said,) = problems(replace(GOOD, blur_px=blur), max_blur_px=2.0)
    assert "blur of 9 px at 0 deg and 500 mm (at most 2 px allowed)" in said
    (said,) = problems(replace(GOOD, blur_px=with_number(blur, (2, 1), np.nan)), max_blur_px=2.0)
    assert "blur of nan px at 20 deg and 3000 mm" in said
