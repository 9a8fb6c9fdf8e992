"""What the commands do, in a few Python calls: for notebooks and scripts.

A study and a sweep are held as tables (pandas) with designs behind them; both show themselves in a notebook.

Examples
--------
>>> from designer import api
>>> requirement = api.requirement("configs/indoor_robot.toml", envelope__height_mm=150)
>>> requirement.envelope.height_mm
150.0
>>> len(api.configurations())
44
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from designer.requirement import Requirement, read_requirement, set_key

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import ArrayLike

    from designer.design import Design
    from designer.imaging.endtoend.check import EndToEndCheck
    from designer.imaging.stereo.reconstruction import PointCloud
    from designer.study.compare import StudyComparison
    from designer.trace.sequential import SequentialTrace
    from designer.verify.verdict import Verdict

# A length off by so much moves the points of a ray by less than a nanometre.
UNIT_WITHIN = 1e-9


@dataclass(frozen=True)
class StudyResult:
    """A study: its requirement, its table (a row for each configuration, best first), its designs by name."""

    requirement: Requirement
    table: pd.DataFrame
    designs: dict[str, Design]

    @property
    def best(self) -> Design | None:
        """The winner; None if nothing is feasible."""
        return next(iter(self.designs.values()), None)

    def _repr_html_(self) -> str:
        from designer.study.columns import SCORE_COLUMNS

        title = f"{self.requirement.title}: {len(self.designs)} of {len(self.table)} configurations feasible"
        shown = self.table[["configuration", "status", *SCORE_COLUMNS]]
        return f"<p><b>{title}</b></p>{shown.head(10).to_html(index=False)}"


@dataclass(frozen=True)
class SweepResult:
    """A sweep's folder, its table (a row for each requirement and configuration) and its winners."""

    folder: Path
    table: pd.DataFrame
    winners: pd.DataFrame

    def design(self, point: int, configuration: str | None = None) -> Design:
        """The design of a configuration at a point, of the winner if none is named."""
        from designer.files import InputError
        from designer.study.sweep.designs import design_at

        self._check_points([point])
        if configuration is None:
            found = self.winners[self.winners["point"] == point]["configuration"]
            if found.empty:
                raise InputError(f"{self.folder}: nothing is feasible at point {point}")
            configuration = str(found.iloc[0])
        return design_at(self.folder, point, configuration)

    def sensitivities(self, points: list[int] | None = None) -> pd.DataFrame:
        """What one more unit of each key is worth to the winners, from the first stage's multipliers.

        Points where nothing is feasible are left out.

        Raises
        ------
        InputError
            The sweep has no such point.
        """
        from designer.study.sweep.designs import sensitivities

        self._check_points(points or [])
        chosen = self.winners if points is None else self.winners[self.winners["point"].isin(points)]
        pairs = zip(chosen["point"], chosen["configuration"], strict=True)
        return sensitivities(self.folder, [(int(point), str(name)) for point, name in pairs])

    def _check_points(self, points: list[int]) -> None:
        from designer.files import InputError

        for point in points:
            if not (self.table["point"] == point).any():
                raise InputError(f"{self.folder}: the sweep has no point {point}, or has not come to it yet")

    def front(self, columns: tuple[str, ...] = ("depth_error_rms", "height_mm", "diameter_mm")) -> pd.DataFrame:
        """The designs that no other beats in all the columns at once."""
        from designer.study.sweep.export import pareto

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

        from designer.files import InputError

        try:
            from designer.report.figures.sweep_explorer import draw_explorer
        except ModuleNotFoundError as error:
            if error.name is None or error.name.partition(".")[0] != "plotly":
                raise
            raise InputError(
                "the interactive front needs plotly; install it with: pip install 'catadioptric-designer[notebooks]'"
            ) from None
        front = self.front()
        if front.empty:
            raise InputError(f"{self.folder}: nothing is feasible in this sweep, so there is no front")
        shown = front.iloc[np.linspace(0, len(front) - 1, min(most, len(front))).round().astype(int)]
        pairs = zip(shown["point"], shown["configuration"], strict=True)
        return draw_explorer(shown, [self.design(int(point), str(name)) for point, name in pairs])

    def _repr_html_(self) -> str:
        title = f"{self.table['point'].nunique()} requirements, {len(self.winners)} with a feasible design"
        return f"<p><b>{title}</b></p>{self.winners.head(10).to_html(index=False)}"


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


def study(asked: Requirement, only: tuple[str, ...] = (), jobs: int | None = None) -> StudyResult:
    """Solve, trace and rank the configurations of a requirement; nothing is written.

    Parameters
    ----------
    asked
        The requirement.
    only
        Names or glob patterns of configurations; all if empty.
    jobs
        Processes; one for each core if not given.

    Raises
    ------
    InputError
        A name or pattern matches none of the requirement's configurations.
    """
    from designer.study.process_pool import cores
    from designer.study.row import frame_of
    from designer.study.run import solve_study

    solved = solve_study(asked, jobs=jobs or cores(), only=only)
    return StudyResult(solved.requirement, frame_of(solved.rows), dict(solved.designs))


def sweep(definition: str | Path, folder: str | Path, jobs: int | None = None) -> SweepResult:
    """Run a sweep, or go on where it was, and return what it found."""
    from designer.study.process_pool import cores
    from designer.study.sweep.definition import read_sweep
    from designer.study.sweep.run import run_sweep

    run_sweep(*read_sweep(Path(definition)), Path(folder), jobs=jobs or cores())
    return read_sweep_folder(folder)


def read_sweep_folder(folder: str | Path) -> SweepResult:
    """What a sweep has found so far."""
    from designer.study.sweep.export import read_sweep_results, winners

    table = read_sweep_results(Path(folder))
    return SweepResult(Path(folder), table, winners(table))


def trace(design: Design) -> Verdict:
    """The tracer's verdict on a design."""
    from designer.verify.verdict import judge

    return judge(design)


def trace_rays(design: Design, view: Literal["upper", "lower"], directions: ArrayLike) -> SequentialTrace:
    """Rays of one's own from the pinhole through the mirrors of a view: the points on each, and the exit directions.

    Nothing blocks them but the mirrors' own apertures. With the extra ``compiled``, loops that are compiled at the
    first call trace them, some forty million a second; without it NumPy does, half as fast.

    Parameters
    ----------
    directions
        Unit vectors (n, 3), frame of the pinhole.

    Raises
    ------
    InputError
        There is no such view, or these are not unit vectors.
    """
    from importlib.util import find_spec

    import numpy as np

    from designer.files import InputError
    from designer.trace.instrument import build_instrument
    from designer.trace.sequential import trace_sequential

    if view not in {"upper", "lower"}:
        raise InputError(f"view = {view!r}: must be upper or lower")
    directions = np.asarray(directions, dtype=float)
    if directions.ndim != 2 or directions.shape[1] != 3:
        raise InputError(f"directions: must have shape (n, 3), not {directions.shape}")
    if not np.allclose(np.linalg.norm(directions, axis=1), 1.0, rtol=0.0, atol=UNIT_WITHIN):
        raise InputError("directions: must be unit vectors")
    instrument = build_instrument(design)
    path = instrument.path(getattr(design.views, view).path)
    if find_spec("numba") is None:
        return trace_sequential(instrument, path, directions)
    from designer.trace.compiled import trace_many

    return trace_many(instrument, path, directions)


def check(design: Design, scene: str = "auto", seed: int = 0) -> EndToEndCheck:
    """A design tried end to end: a scene rendered, turned into panoramas, matched, and held against the truth.

    Parameters
    ----------
    scene
        office, pipe, hall, sky or cylinder, auto (by the working volume), or the path of a mesh.
    seed
        Of textures and noise.
    """
    from designer.imaging.endtoend.check import check_design

    return check_design(design, scene, seed=seed)


def point_cloud(found: EndToEndCheck) -> PointCloud:
    """The points that a check reconstructed, in the frame of the pinhole, each with its standard deviations."""
    from designer.imaging.stereo.rig import point_cloud as cloud_of

    return cloud_of(found.rig, found.raw, found.matches)


def compare(first: str | Path, second: str | Path) -> StudyComparison:
    """Two folders of studies or sweeps side by side."""
    from designer.study.compare import compare as compare_folders

    return compare_folders(Path(first), Path(second))
