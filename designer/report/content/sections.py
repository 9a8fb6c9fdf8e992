"""The report's sections as Typst source, made from a study and the figures drawn of it."""

from __future__ import annotations

from collections.abc import Mapping

from designer.as_built.allowances import mirror_allowance
from designer.as_built.named import NamedTolerances
from designer.design import Design
from designer.evaluate.depth import FIRST_ORDER_BOUND
from designer.evaluate.score import recorded_fabrication_notes
from designer.goals import GOALS
from designer.report.content.as_built import as_built
from designer.report.content.check_section import check_heading, check_page, unchecked_line
from designer.report.content.comparators import comparators
from designer.report.content.design_facts import design_groups, winner_groups
from designer.report.content.lens import lens_sentences, other_projections
from designer.report.content.provenance import provenance
from designer.report.content.requirement import facts_argument, requirement_groups, requirement_notes
from designer.report.content.tables import (
    PAPER_CONFIGURATION,
    closest,
    excluded,
    fabrication,
    lens_choice,
    paper_comparison,
    prescription,
    ranking_table,
)
from designer.report.content.verdict import configuration_in_words, ties, verdict
from designer.report.figures.depth_map import IMAGE_CIRCLE_PX
from designer.report.figures.registry import (
    LENS_PANEL,
    LENS_WIDE,
    PAGE_DRAWING,
    PAGE_PANEL,
    TRADE,
    WINNER_DRAWING,
    WINNER_PANEL,
    DrawnFigure,
    design_figures,
    study_figures,
)
from designer.requirement import PREDICTED
from designer.study.ranking import tolerance_in_words
from designer.study.row import Row
from designer.study.study import Study
from designer.typesetting.markup import call, literal, text, typographic

FIRST_ORDER_WORDS = f"{100 * FIRST_ORDER_BOUND:g} %"

PAPER_STUDY = "indoor_robot"
"""The requirement taken from the paper's prototype, which is then shown beside the paper's numbers."""


Drawings = Mapping[str, DrawnFigure]
"""The figures by the names of their files."""


def source(study: Study, drawings: Drawings, note: str = "") -> str:
    """The whole report as Typst source; it includes style.typ, method.typ and figures/*.svg.

    A note is printed below the title.
    """
    parts = [
        '#import "style.typ": *\n',
        f"#show: report.with(study: {literal(study.name)}, title: {literal(study.title)})\n",
        title_page(study, note),
        winner(study, drawings) if study.feasible else nothing_feasible(study),
        ranking_section(study),
        paper(study),
        trade(study, drawings),
        comparators(study, drawings),
        best_heading() if study.feasible else "",
        "\n#pagebreak(weak: true)\n".join(
            page(row, design, drawings) for row, design in study.best() for page in (design_page, lens_page)
        ),
        checks(study),
        as_built(study, drawings),
        "#pagebreak(weak: true)\n" if study.feasible else "",
        '#[#set text(size: 9.3pt)\n#include "method.typ"\n',
        other_projections(study.requirement.camera.lenses),
        (reading() if study.feasible else "") + "]\n",
        provenance(study),
    ]
    return "\n".join(parts)


def title_page(study: Study, note: str = "") -> str:
    """Title, verdict and requirement."""
    description = study.requirement.description
    lines = [
        f'#align(center, block(below: 1.2em, text(size: 19pt, weight: "bold", {literal(study.title)})))',
        f"#align(center, block(width: 88%, emph({literal(' '.join(description.split()))})))" if description else "",
        f"#align(center, block(width: 88%, text(size: 8.5pt, fill: grey, {literal(note)})))" if note else "",
        "= Verdict",
        verdict(study),
        lenses(study),
        "= Requirement",
        requirement_notes(study.requirement),
        requirement_table(study),
    ]
    return "\n".join(lines)


def lenses(study: Study) -> str:
    """What each lens of a catalogue gives in the winning configuration; nothing with one lens."""
    rows = study.lenses_of(study.feasible[0].configuration) if study.feasible else ()
    if not rows:
        return ""
    objective = study.requirement.objective
    note = text(
        "What the winning configuration reaches with each lens alone; lenses.csv has all configurations. Among lenses "
        f"tied{tolerance_in_words(objective)} in {GOALS[objective.minimise].label}, {GOALS[objective.then].label} "
        "decides."
    )
    return f"= Lenses <lenses>\n{note}\n{lens_choice(rows)}"


def requirement_table(study: Study) -> str:
    """The requirement in two columns of about equal length."""
    groups = requirement_groups(study.requirement)
    lengths = [1.2 + len(facts) for _, facts in groups]
    split = min(range(len(groups) + 1), key=lambda count: abs(sum(lengths[:count]) - sum(lengths[count:])))
    halves = [call("facts", facts_argument(half)) for half in (groups[:split], groups[split:]) if half]
    return "#grid(columns: (1fr, 1fr), column-gutter: 6mm, " + ", ".join(f"[{half}]" for half in halves) + ")"


def winner(study: Study, drawings: Drawings) -> str:
    """The winner's cross-section, prescription and image layout."""
    (row, design), *_ = study.best(1)
    name, panels = _file(WINNER_DRAWING, design), _design_panels(WINNER_PANEL, design)
    caption = (
        f"The winner, #name-of({literal(design.configuration)}), {text(_scale_words(drawings, name))} "
        "Lengths in mm. Solid blue: the upper view (right); dashed red: the lower view (left); each at five "
        "elevations of its required range, the end rays drawn thick. Dotted lines extend the rays back to the "
        "effective viewpoints $F_u$ and $F_l$; "
        "$O$ is the camera's pinhole, and the numbers are those of the prescription. Grey: substrates, lens and camera"
        f"{'' if design.housing is None else '; pale blue: the ' + design.housing.kind}."
    )
    words = configuration_in_words(design.configuration)
    tolerances = None if study.tolerances is None else study.tolerances.tolerances
    lines = [
        "#pagebreak(weak: true)",
        "= The winning design <winner>",
        text(f"{words[0].upper()}{words[1:]}. Variant: {row.text('variant') or 'only one'}.") if words else "",
        f"#figure(image({literal('figures/' + name)}), caption: [{caption}])",
        f"#figure({_as_argument(prescription(design, tolerances))}, caption: [{_prescription_caption(study, design)}])",
        "#grid(columns: (96mm, 1fr), column-gutter: 5mm,",
        *(f"  {panel}," for panel in panels),
        f"  [{call('facts', facts_argument(winner_groups(row, design)), size='7.8pt')}],",
        ")",
    ]
    return "\n".join(lines)


PRESCRIPTION_CAPTION = (
    "Prescription. The vertex is measured along the axis from the pinhole; a positive radius has its centre of "
    "curvature above the vertex. The face spans inner to outer $R$; the substrate lies behind it."
)


def _prescription_caption(study: Study, design: Design) -> str:
    if study.tolerances is None:
        return PRESCRIPTION_CAPTION
    each = [mirror_allowance(design, mirror.name, study.tolerances.tolerances) for mirror in design.mirrors]
    poses = [(allowed.decentre_mm, allowed.tilt_deg) for allowed in each]
    named = [""] if len(set(poses)) == 1 else [f"{mirror.name} " for mirror in design.mirrors]
    listed = ", ".join(
        f"{name}{decentre:g} mm and {tilt:g}°" for name, (decentre, tilt) in zip(named, poses, strict=False)
    )
    origin = NamedTolerances(study.tolerances.name, study.tolerances.tolerances).in_words
    return (
        f"{PRESCRIPTION_CAPTION} ±: tolerances, of {text(origin)}. A mirror may be decentred and tilted, in x and in "
        f"y, by {text(listed)}."
    )


def nothing_feasible(study: Study) -> str:
    """What came closest, when no design met the requirement."""
    infeasible = study.with_status("infeasible")
    if not any(row.text("closest_constraint") for row in infeasible):
        return ""
    lines = [
        "= Limiting constraints",
        text(
            "For each configuration without a feasible design: the limiting constraint at the point where the "
            "largest scaled violation is smallest, and the amount by which it is violated there."
        ),
        closest(infeasible),
    ]
    return "\n\n".join(lines)


def paper(study: Study) -> str:
    """The paper's prototype beside our design of its configuration, for the requirement made from it."""
    row = study.row(PAPER_CONFIGURATION)
    if study.name != PAPER_STUDY or row is None:
        return ""
    title = literal("The paper's prototype (Jang, Kim and Kweon, 2005) beside this study's design")
    if row.status != "feasible":
        outcome = text(f"{PAPER_CONFIGURATION} is {row.status} here: {typographic(row.reason)}")
        return f"#boxed({title})[{outcome}]\n"
    intro = text(f"Configuration {PAPER_CONFIGURATION}, figure 4 (c) of the paper; rank {row.rank} here.")
    return f"#boxed({title})[{intro}\n{paper_comparison(study.designs[PAPER_CONFIGURATION], row)}]\n"


def ranking_section(study: Study) -> str:
    """All configurations with status and reason."""
    is_bound = study.requirement.noise_px != PREDICTED
    meaning = "$1.000$: proven optimal" if is_bound else "with the design's own noise in both"
    note = (
        "$sigma_D\\/D$ is the rms relative depth error over the working volume; the limit ratio compares it with the "
        f"closed-form limit for any conic mirrors at the design's baseline and principal distance ({meaning}). "
        "$b$ baseline, $H$ height, $W$ diameter. Statuses are defined in @method, full reasons are in designs.csv."
    )
    if any(row.is_beyond_first_order for row in study.feasible):
        note += (
            f" A star marks errors that exceed {FIRST_ORDER_WORDS} somewhere in the working volume, where first "
            "order underestimates the error: see @depth-error."
        )
    tied = ties(study)
    if tied:
        note += text(f" {tied}")
    opening = "#pagebreak(weak: true)\n" if study.feasible else ""
    impossible = study.with_status("impossible")
    listed = ranking_table(row for row in study.rows if row.status != "impossible")
    if impossible:
        listed += f"\n== Excluded by rule ({len(impossible)})\n{excluded(impossible)}"
    return f"{opening}= Ranking of all configurations <ranking>\n{note}\n\n{listed}"


def trade(study: Study, drawings: Drawings) -> str:
    """Depth error against height and diameter: all feasible designs, and the Pareto fronts of the best ones."""
    lines = []
    for figure in study_figures(TRADE):
        if figure.file() in drawings:
            letters = drawings[figure.file()].letters
            key = "; ".join(f"{letter}: {ranks}" for letter, ranks in letters.items())
            lines.append(_figure(figure.file(), figure.title(study) + (text(f" Near-ties: {key}.") if key else "")))
    return "\n".join(["= Trade-offs <trade>", *lines]) if lines else ""


def _figure(name: str, caption: str) -> str:
    return f"#figure(image({literal('figures/' + name)}), caption: [{caption}])"


def best_heading() -> str:
    """Opens the section of the best designs, on the page of the first; how to read them stands where there is room."""
    pointer = '#text(size: 8.5pt, weight: "regular")[how to read these pages: @reading]'
    return f"#pagebreak(weak: true)\n= The best designs #h(1fr) {pointer} <best>\n"


def reading() -> str:
    """How to read the pages of the best designs."""
    return (
        "== The pages of the best designs <reading>\n"
        "Drawings follow the conventions of @winner. _Depth resolution_ shows the points defined by pairs of pixels "
        f"in one epipolar plane, as in the paper's figure 6, for an image circle {IMAGE_CIRCLE_PX} pixels in "
        "diameter; the grey outline is the working volume, the triangles are the viewpoints. _Depth error_: lines "
        "show the first-order error at the lowest, middle and highest elevation and its rms, circles the rms of a "
        f"Monte Carlo simulation with the ray tracer; a dotted line at {FIRST_ORDER_WORDS} marks the limit of "
        "validity of first order, and is omitted where the errors are far below it.\n\n"
        "On the second page, blurs are diameters of the disc into which the lens spreads a scene point, over "
        "the elevations of each view at both ends of the working distances. _Through focus_ keeps the lens "
        "and its stop and moves the focus; _depth of field_ shades the distances that stay within the limit. "
        "_Modulation_ is the contrast that defocus, diffraction (green light) and pixel leave of a pattern of "
        "full contrast along the radius, at the worse end of the distances: with one period in the matching "
        "window, and with one in two rows of the panorama, the finest that it can hold. An edge at the height "
        "$z$ has a penumbra of $p f abs(1\\/u - 1\\/z)$ on the sensor (grey in the image layout); where "
        "penumbrae let light of both views pass, the views mix (hatched).\n"
    )


def checks(study: Study) -> str:
    """The end-to-end checks, a page each; nothing if none was tried."""
    checked, broken = study.checks(), study.not_checked()
    if not checked and not broken:
        return ""
    definition = checked[0][1].verdict.definition if checked else ""
    lines = [check_heading(definition), *(unchecked_line(row, reason) for row, reason in broken)]
    pages = [check_page(row, check) for row, check in checked]
    return "\n".join(lines) + "\n" + "\n#pagebreak()\n".join(pages)


def design_page(row: Row, design: Design, drawings: Drawings) -> str:
    """One page for one of the best designs."""
    configuration = design.configuration
    section = _file(PAGE_DRAWING, design)
    scale = literal(_scale_words(drawings, section))
    grid = ",\n  ".join(_design_panels(PAGE_PANEL, design))
    lines = [
        f"== Rank {row.rank}: #name-of({literal(configuration)})",
        "#grid(columns: (97mm, 1fr), column-gutter: 4mm,",
        f"  [#image({literal('figures/' + section)})#align(center)[#text(size: 8pt, {scale})]",
        f"{fabrication_notes(design)}],",
        f"  [{call('facts', facts_argument(design_groups(row, design)), size='7.6pt')}],",
        ")",
        prescription(design),
        f"#grid(columns: (1fr, 1fr), column-gutter: 4mm, row-gutter: 2.5mm,\n  {grid},\n)",
    ]
    return "\n".join(lines)


FABRICATION_CAPTION = (
    "Fabrication. Diameter of the face, without a flange; sag from inner to outer rim; slope against the plane across "
    "the axis; sphere by least squares over the face, its centre above the face where positive, and the departure "
    "from it peak to valley along its normal: what a lathe or an interferometer must cover. Mass of aluminium "
    "substrates as thick as the prescription says."
)


def lens_page(row: Row, design: Design, drawings: Drawings) -> str:
    """The second page of one of the best designs: how sharp it is through its lens, and its mirrors for the shop."""
    wide, panels = (
        [panel for figure, panel in _panels_by_figure(place, design) if figure in drawings]
        for place in (LENS_WIDE, LENS_PANEL)
    )
    lines = [
        f"#heading(level: 2, numbering: none)[Rank {row.rank}: lens and fabrication]",
        text(f"Lens: {lens}. " if (lens := row.text("lens")) else "") + lens_sentences(design),
        *(f"#{panel}" for panel in wide),
        f"#grid(columns: (1fr, 1fr), column-gutter: 4mm, row-gutter: 2.5mm,\n  {', '.join(panels)},\n)"
        if panels
        else "",
        f"#figure({_as_argument(fabrication(design))}, kind: table, caption: [{FABRICATION_CAPTION}])",
    ]
    return "\n".join(line for line in lines if line)


def fabrication_notes(design: Design) -> str:
    """What to look at before ordering the design's mirrors; nothing if there is nothing."""
    notes = recorded_fabrication_notes(design)
    if not notes:
        return ""
    items = ", ".join(f"[{text(typographic(_sentence(note)))}]" for note in notes)
    return f"#fabrication-notes({items})\n"


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _file(place: str, design: Design) -> str:
    """The file of the figure that alone has its place."""
    (figure,) = design_figures(place)
    return figure.file(design.configuration)


def _design_panels(place: str, design: Design) -> list[str]:
    return [panel for _, panel in _panels_by_figure(place, design)]


def _panels_by_figure(place: str, design: Design) -> list[tuple[str, str]]:
    """The panels at a place, each with the name of its figure's file."""
    files = [(figure, figure.file(design.configuration)) for figure in design_figures(place)]
    return [(file, f"panel([{figure.title(design)}], image({literal('figures/' + file)}))") for figure, file in files]


def _scale_words(drawings: Drawings, name: str) -> str:
    drawing = drawings.get(name)
    return "" if drawing is None or drawing.scale is None else f"drawn to scale, 1 : {drawing.scale:g}."


def _as_argument(markup: str) -> str:
    return markup.strip().removeprefix("#")
