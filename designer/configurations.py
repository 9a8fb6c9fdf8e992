"""The 44 single-viewpoint stereo configurations, enumerated from the pairing rule (paper, sections 3 and 4).

The paper gives the number of folding pairs; the rule that yields nine is our reading of its reference 11
(Nayar and Peri 1999): planes, hyperboloids and ellipsoids have finite foci and pair freely, a plane with a
plane has no power, and a paraboloid, whose second focus is at infinity, pairs only with a paraboloid.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from itertools import product
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:  # so that listing the 44 does not load pydantic
    from designer.design import ConicKind, ViewName, Zone

Topology = Literal["upper_outer", "upper_inner"]
Family = Literal["direct", "folded"]
TOPOLOGIES: tuple[Topology, ...] = ("upper_outer", "upper_inner")


class MirrorKind(Enum):
    """A conic of revolution, by the two-letter code used in configuration names."""

    PLANE = "Pl"
    HYPERBOLOID = "Hy"
    ELLIPSOID = "El"
    PARABOLOID = "Pa"

    @property
    def word(self) -> ConicKind:
        """The kind as design files and sentences have it: plane, hyperboloid, ellipsoid, paraboloid."""
        return _WORDS[self]

    @property
    def adjective(self) -> str:
        """The kind as an adjective: plane, hyperboloidal, ellipsoidal, paraboloidal."""
        return self.word if self is MirrorKind.PLANE else f"{self.word}al"

    @property
    def has_finite_foci(self) -> bool:
        """Whether both foci lie at finite distance (a plane's are mirror images of each other)."""
        return self is not MirrorKind.PARABOLOID

    @property
    def has_power(self) -> bool:
        """Whether the mirror changes the angle of a ray at its focus."""
        return self is not MirrorKind.PLANE


_WORDS: dict[MirrorKind, ConicKind] = {
    MirrorKind.PLANE: "plane",
    MirrorKind.HYPERBOLOID: "hyperboloid",
    MirrorKind.ELLIPSOID: "ellipsoid",
    MirrorKind.PARABOLOID: "paraboloid",
}


def with_article(word: str) -> str:
    """A kind's word or adjective after its indefinite article: "an ellipsoid"."""
    return f"{'an' if word[0] in 'aeiou' else 'a'} {word}"


# A hyperboloid or ellipsoid of a folding pair counts as one only while its inverse eccentricity (a hyperboloid's; an
# ellipsoid's eccentricity) stays away from 0 (a plane; a sphere) and from 1 (a paraboloid): beyond these a shop could
# not tell it from the neighbouring kind.
FLATTEST = 0.05
MOST_PARABOLIC = 0.98

# A mirror that gives a view on its own needs two finite foci and power.
SINGLE_VIEW_KINDS = tuple(kind for kind in MirrorKind if kind.has_finite_foci and kind.has_power)


def can_fold(primary: MirrorKind, secondary: MirrorKind) -> bool:
    """Whether two mirrors in a row keep a single viewpoint: they share a focus, and one of them has power."""
    share_a_focus = primary.has_finite_foci == secondary.has_finite_foci
    return share_a_focus and (primary.has_power or secondary.has_power)


# The view that each mirror gives which gives one alone.
MIRROR_NAMES = ("lower", "upper", "primary", "secondary", "direct")
"""Those of the direct family, then those of the folded one."""
VIEW_OF_SINGLE_MIRROR: dict[str, ViewName] = {"lower": "lower", "upper": "upper", "direct": "upper"}

FOLDING_PAIRS = tuple(pair for pair in product(MirrorKind, MirrorKind) if can_fold(*pair))


def outer_view(topology: Topology) -> ViewName:
    """Which view takes the outer zone of the image."""
    return "upper" if topology == "upper_outer" else "lower"


@dataclass(frozen=True, slots=True)
class Configuration:
    """One of the 44: a family, the kinds of its mirrors in the order of its name, and a topology.

    ``kinds`` is (lower, upper) for a direct configuration and (primary, secondary, direct) for a folded one.
    The topology says which zone of the image the upper view takes.
    """

    family: Family
    kinds: tuple[MirrorKind, ...]
    topology: Topology

    @property
    def name(self) -> str:
        """The configuration's name, such as ``folded-HyPl-Hy-upper_outer``."""
        codes = [kind.value for kind in self.kinds]
        mirrors = "".join(codes) if self.family == "direct" else f"{codes[0]}{codes[1]}-{codes[2]}"
        return f"{self.family}-{mirrors}-{self.topology}"

    @property
    def outer_view(self) -> ViewName:
        """Which view takes the outer zone of the image."""
        return outer_view(self.topology)

    @property
    def inner_view(self) -> ViewName:
        """Which view takes the inner zone of the image."""
        return "lower" if self.outer_view == "upper" else "upper"

    def zone_of(self, view: ViewName) -> Zone:
        """The zone of the image that a view takes."""
        return "outer" if view == self.outer_view else "inner"

    @property
    def mirror_kinds(self) -> dict[str, MirrorKind]:
        """The kind of each mirror by its name in the design record."""
        names = ("lower", "upper") if self.family == "direct" else ("primary", "secondary", "direct")
        return dict(zip(names, self.kinds, strict=True))


def enumerate_configurations() -> tuple[Configuration, ...]:
    """All 44 configurations: the 8 direct ones, then the 36 folded ones."""
    direct = [
        Configuration("direct", kinds, topology)
        for kinds in product(SINGLE_VIEW_KINDS, SINGLE_VIEW_KINDS)
        for topology in TOPOLOGIES
    ]
    folded = [
        Configuration("folded", (*pair, direct_kind), topology)
        for pair in FOLDING_PAIRS
        for direct_kind in SINGLE_VIEW_KINDS
        for topology in TOPOLOGIES
    ]
    return (*direct, *folded)
