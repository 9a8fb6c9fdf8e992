"""Tolerance files, the departures drawn from them, and what they come to."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

from designer import api
from designer.as_built.merits import grid_of
from designer.as_built.model import depth_error, first_order_bias, measure, perturbable
from designer.as_built.parameters import values_of
from designer.as_built.projection import project
from designer.as_built.sensitivity import sensitivities
from designer.as_built.tolerances import GRADES, read_tolerances, tolerance_values, tolerances_of_grade
from designer.as_built.yields import clopper_pearson, draw_departures, simulate
from designer.cli import cli
from designer.design import Design, read_design, write_design
from designer.files import InputError
from support import DATA
from support.studied_designs import SHARP_NAMES, sharp_design


def own(tmp_path, text):
    path = tmp_path / "tolerances.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_overrules_its_grade_and_one_mirror_overrules_all(tmp_path):
    design = read_design(DATA / "folded_hypl_hy.json")
    parameters = perturbable(design).parameters
    text = 'grade = "coarse"\n[mirrors]\ntilt_deg = 0.03\n[mirror.direct]\ntilt_deg = 0.01\nradius_percent = 0.1\n'
    values = tolerance_values(design, parameters, read_tolerances(own(tmp_path, text), design))
    at = {(p.part, p.key): value for p, value in zip(parameters, values, strict=True)}
    assert at["direct", "tilt_x_deg"] == at["direct", "tilt_y_deg"] == 0.01
    assert at["primary", "tilt_x_deg"] == 0.03
    assert at["primary", "decentre_y_mm"] == GRADES["coarse"][0].decentre_mm
    assert at["direct", "radius_departure_mm"] == pytest.approx(1e-3 * abs(design.mirror("direct").radius_mm))
    assert at["secondary", "curvature_per_m"] == GRADES["coarse"][0].plane_curvature_per_m
    assert at["camera", "principal_distance_departure_mm"] == pytest.approx(0.01 * design.camera.focal_length_mm)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('grade = "fine"', "grade = 'fine': must be 'coarse', 'standard' or 'precision'"),
        ("[mirrors]\ntilt = 0.1", "mirrors.tilt: Extra inputs are not permitted"),
        ("[mirrors]\ntilt_deg = -0.1", "greater than or equal to 0"),
        ("depth_error_growth_percent = 0", "greater than 0"),
        ("[mirror.lower]\ntilt_deg = 0.1", "mirror.lower: must be a mirror of the design: primary, secondary, direct"),
        ("[mirror.secondary]\nplane_curvature_per_m = 0.1", "plane_curvature_per_m = 0.1: secondary is no plane"),
        ("[camera", "not valid TOML"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, text, said):
    path = own(tmp_path, text)
    with pytest.raises(InputError) as refused:
        read_tolerances(path, sharp_design(SHARP_NAMES[0]))
    assert str(refused.value).startswith(f"{path}: ")
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_radius_of_a_plane_is_refused(tmp_path):
    path = own(tmp_path, "[mirror.secondary]\nconic = 0.1\n")
    with pytest.raises(InputError, match=r"mirror\.secondary\.conic = 0\.1: secondary is a plane"):
        read_tolerances(path, read_design(DATA / "folded_hypl_hy.json"))


def test_draws_are_cut_off_gaussians_and_do_not_depend_on_how_many_follow():
    tolerances = np.array([0.1, 0.0, 2.0])
    values = draw_departures(tolerances, 200_000, 3)
    np.testing.assert_array_equal(values[:50], draw_departures(tolerances, 50, 3))
    assert np.all(np.abs(values) <= tolerances)
    # The variance of a unit Gaussian cut off at 2, 1 - 2 * 2 phi(2) / (2 Phi(2) - 1), is 0.7737: published tables.
    np.testing.assert_allclose(values.std(axis=0), tolerances / 2.0 * np.sqrt(0.77374), rtol=5e-3)
    assert abs(np.corrcoef(values[:, 0], values[:, 2])[0, 1]) < 0.01


def test_intervals_are_those_of_published_tables():
    """Clopper and Pearson's 95 % limits for 0, 5 and 10 of 10 (E. S. Pearson and H. O. Hartley, Biometrika Tables)."""
    np.testing.assert_allclose(clopper_pearson(0, 10), (0.0, 0.3085), atol=1e-4)
    np.testing.assert_allclose(clopper_pearson(5, 10), (0.1871, 0.8129), atol=1e-4)
    np.testing.assert_allclose(clopper_pearson(10, 10), (0.6915, 1.0), atol=1e-4)


@pytest.mark.parametrize("name", [SHARP_NAMES[place] for place in (1, 4, 13)])
def test_what_is_allowed_grows_the_depth_error_by_what_was_asked(name):
    model = perturbable(sharp_design(name))
    tolerances = tolerance_values(model.design, model.parameters, tolerances_of_grade("standard"))
    impacts = sensitivities(model, tolerances, 0.1)
    assert [impact.growth_after for impact in impacts] == sorted((i.growth_after for i in impacts), reverse=True)
    for impact in impacts:
        place = model.parameters.index(impact.parameter)
        if impact.is_harmless:
            assert impact.allowed is None
            # A change of scale is taken out whole, and so is a plane's shift within itself.
            assert impact.bias_per_unit_after * tolerances[place] < 1e-6 * model.noise
            continue
        values = np.zeros((2, len(tolerances)))
        values[:, place] = impact.allowed, -impact.allowed
        found = measure(model, values)
        if impact.allowed_by == "blur":
            assert found.blur_of_limit.max() == pytest.approx(1.0, abs=1e-4)
            assert depth_error(model, found.after.depth_bias).max() < 1.1 * model.noise
            continue
        assert found.blur_of_limit.max() <= 1.0
        grown = depth_error(model, found.after.depth_bias).max() / model.noise
        assert grown == pytest.approx(1.1, abs=1e-4)
        first_order = model.noise * np.sqrt(1.1**2 - 1.0) / impact.bias_per_unit_after
        assert impact.allowed == pytest.approx(first_order, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("name", SHARP_NAMES[::2])
def test_first_order_says_the_yield_that_the_tracer_finds(name):
    """Within 3 percentage points, at tolerances of which about half of all sensors are good."""
    model = perturbable(sharp_design(name))
    tolerances = tolerance_values(model.design, model.parameters, tolerances_of_grade("precision"))
    found = simulate(model, tolerances, 0.1, 400, 1)
    middling = np.median(found.depth_error_after) / model.noise - 1.0
    result = simulate(model, tolerances, middling, 2000, 2).result
    assert 0.35 < result.value < 0.65
    assert result.interval[0] < result.value < result.interval[1]
    assert abs(result.first_order - result.value) < 0.03
    assert result.first_order_holds


def place_of(model, part, key):
    return next(place for place, p in enumerate(model.parameters) if (p.part, p.key) == (part, key))


@pytest.mark.parametrize("name", [SHARP_NAMES[place] for place in (0, 4, 13)])
def test_alignment_puts_a_shifted_mirror_back(name):
    model = perturbable(sharp_design(name))
    place = place_of(model, model.design.mirrors[0].name, "axial_shift_mm")
    values = np.zeros((1, len(model.parameters)))
    values[0, place] = 0.1
    aligned = measure(model, values, place)
    assert abs(aligned.values[0, place]) < 2e-3
    assert aligned.after.depth_bias[0] < 0.02 * measure(model, values).after.depth_bias[0]
    assert first_order_bias(model, values, place) < 1e-12


def test_alignment_makes_up_for_another_radius():
    model = perturbable(sharp_design(SHARP_NAMES[0]))
    radius, shift = (place_of(model, "secondary", key) for key in ("radius_departure_mm", "axial_shift_mm"))
    values = np.zeros((1, len(model.parameters)))
    values[0, radius] = 1.0
    alone, aligned = measure(model, values), measure(model, values, shift)
    assert aligned.after.depth_bias[0] < 0.05 * alone.after.depth_bias[0]


def test_decentres_turned_by_a_sixth_of_a_turn_do_the_same():
    """The azimuths of the grid are a sixth of a turn apart, and all else is round."""
    model = perturbable(sharp_design(SHARP_NAMES[5]))
    values = np.zeros((2, len(model.parameters)))
    turn = np.array([[0.5, -np.sqrt(0.75)], [np.sqrt(0.75), 0.5]])
    for part, key, shift in (
        ("primary", "decentre", np.array([0.1, -0.03])),
        ("direct", "decentre", np.array([-0.05, 0.08])),
        ("camera", "shift", np.array([0.02, 0.06])),
    ):
        values[:, [place_of(model, part, f"{key}_{axis}_mm") for axis in "xy"]] = shift, turn @ shift
    found = measure(model, values)
    for merits in (found.before, found.after):
        for key in ("epipolar_px", "depth_bias", "viewpoint_spread_mm", "blur_px"):
            first, second = getattr(merits, key)
            assert first == pytest.approx(second, rel=1e-9)
    first, second = found.centres_apart_px
    assert first == pytest.approx(second, rel=1e-9)
    assert first > 0.5


def test_a_trial_that_no_file_can_hold_is_refused(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    path = own(tmp_path, "[mirrors]\nconic = 10.0\n")
    study = api.tolerance(design, path, trials=20)
    assert study.trials.result.blind > 0
    roundest = int(np.argmax([study.trials.measured.values[:, place_of(study.model, "lower", "conic_departure")]]))
    with pytest.raises(InputError, match="lies beyond the equator of this ellipsoid"):
        study.trial(roundest)


def test_the_command_and_the_api_write_the_same_tables(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    path = tmp_path / "design.json"
    write_design(design, path)
    ours = tmp_path / "ours"
    words = ["tolerance", str(path), "--trials", "50", "--seed", "4", "--write-trial", "7", "-o", str(ours)]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 0, result.output
    study = api.tolerance(design, trials=50, seed=4, folder=tmp_path / "theirs")
    for name in ("sensitivity.csv", "trials.csv"):
        assert (ours / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes()
    assert read_design(ours / "trial_000007.json") == study.trial(7)
    row = list(csv.DictReader((ours / "trials.csv").open(encoding="utf-8")))[7]
    assert float(row["upper.tilt_x_deg"]) == pytest.approx(
        study.trial(7).as_built.mirrors["upper"].tilt_x_deg, rel=1e-9
    )
    summary = json.loads((ours / "tolerance.json").read_text(encoding="utf-8"))
    assert summary["yield"]["trials"] == 50
    assert summary["provenance"]["seed"] == 4
    first = study.impacts[0]
    assert f"{first.parameter.name} " in result.stdout
    assert (
        f"yield (depth error at most 10 % larger, blur at most 0.5 deg): {100 * study.trials.result.value:.1f} %"
        in result.stdout
    )
    assert "tolerance.json written" in result.stdout


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--grade", "fine"), "grade = 'fine': must be coarse, standard, precision"),
        (("--align", "third"), "align = 'third': the design has no such mirror; its mirrors are lower, upper"),
        (("--trials", "0"), "trials = 0: must be from 1 to 1000000"),
        (("--trials", "10", "--write-trial", "10"), "trial 10: must be from 0 to 9"),
        (("--grade", "coarse", "--tolerances", "own.toml"), "give one"),
        (("--tolerances", "absent.toml"), "absent.toml: cannot be read"),
    ],
)
def test_the_command_refuses_in_one_line(tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    write_design(sharp_design(SHARP_NAMES[13]), tmp_path / "design.json")
    result = CliRunner().invoke(cli, ["tolerance", "design.json", "-o", "out", *words])
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    (line,) = result.stderr.splitlines()
    assert said in line


def test_a_design_that_does_not_show_its_volume_is_refused(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    volume = design.working_volume.model_copy(update={"elevation_deg": (-50.0, 88.0)})
    path = tmp_path / "design.json"
    write_design(design.model_copy(update={"working_volume": volume}), path)
    result = CliRunner().invoke(cli, ["tolerance", str(path), "-o", str(tmp_path / "out")])
    assert result.exit_code == 2
    assert result.stderr.count("\n") == 1
    assert "view does not show all points of the working volume" in result.stderr


def test_trace_and_evaluate_say_that_the_single_viewpoint_is_gone(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    tilt = {"mirrors": {"upper": {"tilt_x_deg": 0.1}}}
    sensors = {"plain": None, "tilted": tilt, "longer": {"camera": {"principal_distance_departure_mm": 0.1}}}
    said = {}
    for name, as_built in sensors.items():
        path = tmp_path / f"{name}.json"
        write_design(Design.model_validate({**design.model_dump(by_alias=True), "as_built": as_built}), path)
        for command in ("trace", "evaluate"):
            result = CliRunner().invoke(cli, [command, str(path)])
            assert result.exit_code == 0, result.output
            said[name, command] = result.stdout
        said[name] = json.loads(CliRunner().invoke(cli, ["evaluate", "--json", str(path)]).stdout)
    assert "as_built" not in said["plain"]
    sensor = api.built_sensor(api.read_design(tmp_path / "tilted.json"))
    assert api.built_sensor(design) is None
    # The untouched mirror keeps its viewpoint; that of the tilted one is gone.
    assert sensor.views["lower"].caustic_mm < 1e-6
    assert sensor.views["upper"].caustic_mm > 2.0 * sensor.views["upper"].spread_mm > 1e-3
    assert said["tilted"]["as_built"]["views"]["upper"]["caustic_mm"] == sensor.views["upper"].caustic_mm
    for command in ("trace", "evaluate"):
        assert said["tilted", command].startswith(said["plain", command])
        assert "as built" not in said["plain", command]
        assert "as built: no single viewpoint any more" in said["tilted", command]
        assert f"upper view: caustic {sensor.views['upper'].caustic_mm:.3g} mm" in said["tilted", command]
        assert "as built: each view still has a single viewpoint" in said["longer", command]


def test_a_sensor_that_is_blind_is_said_to_see_less(tmp_path):
    design = sharp_design(SHARP_NAMES[13])
    path = tmp_path / "blind.json"
    as_built = {"mirrors": {"upper": {"tilt_x_deg": 20.0}}, "camera": {"tilt_x_deg": -20.0}}
    write_design(Design.model_validate({**design.model_dump(by_alias=True), "as_built": as_built}), path)
    for command in ("trace", "evaluate"):
        result = CliRunner().invoke(cli, [command, str(path)])
        assert result.exit_code == 1, result.output
        (first,) = (line for line in result.stdout.splitlines() if line.startswith(design.configuration))
        assert first.startswith(f"{design.configuration}: passed as designed; as built: rejected: ")
        sensor = api.built_sensor(api.read_design(path))
        seen = sensor.views["upper"].seen
        assert 0.0 <= seen < 0.9
        sees = f"sees {100.0 * seen:.4g} % of the working volume"
        assert f"the upper view {sees}" in first
        assert f"the upper view {sees}" in sensor.problems
        assert f"it {sees}" in result.stdout
    told = CliRunner().invoke(cli, ["evaluate", "--json", str(path)])
    assert told.exit_code == 1
    assert json.loads(told.stdout)["as_built"]["problems"] == list(sensor.problems)


def test_trace_and_evaluate_name_parts_that_collide_in_the_line_of_the_verdict(tmp_path):
    design = sharp_design(SHARP_NAMES[0])
    path = tmp_path / "colliding.json"
    as_built = {"mirrors": {"primary": {"axial_shift_mm": -50.0}}}
    write_design(Design.model_validate({**design.model_dump(by_alias=True), "as_built": as_built}), path)
    contacts = api.built_sensor(api.read_design(path)).contacts
    assert contacts
    traced, evaluated = (CliRunner().invoke(cli, [command, str(path)]) for command in ("trace", "evaluate"))
    assert traced.exit_code == 1
    first = traced.stdout.splitlines()[0]
    assert first.startswith(f"{design.configuration}: passed as designed; as built: rejected: ")
    assert all(contact in first for contact in contacts)
    assert first in evaluated.stdout.splitlines()


@pytest.mark.parametrize("uncertainty", [0.0, 2e-4])
def test_a_sensor_without_departures_is_as_designed(tmp_path, uncertainty):
    design = sharp_design(SHARP_NAMES[0]).model_copy(update={"scale_uncertainty": uncertainty})
    path = tmp_path / "built.json"
    said = []
    for as_built in (
        {"camera": {"shift_x_mm": 0.0}},
        {"camera": {"tilt_x_deg": 0.01}},
        {"camera": {"tilt_x_deg": 0.4}},
    ):
        write_design(Design.model_validate({**design.model_dump(by_alias=True), "as_built": as_built}), path)
        said.append(CliRunner().invoke(cli, ["trace", str(path)]).stdout.partition("\n\n")[2])
    assert said[0] == "as built: all departures are zero, so the sensor is as designed\n"
    noise = "noise and scale" if uncertainty else "noise"
    assert f"  depth error with {noise}: " in said[1]
    assert "e-" not in said[1]
    assert "px rms, no depth at some points: the rays diverge; image centres" in said[2]


def test_rays_of_ones_own_meet_the_mirrors_where_they_were_built():
    design = sharp_design(SHARP_NAMES[13])
    record = {"mirrors": {"upper": {"tilt_x_deg": 0.5, "decentre_y_mm": 0.2}}, "camera": {"shift_x_mm": 0.1}}
    built = Design.model_validate({**design.model_dump(by_alias=True), "as_built": record})
    values = values_of(built)[None]
    seen = project(design, "upper", grid_of(design).targets["upper"], values)
    ahead = np.column_stack([*seen.slopes[:, 0], np.ones(seen.slopes.shape[2])])
    traced = api.trace_rays(built, "upper", ahead / np.linalg.norm(ahead, axis=1)[:, None])
    np.testing.assert_allclose(np.add(traced.point, [0.1, 0.0, 0.0]), seen.start[:, 0].T, atol=1e-9)
    np.testing.assert_allclose(traced.direction, seen.ahead[:, 0].T, atol=1e-11)
