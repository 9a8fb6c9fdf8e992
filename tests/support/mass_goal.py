"""A goal added in the way of docs/contributing.md: one entry, before anything has read the table.

Run as a script it studies some configurations with it and prints what came of them as JSON.
"""

import json
import math
import sys

from designer.evaluate.fabrication import ALUMINIUM_G_PER_MM3
from designer.goals import GOALS, Goal

GOALS["mass"] = Goal(
    label="mass",
    description="of the mirrors, in aluminium",
    column="mass_g",
    unit="g",
    expression=lambda system: sum(
        math.pi * ALUMINIUM_G_PER_MM3 * (mirror.outer_radius**2 - mirror.inner_radius**2) * mirror.thickness
        for mirror in system.layout.mirrors
    ),
    typical_size=lambda sizes: 0.1 * ALUMINIUM_G_PER_MM3 * sizes.diameter**2,
    multiplier_unit="g",
)


def study_of(objective: dict[str, object], names: list[str]) -> dict[str, object]:
    """Rows, best first, the designs' mirrors as the workshop sees them, and the verdict of the report."""
    from designer.evaluate.fabrication import mirror_shape
    from designer.report.content.verdict import verdict
    from designer.report.html.payload import payload_of_study
    from designer.requirement import set_key
    from designer.study.ranking import ranking
    from designer.study.row import frame_of
    from designer.study.study import Study
    from designer.study.task import solve_configuration
    from support.shipped_problems import CONFIGURATIONS, however_blurred, shipped_requirement

    asked = set_key(however_blurred(shipped_requirement("indoor_robot")), "objective", objective)
    results = [solve_configuration(asked, CONFIGURATIONS[name]) for name in names]
    ranked = [results[place] for place in ranking(asked, [result.row for result in results])]
    designs = {result.row.configuration: result.design for result in ranked if result.design is not None}
    study = Study(asked, tuple(result.row for result in ranked), designs)
    return {
        "table": frame_of(result.row for result in ranked).to_csv(index=False),
        "masses_g": {
            name: sum(mirror_shape(design, mirror.name).mass_g for mirror in design.mirrors)
            for name, design in designs.items()
        },
        "scores": {name: dict(design.score) for name, design in designs.items()},
        "verdict": verdict(study),
        "page": payload_of_study(study),
    }


if __name__ == "__main__":
    print(json.dumps(study_of(json.loads(sys.argv[1]), sys.argv[2:])))
