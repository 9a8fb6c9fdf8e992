"""Raw images of an analytic room, straight from the gain law: each pixel back to its viewpoint's ray and on to a wall.

The room's wall stands upright at the distance ``wall(azimuth)`` from the axis, so every ray meets it in closed form
and the true distance of every panorama pixel is known without any rendering.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from designer.design import Design
from designer.imaging.stereo.panorama import view_images
from designer.imaging.stereo.placement import Placement

Wall = Callable[[np.ndarray], np.ndarray]
Texture = Callable[[np.ndarray, np.ndarray], np.ndarray]


def eccentric_wall(mean_mm: float, swing: float) -> Wall:
    """A wall whose inverse distance swings once around the sensor: smooth across the seam at 180 degrees."""
    return lambda azimuth: mean_mm / (1.0 + swing * np.cos(azimuth - 2.8))


@dataclass(frozen=True)
class Waves:
    """A band-limited random texture over azimuth and height in units of the wall's distance: grey levels 0 to 255."""

    seed: int = 0
    count: int = 250
    finest_deg: float = 0.8
    coarsest_deg: float = 12.0

    def __call__(self, azimuth: np.ndarray, height: np.ndarray) -> np.ndarray:
        rng = np.random.default_rng(self.seed)
        wavelengths = np.radians(np.exp(rng.uniform(np.log(self.finest_deg), np.log(self.coarsest_deg), self.count)))
        directions = rng.uniform(0, np.pi, self.count)
        # Whole periods around the circle, so that the texture has no seam.
        around = np.rint(2 * np.pi * np.cos(directions) / wavelengths / (2 * np.pi))
        upwards = 2 * np.pi * np.sin(directions) / wavelengths
        total = np.zeros(azimuth.shape, np.float32)
        azimuth, height = azimuth.astype(np.float32), height.astype(np.float32)
        for a, h, phase in zip(around, upwards, rng.uniform(0, 2 * np.pi, self.count), strict=True):
            total += np.cos(np.float32(a) * azimuth + np.float32(h) * height + np.float32(phase))
        return 127.5 + 40.0 * total / np.sqrt(self.count / 2)


def raw_image(
    design: Design,
    wall: Wall,
    texture: Texture,
    placement: Placement | None = None,
    noise: float = 0.0,
    seed: int = 0,
) -> np.ndarray:
    """The raw image, sampled at pixel centres; dark where neither view's asked elevations (and 3 pixels more) lie."""
    camera = design.camera
    v, u = np.mgrid[0 : camera.height_px, 0 : camera.width_px]
    raw = np.zeros(u.shape, np.float32)
    for image in view_images(design, placement).values():
        with np.errstate(divide="ignore", invalid="ignore"):  # a pixel on the axis sees straight up or down
            slope, azimuth = image.direction_of(u, v)
            radius = np.abs(image.radius_px(slope))
        ends = np.sort(np.abs(image.radius_px(np.array(image.slopes))))
        seen = (radius > ends[0] - 3) & (radius < ends[1] + 3)
        distance = wall(azimuth[seen])
        height = image.viewpoint_mm + distance * slope[seen]
        raw[seen] = texture(azimuth[seen], height / distance)
    if noise:
        raw += np.random.default_rng(seed).normal(0, noise, raw.shape)
    return np.clip(np.rint(raw), 0, 255).astype(np.uint8)
