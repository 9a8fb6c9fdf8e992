"""What the best designs of a study forgive: sensors built to one set of tolerances, for each of them.

``tolerances.json`` in the study's folder holds the result; the report is written from it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from designer.as_built.model import perturbable
from designer.as_built.named import NamedTolerances
from designer.as_built.study import ToleranceStudy, percentiles, study_tolerances
from designer.as_built.tolerances import Tolerances, tolerance_values
from designer.as_built.yields import expected_depth_error
from designer.design import Design, design_to_json
from designer.evaluate.score import check_image_law
from designer.files import InputError, describe_validation_error, finite, read_text, write_atomically
from designer.own_files import sha256
from designer.study.manifest import announce, settle
from designer.study.names import TOLERANCES
from designer.study.processes import local_processes, run_each, why_it_failed

TRIALS = 2000
HIGH = 95
"""The percentile by which designs are called forgiving."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class RecordedImpact(_Record):
    """One departure at its tolerance, calibrated: see :class:`designer.as_built.sensitivity.Impact`."""

    name: str
    unit: str
    tolerance: float
    growth: float | None = None
    allowed: float | None = None
    allowed_by: Literal["growth", "blur"] | None = None
    is_harmless: bool = False


class Forgiveness(_Record):
    """What becomes of one design's sensors. Depth errors are shares, once calibrated.

    ``depth_errors`` are at the 101 percentiles from 0 to 100; None where sensors have no depth at all. ``impacts`` is
    sorted by growth of the depth error. ``problem`` says why there is none of it.
    """

    configuration: str
    design_sha256: str
    depth_error_as_designed: float | None = None
    depth_errors: tuple[float | None, ...] = ()
    good: float | None = None
    good_interval: tuple[float, float] | None = None
    first_order_holds: bool | None = None
    blurred: int | None = None
    impacts: tuple[RecordedImpact, ...] = ()
    problem: str = ""

    @property
    def median(self) -> float | None:
        """Depth error that half of the sensors exceed."""
        return self.depth_errors[50] if self.depth_errors else None

    @property
    def high(self) -> float | None:
        """Depth error at the 95th percentile."""
        return self.depth_errors[HIGH] if self.depth_errors else None


class StudyTolerances(_Record):
    """The tolerances, and what each of the best designs makes of them, best first.

    ``name`` is a grade or the name of a file; ``growth`` the share by which a good sensor's depth error may grow.
    """

    name: str
    trials: int
    seed: int
    growth: float
    tolerances: Tolerances
    designs: tuple[Forgiveness, ...]

    def of(self, configuration: str) -> Forgiveness | None:
        """What one design makes of them; None if it was not among the best."""
        return next((each for each in self.designs if each.configuration == configuration), None)

    @property
    def most_forgiving(self) -> Forgiveness | None:
        """The design with the least depth error at the 95th percentile; None if none has one."""
        known = [each for each in self.designs if each.high is not None]
        return min(known, key=lambda each: each.high or 0.0, default=None)


@dataclass(frozen=True, slots=True)
class ToleranceProgress:
    """One design done, of how many."""

    done: int
    total: int
    configuration: str


def tolerate_designs(
    designs: Sequence[Design],
    tolerances: Tolerances,
    name: str,
    folder: Path,
    *,
    jobs: int = 1,
    seed: int = 0,
    trials: int = TRIALS,
    progress: Callable[[ToleranceProgress], None] | None = None,
) -> StudyTolerances:
    """Build sensors of each design within the same tolerances, and write ``tolerances.json`` into the study's folder.

    The results do not depend on ``jobs``.

    Raises
    ------
    InputError
        A file is in the way that no study wrote, or that has been changed since.
    """
    announce(folder, [TOLERANCES])
    found: dict[int, Forgiveness] = {}
    with local_processes(min(jobs, len(designs))) as processes:
        tasks = [(design, tolerances, trials, seed) for design in designs]
        for index, future in run_each(processes, _tolerate, tasks):
            try:
                found[index] = future.result()
            except Exception as error:
                found[index] = _failed(designs[index], why_it_failed(error))
            if progress is not None:
                progress(ToleranceProgress(len(found), len(designs), designs[index].configuration))
    growth = tolerances.depth_error_growth_percent / 100.0
    every = tuple(found[index] for index in range(len(designs)))
    result = StudyTolerances(name=name, trials=trials, seed=seed, growth=growth, tolerances=tolerances, designs=every)
    content = result.model_dump(mode="json", exclude_none=True)
    write_atomically(folder / TOLERANCES, json.dumps(content, indent=2, allow_nan=False) + "\n")
    settle(folder, [TOLERANCES])
    return result


def to_be_built(ranked: Sequence[Design], tolerances: Tolerances, *, best: int, seed: int = 0) -> list[Design]:
    """The best of ranked designs, and one more if it forgives more than each of these.

    What a design forgives is judged to first order, by its depth error at the 95th percentile.
    """
    known = {place: _expected(design, tolerances, seed) for place, design in enumerate(ranked)}
    others = range(best, len(ranked))
    most_forgiving = min(others, key=known.__getitem__, default=None)
    chosen = list(ranked[:best])
    if most_forgiving is not None and known[most_forgiving] < min(known[place] for place in range(best)):
        chosen.append(ranked[most_forgiving])
    return chosen


def read_tolerances_of_study(folder: Path, designs: Sequence[Design]) -> StudyTolerances | None:
    """What a study wrote of these designs; None if it did not, or if the designs are no longer those.

    Raises
    ------
    InputError
        The file cannot be understood.
    """
    found = _read(folder)
    if found is None:
        return None
    present = {design.configuration: _fingerprint(design) for design in designs}
    is_theirs = all(present.get(each.configuration) == each.design_sha256 for each in found.designs)
    return found if is_theirs else None


def tolerances_in(folder: Path) -> NamedTolerances | None:
    """The tolerances that a study's folder holds, whatever its designs; None if it holds none.

    Raises
    ------
    InputError
        The file cannot be understood.
    """
    found = _read(folder)
    return None if found is None else NamedTolerances(found.name, found.tolerances)


def _read(folder: Path) -> StudyTolerances | None:
    path = folder / TOLERANCES
    if not path.exists():
        return None
    try:
        return StudyTolerances.model_validate_json(read_text(path))
    except ValidationError as error:
        raise InputError(describe_validation_error(path, error)) from None


def _expected(design: Design, tolerances: Tolerances, seed: int) -> float:
    try:
        check_image_law(design)
        model = perturbable(design)
    except InputError:
        return math.inf
    expected = expected_depth_error(model, tolerance_values(design, model.parameters, tolerances), TRIALS, seed)
    return expected if math.isfinite(expected) else math.inf


def _tolerate(design: Design, tolerances: Tolerances, trials: int, seed: int) -> Forgiveness:
    try:
        return _record(study_tolerances(design, tolerances, trials, seed))
    except InputError as error:
        return _failed(design, str(error))


def _record(study: ToleranceStudy) -> Forgiveness:
    result = study.trials.result
    return Forgiveness(
        configuration=study.model.design.configuration,
        design_sha256=_fingerprint(study.model.design),
        depth_error_as_designed=study.model.noise,
        depth_errors=tuple(finite(value) for value in percentiles(study.trials.depth_error_after, range(101))),
        good=result.value,
        good_interval=result.interval,
        first_order_holds=result.first_order_holds,
        blurred=result.blurred,
        impacts=tuple(
            RecordedImpact(
                name=impact.parameter.name,
                unit=impact.parameter.unit,
                tolerance=impact.tolerance,
                growth=finite(impact.growth_after),
                allowed=impact.allowed,
                allowed_by=impact.allowed_by,
                is_harmless=impact.is_harmless,
            )
            for impact in study.impacts
        ),
    )


def _failed(design: Design, problem: str) -> Forgiveness:
    return Forgiveness(configuration=design.configuration, design_sha256=_fingerprint(design), problem=problem)


def _fingerprint(design: Design) -> str:
    return sha256(design_to_json(design).encode())
