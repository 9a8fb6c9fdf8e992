"""``sweep.pdf``: what a sweep found, with maps of which configuration wins where."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd

from designer.evaluate.depth import FIRST_ORDER_BOUND
from designer.files import InputError, write_atomically
from designer.goals import GOALS
from designer.report.figures.style import report_style, svg_bytes
from designer.report.figures.sweep import (
    NAMED_COLOURS,
    draw_heat_map,
    draw_parallel,
    draw_pareto,
    draw_winner_map,
    letters_of,
    short,
)
from designer.report.typst.glyphs import ELLIPSIS, missing_characters, without_characters
from designer.report.typst.markup import DASH, call, cells, literal, number, text
from designer.report.typst.pdf import typeset
from designer.study.sweep.designs import sensitivities
from designer.study.sweep.export import axis_columns, pareto, read_sweep_results, requirement_of, winners
from designer.study.sweep.store import read_store

WIDTH_MM = 168.0
LISTED_WINNERS = 15
# Multipliers are shown for so many winners, spread over the sweep.
SENSITIVITIES_SHOWN = 10
SMALLEST_SLOPE_SHOWN = 1e-4
FRONT_COLUMNS = ("depth_error_rms", "height_mm", "diameter_mm")


def write_sweep_pdf(folder: Path) -> Path:
    """Draw a sweep's figures, typeset its report, and return the path of ``sweep.pdf``.

    Raises
    ------
    InputError
        The folder holds no sweep, or nothing in it is feasible.
    """
    table = read_sweep_results(folder)
    best = winners(table)
    if best.empty:
        raise InputError(f"{folder}: nothing is feasible in this sweep, so there is nothing to draw")
    figures = _draw(table, best)
    for name, svg in figures.items():
        write_atomically(folder / "figures" / name, svg)
    path = folder / "sweep.pdf"
    write_atomically(path, typeset(legible(source(folder, table, best)), figures))
    return path


def legible(written: str) -> str:
    """The source with nothing in it that the report's fonts cannot print, and a note if there was something."""
    missing = missing_characters(written)
    if not missing:
        return written
    note = f"The fonts of the report lack characters of the sweep's title or description: {ELLIPSIS} stands for them."
    return without_characters(written, missing) + "\n" + text(f" {note}")


def _draw(table: pd.DataFrame, best: pd.DataFrame) -> dict[str, bytes]:
    """Every figure as SVG by its file name."""
    letters = letters_of(best)
    axes = [axis for axis in axis_columns(table) if table[axis].nunique() > 1] or axis_columns(table)
    feasible = table[table["status"] == "feasible"]
    front = pareto(feasible, FRONT_COLUMNS)
    shown = best.assign(percent=100.0 * best["depth_error_rms"])
    with report_style():
        drawn = {
            "winners.svg": draw_winner_map(best, table[axes], letters, WIDTH_MM),
            "depth-error.svg": draw_heat_map(shown, table[axes], "percent", "depth error of the winner (%)", WIDTH_MM),
            "limit-ratio.svg": draw_heat_map(best, table[axes], "limit_ratio", "depth error / limit", WIDTH_MM),
            "height.svg": draw_heat_map(best, table[axes], "height_mm", "height of the winner (mm)", WIDTH_MM),
            "pareto.svg": draw_pareto(feasible, letters, WIDTH_MM),
            "parallel.svg": draw_parallel(front, axes, letters, WIDTH_MM),
        }
        return {name: svg_bytes(figure) for name, figure in drawn.items()}


def source(folder: Path, table: pd.DataFrame, best: pd.DataFrame) -> str:
    """The report as Typst source."""
    with read_store(folder) as connection:
        about = dict(connection.execute("SELECT key, value FROM about"))
        planned = connection.execute("SELECT COUNT(*) FROM points").fetchone()[0]
    definition = json.loads(about["definition"])
    base = requirement_of(folder)
    letters = letters_of(best)
    front = pareto(table[table["status"] == "feasible"], FRONT_COLUMNS)
    parts = [
        '#import "style.typ": *\n',
        f"#show: report.with(study: {literal(definition['name'])}, title: {literal(definition['title'])}, "
        'kind: "sweep")\n',
        f'#text(size: 18pt, weight: "bold", {literal(definition["title"])})\n',
        text(definition["description"]) + "\n",
        _summary(table, best, planned),
        "= Who wins where\n",
        _figure(
            "winners.svg",
            "Best configuration of each requirement. Letters as in the table; the "
            f"{len(NAMED_COLOURS)} that win most often are coloured, the rest grey. No cell, or a cross: nothing is "
            "feasible.",
        ),
        _winners_table(best, letters),
        "= How good the winner is\n",
        _figure("depth-error.svg", "Depth error of the best design: root mean square over the working volume."),
        _figure("limit-ratio.svg", "Its ratio to the closed-form limit at its own baseline and lens."),
        _figure("height.svg", "Its height."),
        "= Fronts over the whole sweep\n",
        _figure(
            "pareto.svg",
            "Every feasible design of the sweep (grey) and the front of depth error against height and diameter, "
            "with the letter of its configuration where it wins somewhere.",
        ),
        _figure(
            "parallel.svg",
            f"The {len(front)} designs that no other beats in depth error, height and diameter at once: what was "
            "asked, and what came of it. Colours as in the map.",
        ),
        sensitivity_section(folder, best, base.objective.minimise),
        "= Where it comes from\n",
        text(
            f"Designer {about['version of designer']}, base requirement {base.name}, plan "
            f"{definition['plan'].replace('_', ' ')}, seed {definition['seed']} of the plan and "
            f"{base.solve.seed} of the searches. Each point started from a neighbour's optimum along a fixed "
            "tree; each feasible design was traced over the elevations asked of it. A design may have stayed in its "
            "neighbour's optimum: before building one, run a study of its requirement, which searches from nothing."
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
        f" Depth errors are first order; in {bent} of these requirements the winner's worst point is beyond "
        f"{100 * FIRST_ORDER_BOUND:g} %, where that is too little."
        if bent
        else ""
    )
    unfinished = f" of {planned} planned" if solved < planned else ""
    return call(
        "boxed",
        literal("In short"),
        "["
        + text(
            f"{solved} requirements{unfinished}: {axes}. {len(table)} configuration problems: {statuses}. "
            f"{len(best)} requirements have at least one feasible design. Different winners: "
            f"{best['configuration'].nunique()}, most often {best['configuration'].value_counts().index[0]}. The least "
            f"depth error of the sweep is {100 * least['depth_error_rms']:.3g} %, by {least['configuration']} "
            f"{least['height_mm']:.0f} mm tall.{beyond}"
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
            ]
        )
    return call(
        "ruled",
        columns="(auto, 1fr) + (auto,) * 5",
        align="(left, left) + (right,) * 5",
        header="([], [configuration], [wins], [depth error (%)], [of limit], [height (mm)], [diameter (mm)],)",
        rows=cells(rows),
    ) + text("Medians over the requirements where each wins.")


def sensitivity_section(folder: Path, best: pd.DataFrame, goal: str) -> str:
    """What one more unit of each key does to the first objective of some winners."""
    chosen = best.iloc[np.unique(np.linspace(0, len(best) - 1, SENSITIVITIES_SHOWN).round().astype(int))]
    slopes = sensitivities(folder, list(zip(chosen["point"], chosen["configuration"], strict=True)))
    keys = [key for key in slopes.columns[2:] if slopes[key].abs().max() > 0.0]
    if slopes.empty or not keys:
        return ""
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
    header = ", ".join(f"[#text({literal(short(key))})]" for key in keys)
    return (
        "= What each requirement is worth\n"
        + text(
            f"Change of the least {objective}, in {unit}, for one more unit (mm, degree or pixel) of each key: the "
            "Lagrange multipliers of the first stage, at winners spread over the sweep. They hold while the same "
            "constraints hold the design. After the number of the point stands what was asked: "
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


def slope_words(value: float) -> str:
    """Three digits; a dash for nothing worth mentioning, and where the key cannot move both ways."""
    return DASH if not abs(value) >= SMALLEST_SLOPE_SHOWN else f"{value:+.3g}".replace("-", "−")


def _figure(name: str, caption: str) -> str:
    return f'#figure(image("figures/{name}", width: 100%), caption: [{text(caption)}])\n'
