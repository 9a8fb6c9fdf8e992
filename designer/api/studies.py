"""Studies and sweeps: from a requirement to tables and designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from designer.extras import require_extra
from designer.files import InputError
from designer.notebook_html import html_table
from designer.requirement import Requirement, read_requirement, set_key

if TYPE_CHECKING:
    import pandas as pd

    from designer.design import Design
    from designer.study.compare import StudyComparison

SHOWN_ROWS = 10


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class StudyResult:
    """A study: its requirement, its table (a row for each configuration, best first), its designs by name.

    ``lenses`` tells what each lens of a catalogue gives: a row for each configuration and lens, none with one lens.
    ``comparators`` tells what else could be built, a row for each idea, none unless asked for.
    """

    requirement: Requirement
    table: pd.DataFrame
    designs: dict[str, Design]
    lenses: pd.DataFrame
    comparators: pd.DataFrame

    @property
    def best(self) -> Design | None:
        """The winner; None if nothing is feasible."""
        return next(iter(self.designs.values()), None)

    def _repr_html_(self) -> str:
        from designer.study.columns import SCORE_COLUMNS

        title = f"{self.requirement.title}: {len(self.designs)} of {len(self.table)} configurations feasible"
        return _shown(title, self.table, ["configuration", "status", *SCORE_COLUMNS])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SweepResult:
    """A sweep's folder, its table (a row for each requirement and configuration) and its winners."""

    folder: Path
    table: pd.DataFrame
    winners: pd.DataFrame

    @property
    def axes(self) -> list[str]:
        """The columns of the table that say what was swept."""
        return [name for name in map(str, self.table.columns) if name.startswith("asked.")]

    def design(self, point: int, configuration: str | None = None) -> Design:
        """The design of a configuration at a point, of the winner if none is named."""
        from designer.study.sweep.designs import design_at

        self._check_points([point])
        if configuration is None:
            found = self.winners[self.winners["point"] == point]["configuration"]
            if found.empty:
                raise InputError(f"{self.folder}: no feasible design at point {point}")
            configuration = str(found.iloc[0])
        return design_at(self.folder, point, configuration)

    def sensitivities(self, points: list[int] | None = None) -> pd.DataFrame:
        """What one more unit of each key is worth to the winners, from the first stage's multipliers.

        Millimetres, degrees and pixels, as the keys say; of a given f-number, one stop (a factor of the root of two).
        Points where nothing is feasible are left out.

        Raises
        ------
        InputError
            The sweep has no such point.
        """
        from designer.study.sweep.designs import multipliers_of_designs

        self._check_points(points or [])
        chosen = self.winners if points is None else self.winners[self.winners["point"].isin(points)]
        pairs = zip(chosen["point"], chosen["configuration"], strict=True)
        return multipliers_of_designs(self.folder, [(int(point), str(name)) for point, name in pairs])

    def _check_points(self, points: list[int]) -> None:
        for point in points:
            if not (self.table["point"] == point).any():
                raise InputError(f"{self.folder}: the sweep has no point {point}, or has not reached it yet")

    def front(self, columns: tuple[str, ...] = ("depth_error_rms", "height_mm", "diameter_mm")) -> pd.DataFrame:
        """The designs that no other beats in all the columns at once."""
        from designer.study.sweep.tables import pareto

        return pareto(self.table[self.table["status"] == "feasible"], columns)

    def explore(self, most: int = 40) -> Any:
        """The front as an interactive figure (plotly): hover says what a design is, a slider shows its cross-section.

        Of a longer front ``most`` designs are shown, spread over it by depth error.

        Raises
        ------
        InputError
            Plotly is not installed, or nothing is feasible.
        """
        import numpy as np

        require_extra("report", "the interactive front")
        require_extra("notebooks", "the interactive front")
        from designer.report.figures.sweep_explorer import draw_explorer

        front = self.front()
        if front.empty:
            raise InputError(f"{self.folder}: this sweep has no feasible design, so there is no front")
        shown = front.iloc[np.linspace(0, len(front) - 1, min(most, len(front))).round().astype(int)]
        pairs = zip(shown["point"], shown["configuration"], strict=True)
        return draw_explorer(shown, [self.design(int(point), str(name)) for point, name in pairs])

    def _repr_html_(self) -> str:
        from designer.study.columns import SCORE_COLUMNS

        title = f"{self.table['point'].nunique()} requirements, {len(self.winners)} with a feasible design"
        return _shown(title, self.winners, ["point", *self.axes, "configuration", *SCORE_COLUMNS])


def requirement(path: str | Path, **changes: object) -> Requirement:
    """A requirement from its file, with keys changed: two underscores stand for a dot, envelope__height_mm=150."""
    asked = read_requirement(Path(path))
    for key, value in changes.items():
        asked = set_key(asked, key.replace("__", "."), value)
    return asked


def configurations() -> pd.DataFrame:
    """The 44 configurations: name, family, topology and the kinds of their mirrors."""
    import pandas as pd

    from designer.configurations import enumerate_configurations

    return pd.DataFrame(
        {"configuration": each.name, "family": each.family, "topology": each.topology}
        | {name: kind.name.lower() for name, kind in each.mirror_kinds.items()}
        for each in enumerate_configurations()
    )


def study(
    requirement: Requirement, only: tuple[str, ...] = (), jobs: int | None = None, comparators: bool = False
) -> StudyResult:
    """Solve, trace and rank the configurations of a requirement; nothing is written.

    Parameters
    ----------
    requirement
        The requirement.
    only
        Names or glob patterns of configurations; all if empty.
    jobs
        Processes; one for each core if not given.
    comparators
        Whether to design what else could be built as well, which takes some minutes.

    Raises
    ------
    InputError
        A name or pattern matches none of the requirement's configurations.
    """
    from designer.study.comparators import comparator_frame, design_comparators
    from designer.study.folder import lens_frame
    from designer.study.process_pool import cores
    from designer.study.row import frame_of
    from designer.study.run import solve_study

    solved = solve_study(requirement, jobs=jobs or cores(), only=only)
    others = design_comparators(solved.requirement, jobs=jobs or cores()) if comparators else ()
    return StudyResult(
        solved.requirement,
        frame_of(solved.rows),
        dict(solved.designs),
        lens_frame(solved.lenses),
        comparator_frame(others),
    )


def sweep(definition: str | Path, folder: str | Path, jobs: int | None = None) -> SweepResult:
    """Run a sweep, or go on where it was, and return what it found; warns if its store is damaged."""
    import warnings

    from designer.study.process_pool import cores
    from designer.study.sweep.definition import read_sweep
    from designer.study.sweep.run import run_sweep

    run_sweep(*read_sweep(Path(definition)), Path(folder), jobs=jobs or cores(), tell=warnings.warn)
    return read_sweep_folder(folder)


def read_sweep_folder(folder: str | Path) -> SweepResult:
    """What a sweep has found so far."""
    from designer.study.sweep.tables import read_sweep_results, winners

    table = read_sweep_results(Path(folder))
    return SweepResult(Path(folder), table, winners(table))


def compare(first: str | Path, second: str | Path) -> StudyComparison:
    """Two folders of studies or sweeps side by side."""
    from designer.study.compare import compare as compare_folders

    return compare_folders(Path(first), Path(second))


def certify(folder: str | Path, only: Sequence[str] = (), seconds: float = 60.0) -> pd.DataFrame:
    """Prove how far a study's designs are from the best possible, and which configurations have no design.

    A table with a row for each configuration looked at, as ``certificates.csv`` in the study's folder has it
    (docs/certify.md). Depth errors are shares.

    Parameters
    ----------
    only
        Names or glob patterns of configurations; all if there are none.
    seconds
        Processor time for each configuration.

    Raises
    ------
    InputError
        The folder is no study's, a pattern matches nothing, or the extra ``certify`` is not installed.
    """
    require_extra("certify", "certifying a study")
    from designer.certify.certify import certificate_frame, certify_study

    return certificate_frame(certify_study(Path(folder), seconds, only))


def multipliers(requirement: Requirement, configuration: str) -> pd.Series[float]:
    """What one more unit of each key is worth to one configuration, from the first stage's multipliers.

    The derivative of the least first objective by each key, in its unit for each unit of the key: millimetres, degrees
    and pixels, as the keys say, and stops (factors of the root of two) of a given f-number.

    Raises
    ------
    InputError
        The requirement has no such configuration, nothing is feasible, or the optimum has no multipliers.
    """
    import pandas as pd

    from designer.optimise.multipliers import first_stage_multipliers
    from designer.optimise.search import search

    named = [each for each in requirement.configurations if each.name == configuration]
    if not named:
        raise InputError(f"{configuration}: is not a configuration of this requirement")
    first = search(requirement, named[0]).first
    slopes = None if first is None else first_stage_multipliers(requirement, first)
    if slopes is None:
        raise InputError(f"{configuration}: has no optimum, so it has no multipliers")
    return pd.Series(slopes, name=configuration)


def _shown(title: str, table: pd.DataFrame, columns: list[str]) -> str:
    rows = table[columns].head(SHOWN_ROWS).itertuples(index=False)
    left = len(table) - SHOWN_ROWS
    return html_table(title, columns, rows, f"and {left} more" if left > 0 else "")
