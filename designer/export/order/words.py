"""What an order says in words: its README and its parts list."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence

from designer import __version__
from designer.as_built.named import NamedTolerances
from designer.design import Design
from designer.evaluate.coatings import ALUMINIUM_6061, COATINGS
from designer.evaluate.fabrication import mirror_shape
from designer.evaluate.fabrication_notes import fabrication_notes_on
from designer.evaluate.housing import DepthBias, housing_mass_g, housing_score
from designer.export.assembly_name import ASSEMBLY
from designer.export.drawing.fields import lens_law
from designer.export.drawing.sheet import design_digest
from designer.export.formats import EXPORTS, WITHOUT_DEPARTURES
from designer.export.housing_words import housing_material
from designer.housing import Tube

_OPEN = (
    "Tolerances of surface form, roughness, imperfections, centring and dimensions, to be agreed with the workshop "
    "before ordering: run `designer tolerance` for what each departure costs (docs/tolerances.md of the designer), and "
    "give its file to `--tolerances`.",
    "Tolerances of each mirror's place and tilt: from the same budget.",
)
_OPEN_BESIDE_TOLERANCES = (
    "Roughness, imperfections and irregularity (form other than radius and conic constant), to be agreed with the "
    "workshop before ordering.",
    "Tolerances of dimensions that are not optical, and how decentre and tilt are shared between part and seat.",
)
_OPEN_ALWAYS = (
    "What holds the mirrors: seats, flanges and screws. A mirror's solid is its face with its back, and nothing else.",
    "Edges: chamfers outside the clear aperture.",
)


def parts_list(design: Design) -> str:
    """The parts as comma-separated values; masses in grams, of mirrors and housing."""
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(["part", "quantity", "material", "coating", "mass_g", "drawing"])
    for mirror in design.mirrors:
        mass = mirror_shape(design, mirror.name).mass_g
        material = f"{ALUMINIUM_6061.name}, {ALUMINIUM_6061.process}"
        drawing = f"drawing/{mirror.name}{EXPORTS['drawing'].suffix}"
        rows.writerow([f"{mirror.name} mirror", 1, material, COATINGS[0].name, f"{mass:.2f}", drawing])
    rows.writerows(_housing_rows(design))
    named = design.camera.model_extra or {}
    if "name" in named:
        rows.writerow([f"camera: {_in_one_line(named['name'])}", 1, "", "", "", ""])
    law = [f"{key}: {words}" for key, words in lens_law(design.camera)]
    if law or "lens" in named:
        lens = "; ".join([_in_one_line(named.get("lens", "not named")), *law])
        rows.writerow([f"lens: {lens}", 1, "", "", "", ""])
    rows.writerow([ASSEMBLY, 1, "", "", "", f"drawing/{ASSEMBLY}{EXPORTS['drawing'].suffix}"])
    return table.getvalue()


def _housing_rows(design: Design) -> list[list[object]]:
    """The tube, or the struts, with all dimensions."""
    housing = design.housing
    if housing is None:
        return []
    if isinstance(housing, Tube):
        part = f"tube, outer diameter {2.0 * housing.outer_radius_mm:.3f}, wall {housing.wall_mm:.3f}"
        quantity = 1
    else:
        part, quantity = f"strut, diameter {housing.width_mm:.3f}", housing.number
    mass = housing_mass_g(housing)
    each = "" if mass is None else f"{mass / quantity:.2f}"
    drawing = f"drawing/{ASSEMBLY}{EXPORTS['drawing'].suffix}"
    return [[f"{part}, length {housing.length_mm:.3f}", quantity, housing_material(design), "", each, drawing]]


def _in_one_line(text: object) -> str:
    return " ".join(str(text).split())


def read_me(
    design: Design,
    formats: Sequence[str],
    left_out: Mapping[str, str],
    problems: Sequence[str],
    tolerances: NamedTolerances | None = None,
) -> str:
    """The README of an order, in Markdown."""
    configuration = " ".join(design.configuration.split())
    first, *others = COATINGS
    choices = ", ".join(f"{coating.name} ({100 * coating.reflectivity:g} %, {coating.reason})" for coating in others)
    sections = [
        f"# {configuration}",
        "Single-camera catadioptric stereo head: "
        + ", ".join(f"{mirror.name} mirror" for mirror in design.mirrors)
        + f". Written by catadioptric-designer {__version__} from a design with the SHA-256 {design_digest(design)}. "
        "All lengths in mm, heights above the pinhole (the centre of the lens's entrance pupil).",
        *([] if design.as_built is None else [f"**{WITHOUT_DEPARTURES[0].upper()}{WITHOUT_DEPARTURES[1:]}.**"]),
        *_verdict(problems),
        "## What is in this folder",
        _bullets(
            [
                "`parts.csv`: the parts, with material, coating, mass and drawing",
                "`design.json`: the design itself, for the designer",
                *_tolerance_file(tolerances),
                *(f"`{name}/`: {EXPORTS[name].description}; without {EXPORTS[name].leaves_out}" for name in formats),
                "`order.json`: the files with their SHA-256",
            ]
        ),
        "For a quotation send `drawing/`, `sag/` and the solids. Where files disagree, the drawing counts.",
        *(
            ["## What is not in this folder", _bullets(f"`{name}`: {why}" for name, why in left_out.items())]
            if left_out
            else []
        ),
        "## What is not specified yet",
        _bullets([*(_OPEN if tolerances is None else _OPEN_BESIDE_TOLERANCES), *_OPEN_ALWAYS, *_open_housing(design)]),
        "## Material and coating",
        f"Unless you decide otherwise: {ALUMINIUM_6061.name}, {ALUMINIUM_6061.process}, with {first.name} "
        f"(reflects at least {100 * first.reflectivity:g} % in the visible, {first.reason}). Others: {choices}. A "
        "study counts with `[light] mirror_reflectivity`, 0.88 by default: set it to what you order.",
        *_notes(design),
    ]
    return "\n\n".join(sections) + "\n"


def _tolerance_file(tolerances: NamedTolerances | None) -> list[str]:
    if tolerances is None:
        return []
    return [
        f"`tolerances.toml`: the tolerances that the drawings carry, those of {tolerances.in_words}; "
        "`designer tolerance design.json --tolerances tolerances.toml` says how many sensors are good"
    ]


def _verdict(problems: Sequence[str]) -> list[str]:
    if not problems:
        return ["The independent ray tracer accepts this design."]
    return ["**The independent ray tracer rejects this design. Do not order it as it is:**", _bullets(problems)]


def _open_housing(design: Design) -> list[str]:
    """What is open of the housing, or that there is none."""
    if design.housing is None:
        return ["A tube or struts: the design has none (`[housing]` of the requirement)."]
    score = housing_score(design)
    if score is None or score.kind == "struts":
        return []
    biases = ", ".join(_bias_words(bias) for bias in score.uncorrected_bias)
    return [
        f"Tolerances of the tube: without correction its wall would shift depth by {biases}. The correction is in "
        "proportion to the wall's thickness: an error of 1 % leaves 1 % of it. Tubes differ in optical quality: try "
        "one.",
        f"Coating of the tube: uncoated it reflects about {100.0 * (1.0 - score.transmitted[1]):.2g} % of the far side "
        "into the views (`designer trace` says at which elevations).",
    ]


def _bias_words(bias: DepthBias) -> str:
    return "unknown" if bias.bias_mm is None else f"{bias.bias_mm:.2f} mm at {bias.distance_mm:g} mm"


def _notes(design: Design) -> list[str]:
    notes = fabrication_notes_on(design)
    return ["## Before ordering mirrors", _bullets(notes)] if notes else []


def _bullets(sentences: Iterable[str]) -> str:
    return "\n".join(f"- {' '.join(sentence.split())}" for sentence in sentences)
