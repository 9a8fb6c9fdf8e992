"""Volume of a mirror's shell as a mesh of trimesh: python -m validation.others.solid_volume.

Jaramillo's primary: radius -27.83526, conic constant -1.258254, from 3.392 to 37 mm from the axis, 2 mm thick along
the axis. Meshes of n meridians and n rings; the last line is their limit for errors in 1 / n^2.
"""

import numpy as np
import trimesh


def height(radius: np.ndarray) -> np.ndarray:
    c, k = 1.0 / -27.83526, 1.0 - 1.258254
    return c * radius**2 / (1.0 + np.sqrt(1.0 - k * (c * radius) ** 2))


def volume(count: int) -> float:
    radii = np.linspace(3.392, 37.0, count)
    face = np.column_stack([radii, height(radii)])
    section = np.concatenate([face[::-1], face - np.array([0.0, 2.0]), face[-1:]])
    return abs(float(trimesh.creation.revolve(section, sections=count).volume))


print("trimesh", trimesh.__version__)
volumes = [volume(count) for count in (256, 512, 1024)]
for value in volumes:
    print(f"{value:.6f}")
print(f"limit {volumes[2] + (volumes[2] - volumes[1]) / 3.0:.4f}")
