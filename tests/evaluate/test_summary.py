"""The summary of a design is plain JSON, agrees with its parts, and refuses what is no stereo pair."""

from __future__ import annotations

import json

import pytest

from designer.design import Design
from designer.evaluate.summary import evaluate_design
from designer.files import InputError


@pytest.mark.parametrize("name", ["published", "crossing"])
def test_summary_is_plain_json_with_what_was_asked(name: str, request):
    design: Design = request.getfixturevalue(name)
    summary = evaluate_design(design)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert summary["limit_ratio"] == pytest.approx(summary["depth_error_rms"] / summary["depth_error_limit"])
    assert summary["limit_ratio"] >= 1
    assert summary["first_order_valid"] is True
    assert summary["depth_error_worst"] > summary["depth_error_rms"]
    rounding = summary["quantisation"]
    assert rounding["brute_force_rms"] == pytest.approx(rounding["first_order_rms"], rel=0.01)
    assert [mirror["name"] for mirror in summary["mirrors"]] == ["direct", "primary", "secondary"]


@pytest.mark.parametrize(
    ("farthest", "first", "second"), [(2000.0, True, True), (8_000.0, False, True), (60_000.0, False, False)]
)
def test_each_order_is_valid_up_to_its_bound(published: Design, farthest: float, first: bool, second: bool):
    summary = evaluate_design(changed(published, ("working_volume", "distance_mm"), [500.0, farthest]))
    assert (summary["first_order_valid"], summary["second_order_valid"]) == (first, second)
    worst, corrected = summary["depth_error_worst"], summary["depth_error_worst_second_order"]
    assert corrected == pytest.approx(worst * (1 + 9 * worst**2) ** 0.5)
    assert (corrected < 1.02 * worst) == first
    assert summary["depth_error_rms"] < summary["depth_error_rms_second_order"] < corrected


def test_far_away_rounding_reaches_infinity(published: Design):
    far = changed(published, ("working_volume", "distance_mm"), [500.0, 60_000.0])
    summary = evaluate_design(far)
    assert summary["quantisation"]["brute_force_rms"] is None


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("baseline_mm",), -10.0, "baseline_mm = -10"),
        (("working_volume", "elevation_deg"), [8.0, -8.0], "working_volume.elevation_deg"),
        (("working_volume", "distance_mm"), [0.0, 2000.0], "working_volume.distance_mm"),
        (("views", "upper", "gain"), 0.0, "views.upper.gain"),
        (("views", "lower", "gain"), 2.5, "views.lower.gain = 2.5"),
        (("views", "lower", "elevation_deg"), [10.0, 95.0], "views.lower.elevation_deg"),
    ],
)
def test_what_is_no_stereo_pair_is_refused(published: Design, keys, value, message: str):
    with pytest.raises(InputError, match=message):
        evaluate_design(changed(published, keys, value))


def changed(design: Design, keys: tuple[str, ...], value: object) -> Design:
    record = design.model_dump(mode="json", by_alias=True)
    part = record
    for key in keys[:-1]:
        part = part[key]
    part[keys[-1]] = value
    return Design.model_validate(record)
