"""What other programs compute."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from designer.as_built.parameters import rotation
from designer.as_built.projection import Targets, aim
from designer.as_built.tracing import PosedCamera, PosedMirror
from designer.design import Mirror
from designer.evaluate.depth import StereoPair, Volume, depth_error_rms
from designer.evaluate.fabrication import ALUMINIUM_G_PER_MM3, mirror_shape
from designer.evaluate.modulation import GREEN_MM, lens_transfer
from designer.optics.focus import FocusedLens
from designer.optics.image_law import ImageLaw
from designer.optimise.search import search
from designer.trace.instrument import build_instrument
from designer.trace.sequential import trace_sequential
from validation.problem import CONFIGURATION, REQUIREMENT
from validation.published import jaramillos_rig
from validation.row import Row

# The rig as the programs were given it: rounded to their digits.
WALL_MM = 1500.0
LENS = FocusedLens(13.0, 5.6, 1.0 / 145.0)


def imaged_by_opencv(law: ImageLaw, psi_deg: float) -> float:
    """Column of a point at an angle from the axis, azimuth 30 degrees, f = 600 px."""
    half_tangent = math.tan(math.radians(psi_deg) / 2.0)
    return 799.5 + 600.0 * float(law.ratio(half_tangent)) * math.cos(math.radians(30.0))


def on_the_wall(starts: list[list[float]], directions: list[list[float]]) -> np.ndarray:
    """Where rays (n, 3) through the folding pair meet the wall y = 1500 mm."""
    rounded = {"vertex_mm": 5.0002, "radius_mm": -27.83526, "conic": -1.258254}
    rig = jaramillos_rig()
    mirrors = [
        Mirror.model_validate({**mirror.model_dump(), **(rounded if mirror.name == "primary" else {})})
        for mirror in rig.mirrors
    ]
    instrument = build_instrument(rig.model_copy(update={"mirrors": tuple(mirrors)}))
    ahead = np.array(directions)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    path = instrument.path(("secondary", "primary"))
    trace = trace_sequential(instrument, path, ahead, starts, apertures=False)
    length = (WALL_MM - trace.point[:, 1]) / trace.direction[:, 1]
    return np.asarray(trace.point + length[:, None] * trace.direction)


def skew_ray(axis: int) -> float:
    """A ray that starts beside the pinhole and leaves the meridian."""
    return float(on_the_wall([[0.4, 0.3, 0.0]], [[0.01, 0.1, 1.0]])[0, axis])


def another_skew_ray(axis: int) -> float:
    """A steeper one, from the other side of the pinhole."""
    return float(on_the_wall([[0.2, -0.3, 0.0]], [[-0.02, 0.12, 1.0]])[0, axis])


def spot() -> float:
    """Root mean square radius of what 24 parallel rays through the pupil make on the wall."""
    angles, radii = np.meshgrid(np.arange(8) * np.pi / 4.0, [0.25, 0.5, 0.75])
    places = np.stack([(radii * np.cos(angles)).ravel(), (radii * np.sin(angles)).ravel(), np.zeros(24)], axis=-1)
    points = on_the_wall(places.tolist(), [[0.0, 0.1, 1.0]] * 24)
    return float(np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean()))


def shown_by_povray() -> float:
    """Height at which the ray of a pixel meets a round wall of 1500 mm."""
    rays = [[-0.5 * 0.0044, 190.5 * 0.0044, 8.0]]
    rig = jaramillos_rig()
    instrument = build_instrument(rig)
    ahead = np.array(rays) / np.linalg.norm(rays)
    trace = trace_sequential(instrument, instrument.path(("secondary", "primary")), ahead, apertures=False)
    point, direction = trace.point[0], trace.direction[0]
    across = np.hypot(*direction[:2])
    return float(point[2] + (WALL_MM - np.hypot(*point[:2])) / across * direction[2])


def aimed(conic: float) -> float:
    """tan(psi) of the image of the point (1000, 250) mm in a convex mirror of radius 30 mm, vertex at 100 mm."""
    mirror = PosedMirror((0.0, 0.0, 100.0), rotation(0.0, 0.0), 1.0 / 30.0, 1.0 + conic, -1.0)
    point = np.array([1000.0, 0.0, 250.0])
    towards = (point - [0.0, 0.0, 115.0]) / np.linalg.norm(point - [0.0, 0.0, 115.0])
    right = np.array([0.0, 1.0, 0.0])
    basis = np.stack([right, np.cross(towards, right), towards])[:, :, None]
    camera = PosedCamera((0.0, 0.0, 0.0), rotation(0.0, 0.0), 1.0, 0.0)
    slopes = np.array([0.15, 0.0])
    targets = Targets(point[:, None], basis, slopes[:, None])
    return float(np.asarray(aim(camera, [mirror], targets, slopes[:, None, None]).slopes)[0, 0, 0])


def score() -> float:
    """The score of a pair of views."""
    pair = StereoPair(0.046, "folded", 0.11, "direct", 100.0, 12.0)
    volume = Volume((math.radians(-16.0), math.radians(16.0)), (1000.0, 5000.0))
    return float(depth_error_rms(pair, volume, 0.00044))


def shell_volume() -> float:
    """Volume of the primary's shell with its published hole, in mm^3."""
    return mirror_shape(jaramillos_rig(hole=3.392), "primary").mass_g / ALUMINIUM_G_PER_MM3


def diffraction() -> float:
    """Transfer of a lens in focus at half the frequency at which diffraction ends."""
    cut_off = LENS.pupil_diameter / (GREEN_MM * LENS.principal_distance)
    return float(lens_transfer(0.5 * cut_off, 0.0, LENS))


def first_zero() -> float:
    """Frequency times diameter at which a large blur transfers nothing, hardly any diffraction."""
    return float(brentq(lambda nu: float(lens_transfer(nu, 1.0, LENS, wavelength=1e-12)), 1.0, 1.4, xtol=1e-14))


def optimum() -> float:
    """The least depth error of the paper's configuration."""
    first = search(REQUIREMENT, CONFIGURATION).first
    assert first is not None
    return 100.0 * first.goals["depth_error"]


NEWTON = "Newton's method to rounding"
ROWS = (
    Row("opencv_fisheye_px", "column of a point at 50 degrees, OpenCV's fisheye model", "px",
        lambda: imaged_by_opencv(ImageLaw("equidistant", (-0.02, 0.003, -0.0005, 0.0001)), 50.0), ".10f"),
    Row("opencv_pinhole_px", "column of a point at 30 degrees, OpenCV's pinhole model with k1, k2, k3", "px",
        lambda: imaged_by_opencv(ImageLaw("perspective", (-0.1, 0.02, -0.003)), 30.0), ".10f"),
    Row("optiland_skew_x_mm", "a skew ray through Jaramillo's folding pair, x on a wall 1.5 m away", "mm",
        lambda: skew_ray(0), ".10f"),
    Row("optiland_skew_z_mm", "the same ray, height on the wall", "mm", lambda: skew_ray(2), ".10f"),
    Row("optiland_spot_mm", "rms radius of the spot of 24 rays of the pupil on the wall", "mm", spot, ".10f",
        convergence="the same 24 rays in both"),
    Row("rayoptics_skew_x_mm", "another skew ray through the pair, x on the wall", "mm", lambda: another_skew_ray(0),
        ".10f"),
    Row("rayoptics_skew_z_mm", "the same ray, height on the wall", "mm", lambda: another_skew_ray(2), ".10f"),
    Row("povray_height_mm", "height on a round wall that a pixel of a rendered image shows", "mm",
        shown_by_povray, ".4f", few_digits="a tone of 16 bits for 800 mm: steps of 0.012 mm"),
    Row("alhazen_sphere", "image of a point in a sphere, tan(psi)", "", lambda: aimed(0.0), ".12f",
        convergence=NEWTON),
    Row("agrawal_conic", "image of a point in a hyperboloid off its focus, tan(psi)", "", lambda: aimed(-2.3), ".12f",
        convergence=NEWTON),
    Row("score_integral", "depth error of a pair of views, integrated", "", score, ".10f",
        convergence="5 x 4 Gauss nodes, held to 1e-3 by tests/evaluate/test_depth.py; the difference is the rule's"),
    Row("trimesh_volume_mm3", "volume of the shell of Jaramillo's primary", "mm^3", shell_volume, ".4f"),
    Row("diffraction_transfer", "transfer at half of diffraction's last frequency, in focus", "", diffraction, ".12f",
        convergence="96 Gauss nodes"),
    Row("first_zero", "blur in periods at which contrast first vanishes, 1.22", "", first_zero, ".9f",
        convergence="96 Gauss nodes; wavelength 1e-12 mm in the place of none"),
    Row("evolution_percent", "least depth error of the paper's configuration, 0.1 px", "%", optimum, ".8f",
        convergence="sequential quadratic programming to 1e-6, from many starts", is_quick=False),
)  # fmt: skip
