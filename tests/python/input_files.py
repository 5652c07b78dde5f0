"""Ways to change cases, systems, sweeps and robots as people write them; test_bad_inputs.py runs them."""

from input_desk import CASE, CSV, ROBOT, SIDECAR, SSD, SWEEP, SYSTEM, URDF, noted, package, refused, same, way


@way
def a_sidecar_that_fits(desk, rng):
    lines = CSV.splitlines()
    rows = [line.split(",") for line in lines[1:]]
    desk.write("in.csv", "time,I,angle\n" + "".join(f"{t},{float(i) * 2},{e}\n" for t, i, e in rows))
    desk.write("in.toml", SIDECAR)
    return same("input")


@way
def a_sidecar_with_a_mistake(desk, rng):
    desk.write("in.csv", CSV.replace("motorCurrent", "I").replace("externalTorque", "angle"))
    old, new, words = rng.choice([
        ("[columns]", "[colums]", ("`colums`", "`columns`")),
        ("I =", "J =", ("no column `J`",)),
        ("scale = 0.5", "scale = 0", ("`scale` is 0",)),
        ("scale = 0.5", 'scale = "x"', ("`scale`",)),
        ('unit = "N.m"', 'unit = "Newtons"', ("`Newtons`",)),
        ("[columns]", "rate = -5\n[columns]", ("`rate` is -5",)),
        ('"linear"', '"cubic"', ("`interpolation`",)),
        ("scale = 0.5 }", "scale = 0.5", ()),
    ])
    desk.write("in.toml", SIDECAR.replace(old, new))
    return refused("input", "in.toml:", *words)


@way
def a_case_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ("[parameters]", "[parameter]", ("`parameters`",)),
        ("stiffness = 3.07e-5", "stifness = 3.07e-5", ("`stiffness`",)),
        ('["hold.csv"]', '["gone.csv"]', ("gone.csv",)),
        ("3.07e-5", '"3.07e-5"', ("stiffness",)),
        ('["hold.csv"]', '["run.csv"]', ("`run.csv`", "holdout")),
        ("TwoMassJoint", "TwoMasJoint", ("TwoMassJoint",)),
        ("noise = 1e-3", "noise = -1", ("`noise` is -1",)),
        ("motorAngle]", "motorAngel]", ("`motorAngle`",)),
        ("gearRatio = 160", "gearRatio = inf", ("gearRatio",)),
        ("[fit]", "[fit", ("case.toml:",)),
        ("[fit]", "[recordings]\nrate = 0\n[fit]", ("`rate` is 0",)),
        ('train = ["run.csv"]\n', "", ("train",)),
    ])
    desk.write("case/case.toml", CASE.replace(old, new, 1))
    return refused("case", "case", *words)


@way
def a_recording_with_a_mistake(desk, rng):
    path = desk.folder / "case" / "run.csv"
    lines = path.read_text().splitlines()
    row = rng.randrange(3, len(lines))
    cells = lines[row].split(",")
    words, change = rng.choice([
        (("is no number",), lambda: cells.__setitem__(2, "bad")),
        (("jumps back",), lambda: cells.__setitem__(0, "-1")),
        (("cells under 3 names",), lambda: cells.pop()),
        (("an infinite value",), lambda: cells.__setitem__(1, "inf")),
    ])
    change()
    lines[row] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    return refused("case", f"run.csv:{row + 1}:", *words)


@way
def a_system_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ("c.motorCurrent ->", "c.motorCurent ->", ("system.toml:1", "`motorCurrent`")),
        ('-> c.motorAngle"', '-> c.motorAngle", "p.loadAngle -> c.motorAngle"', ("system.toml:1", "driven twice")),
        ("stop = 0.2", "stopp = 0.2", ("system.toml:5", "`stop`")),
        ("step = 0.01", 'step = "x"', ("system.toml:6", "`step`")),
        ("stiffness = 3.07e-5", 'stiffness = "x"', ("system.toml:10", "stiffness")),
        ("stiffness = 3.07e-5", "stiffnes = 3.07e-5", ("system.toml:10", "`stiffness`")),
        ("stiffness = 3.07e-5", 'stiffness = { value = 1, unit = "furlong" }', ("system.toml:10", "furlong")),
        ("stiffness = 3.07e-5", 'stiffness = { value = 1, unit = "kg" }', ("system.toml:10", "kg")),
        ('"P_PI"', '"PPI"', ("system.toml:14", "P_PI")),
        ("JointController.fmi3", "JointControler.fmi3", ("system.toml:12", "JointController.fmi3.fmu")),
        ('record = ["p.motorAngle"]', 'record = ["p.motorAngel"]', ("system.toml:2", "motorAngle")),
        ("[components.c]", "[components.c", ("system.toml:12",)),
        ("-> p.motorCurrent", "-> p.motorAngle", ("system.toml:1", "output")),
    ])
    desk.write("system.toml", SYSTEM.replace(old, new, 1))
    return refused("system", *words)


@way
def parameters_in_a_unit_of_everybody(desk, rng):
    value, unit = rng.choice([("3.07e-2", "N.mm/rad"), ("3.07e-3", "N.cm/rad"), ("3.07e-8", "kN.m/rad"), ("30.7", "uN.m/rad")])
    package(desk, (value, unit))
    return same("ssp")


@way
def parameters_in_a_unit_of_nobody(desk, rng):
    unit = rng.choice(["furlong", "N.m/foo", "blob", "kg"])
    package(desk, ("3.07e-5", unit))
    return refused("ssp", "p.ssv:4", unit)


@way
def a_mapping_that_leaves_something_out(desk, rng):
    left = rng.choice(["k", "n"])
    package(desk, entries=[e for e in (("k", "stiffness"), ("n", "gearRatio")) if e[0] != left])
    # What is left out has its start value in the run.
    return noted("ssp", "m.ssm", "left out", left, results=False)


@way
def a_mapping_without_entries(desk, rng):
    package(desk, entries=())
    return noted("ssp", "m.ssm", "left out", "k, n", results=False)


@way
def a_mapping_of_what_is_not_there(desk, rng):
    package(desk, entries=(("k", "stiffness"), ("n", "gearRatio"), (rng.choice(["kk", "K", "q"]), "damping")))
    return noted("ssp", "m.ssm", "does not have")


@way
def a_target_that_is_not_there(desk, rng):
    wrong = rng.choice(["stifness", "k", "spring"])
    package(desk, entries=(("k", wrong), ("n", "gearRatio")))
    return noted("ssp", "left out", wrong, results=False)


@way
def an_archive_that_is_damaged(desk, rng):
    path = package(desk)
    bytes_ = path.read_bytes()
    path.write_bytes(bytes_[: rng.randrange(10, len(bytes_) - 30)])
    return refused("ssp", "system.ssp")


@way
def xml_that_is_none(desk, rng):
    old = rng.choice(["</ssd:Elements>", '<ssd:System name="root">', "</ssd:ParameterBindings>"])
    package(desk, ssd=SSD.replace(old, "", 1))
    return refused("ssp", "SystemStructure.ssd:", "XML")


@way
def a_sweep_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ('"c.positionReference"', '"p.stiffness"', ("sweep.toml:6", "varied by `k` already", "sweep.toml:5")),
        ('"c.positionReference"', '["c.positionReference", "p.stiffness"]', ("sweep.toml:6", "varied by `k` already")),
        ("points = 2", "points = 1", ("sweep.toml:6", "points")),
        ('design = "grid"', 'design = "gird"', ("sweep.toml:2", "grid")),
        ("[outputs]", "[output]", ("sweep.toml", "output")),
        ('"p.stiffness"', '"p.stifness"', ("sweep.toml:5", "stiffness")),
        ('"p.motorAngle"', '"p.motorAngel"', ("sweep.toml:9", "motorAngle")),
        ("[1e-5, 3e-5]", "[]", ("sweep.toml",)),
        ('"system.toml"', '"sytem.toml"', ("sytem.toml",)),
    ])
    desk.write("sweep.toml", SWEEP.replace(old, new, 1))
    return refused("sweep", *words)


@way
def a_urdf_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ('link name="fore"', 'link name="upper"', ("arm.urdf:4", "`upper` is defined in line 3 already")),
        ('joint name="elbow"', 'joint name="shoulder"', ("arm.urdf:6", "`shoulder` is defined in line 5 already")),
        ('<mass value="3"/>', "", ("arm.urdf:3", "<mass>")),
        ('<mass value="3"/>', '<mass value="three"/>', ("arm.urdf:3", "three")),
        ('<mass value="3"/>', '<mass value="0"/>', ("arm.urdf:3", "`upper`", "mass")),
        ('<parent link="upper"/>', '<parent link="uper"/>', ("arm.urdf:6", "`upper`")),
        ('<parent link="foot"/>', '<parent link="fore"/>', ("arm.urdf:5", "loop")),
        ('<origin xyz="0 0 0.4"/>', '<origin xyz="0 0"/>', ("arm.urdf:5", "3 finite")),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', ("arm.urdf", "`upper`", "axis")),
        ('iyy="0.03"', 'iyy="-0.03"', ("arm.urdf", "`base`", "above 0")),
        ('type="revolute"', 'type="planar"', ("arm.urdf:5", "planar")),
        ("</robot>", "", ("arm.urdf",)),
    ])
    desk.write("arm.urdf", URDF.replace(old, new, 1))
    return refused("urdf", *words)


@way
def a_urdf_with_more_than_is_read(desk, rng):
    old, new, words = rng.choice([
        ("<axis", '<limit lower="-1" upper="1" effort="1" velocity="1"/><axis', ("<limit> of 1 joint (shoulder)",)),
        ("<axis", '<calibration rising="0"/><axis', ("<calibration> of 1 joint (shoulder)",)),
        ('izz="0.02"', 'izz="0.9"', ("`base`", "larger than the sum", "used as it is")),
    ])
    desk.write("arm.urdf", URDF.replace(old, new, 1))
    return noted("urdf", "arm.urdf", *words, results=False)


@way
def a_robot_with_a_mistake(desk, rng):
    old, new, words = rng.choice([
        ("position = [0.3", "positions = [0.3", ("robot.toml:10", "positions")),
        ("mass = 2.0", 'mass = "2"', ("robot.toml:7",)),
        ("mass = 2.0", "mass = 0.0", ("robot.toml", "`upper`", "mass")),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 0.0]", ("robot.toml", "`upper`", "axis")),
        ('name = "upper"', 'name = "upper"\nparent = "lower"', ("robot.toml", "`lower`")),
        ('name = "hand"', 'name = "hand"\nbody = "uper"', ("robot.toml", "`upper`")),
        ("[[5.0,", "[[-5.0,", ("robot.toml", "`base`", "above 0")),
        ("[[tip]]", "[[tip]", ("robot.toml",)),
    ])
    desk.write("robot.toml", ROBOT.replace(old, new, 1))
    return refused("robot", *words)
