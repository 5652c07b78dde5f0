"""FMUs of this project as those of others: variables under names that mean nothing here, with the `ports.toml` that says what they are, and
cases of a model as cases of such an FMU."""

import re
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
