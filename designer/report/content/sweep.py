"""What ``sweep.pdf`` says: what a sweep found, with maps of which configuration wins where."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from designer.evaluate.depth import FIRST_ORDER_BOUND
from designer.goals import GOALS
from designer.optimise.multipliers import F_NUMBER
from designer.report.figures.sweep import letters_of, short
from designer.report.figures.sweep_registry import HOW_GOOD, PARETO, SWEEP_FIGURES, WHO_WINS, SweepTables
from designer.requirement.design_quantities import design_quantities
from designer.study.sweep.designs import multipliers_of_designs
from designer.study.sweep.store import read_store
from designer.study.sweep.tables import axis_columns, requirement_of
from designer.typesetting.glyphs import ELLIPSIS, missing_characters, without_characters
from designer.typesetting.markup import DASH, call, cells, literal, number, text

LISTED_WINNERS = 15
# Multipliers are shown for so many winners, spread over the sweep.
SENSITIVITIES_SHOWN = 10
SMALLEST_SLOPE_SHOWN = 1e-4


def legible(written: str) -> str:
    """The source with nothing in it that the report's fonts cannot print, and a note if there was something."""
    missing = missing_characters(written)
    if not missing:
        return written
    note = (
        "The report fonts do not contain some characters of the sweep's title or description: "
        f"{ELLIPSIS} replaces them."
    )
    return without_characters(written, missing) + "\n" + text(f" {note}")


def source(folder: Path, tables: SweepTables) -> str:
    """The report as Typst source."""
    with read_store(folder) as connection:
        about = dict(connection.execute("SELECT key, value FROM about"))
        planned = connection.execute("SELECT COUNT(*) FROM points").fetchone()[0]
    definition = json.loads(about["definition"])
    base, best = requirement_of(folder), tables.best
    parts = [
        '#import "style.typ": *\n',
        f"#show: report.with(study: {literal(definition['name'])}, title: {literal(definition['title'])}, "
        'kind: "sweep")\n',
        f'#text(size: 18pt, weight: "bold", {literal(definition["title"])})\n',
        text(definition["description"]) + "\n",
        _summary(tables.table, best, planned),
        "= Winning configurations\n",
        *_figures(WHO_WINS, tables),
        _winners_table(best, letters_of(best)),
        "= Performance of the winners\n",
        *_figures(HOW_GOOD, tables),
        "= Pareto fronts over the whole sweep\n",
        *_figures(PARETO, tables),
        sensitivity_section(folder, best, base.objective.minimise),
        "= Provenance\n",
        text(
            f"Designer {about['version of designer']}, base requirement {definition['requirement']}, plan "
            f"{definition['plan'].replace('_', ' ')}, seed {definition['seed']} of the plan and "
            f"{base.solve.seed} of the searches. Each point started from a neighbour's optimum along a fixed "
            "tree, then from the designs of all its neighbours until none was better, with fresh starts where it stood "
            "out; each feasible design was traced over its required elevations. Before building a design, run a study "
            "of its requirement, which searches from scratch and traces the whole image."
        ),
    ]
    return "\n".join(parts)


def _summary(table: pd.DataFrame, best: pd.DataFrame, planned: int) -> str:
    counts = table["status"].value_counts()
    statuses = ", ".join(f"{count} {status}" for status, count in counts.items())
    solved = table["point"].nunique()
    least = best.sort_values("depth_error_rms").iloc[0]
    axes = "; ".join(
        f"{short(axis)} {table[axis].min():g} to {table[axis].max():g} ({table[axis].nunique()} values)"
        for axis in axis_columns(table)
    )
    bent = int((~best["first_order_valid"].astype(bool)).sum())
    beyond = (
        f" Depth errors are first order; for {bent} of these requirements the winner's worst point exceeds "
        f"{100 * FIRST_ORDER_BOUND:g} %, where first order underestimates the error."
        if bent
        else ""
    )
    unfinished = f" of {planned} planned" if solved < planned else ""
    return call(
        "boxed",
        literal("Summary"),
        "["
        + text(
            f"{solved} requirements{unfinished}: {axes}. {len(table)} configuration problems: {statuses}. "
            f"{len(best)} requirements have at least one feasible design. Number of different winning "
            f"configurations: {best['configuration'].nunique()}; the most frequent is "
            f"{best['configuration'].value_counts().index[0]}. The lowest depth error of the sweep is "
            f"{100 * least['depth_error_rms']:.3g} % ({least['configuration']}, {least['height_mm']:.0f} mm "
            f"tall).{beyond}"
        )
        + "]",
    )


def _winners_table(best: pd.DataFrame, letters: dict[str, str]) -> str:
    rows = []
    for name in list(letters)[:LISTED_WINNERS]:
        part = best[best["configuration"] == name]
        rows.append(
            [
                letters[name],
                name,
                str(len(part)),
                number(100.0 * part["depth_error_rms"].median(), 3),
                number(part["limit_ratio"].median(), 3),
                number(part["height_mm"].median(), 1),
                number(part["diameter_mm"].median(), 1),
                _median(part["f_number"]),
                _median(part["largest_blur_px"]),
            ]
        )
    return call(
        "ruled",
        columns="(auto, 1fr) + (auto,) * 7",
        align="(left, left) + (right,) * 7",
        header="([], [configuration], [wins], [depth error (%)], [limit ratio], [height (mm)], [diameter (mm)], "
        "[f-number], [blur (px)],)",
        rows=cells(rows),
    ) + text("Medians over the requirements that each configuration wins.")


def _median(values: pd.Series[float]) -> str:
    """The median with one decimal; a dash where the sweep is of a version that did not know the quantity."""
    return number(None if values.isna().all() else float(values.median()), 1)


def sensitivity_section(folder: Path, best: pd.DataFrame, goal: str) -> str:
    """What one more unit of each key does to the first objective of some winners."""
    chosen = best.iloc[np.unique(np.linspace(0, len(best) - 1, SENSITIVITIES_SHOWN).round().astype(int))]
    slopes = multipliers_of_designs(folder, list(zip(chosen["point"], chosen["configuration"], strict=True)))
    keys = [key for key in slopes.columns[2:] if slopes[key].abs().max() > 0.0]
    if slopes.empty or not keys:
        return ""
    for key in keys:
        slopes[key] *= _shown_step(key)
    weight = slopes[keys].abs().mean().sort_values(ascending=False)
    keys = [str(key) for key in weight.index[:8]]
    axes = axis_columns(best)
    objective, unit, factor = GOALS[goal].label, GOALS[goal].multiplier_unit, GOALS[goal].multiplier_factor
    asked = {row["point"]: ", ".join(f"{row[axis]:.4g}" for axis in axes) for _, row in chosen.iterrows()}
    rows = [
        [
            f"{row['point']}: {asked[row['point']]}",
            row["configuration"],
            *(slope_words(factor * row[key]) for key in keys),
        ]
        for _, row in slopes.iterrows()
    ]
    header = ", ".join(f"[#text({literal(_multiplier_heading(key))})]" for key in keys)
    return (
        "= Sensitivity to the requirement\n"
        + text(
            f"Change of the minimum {objective}, in {unit}, per unit of each key (mm, degree or pixel; another step is "
            f"stated in the heading) and per stop (factor √2) of a given f-number: the Lagrange multipliers of the "
            f"first stage, at winners spread over the sweep. They apply as long as the same constraints are active. "
            f"The number of the point is followed by its values of: "
            f"{', '.join(short(axis) for axis in axes)}."
        )
        + "\n"
        + call(
            "ruled",
            columns=f"(auto, auto) + (1fr,) * {len(keys)}",
            align=f"(left, left) + (right,) * {len(keys)}",
            header=f"([point], [configuration], {header},)",
            rows=cells(rows),
            size="7pt",
        )
    )


def _shown_step(key: str) -> float:
    """The step of a key that its multiplier is shown for, in its units."""
    return design_quantities()[key].shown_step if key in design_quantities() else 1.0


def _multiplier_heading(key: str) -> str:
    """A key as the title of its multipliers, with the step that they are for."""
    if key == F_NUMBER:
        return "f-number (stop)"
    step, (name, bracket, unit) = _shown_step(key), short(key).rpartition("(")
    return short(key) if step == 1.0 else f"{name}{bracket}{step:g} {unit}"


def slope_words(value: float) -> str:
    """Three digits; a dash for nothing worth mentioning, and where the key cannot move both ways."""
    return DASH if not abs(value) >= SMALLEST_SLOPE_SHOWN else f"{value:+.3g}".replace("-", "−")


def _figures(place: str, tables: SweepTables) -> list[str]:
    return [
        f'#figure(image("figures/{figure.file}", width: 100%), caption: [{text(figure.caption(tables))}])\n'
        for figure in SWEEP_FIGURES
        if figure.place == place
    ]
