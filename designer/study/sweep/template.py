"""The commented sweep that ``designer init --sweep`` writes."""

from __future__ import annotations

import json
import os
from pathlib import Path

from designer.requirement import read_requirement

_TEMPLATE = """\
# A sweep: every configuration for every combination of the values below. Run it with: designer sweep THIS_FILE
# Any numeric key of the requirement can be an axis, by its dotted name; a number selects from a list or a range.

requirement = {requirement}  # relative to this file
plan = "grid"  # or "latin_hypercube", with points = 100 and axes of low and high only

# Each point starts from its neighbours' designs. start is where the search begins: the loosest value saves time.
[[axis]]
key = "envelope.height_mm"
values = [{heights}]
start = {start}

# Instead of values, an axis can have low, high and count, and spacing = "logarithmic".
[[axis]]
key = "baseline_mm"
low = {shortest}
high = {longest}
count = 3
"""


def sweep_template(requirement: Path, folder: Path) -> str:
    """A valid sweep in TOML over a requirement's height and baseline, each key explained, for a person to change.

    Parameters
    ----------
    requirement
        The base requirement's file.
    folder
        Where the sweep's file will stand.

    Raises
    ------
    InputError
        The requirement cannot be used.
    """
    base = read_requirement(requirement)
    heights = [share * base.envelope.height_mm for share in (1.0, 1.1, 1.2)]
    least, greatest = base.baseline_range_mm
    shortest, longest = (0.9 * least, 1.1 * least) if least == greatest else (least, greatest)
    return _TEMPLATE.format(
        requirement=json.dumps(os.path.relpath(requirement, folder), ensure_ascii=False),
        heights=", ".join(f"{height:.6g}" for height in heights),
        start=f"{heights[-1]:.6g}",
        shortest=f"{shortest:.6g}",
        longest=f"{longest:.6g}",
    )
