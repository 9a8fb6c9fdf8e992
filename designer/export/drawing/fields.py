"""Fields of a sheet: groups of names and what they say, as Typst; numbers with all their digits."""

from __future__ import annotations

from designer.as_built.named import NamedTolerances
from designer.design import Camera, Projection
from designer.typesetting.markup import cell, literal

Groups = list[tuple[str, list[tuple[str, str]]]]

OPEN = "to be agreed"
"""What nobody has decided: the sheet says so and does not invent a number."""


def tolerances_title(tolerances: NamedTolerances | None) -> str:
    """The heading of the tolerances on a sheet: where they come from, or that there are none."""
    if tolerances is None:
        return f"Tolerances, {OPEN}: run designer tolerance for what each departure costs"
    return f"Tolerances, of {tolerances.in_words}; largest departures, of radius and conic constant at the same time"


def exactly(value: float) -> str:
    """A number with all its digits, with a true minus sign: reading it gives the same number again."""
    return repr(float(value)).replace("-", "−")


_LAWS: dict[Projection, tuple[str, str]] = {
    "perspective": ("r = f tan ψ", "r = f x (1 + k1 x² + k2 x⁴ + …), x = tan ψ"),
    "equidistant": ("r = f ψ", "r = f ψ (1 + k1 ψ² + k2 ψ⁴ + …), ψ in radians"),
    "equisolid": ("r = 2 f sin(ψ/2)", ""),
    "stereographic": ("r = 2 f tan(ψ/2)", ""),
}


def lens_law(camera: Camera) -> list[tuple[str, str]]:
    """Projection and distortion of a lens as names and words, with all digits; none for r = f tan(psi)."""
    if camera.projection == "perspective" and not any(camera.distortion):
        return []
    law, distorted = _LAWS[camera.projection]
    if not any(camera.distortion):
        return [("projection", f"{camera.projection}, {law}; f: principal distance")]
    named = ", ".join(f"k{place} = {exactly(value)}" for place, value in enumerate(camera.distortion, 1))
    return [("projection", f"{camera.projection}, {distorted}; f: principal distance"), ("distortion", named)]


def fields(groups: Groups) -> str:
    """Groups of fields as Typst."""
    rows = "".join(
        f"({literal(title)}, ({''.join(f'({cell(name)}, {cell(value)}), ' for name, value in group)})), "
        for title, group in groups
    )
    return f"#fields(({rows}))\n"
