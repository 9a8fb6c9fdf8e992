"""The report's section on the end-to-end checks: a page for each checked design."""

from __future__ import annotations

from designer.report.content.tables import in_percent
from designer.report.figures.registry import CHECK_BOTTOM, CHECK_TOP, CHECK_WIDE, check_figures
from designer.report.figures.style import length_unit
from designer.study.checked import CheckedBand, CheckedDesign, CheckedNoise, CheckVerdict
from designer.study.row import Row
from designer.typesetting.markup import DASH, call, cells, literal, number, text, typographic


def check_heading(definition: str) -> str:
    """Opens the section and says what passing means; without a definition, no design was checked to the end."""
    intro = (
        "For each design the camera image of a scene was rendered by ray tracing through the design's own lens, with "
        "blur, diffraction, light lost at mirrors and towards the rim, and detector noise. It was unwrapped into two "
        "panoramas of equalised resolution and even brightness, matched and triangulated; the distances are compared "
        "with ground truth and their errors with the prediction."
    )
    if definition:
        intro += (
            " Floor plans show the points in a range of heights, measured from the middle of the baseline. A design "
            f"{definition}."
        )
    return f"#pagebreak(weak: true)\n= End-to-end check <check>\n#[#set text(size: 8.5pt)\n{text(intro)}]\n"


def unchecked_line(row: Row, reason: str) -> str:
    """A design whose check broke down."""
    name = f"#name-of({literal(row.configuration)})"
    return f"Rank {row.rank}, {name}, {text(f'could not be checked: {typographic(reason)}')}.\n"


def check_page(row: Row, checked: CheckedDesign) -> str:
    """One page for one checked design."""
    configuration = row.configuration
    passes = "passes where tested" if checked.verdict.untested else "passes"
    word, colour = (passes, 'rgb("#009E73")') if checked.passed else ("fails", 'rgb("#D55E00")')
    lines = [
        f"== Rank {row.rank}: #name-of({literal(configuration)}) #h(1fr) #text(fill: {colour}, {literal(word)})",
        text(_summary(checked.verdict)),
        "#v(1mm)",
        *_grid("82mm", "4mm", _panels(CHECK_TOP, configuration, checked)),
        *(f"#image({literal('figures/' + figure.file(configuration))})" for figure in check_figures(CHECK_WIDE)),
        *_grid(
            "92mm",
            "3mm",
            [*_panels(CHECK_BOTTOM, configuration, checked), f"panel([Bands of distance], [#v(2mm){_bands(checked)}])"],
        ),
    ]
    return "\n".join(lines)


def _summary(verdict: CheckVerdict) -> str:
    judged = sum(band.judged for band in verdict.bands)
    passed = sum(band.passes for band in verdict.bands)
    share = verdict.kept_of_pinhole
    untested = ", ".join("{:.4g} to {:.4g} mm".format(*band.distance_mm) for band in verdict.untested)
    sentences = [
        f"Passes in {passed} of {judged} bands of distance{f'; not tested: {untested}' if untested else ''}.",
        f"Scene: {verdict.scene}, {verdict.texture} texture, through {verdict.recorded_through}.",
        "" if share is None else f"Points found, relative to those through a pinhole: {in_percent(share, 1)} %.",
        f"Noise of an image point in each view, measured on the calibration scene: {_noise(verdict.noise_px)}.",
    ]
    return " ".join(sentence for sentence in sentences if sentence)


def _grid(first: str, gutter: str, panels: list[str]) -> list[str]:
    """Panels in two columns, the first of a given width."""
    return [
        f"#grid(columns: ({first}, 1fr), column-gutter: {gutter},",
        *(f"  {panel}," for panel in panels),
        ")",
    ]


def _panels(place: str, configuration: str, checked: CheckedDesign) -> list[str]:
    panels = []
    for figure in check_figures(place):
        image = f"image({literal('figures/' + figure.file(configuration))}"
        is_set = figure.set_to_mm is not None
        shown = f"align(center)[#v(1.5mm)#{image}, width: {figure.set_to_mm:g}mm)]" if is_set else f"{image})"
        panels.append(f"panel([{figure.title(checked)}], {shown})")
    return panels


def _noise(noise: CheckedNoise) -> str:
    """The noise in words; a dash where the check found none."""
    if noise.median is None:
        return DASH
    median, least, largest = (number(value, 3) for value in (noise.median, noise.least, noise.largest))
    return f"{median} px ({least} to {largest} over elevations and distances)"


def _bands(checked: CheckedDesign) -> str:
    unit_mm, unit = length_unit(checked.design.working_volume.distance_mm[1])
    rows = [_band(band, unit_mm) for band in checked.verdict.bands]
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


def _band(band: CheckedBand, unit_mm: float) -> list[str]:
    low, high = (number(end / unit_mm, 2 if unit_mm > 1 else 0) for end in band.distance_mm)
    if not band.judged:
        return [f"{low} to {high}", "", "", "", "too few pixels"]
    return [
        f"{low} to {high}",
        in_percent(band.kept, 1),
        f"{in_percent(band.bias, 2)} (±{in_percent(band.bias_bound, 2)})",
        number(band.error_ratio, 2),
        ", ".join(band.problems) or "pass",
    ]
