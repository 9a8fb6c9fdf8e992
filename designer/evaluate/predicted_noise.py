"""The noise of a match as the depth error takes it: predicted from lens, light and texture wherever a point lies.

:mod:`designer.evaluate.noise` says how precisely a point can be matched where its blur is known; here the blur follows
from the mirrors and the focus. Floats, NumPy arrays or CasADi symbols; lengths in mm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from designer.design import PerView, ViewName
from designer.evaluate.depth import NoiseModel, StereoPair
from designer.evaluate.noise import (
    CameraSetting,
    CollectedLight,
    ImagePoint,
    MatcherPerformance,
    SurfaceSeen,
    TextureSpectrum,
    matching_noise,
    seen_on_surface,
)
from designer.optics.backend import Scalar, sqrt
from designer.optics.focus import FocusedLens, LightPath, chief_ray, reciprocal_along_ray, reciprocal_image_depth
from designer.optics.illumination import relative_illumination
from designer.optics.view import half_angle_tangent, image_radius, image_radius_slope

REFLECTIONS = {"direct": 1, "folded": 2}
# Wavelengths of the texture that is matched, as shares of the farthest distance.
FINEST_TEXTURE, COARSEST_TEXTURE = 0.8e-3, 0.2


@dataclass(frozen=True, slots=True)
class Conditions:
    """What a noise is predicted for, beside the design: camera, light, texture, and the matcher.

    ``constant`` is a standard deviation in mm on the sensor that counts whatever the lens does; with a
    ``predicted_share`` of 0 it is all there is, with 1 the prediction is added to it in quadrature. (A share that is a
    symbol may become either.)
    """

    constant: Scalar
    predicted_share: Scalar
    pixel_pitch: Scalar
    wavelength: Scalar
    mirror_reflectivity: Scalar
    texture: TextureSpectrum
    light: CollectedLight
    matching: MatcherPerformance


def noise_model(
    conditions: Conditions, pair: StereoPair, lens: FocusedLens, light: Mapping[ViewName, LightPath]
) -> Scalar | NoiseModel:
    """The noise of a match at any point, through a lens: a function of the slopes in both views and the distance.

    Parameters
    ----------
    pair
        The two views.
    lens
        The lens, focused and stopped down.
    light
        What focusing needs of each view, by its name.
    """

    def defocus(view: ViewName, slope: Scalar, distance: Scalar) -> Scalar:
        ray = chief_ray(light[view], slope)
        return lens.blur(reciprocal_image_depth(ray, reciprocal_along_ray(slope, distance)))

    return _noise_model(conditions, pair, lens.f_number, defocus)


def sharp_noise_model(conditions: Conditions, pair: StereoPair, f_number: Scalar) -> Scalar | NoiseModel:
    """The same with every point in focus: what no mirrors can better at that f-number."""
    return _noise_model(conditions, pair, f_number, lambda view, slope, distance: 0.0)


def seen_through(
    conditions: Conditions, pair: StereoPair, lens: FocusedLens, light: Mapping[ViewName, LightPath]
) -> Callable[[PerView[Scalar], Scalar], SurfaceSeen]:
    """What the noise of :func:`noise_model` is predicted from, at the slopes in both views and a distance."""

    def defocus(view: ViewName, slope: Scalar, distance: Scalar) -> Scalar:
        ray = chief_ray(light[view], slope)
        return lens.blur(reciprocal_image_depth(ray, reciprocal_along_ray(slope, distance)))

    exposure, points_at = _imaging(conditions, pair, lens.f_number, defocus)

    def seen_at(slopes: PerView[Scalar], distance: Scalar) -> SurfaceSeen:
        return seen_on_surface(points_at(slopes, distance), distance, conditions.light, exposure, conditions.matching)

    return seen_at


def _imaging(
    conditions: Conditions, pair: StereoPair, f_number: Scalar, defocus: Callable[[ViewName, Scalar, Scalar], Scalar]
) -> tuple[CameraSetting, Callable[[PerView[Scalar], Scalar], PerView[ImagePoint]]]:
    """The camera's setting, and where and how both views image a point at their slopes and a distance."""
    views = {
        "lower": (pair.gain_lower, pair.sense_lower),
        "upper": (pair.gain_upper, pair.sense_upper),
    }

    def image_point(view: ViewName, slope: Scalar, distance: Scalar) -> ImagePoint:
        gain, sense = views[view]
        law = pair.law
        radius = image_radius(slope, gain, pair.principal_distance, sense, law)
        flat = radius if law.is_perspective else image_radius(slope, gain, pair.principal_distance, sense)
        tangent = flat / pair.principal_distance
        cosine = 1.0 / sqrt(1.0 + tangent * tangent)
        along, across = law.stretch(gain * half_angle_tangent(slope, sense))
        return ImagePoint(
            slope,
            radius,
            image_radius_slope(slope, gain, pair.principal_distance, sense, law),
            defocus(view, slope, distance),
            relative_illumination(cosine, REFLECTIONS[sense], conditions.mirror_reflectivity, along * across),
            None if law.is_perspective else (along, across),
        )

    def points_at(slopes: PerView[Scalar], distance: Scalar) -> PerView[ImagePoint]:
        return PerView(
            upper=image_point("upper", slopes.upper, distance),
            lower=image_point("lower", slopes.lower, distance),
        )

    return CameraSetting(conditions.pixel_pitch, f_number, wavelength=conditions.wavelength), points_at


def _noise_model(
    conditions: Conditions, pair: StereoPair, f_number: Scalar, defocus: Callable[[ViewName, Scalar, Scalar], Scalar]
) -> Scalar | NoiseModel:
    if isinstance(conditions.predicted_share, float) and conditions.predicted_share == 0.0:
        return conditions.constant
    exposure, points_at = _imaging(conditions, pair, f_number, defocus)

    def noise_at(slopes: PerView[Scalar], distance: Scalar) -> PerView[Scalar]:
        matched = matching_noise(
            points_at(slopes, distance),
            distance,
            conditions.texture,
            conditions.light,
            exposure,
            conditions.matching,
        )
        floor = conditions.constant * conditions.constant
        share = conditions.predicted_share
        return PerView(
            lower=sqrt(floor + share * matched.lower * matched.lower),
            upper=sqrt(floor + share * matched.upper * matched.upper),
        )

    return noise_at
