"""Tolerances of a design: what its departures cost, and how many sensors built to it are good."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from designer.as_built.built import BuiltSensor
    from designer.as_built.compensation import Calibration
    from designer.as_built.study import ToleranceStudy
    from designer.design import Design


def built_sensor(design: Design) -> BuiltSensor | None:
    """What the departures of a design's ``as_built`` table do; None if it has none.

    Raises
    ------
    InputError
        A view of the design itself does not show the whole working volume.
    """
    from designer.as_built.built import built_sensor as measure

    return measure(design)


def tolerance(
    design: Design,
    tolerances: str | Path = "standard",
    *,
    trials: int = 10_000,
    seed: int = 0,
    align: str | None = None,
    calibration: Calibration = "views",
    asked_yield: float | None = None,
    folder: str | Path | None = None,
) -> ToleranceStudy:
    """Perturb a design within tolerances: each departure alone, then many sensors with all of them at random.

    Parameters
    ----------
    tolerances
        A grade (``coarse``, ``standard``, ``precision``), or a TOML file of tolerances.
    trials, seed
        How many sensors to trace, and the seed from which they are drawn.
    align
        Name of a mirror that is adjusted along the axis at assembly.
    calibration
        What calibration finds: centre, scale and turn of each of the ``views``, of the whole ``image`` (which is all
        that ``designer stereo`` takes), or ``none``.
    asked_yield
        The share of good sensors for which to find the cheapest tolerances (``.budget`` of what is returned). What a
        file of tolerances sets stays as it is.
    folder
        Where to write tables and results, if anywhere.

    Raises
    ------
    InputError
        The tolerances cannot be read or do not fit the design, the design does not show its working volume,
        or the folder holds anything but an earlier study.
    """
    from designer.as_built.folder import check_tolerance_folder
    from designer.as_built.named import named_tolerances
    from designer.as_built.study import study_tolerances, write_tolerance_study

    if folder is not None:
        check_tolerance_folder(Path(folder))
    asked = named_tolerances(str(tolerances), design).values
    study = study_tolerances(design, asked, trials, seed, align, calibration, asked_yield)
    if folder is not None:
        write_tolerance_study(study, Path(folder))
    return study
