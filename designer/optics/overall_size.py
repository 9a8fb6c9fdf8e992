"""How large a finished head is, from the rims of its mirrors and their substrates (docs/theory.md, section 7).

Takes floats, NumPy arrays or CasADi symbols; lengths in mm.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from designer.optics.backend import Scalar, maximum, minimum
from designer.optics.conic import Surface


@dataclass(frozen=True, slots=True)
class Substrate:
    """A mirror with its blank: the face from inner to outer radius, and the same face shifted along z as its back.

    ``back_offset`` is how far the back lies above the face; negative behind a mirror that faces up.
    """

    face: Surface
    inner_radius: Scalar
    outer_radius: Scalar
    back_offset: Scalar

    @property
    def rim_heights(self) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """Heights of the inner rim on face and back, then of the outer rim on face and back.

        A conic that crosses the axis only at its vertex is monotonic from rim to rim: its extremes are among these.
        """
        inner, outer = self.face.height(self.inner_radius), self.face.height(self.outer_radius)
        return inner, inner + self.back_offset, outer, outer + self.back_offset


@dataclass(frozen=True, slots=True)
class OverallSize:
    """Highest and lowest point that count for the height, and the largest radius; a housing counts."""

    top: Scalar
    bottom: Scalar
    radius: Scalar

    @property
    def height(self) -> Scalar:
        """From the lower of lens front and lowest part of the head to its highest part."""
        return self.top - self.bottom

    @property
    def diameter(self) -> Scalar:
        """Over all mirrors with their substrates, and the housing."""
        return 2.0 * self.radius


@dataclass(frozen=True, slots=True)
class Ring:
    """A housing as its envelope: its lower and upper end, and its outer radius."""

    low: Scalar
    high: Scalar
    outer_radius: Scalar


def overall_size(substrates: Iterable[Substrate], lens_front: Scalar, housing: Ring | None = None) -> OverallSize:
    """The size of a head of at least one mirror, in a housing or not, over a lens whose front is at ``lens_front``.

    The lens front counts only as the lowest point: a gap between lens and mirrors belongs to the height, the camera
    does not.
    """
    first, *others = substrates
    top, bottom, radius = first.rim_heights[0], lens_front, first.outer_radius
    for substrate in (first, *others):
        for height in substrate.rim_heights:
            top, bottom = maximum(top, height), minimum(bottom, height)
        radius = maximum(radius, substrate.outer_radius)
    if housing is not None:
        top, bottom = maximum(top, housing.high), minimum(bottom, housing.low)
        radius = maximum(radius, housing.outer_radius)
    return OverallSize(top, bottom, radius)


@dataclass(frozen=True, slots=True)
class Sight:
    """What a view looks through a tube at: its viewpoint's height, and its lowest and highest tan(elevation)."""

    viewpoint: Scalar
    slopes: tuple[Scalar, Scalar]

    def heights(self, radius: Scalar) -> tuple[Scalar, Scalar]:
        """Lowest and highest height at a distance from the axis, of rays that no wall refracts.

        A wall brings them nearer to the viewpoint's height: behind it they lie between these.
        """
        return self.viewpoint + self.slopes[0] * radius, self.viewpoint + self.slopes[1] * radius


def housing_about(
    size: OverallSize, lens_radius: Scalar, gap: Scalar, thickness: Scalar, sights: Iterable[Sight] = ()
) -> Ring:
    """The housing of mirrors of a size: so far outside the widest of them or the lens, so thick, and as tall.

    A tube reaches by the ``gap`` beyond the light of the views' ``sights`` at its outer wall.
    """
    radius = maximum(size.radius, lens_radius) + gap + thickness
    low, high = size.bottom, size.top
    for sight in sights:
        lowest, highest = sight.heights(radius)
        low, high = minimum(low, lowest - gap), maximum(high, highest + gap)
    return Ring(low, high, radius)
