"""The variants of a configuration: which sheet of a conic, which sign of gain, and what no sheet can see.

A variant fixes every sign, so that within one variant the geometry is smooth. What remains discrete (which side of a
rim the light passes, whether the primary sits ahead of the lens) is found by the starts, not enumerated here.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from designer.configurations import Configuration, MirrorKind
from designer.design import Sense, ViewName
from designer.optics.kinds import CONVEX_HYPERBOLOID_GAINS, ELLIPSOID_GAINS


@dataclass(frozen=True, slots=True)
class Fold:
    """How a folding pair is built: the signs that make it smooth.

    Attributes
    ----------
    label
        What distinguishes it, in words; empty if the configuration has no choice.
    gain_sign
        Sign of the pair's gain kappa.
    inverse_gains
        Range of the secondary's 1/kappa; both ends equal if fixed (plane 1, paraboloid 0).
    primary_gains
        Range of the primary's kappa; None if the pair's gain alone decides (a paraboloid's is 0).
    primary_side
        Sign of R where the light meets the primary: -1 if it then crosses the axis at the viewpoint.
    primary_is_plane
        The primary's kappa is 1, so the secondary alone has the pair's gain.
    is_seldom_feasible
        Where its first starts end far from feasible, no more are worth their time.
    """

    label: str
    gain_sign: int
    inverse_gains: tuple[float, float]
    primary_gains: tuple[float, float] | None
    primary_side: int
    primary_is_plane: bool = False
    is_seldom_feasible: bool = False


@dataclass(frozen=True, slots=True)
class Variant:
    """One smooth family of designs of a configuration.

    ``direct_gain_signs`` holds the sign of kappa for each direct mirror (+1 hyperboloid, -1 ellipsoid); ``fold`` is
    None for direct configurations.
    """

    configuration: Configuration
    direct_gain_signs: tuple[tuple[str, int], ...]
    fold: Fold | None

    @property
    def label(self) -> str:
        """What distinguishes this variant among those of its configuration, in words."""
        return self.fold.label if self.fold else ""

    @property
    def is_seldom_feasible(self) -> bool:
        """Whether no more than the first starts are worth their time where they end far from feasible."""
        return self.fold is not None and self.fold.is_seldom_feasible

    def sense(self, view: ViewName) -> Sense:
        """The sense of a view: only the lower view of a folded configuration is folded."""
        return "folded" if self.fold and view == "lower" else "direct"

    def gain_sign(self, view: ViewName) -> int:
        """Sign of the view's gain."""
        if self.fold and view == "lower":
            return self.fold.gain_sign
        return dict(self.direct_gain_signs)[self.last_mirror(view)]

    def last_mirror(self, view: ViewName) -> str:
        """The mirror that sends the view's light out into the world."""
        if self.fold is None:
            return view
        return "primary" if view == "lower" else "direct"

    def crosses_at_viewpoint(self, view: ViewName) -> bool:
        """Whether the light crosses the axis at the viewpoint, so that the mirror's own wall hides the horizon."""
        if self.fold and view == "lower":
            return self.fold.primary_side < 0
        return self.gain_sign(view) < 0


def enumerate_variants(configuration: Configuration) -> tuple[Variant, ...]:
    """The variants of a configuration, in a fixed order."""
    kinds = configuration.mirror_kinds
    signs = tuple(
        (name, 1 if kind is MirrorKind.HYPERBOLOID else -1)
        for name, kind in kinds.items()
        if name in {"lower", "upper", "direct"}
    )
    if configuration.family == "direct":
        return (Variant(configuration, signs, None),)
    return tuple(Variant(configuration, signs, fold) for fold in _folds(kinds["primary"], kinds["secondary"]))


def _folds(primary: MirrorKind, secondary: MirrorKind) -> tuple[Fold, ...]:
    if primary is MirrorKind.PARABOLOID:
        return (
            Fold("convex primary", 1, (0.0, 0.0), None, 1),
            Fold("concave primary", -1, (0.0, 0.0), None, -1),
        )
    folds = [
        _pair(primary, label, sign, inverse_gains) for label, sign, inverse_gains in _secondary_branches(secondary)
    ]
    if primary is secondary is MirrorKind.ELLIPSOID:
        return tuple(case.fold for case in PAIRS_OF_ELLIPSOIDS if not case.why_left_out)
    return tuple(fold for fold in folds if fold is not None)


@dataclass(frozen=True, slots=True)
class EllipsoidPair:
    """One combination of signs of two ellipsoids in a folding pair, and why it is no variant, if it is not."""

    fold: Fold
    why_left_out: str = ""


def _pairs_of_ellipsoids() -> tuple[EllipsoidPair, ...]:
    """Every combination of signs: where the shared focus lies, which face the primary has, which way its gain goes.

    The secondary's second focus lies between pinhole and secondary (-1 < kappa < 0) or below the pinhole (kappa < -1).
    The primary is the bottom of an ellipsoid seen from inside, behind the shared focus, or the top seen from outside,
    ahead of it. The viewpoint is its focus nearer to that vertex, and it widens the view (abs(kappa) < 1), or the
    farther one, and it narrows the view.
    """
    widening, narrowing = ELLIPSOID_GAINS, (1.0 / ELLIPSOID_GAINS[1], 1.0 / ELLIPSOID_GAINS[0])
    below = (-CONVEX_HYPERBOLOID_GAINS[1], -CONVEX_HYPERBOLOID_GAINS[0])  # 1 / kappa, as far from 0 and -1
    places = (("above", narrowing), ("below", below))
    cases = []
    for (place, inverse_gains), side, gains in product(places, (-1, 1), (widening, narrowing)):
        reason = ""
        if place == "below" and side < 0:
            reason = "its light would cross the axis below the pinhole, inside the camera"
        elif place == "below" and gains is narrowing:
            reason = "both mirrors narrow the view"
        elif gains is narrowing:
            reason = "a primary that narrows the view is left out, as a concave hyperboloid is"
        face = "concave" if side < 0 else "convex"
        where = "between pinhole and primary" if (place, side) == ("above", 1) else place
        label, is_between = f"{face} primary, shared focus {where}", where.startswith("between")
        fold = Fold(label, 1, inverse_gains, gains, side, is_seldom_feasible=is_between)
        cases.append(EllipsoidPair(fold, reason))
    # In the order in which they came to be known: warm starts hold their place.
    return tuple(sorted(cases, key=lambda case: _PLACES.index(case.fold.label)))


_PLACES = (
    "concave primary, shared focus above",
    "convex primary, shared focus below",
    "convex primary, shared focus between pinhole and primary",
    "concave primary, shared focus below",
)
PAIRS_OF_ELLIPSOIDS = _pairs_of_ellipsoids()


def _secondary_branches(kind: MirrorKind) -> tuple[tuple[str, int, tuple[float, float]], ...]:
    """(label, sign of kappa, range of 1/kappa) of each branch of a secondary with its second focus above."""
    convex = (1.0 / CONVEX_HYPERBOLOID_GAINS[1], 1.0 / CONVEX_HYPERBOLOID_GAINS[0])
    if kind is MirrorKind.PLANE:
        return (("", 1, (1.0, 1.0)),)
    if kind is MirrorKind.HYPERBOLOID:
        return ("convex secondary", 1, convex), ("concave secondary", 1, CONVEX_HYPERBOLOID_GAINS)
    return (("", -1, (1.0 / ELLIPSOID_GAINS[1], 1.0 / ELLIPSOID_GAINS[0])),)


def _pair(primary: MirrorKind, label: str, sign: int, inverse_gains: tuple[float, float]) -> Fold | None:
    if primary is MirrorKind.PLANE:
        if max(inverse_gains) <= 1.0 and sign > 0:
            # The other variant holds it too: its gain alone makes the secondary convex (below 1) or concave (above).
            return None
        return Fold("", sign, inverse_gains, None, 1, primary_is_plane=True)
    if primary is MirrorKind.HYPERBOLOID:
        return Fold(label, sign, inverse_gains, CONVEX_HYPERBOLOID_GAINS, 1)
    crossing = "concave primary, shared focus above" if sign < 0 else label
    return Fold(crossing, -sign, inverse_gains, ELLIPSOID_GAINS, -1)
