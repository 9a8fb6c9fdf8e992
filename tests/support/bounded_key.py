"""A key with a bound, added to a copy of the code as docs/contributing.md says: its snippets and nothing else.

Run as a script, with the copy first on the path, it prints what became of the key as JSON.
"""

import json
import re
import shutil
from pathlib import Path

from support import ROOT

KEY = "envelope.lowest_viewpoint_mm"
CONFIGURATION = "folded-HyPl-Hy-upper_outer"
LOOSE_MM, STEP_MM = -500.0, 0.01


def copy_with_key(folder: Path) -> list[str]:
    """Write the designer into a folder with the recipes' key and constraint; the files that differ from ours."""
    snippets = re.findall(r"```python\n(.*?)```", (ROOT / "docs/contributing.md").read_text(), re.DOTALL)
    (constraint,) = (snippet for snippet in snippets if "def viewpoint_constraints" in snippet)
    (field,) = (snippet for snippet in snippets if "lowest_viewpoint_mm: Annotated" in snippet)
    shutil.copytree(ROOT / "designer", folder / "designer", ignore=shutil.ignore_patterns("__pycache__"))
    edits = {
        "requirement/space.py": [("    height_mm: Annotated[\n", field)],
        "optimise/constraints.py": [
            ("CONSTRAINTS: tuple[", constraint + "\n\n"),
            (')\n"""Every builder', "    viewpoint_constraints,\n"),
        ],
    }
    for name, changes in edits.items():
        path = folder / "designer" / name
        text = path.read_text()
        for place, added in changes:
            assert text.count(place) == 1, (name, place)
            text = text.replace(place, added + place)
        path.write_text(text)
    return sorted(edits)


def held_by_the_key() -> dict[str, object]:
    """A search without a bound and one that the key holds, its multiplier, and a finite difference of searches."""
    from designer.files import InputError
    from designer.optimise.multipliers import first_stage_multipliers
    from designer.optimise.search import search
    from designer.report.content.requirement import requirement_groups
    from designer.requirement import set_key
    from support.shipped_problems import CONFIGURATIONS, however_blurred, shipped_requirement

    free = set_key(however_blurred(shipped_requirement("indoor_robot")), "solve.starts", 3)
    configuration = CONFIGURATIONS[CONFIGURATION]
    loose = set_key(free, KEY, LOOSE_MM)
    unbound = search(loose, configuration).first
    least_mm = round(float(unbound.values["lower_viewpoint"]) + 2.0, 2)
    asked = set_key(free, KEY, least_mm)
    found = search(asked, configuration)

    def least_error(value: float) -> float:
        return search(set_key(free, KEY, value), configuration, found.warm_starts).first.goals["depth_error"]

    try:
        set_key(free, KEY, 5000.0)
        refused = ""
    except InputError as error:
        refused = str(error)
    slopes = first_stage_multipliers(asked, found.first)
    return {
        "least_mm": least_mm,
        "viewpoint_mm": float(found.first.values["lower_viewpoint"]),
        "unbound_multiplier": first_stage_multipliers(loose, unbound)[KEY],
        "multiplier": slopes[KEY],
        "finite_difference": (least_error(least_mm + STEP_MM) - least_error(least_mm - STEP_MM)) / (2.0 * STEP_MM),
        "facts": dict(requirement_groups(asked))["Envelope"],
        "refused": refused,
    }


if __name__ == "__main__":
    print(json.dumps(held_by_the_key()))
