"""Fixed numbers that exclude each other, whatever the configuration: found before any search."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from designer.configurations import VIEW_OF_SINGLE_MIRROR, MirrorKind, enumerate_configurations, with_article
from designer.optics.kinds import conic_with_focus, inverse_eccentricities, kind_of_conic, radius_signs
from designer.requirement.quantity import refuse

# What differs by more cannot be met to the solver's tolerance either.
SAME_NUMBER = 1e-6

Given = Mapping[str, float]
"""Fixed numbers by name; of a mirror radius_mm, conic, vertex_mm, of a view viewpoint_mm, gain."""


def check_fixed_numbers(mirrors: Mapping[str, Given], views: Mapping[str, Given]) -> None:
    """Refuse fixed numbers of mirrors and views, by name, that no configuration can hold together.

    Raises
    ------
    PydanticCustomError
        They exclude each other: says which, and what would be allowed.
    """
    _check_mirrors_belong_together(mirrors)
    for name, mirror in mirrors.items():
        _check_side(name, mirror)
    _check_direct_view("upper", views.get("upper", {}))
    if "lower" in mirrors:
        _check_direct_view("lower", views.get("lower", {}))
    for name, view in VIEW_OF_SINGLE_MIRROR.items():
        if name in mirrors:
            _check_agreement(name, inverse_eccentricities(mirrors[name], views.get(view, {})))
    if "secondary" in mirrors:
        _check_focus("secondary", mirrors["secondary"], 0.0, "the pinhole")
    viewpoint = views.get("lower", {}).get("viewpoint_mm")
    if "primary" in mirrors and viewpoint is not None:
        _check_focus("primary", mirrors["primary"], viewpoint, "the lower viewpoint")


def _check_mirrors_belong_together(mirrors: Mapping[str, Given]) -> None:
    if not any(_may_have(configuration.mirror_kinds, mirrors) for configuration in enumerate_configurations()):
        given = [f"{name} {_described(mirror)}".strip() for name, mirror in mirrors.items()]
        refuse(f"none of the 44 configurations combines these mirrors: {', '.join(given)}", "mirror")


def _may_have(kinds: Mapping[str, MirrorKind], mirrors: Mapping[str, Given]) -> bool:
    return all(
        name in kinds
        and (kinds[name] is not MirrorKind.PLANE or not given.keys() & {"radius_mm", "conic"})
        and ("conic" not in given or kinds[name] is kind_of_conic(given["conic"]))
        for name, given in mirrors.items()
    )


def _described(mirror: Given) -> str:
    if "conic" in mirror:
        return f"({kind_of_conic(mirror['conic']).word})"
    return "(curved)" if "radius_mm" in mirror else ""


def _check_side(name: str, mirror: Given) -> None:
    """A radius whose sign contradicts the conic constant; a vertex on the wrong side of the pinhole."""
    vertex, radius, conic = mirror.get("vertex_mm"), mirror.get("radius_mm"), mirror.get("conic")
    if name != "primary" and vertex is not None and vertex <= 0:
        refuse("must be above 0: this mirror is above the pinhole", f"mirror.{name}.vertex_mm", vertex)
    if radius is None or conic is None:
        return
    kind = kind_of_conic(conic)
    if math.copysign(1, radius) not in radius_signs(name, kind, may_share_focus_below=True):
        side = "below" if radius > 0 else "above"
        refuse(
            f"must be {side} 0 because conic = {conic:g} makes the {name} mirror {with_article(kind.word)}",
            f"mirror.{name}.radius_mm",
            radius,
        )


def _check_direct_view(name: str, view: Given) -> None:
    """A viewpoint or a gain that no mirror facing down with a focus at the pinhole can give."""
    if view.get("viewpoint_mm", 1.0) <= 0:
        refuse(
            "must be above 0: the mirror that forms this view is above the pinhole",
            f"view.{name}.viewpoint_mm",
            view["viewpoint_mm"],
        )
    if abs(view.get("gain", 0.0)) >= 1:
        refuse("must be between -1 and 1: a single mirror forms this view", f"view.{name}.gain", view["gain"])


def _check_agreement(name: str, found: Iterable[tuple[str, float]]) -> None:
    """Two ways to the inverse eccentricity of one mirror that give different numbers."""
    known = list(found)
    for words, q in known:
        if not 0 < q < math.inf or q == 1:  # infinite: a sphere round the pinhole, its foci one
            refuse(
                f"{words}: no mirror with foci at the pinhole and at its viewpoint has these values", f"mirror.{name}"
            )
    for words, q in known[1:]:
        first_words, first = known[0]
        if not math.isclose(q, first, rel_tol=SAME_NUMBER):
            refuse(
                f"{first_words} implies a conic constant of {_conic(first)}, but {words} one of {_conic(q)}; omit "
                f"one of them",
                f"mirror.{name}",
            )


def _check_focus(name: str, mirror: Given, focus_mm: float, where: str) -> None:
    """Vertex, radius and conic constant that put no focus where the mirror must have one."""
    if not {"vertex_mm", "radius_mm", "conic"} <= mirror.keys():
        return
    wanted = conic_with_focus(mirror["vertex_mm"] - focus_mm, mirror["radius_mm"])
    if not math.isclose(mirror["conic"], wanted, rel_tol=SAME_NUMBER):
        refuse(
            f"must be {wanted:.8g} for a focus at {where}, given the vertex and the radius; omit one of the three",
            f"mirror.{name}.conic",
            mirror["conic"],
        )


def _conic(inverse_eccentricity: float) -> str:
    return f"{-1.0 / inverse_eccentricity**2:.8g}"
