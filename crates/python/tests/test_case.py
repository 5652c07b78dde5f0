"""Cases: the program's JSON from folders and from arrays; exact sensitivities."""

import json
import pickle
import re
import time
import tomllib

import numpy as np
import pytest
import scipy.optimize
import trueup as tu

PARAMETERS = ["stiffness", "damping", "coulombFriction", "viscousFriction", "staticFriction"]


@pytest.fixture(scope="module")
def fit(backlash):
    return tu.identify(backlash)


@pytest.fixture(scope="module")
def diagnosis(backlash):
    told = []
    found = tu.diagnose(backlash, progress=lambda part, what: told.append(part))
    assert told == sorted(told) and 0 <= told[0] <= told[-1] <= 1
    return found


def test_identify_is_the_programs(fit, program, backlash):
    assert fit.json == json.loads(program("identify", backlash, "--json").stdout)


def test_identify_from_arrays_is_the_same(fit, in_memory):
    assert tu.identify(pickle.loads(pickle.dumps(in_memory))).json == fit.json


def test_a_fit_shows_itself(fit):
    assert list(fit.parameters.index[:5]) == sorted(PARAMETERS)
    assert fit.parameters.loc["stiffness", "unit"] == "N.m/rad"
    assert "stiffness" in fit._repr_html_()
    errors = fit.parameters.loc[fit.names, "standard_error"].to_numpy(float)
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), errors)
    posterior = fit.to_arviz(n=4000).posterior
    for name in fit.names:
        found = fit.json["parameters"][name]
        draws = np.asarray(posterior[name]).ravel()
        assert draws.size == 4000
        # Five standard errors of 4000 draws.
        assert abs(draws.mean() - found["value"]) < 5 * found["standard_error"] / np.sqrt(4000)
        np.testing.assert_allclose(draws.std(), found["standard_error"], rtol=0.06)


def test_diagnose_is_the_programs_but_for_files(diagnosis, program, backlash, tmp_path):
    said = json.loads(program("diagnose", backlash, "--json", "-o", tmp_path / "out").stdout)
    # The program wrote them.
    assert said["augmented"] and diagnosis.json["augmented"] is None
    assert {**diagnosis.json, "augmented": said["augmented"]} == said


def test_a_verdict_alone_is_the_programs(program, backlash, tmp_path):
    said = json.loads(program("diagnose", backlash, "--json", "--verdict-only", "-o", tmp_path / "out").stdout)
    assert tu.diagnose(backlash, verdict_only=True).json == said


def test_diagnose_from_arrays_is_the_same(diagnosis, in_memory):
    found = tu.diagnose(in_memory)
    assert "inputs" not in found.json and "inputs" in diagnosis.json

    def kept(json):
        left_out = ("inputs", "augmented")  # hashes of files, and names of files
        return {**{k: v for k, v in json.items() if k not in left_out}, "pack": {**json["pack"], "case": ""}}

    assert kept(found.json) == kept(diagnosis.json)


def test_a_diagnosis_shows_itself(diagnosis):
    assert diagnosis.verdict == "effects" and diagnosis.effects[0]["id"] == "backlash"
    assert "backlash" in diagnosis._repr_html_() and "backlash" in repr(diagnosis)
    assert diagnosis.gap["overall"]["after"] < diagnosis.gap["overall"]["before"]
    assert "backlash" in set(diagnosis.candidates["id"])


def test_a_report_is_written_without_a_second_run(diagnosis, program, backlash, tmp_path):
    """Within the time of packing, and with the bytes of the program; what differs are command and the FMUs' names in the JSON."""
    again = pickle.loads(pickle.dumps(diagnosis))
    begun = time.process_time()
    page = again.report(tmp_path / "ours")
    assert time.process_time() - begun < 2
    program("diagnose", backlash, "-o", tmp_path / "theirs")
    names = sorted(file.name for file in page.parent.iterdir())
    assert names == sorted(file.name for file in (tmp_path / "theirs").iterdir())
    for name in names:
        ours, theirs = ((tmp_path / folder / name).read_bytes() for folder in ("ours", "theirs"))
        if name == "report.html":
            cut = lambda text: re.sub(rb"<h3>Command</h3><p><code>.*?</code></p>\n", b"", text)
            ours, theirs = cut(ours), cut(theirs)
        assert ours == theirs, name
    with pytest.raises(tu.Error, match="verdict_only"):
        tu.diagnose(backlash, verdict_only=True).report(tmp_path / "short")
    assert not (tmp_path / "short").exists()


def test_a_diagnosis_has_its_parameters_residuals_and_model(diagnosis):
    table = diagnosis.parameters
    gap = diagnosis.json["effects"][0]["parameters"]["backlashGap"]
    assert table.loc["backlashGap", "value"] == gap["value"] and table.loc["backlashGap", "effect"] == "backlash"
    stiffness = table.loc["stiffness"]
    assert stiffness["nominal"] == 0.1 and stiffness["nominal_deviation"] == pytest.approx(0.01)
    assert stiffness["change"] == pytest.approx(stiffness["value"] / 0.1 - 1)
    assert stiffness["change_in_deviations"] == pytest.approx((stiffness["value"] - 0.1) / 0.01)
    assert stiffness["load_side"] == pytest.approx(1e4 * stiffness["motor_side"])
    residuals = diagnosis.residuals
    assert set(residuals.channel) == {"motorAngle", "loadAngle", "twist"}
    for channel, gap in diagnosis.json["gap"]["channels"].items():
        own = residuals[residuals.channel == channel]
        for stage in ("before", "tuned", "after"):
            assert np.sqrt(np.mean((own[stage] - own.measured) ** 2)) == pytest.approx(gap["rms"][stage])
    model = diagnosis.model()
    assert model.variables["stiffness"].start == (stiffness["value"],)
    assert model.variables["backlashGap"].start == (gap_value(diagnosis),)


def gap_value(diagnosis):
    return diagnosis.json["effects"][0]["parameters"]["backlashGap"]["value"]


def test_a_fit_predicts_and_becomes_a_model(fit, program, backlash, recordings, tmp_path):
    shown = fit.predict()
    assert set(shown.recording) == {"train-1.csv", "train-2.csv", "train-3.csv", "holdout-1.csv"}
    held = shown[shown.recording == "holdout-1.csv"]
    for channel, figure in fit.json["fit"].items():
        own = held[held.channel == channel]
        assert np.sqrt(np.mean((own.predicted - own.measured) ** 2)) == pytest.approx(figure["rms"])
    (tmp_path / "fit.json").write_text(json.dumps(fit.json))
    program("fmu", "pack", "--from", tmp_path / "fit.json", "-o", tmp_path / "out")
    packed = tu.Fmu(tmp_path / "out" / "TwoMassJoint.fmi3.fmu")
    for name, value in fit.values.items():
        assert packed.variables[name].start == (value,) == fit.model().variables[name].start
    (recording,) = recordings(["holdout-1.csv"]).values()
    t = np.linspace(0, 1, 101)
    current = np.interp(t, recording["time"], recording["motorCurrent"])
    run = fit.predict(t, {"motorCurrent": current})
    np.testing.assert_array_equal(run["motorAngle"], packed.simulate(t, {"motorCurrent": current})["motorAngle"])


def test_arviz_compares_and_checks_fits(backlash, recordings):
    """Two fits of the same recordings; the one with play is better by far."""
    az = pytest.importorskip("arviz")
    said = tomllib.loads((backlash / "case.toml").read_text())
    known = {key: said[key] for key in ("model", "parameters", "uncertain", "channels")}
    case = tu.Case(train=recordings(["train-1.csv"]), fit=["stiffness", "coulombFriction"], **known)
    play = tu.identify(case, effects=["backlash"], fast=True)
    data = {"plain": tu.identify(case, fast=True).to_arviz(n=60), "play": play.to_arviz(n=60)}
    for one in data.values():
        assert {"posterior", "prior", "log_likelihood", "posterior_predictive", "observed_data"} <= set(one.groups())
    # A draw's likelihood is that of its residuals, predictions linear about the estimates.
    problem, draw = play.problem(), 7
    found = {**play.json["parameters"], **play.json["uncertain"]}
    theta = np.array([found[name]["value"] for name in problem.names])
    drawn = np.array([float(data["play"].posterior[name][0, draw]) for name in problem.names])
    mean, jacobian = problem.predict_and_jacobian(theta)
    off = (problem.measured - mean - jacobian @ (drawn - theta)) / problem.deviation
    expected = -0.5 * off**2 - np.log(np.sqrt(2 * np.pi) * problem.deviation)
    likelihood = data["play"].log_likelihood["reading"][0, draw]
    np.testing.assert_allclose(likelihood, expected, rtol=1e-6, atol=1e-6)
    compared = az.compare(data, ic="waic")
    assert compared.index[0] == "play"
    az.plot_ppc(data["play"], num_pp_samples=5, random_seed=1)


def test_a_saved_case_is_the_same(in_memory, fit, tmp_path):
    problem = tu.Case(in_memory.save(tmp_path / "case")).problem(PARAMETERS)
    other = in_memory.problem(PARAMETERS)
    np.testing.assert_array_equal(problem.measured, other.measured)
    np.testing.assert_array_equal(problem.predict(problem.start), other.predict(other.start))
    with pytest.raises(tu.Error, match="something in it"):
        in_memory.save(tmp_path / "case")


def test_the_jacobian_is_that_of_differences(in_memory):
    problem = in_memory.problem(["stiffness", "damping", "viscousFriction", "loadInertia", "initialMotorVelocity"])
    theta = problem.start * 1.02 + np.array([0, 0, 0, 0, 0.3])
    found, jacobian = problem.predict_and_jacobian(theta)
    np.testing.assert_array_equal(found, problem.predict(theta))
    for k, x in enumerate(theta):
        step = np.zeros(len(theta))
        step[k] = 1e-4 * abs(x)
        differences = (problem.predict(theta + step) - problem.predict(theta - step)) / (2 * step[k])
        off = np.linalg.norm(differences - jacobian[:, k]) / np.linalg.norm(jacobian[:, k])
        assert off < 1e-6, (problem.names[k], off)


def test_scipy_finds_what_made_the_recordings():
    """Recordings of known parameters without noise; SciPy, with our derivatives, comes back to them."""
    t = np.linspace(0, 2, 801)
    current = 0.025 * np.sin(4 * t) + 0.01 * np.sin(17 * t)
    truth = {"stiffness": 3.5e-5, "damping": 4e-7}
    joint = tu.Model("TwoMassJoint")
    # In Model Exchange inputs follow their lines to the last digit.
    run = joint.simulate(t, {"motorCurrent": current}, truth, interface="model-exchange")
    recording = {"time": t, "motorCurrent": current, **{n: run[n] for n in ("motorAngle", "loadAngle")}}
    sensors = {"motorAngle": {"noise": 1e-3}, "loadAngle": {"noise": 1e-6}}
    believed = {name: 1.3 * value for name, value in truth.items()}
    problem = tu.Case(model="TwoMassJoint", train=[recording], parameters=believed, channels=sensors).problem(list(truth))
    found = scipy.optimize.least_squares(problem.residuals, problem.start, problem.jacobian, x_scale=problem.start)
    assert found.nfev < 30
    np.testing.assert_allclose(found.x, list(truth.values()), rtol=1e-4)


@pytest.mark.parametrize(
    "wrong, message, variable, file",
    [
        (lambda c, r: tu.Case(), "has no `model`", "model", None),
        (lambda c, r: tu.Case("nothing").problem([]), "a case is a folder", None, "nothing"),
        (lambda c, r: tu.identify(c, method="magic"), "no method `magic`", "magic", None),
        (lambda c, r: c.problem(["stifness"]), "did you mean `stiffness`", "stifness", None),
        (lambda c, r: c.problem(["stiffness"]).predict([np.nan]), "give a finite value", "stiffness", None),
        (lambda c, r: c.problem(["stiffness"]).predict([1.0, 2.0]), "2 values are given for 1", None, None),
        (lambda c, r: tu.Case(model="TwoMassJoin", train=[r]).problem([]), "TwoMassJoin", None, "case.toml"),
        (lambda c, r: tu.Case(model="TwoMassJoint", train=[{**r, "time": r["time"][::-1]}]).problem([]),
         "train-1.csv", None, "train-1.csv"),
        (lambda c, r: tu.Case(model="TwoMassJoint", train=[{**r, "loadAngle": r["loadAngle"][:-1]}]).problem([]),
         "columns of one length", "loadAngle", "train-1.csv"),
        (lambda c, r: tu.Case(model="TwoMassJoint", train=[{"loadAngle": r["loadAngle"]}]),
         "no `time`", "time", "train-1.csv"),
        (lambda c, r: tu.Case(model="TwoMassJoint", train=[[1, 2]]), "no named columns", None, None),
    ],
)
def test_mistakes_name_variable_file_and_mend(in_memory, recordings, wrong, message, variable, file):
    (recording,) = recordings(["train-1.csv"]).values()
    with pytest.raises(tu.Error) as caught:
        wrong(in_memory, recording)
    error = caught.value
    assert message in str(error)
    assert variable is None or error.variable == variable
    assert file is None or error.file == file
