"""A built sensor in words."""

from __future__ import annotations

from designer.as_built.built import BuiltSensor, BuiltView
from designer.design import Design, ViewName

# Traced rays of a design pass its viewpoints within less; smaller numbers of anything are rounding.
SINGLE_VIEWPOINT_MM = 1e-6


def describe_built(sensor: BuiltSensor, design: Design) -> list[str]:
    """Lines of what the departures do."""
    if sensor.is_nominal and not sensor.problems:
        return ["as built: all departures are zero, so the sensor is as designed"]
    lines = ["as built: " + (f"rejected: {'; '.join(sensor.problems)}" if sensor.problems else _viewpoints(sensor))]
    for name, view in sensor.views.items():
        lines += _view_lines(name, view)
    lines += _depth_lines(sensor, design)
    return [*lines, "  everything else said here is of the design without its departures"]


def noise_in_words(design: Design) -> str:
    """What the depth error of a design counts: noise, and the uncertainty of the scale if it has one."""
    return "noise and scale" if design.scale_uncertainty else "noise"


def _viewpoints(sensor: BuiltSensor) -> str:
    known = [view.caustic_mm for view in sensor.views.values() if view.caustic_mm is not None]
    if max(known, default=0.0) > SINGLE_VIEWPOINT_MM:
        return "no single viewpoint any more"
    return "each view still has a single viewpoint"


def _view_lines(name: ViewName, view: BuiltView) -> list[str]:
    sees = f"it sees {100.0 * view.seen:.4g} % of the working volume"
    if view.viewpoint_mm is None or view.caustic_mm is None:
        return [f"  {name} view: {sees}"]
    x, y, z = (0.0 if abs(part) < SINGLE_VIEWPOINT_MM else part for part in view.viewpoint_mm)
    where = f"({x:.3f}, {y:.3f}, {z:.3f}) mm"
    point = (
        f"caustic {view.caustic_mm:.3g} mm across, rays pass {where} at {view.spread_mm:.3g} mm rms"
        if view.caustic_mm > SINGLE_VIEWPOINT_MM
        else f"single viewpoint at {where}"
    )
    rows, columns = _number(view.rows_px), _number(view.columns_px)
    off = "as designed" if rows == columns == "0" else f"off by {rows} rows and {columns} columns rms"
    return [f"  {name} view: {point};", f"    its panorama is {off}; {sees}"]


def _depth_lines(sensor: BuiltSensor, design: Design) -> list[str]:
    if sensor.epipolar_px is None:
        return []
    error = sensor.depth_error_calibrated
    grown = "no depth: the rays diverge" if error is None else f"{100.0 * error:.3g} %"
    return [
        f"  read by the design's tables: epipolar error {_number(sensor.epipolar_px)} px rms, "
        f"{_bias(sensor.depth_bias)}; image centres of the views {_number(sensor.centres_apart_px)} px apart",
        f"  with each view's centre, scale and turn calibrated: epipolar error "
        f"{_number(sensor.epipolar_px_calibrated)} px rms, {_bias(sensor.depth_bias_calibrated)};",
        f"  depth error with {noise_in_words(design)}: {grown}; as designed {100.0 * sensor.depth_error:.3g} %; "
        f"blur {sensor.blur_px:.2g} px rms",
    ]


def _bias(share: float | None) -> str:
    return (
        "no depth at some points: the rays diverge" if share is None else f"depth bias {_number(100.0 * share)} % rms"
    )


def _number(value: float | None) -> str:
    return "unknown" if value is None else "0" if abs(value) < SINGLE_VIEWPOINT_MM else f"{value:.3g}"
