"""Bundle adjustment: the sensor and the poses of all targets at once, from the images of known points.

The cost is that of independent Gaussian errors of image points, of one standard deviation in each view, which is
estimated, and of the priors on the departures. Beyond ``HUBER`` standard deviations an image point counts linearly
(Huber), so that a few wrong ones do no harm. The pose of a target moves its own points only; derivatives are exact.
Light does not fall exactly where its chief ray does, and neighbouring corners share that, so each sighting has a common
shift of its image, of standard deviation ``SHIFT_PX``.
The covariance is the inverse of the Gauss-Newton Hessian of this cost at its minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy.optimize import least_squares

from designer.as_built.dual import Array
from designer.calibration.images import UNSEEN_PX, PointImages, point_images
from designer.calibration.target_pose import NUMBERS, TargetPose, point_slopes, varied
from designer.calibration.unknowns import Unknowns
from designer.design import VIEW_NAMES, Design, ViewName

HUBER = 2.5
# Of single corners, and of all corners of a sighting alike: renders through real lenses (benchmarks) show 0.01.
LEAST_NOISE_PX, SHIFT_PX = 0.01, 0.01
MOST_ROUNDS = 10
NOISE_SETTLED, NOISE_ROUGH = 0.05, 0.5
# A median absolute deviation of a Gaussian is so much of its standard deviation.
MEDIAN_OF_SIGMA = 0.6744897501960817
TOLERANCE, ROUGH_TOLERANCE = 1e-8, 1e-2
# Priors, then radians and mm of a pose.
FIRST_STEP, POSE_STEP = 10.0, (1.0, 1.0, 1.0, 1000.0, 1000.0, 1000.0)


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """The points of one target in one view of one image: ``points_mm`` (n, 3) on it, ``pixels`` (n, 2) of (u, v)."""

    target: int
    view: ViewName
    points_mm: Array
    pixels: Array


@dataclass(frozen=True, slots=True, eq=False)
class Adjusted:
    """The sensor and the poses that explain the images best.

    ``values`` (parameters,) are departures, image shift last; ``covariance`` is theirs, zero where not free, whatever
    the poses are; ``information`` (parameters, parameters) what the images alone say of them, whatever the poses are.
    ``noise_px`` is the standard deviation of a coordinate of an image point. ``residuals_px`` holds measured minus
    predicted (n, 2) for each sighting.
    """

    values: Array
    covariance: Array
    information: Array
    poses: tuple[TargetPose, ...]
    noise_px: dict[ViewName, float]
    residuals_px: tuple[Array, ...]


def adjust(
    design: Design,
    unknowns: Unknowns,
    sightings: Sequence[Sighting],
    poses: Sequence[TargetPose],
    noise_px: float | None = None,
) -> Adjusted:
    """Find the departures and poses by least squares from first guesses of the poses.

    Parameters
    ----------
    noise_px
        Standard deviation of a coordinate of an image point; estimated from the residuals, for each view, if not given.
    """
    problem = BundleProblem(design, unknowns, tuple(sightings), tuple(poses))
    at, tolerance = np.zeros(problem.number), ROUGH_TOLERANCE
    # From the residuals of the first guess on, so that Huber's loss does not take all points for wrong ones.
    noise = problem.estimated_noise(at)
    for _ in range(MOST_ROUNDS):
        problem.noise_px = noise
        found: Any = least_squares(
            problem.residuals, at, problem.jacobian, method="trf", x_scale=problem.scale, loss=cast(Any, problem.loss),
            ftol=tolerance, xtol=tolerance, gtol=tolerance, max_nfev=60,
        )  # fmt: skip
        at = found.x
        estimated = dict.fromkeys(VIEW_NAMES, noise_px) if noise_px else problem.estimated_noise(at)
        change = max(abs(estimated[view] / noise[view] - 1.0) for view in VIEW_NAMES)
        if change < NOISE_SETTLED and tolerance == TOLERANCE:
            break
        tolerance = ROUGH_TOLERANCE if change > 1.0 - NOISE_ROUGH else TOLERANCE
        noise = estimated
    return problem.result(at, found.jac)


class BundleProblem:
    """The least squares problem as scipy asks for it: residuals and their derivatives share one trace."""

    def __init__(
        self, design: Design, unknowns: Unknowns, sightings: tuple[Sighting, ...], poses: tuple[TargetPose, ...]
    ) -> None:
        self.design, self.unknowns, self.sightings, self.poses = design, unknowns, sightings, poses
        self.free = np.flatnonzero(unknowns.free)
        self.first_shift = len(self.free) + NUMBERS * len(poses)
        self.number = self.first_shift + 2 * len(sightings)
        self.data = 2 * sum(len(sighting.pixels) for sighting in sightings)
        self.noise_px: dict[ViewName, float] = {}
        free_prior = unknowns.prior[np.ix_(self.free, self.free)]
        # Departures times this are independent, of standard deviation 1.
        self.whitening = np.linalg.inv(np.linalg.cholesky(free_prior))
        # The first step may be as long as one of these in each: the solver's own scales start too small from zero.
        self.scale = np.concatenate(
            [
                FIRST_STEP * unknowns.prior_sigma[self.free],
                np.tile(POSE_STEP, len(poses)),
                np.full(2 * len(sightings), FIRST_STEP * SHIFT_PX),
            ]
        )
        self._at: Array | None = None
        self._images: list[PointImages] = []

    def values(self, at: Array) -> Array:
        """Departures (parameters,) of the unknowns ``at``."""
        values = np.zeros(len(self.unknowns.parameters))
        values[self.free] = at[: len(self.free)]
        return values

    def variation(self, at: Array, target: int) -> Array:
        """How the pose of a target differs from its first guess."""
        start = len(self.free) + NUMBERS * target
        return at[start : start + NUMBERS]

    def shifts(self, at: Array) -> Array:
        """The common shift in px of each sighting, (sightings, 2)."""
        return at[self.first_shift :].reshape(-1, 2)

    def residuals(self, at: Array) -> Array:
        """Predicted minus measured image points, then departures and shifts, in standard deviations."""
        images = self._trace(at)
        parts = [
            np.nan_to_num(image.pixels + shift - sighting.pixels, nan=UNSEEN_PX).ravel() / self.noise_px[sighting.view]
            for sighting, image, shift in zip(self.sightings, images, self.shifts(at), strict=True)
        ]
        return np.concatenate([*parts, self.whitening @ at[: len(self.free)], at[self.first_shift :] / SHIFT_PX])

    def jacobian(self, at: Array) -> Array:
        """Derivatives (residuals, unknowns) of the residuals."""
        images = self._trace(at)
        shifts = self.number - self.first_shift
        jacobian = np.zeros((self.data + len(self.free) + shifts, self.number))
        row = 0
        for place, (sighting, image) in enumerate(zip(self.sightings, images, strict=True)):
            rows = slice(row, row + 2 * len(sighting.pixels))
            row = rows.stop
            noise, start = self.noise_px[sighting.view], len(self.free) + NUMBERS * sighting.target
            by_departure = np.nan_to_num(image.by_departure)[:, :, self.free]
            jacobian[rows, : len(self.free)] = by_departure.reshape(-1, len(self.free)) / noise
            moved = point_slopes(self.poses[sighting.target], self.variation(at, sighting.target), sighting.points_mm)
            by_pose = np.nan_to_num(image.by_point) @ moved
            jacobian[rows, start : start + NUMBERS] = by_pose.reshape(-1, NUMBERS) / noise
            shift = self.first_shift + 2 * place
            jacobian[rows, shift : shift + 2] = np.tile(np.eye(2), (len(sighting.pixels), 1)) / noise
        jacobian[self.data : self.data + len(self.free), : len(self.free)] = self.whitening
        jacobian[-shifts:, self.first_shift :] = np.eye(shifts) / SHIFT_PX
        return jacobian

    def loss(self, squared: Array) -> Array:
        """Huber's loss for image points, and none for the priors: value, first and second derivative."""
        rho = np.stack([squared, np.ones_like(squared), np.zeros_like(squared)])
        far = np.flatnonzero(squared[: self.data] > HUBER**2)
        beyond = squared[far]
        rho[:, far] = [2.0 * HUBER * np.sqrt(beyond) - HUBER**2, HUBER / np.sqrt(beyond), -HUBER / (2.0 * beyond**1.5)]
        return rho

    def estimated_noise(self, at: Array) -> dict[ViewName, float]:
        """Robust standard deviation of the residuals in each view, for the numbers that were fitted to them."""
        spent = np.sqrt(self.data / max(self.data - self.number, 1))
        noise = {}
        for view in VIEW_NAMES:
            parts = [
                (image.pixels + shift - sighting.pixels).ravel()
                for sighting, image, shift in zip(self.sightings, self._trace(at), self.shifts(at), strict=True)
                if sighting.view == view
            ]
            median = float(np.nanmedian(np.abs(np.concatenate(parts)))) if parts else 0.0
            noise[view] = max(float(median / MEDIAN_OF_SIGMA * spent), LEAST_NOISE_PX)
        return noise

    def result(self, at: Array, jacobian: Array) -> Adjusted:
        """What was found, from the derivatives of the residuals as the loss weights them."""
        count = len(self.free)
        covariance = np.zeros((len(self.unknowns.parameters),) * 2)
        information = np.zeros_like(covariance)
        # All but the priors of the departures.
        of_data = np.delete(jacobian, slice(self.data, self.data + count), axis=0)
        hessian = of_data.T @ of_data
        of_departures, mixed, of_others = hessian[:count, :count], hessian[:count, count:], hessian[count:, count:]
        told = of_departures - mixed @ np.linalg.solve(of_others, mixed.T)
        here = np.ix_(self.free, self.free)
        information[here] = (told + told.T) / 2.0
        # In units of the prior, so that all numbers are of a size.
        unit = np.linalg.inv(self.whitening)
        covariance[here] = unit @ np.linalg.inv(unit.T @ information[here] @ unit + np.eye(count)) @ unit.T
        return Adjusted(
            values=self.values(at),
            covariance=covariance,
            information=information,
            poses=tuple(varied(pose, self.variation(at, target)) for target, pose in enumerate(self.poses)),
            noise_px=self.noise_px,
            residuals_px=tuple(
                sighting.pixels - image.pixels for sighting, image in zip(self.sightings, self._trace(at), strict=True)
            ),
        )

    def _trace(self, at: Array) -> list[PointImages]:
        """Images of all points, traced once for each place; the points of a view go together."""
        if self._at is not None and np.array_equal(at, self._at):
            return self._images
        values = self.values(at)
        images: list[PointImages | None] = [None] * len(self.sightings)
        for view in VIEW_NAMES:
            here = [place for place, sighting in enumerate(self.sightings) if sighting.view == view]
            if not here:
                continue
            points = [
                varied(self.poses[sighting.target], self.variation(at, sighting.target)).points(sighting.points_mm)
                for sighting in (self.sightings[place] for place in here)
            ]
            before = np.concatenate([self._images[place].slopes for place in here], axis=1) if self._images else None
            found = point_images(self.design, view, np.concatenate(points), values, before)
            ends = np.cumsum([len(part) for part in points])[:-1]
            for place, pixels, by_departure, by_point, slopes in zip(
                here,
                np.split(found.pixels, ends),
                np.split(found.by_departure, ends),
                np.split(found.by_point, ends),
                np.split(found.slopes, ends, axis=1),
                strict=True,
            ):
                images[place] = PointImages(pixels, by_departure, by_point, slopes)
        self._at, self._images = at.copy(), [image for image in images if image is not None]
        return self._images
