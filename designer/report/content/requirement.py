"""The requirement as two columns of facts."""

from __future__ import annotations

from collections.abc import Iterable

from designer.goals import GOALS
from designer.requirement import PREDICTED, Requirement
from designer.requirement.camera import Camera, Lens
from designer.requirement.fixed import Fixed
from designer.requirement.housing import Housing
from designer.requirement.model import Objective
from designer.requirement.notes import notes_on
from designer.requirement.part import Part
from designer.requirement.quantity import NumberOrWord, Quantity
from designer.typesetting.markup import literal, plain_number, text, value_range

Facts = list[tuple[str, str]]
SYMBOLS = {"degrees": "°", "pixels": "px", "percent": "%"}
"""Units as reports write them; the others are symbols already."""


def requirement_groups(asked: Requirement) -> list[tuple[str, Facts]]:
    """What was asked, defaults too, as groups of (name, value): a key with a title shows itself."""
    camera, predicts = asked.camera, asked.noise_px == PREDICTED
    groups: list[tuple[str, Facts]] = [
        ("Working volume", _facts(asked.working_volume) + _facts(asked)),
        ("Envelope", _facts(asked.envelope)),
        ("Camera", _named("camera", camera.name) + _sensor(camera) + _facts(camera)),
        *_lens_groups(camera.lenses),
        ("Sharpness", _facts(asked.sharpness)),
        *([("Light", _facts(asked.light)), ("Matching", _facts(asked.matching))] if predicts else []),
        ("Manufacture", _facts(asked.manufacture)),
        ("Housing", _housing(asked.housing)),
        ("Objective", _objective(asked.objective) + _facts(asked.solve)),
        ("Fixed by the requirement", _fixed(asked.fixed)),
    ]
    return [(title, facts) for title, facts in groups if facts]


def requirement_notes(asked: Requirement) -> str:
    """What a requirement allows but its author may not expect, as Typst markup; nothing if there is nothing."""
    return "\n\n".join(text(f"Note: {note}.") for note in notes_on(asked))


def facts_argument(groups: Iterable[tuple[str | None, Iterable[tuple[str, str]]]]) -> str:
    """Groups of facts as the Typst array that the style's ``facts`` takes."""
    parts = []
    for title, facts in groups:
        rows = "".join(f"({literal(name)}, {literal(value)}), " for name, value in facts)
        parts.append(f"({literal(title) if title is not None else 'none'}, ({rows})), ")
    return "(" + "".join(parts) + ")"


def _facts(part: Part) -> Facts:
    """The keys of one table of the requirement that have a title, with their values."""
    facts = []
    for name, field in type(part).model_fields.items():
        value = getattr(part, name)
        if field.title is not None and value is not None:
            unit = next((each.unit for each in field.metadata if isinstance(each, Quantity | NumberOrWord)), "")
            facts.append((field.title, _value(value, unit)))
    return facts


def _housing(housing: Housing) -> Facts:
    """The keys that mean something for its kind; nothing for none."""
    if housing.kind == "none":
        return []
    titles = {field.title for name, field in Housing.model_fields.items() if name in housing.keys}
    return [(title, value) for title, value in _facts(housing) if title in titles]


def _value(value: float | tuple[float, float] | str, unit: str) -> str:
    if isinstance(value, str):
        return value
    return (
        value_range(value, SYMBOLS.get(unit, unit))
        .replace(" °", "°")
        .replace("∞ mm", "infinity")
        .replace("∞ px", "no limit")
        .replace("∞°", "no limit")
    )


def _named(what: str, name: str) -> Facts:
    return [(what, name)] if name else []


def _sensor(camera: Camera) -> Facts:
    pitch = plain_number(round(1000 * camera.pixel_pitch_mm, 6))
    return [("sensor", f"{camera.width_px} × {camera.height_px} px at {pitch} µm")]


def _lens_groups(lenses: tuple[Lens, ...]) -> list[tuple[str, Facts]]:
    return [
        (
            f"Lens {number} of {len(lenses)} to choose from" if len(lenses) > 1 else "Lens",
            _named("lens", lens.name) + _facts(lens) + projection_facts(lens.projection, lens.distortion),
        )
        for number, lens in enumerate(lenses, start=1)
    ]


def projection_facts(projection: str, distortion: tuple[float, ...]) -> Facts:
    """The lens's law from angle to image radius; nothing for r = f tan(psi)."""
    if projection == "perspective" and not any(distortion):
        return []
    named = ", ".join(f"k{place} = {plain_number(each)}" for place, each in enumerate(distortion, start=1))
    return [("projection", projection), *([("distortion", named)] if named else [])]


def _objective(objective: Objective) -> Facts:
    first, then = GOALS[objective.minimise].label, GOALS[objective.then].label
    return [("minimise", first), ("then", f"{then}, within {plain_number(objective.within_percent)} % of the first")]


def _fixed(fixed: Fixed) -> Facts:
    return [
        (f"{table} {name} {key}", value_range(value))
        for table, parts in (("mirror", fixed.mirror), ("view", fixed.view))
        for name, part in parts.items()
        for key, value in part.model_dump(exclude_none=True).items()
    ]
