"""A point cloud as a PLY file, which MeshLab and CloudCompare open."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from designer.files import write_atomically
from designer.imaging.stereo.reconstruction import PointCloud


def write_ply(path: Path, cloud: PointCloud) -> None:
    """Write a point cloud as binary PLY: position (mm), colour and standard deviations (mm) of each point.

    Raises
    ------
    InputError
        The file cannot be written there.
    """
    floats = ["x", "y", "z", "sigma_distance_mm", "sigma_height_mm", "sigma_across_mm"]
    vertex = np.empty(
        len(cloud.positions_mm),
        dtype=[(name, "<f4") for name in floats[:3]]
        + [(name, "u1") for name in ("red", "green", "blue")]
        + [(name, "<f4") for name in floats[3:]],
    )
    for axis, name in enumerate("xyz"):
        vertex[name] = cloud.positions_mm[:, axis]
    for channel, name in enumerate(("red", "green", "blue")):
        vertex[name] = cloud.colours[:, channel]
    for name in floats[3:]:
        vertex[name] = getattr(cloud, name)
    types = {"<f4": "float", "|u1": "uchar"}
    names = vertex.dtype.names or ()
    properties = [f"property {types[vertex.dtype[name].str]} {name}" for name in names]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        "comment millimetres, origin at the camera's pinhole, z along the optical axis",
        f"element vertex {len(vertex)}",
        *properties,
        "end_header",
    ]
    write_atomically(path, "\n".join(header).encode("ascii") + b"\n" + vertex.tobytes())
