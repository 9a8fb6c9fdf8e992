"""The verdict in words: who won, by what numbers against what limits, and what decided."""

from __future__ import annotations

from collections import Counter

from designer.configurations import Configuration, enumerate_configurations, with_article
from designer.evaluate.score import recorded_fabrication_notes
from designer.goals import GOALS
from designer.report.content.lens import lens_sentences
from designer.report.content.tables import in_percent
from designer.requirement import PREDICTED
from designer.study.ranking import tied_with_best, ties_in_words, tolerance_in_words
from designer.study.row import Row
from designer.study.study import Study
from designer.typesetting.markup import literal, number, plain_number, text, typographic


def configuration_in_words(name: str) -> str:
    """What a configuration's name says, as part of a sentence; empty if it is none of the 44."""
    known = {configuration.name: configuration for configuration in enumerate_configurations()}
    configuration = known.get(name)
    return "" if configuration is None else _in_words(configuration)


def _in_words(configuration: Configuration) -> str:
    kinds = {role: with_article(kind.adjective) for role, kind in configuration.mirror_kinds.items()}
    zone = configuration.zone_of("upper")
    if configuration.family == "direct":
        mirrors = f"{kinds['lower']} lower and {kinds['upper']} upper mirror, each seen directly"
        return f"{mirrors}; the upper view occupies the {zone} zone of the image"
    return (
        f"{kinds['primary']} primary, folded by {kinds['secondary']} secondary, gives the lower view and "
        f"{kinds['direct']} direct mirror the upper one, which occupies the {zone} zone of the image"
    )


def verdict(study: Study) -> str:
    """The verdict as Typst markup: what to build, how to set its lens, and why this design."""
    if not study.feasible:
        return _nothing_feasible(study)
    winner = study.feasible[0]
    design = study.designs[winner.configuration]
    groups = (
        ("Build", [_build(winner), _size(study, winner)]),
        ("Lens", [lens_sentences(design)]),
        ("Why", [_accuracy(study, winner), _decided(study), _counts(study), _runners_up(study)]),
        ("Before building", [_checked(study, winner), _fabrication_notes(study, winner)]),
    )
    told = [(name, " ".join(filter(None, sentences))) for name, sentences in groups]
    return "\n\n".join(f"/ {name}: {sentences}" for name, sentences in told if sentences) + "\n"


def _counts(study: Study) -> str:
    feasible, infeasible, impossible, failed = (
        len(study.with_status(status)) for status in ("feasible", "infeasible", "impossible", "failed")
    )
    others = [
        f"{impossible} {_are(impossible)} impossible by rule" if impossible else "",
        f"for {infeasible} the search found no feasible design" if infeasible else "",
        f"{failed} failed" if failed else "",
    ]
    listed = "; ".join(other for other in others if other)
    if len(study.rows) == 1:
        return text("The only configuration studied is feasible, verified by ray tracing.")
    return text(
        f"Of the {len(study.rows)} configurations, {feasible} {_are(feasible)} feasible, verified by ray tracing"
        + (f"; {listed}." if listed else ".")
    )


def _build(winner: Row) -> str:
    words = configuration_in_words(winner.configuration)
    return f"{_name(winner)}{text(f': {words}.' if words else '.')}"


def _accuracy(study: Study, winner: Row) -> str:
    worst = winner.number("depth_error_worst")
    ratio = winner.number("limit_ratio")
    same = "" if study.requirement.noise_px != PREDICTED else " with the same noise"
    sentence = f"Its rms depth error over the working volume is {in_percent(winner.number('depth_error_rms'))} %"
    sentence += f" at {_noise(study, winner)}"
    if (scale := study.requirement.scale_uncertainty_percent) and winner.number("depth_shift_per_scale") is not None:
        sentence += f" and {plain_number(scale)} % of image scale"
    sentence += f" (at worst {in_percent(worst)} %)" if worst is not None else ""
    if ratio is not None:
        sentence += f", {number(ratio, 3)} times the limit for any conic mirrors at its baseline and topology{same}"
    if winner.least_limit is not None:
        what = "the limit" if not same else "that of sharp images at the largest gains"
        sentence += f" ({what} at the best allowed baseline and focal length is {in_percent(winner.least_limit)} %)"
    return text(sentence + "." + _beyond_first_order(winner))


def _noise(study: Study, winner: Row) -> str:
    asked = study.requirement.noise_px
    if asked != PREDICTED:
        return f"{plain_number(asked)} px of noise"
    equal = number(study.designs[winner.configuration].noise_px, 3)
    return f"the predicted matching noise, which counts as much as {equal} px everywhere"


def _beyond_first_order(winner: Row) -> str:
    """What to make of depth errors that first order does not say to 2 percent; empty where it does."""
    if not winner.is_beyond_first_order:
        return ""
    rms, worst = (winner.number(f"depth_error_{kind}_second_order") for kind in ("rms", "worst"))
    if winner.is_beyond_second_order or rms is None or worst is None:
        return (
            " These are first-order values, and the worst points are beyond the validity of both first and second "
            "order: there, use the traced points on its page."
        )
    to_second_order = f"{in_percent(rms)} % (at worst {in_percent(worst)} %)"
    return f" First order underestimates it: to second order it is {to_second_order}."


def _size(study: Study, winner: Row) -> str:
    envelope = study.requirement.envelope
    parts = []
    for column, limit, word in (
        ("height_mm", envelope.height_mm, "tall"),
        ("diameter_mm", envelope.diameter_mm, "wide"),
    ):
        value = winner.number(column)
        if value is not None:
            allowed = f" (of {plain_number(limit)} mm allowed)" if limit is not None else ""
            parts.append(f"{number(value, 1)} mm {word}{allowed}")
    baseline = winner.number("baseline_mm")
    lens = winner.text("lens")
    sentence = f"With a baseline of {number(baseline, 1)} mm the mirror system is {' and '.join(parts)}"
    return text(sentence + (f"; lens: {lens}." if lens else ".")) if parts else ""


def _decided(study: Study) -> str:
    objective = study.requirement.objective
    if len(study.feasible) == 1:
        return text("It is the only feasible design.")
    if not tied_with_best(objective, study.feasible):
        return ""
    label, within = GOALS[objective.minimise].label, tolerance_in_words(objective)
    return text(ties(study) or f"No other design is tied with it{within} in {label}.")


def ties(study: Study) -> str:
    """Which ranks are tied and what decides among them, as a sentence; empty if no other ties with the best."""
    words = ties_in_words(study.requirement.objective, study.feasible)
    return f"{words[0].upper()}{words[1:]}." if words else ""


def _checked(study: Study, winner: Row) -> str:
    """How the winner did as a sensor; empty if it was not checked."""
    checked, reason = study.checked.get(winner.configuration), study.unchecked.get(winner.configuration)
    if reason is not None:
        return text(f"The winner could not be checked end to end: {typographic(reason)}.")
    if checked is None:
        return ""
    word = "passes" if checked.passed else "does not pass"
    through = checked.verdict.recorded_through
    share = checked.verdict.kept_of_pinhole
    kept = "" if share is None else f", with {in_percent(share, 1)} % of the points that a pinhole would give"
    return f"{text(f'The winner {word} the end-to-end check through {through}{kept}')} (@check)."


def _fabrication_notes(study: Study, winner: Row) -> str:
    """Where to read on before ordering the winner's mirrors; empty if there is nothing to read."""
    count = len(recorded_fabrication_notes(study.designs[winner.configuration]))
    if not count:
        return ""
    notes = "the fabrication note" if count == 1 else f"the {count} fabrication notes"
    return f"{text(f'Before ordering its mirrors, read {notes} on its page')} (@best)."


def _runners_up(study: Study) -> str:
    runners = study.feasible[1:4]
    if not runners:
        return ""
    described = [
        _name(row)
        + text(
            f" ({in_percent(row.number('depth_error_rms'))} %, {number(row.number('height_mm'), 1)} mm tall, "
            f"{number(row.number('diameter_mm'), 1)} mm wide)"
        )
        for row in runners
    ]
    return f"Next {'come' if len(described) > 1 else 'comes'} " + ", ".join(described) + "."


def _nothing_feasible(study: Study) -> str:
    infeasible, impossible = study.with_status("infeasible"), study.with_status("impossible")
    failed = study.with_status("failed")
    none = f"None of the {len(study.rows)} configurations" if len(study.rows) > 1 else "The only configuration studied"
    sentence = f"{none} was {'not ' * (len(study.rows) == 1)}found to be feasible for this requirement. "
    sentence += f"{len(impossible)} {_are(len(impossible))} impossible by rule and for {len(infeasible)} the search "
    sentence += "found no feasible design" + (f"; {len(failed)} failed. " if failed else ". ")
    obstacles = Counter(row.text("closest_constraint") for row in infeasible if row.text("closest_constraint"))
    if obstacles:
        (obstacle, times), *_ = obstacles.most_common()
        sentence += f"The most frequent limiting constraint ({times} of {len(infeasible)}) is: {obstacle}. "
        sentence += "The table below gives the violation for each configuration: relax the requirement there first."
    return text(sentence) + "\n"


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def _name(row: Row) -> str:
    return f"#name-of({literal(row.configuration)})"
