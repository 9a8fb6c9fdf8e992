"""What ``study.html`` knows of a study, as JSON: requirement, rows, designs, Pareto fronts."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from designer import __version__
from designer.design import VIEW_NAMES, Design, PerView
from designer.evaluate.depth import NoiseModel, slopes_of_point, stereo_pair_of, volume_of
from designer.evaluate.fabrication import mirror_shape
from designer.evaluate.focus import focus_score
from designer.evaluate.predicted_noise import noise_model
from designer.evaluate.score import depth_score, recorded_fabrication_notes
from designer.files import as_json
from designer.goals import GOALS
from designer.optics.focus import lens_of_camera, light_path_of_design
from designer.optimise.limit import conditions_of
from designer.optimise.required_numbers import specification_of
from designer.report.content.requirement import requirement_groups
from designer.requirement import PREDICTED, Requirement
from designer.study.columns import COLUMNS
from designer.study.row import Row
from designer.study.study import Study

MASS = "mass_g"
"""A column of the page alone: the mass of all mirrors, of aluminium."""
NOT_JUDGED = "not judged"
"""Status of a design that is shown without a study."""
_SHOWN = (
    "rank",
    "configuration",
    "family",
    "topology",
    "status",
    "reason",
    "variant",
    "lens",
    "depth_error_rms",
    "depth_error_worst",
    "limit_ratio",
    "baseline_mm",
    "height_mm",
    "diameter_mm",
    "volume_cm3",
    "largest_mirror_diameter_mm",
    "largest_blur_px",
    "largest_blur_deg",
    "f_number",
    "focus_distance_mm",
    "principal_distance_mm",
    "depth_shift_per_scale",
    "largest_slope_deg",
    "smallest_clearance_mm",
    "smallest_clearance_where",
    "starts",
    "solves",
    "closest_constraint",
    "closest_violation",
    "closest_unit",
    "pareto_front_problem",
)
_OF_CAMERA = ("distortion", "projection")
"""Keys of a camera that this version's record may not know, but by which the page tells a law that it does not."""
NOISE_ELEVATIONS, NOISE_DISTANCES = 17, 13
"""Size of the table of predicted noise; interpolated, it is within one percent of the prediction (see the tests)."""


def payload_of_study(study: Study) -> dict[str, JsonValue]:
    """A study as JSON: the same, whether it was found a moment ago or read from its folder."""
    requirement = study.requirement
    envelope = requirement.envelope
    return {
        "version": __version__,
        "title": study.title,
        "description": requirement.description,
        "facts": as_json(requirement_groups(requirement)),
        "envelope": {"height_mm": _plain(envelope.height_mm), "diameter_mm": _plain(envelope.diameter_mm)},
        "columns": _columns(),
        "goals": list(_goals()),
        "rows": [_row(study, row) for row in study.rows],
        "designs": {name: described(design, requirement) for name, design in study.designs.items()},
        "fronts": [as_json({name: _plain(getattr(point, name)) for name in _FRONT}) for point in study.pareto],
        "provenance": as_json({key: study.provenance[key] for key in _PROVENANCE if key in study.provenance}),
    }


DEPARTURES_LEFT_OUT = "The departures of the sensor as built (as_built) are not shown: this is the design without them."


def payload_of_design(design: Design) -> dict[str, JsonValue]:
    """A single design as JSON, in the form of a study with one row.

    Raises
    ------
    InputError
        The design cannot be scored.
    """
    depth, focus = depth_score(design), focus_score(design)
    camera = design.camera
    row: dict[str, Any] = {
        "configuration": design.configuration,
        "family": "folded" if any(len(view.path) > 1 for view in design.views.by_name.values()) else "direct",
        "topology": f"upper_{design.views.upper.zone}",
        "status": NOT_JUDGED,
        "variant": design.variant,
        "rank": 1,
        "depth_error_rms": depth.depth_error_rms,
        "depth_error_worst": depth.depth_error_worst,
        "limit_ratio": depth.limit_ratio,
        "baseline_mm": design.baseline_mm,
        "height_mm": design.height_mm,
        "diameter_mm": design.diameter_mm,
        "largest_blur_px": focus and focus.largest_blur_px,
        "largest_blur_deg": focus and focus.largest_blur_deg,
        "f_number": camera.f_number,
        "focus_distance_mm": camera.focus_distance_mm,
        "principal_distance_mm": camera.focal_length_mm,
        MASS: _mass_g(design),
    }
    if not depth.first_order_valid:
        row["beyond_first_order"] = True
    return {
        "version": __version__,
        "title": design.configuration,
        "description": "A single design, without a study." + (f" {DEPARTURES_LEFT_OUT}" if design.as_built else ""),
        "facts": [],
        "envelope": {"height_mm": None, "diameter_mm": None},
        "columns": _columns(),
        "goals": list(_goals()),
        "rows": [as_json({name: _plain(value) for name, value in row.items() if value is not None})],
        "designs": {design.configuration: described(design, None)},
        "fronts": [],
        "provenance": {},
    }


_FRONT = ("configuration", "swept", "limit_mm", "status", "depth_error_rms", "height_mm", "diameter_mm")
_PROVENANCE = ("designer", "command", "finished", "seed", "starts")


def _goals() -> tuple[str, ...]:
    """The columns of the goals, by which a page can rank, plot and compare whatever it lists beside them."""
    return tuple(goal.column for goal in GOALS.values())


def _of_rows() -> tuple[str, ...]:
    return (*_SHOWN, *(name for name in _goals() if name not in _SHOWN))


def _columns() -> dict[str, JsonValue]:
    """Label, unit, factor and kind of each column of the rows."""
    columns: dict[str, JsonValue] = {
        name: {
            "label": COLUMNS[name].label,
            "unit": COLUMNS[name].unit,
            "factor": COLUMNS[name].factor,
            "is_number": COLUMNS[name].kind in (float, int),
        }
        for name in _of_rows()
    }
    columns.setdefault(MASS, {"label": "mass of the mirrors", "unit": "g", "factor": 1.0, "is_number": True})
    columns["check"] = {"label": "end-to-end check", "unit": "", "factor": 1.0, "is_number": False}
    return columns


def _row(study: Study, row: Row) -> dict[str, JsonValue]:
    values: dict[str, Any] = {}
    for name in _of_rows():
        value = row.text(name) if COLUMNS[name].kind is str else row.number(name)
        if value is not None and value != "":
            values[name] = _plain(value)
    design = study.designs.get(row.configuration)
    if design is not None:
        values.setdefault(MASS, _plain(_mass_g(design)))
    if row.is_beyond_first_order:
        values["beyond_first_order"] = True
    if row.configuration in study.checked:
        values["check"] = "passes" if study.checked[row.configuration].passed else "fails"
    elif row.configuration in study.unchecked:
        values["check"] = f"could not be checked: {study.unchecked[row.configuration]}"
    return dict(values)


def described(design: Design, requirement: Requirement | None) -> dict[str, JsonValue]:
    """A design's record as its file has it, without score and further keys, and what the page cannot work out."""
    camera = {
        name: value
        for name, value in design.camera.model_dump(mode="json").items()
        if name in type(design.camera).model_fields or name in _OF_CAMERA
    }
    mirrors: list[JsonValue] = []
    for mirror in design.mirrors:
        shape = mirror_shape(design, mirror.name)
        record = {name: getattr(mirror, name) for name in type(mirror).model_fields}
        mirrors.append({**record, "sag_mm": _plain(shape.sag_mm), MASS: _plain(shape.mass_g)})
    views: dict[str, JsonValue] = {
        name: as_json({key: getattr(view, key) for key in type(view).model_fields})
        for name, view in design.views.by_name.items()
    }
    volume = design.working_volume
    table = None if requirement is None else _noise_table(design, requirement)
    return {
        "configuration": design.configuration,
        "variant": design.variant,
        "camera": camera,
        "mirrors": mirrors,
        "views": views,
        "baseline_mm": design.baseline_mm,
        "height_mm": design.height_mm,
        "diameter_mm": design.diameter_mm,
        "working_volume": {
            "elevation_deg": as_json(volume.elevation_deg),
            "distance_mm": as_json(volume.distance_mm),
        },
        "noise_px": design.noise_px,
        "scale_uncertainty": design.scale_uncertainty,
        "notes": as_json(recorded_fabrication_notes(design)),
        **({} if table is None else {"noise_table": table}),
    }


def _noise_table(design: Design, requirement: Requirement) -> dict[str, JsonValue] | None:
    """The predicted noise of an image point in px over the working volume; None where the noise is the same everywhere.

    Rows go evenly from the lowest to the highest elevation seen from the middle of the baseline, columns from the
    nearest to the farthest distance, evenly in its logarithm.
    """
    if requirement.noise_px != PREDICTED or any(len(view.path) > 2 for view in design.views.by_name.values()):
        return None
    volume = volume_of(design)
    elevations = np.linspace(*volume.elevations, NOISE_ELEVATIONS)[:, None]
    distances = np.geomspace(*volume.distances, NOISE_DISTANCES)[None, :]
    noise = predicted_noise_px(design, requirement, elevations, distances)
    if not (np.isfinite(noise.lower).all() and np.isfinite(noise.upper).all()):
        return None
    return {"upper_px": _table(noise.upper), "lower_px": _table(noise.lower)}


def predicted_noise_px(
    design: Design, requirement: Requirement, elevations: NDArray[np.float64], distances: NDArray[np.float64]
) -> PerView[NDArray[np.float64]]:
    """Noise of an image point in each view, px, by the requirement's light and texture.

    At points given by elevation from the middle of the baseline (rad) and distance from the axis (mm), broadcast.
    """
    slopes = slopes_of_point(np.tan(elevations), distances, design.baseline_mm)
    noise = predicted_noise(design, requirement)(slopes, distances)
    pitch = design.camera.pixel_pitch_mm
    return PerView(lower=np.asarray(noise.lower) / pitch, upper=np.asarray(noise.upper) / pitch)


def predicted_noise(design: Design, requirement: Requirement) -> NoiseModel:
    """The noise that a requirement predicts for a finished design, whose views have at most two mirrors each."""
    # Light and texture are the same with every lens of a catalogue.
    conditions = conditions_of(specification_of(requirement, requirement.camera.lenses[0]))
    paths = {name: light_path_of_design(design, name) for name in VIEW_NAMES}
    model: NoiseModel = noise_model(conditions, stereo_pair_of(design), lens_of_camera(design.camera), paths)
    return model


def _table(values: NDArray[np.float64]) -> JsonValue:
    return [[float(f"{value:.5g}") for value in row] for row in values]


def _mass_g(design: Design) -> float:
    return sum(mirror_shape(design, mirror.name).mass_g for mirror in design.mirrors)


def _plain(value: Any) -> Any:
    """A number as far as the page shows it: ten digits, so that last digits of a text file do not matter."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(f"{value:.10g}") if math.isfinite(value) else None
