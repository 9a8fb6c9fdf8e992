"""The tolerances of one design in full: impacts, yield, provenance; and as files.

A results folder holds ``sensitivity.csv``, ``trials.csv``, a design file for each trial that was asked for,
``budget.csv`` and ``budget.toml`` (a tolerance file) if a yield was, and ``tolerance.json``, whose results are written
last.
"""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from designer.as_built.budget import Budget, allocate, tolerances_of
from designer.as_built.compensation import Calibration
from designer.as_built.dual import Array
from designer.as_built.folder import write_tolerance_folder
from designer.as_built.model import Perturbable, perturbable, with_departures
from designer.as_built.sensitivity import Impact, sensitivities
from designer.as_built.tolerances import Tolerances, growth_of, tolerance_values, tolerances_to_toml
from designer.as_built.yields import PERCENTILES, Trials, simulate
from designer.design import Design, design_to_json
from designer.evaluate.score import check_image_law
from designer.files import InputError, as_json
from designer.notebook_html import html_table, percent
from designer.own_files import described_run
from designer.verify.judge import judge

MOST_TRIALS = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class ToleranceStudy:
    """What the tolerances of a design come to.

    ``budget`` is the cheapest allocation if a yield was asked for; then the tolerances are those that it chose.
    ``values`` (parameters,) are the tolerances in the units of ``model.parameters``; ``impacts`` the departures one by
    one, the worst first; ``trials`` sensors with all of them at random. ``problems`` are the ray tracer's reasons to
    reject the design itself; none if it accepts it.
    """

    model: Perturbable
    tolerances: Tolerances
    values: Array
    impacts: list[Impact]
    trials: Trials
    seed: int
    align: str | None
    problems: tuple[str, ...]
    budget: Budget | None = None

    def _repr_html_(self) -> str:
        """The departures as a table, the worst first."""
        rows = [
            (
                f"{impact.parameter.name} ({impact.parameter.unit})"
                if impact.parameter.unit
                else impact.parameter.name,
                f"{impact.tolerance:.4g}",
                f"{impact.epipolar_px:.3f}",
                f"{impact.epipolar_px_after:.3f}",
                percent(impact.depth_bias),
                percent(impact.depth_bias_after),
                impact.allowed_in_words(),
            )
            for impact in self.impacts
        ]
        header = (
            "departure",
            "tolerance",
            "epipolar error (px)",
            "calibrated",
            "depth bias",
            "calibrated",
            "allowed",
        )
        caption = f"{self.model.design.configuration}, yield {percent(self.trials.result.value)}"
        return html_table(caption, header, rows)

    def trial(self, number: int) -> Design:
        """The design file of one trial, counted from 0: the design with an ``as_built`` table.

        Raises
        ------
        InputError
            There is no such trial, or its departures are larger than a design file may hold.
        """
        count = self.trials.result.trials
        if not 0 <= number < count:
            raise InputError(f"trial {number}: must be from 0 to {count - 1}")
        return with_departures(self.model.design, self.trials.measured.values[number])


def study_tolerances(
    design: Design,
    tolerances: Tolerances,
    trials: int,
    seed: int = 0,
    align: str | None = None,
    calibration: Calibration = "views",
    asked_yield: float | None = None,
) -> ToleranceStudy:
    """Measure each departure at its tolerance, and many sensors with all of them.

    Parameters
    ----------
    align
        Name of a mirror that assembly moves along the axis until calibration leaves the least.
    calibration
        What calibration finds: centre, scale and turn of each of the ``views``, of the whole ``image``, or ``none``.
    asked_yield
        The share of good sensors for which to find the cheapest tolerances, see :mod:`designer.as_built.budget`; those
        given stay as they are.

    Raises
    ------
    InputError
        The design does not show its working volume, its lens does not reach the edge of its image circle, or there is
        no such mirror or number of trials.
    """
    if not 1 <= trials <= MOST_TRIALS:
        raise InputError(f"trials = {trials}: must be from 1 to {MOST_TRIALS}")
    check_image_law(design)
    model = perturbable(design, calibration)
    values = tolerance_values(design, model.parameters, tolerances)
    growth = growth_of(tolerances)
    moved = None
    if align is not None:
        places = [place for place, p in enumerate(model.parameters) if (p.part, p.key) == (align, "axial_shift_mm")]
        if not places:
            names = ", ".join(mirror.name for mirror in design.mirrors)
            raise InputError(f"align = {align!r}: the design has no such mirror; its mirrors are {names}")
        moved = places[0]
    impacts, budget = sensitivities(model, values, growth), None
    if asked_yield is not None:
        if not 0.0 < asked_yield < 1.0:
            raise InputError(f"yield = {100.0 * asked_yield:g} %: must be more than 0 and less than 100")
        budget = allocate(model, tolerances, impacts, asked_yield, trials, seed, moved)
        if budget.choices:
            tolerances = tolerances_of(budget, tolerances)
            values = tolerance_values(design, model.parameters, tolerances)
            impacts = sensitivities(model, values, growth)
    found = simulate(model, values, growth, trials, seed, moved)
    problems = judge(design, whole_image=False).problems
    return ToleranceStudy(model, tolerances, values, impacts, found, seed, align, problems, budget)


def write_tolerance_study(study: ToleranceStudy, folder: Path, written_trials: Sequence[int] = ()) -> list[Path]:
    """Write the results folder, and a design file for some trials; returns the files.

    Raises
    ------
    InputError
        The folder is a file or holds something else than an earlier study, or there is no such trial.
    """
    designs = {f"trial_{number:06d}.json": design_to_json(study.trial(number)) for number in written_trials}
    content = {"sensitivity.csv": sensitivity_csv(study), "trials.csv": trials_csv(study), **designs}
    if study.budget is not None and study.budget.choices:
        content |= {"budget.csv": budget_csv(study.budget), "budget.toml": tolerances_to_toml(study.tolerances)}
    return write_tolerance_folder(folder, content, summary(study))


def sensitivity_csv(study: ToleranceStudy) -> str:
    """A row for each departure, the worst first, as in :class:`designer.as_built.sensitivity.Impact`."""
    columns = [key for key in Impact.__dataclass_fields__ if key != "parameter"]
    rows = [
        [impact.parameter.part, impact.parameter.key, *(_cell(getattr(impact, column)) for column in columns)]
        for impact in study.impacts
    ]
    return _csv(["part", "departure", *columns], rows)


def budget_csv(budget: Budget) -> str:
    """A row for each tolerance that was chosen: its class, its value in the unit of its key, its cost."""
    columns = ("part", "tolerance", "class", "value", "cost")
    rows = [
        [choice.part, choice.key, choice.chosen, _cell(choice.value), _cell(choice.cost)] for choice in budget.choices
    ]
    return _csv(columns, rows)


def trials_csv(study: ToleranceStudy) -> str:
    """A row for each trial: its merits, then its departures."""
    trials = study.trials
    before, after = trials.measured.before, trials.measured.after
    columns = {
        "depth_error_before": trials.depth_error_before,
        "depth_error_after": trials.depth_error_after,
        "depth_error_first_order": trials.depth_error_first_order,
        "epipolar_px_before": before.epipolar_px,
        "epipolar_px_after": after.epipolar_px,
        "centres_apart_px": trials.measured.centres_apart_px,
        "viewpoint_spread_mm": before.viewpoint_spread_mm,
        "blur_px": before.blur_px,
    }
    if study.model.sharp is not None:
        columns["blur_of_limit"] = trials.measured.blur_of_limit
    table = np.column_stack([*columns.values(), trials.measured.values])
    names = [f"{parameter.part}.{parameter.key}" for parameter in study.model.parameters]
    rows = [[str(number), *map(_cell, row)] for number, row in enumerate(table.tolist())]
    return _csv(["trial", *columns, *names], rows)


def summary(study: ToleranceStudy) -> dict[str, JsonValue]:
    """Everything but the single trials, as JSON."""
    design, trials = study.model.design, study.trials
    merits = {
        "depth_error_before": trials.depth_error_before,
        "depth_error_after": trials.depth_error_after,
        "epipolar_px_before": trials.measured.before.epipolar_px,
        "epipolar_px_after": trials.measured.after.epipolar_px,
        "centres_apart_px": trials.measured.centres_apart_px,
        "viewpoint_spread_mm": trials.measured.before.viewpoint_spread_mm,
        "blur_px": trials.measured.before.blur_px,
    }
    impacts = [
        {
            "part": impact.parameter.part,
            "departure": impact.parameter.key,
            "unit": impact.parameter.unit,
            **{key: _plain(getattr(impact, key)) for key in Impact.__dataclass_fields__ if key != "parameter"},
        }
        for impact in study.impacts
    ]
    return {
        "configuration": design.configuration,
        "problems": as_json(study.problems),
        "depth_error_as_designed": study.model.noise,
        "grade": study.tolerances.grade,
        "align": study.align,
        "calibration": study.model.calibration,
        "yield": as_json(trials.result),
        "budget": None if study.budget is None else as_json(study.budget),
        "percentiles": {
            key: {f"{share:g}": _plain(value) for share, value in zip(PERCENTILES, percentiles(found), strict=True)}
            for key, found in merits.items()
        },
        "sensitivity": as_json(impacts),
        "provenance": {
            **described_run({"numpy": np.__version__, "scipy": version("scipy")}),
            "design_sha256": hashlib.sha256(design_to_json(design).encode()).hexdigest(),
            "tolerances": as_json(study.tolerances.model_dump(exclude_none=True)),
            "seed": study.seed,
        },
    }


def percentiles(found: Array, shares: Sequence[float] = PERCENTILES) -> list[float]:
    """Percentiles, by default the 5th, 50th and 95th; a sensor that is blind counts as the worst."""
    ordered = np.sort(np.where(np.isnan(found), np.inf, found))
    return [float(ordered[round((len(ordered) - 1) * share / 100.0)]) for share in shares]


def _csv(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return stream.getvalue()


def _cell(value: float | bool | str | None) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, str):
        return value
    return "" if value is None or not np.isfinite(value) else f"{value:.10g}"


def _plain(value: float | str | None) -> float | str | None:
    return value if value is not None and (isinstance(value, str) or np.isfinite(value)) else None
