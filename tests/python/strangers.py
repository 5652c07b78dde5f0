"""FMUs of this project as those of others: variables under names that mean nothing here, with a `ports.toml` for them, and
cases of a model as cases of such an FMU."""

import math
import random
import re
import subprocess
import zipfile
from pathlib import Path

# What the variables of a joint are called by somebody else.
JOINT = {
    "motorCurrent": "axis.iq", "externalTorque": "axis.tExt", "motorAngle": "axis.phiRotor", "motorVelocity": "axis.wRotor",
    "loadAngle": "axis.phiArm", "loadVelocity": "axis.wArm", "transmissionTorque": "axis.tGear", "stiffness": "cGear", "damping": "dGear",
    "coulombFriction": "tauDry", "staticFriction": "tauBreak", "viscousFriction": "bRotor", "motorInertia": "jRotor", "loadInertia": "jArm",
    "torqueConstant": "kT", "gearRatio": "iGear", "initialMotorAngle": "phiRotor0", "initialMotorVelocity": "wRotor0",
    "initialLoadAngle": "phiArm0", "initialLoadVelocity": "wArm0",
}


def fmu(file, target, names):
    """The FMU with these names for its variables; those without one keep theirs."""
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as into:
        for item in old.infolist():
            data = old.read(item)
            if item.filename == "modelDescription.xml":
                text = data.decode()
                begin, end = text.index("<ModelVariables>"), text.index("</ModelVariables>")
                part = re.sub(
                    r'(<(?:ScalarVariable|Float64|Int32|UInt64|Boolean|Enumeration)\b[^>]*? name=)"([^"]+)"',
                    lambda m: f'{m[1]}"{names.get(m[2], m[2])}"', text[begin:end],
                )
                data = (text[:begin] + part + text[end:]).encode()
            elif not item.filename.startswith("binaries/"):
                continue
            into.writestr(item, data)
    return target


def joint_ports(file, gear_ratio=44340.0, torque_constant=0.02, names=JOINT, without=()):
    """`ports.toml` of a joint; `without`: roles that are left out."""
    roles = {
        "current": "motorCurrent", "motorAngle": "motorAngle", "motorVelocity": "motorVelocity", "linkAngle": "loadAngle",
        "linkVelocity": "loadVelocity", "externalTorque": "externalTorque", "transmissionTorque": "transmissionTorque",
        "stiffness": "stiffness", "damping": "damping",
    }
    lines = [f'{role} = "{names[v]}"' for role, v in roles.items() if role not in without]
    figures = [f"gearRatio = {gear_ratio!r}", f"torqueConstant = {torque_constant!r}"]
    sensors = [f'"{names[v]}" = {{ kind = "{k}" }}' for v, k in (("motorAngle", "encoder"), ("loadAngle", "encoder"))]
    return "\n".join([f'fmu = "{Path(file).name}"', "[joint.1]", *lines, *figures, "[sensors]", *sensors]) + "\n"


def case(folder, target, file, names=JOINT):
    """A case of the joint as one of this FMU. Its ports are those of the FMU as it was packed, whatever the case gives."""
    target.mkdir(parents=True)
    text = (folder / "case.toml").read_text()
    new = lambda name: f'"{names[name]}"' if name in names else name  # noqa: E731
    text = text.replace('model = "TwoMassJoint"', f'model = "{file.name}"\nports = "ports.toml"')
    text = re.sub(r"^(\w+)( = )", lambda m: new(m[1]) + m[2], text, flags=re.M)
    text = re.sub(r"^\[channels\.(\w+)\]", lambda m: f"[channels.{new(m[1])}]", text, flags=re.M)
    (target / "case.toml").write_text(text)
    (target / file.name).symlink_to(file.resolve())
    (target / "ports.toml").write_text(joint_ports(file, names=names))
    for log in folder.glob("*.csv"):
        header, rest = log.read_text().split("\n", 1)
        (target / log.name).write_text(",".join(names.get(c, c) for c in header.split(",")) + "\n" + rest)
    return target


# Variables of joint.c in the order of their references: name, causality, unit, start value.
WRITTEN = [
    ("tauCmd", "input", "N.m", 0), ("tauExt", "input", "N.m", 0), ("phi", "output", "rad", None), ("w", "output", "rad/s", None),
    ("q", "output", "rad", None), ("v", "output", "rad/s", None), ("Jm", "parameter", "kg.m2", 2e-5), ("Jl", "parameter", "kg.m2", 0.5),
    ("c", "parameter", "N.m/rad", 0.3), ("d", "parameter", "N.m.s/rad", 4e-4), ("fc", "parameter", "N.m", 0.02),
    ("b", "parameter", "N.m.s/rad", 3e-5), ("n", "parameter", "1", 100), ("phi0", "parameter", "rad", 0), ("w0", "parameter", "rad/s", 0),
    ("q0", "parameter", "rad", 0), ("v0", "parameter", "rad/s", 0),
]
WRITTEN_PORTS = """fmu = "written.fmu"
[joint.1]
torque = "tauCmd"
externalTorque = "tauExt"
motorAngle = "phi"
motorVelocity = "w"
linkAngle = "q"
linkVelocity = "v"
gearRatio = 100
[sensors]
phi = { kind = "encoder" }
q = { kind = "encoder" }
"""


def written(folder):
    """The FMU of joint.c."""
    library = folder / "joint.so"
    subprocess.run(["cc", "-O1", "-shared", "-fPIC", Path(__file__).with_name("joint.c"), "-o", library, "-lm"], check=True)
    rows, states = [], ["phi", "w", "q", "v"]
    for k, (name, causality, unit, start) in enumerate(WRITTEN):
        variability = "fixed" if causality == "parameter" else "continuous"
        first = f' start="{start}"' if start is not None else ""
        initial = ' initial="calculated"' if causality == "output" else ""
        rows.append(
            f'<ScalarVariable name="{name}" valueReference="{k}" causality="{causality}" variability="{variability}"{initial}>'
            f'<Real unit="{unit}"{first}/></ScalarVariable>'
        )
    index = {name: k + 1 for k, (name, *_) in enumerate(WRITTEN)}
    for k, name in enumerate(states):
        rows.append(f'<ScalarVariable name="der({name})" valueReference="{100 + k}" variability="continuous"><Real derivative="{index[name]}"/></ScalarVariable>')
    units = {"N.m": "kg='1' m='2' s='-2'", "rad": "rad='1'", "rad/s": "rad='1' s='-1'", "kg.m2": "kg='1' m='2'", "1": ""}
    units |= {"N.m/rad": "kg='1' m='2' s='-2' rad='-1'", "N.m.s/rad": "kg='1' m='2' s='-1' rad='-1'"}
    unknown = lambda all: "".join(f'<Unknown index="{k}"/>' for k in all)  # noqa: E731
    rates = [len(WRITTEN) + 1 + k for k in range(4)]
    xml = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Written" guid="written" numberOfEventIndicators="1">
<ModelExchange modelIdentifier="joint"/>
<UnitDefinitions>{"".join(f'<Unit name="{u}"><BaseUnit {b}/></Unit>' for u, b in units.items())}</UnitDefinitions>
<ModelVariables>{"".join(rows)}</ModelVariables>
<ModelStructure><Outputs>{unknown(index[s] for s in states)}</Outputs><Derivatives>{unknown(rates)}</Derivatives>
<InitialUnknowns>{unknown([*(index[s] for s in states), *rates])}</InitialUnknowns></ModelStructure>
</fmiModelDescription>"""
    with zipfile.ZipFile(folder / "written.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", xml)
        archive.write(library, "binaries/linux64/joint.so")
    return folder / "written.fmu"


def recorded(file, seed, gravity, seconds=12.0, step=2e-3, parts=20):
    """A made recording of that joint with a weight (N.m), by small steps of its own."""
    p = {name: start for name, causality, _, start in WRITTEN if causality == "parameter"}
    dice, h, lines = random.Random(seed), step / parts, ["time,tauCmd,phi,q"]
    waves = [(dice.uniform(0.02, 0.06), dice.uniform(0.15, 0.9), dice.uniform(0, 6.28)) for _ in range(4)]
    phi = w = q = v = 0.0
    for k in range(int(seconds / step)):
        t = k * step
        tau = sum(a * math.sin(6.283 * f * t + s) for a, f, s in waves)
        count = 6.283 / 4096
        reading = round((phi + dice.gauss(0, 0.3) * count) / count) * count, round(q / 2e-5 + dice.gauss(0, 0.3)) * 2e-5
        lines.append(f"{t:.4f},{tau:.7f},{reading[0]:.6f},{reading[1]:.7f}")
        for _ in range(parts):
            spring = p["c"] * (phi - 100 * q) + p["d"] * (w - 100 * v)
            free = tau - spring - p["b"] * w
            after = w + h * (free - math.copysign(p["fc"], w if w else free)) / p["Jm"]
            # Friction holds, or brings to rest within the step.
            if w == 0:
                after = 0.0 if abs(free) <= p["fc"] else after
            elif after * w < 0:
                after = 0.0
            v += h * (100 * spring - gravity * math.sin(q)) / p["Jl"]
            w = after
            phi, q = phi + h * w, q + h * v
    file.write_text("\n".join(lines) + "\n")


def written_case(folder, gravity):
    """A case of the FMU of joint.c."""
    folder.mkdir()
    written(folder)
    (folder / "ports.toml").write_text(WRITTEN_PORTS)
    names = ["train-1.csv", "train-2.csv", "holdout-1.csv"]
    for seed, name in enumerate(names):
        recorded(folder / name, seed, gravity)
    (folder / "case.toml").write_text(
        'model = "written.fmu"\nports = "ports.toml"\ntrain = ["train-1.csv", "train-2.csv"]\nholdout = ["holdout-1.csv"]\n'
        "[parameters]\n" + "".join(f"{n} = {start}\n" for n, _, _, start in WRITTEN[6:12]) + "[uncertain]\nJm = 0.05\nJl = 0.05\nc = 0.05\nd = 0.2\nfc = 0.1\nb = 0.2\n"
        '[channels.tauCmd]\ninterpolation = "hold"\n[channels.phi]\nresolution = 1.534e-3\nnoise = 6.4e-4\n'
        "[channels.q]\nresolution = 2e-5\nnoise = 8e-6\n"
    )
    return folder
