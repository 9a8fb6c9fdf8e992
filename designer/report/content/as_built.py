"""The report's page on sensors as built: what the best designs forgive."""

from __future__ import annotations

from collections.abc import Mapping

from designer.report.content.tables import in_percent, percent_decimals
from designer.report.figures.registry import AS_BUILT, DrawnFigure, study_figures
from designer.study.study import Study
from designer.study.tolerances import Forgiveness, RecordedImpact, StudyTolerances
from designer.typesetting.markup import DASH, call, cells, literal, number, text, typographic

SHOWN_IMPACTS = 12
"""The departures of the winner that are listed, the worst first."""


def as_built(study: Study, drawings: Mapping[str, DrawnFigure]) -> str:
    """Yield and depth error of sensors built to one set of tolerances; nothing if none was asked for."""
    found = study.tolerances
    if found is None or not found.designs:
        return ""
    lines = [
        "#pagebreak(weak: true)",
        "= As built <as-built>",
        text(_introduction(found)),
        _designs(study, found),
        text(most_forgiving_in_words(found)),
    ]
    for figure in study_figures(AS_BUILT):
        if figure.file() in drawings:
            lines.append(f"#figure(image({literal('figures/' + figure.file())}), caption: [{figure.title(study)}])")
    first = found.designs[0]
    if first.impacts:
        lines += [_impacts(first), text(_reading(found))]
    return "\n\n".join(line for line in lines if line)


def most_forgiving_in_words(found: StudyTolerances) -> str:
    """Which of the designs has the least depth error at the 95th percentile, and what that costs as designed."""
    best, first = found.most_forgiving, found.designs[0]
    if best is None:
        return "No design keeps a depth at the 95th percentile."
    if best.configuration == first.configuration:
        return (
            f"The winner is also the most forgiving: no other of these designs has a lower depth error at the 95th "
            f"percentile ({_percent(best.high)})."
        )
    return (
        f"The most forgiving of these designs is {best.configuration}: {_percent(best.high)} at the 95th percentile, "
        f"where the winner has {_percent(first.high)}. As designed, it has {_percent(best.depth_error_as_designed)} "
        f"and the winner {_percent(first.depth_error_as_designed)}."
    )


def _introduction(found: StudyTolerances) -> str:
    named = f"the {found.name} grade" if found.name in ("coarse", "standard", "precision") else found.name
    return (
        f"{found.trials} sensors of each of the best designs, and of the most forgiving of the others if that forgives "
        f"more, built within the tolerances of {named} and calibrated (image centre, scale and rotation of each "
        f"view), by ray tracing. A sensor is good if its depth error is at most {100 * found.growth:g} % larger than "
        "designed and its blur stays within the design's limits."
    )


def _designs(study: Study, found: StudyTolerances) -> str:
    errors = [value for each in found.designs for value in (each.depth_error_as_designed, each.median, each.high)]
    decimals = percent_decimals(errors, significant=4)
    rows = []
    for each in found.designs:
        row = study.row(each.configuration)
        rank = "" if row is None or row.rank is None else str(row.rank)
        if each.problem:
            rows.append([rank, each.configuration, typographic(each.problem), DASH, DASH, DASH])
            continue
        low, high = each.good_interval or (0.0, 0.0)
        rows.append(
            [
                rank,
                each.configuration,
                in_percent(each.depth_error_as_designed, decimals),
                _or_none(each.median, decimals),
                _or_none(each.high, decimals),
                f"{number(100 * (each.good or 0.0), 1)} ({number(100 * low, 1)} to {number(100 * high, 1)})",
            ]
        )
    return call(
        "ruled",
        columns="(auto, 1fr, auto, auto, auto, auto)",
        align="(right, left, right, right, right, right)",
        header="([rank], [configuration], [depth error\\ as designed (%)], [median\\ (%)], [95th\\ percentile (%)], "
        "[good sensors (%)\\ and 95 % interval],)",
        rows=cells(rows),
    )


def _impacts(first: Forgiveness) -> str:
    rows = [_impact(impact) for impact in first.impacts[:SHOWN_IMPACTS]]
    table = call(
        "ruled",
        columns="(1fr, auto, auto, auto)",
        align="(left, right, right, right)",
        header="([departure], [tolerance], [growth of the\\ depth error (%)], [allowed alone],)",
        rows=cells(rows),
    ).strip()
    caption = (
        f"The departures of the winner, #name-of({literal(first.configuration)}), that matter most: each alone at its "
        "tolerance."
    )
    return f"#figure({table.removeprefix('#')}, kind: table, caption: [{caption}])"


def _impact(impact: RecordedImpact) -> list[str]:
    unit = f" {impact.unit.replace('deg', '°')}" if impact.unit else ""
    if impact.allowed is None:
        allowed = "any" if impact.is_harmless else "unknown"
    else:
        allowed = f"{plain(impact.allowed)}{unit}" + (" (blur)" if impact.allowed_by == "blur" else "")
    growth = "no depth" if impact.growth is None else number(100 * impact.growth, 1)
    return [impact.name, f"± {plain(impact.tolerance)}{unit}", growth, allowed]


def plain(value: float) -> str:
    """A tolerance with the digits that matter."""
    return f"{value:.2g}"


def _reading(found: StudyTolerances) -> str:
    return (
        "Allowed alone: the departure that by itself increases the calibrated depth error by "
        f"{100 * found.growth:g} %, or at which the blur exceeds the design's limit (blur). designer tolerance gives "
        "all departures, also before calibration, and with --budget the cheapest tolerances for a yield."
    )


def _or_none(value: float | None, decimals: int) -> str:
    return "no depth" if value is None else in_percent(value, decimals)


def _percent(value: float | None) -> str:
    return "no depth" if value is None else f"{in_percent(value, percent_decimals([value], significant=4))} %"
