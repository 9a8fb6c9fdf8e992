"""Where the lens must focus, and how wide the light of a scene point is: first order about a chief ray.

A chief ray passes through both foci of every mirror that it meets, and there a conic has the same power in the
tangential and in the sagittal plane, 2 / (R_t cos i) = 2 cos i / R_s (Coddington's equations): narrow pencils stay free
of astigmatism at every elevation. One chain of heights h and slopes theta about the chief ray therefore says
everything. World inwards, with the scene point at distance L from the viewpoint and rho_F the distance from the
viewpoint to the last mirror:

    at the last mirror   h = 1 - rho_F / L,   theta = 1 / L
    at a mirror          theta -= P h
    over a leg           h += leg theta
    at the pinhole       1 / V = theta / h,   1 / z_V = (1 / V) / cos(psi)

V is the distance of the virtual image from the pinhole along the chief ray, z_V its depth along the axis. All
distances enter as reciprocals: V and L may be infinite.

Every function takes floats, NumPy arrays or CasADi symbols; lengths in mm, angles in radians, reciprocals in 1/mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from designer.design import Camera, Design, Sense, ViewName
from designer.optics.backend import Scalar, absolute, sqrt
from designer.optics.conic import FocalConic
from designer.optics.image_law import PERSPECTIVE, ImageLaw, image_law_of
from designer.optics.layout import OpticalPath, Point
from designer.optics.view import half_angle_tangent, image_radius_slope


@dataclass(frozen=True, slots=True)
class FocusingMirror:
    """A mirror of a view, written from one of its foci.

    ``from_world`` says which: the focus through which the light passes, or seems to, on the mirror's world side
    (a primary, seen from the effective viewpoint), or the one on its pinhole side (a direct mirror, a secondary).
    """

    conic: FocalConic
    from_world: bool = False


@dataclass(frozen=True, slots=True)
class LightPath:
    """What focusing needs of a view: its mirrors from the pinhole outwards, viewpoint, gain and sense.

    Mirrors that are written from their pinhole side come before those written from their world side.
    """

    mirrors: tuple[FocusingMirror, ...]
    viewpoint: Scalar
    gain: Scalar
    sense: Sense


@dataclass(frozen=True, slots=True)
class ChiefRay:
    """One chief ray of a view, with the powers that the light of a scene point meets along it.

    ``slope`` is tan(phi) at the viewpoint and ``half_tangent`` tan(psi/2) at the pinhole. For each mirror from the
    pinhole outwards: the ``points`` (R, z) where the ray meets it, its ``powers`` in 1/mm, and the lengths of the
    ``legs`` that lead to it. ``directions`` (R, z) are unit vectors of the legs, outwards, the last one into the
    world. ``viewpoint_distance`` is the signed distance from the viewpoint to the last mirror, positive outwards.
    """

    slope: Scalar
    half_tangent: Scalar
    points: tuple[Point, ...]
    powers: tuple[Scalar, ...]
    legs: tuple[Scalar, ...]
    directions: tuple[Point, ...]
    viewpoint_distance: Scalar

    @property
    def pinhole_cosine(self) -> Scalar:
        """cos(psi) at the pinhole."""
        squared = self.half_tangent * self.half_tangent
        return (1.0 - squared) / (1.0 + squared)


@dataclass(frozen=True, slots=True)
class LightWidth:
    """Half-widths in mm of the light of one scene point through the pupil, in the meridional plane.

    ``across`` holds one for each mirror from the pinhole outwards, measured across the chief ray, and ``radial`` the
    same along R on the face: what an aperture needs beyond the chief ray's point. ``at_pupil`` is the half-width
    where the ray leaves the pinhole. All are signed: a change of sign from one to the next is an image on the leg
    between them. ``narrowing`` is what the last leg loses per mm outwards.
    """

    at_pupil: Scalar
    across: tuple[Scalar, ...]
    radial: tuple[Scalar, ...]
    narrowing: Scalar

    def along_leg(self, leg: int, share: Scalar) -> Scalar:
        """Half-width across the chief ray at a share 0..1 of the way along a leg; leg 0 leaves the pinhole.

        The last leg has no end: there the second argument is the distance from its mirror in mm.
        """
        start = self.across[leg - 1] if leg else self.at_pupil
        if leg == len(self.across):
            return absolute(start - share * self.narrowing)
        return absolute(start + share * (self.across[leg] - start))


@dataclass(frozen=True, slots=True)
class FocusedLens:
    """A focused lens: principal distance f, f-number N, the reciprocal w = 1/u of its focus distance, and its law.

    u counts from the entrance pupil, and w = 0 is focus at infinity. The nominal focal length f0 follows from
    1/f0 = 1/f + w.
    """

    principal_distance: Scalar
    f_number: Scalar
    reciprocal_focus: Scalar
    law: ImageLaw = PERSPECTIVE

    @property
    def pupil_diameter(self) -> Scalar:
        """Diameter p = f0 / N of the entrance pupil."""
        return self.principal_distance / (1.0 + self.principal_distance * self.reciprocal_focus) / self.f_number

    def blur(self, reciprocal_depth: Scalar) -> Scalar:
        """Signed diameter p f (1/u - 1/z_V) of the blur in a perspective image, negative if nearer than the focus.

        Exact for a thin lens and a stigmatic pencil, and even in all of the pupil: the disc is evenly lit. A lens of
        another law stretches it (:meth:`designer.optics.image_law.ImageLaw.stretch`).
        """
        return self.pupil_diameter * self.principal_distance * (self.reciprocal_focus - reciprocal_depth)


def focal_distances(vertex_distance: Scalar, tangent_ratio: Scalar, half_tangent: Scalar) -> tuple[Scalar, Scalar]:
    """Distance rho_A from focus A to a mirror along a chief ray, and the reciprocal 1 / rho_B of that from focus B.

    rho_A = v (1 + t^2) / (1 - mu t^2) and 1 / rho_B = mu (1 - mu t^2) / (v (1 + mu^2 t^2)), both signed and positive
    outwards, with t = tan(half the angle at A) and mu = tan(half the angle at B) / t. 1 / rho_B = 0 is a paraboloid.
    """
    squared = half_tangent * half_tangent
    reach = 1.0 - tangent_ratio * squared
    distance = vertex_distance * (1.0 + squared) / reach
    reciprocal = tangent_ratio * reach / (vertex_distance * (1.0 + tangent_ratio * tangent_ratio * squared))
    return distance, reciprocal


def mirror_power(vertex_distance: Scalar, tangent_ratio: Scalar, half_tangent: Scalar) -> Scalar:
    """Power in 1/mm of a conic along a chief ray through its foci, the same tangentially and sagittally.

    P = 1 / rho_A - 1 / rho_B = (1 - mu) (1 - mu t^2)^2 / (v (1 + t^2) (1 + mu^2 t^2)): positive for a concave mirror,
    zero for a plane (mu = 1), finite for a paraboloid (mu = 0). This is the sign of a mirror that faces down; one that
    faces up has the opposite, whichever of its foci v counts from.
    """
    squared = half_tangent * half_tangent
    reach = 1.0 - tangent_ratio * squared
    spread = (1.0 + squared) * (1.0 + tangent_ratio * tangent_ratio * squared)
    return (1.0 - tangent_ratio) * reach * reach / (vertex_distance * spread)


def chief_ray(path: LightPath, slope: Scalar) -> ChiefRay:
    """Follow the chief ray of elevation slope m = tan(phi) from the pinhole over the mirrors to the world."""
    at_viewpoint = half_angle_tangent(slope, path.sense)
    at_pinhole = path.gain * at_viewpoint
    tangents = _half_tangents(path.mirrors, at_pinhole, at_viewpoint)
    points: list[Point] = []
    powers: list[Scalar] = []
    for place, (mirror, tangent) in enumerate(zip(path.mirrors, tangents, strict=True)):
        # Mirrors face down and up in turn. Light that goes down at a focus has its angle counted from -z.
        faces_down = place % 2 == 0
        goes_up = faces_down != mirror.from_world
        vertex_distance, ratio = _vertex_distance_and_ratio(mirror.conic)
        points.append(mirror.conic.point(tangent if goes_up else -tangent))
        power = mirror_power(vertex_distance, ratio, tangent)
        powers.append(power if faces_down else -power)

    squared = at_pinhole * at_pinhole
    directions: list[Point] = [(2.0 * at_pinhole / (1.0 + squared), (1.0 - squared) / (1.0 + squared))]
    # Along the axis the first mirror may be reached at R = 0, so that only its height tells the distance.
    legs = [points[0][0] * directions[0][0] + points[0][1] * directions[0][1]]
    for (start_r, start_z), (end_r, end_z) in pairwise(points):
        length = sqrt((end_r - start_r) * (end_r - start_r) + (end_z - start_z) * (end_z - start_z))
        legs.append(length)
        directions.append(((end_r - start_r) / length, (end_z - start_z) / length))
    secant = sqrt(1.0 + slope * slope)
    directions.append((1.0 / secant, slope / secant))
    radius, height = points[-1]
    viewpoint_distance = radius * directions[-1][0] + (height - path.viewpoint) * directions[-1][1]
    return ChiefRay(slope, at_pinhole, tuple(points), tuple(powers), tuple(legs), tuple(directions), viewpoint_distance)


def reciprocal_along_ray(slope: Scalar, horizontal_distance: Scalar) -> Scalar:
    """1 / L in 1/mm of a scene point at a horizontal distance from the axis, L along its chief ray."""
    return 1.0 / (horizontal_distance * sqrt(1.0 + slope * slope))


def reciprocal_image_distance(ray: ChiefRay, reciprocal_distance: Scalar) -> Scalar:
    """1 / V of the virtual image of a scene point at 1 / L, along the chief ray from the pinhole; positive ahead."""
    heights, slope = _chain(ray, reciprocal_distance)
    return slope / heights[0]


def reciprocal_image_depth(ray: ChiefRay, reciprocal_distance: Scalar) -> Scalar:
    """1 / z_V of the virtual image of a scene point at 1 / L, along the optical axis: what the lens focuses at."""
    return reciprocal_image_distance(ray, reciprocal_distance) / ray.pinhole_cosine


def blur_in_scene(path: LightPath, slope: Scalar, lens: FocusedLens, blur: Scalar) -> Scalar:
    """A blur in a perspective image (mm) as an angle of elevation in the scene (radians), its sign kept.

    blur / |dr/dphi|, both of r = f tan(psi): the lens's law stretches both alike.
    """
    return blur / absolute(image_radius_slope(slope, path.gain, lens.principal_distance, path.sense))


def light_width(ray: ChiefRay, reciprocal_distance: Scalar, pupil_radius: Scalar) -> LightWidth:
    """Half-widths of the light of a scene point at 1 / L that fills a pupil, at every mirror and along every leg.

    Across the chief ray (p/2) cos(psi) h_k / h_pupil; along R on a face times cos(slope) / cos(incidence), which for
    unit directions d and d' of the legs before and after is |d_z - d'_z| / (1 - d d').
    """
    heights, _ = _chain(ray, reciprocal_distance)
    at_pupil = pupil_radius * ray.pinhole_cosine
    scale = at_pupil / heights[0]
    across = [scale * height for height in heights[1:]]
    radial = []
    for width, ((before_r, before_z), (after_r, after_z)) in zip(across, pairwise(ray.directions), strict=True):
        turn = 1.0 - before_r * after_r - before_z * after_z
        radial.append(width * absolute(before_z - after_z) / turn)
    return LightWidth(at_pupil, tuple(across), tuple(radial), scale * reciprocal_distance)


def image_conjugates(ray: ChiefRay) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """(a, b, c, d) of 1 / z_V = (c + d y) / (a + b y) with y = 1 / L: every distance at once.

    Heights and slopes are linear in y, so that two scene points, one at infinity, fix all others.
    """
    far_heights, far_slope = _chain(ray, 0.0)
    near_heights, near_slope = _chain(ray, 1.0)
    cosine = ray.pinhole_cosine
    return (
        far_heights[0] * cosine,
        (near_heights[0] - far_heights[0]) * cosine,
        far_slope,
        near_slope - far_slope,
    )


def light_path_of_layout(path: OpticalPath, gain: Scalar, sense: Sense) -> LightPath:
    """The light path of a view that an optimiser has laid out; a mirror that faces up is written from the world."""
    mirrors = tuple(FocusingMirror(reflection.conic, reflection.direction < 0) for reflection in path.reflections)
    return LightPath(mirrors, path.viewpoint, gain, sense)


def light_path_of_design(design: Design, view_name: ViewName) -> LightPath:
    """The light path of a finished design's view, "upper" or "lower": of one mirror or of a folded pair.

    Vertices and curvatures come from the mirrors, the foci from the pinhole and the recorded viewpoint: for a design
    that is not confocal this says what a confocal one with the same curvatures would do.

    Raises
    ------
    ValueError
        The view has more than two mirrors, whose foci no record holds.
    """
    view = design.views.by_name[view_name]
    if len(view.path) > 2:
        raise ValueError(f"the {view_name} view has {len(view.path)} mirrors: their foci are recorded for two only")
    mirrors = []
    for place, name in enumerate(view.path):
        mirror = design.mirror(name)
        focus = view.viewpoint_mm if place else 0.0
        distance = mirror.vertex_mm - focus
        ratio = 1.0 if mirror.radius_mm is None else 1.0 + 2.0 * distance / mirror.radius_mm
        mirrors.append(FocusingMirror(FocalConic(focus, distance, ratio), from_world=place > 0))
    return LightPath(tuple(mirrors), view.viewpoint_mm, view.gain, view.sense)


def lens_of_camera(camera: Camera) -> FocusedLens:
    """The lens as a design records it; focus at infinity where none is recorded."""
    reciprocal = 1.0 / camera.focus_distance_mm if camera.focus_distance_mm else 0.0
    return FocusedLens(camera.focal_length_mm, camera.f_number, reciprocal, image_law_of(camera))


def _chain(ray: ChiefRay, reciprocal_distance: Scalar) -> tuple[tuple[Scalar, ...], Scalar]:
    """Heights at the pinhole and at each mirror outwards, and the slope at the pinhole, per slope L at the object."""
    height = 1.0 - ray.viewpoint_distance * reciprocal_distance
    slope = reciprocal_distance
    heights = [height]
    for power, leg in zip(reversed(ray.powers), reversed(ray.legs), strict=True):
        slope = slope - power * height
        height = height + leg * slope
        heights.append(height)
    return tuple(reversed(heights)), slope


def _half_tangents(mirrors: tuple[FocusingMirror, ...], at_pinhole: Scalar, at_viewpoint: Scalar) -> list[Scalar]:
    """Half-angle tangents of a chief ray, each at the focus from which its mirror is written."""
    tangents: list[Scalar] = []
    outwards = at_pinhole
    for mirror in mirrors:
        if mirror.from_world:
            break
        tangents.append(outwards)
        outwards = outwards * _vertex_distance_and_ratio(mirror.conic)[1]
    from_world = []
    inwards = at_viewpoint
    for mirror in reversed(mirrors[len(tangents) :]):
        from_world.append(inwards)
        inwards = inwards * _vertex_distance_and_ratio(mirror.conic)[1]
    return tangents + from_world[::-1]


def _vertex_distance_and_ratio(conic: FocalConic) -> tuple[Scalar, Scalar]:
    """Vertex distance v from the focus, and the ratio mu of the half-angle tangents at the two foci."""
    return conic.vertex_distance, conic.tangent_ratio
