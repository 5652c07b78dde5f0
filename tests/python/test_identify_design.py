"""`trueup identify --design`: expected standard errors over how a run begins, against bounds made here, in NumPy, from the exact
solution of the joint, and against what `identify` reports for runs that do begin so."""

import json

import numpy as np
import pytest

MOTOR, LOAD, RATIO, STIFFNESS, DAMPING, NOISE = 5.6, 1.6, 2.0, 1.4, 0.12, 2.7e-3
TIMES = np.arange(201) * 0.05
CURRENT = 0.02


def angle(offset, stiffness=STIFFNESS, damping=DAMPING):
    """Load angle of two masses, motor at rest at 0, spring released with that offset; exact by the eigenvectors."""
    twist = np.array([1.0, -RATIO])
    accelerate = np.array([-1 / MOTOR, RATIO / LOAD])
    a = np.zeros((4, 4))
    a[:2, 2:] = np.eye(2)
    a[2:, :2], a[2:, 2:] = stiffness * np.outer(accelerate, twist), damping * np.outer(accelerate, twist)
    # The motor's torque as a fifth state that stays.
    b = np.zeros((5, 5))
    b[:4, :4], b[2, 4] = a, 1 / MOTOR
    begin = np.array([0, offset, 0, 0, CURRENT])
    out, step = [begin], exponential(b * 0.05)
    for _ in TIMES[1:]:
        out.append(step @ out[-1])
    return np.array(out)[:, 1]


def exponential(m):
    """By its series; the norm of what comes here is below 1."""
    term = total = np.eye(len(m))
    for k in range(1, 30):
        term = term @ m / k
        total = total + term
    return total


def bounds(offset, *at):
    """Cramer-Rao of stiffness and damping, derivatives by central differences."""
    columns = []
    for k, value in enumerate(at):
        h = 1e-4 * value
        moved = lambda sign: angle(offset, *(v + sign * h * (i == k) for i, v in enumerate(at)))
        columns.append((moved(1) - moved(-1)) / (2 * h * NOISE))
    j = np.column_stack(columns)
    return np.sqrt(np.diag(np.linalg.inv(j.T @ j)))


def lay(folder, offset, seed=1, known=True, fit='"stiffness", "damping"', noise=NOISE):
    folder.mkdir()
    (folder / "case.toml").write_text(
        f"""model = "TwoMassJoint"
train = ["run.csv"]
[parameters]
motorInertia = {MOTOR}
loadInertia = {LOAD}
gearRatio = {RATIO}
torqueConstant = 1.0
stiffness = {1.2 * STIFFNESS}
damping = {0.8 * DAMPING}
coulombFriction = 0.0
staticFriction = 0.0
viscousFriction = 0.0
[fit]
parameters = [{fit}]
[channels.loadAngle]
noise = {noise}
"""
    )
    read = angle(offset) + np.random.default_rng(seed).normal(0, noise, len(TIMES))
    rows = np.column_stack([TIMES, np.full_like(TIMES, CURRENT), read])
    np.savetxt(folder / "run.csv", rows, delimiter=",", header="time,motorCurrent,loadAngle", comments="", fmt="%.12g")
    begin = f"initialLoadAngle = {offset}\n" if known else ""
    begin = f"[parameters]\ninitialMotorAngle = 0.0\ninitialMotorVelocity = 0.0\ninitialLoadVelocity = 0.0\n{begin}"
    (folder / "run.csv.toml").write_text(begin)
    return folder


def identified(trueup, folder, *more):
    done = trueup("identify", folder, "--fast", "--json", *more)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_errors_are_the_bounds_of_an_exact_solution(trueup, tmp_path):
    found = identified(trueup, lay(tmp_path / "a", 0.01), "--design", "initialSpringOffset=-0.08..0.08")
    at = [found["parameters"][n]["value"] for n in ("stiffness", "damping")]
    design = found["design"]
    assert len(design["values"]) == 15 and design["values"][0] == -0.08 and design["values"][-1] == 0.08
    assert design["unit"] == "rad" and design["present"]["run.csv"] == pytest.approx(0.01)
    errors = np.array([design["parameters"][n]["standard_error"] for n in ("stiffness", "damping")]).T
    own = np.array([bounds(v, *at) for v in design["values"]])
    assert np.allclose(errors, own, rtol=2e-3), errors / own
    now = [design["parameters"][n]["present"] for n in ("stiffness", "damping")]
    assert np.allclose(now, bounds(0.01, *at), rtol=2e-3)
    best = design["parameters"]["stiffness"]["best"]
    assert best["value"] == design["values"][int(own[:, 0].argmin())] and best["gain"] == pytest.approx(now[0] / own[:, 0].min(), rel=3e-3)


def test_a_run_that_begins_so_has_these_errors(trueup, tmp_path):
    """The offset is an unknown of the run, too; also by the name of the state that is set. Little noise, so that the estimates, with
    which the bound moves, are nearly the same."""
    small = lay(tmp_path / "small", 0.01, known=False, noise=0.1 * NOISE)
    large = identified(trueup, lay(tmp_path / "large", 0.07, seed=2, known=False, noise=0.1 * NOISE))
    for span in ("initialSpringOffset=-0.07..0.07", "initialLoadAngle=-0.07..0.07"):
        design = identified(trueup, small, "--design", span)["design"]["parameters"]
        for name in ("stiffness", "damping"):
            told, true = design[name]["standard_error"][-1], large["parameters"][name]["cramer_rao"]
            print(span, name, told, true, told / true, design[name]["present"] / told)
            assert abs(told / true - 1) < 0.03 and design[name]["present"] > 3 * told


@pytest.mark.full
def test_fits_scatter_as_told(trueup, tmp_path):
    """40 noises at the far end of the span: a standard deviation of 40 is known to 11 %."""
    design = identified(trueup, lay(tmp_path / "a", 0.01), "--design", "initialSpringOffset=-0.07..0.07")["design"]
    fits = [identified(trueup, lay(tmp_path / str(seed), 0.07, seed=seed)) for seed in range(100, 140)]
    for name in ("stiffness", "damping"):
        scatter = np.std([f["parameters"][name]["value"] for f in fits], ddof=1)
        told = design["parameters"][name]["standard_error"][-1]
        print(name, scatter, told, scatter / told)
        assert 0.7 < scatter / told < 1.4


def test_the_table_says_what_the_offset_is_worth(trueup, tmp_path):
    done = trueup("identify", lay(tmp_path / "a", 0.01), "--fast", "--design", "initialSpringOffset=-0.08..0.08")
    assert done.returncode == 0, done.stderr
    assert "Expected standard errors over initialSpringOffset" in done.stdout
    assert "the same runs would identify stiffness " in done.stdout and "times smaller" in done.stdout


BAD = {
    "initialSpringOfset=-0.1..0.1": (2, "did you mean `initialSpringOffset`?"),
    "weight=1..2": (2, "no such parameter"),
    "initialSpringOffset": (2, "write a parameter and its least and largest value"),
    "initialSpringOffset=0.1..-0.1": (2, "write a parameter and its least and largest value"),
    "initialSpringOffset=0..inf": (2, "write a parameter and its least and largest value"),
    "stiffness=1..2": (1, "it is an unknown of the fit"),
    "loadInertia=-1..1": (1, "loadInertia"),
}


@pytest.mark.parametrize("span", BAD)
def test_what_cannot_be_looked_at_is_said(trueup, tmp_path, span):
    status, said = BAD[span]
    done = trueup("identify", lay(tmp_path / "a", 0.01), "--fast", "--design", span)
    assert done.returncode == status and said in done.stderr and not done.stdout, done.stderr


def test_regressions_and_cases_without_unknowns_are_refused(trueup, tmp_path):
    folder, span = lay(tmp_path / "a", 0.01), "initialSpringOffset=-0.1..0.1"
    done = trueup("identify", folder, "--method", "ls", "--design", span)
    assert done.returncode == 1 and "leave out --design" in done.stderr, done.stderr
    done = trueup("identify", lay(tmp_path / "b", 0.01, fit=""), "--design", span)
    assert done.returncode == 1 and "there is nothing to estimate" in done.stderr, done.stderr
