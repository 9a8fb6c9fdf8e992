"""What the commands do, in a few Python calls: for notebooks and scripts.

A study and a sweep are held as tables (pandas) with designs behind them; results and drawings show themselves in a
notebook.

Examples
--------
>>> from designer import api
>>> requirement = api.requirement("configs/indoor_robot.toml", envelope__height_mm=150)
>>> requirement.envelope.height_mm
150.0
>>> len(api.configurations())
44
"""

from designer.api.calibration import calibrate, target
from designer.api.designs import Evaluation, evaluate, export, order, read_design, trace, trace_rays, write_design
from designer.api.drawings import (
    Drawing,
    draw_cross_section,
    draw_depth_error,
    draw_depth_map,
    draw_equalisation,
    draw_floor_plan,
    draw_folded_principle,
    draw_image_layout,
    draw_kernels,
    draw_panoramas,
    draw_point_cloud,
    draw_raw,
    draw_resolution,
    draw_single_mirror_principles,
    draw_virtual_images,
    draw_winner_map,
)
from designer.api.images import (
    check,
    compare_equalisation,
    find_center,
    find_centers,
    placement,
    point_cloud,
    read_placement,
    reconstruct,
    render,
    stereo_rig,
    view_placements,
    write_image,
    write_placement,
    write_point_cloud,
)
from designer.api.studies import (
    StudyResult,
    SweepResult,
    certify,
    compare,
    configurations,
    multipliers,
    read_sweep_folder,
    requirement,
    study,
    sweep,
)
from designer.api.tolerances import built_sensor, tolerance
from designer.files import InputError

__all__ = [
    "Drawing",
    "Evaluation",
    "InputError",
    "StudyResult",
    "SweepResult",
    "built_sensor",
    "calibrate",
    "certify",
    "check",
    "compare",
    "compare_equalisation",
    "configurations",
    "draw_cross_section",
    "draw_depth_error",
    "draw_depth_map",
    "draw_equalisation",
    "draw_floor_plan",
    "draw_folded_principle",
    "draw_image_layout",
    "draw_kernels",
    "draw_panoramas",
    "draw_point_cloud",
    "draw_raw",
    "draw_resolution",
    "draw_single_mirror_principles",
    "draw_virtual_images",
    "draw_winner_map",
    "evaluate",
    "export",
    "find_center",
    "find_centers",
    "multipliers",
    "order",
    "placement",
    "point_cloud",
    "read_design",
    "read_placement",
    "read_sweep_folder",
    "reconstruct",
    "render",
    "requirement",
    "stereo_rig",
    "study",
    "sweep",
    "target",
    "tolerance",
    "trace",
    "trace_rays",
    "view_placements",
    "write_design",
    "write_image",
    "write_placement",
    "write_point_cloud",
]
