import pytest

from designer.files import InputError
from designer.study.sweep.definition import read_sweep
from designer.study.sweep.plan import check_points, plan_points

HEAD = 'requirement = "base.toml"\n'
AXIS = '[[axis]]\nkey = "baseline_mm"\n'

MALFORMED = {
    "not TOML": ("axis = [", "not valid TOML"),
    "no axis": (HEAD, "axis: is required"),
    "empty axis": (HEAD + "axis = []", "at least one axis"),
    "no values": (HEAD + AXIS, "needs values"),
    "empty values": (HEAD + AXIS + "values = []", "at least one number"),
    "words": (HEAD + AXIS + 'values = ["a"]', "must be a number"),
    "not a number": (HEAD + AXIS + "values = [nan]", "must be a number"),
    "falling": (HEAD + AXIS + "values = [2, 1]", "must be increasing numbers without repetition"),
    "twice the same": (HEAD + AXIS + "values = [100, 100]", "must be increasing numbers without repetition"),
    "both ways": (HEAD + AXIS + "values = [100]\nlow = 1\nhigh = 2", "either values"),
    "no count": (HEAD + AXIS + "low = 90\nhigh = 110", "needs a count"),
    "count of one": (HEAD + AXIS + "low = 90\nhigh = 110\ncount = 1", "whole number from 2"),
    "inverted": (HEAD + AXIS + "low = 110\nhigh = 90\ncount = 3", "less than high"),
    "logarithm of zero": (HEAD + AXIS + 'low = 0\nhigh = 90\ncount = 3\nspacing = "logarithmic"', "above zero"),
    "start off the grid": (HEAD + AXIS + "low = 90\nhigh = 110\ncount = 3\nstart = 95",
                           "must be one of the axis's values (90, 100, 110)"),
    "start of a hypercube": ('plan = "latin_hypercube"\npoints = 3\n' + HEAD + AXIS + "low = 9\nhigh = 11\nstart = 9",
                             "applies only to a grid"),
    "misspelt": (HEAD + AXIS + "value = [100]", "did you mean values?"),
    "misspelt plan": ('plan = "gird"\n' + HEAD + AXIS + "values = [100]", "plan"),
    "name of no folder": ('name = "my sweep"\n' + HEAD + AXIS + "values = [100]",
                          "quick.toml: name = 'my sweep': must be letters"),
    "key that does not exist": (HEAD + '[[axis]]\nkey = "envelope.hight_mm"\nvalues = [1]',
                                "no such key (hight_mm); did you mean height_mm?"),
    "key that is no number": (HEAD + '[[axis]]\nkey = "name"\nvalues = [1]', "not a numeric key"),
    "key of the solver": (HEAD + '[[axis]]\nkey = "solve.seed"\nvalues = [1]', "is not part of the requirement"),
    "two axes, one key": (HEAD + AXIS + "values = [100]\n" + AXIS + "values = [101]", "two axes"),
    "points on a grid": ("points = 5\n" + HEAD + AXIS + "values = [100]", "omit it"),
    "hypercube without points": ('plan = "latin_hypercube"\n' + HEAD + AXIS + "low = 90\nhigh = 110", "is needed"),
    "too many": (HEAD + AXIS + "low = 90\nhigh = 110\ncount = 100000\n"
                 + '[[axis]]\nkey = "noise_px"\nvalues = [1, 2]',
                 "at most 100000"),
    "no requirement": ('requirement = "none.toml"\n' + AXIS + "values = [100]", "cannot be read"),
    "a range given one number": (HEAD + '[[axis]]\nkey = "working_volume.distance_mm"\nvalues = [9]',
                                 "must be a range"),
    "beyond the limits": (HEAD + AXIS + "values = [100, 1e6]", "point 1 (baseline_mm = 1e+06)"),
    "does not fit together": (HEAD + '[[axis]]\nkey = "envelope.height_mm"\nvalues = [10]', "must be at least"),
}  # fmt: skip


def read_and_check(path):
    definition, base = read_sweep(path)
    check_points(definition, base, plan_points(definition))


@pytest.mark.parametrize("name", MALFORMED)
def test_malformed_sweep_gets_one_line(name, quick_sweep):
    content, expected = MALFORMED[name]
    quick_sweep.write_text(content)
    with pytest.raises(InputError) as caught:
        read_and_check(quick_sweep)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_ends_of_a_range_can_be_swept(quick_sweep):
    quick_sweep.write_text(HEAD + '[[axis]]\nkey = "working_volume.elevation_deg.1"\nvalues = [12, 16]')
    definition, base = read_sweep(quick_sweep)
    points = plan_points(definition)
    check_points(definition, base, points)
    assert [point.coordinates["working_volume.elevation_deg.1"] for point in points] == [12, 16]
