"""``designer trace`` and ``designer evaluate``: what the tracer and the score say of one design file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.cli.table import aligned
from designer.files import InputError

if TYPE_CHECKING:
    from designer.as_built.built import BuiltSensor
    from designer.design import Design
    from designer.evaluate.score import DepthScore

REJECTED = 1


@click.command()
@click.argument("design", type=click.Path(path_type=Path))
def trace(design: Path) -> None:
    """Print the ray tracer's verdict on DESIGN.json; exit code 1 if it rejects the design.

    For a sensor with departures (as_built) it also reports how far the rays miss a single viewpoint. It rejects parts
    that collide, and views that do not see all of the working volume.
    """
    from designer.design import read_design

    record = read_design(design)
    from designer.verify.description import describe
    from designer.verify.judge import judge

    verdict = judge(record)
    built = _built(design, record)
    click.echo(describe(verdict, built.problems if built else ()))
    if record.housing is not None:
        click.echo("\n".join(_housing_lines(record)))
    _echo_built(built, record)
    if not verdict.passed or (built is not None and built.problems):
        raise SystemExit(REJECTED)


@click.command()
@click.argument("design", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def evaluate(design: Path, as_json: bool) -> None:
    """Score and trace DESIGN.json, an existing or hand-edited design, and report its focus and blur.

    If recorded values contradict the mirrors, a warning is printed and the score is that of the mirrors. Exit code 1 if
    a view of a sensor with departures (as_built) does not see all of the working volume.
    """
    from designer.design import read_design

    record = read_design(design)
    from designer.cli.focus import describe_focus
    from designer.evaluate.focus_table import focus_table
    from designer.evaluate.score import evaluate_design
    from designer.verify.contradicted_record import record_problems
    from designer.verify.description import describe
    from designer.verify.judge import judge
    from designer.verify.traced_views import as_traced
    from designer.verify.wall_reflections import wall_reflections

    geometry, warnings = as_traced(record)
    warnings += record_problems(geometry)
    for warning in warnings:
        click.echo(f"designer: warning: {' '.join(warning.split())}", err=True)
    try:
        score = evaluate_design(geometry)
    except InputError as error:
        raise InputError(f"{design}: {error}") from None
    measured = None if score.depth.second_order_valid else _monte_carlo(geometry)
    focus = focus_table(geometry)
    built = _built(design, record)
    verdict = judge(record)
    summary = {"baseline_mm": geometry.baseline_mm} | score.as_json()
    if as_json:
        import json
        from dataclasses import asdict

        content: dict[str, object] = {
            "warnings": warnings,
            "evaluation": summary,
            "monte_carlo": measured,
            "focus": focus,
            "trace": asdict(verdict),
        }
        if geometry.tube is not None:
            content["wall_reflections_deg"] = wall_reflections(geometry)
        if built is not None:
            content["as_built"] = asdict(built)
        click.echo(json.dumps(_plain(content), indent=2))
        _exit_if_blind(built)
        return
    for said_in_words in ("fabrication_notes", "focus", "housing"):
        summary.pop(said_in_words, None)
    click.echo("\n".join(_outline(_plain(summary))))
    click.echo("\n".join(["", _what_the_points_count(geometry)]))
    click.echo("\n".join(_what_the_scale_does(score.depth, geometry.scale_uncertainty)))
    click.echo("\n".join(_how_good_the_score_is(score.depth, measured)))
    if focus is not None:
        click.echo("\n".join([*describe_focus(focus), ""]))
    if geometry.housing is not None:
        click.echo("\n".join([*_housing_lines(geometry), ""]))
    if score.fabrication_notes:
        click.echo("\n".join(["before ordering mirrors:", *(f"  - {note}" for note in score.fabrication_notes), ""]))
    click.echo(describe(verdict, built.problems if built else ()))
    _echo_built(built, record)
    _exit_if_blind(built)


def _built(path: Path, design: Design) -> BuiltSensor | None:
    """The sensor as it was built, if the design says how; nothing of it is needed for a design without departures."""
    if design.as_built is None:
        return None
    from designer.as_built.built import built_sensor

    try:
        return built_sensor(design)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _echo_built(built: BuiltSensor | None, design: Design) -> None:
    if built is not None:
        from designer.as_built.words import describe_built

        click.echo("\n".join(["", *describe_built(built, design)]))


def _exit_if_blind(built: BuiltSensor | None) -> None:
    """No score holds for a sensor that does not see all of the working volume."""
    if built is not None and len(built.problems) > len(built.contacts):
        raise SystemExit(REJECTED)


def _housing_lines(design: Design) -> list[str]:
    """What the housing is and does, where its numbers say so."""
    from designer.cli.housing import describe_housing
    from designer.evaluate.housing import housing_score
    from designer.verify.wall_reflections import wall_reflections

    return describe_housing(housing_score(design), wall_reflections(design))


def _what_the_points_count(design: Design) -> str:
    """What is in the deviations of the table of points, as in the score."""
    scale = (
        f"a scale known to {_percent(design.scale_uncertainty)}, added in quadrature"
        if design.scale_uncertainty
        else "no uncertainty of the scale, as the design gives none"
    )
    return (
        f"depth errors and sigmas of points count {design.noise_px:.6g} px of noise in each image point, the same "
        f"everywhere (noise_px), and {scale}"
    )


def _what_the_scale_does(depth: DepthScore, uncertainty: float) -> list[str]:
    """How far an error of the image's scale shifts the depth, and its share of the score; after an empty line."""
    rms, worst = depth.depth_shift_per_scale, depth.depth_shift_per_scale_worst
    if rms is None or worst is None:
        return []
    counted = (
        f"the depth error counts {_percent(uncertainty * rms)} rms for a scale known to {_percent(uncertainty)}"
        if uncertainty
        else "the depth error does not count it"
    )
    shifts = f"{_percent(0.001 * rms)} rms, up to {_percent(0.001 * worst)}"
    return ["", f"0.1 % of image scale shifts the depth by {shifts}; {counted}"]


def _how_good_the_score_is(depth: DepthScore, measured: dict[str, float | None] | None) -> list[str]:
    """What to make of a depth error that first order does not say to 2 percent; an empty line before and after."""
    if depth.first_order_valid:
        return [""]
    first, second = (
        f"{_percent(rms)} rms, {_percent(worst)} at worst"
        for rms, worst in (
            (depth.depth_error_rms, depth.depth_error_worst),
            (depth.depth_error_rms_second_order, depth.depth_error_worst_second_order),
        )
    )
    lines = ["", f"depth error, first order: {first}; with second order: {second}"]
    if measured is not None:
        lines.append(
            "neither is valid at the worst points; in a Monte Carlo simulation with the tracer the central 68 % of "
            "errors lie between "
            f"{_percent(measured['low'])} and {_percent(measured['high'])}"
        )
        if measured["lost"]:
            lines.append(f"for a further {_percent(measured['lost'])} the rays diverge, so there is no distance")
    return [*lines, ""]


def _monte_carlo(design: Design) -> dict[str, float | None]:
    """The middle 68.27 percent of relative depth errors over the volume, and the share of points without a distance."""
    from designer.verify.montecarlo import depth_error_monte_carlo, middle_of

    samples = 20_000
    low, high, lost = middle_of(depth_error_monte_carlo(design, samples))
    return {"low": low, "high": high, "lost": lost}


def _percent(value: float | None) -> str:
    return "unknown" if value is None else f"{100.0 * value:.3g} %"


def _plain(value: object) -> object:
    """The value in JSON's own types; numbers that JSON does not know become null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # NumPy arrays and scalars
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def _outline(value: object, indent: str = "") -> list[str]:
    """Lines of ``key: value``, tables indented; a list of tables has a row for each key, a column for each table."""
    if not isinstance(value, dict):
        return [f"{indent}{_text(value)}"]
    lines = []
    for key, item in value.items():
        if isinstance(item, dict):
            lines += [f"{indent}{key}:", *_outline(item, indent + "  ")]
        elif isinstance(item, list) and item and all(isinstance(entry, dict) for entry in item):
            lines += [f"{indent}{key}:", *(f"{indent}  {line}" for line in _columns(item))]
        else:
            lines.append(f"{indent}{key}: {_text(item)}")
    return lines


def _columns(tables: list[dict[str, object]]) -> list[str]:
    keys = list(dict.fromkeys(key for table in tables for key in table))
    rows = [[key, *(_text(table.get(key)) for table in tables)] for key in keys]
    return aligned(rows)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if value is None:
        return "none"
    if isinstance(value, list):
        return ", ".join(_text(item) for item in value)
    return str(value)
