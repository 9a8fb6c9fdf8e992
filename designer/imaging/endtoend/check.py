"""The end-to-end check: a design's image of a scene, rendered, matched and reconstructed, against the truth.

The noise of the matched image points is measured on another scene (:mod:`designer.imaging.endtoend.noise`) and carried
to the distances, elevations and contrasts of the scene under test by first order (docs/theory.md, section 5); nothing
of how that one was matched enters the prediction. The truth of a panorama pixel is what the traced ray through its
place in the raw image meets.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import pairwise
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from designer.design import Design
from designer.imaging.endtoend.noise import (
    BANDS,
    FEWEST_PIXELS,
    NORMAL_PER_MAD,
    Noise,
    calibrate_noise,
    contrast_in,
    distance_bands,
    error_per_pixel,
    record,
    robust_deviation,
    true_points,
)
from designer.imaging.render.detector import Detector
from designer.imaging.render.scenes.library import build_world, calibration_world
from designer.imaging.render.scenes.world import Array, World, first_surfaces
from designer.imaging.stereo.matching import ACCURATE_OPTIONS, Matches, MatchingOptions, MatchOutcome
from designer.imaging.stereo.panorama import Image
from designer.imaging.stereo.placement import ViewImage
from designer.imaging.stereo.rig import StereoRig, build_rig, match_image, panoramas

Mask = NDArray[np.bool_]

LARGEST_BIAS = 0.01
LARGEST_BIAS_SIGMAS = 0.25
LEAST_ERROR_RATIO, LARGEST_ERROR_RATIO = 0.5, 1.5
LEAST_KEPT = 0.6
# With less contrast than this over a band, stereo has nothing to go by.
LEAST_TEXTURED = 0.1
# Matches are looked for well beyond the working volume: a search that ended at its edge would cut off the errors of
# one sign there and so look like bias.
SEARCH_NEARER, SEARCH_FARTHER = 0.8, 2.5
# A point is seen by the lower view if the first surface on its line of sight is this near, relative.
SAME_POINT = 2e-3


@dataclass(frozen=True, slots=True)
class Band:
    """The verdict on one band of true distances.

    ``pixels`` are those of the upper panorama that show a point of the working volume there which both views can
    see; ``textured`` those of them with contrast; ``kept`` the fraction of the textured that has a depth. ``bias``
    is the median relative depth error of the kept and ``error`` its robust RMS; ``error_ratio`` is the robust RMS of
    their errors in units of the prediction, and ``predicted`` the median predicted sigma_D / D. Numbers are NaN where
    nothing was kept.
    """

    distance_mm: tuple[float, float]
    pixels: int
    textured: int
    kept: float
    bias: float
    error: float
    error_ratio: float
    predicted: float

    @property
    def is_judged(self) -> bool:
        """Whether there are enough pixels to judge."""
        return self.pixels >= FEWEST_PIXELS

    @property
    def bias_bound(self) -> float:
        """The largest median relative error allowed."""
        return max(LARGEST_BIAS, LARGEST_BIAS_SIGMAS * self.predicted)

    @property
    def problems(self) -> tuple[str, ...]:
        """What fails, in words; empty if the band passes or cannot be judged."""
        if not self.is_judged:
            return ()
        if self.textured < LEAST_TEXTURED * self.pixels:
            return ("no texture",)
        found = []
        # Written so that a number that is not there fails.
        if not abs(self.bias) <= self.bias_bound:
            found.append("bias")
        if not LEAST_ERROR_RATIO <= self.error_ratio <= LARGEST_ERROR_RATIO:
            found.append("error ratio")
        if not self.kept >= LEAST_KEPT:
            found.append("kept")
        return tuple(found)


@dataclass(frozen=True, slots=True, eq=False)
class EndToEndCheck:
    """A design checked end to end.

    ``noise`` is that of an image point in each view, from the calibration scene. The arrays have the shape (columns,
    rows) of the upper panorama's scan lines: ``true_distance_mm`` (NaN where there is nothing), ``both_see`` (the
    pixels judged: in the working volume and seen by both views), ``predicted`` (sigma_D / D) and ``relative_error``
    ((measured - true) / true, NaN where dropped).
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

    @property
    def passed(self) -> bool:
        """Whether every band that can be judged passes, and there is one."""
        judged = [band for band in self.bands if band.is_judged]
        return bool(judged) and not any(band.problems for band in judged)


def check_design(
    design: Design,
    scene: str = "auto",
    *,
    texture: str = "rich",
    samples: int = 2,
    detector: Detector | None = None,
    options: MatchingOptions = ACCURATE_OPTIONS,
    equalise: bool = True,
    seed: int = 0,
    built: Design | None = None,
) -> EndToEndCheck:
    """Render a scene, reconstruct it and compare it with the truth.

    Parameters
    ----------
    scene, texture
        As :func:`designer.imaging.render.scenes.library.build_world` takes them.
    samples
        Rays along each side of a pixel.
    detector
        The noise of the detector; its defaults if not given.
    seed
        Of textures and noise.
    built
        The system that records the images, if it was not built as designed; it has the camera of the design.

    Raises
    ------
    InputError
        There is no such scene or texture.
    """
    built = built or design
    detector = detector or Detector()
    world = build_world(scene, design, texture, seed)
    near, far = design.working_volume.distance_mm
    rig = build_rig(design, distances_mm=(SEARCH_NEARER * near, SEARCH_FARTHER * far), equalise=equalise)
    worlds = (calibration_world(design, seed=seed + 1), world)
    raw_of_walls, raw = record(built, worlds, detector, samples, (seed + 1, seed))
    points_of_walls, points = true_points(rig, built, worlds)
    noise = calibrate_noise(rig, raw_of_walls, points_of_walls, options)
    matches = match_image(rig, raw, options)
    distance = np.hypot(points[0], points[1])
    both_see = _in_volume(design, points) & _lower_sees(rig, world, points)
    predicted = noise.at(distance, contrast_in(rig, raw, options)) * error_per_pixel(rig, distance)
    error = matches.distances_mm / distance - 1.0
    edges = distance_bands(design)
    bands = tuple(
        _judge((float(low), float(high)), both_see & (distance >= low) & (distance < high), matches, error, predicted)
        for low, high in pairwise(edges)
    )
    pair = panoramas(rig, raw)
    return EndToEndCheck(
        configuration=design.configuration,
        scene=world.name,
        texture=texture,
        noise=noise,
        bands=bands,
        rig=rig,
        raw=raw,
        upper=pair["upper"],
        lower=pair["lower"],
        matches=matches,
        true_distance_mm=distance,
        both_see=both_see,
        predicted=predicted,
        relative_error=error,
    )


def definition_of_passing() -> str:
    """What a check demands, in words."""
    return (
        f"passes if, in each of {BANDS} bands of distance with at least {FEWEST_PIXELS} pixels that both views see, of "
        f"which there must be one: at least {100 * LEAST_TEXTURED:g} % of those pixels have texture; the median depth "
        f"error is within {100 * LARGEST_BIAS:g} % of the distance or {LARGEST_BIAS_SIGMAS:g} of the predicted sigma, "
        f"whichever is larger; the robust RMS depth error ({NORMAL_PER_MAD:g} MAD) is {LEAST_ERROR_RATIO:g} to "
        f"{LARGEST_ERROR_RATIO:g} times the prediction, its noise measured on another scene, a ring of textured "
        f"walls, by elevation, distance and local contrast; and at least {100 * LEAST_KEPT:g} % of the textured "
        "pixels are kept"
    )


def describe_check(check: EndToEndCheck) -> str:
    """The check in lines: a row for each band, what was dropped and why, the definition of passing, the verdict."""
    noise = check.noise.summary
    lines = [
        f"{check.configuration}, scene {check.scene}, {check.texture} texture",
        f"noise of an image point, from the calibration scene: {noise['median']:.3f} px "
        f"({noise['least']:.3f} to {noise['largest']:.3f} over elevations and distances)",
        "",
        "distance (mm)    pixels   kept   median error (bound)   robust RMS error   predicted   ratio",
    ]
    for band in check.bands:
        low, high = band.distance_mm
        numbers = (
            f"{100 * band.kept:5.1f} %   {100 * band.bias:+8.3f} % ({100 * band.bias_bound:.2f} %)   "
            f"{100 * band.error:14.3f} %   {100 * band.predicted:7.3f} %   {band.error_ratio:5.2f}"
        )
        words = f"FAILS: {', '.join(band.problems)}" if band.problems else "" if band.is_judged else "too few to judge"
        lines.append(f"{low:6.4g} - {high:<6.4g} {band.pixels:8d}  {numbers}   {words}".rstrip())
    counts = np.bincount(check.matches.outcomes[check.both_see], minlength=len(MatchOutcome))
    dropped = [
        f"{outcome.name.lower().replace('_', ' ')} {100 * counts[outcome] / max(1, counts.sum()):.1f} %"
        for outcome in MatchOutcome
        if outcome != MatchOutcome.KEPT and counts[outcome]
    ]
    lines += ["", f"dropped: {', '.join(dropped) or 'none'}", "", *wrap(definition_of_passing(), 110), ""]
    lines.append("passed" if check.passed else "FAILED")
    return "\n".join(lines)


def summarise_check(check: EndToEndCheck) -> dict[str, Any]:
    """The check's numbers in plain types, for JSON; None for a number that is not there."""
    bands = [
        {key: _number(value) if isinstance(value, float) else value for key, value in asdict(band).items()}
        | {"bias_bound": _number(band.bias_bound), "judged": band.is_judged, "problems": list(band.problems)}
        for band in check.bands
    ]
    return {
        "configuration": check.configuration,
        "scene": check.scene,
        "texture": check.texture,
        "noise_px": {name: _number(value) for name, value in check.noise.summary.items()},
        "bands": bands,
        "definition": definition_of_passing(),
        "passed": check.passed,
    }


def _number(value: float) -> float | None:
    return None if np.isnan(value) else value


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
    imaged = image.is_imaged((z - image.viewpoint_mm) / distance, np.arctan2(y, x))
    known = np.isfinite(distance)
    towards = points[:, known] - np.array([[0.0], [0.0], [image.viewpoint_mm]])
    length = np.linalg.norm(towards, axis=0)
    start = np.broadcast_to(np.array([[0.0], [0.0], [image.viewpoint_mm]]), towards.shape)
    reached = first_surfaces(world, start, towards / length).distance
    clear = np.zeros(distance.shape, dtype=bool)
    clear[known] = reached > length * (1.0 - SAME_POINT)
    return np.asarray(imaged & clear)


def _judge(distances: tuple[float, float], pixels: Mask, matches: Matches, error: Array, predicted: Array) -> Band:
    textured = pixels & (matches.outcomes != MatchOutcome.NO_TEXTURE)
    kept = textured & (matches.outcomes == MatchOutcome.KEPT)
    count = int(textured.sum())
    return Band(
        distance_mm=distances,
        pixels=int(pixels.sum()),
        textured=count,
        kept=float(kept.sum() / count) if count else np.nan,
        bias=float(np.median(error[kept])) if kept.any() else np.nan,
        error=robust_deviation(error[kept]),
        error_ratio=robust_deviation(error[kept] / predicted[kept]),
        predicted=float(np.median(predicted[pixels])) if pixels.any() else np.nan,
    )
