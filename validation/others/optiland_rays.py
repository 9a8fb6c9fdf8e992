"""Rays through Jaramillo's folding pair: python -m validation.others.optiland_rays, with optiland installed.

The pinhole is the origin, z up. Fold plane at z = 116.842; primary with vertex 5.0002, radius -27.83526 and conic
constant -1.258254; wall y = 1500. All in mm.
"""

import importlib.metadata

import numpy as np
from optiland.coordinate_system import CoordinateSystem
from optiland.geometries import Plane, StandardGeometry
from optiland.rays import RealRays


def traced(starts: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Where rays (n, 3) meet the wall."""
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    ones = np.ones(len(starts))
    columns = (np.ascontiguousarray(column) for column in (*starts.T, *directions.T))
    rays = RealRays(*columns, ones, 0.55 * ones)
    secondary = Plane(CoordinateSystem(z=116.842))
    primary = StandardGeometry(CoordinateSystem(z=5.0002), radius=-27.83526, conic=-1.258254)
    for geometry in (secondary, primary):
        geometry.localize(rays)
        length = geometry.distance(rays)
        rays.x, rays.y, rays.z = rays.x + length * rays.L, rays.y + length * rays.M, rays.z + length * rays.N
        rays.reflect(*geometry.surface_normal(rays))
        geometry.globalize(rays)
    length = (1500.0 - rays.y) / rays.M
    return np.stack([rays.x + length * rays.L, rays.y + length * rays.M, rays.z + length * rays.N], axis=-1)


print("optiland", importlib.metadata.version("optiland"))
skew = traced(np.array([[0.4, 0.3, 0.0]]), np.array([[0.01, 0.1, 1.0]]))[0]
print(f"skew_x {skew[0]:.10f}\nskew_z {skew[2]:.10f}")
angles, radii = np.meshgrid(np.arange(8) * np.pi / 4.0, [0.25, 0.5, 0.75])
places = np.stack([(radii * np.cos(angles)).ravel(), (radii * np.sin(angles)).ravel(), np.zeros(24)], axis=-1)
spot = traced(places, np.tile([0.0, 0.1, 1.0], (24, 1)))
print(f"spot_rms {np.sqrt(((spot - spot.mean(axis=0)) ** 2).sum(axis=1).mean()):.10f}")
