"""A stand-in for the study, so that the command line is tested alone and at once."""

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from recorded_calls import Calls

from designer.design import Design, read_design
from designer.requirement import Requirement
from designer.study.checks import CheckProgress
from designer.study.folder import read_rows
from designer.study.manifest import settle
from designer.study.progress import Progress
from designer.study.study import Study
from support import DATA

DESIGNS = """\
configuration,family,topology,status,reason,depth_error_rms,limit_ratio,baseline_mm,height_mm,diameter_mm
folded-HyPl-Hy-upper_outer,folded,upper_outer,feasible,,0.0123,1.004,100,118.2,61.5
direct-HyHy-upper_outer,direct,upper_outer,infeasible,height_mm exceeded by 71 mm,,,,,
direct-ElEl-upper_outer,direct,upper_outer,impossible,an ellipsoid cannot see its own horizon,,,,,
"""


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    seen = Calls(designs=DESIGNS)

    def run_study(
        requirement: Requirement,
        out_dir: Path,
        *,
        jobs: int,
        progress: Callable[[Progress], None] | None,
    ) -> Study:
        seen.requirements.append(requirement)
        seen.folders.append(out_dir)
        seen.jobs.append(jobs)
        seen.only.append(requirement.solve.configurations)
        (out_dir / "designs.csv").write_text(seen.designs, encoding="utf-8")
        settle(out_dir, ["designs.csv"])
        if progress:
            progress(Progress(1, 2, "direct-HyHy-upper_outer", "infeasible", 0, 1.5, 1.5))
            progress(Progress(2, 2, "folded-HyPl-Hy-upper_outer", "feasible", 1, 3.0, 0.0))
        best = read_design(DATA / "folded_hypl_hy.json").model_copy(update={"score": {"fabrication_notes": seen.notes}})
        rows = read_rows(out_dir)
        ranked = tuple(row.with_values(rank=place) for place, row in enumerate(rows, 1) if row.status == "feasible")
        designs = {row.configuration: best for row in ranked}
        return Study(requirement, (*ranked, *rows[len(ranked) :]), designs, lenses=seen.lenses)

    def write_pdf(study: Study, study_dir: Path, tell: Callable[[str], None] | None, *, jobs: int) -> Path:
        seen.reports.append(study_dir)
        if tell:
            tell("the fonts lack characters of title")
        return study_dir / "study.pdf"

    def write_html(study: Study, study_dir: Path) -> Path:
        seen.pages.append(study_dir)
        return study_dir / "study.html"

    def check_designs(
        designs: list[Design], study_dir: Path, *, jobs: int, progress: Callable[[CheckProgress], None] | None
    ) -> None:
        seen.checks.append([design.configuration for design in designs])
        if progress and designs:
            progress(CheckProgress(1, 1, "folded-HyPl-Hy-upper_outer", True, 12.3))

    for name, functions in (
        ("designer.study.run", (run_study,)),
        ("designer.study.checks", (check_designs, CheckProgress)),
        ("designer.report.document", (write_pdf,)),
        ("designer.report.html.document", (write_html,)),
    ):
        module = ModuleType(name)
        for function in functions:
            setattr(module, function.__name__, function)
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr("designer.study.folder.read_study", lambda folder: None)
    return seen
