"""A ray through Jaramillo's folding pair: python -m validation.others.rayoptics_rays, with rayoptics installed.

Its conic profile and its reflection, in the frame of optiland_rays.py: pinhole at the origin, z up, mm.
"""

import importlib.metadata

import numpy as np
from rayoptics.elem.profiles import Conic
from rayoptics.raytr.raytrace import reflect

start, ahead = np.array([0.2, -0.3, 0.0]), np.array([-0.02, 0.12, 1.0])
ahead /= np.linalg.norm(ahead)
# The fold plane, curvature 0, then the primary; intersections are in each surface's own frame.
for vertex, profile, side in (
    (116.842, Conic(c=0.0, cc=0.0), 1.0),
    (5.0002, Conic(c=1 / -27.83526, cc=-1.258254), -1.0),
):
    lift = np.array([0.0, 0.0, vertex])
    # Its search starts at the plane of the vertex.
    near = start - lift + (vertex - start[2]) / ahead[2] * ahead
    _, point = profile.intersect(near, ahead, 1e-13, side)
    ahead = reflect(ahead, profile.normal(point))
    start = point + lift
met = start + (1500.0 - start[1]) / ahead[1] * ahead
print("rayoptics", importlib.metadata.version("rayoptics"))
print(f"skew_x {met[0]:.10f}\nskew_z {met[2]:.10f}")
