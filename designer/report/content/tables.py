"""The report's tables: prescription, ranking, what came closest, and the paper's prototype beside ours."""

from __future__ import annotations

import math
from collections.abc import Iterable

from designer.as_built.allowances import mirror_allowance
from designer.as_built.tolerances import Tolerances
from designer.design import Design, Mirror
from designer.evaluate.fabrication import mirror_shape
from designer.study.row import Row
from designer.study.study import LensRow
from designer.typesetting.markup import DASH, call, cell, cells, literal, number, plain_number, text, typographic

# Joins the constraints of a reason that are equally violated.
_EQUALLY = "; equally, "
PAPER_CONFIGURATION = "folded-HyPl-Hy-upper_outer"


def in_percent(value: float | None, decimals: int | None = None) -> str:
    """A share as percent, without the sign; with three significant digits unless decimals are given."""
    if decimals is None:
        decimals = percent_decimals([value], significant=3)
    return number(None if value is None else 100 * value, decimals)


def percent_decimals(values: Iterable[float | None], significant: int = 4) -> int:
    """Decimals with which the smallest of some shares, as percent, still shows its significant digits."""
    known = [100 * value for value in values if value]
    return max(significant - 1 - math.floor(math.log10(min(known))), 0) if known else significant


def prescription(design: Design, tolerances: Tolerances | None = None) -> str:
    """The mirrors as opticians write them; the first column numbers them as the cross-section does.

    Numbers with a tolerance stop at a tenth of it.
    """
    rows: list[list[str]] = []
    for index, mirror in enumerate(design.mirrors, start=1):
        rows.append(
            [
                str(index),
                mirror.name,
                mirror.kind,
                mirror.faces,
                *_optical_numbers(design, mirror, tolerances),
                number(mirror.inner_radius_mm, 3),
                number(mirror.outer_radius_mm, 3),
                number(mirror_shape(design, mirror.name).sag_mm, 4),
                number(mirror.thickness_mm, 2),
            ]
        )
    header = (
        "[], [mirror], [kind], [faces], [vertex $z_0$\\ (mm)], [radius $r_0$\\ (mm)], [conic $K$], "
        "[inner $R$\\ (mm)], [outer $R$\\ (mm)], [sag\\ (mm)], [thickness\\ (mm)],"
    )
    return call(
        "ruled",
        columns="(auto, 1fr, auto, auto) + (auto,) * 7",
        align="(right, left, left, left) + (right,) * 7",
        header=f"({header})",
        rows=cells(rows),
        inset="(x: 1.2mm, y: 0.95mm)",
    )


def _optical_numbers(design: Design, mirror: Mirror, tolerances: Tolerances | None) -> list[str]:
    """Vertex, radius and conic constant, each with its tolerance if there are any."""
    if tolerances is None:
        radius = "∞" if mirror.radius_mm is None else number(mirror.radius_mm, 4)
        return [number(mirror.vertex_mm, 4), radius, number(mirror.conic, 6)]
    allowed = mirror_allowance(design, mirror.name, tolerances)
    vertex = _within(mirror.vertex_mm, allowed.axial_shift_mm)
    if mirror.radius_mm is None or allowed.radius_mm is None or allowed.conic is None:
        return [vertex, f"∞ (1/R ±{allowed.curvature_per_m:.2g} 1/m)", number(mirror.conic, 0)]
    return [vertex, _within(mirror.radius_mm, allowed.radius_mm), _within(mirror.conic, allowed.conic)]


def _within(value: float, tolerance: float) -> str:
    """A number and its tolerance, to two significant digits of the latter; in full where nothing is allowed."""
    if tolerance <= 0.0:
        return f"{plain_number(value)} ±0"
    decimals = max(1 - math.floor(math.log10(tolerance)), 0)
    return f"{number(value, decimals)} ±{tolerance:.2g}"


def fabrication(design: Design) -> str:
    """What a shop needs to quote each mirror: size, form, departure from a sphere, and mass of the substrate."""
    shapes = [mirror_shape(design, mirror.name) for mirror in design.mirrors]
    rows = []
    for index, (mirror, shape) in enumerate(zip(design.mirrors, shapes, strict=True), start=1):
        radius = shape.best_sphere_radius_mm
        rows.append(
            [
                str(index),
                mirror.name,
                f"{shape.shape} {mirror.kind}" if mirror.kind != "plane" else mirror.kind,
                number(shape.diameter_mm, 2),
                number(2.0 * mirror.inner_radius_mm, 2) if mirror.inner_radius_mm else DASH,
                number(shape.sag_mm, 3),
                number(max(shape.slope_deg), 1),
                "∞" if radius is None else number(radius, 2),
                DASH if radius is None else _micrometres(shape.sphere_departure_mm),
                number(shape.mass_g, 1),
            ]
        )
    rows.append(["", "all", *[""] * 7, number(sum(shape.mass_g for shape in shapes), 1)])
    header = (
        "[], [mirror], [form], [diameter\\ (mm)], [hole\\ (mm)], [sag\\ (mm)], [largest\\ slope (°)], "
        "[best-fit\\ sphere (mm)], [departure\\ (µm)], [mass\\ (g)],"
    )
    return call(
        "ruled",
        columns="(auto, auto, 1fr) + (auto,) * 7",
        align="(right, left, left) + (right,) * 7",
        header=f"({header})",
        rows=cells(rows),
        inset="(x: 1.2mm, y: 0.95mm)",
    )


def _micrometres(length_mm: float) -> str:
    return number(1000.0 * length_mm, 1 if length_mm < 0.1 else 0)


def excluded(rows: Iterable[Row]) -> str:
    """The impossible configurations grouped by the rule that excludes them, the most frequent rule first."""
    by_reason: dict[str, list[str]] = {}
    for row in rows:
        by_reason.setdefault(typographic(row.reason) or "no reason given", []).append(row.configuration)
    body = []
    for reason, names in sorted(by_reason.items(), key=lambda item: -len(item[1])):
        listed = ", ".join(f"#name-of({literal(name)})" for name in names)
        body.append(f"({cell(len(names))}, {cell(reason)}, [{listed}])")
    return call(
        "ruled",
        columns="(auto, 62mm, 1fr)",
        align="(right, left, left)",
        header="([], [rule], [configurations])",
        rows="(" + "".join(f"{part}, " for part in body) + ")",
        size="8pt",
        inset="(x: 1.1mm, y: 0.95mm)",
        hairlines="true",
    )


def ranking_table(rows: Iterable[Row]) -> str:
    """Configurations with their status: feasible ones by rank with their numbers, the others with their reason.

    A star marks depth errors that first order does not tell truly at the worst point of the volume.
    """
    body = []
    rows = tuple(rows)
    decimals = percent_decimals(row.number("depth_error_rms") for row in rows)
    starred = any(row.is_beyond_first_order for row in rows)
    for row in rows:
        head = [cell(row.rank or DASH), f"name-of({literal(row.configuration)})", cell(row.status)]
        if row.status == "feasible":
            error = text(in_percent(row.number("depth_error_rms"), decimals))
            if starred:
                # Hidden where it does not apply, so that the digits stay in line.
                error += '#text("*")' if row.is_beyond_first_order else '#hide("*")'
            values = [
                number(row.number("limit_ratio"), 3),
                number(row.number("baseline_mm"), 1),
                number(row.number("height_mm"), 1),
                number(row.number("diameter_mm"), 1),
                typographic(row.text("variant")),
            ]
            body.append([*head, f"[{error}]", *(cell(value) for value in values)])
        else:
            reason = typographic(_shortened(row.reason)) or "no reason given"
            body.append([*head, f"table.cell(colspan: 6, align: left, {cell(reason)})"])
    header = (
        "[rank], [configuration], [status], [$sigma_D\\/D$\\ (%)], [limit\\ ratio], [$b$\\ (mm)], [$H$\\ (mm)], "
        "[$W$\\ (mm)], [variant, or reason],"
    )
    return call(
        "ruled",
        columns="(auto,) * 8 + (1fr,)",
        align="(right, left, left) + (right,) * 5 + (left,)",
        header=f"({header})",
        rows="(" + "".join(f"({''.join(part + ', ' for part in parts)}), " for parts in body) + ")",
        size="8pt",
        inset="(x: 1.1mm, y: 0.95mm)",
        hairlines="true",
    )


def _shortened(reason: str) -> str:
    """A reason with at most two of the constraints that are equally violated; the status says the rest."""
    first, *others = reason.removeprefix("no feasible point found; ").split(_EQUALLY)
    if len(others) <= 1:
        return _EQUALLY.join([first, *others])
    return f"{first}{_EQUALLY}{others[0]}, and {len(others) - 1} more"


def closest(rows: Iterable[Row]) -> str:
    """The infeasible configurations by what stood in the way, the smallest excess of each kind first."""
    known = [row for row in rows if row.text("closest_constraint")]
    known.sort(key=lambda row: (row.text("closest_constraint"), row.number("closest_violation") or 0.0))
    return call(
        "ruled",
        columns="(auto, 1fr, auto, auto)",
        align="(left, left, right, left)",
        header="([configuration], [limiting constraint], [violated by], [unit])",
        rows=cells(
            [
                row.configuration,
                row.text("closest_constraint"),
                number(row.number("closest_violation"), 3),
                row.text("closest_unit"),
            ]
            for row in known
        ),
    )


def lens_choice(rows: Iterable[LensRow]) -> str:
    """What each lens of a catalogue gives in one configuration: its numbers, or why nothing is feasible with it."""
    rows = tuple(rows)
    decimals = percent_decimals((row.depth_error_rms for row in rows), significant=3)
    body = []
    for row in rows:
        head = [cell(row.number), cell(row.lens)]
        if row.status != "feasible":
            reason = typographic(f"{row.status}: {_shortened(row.reason) or 'no reason given'}")
            body.append([*head, f"table.cell(colspan: 7, align: left, {cell(reason)})"])
            continue
        at = "infinity" if row.focus_distance_mm is None else number(row.focus_distance_mm, 0)
        values = [
            "chosen" if row.is_chosen else "feasible",
            in_percent(row.depth_error_rms, decimals),
            number(row.height_mm, 1),
            number(row.f_number, 2),
            at,
            number(row.largest_blur_deg, 2),
            number(row.largest_blur_px, 1),
        ]
        body.append([*head, *(cell(value) for value in values)])
    header = (
        "[], [lens], [status], [$sigma_D\\/D$\\ (%)], [height\\ (mm)], [f-number], [focused\\ at (mm)], "
        "[largest\\ blur (°)], [largest\\ blur (px)],"
    )
    return call(
        "ruled",
        # A reason spans columns of given width: of automatic ones it would widen the last.
        columns="(auto, 1fr) + (15mm,) * 7",
        align="(right, left, left) + (right,) * 6",
        header=f"({header})",
        rows="(" + "".join(f"({''.join(part + ', ' for part in parts)}), " for parts in body) + ")",
        size="8pt",
        inset="(x: 1.1mm, y: 0.95mm)",
    )


def paper_comparison(design: Design, row: Row) -> str:
    """The prototype of Jang, Kim and Kweon (2005) beside the design of the same configuration."""
    camera = design.camera
    upper, lower = design.views.upper.elevation_deg, design.views.lower.elevation_deg
    asked = design.working_volume.elevation_deg
    largest = 2 * max(mirror.outer_radius_mm for mirror in design.mirrors)
    lens = row.text("lens")
    rows = [
        ("baseline (mm)", "100", number(design.baseline_mm, 1)),
        ("height of the mirror system (mm)", "140", number(design.height_mm, 1)),
        ("width of the mirror system (mm)", "80", number(design.diameter_mm, 1)),
        ("widest mirror (mm)", "60", number(largest, 1)),
        ("vertical field, from the middle (°)", "more than 16 up and down", _span(asked)),
        ("vertical field, upper viewpoint (°)", "not given", _span(upper)),
        ("vertical field, lower viewpoint (°)", "not given", _span(lower)),
        ("image (px)", "1600 × 1200", f"{camera.width_px} × {camera.height_px}"),
        ("lens", "12 mm", lens or f"principal distance {number(camera.focal_length_mm, 2)} mm"),
        ("rms depth error (%)", "not given", in_percent(row.number("depth_error_rms"))),
    ]
    return call(
        "ruled",
        columns="(auto, auto, 1fr)",
        align="(left, right, right)",
        header="([quantity], [paper's prototype], [this design])",
        rows=cells(rows),
    )


def _span(elevation_deg: tuple[float, float]) -> str:
    return f"{number(elevation_deg[0], 1)} to {number(elevation_deg[1], 1)}"
