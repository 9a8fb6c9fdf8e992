"""The end-to-end check: a design's image of a scene, rendered, matched and reconstructed, against the truth.

The noise of the matched image points is measured on another scene (:mod:`designer.imaging.endtoend.noise`) and carried
to the distances, elevations and contrasts of the scene under test by first order (docs/theory.md, section 5); nothing
of how that one was matched enters the prediction. The truth of a panorama pixel is what the traced ray through its
place in the raw image meets.

Through the design's lens the check says what the system will do: blur takes texture away, in the calibration scene
too, and with it matches; mirrors and the rim of the lens take light. The panoramas are evened out by what they take,
which is known: a folded view loses light at two mirrors, a direct one at one, and matched as they are the views would
be unlike everywhere. Through a pinhole it proves the geometry alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from designer.design import Design
from designer.imaging.endtoend.bands import Band, Mask, judge_bands
from designer.imaging.endtoend.noise import Noise, calibrate_noise, contrast_in, error_per_pixel, record, true_points
from designer.imaging.images import Image
from designer.imaging.render.camera_rays import refuse_too_large
from designer.imaging.render.detector import Detector
from designer.imaging.render.lens import RenderedLens
from designer.imaging.render.scenes.library import build_world, calibration_world
from designer.imaging.render.scenes.world import Array, World, first_surfaces
from designer.imaging.stereo.matching import ACCURATE_OPTIONS, Matches, MatchingOptions, MatchOutcome
from designer.imaging.stereo.placement import ViewImage
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image, panoramas
from designer.notebook_html import html_table, percent

# Matches are looked for well beyond the working volume: a search that ended at its edge would cut off the errors of
# one sign there and so look like bias.
SEARCH_NEARER, SEARCH_FARTHER = 0.8, 2.5
# A point is seen by the lower view if the first surface on its line of sight is this near, relative.
SAME_POINT = 2e-3


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """How a design is checked.

    ``scene`` and ``texture`` are those of :func:`designer.imaging.render.scenes.library.build_world`; ``samples`` is
    the number of rays along each side of a pixel, None for as many as are enough; ``seed`` is that of textures and
    noise. ``lens`` is what the images are recorded through, those of the calibration scene and of the scene under test,
    None for a pinhole. ``built`` is the system that records the images if it was not built as designed; it has the
    camera of the design.
    """

    scene: str = "auto"
    texture: str = "rich"
    samples: int | None = None
    detector: Detector = field(default_factory=Detector)
    matching: MatchingOptions = ACCURATE_OPTIONS
    equalise: bool = True
    seed: int = 0
    lens: RenderedLens | None = field(default_factory=RenderedLens)
    built: Design | None = None


DEFAULT_OPTIONS = CheckOptions()


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """What the camera recorded of the calibration scene and of the scene under test.

    Raw images, and what the pixels of the upper panorama truly show, (3, columns, rows), NaN where seen another way.
    """

    world: World
    raw_of_walls: Image
    points_of_walls: Array
    raw: Image
    points: Array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class EndToEndCheck:
    """A design checked end to end.

    ``noise`` is that of an image point in each view, from the calibration scene. The arrays have the shape (columns,
    rows) of the upper panorama's scan lines: ``true_distance_mm`` (NaN where there is nothing), ``both_see`` (the
    pixels judged: in the working volume and seen by both views), ``predicted`` (sigma_D / D) and ``relative_error``
    ((measured - true) / true, NaN where dropped). ``lens`` is what recorded the images, None for a pinhole.
    """

    configuration: str
    scene: str
    texture: str
    noise: Noise
    bands: tuple[Band, ...]
    rig: StereoRig
    raw: Image
    upper: Image
    lower: Image
    matches: Matches
    true_distance_mm: Array
    both_see: Mask
    predicted: Array
    relative_error: Array
    lens: RenderedLens | None

    @property
    def points(self) -> int:
        """How many of the pixels judged have a distance."""
        return int((self.both_see & (self.matches.outcomes == MatchOutcome.KEPT)).sum())

    @property
    def passed(self) -> bool:
        """Whether every band that can be judged passes, and there is one."""
        judged = [band for band in self.bands if band.is_judged]
        return bool(judged) and not any(band.problems for band in judged)

    @property
    def untested(self) -> tuple[Band, ...]:
        """Bands in which too few pixels show a surface for a verdict."""
        return tuple(band for band in self.bands if not band.is_judged)

    def _repr_html_(self) -> str:
        through = "a pinhole" if self.lens is None else "the lens"
        title = f"{self.configuration}, scene {self.scene}, through {through}: {'passed' if self.passed else 'FAILED'}"
        columns = ("distance (mm)", "pixels", "kept", "median error", "robust rms error", "predicted", "problems")
        rows = [
            (
                "{:.4g} to {:.4g}".format(*band.distance_mm),
                band.pixels,
                *(percent(share) for share in (band.kept, band.bias, band.error, band.predicted)),
                ", ".join(band.problems) or ("none" if band.is_judged else "too few pixels to judge"),
            )
            for band in self.bands
        ]
        return html_table(title, columns, rows)


def check_design(design: Design, options: CheckOptions = DEFAULT_OPTIONS) -> EndToEndCheck:
    """Render a scene, reconstruct it and compare it with the truth.

    Raises
    ------
    InputError
        There is no such scene or texture, or the camera has too many pixels.
    """
    refuse_too_large(design.camera.width_px, design.camera.height_px)
    near, far = design.working_volume.distance_mm
    world = build_world(options.scene, design, options.texture, options.seed)
    rig = build_rig(
        design,
        distances_mm=(SEARCH_NEARER * near, SEARCH_FARTHER * far),
        equalise=options.equalise,
        mirror_reflectivity=options.lens.mirror_reflectivity if options.lens else None,
    )
    recorded = record_both_scenes(rig, world, options)
    noise = calibrate_noise(rig, recorded.raw_of_walls, recorded.points_of_walls, options.matching)
    matches = match_image(rig, recorded.raw, options.matching)
    distance = np.hypot(recorded.points[0], recorded.points[1])
    both_see = seen_by_both(rig, world, recorded.points)
    predicted = predicted_error(rig, noise, recorded.raw, distance, options.matching)
    error = matches.distances_mm / distance - 1.0
    pair = panoramas(rig, recorded.raw)
    return EndToEndCheck(
        configuration=design.configuration,
        scene=world.name,
        texture=options.texture,
        noise=noise,
        bands=judge_bands(design, matches, distance, both_see, predicted, error),
        rig=rig,
        raw=recorded.raw,
        upper=pair["upper"],
        lower=pair["lower"],
        matches=matches,
        true_distance_mm=distance,
        both_see=both_see,
        predicted=predicted,
        relative_error=error,
        lens=options.lens,
    )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class CheckWithControl:
    """The same check through the design's lens and through a pinhole, which shows what the lens costs."""

    lens: EndToEndCheck
    pinhole: EndToEndCheck

    @property
    def kept_of_pinhole(self) -> float | None:
        """The points found through the lens as a share of those found through a pinhole; None if there are none."""
        return share_of_points(self.lens.points, self.pinhole.points)


def share_of_points(through_lens: int, through_pinhole: int) -> float | None:
    """The points found through a lens as a share of those found through a pinhole; None if there are none."""
    return through_lens / through_pinhole if through_pinhole else None


def check_with_control(design: Design, options: CheckOptions = DEFAULT_OPTIONS) -> CheckWithControl:
    """Check a design through its lens and through a pinhole.

    Raises
    ------
    InputError
        There is no such scene or texture.
    """
    lens = check_design(design, replace(options, lens=options.lens or RenderedLens()))
    return CheckWithControl(lens, check_design(design, replace(options, lens=None)))


def record_both_scenes(rig: StereoRig, world: World, options: CheckOptions) -> Recording:
    """Record the calibration scene and a world with the system as built, and trace what panorama pixels show.

    A sensor with departures (``as_built``) records the world only: the noise is that of matching, which the design has
    too, and what the departures add is for the check to show.
    """
    built, seed = options.built or rig.design, options.seed
    worlds = (calibration_world(rig.design, seed=seed + 1), world)
    if built.as_built is not None:
        as_designed = built.model_copy(update={"as_built": None})
        (raw_of_walls,), (raw,) = (
            record(system, (scene,), options.detector, options.samples, (its_seed,), options.lens)
            for system, scene, its_seed in ((as_designed, worlds[0], seed + 1), (built, world, seed))
        )
        (points_of_walls,), (points,) = true_points(rig, as_designed, worlds[:1]), true_points(rig, built, worlds[1:])
        return Recording(world, raw_of_walls, points_of_walls, raw, points)
    raw_of_walls, raw = record(built, worlds, options.detector, options.samples, (seed + 1, seed), options.lens)
    points_of_walls, points = true_points(rig, built, worlds)
    return Recording(world, raw_of_walls, points_of_walls, raw, points)


def predicted_error(
    rig: StereoRig, noise: Noise, raw: Image, true_distance_mm: Array, options: MatchingOptions
) -> Array:
    """sigma_D / D (columns, rows) that calibrated noise causes at true distances, by the contrast of the raw image."""
    return noise.at(true_distance_mm, contrast_in(rig, raw, options)) * error_per_pixel(rig, true_distance_mm)


def seen_by_both(rig: StereoRig, world: World, points: Array) -> Mask:
    """Which points (3, columns, rows) of the upper panorama lie in the working volume and are seen by both views."""
    return _in_volume(rig.design, points) & _lower_sees(rig, world, points)


def _in_volume(design: Design, points: Array) -> Mask:
    near, far = design.working_volume.distance_mm
    low, high = np.tan(np.radians(design.working_volume.elevation_deg))
    middle = design.views.middle_mm
    distance = np.hypot(points[0], points[1])
    slope = (points[2] - middle) / distance
    return np.asarray((distance >= near) & (distance <= far) & (slope >= low) & (slope <= high))


def _lower_sees(rig: StereoRig, world: World, points: Array) -> Mask:
    """Whether the lower view images the points (3, columns, rows), and nothing in the world hides them from it."""
    image: ViewImage = rig.images["lower"]
    x, y, z = points
    distance = np.hypot(x, y)
    imaged = image.is_imaged(image.slope_towards(z - image.viewpoint_mm, distance), np.arctan2(y, x))
    known = np.isfinite(distance)
    towards = points[:, known] - np.array([[0.0], [0.0], [image.viewpoint_mm]])
    length = np.linalg.norm(towards, axis=0)
    start = np.broadcast_to(np.array([[0.0], [0.0], [image.viewpoint_mm]]), towards.shape)
    reached = first_surfaces(world, start, towards / length).distance
    clear = np.zeros(distance.shape, dtype=bool)
    clear[known] = reached > length * (1.0 - SAME_POINT)
    return np.asarray(imaged & clear)
