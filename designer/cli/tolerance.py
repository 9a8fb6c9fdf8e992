"""``designer tolerance``: what a design's tolerances cost, and how many sensors built to them are good."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from designer.files import InputError

if TYPE_CHECKING:
    from designer.as_built.budget import Budget
    from designer.as_built.compensation import Calibration
    from designer.as_built.sensitivity import Impact
    from designer.as_built.study import ToleranceStudy

REJECTED = 1
# Below this yield a user is told what may help.
FEW = 0.1
HEADER = (
    "departure",
    "tolerance",
    "epipolar error (px)",
    "calibrated",
    "depth bias (%)",
    "calibrated",
    "growth (%)",
    "viewpoint (mm)",
    "blur (px)",
    "allowed",
)

CALIBRATED = {
    "views": "image centre, scale and turn of each view found",
    "image": "one centre, scale and turn of the whole image found",
    "none": "nothing found",
}


@click.command()
@click.argument("design", type=click.Path(path_type=Path), metavar="DESIGN.json")
@click.option("--tolerances", type=click.Path(path_type=Path), help="TOML file of tolerances (docs/tolerances.md).")
@click.option("--grade", help="coarse, standard or precision, instead of a file.  [default: standard]")
@click.option("--trials", type=int, default=10_000, show_default=True, help="Sensors to build and trace.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Random seed of the trials.")
@click.option(
    "--calibration",
    type=click.Choice(["views", "image", "none"]),
    default="views",
    show_default=True,
    help="What is calibrated (centre, scale, rotation): each view, the whole image, or nothing.",
)
@click.option("--align", metavar="MIRROR", help="Mirror to be adjusted along the axis at assembly.")
@click.option(
    "--budget",
    "asked_percent",
    type=float,
    metavar="PERCENT",
    help="Find the cheapest tolerances for which this percentage of the sensors is good.",
)
@click.option(
    "--write-trial", "numbers", type=int, multiple=True, help="Also write trial N as a design file; may be repeated."
)
@click.option("-o", "--out", type=click.Path(path_type=Path), required=True, help="Folder for tables and results.")
def tolerance(
    design: Path,
    tolerances: Path | None,
    grade: str | None,
    trials: int,
    seed: int,
    calibration: Calibration,
    align: str | None,
    asked_percent: float | None,
    numbers: tuple[int, ...],
    out: Path,
) -> None:
    """Report the effect of each manufacturing departure from DESIGN.json, and the yield.

    Exit code 1 if the ray tracer rejects the design itself: the first line says why.
    """
    from designer.design import read_design

    if tolerances is not None and grade is not None:
        raise InputError("--tolerances and --grade: give one; a file has a key grade of its own")
    if asked_percent is not None and not 0.0 < asked_percent < 100.0:
        raise InputError(f"--budget {asked_percent:g}: must be more than 0 and less than 100 (percent)")
    record = read_design(design)
    from designer.as_built.folder import check_tolerance_folder
    from designer.as_built.study import study_tolerances, write_tolerance_study
    from designer.as_built.tolerances import read_tolerances, tolerances_of_grade

    check_tolerance_folder(out)
    asked = read_tolerances(tolerances, record) if tolerances is not None else tolerances_of_grade(grade or "standard")
    try:
        asked_yield = None if asked_percent is None else asked_percent / 100.0
        study = study_tolerances(record, asked, trials, seed, align, calibration, asked_yield)
    except InputError as error:
        raise InputError(f"{design}: {error}") from None
    files = write_tolerance_study(study, out, numbers)
    if study.problems:
        click.echo(f"rejected by the ray tracer: {'; '.join(study.problems)}", err=True)
    click.echo("\n".join(describe_tolerances(study)))
    click.echo("\n".join(f"{path} written" for path in files))
    if study.problems:
        raise SystemExit(REJECTED)


def describe_tolerances(study: ToleranceStudy) -> list[str]:
    """The table of departures, and the yield in words."""
    from designer.as_built.sharpness import describe_limit
    from designer.as_built.study import percentiles
    from designer.as_built.words import noise_in_words
    from designer.cli.table import format_table

    result, trials = study.trials.result, study.trials
    growth = 100.0 * result.growth
    asked = study.model.design.sharpness
    blur = "" if asked is None or result.blurred is None else describe_limit(asked)
    good = f"depth error at most {growth:g} % larger" + (f", blur at most {blur}" if blur else "")
    table = format_table(HEADER, [_row(impact) for impact in study.impacts], HEADER[1:])
    _, middle_before, worst_before = (_percent(value) for value in percentiles(trials.depth_error_before))
    _, middle, worst = (_percent(value) for value in percentiles(trials.depth_error_after))
    apart = percentiles(trials.measured.centres_apart_px)
    low, high = (100.0 * end for end in result.interval)
    aligned = "" if study.align is None else f"{study.align} mirror adjusted along the axis, "
    lines = [
        f"{study.model.design.configuration}: depth error {100.0 * study.model.noise:.4g} % as designed "
        f"({noise_in_words(study.model.design)})",
        "",
        "Each departure alone at its tolerance, the worse of both signs, by growth of the depth error once calibrated:",
        table,
        f"calibrated: {aligned}{CALIBRATED[study.model.calibration]};",
        "viewpoint: root mean square distance of a view's rays from the point that they pass nearest to;",
        f"allowed: the departure at which it alone lets the calibrated depth error grow by {growth:g} %"
        + (f", or blurs by more than {blur} somewhere (blur)" if blur else ""),
        "",
        f"All at once, {result.trials} sensors traced, seed {study.seed}:",
        f"  depth error, median and 95th percentile: {middle_before} and {worst_before} uncalibrated, "
        f"{middle} and {worst} calibrated",
        f"  distance between the image centres of the two views, likewise: {apart[1]:.3g} and {apart[2]:.3g} px",
        f"  yield ({good}): {100.0 * result.value:.1f} %, "
        f"95 % interval {low:.1f} to {high:.1f} %; first order says {100.0 * result.first_order:.1f} %"
        + (", with the blur as traced" if blur else ""),
        f"  {result.blurred} of them blur by more than {blur} somewhere"
        if blur
        else "  blur is not judged: the design has no limits of it",
    ]
    if not result.first_order_holds:
        lines.append("  first order fails here: the two differ by more than 3 percentage points")
    if result.value < FEW:
        lines.append(f"  few are good: {_what_helps(study)}")
    if result.blind:
        lines.append(f"  {result.blind} of them do not show all of the working volume")
    return [*lines, *(_budget_in_words(study.budget) if study.budget is not None else ()), ""]


def _budget_in_words(budget: Budget) -> list[str]:
    """Each tolerance that was chosen with its class and cost, or what the finest class reaches."""
    from designer.cli.table import format_table

    asked, reached = f"{100.0 * budget.asked:g} %", f"{100.0 * budget.reached.value:.1f} %"
    if not budget.choices:
        return [
            "",
            f"No budget: with every open tolerance in the finest class {reached} of the sensors are good, not {asked}.",
        ]
    rows = [
        (f"{choice.part} {choice.key}", choice.chosen, f"{choice.value:g}", f"{choice.cost:g}")
        for choice in budget.choices
    ]
    of_class = ", ".join(f"{cost:g} with all {grade}" for grade, cost in budget.cost_of_class.items())
    return [
        "",
        f"The cheapest classes found with which at least {asked} of the sensors are good ({reached}):",
        format_table(("tolerance", "class", "value", "cost"), rows, ("value", "cost")),
        f"cost: {budget.cost:g}; {of_class}",
    ]


def _what_helps(study: ToleranceStudy) -> str:
    from designer.as_built.tolerances import finer_grade, tolerances_of_grade

    tolerances, finer, found = study.tolerances, finer_grade(study.tolerances.grade), []
    if finer is not None:
        is_grade = tolerances == tolerances_of_grade(tolerances.grade)
        found.append(f"--grade {finer}" if is_grade else f'grade = "{finer}" or tighter tolerances of your own')
    else:
        found.append("tighter tolerances of the parts at the top of the table (--tolerances)")
    if study.align is None:
        names = " or ".join(mirror.name for mirror in study.model.design.mirrors)
        found.append(f"--align {names}, if assembly can move that mirror along the axis")
    return f"try {', and '.join(found)}"


def _row(impact: Impact) -> tuple[str, ...]:
    unit = f" {impact.parameter.unit}" if impact.parameter.unit else ""
    return (
        impact.parameter.name,
        f"{impact.tolerance:.4g}{unit}",
        _number(impact.epipolar_px, 3),
        _number(impact.epipolar_px_after, 3),
        _number(100.0 * impact.depth_bias, 3),
        _number(100.0 * impact.depth_bias_after, 3),
        _number(100.0 * impact.growth_after, 1),
        _number(impact.viewpoint_spread_mm, 4),
        f"{impact.blur_change_px:+.2f}",
        impact.allowed_in_words(unit),
    )


def _percent(value: float) -> str:
    return "no depth" if value == float("inf") else f"{100.0 * value:.4g} %"


def _number(value: float, decimals: int) -> str:
    """A number, ``no depth`` where the rays diverge and ``blind`` where the mirrors do not show all points."""
    if value != value:
        return "blind"
    return "no depth" if value == float("inf") else f"{value:.{decimals}f}"
