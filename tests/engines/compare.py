"""One evaluation of a robot's accelerations: SpatialFreeFlyer, Pinocchio's `aba` and MuJoCo's `mj_forward`, both called from
C++ without Python. Needs a C++ compiler and, by pip, `pin`, `cmeel-eigen` and `mujoco`:

    cargo build --release --workspace --example space_speed
    python tests/engines/compare.py [--rounds 7]

Runs alternate; ratios are medians over the rounds with the range of their middle half."""

import argparse
import glob
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
OURS = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release/examples/space_speed"


def site(name):
    module = __import__(name)
    return Path(module.__file__).parent


def run(*command, text=None):
    done = subprocess.run(list(map(str, command)), input=text, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{command[0]}: {done.stderr}")
    return done.stdout


def build(folder):
    prefix = next(p for p in site("pinocchio").parents if (p / "include/pinocchio").is_dir())
    flags = [
        "-O3", "-DNDEBUG", "-std=c++17", "-w", f"-I{prefix}/include", f"-I{prefix}/include/eigen3",
        # How its library was built.
        "-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",
    ]
    libraries = [f"-L{prefix}/lib", f"-Wl,-rpath,{prefix}/lib", "-lpinocchio_default", "-lboost_filesystem", "-lboost_serialization"]
    run("g++", *flags, HERE / "speed.cpp", "-o", folder / "pinocchio", *libraries)
    mujoco = site("mujoco")
    (library,) = glob.glob(f"{mujoco}/libmujoco.so*")
    run("g++", "-O3", "-DMUJOCO", "-std=c++17", f"-I{mujoco}/include", HERE / "speed.cpp", "-o", folder / "mujoco", library,
        f"-Wl,-rpath,{Path(library).parent}")


def xml(robot):
    rows = [list(map(float, line.split())) for line in robot.splitlines()]

    def inertial(mass, com, i):
        full = [i[0], i[4], i[8], i[1], i[2], i[5]]
        return f'<inertial pos="{text(com)}" mass="{mass}" fullinertia="{text(full)}"/>'

    def text(values):
        return " ".join(map(repr, values))

    def body(k):
        v = rows[k]
        carried = "".join(body(c) for c in range(1, len(rows)) if rows[c][0] == k)
        return (
            f'<body pos="{text(v[14:17])}"><joint type="hinge" axis="{text(v[17:20])}"/>'
            f"{inertial(v[1], v[2:5], v[5:14])}{carried}</body>"
        )

    arms = "".join(body(c) for c in range(1, len(rows)) if rows[c][0] == 0)
    return (
        '<mujoco><compiler angle="radian"/><option gravity="0 0 0"><flag contact="disable" constraint="disable"/></option>'
        f'<worldbody><body><freejoint/>{inertial(rows[0][0], [0.0] * 3, rows[0][1:])}{arms}</body></worldbody></mujoco>'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        build(folder)
        robot = run(OURS, "robot", "chaser")
        (folder / "chaser.xml").write_text(xml(robot))
        ways = {
            "chaser": lambda: run(OURS, "chaser"),
            "chaser, Pinocchio aba": lambda: run(folder / "pinocchio", text=robot),
            "chaser, MuJoCo mj_forward": lambda: run(folder / "mujoco", folder / "chaser.xml"),
            "chaser with two panels": lambda: run(OURS, "chaser-panels"),
            "12 bodies": lambda: run(OURS, "12"),
            "24 bodies": lambda: run(OURS, "24"),
            "arm of S1 on a bus": lambda: run(OURS, "rigid"),
            "the same with two panels": lambda: run(OURS, "panels"),
            "chaser over Dual<8>": lambda: run(OURS, "dual"),
        }
        times = {name: [] for name in ways}
        for _ in range(rounds):
            for name, way in ways.items():
                times[name].append(float(way()))
    print(f"| evaluation | ns, median of {rounds} |\n|---|---|")
    for name, all in times.items():
        print(f"| {name} | {statistics.median(all):.0f} |")
    print("\n| ratio | median | middle half |\n|---|---|---|")
    for name, of, to in [
        ("chaser / Pinocchio's aba", "chaser", "chaser, Pinocchio aba"),
        ("chaser / MuJoCo's mj_forward", "chaser", "chaser, MuJoCo mj_forward"),
        ("24 bodies / 12 bodies", "24 bodies", "12 bodies"),
        ("chaser with two panels / without", "chaser with two panels", "chaser"),
        ("arm of S1 with two panels / without", "the same with two panels", "arm of S1 on a bus"),
        ("over Dual<8> / f64", "chaser over Dual<8>", "chaser"),
    ]:
        ratios = sorted(a / b for a, b in zip(times[of], times[to]))
        low, _, high = statistics.quantiles(ratios, n=4)
        print(f"| {name} | {statistics.median(ratios):.2f} | {low:.2f} to {high:.2f} |")


if __name__ == "__main__":
    main()
