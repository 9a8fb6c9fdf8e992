"""The report's section on the end-to-end checks: a page for each checked design."""

from __future__ import annotations

from typing import Any

from designer.design import Design
from designer.report.content.tables import percent
from designer.report.figures.check import slab_of
from designer.report.figures.style import length_unit
from designer.report.typst.markup import DASH, call, cells, literal, number, text, typographic
from designer.study.checked import CheckedDesign
from designer.study.results import Row


def check_heading(definition: str) -> str:
    """Opens the section and says what passing means; without a definition, no design was checked to the end."""
    intro = (
        "The image that each camera would record of a scene was rendered by ray tracing, with the noise of a detector, "
        "turned into two panoramas of equalised resolution, matched, and triangulated; the distances are compared "
        "with the truth and with the prediction."
    )
    if definition:
        intro += (
            " Floor plans show the points of a slab of heights, measured from the middle of the baseline. A design "
            f"{definition}."
        )
    return f"#pagebreak(weak: true)\n= End-to-end check <check>\n#[#set text(size: 9pt)\n{text(intro)}]\n"


def unchecked_line(row: Row, reason: str) -> str:
    """A design whose check broke down."""
    name = f"#name-of({literal(row.configuration)})"
    return f"Rank {row.rank}, {name}, {text(f'could not be checked: {typographic(reason)}')}.\n"


def check_page(row: Row, checked: CheckedDesign) -> str:
    """One page for one checked design."""
    configuration = row.configuration
    verdict = checked.verdict
    word, colour = ("passes", 'rgb("#009E73")') if checked.passed else ("fails", 'rgb("#D55E00")')
    found = sum(band["judged"] for band in verdict["bands"])
    passed = sum(band["judged"] and not band["problems"] for band in verdict["bands"])
    summary = (
        f" {passed} of {found} bands of distance. Scene: {verdict['scene']}, {verdict['texture']} texture. "
        f"Noise of an image point in each view, measured on the calibration scene: "
        f"{_noise(verdict['noise_px'])}."
    )
    raw, maps, plan, errors = (figure_name(kind, configuration) for kind in ("raw", "maps", "plan", "errors"))
    lines = [
        f"== Rank {row.rank}: #name-of({literal(configuration)}) #h(1fr) #text(fill: {colour}, {literal(word)})",
        text(summary.strip()),
        "#v(1mm)",
        "#grid(columns: (82mm, 1fr), column-gutter: 4mm,",
        f"  panel([Raw image], align(center)[#v(1.5mm)#image({literal(raw)}, width: 50mm)]),",
        f"  panel([{_plan_title(checked.design)}], image({literal(plan)})),",
        ")",
        f"#image({literal(maps)})",
        "#grid(columns: (92mm, 1fr), column-gutter: 3mm,",
        f"  panel([Measured against predicted error], image({literal(errors)})),",
        f"  panel([Bands of distance], [#v(2mm){_bands(checked)}]),",
        ")",
    ]
    return "\n".join(lines)


def figure_name(kind: str, configuration: str) -> str:
    """Path of a check's figure in the report."""
    return f"figures/check-{kind}-{configuration}.svg"


def _plan_title(design: Design) -> str:
    middle = design.views.middle_mm
    low, high = (height - middle for height in slab_of(design))
    return f"Floor plan, {number(low, 0)} to {number(high, 0)} mm"


def _noise(noise_px: object) -> str:
    """The noise in words; a dash where the check found none."""
    if not isinstance(noise_px, dict) or noise_px.get("median") is None:
        return DASH
    median, least, largest = (number(noise_px.get(name), 3) for name in ("median", "least", "largest"))
    return f"{median} px ({least} to {largest} over elevations and distances)"


def _bands(checked: CheckedDesign) -> str:
    unit_mm, unit = length_unit(checked.design.working_volume.distance_mm[1])
    rows = [_band(band, unit_mm) for band in checked.verdict["bands"]]
    header = f"([distance\\ ({unit})], [kept\\ (%)], [bias\\ (%)], [rms over\\ predicted], [verdict])"
    return call(
        "ruled",
        columns="(1fr,) + (auto,) * 4",
        align="(left, right, right, right, left)",
        header=header,
        rows=cells(rows),
        size="7.6pt",
        inset="(x: 1mm, y: 0.9mm)",
    )


def _band(band: dict[str, Any], unit_mm: float) -> list[str]:
    low, high = (number(end / unit_mm, 2 if unit_mm > 1 else 0) for end in band["distance_mm"])
    if not band["judged"]:
        return [f"{low} to {high}", "", "", "", "too few pixels"]
    return [
        f"{low} to {high}",
        percent(band["kept"], 1),
        f"{percent(band['bias'], 2)} (±{percent(band['bias_bound'], 2)})",
        number(band["error_ratio"], 2),
        ", ".join(band["problems"]) or "pass",
    ]
