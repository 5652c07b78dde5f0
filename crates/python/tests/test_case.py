"""Cases: the program's JSON from folders and from arrays; exact sensitivities."""

import json
import pickle

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
    left_out = ("inputs", "augmented")  # hashes of files, and names of files
    assert "inputs" not in found.json and "inputs" in diagnosis.json
    assert {k: v for k, v in found.json.items() if k not in left_out} == {
        k: v for k, v in diagnosis.json.items() if k not in left_out
    }


def test_a_diagnosis_shows_itself(diagnosis):
    assert diagnosis.verdict == "effects" and diagnosis.effects[0]["id"] == "backlash"
    assert "backlash" in diagnosis._repr_html_() and "backlash" in repr(diagnosis)
    assert diagnosis.gap["overall"]["after"] < diagnosis.gap["overall"]["before"]
    assert "backlash" in set(diagnosis.candidates["id"])


def test_a_report_of_arrays_is_written(in_memory, tmp_path):
    short = tu.diagnose(in_memory, verdict_only=True)
    page = short.report(tmp_path / "out")
    assert page.is_file() and (tmp_path / "out" / "diagnosis.json").is_file()


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
