"""What is wrong with a case or a recording is reported by `trueup identify` before anything is fitted, with the file and the remedy."""

import pytest

HEALTHY = "time,motorCurrent,motorAngle,loadAngle\n" + "".join(
    f"{k * 0.01:.2f},{0.02 if k % 40 < 20 else -0.02},{k * k * 0.01:.4f},{k * k * 2.2e-7:.9f}\n" for k in range(200)
)
CASE = 'model = "TwoMassJoint"\ntrain = ["run.csv"]\n'


def table(header, *rows):
    return "\n".join((header, *rows)) + "\n"


# Name: files that differ from the healthy case (None: not there), parts of the message.
BROKEN = {
    "no case": ({"case.toml": None}, "case.toml"),
    "no recording": ({"run.csv": None}, "run.csv"),
    "broken TOML": ({"case.toml": CASE + "[parameters\n"}, "case.toml:3"),
    "no model": ({"case.toml": 'train = ["run.csv"]\n'}, "there is no `model`"),
    "unknown model": ({"case.toml": CASE.replace("TwoMass", "ThreeMass")}, "ThreeMassJoint"),
    "no training": ({"case.toml": 'model = "TwoMassJoint"\n'}, "no recording to train on"),
    "unknown key": ({"case.toml": "trian = 1\n" + CASE}, "trian"),
    "unknown parameter": ({"case.toml": CASE + "[parameters]\nstifness = 1\n"}, "stifness"),
    "parameter no number": ({"case.toml": CASE + '[parameters]\nstiffness = "much"\n'}, "stiffness"),
    "negative inertia": ({"case.toml": CASE + "[parameters]\nmotorInertia = -1\n"}, "motorInertia"),
    "uncertainty without a value": ({"case.toml": CASE + "[uncertain]\nstiffness = 0.1\n"}, "[parameters] has no value"),
    "uncertainty below 0": ({"case.toml": CASE + "[parameters]\nstiffness = 1\n[uncertain]\nstiffness = -0.1\n"}, "the uncertainty of `stiffness` is -0.1"),
    "fit of nothing": ({"case.toml": CASE + '[fit]\nparameters = ["mass"]\n'}, "no parameter `mass`"),
    "fit of an initial state": ({"case.toml": CASE + '[fit]\nparameters = ["initialLoadAngle"]\n'}, "initialLoadAngle"),
    "holdout in train": ({"case.toml": CASE + 'holdout = ["run.csv"]\n'}, "in `holdout` and in `train`"),
    "two joints": ({"case.toml": CASE + "[parameters]\njointFlexible = [true, true]\n"}, "jointFlexible"),
    "unknown channel": ({"case.toml": CASE + "[channels.motorAngel]\nnoise = 1\n"}, "motorAngel"),
    "noise below 0": ({"case.toml": CASE + "[channels.motorAngle]\nnoise = -1\n"}, "noise"),
    "repeats of one": ({"case.toml": CASE + 'repeats = [["run.csv"]]\n'}, "group of one"),
    "empty file": ({"run.csv": ""}, "the file is empty"),
    "header alone": ({"run.csv": "time,motorAngle\n"}, "no row after the header"),
    "semicolons": ({"run.csv": "time;motorAngle\n0,0;1,5\n"}, "semicolons"),
    "no header": ({"run.csv": table("0,1,2", "0.1,1,2")}, "name the columns"),
    "no time": ({"run.csv": table("t,motorAngle", "0,1")}, "no column `time`"),
    "clock back": ({"run.csv": table("time,motorAngle", "0,1", "2,1", "1,1")}, "run.csv:4"),
    "constant clock": ({"run.csv": table("time,motorAngle", "0,1", "1,1", "1,1")}, "repeats 1 s"),
    "a word": ({"run.csv": table("time,motorAngle", "0,1", "1,oops")}, '"oops"'),
    "infinite": ({"run.csv": table("time,motorAngle", "0,1", "1,inf")}, "run.csv:3"),
    "short row": ({"run.csv": table("time,motorCurrent,motorAngle", "0,0,0", "1,1")}, "run.csv:3"),
    "twice a name": ({"run.csv": table("time,motorAngle,motorAngle", "0,1,2")}, "two columns"),
    "no value": ({"run.csv": table("time,motorAngle", "0,", "1,nan")}, "no value"),
    "no input": ({"run.csv": table("time,motorAngle", *(f"{k},{k}" for k in range(30)))}, "no input of the model"),
    "no output": ({"run.csv": table("time,motorCurrent", *(f"{k},{k}" for k in range(30)))}, "no output of the model"),
    "a unit that cannot be": ({"run.csv.toml": '[columns]\nmotorAngle = { variable = "motorAngle", unit = "kg" }\n'}, "kg"),
}


def lay(folder, files):
    for name, text in ({"case.toml": CASE, "run.csv": HEALTHY} | files).items():
        if text is not None:
            (folder / name).write_text(text)


@pytest.mark.parametrize("name", BROKEN)
def test_broken_cases_are_refused_with_their_message(trueup, tmp_path, name):
    files, said = BROKEN[name]
    lay(tmp_path, files)
    done = trueup("identify", tmp_path, "--json", "--fast")
    assert done.returncode == 1, done.stderr
    assert said in done.stderr and not done.stdout, done.stderr
    assert "panicked" not in done.stderr


def test_wrong_usage(trueup, tmp_path):
    lay(tmp_path, {})
    done = trueup("identify", tmp_path, "--method", "guess")
    assert done.returncode == 2 and "there is no method `guess`" in done.stderr
    assert trueup("identify").returncode == 2


def test_at_least_25_kinds():
    assert len(BROKEN) >= 25
