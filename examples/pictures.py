"""Draws the picture of each example from runs of the program: python3 examples/pictures.py PATH-OF-TRUEUP [--into DIR] [NAME...]

A NAME is that of a folder here; without one all are drawn, in a minute or two (06-backlash is a diagnosis, 04-capture 1681 runs).
Needs pyarrow, which reads the tables of sweeps.
"""

import argparse
import csv
import json
import math
import re
import shutil
import subprocess
import tempfile
from collections import Counter
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent
RED, BLUE, GREEN, ORANGE, GREY, INK = "#c0392b", "#1f6fb2", "#2e8b57", "#d98200", "#8a8f98", "#222"


def svg(width, height, items):
    style = "text{font:13px sans-serif;fill:%s} .t{font-size:15px;font-weight:bold} path,line{fill:none}" % INK
    body = "\n".join(items)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">\n'
        f'<style>{style}</style>\n<rect width="{width}" height="{height}" fill="#fff"/>\n{body}\n</svg>\n'
    )


def text(x, y, words, anchor="start", kind="", color=None):
    paint = f' style="fill:{color}"' if color else ""
    return f'<text{paint} x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" class="{kind}">{words}</text>'


def line(points, color, width=1.5):
    steps = " L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{steps}" stroke="{color}" stroke-width="{width}"/>'


class Axes:
    """A frame of 560 by 240 with its ticks, and the curves that are drawn in it."""

    def __init__(self, title, x, y, x_ticks, y_ticks, logarithmic=False):
        of = math.log10 if logarithmic else float
        (x0, x1), (y0, y1) = ((of(x_ticks[0]), of(x_ticks[-1])), (y_ticks[0], y_ticks[-1]))
        self.x = lambda v: 70 + 560 * (of(v) - x0) / (x1 - x0)
        self.y = lambda v: 280 - 240 * (v - y0) / (y1 - y0)
        self.items = [text(70, 24, title, kind="t")]
        for v in y_ticks:
            self.items += [line([(70, self.y(v)), (630, self.y(v))], "#e3e5e8", 1), text(62, self.y(v) + 4, f"{v:g}", "end")]
        self.items += [text(self.x(v), 298, f"{v:g}", "middle") for v in x_ticks]
        self.items += [text(630, 316, x, "end"), text(14, 24, y)]

    def curve(self, points, color, width=1.5):
        points = list(points)
        # More points than a screen shows are of no use.
        kept = points[:: max(1, len(points) // 250)] + points[-1:]
        self.items.append(line([(self.x(a), self.y(b)) for a, b in kept], color, width))

    def legend(self, names, at=430, top=60):
        self.items += [text(at, top + 18 * k, name, color=color) for k, (name, color) in enumerate(names.items())]

    def drawn(self):
        return svg(660, 325, self.items)


def column(path, *names):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    return [[float(row[name]) for row in rows] for name in names]


class Bench:
    """A copy of the examples, next to the packed FMUs, in which the program runs."""

    def __init__(self, trueup, folder):
        self.trueup, self.folder = trueup, folder
        shutil.copytree(EXAMPLES, folder / "examples")

    def run(self, *arguments):
        done = subprocess.run([self.trueup, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    def pack(self, *models):
        self.run("fmu", "pack", *models, "--fmi", "3", "-o", "out")

    def sweep(self, file):
        """The table of its runs, by columns."""
        import pyarrow.parquet

        self.run("sweep", file)
        self.run("sweep", "merge", file, "-o", "runs.parquet")
        return pyarrow.parquet.read_table(self.folder / "runs.parquet").to_pydict()


def joint(bench):
    """The step response of the load under three control laws."""
    bench.pack("TwoMassJoint", "JointController")
    axes = Axes("Load angle after a step of the reference to 0.1 rad", "s", "rad", range(6), [0, 0.02, 0.04, 0.06, 0.08, 0.1])
    laws = {"P_PI": RED, "WBC": GREY, "VWBC": BLUE}
    for law, color in laws.items():
        bench.run("simulate", "examples/01-joint/joint.toml", "--stop", 5, "--set", f"controller.strategy={law}", "-o", "run.csv")
        axes.curve(zip(*column(bench.folder / "run.csv", "time", "plant.loadAngle")), color)
    axes.legend(laws, top=180)
    return axes.drawn()


def arm(bench):
    """Every link at some times, by the lengths and the mount of the default parameters; the hand is compared with the FMU's."""
    bench.pack("PlanarManipulator", "ManipulatorController")
    bench.run("simulate", "examples/02-arm/arm.toml", "--set", "controller.positionReference=0.8,0,0", "-o", "arm.csv")
    names = ["time", "arm.basePosition[1]", "arm.basePosition[2]", "arm.baseAttitude", *(f"arm.jointAngle[{k}]" for k in (1, 2, 3))]
    rows = list(zip(*column(bench.folder / "arm.csv", *names, "arm.tipPosition[1]", "arm.tipPosition[2]")))
    mount, lengths, side = (0.337, -0.001), (0.449, 0.449, 0.31), 0.3

    def poses(row):
        _, bx, by, phi, *angles, tx, ty = row
        place = lambda u, v: (bx + math.cos(phi) * u - math.sin(phi) * v, by + math.sin(phi) * u + math.cos(phi) * v)
        body = [place(u, v) for u, v in ((side, side), (side, -side), (-side, -side), (-side, side), (side, side))]
        chain, heading = [place(*mount)], phi
        for angle, length in zip(angles, lengths):
            heading += angle
            chain.append((chain[-1][0] + length * math.cos(heading), chain[-1][1] + length * math.sin(heading)))
        assert math.hypot(chain[-1][0] - tx, chain[-1][1] - ty) < 1e-6, "the hand is not where the FMU has it"
        return body, chain

    x, y = (lambda p: 160 + 220 * p), (lambda p: 185 - 220 * p)
    flat = lambda points: [(x(a), y(b)) for a, b in points]
    items = [text(20, 28, "Joint 1 turns by 0.8 rad; the free base turns the other way", kind="t")]
    shown = [0, 10, 20, 30, 40, rows[-1][0]]
    for t in shown:
        row = min(rows, key=lambda r: abs(r[0] - t))
        body, chain = poses(row)
        color = RED if t == 0 else BLUE if t == shown[-1] else "#c3c8d0"
        items += [line(flat(body), color, 1.2), line(flat(chain), color, 2.2)]
        items += [f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{color}"/>' for a, b in flat(chain)]
    last = rows[-1]
    items.append(text(20, 315, f"red: 0 s; blue: {last[0]:.0f} s, joint 1 at {last[4]:.3f} rad, base at {last[3]:.3f} rad"))
    return svg(620, 330, items)


def sweep(bench):
    """The time to 90 % of the reference over the stiffness, one curve a control law."""
    bench.pack("TwoMassJoint", "JointController")
    table = bench.sweep("examples/03-sweep/sweep.toml")
    runs = list(zip(table["strategy"], table["stiffness"], table["reached"]))
    axes = Axes("Time until the load is at 90 % of the reference", "N.m/rad", "s", [1e-5, 2e-5, 5e-5, 1e-4], [0, 0.5, 1, 1.5, 2], True)
    laws = {"P_PI": RED, "WBC": GREY, "VWBC": BLUE, "VWBC_WASHOUT": GREEN}
    for law, color in laws.items():
        axes.curve([(k, t) for name, k, t in runs if name == law], color)
    axes.legend(laws, top=90)
    return axes.drawn()


def capture(bench):
    """What becomes of the capture, a tile a run."""
    bench.pack("CaptureScene")
    table = bench.sweep("examples/04-capture/capture-map.toml")
    kinds = {1: ("held", BLUE), 2: ("held, turned", GREEN), 3: ("one jaw", ORANGE), 4: ("jammed", RED), 5: ("pushed away", "#c3c8d0"), 6: ("open", "#5b6270")}
    xs, ys = (sorted(set(table[name])) for name in ("x", "y"))
    outcome = {(x, y): int(o) for x, y, o in zip(table["x"], table["y"], table["outcome"])}
    assert len(outcome) == len(xs) * len(ys)
    side = 260 / len(xs)
    items = [text(70, 24, "Outcome of the capture, by where the port is", kind="t"), text(14, 24, "y, m"), text(340, 340, "x, m", "end")]
    for i, y in enumerate(reversed(ys)):
        start = 0
        for j in range(1, len(xs) + 1):
            # Neighbours of one outcome are one rectangle.
            if j == len(xs) or outcome[xs[j], y] != outcome[xs[start], y]:
                paint = kinds[outcome[xs[start], y]][1]
                items.append(f'<rect shape-rendering="crispEdges" x="{70 + side * start:.1f}" y="{40 + side * i:.1f}" width="{side * (j - start):.2f}" height="{side:.2f}" fill="{paint}"/>')
                start = j
    items += [text(62, 48, f"{ys[-1]:g}", "end"), text(62, 174, "0", "end"), text(62, 300, f"{ys[0]:g}", "end")]
    items += [text(70, 318, f"{xs[0]:g}", "middle"), text(330, 318, f"{xs[-1]:g}", "middle")]
    present = [(*kinds[kind], count) for kind, count in sorted(Counter(outcome.values()).items())]
    for k, (name, color, count) in enumerate(present):
        items += [f'<rect x="370" y="{52 + 24 * k}" width="14" height="14" fill="{color}"/>', text(392, 64 + 24 * k, f"{name}: {count}")]
    return svg(560, 350, items)


def coupled(bench):
    """The speeds of both bodies: three FMUs, and the same scene in one."""
    bench.pack("FreeBody", "GripperContact", "CaptureScene")
    bench.run("simulate", "examples/05-coupled-capture/capture-coupled.toml", "--stop", 8, "-o", "three.csv")
    bench.run("simulate", "out/CaptureScene.fmi3.fmu", "--stop", 8, "--step", 0.01, "-o", "one.csv")
    axes = Axes("Speeds along the axis of the hand", "s", "mm/s", range(9), [-25, -20, -15, -10, -5, 0, 5, 10])
    mm = lambda path, name: [(t, 1e3 * v) for t, v in zip(*column(bench.folder / path, "time", name))]
    for body, color in ("chaser", RED), ("target", BLUE):
        axes.curve(mm("one.csv", f"{body}Velocity[1]"), "#c3c8d0", 5)
        axes.curve(mm("three.csv", f"{body}.velocity[1]"), color)
    axes.legend({"target": BLUE, "chaser": RED, "grey: the same in one FMU": GREY}, at=90, top=170)
    return axes.drawn()


def curves(page, caption):
    """The curves of the first chart of a page with that caption, as (share of the time axis, value) by the labels of its axis."""
    figure = next(f for f in page.split("<figure")[1:] if f"<figcaption>{caption}</figcaption>" in f)
    labels = re.findall(r'<text x="400" y="(\d+)"[^>]*>\s*([-\d.e]+)\s*</text>', figure)
    (y0, v0), (y1, v1) = ((float(y), float(v)) for y, v in (labels[0], labels[-1]))
    found = []
    for points in re.findall(r'<polyline[^>]*points="([^"]*)"', figure):
        pairs = [tuple(map(float, point.split(","))) for point in points.split()]
        left, right = pairs[0][0], pairs[-1][0]
        # The others are axes and their ticks.
        if len(pairs) > 20:
            found.append([((x - left) / (right - left), v0 + (y - y0) * (v1 - v0) / (y1 - y0)) for x, y in pairs])
    return found


def curve(page, caption):
    """The longest of them."""
    return max(curves(page, caption), key=len)


def backlash(bench):
    """The gaps of diagnosis.json, and two curves of report.html, which must have these gaps."""
    bench.run("diagnose", "examples/06-backlash", "-o", "found")
    gap = json.loads((bench.folder / "found" / "diagnosis.json").read_text())["gap"]
    page = (bench.folder / "found" / "report.html").read_text()
    caption = "loadAngle, holdout-1.csv: simulated minus measured, "
    nominal, augmented = ([(8 * s, 1e3 * v) for s, v in curve(page, caption + which)] for which in ("before", "with the effects"))

    (measured,) = column(EXAMPLES / "06-backlash" / "holdout-1.csv", "loadAngle")
    middle = sum(measured) / len(measured)
    variation = 1e3 * math.sqrt(sum((m - middle) ** 2 for m in measured) / len(measured))
    for key, drawn in ("before", nominal), ("after", augmented):
        share = math.sqrt(sum(v * v for _, v in drawn) / len(drawn)) / variation
        assert abs(share - gap["channels"]["loadAngle"][key]) < 0.02 * gap["channels"]["loadAngle"]["before"], (key, share)

    top = 1.08 * max(abs(v) for _, v in nominal)
    x, y = (lambda t: 60 + 400 * t / 8), (lambda v: 160 - 110 * v / top)
    items = [text(60, 30, "Held-out load angle: simulated minus measured", kind="t")]
    for tick in range(-int(top), int(top) + 1, max(1, int(top / 2))):
        items += [line([(60, y(tick)), (460, y(tick))], "#e3e5e8", 1), text(54, y(tick) + 4, f"{tick}", "end")]
    items += [text(x(t), 290, f"{t}", "middle") for t in range(0, 9, 2)]
    items += [text(460, 308, "s", "end"), text(24, 160, "mrad", "middle")]
    items += [line([(x(t), y(v)) for t, v in nominal], RED), line([(x(t), y(v)) for t, v in augmented], BLUE)]
    items += [text(70, 62, "nominal model", color=RED), text(180, 62, "model with backlash", color=BLUE)]

    bars = [("nominal model", "before", RED), ("parameters refitted", "tuned", RED), ("with backlash", "after", BLUE), ("noise floor", "floor", GREY)]
    items.append(text(520, 30, "Gap, held-out (log scale)", kind="t"))
    # From 1e-4 to 1e-1.
    wide = lambda v: 165 * (math.log10(v) + 4) / 3
    for k, (name, key, color) in enumerate(bars):
        value, low = gap["overall"][key], 60 + 58 * k
        items.append(text(520, low, name))
        items.append(f'<rect x="520" y="{low + 7}" width="{wide(value):.1f}" height="20" fill="{color}"/>')
        items.append(text(526 + wide(value), low + 22, f"{value:.4f}"))
    return svg(760, 320, items)


def space_arm(bench):
    """Distance of the hand from its line, by the generalized Jacobian and by that of the arm alone."""
    bench.pack("SpatialFreeFlyer", "SpaceController")
    axes = Axes("Distance of the hand from its line", "s", "m", range(0, 13, 2), [0, 0.02, 0.04, 0.06, 0.08])
    laws = {"free": ("generalized Jacobian", BLUE), "fixed": ("Jacobian of the arm alone", RED)}
    way = (-0.3, 0.6, -0.4)
    length = math.hypot(*way)
    for law, (_, color) in laws.items():
        bench.run("simulate", "examples/07-space-arm/space-arm.toml", "--set", f"controller.baseControl={law}", "-o", "run.csv")
        time, *place = column(bench.folder / "run.csv", "time", *(f"robot.tipPosition[1,{i}]" for i in (1, 2, 3)))
        points = []
        for k, t in enumerate(time):
            moved = [axis[k] - axis[0] for axis in place]
            along = sum(m * w for m, w in zip(moved, way)) / length
            points.append((t, math.hypot(*(m - along * w / length for m, w in zip(moved, way)))))
        axes.curve(points, color)
    axes.legend(dict(laws.values()), at=120)
    return axes.drawn()


def delian(bench):
    """x of the hand under four control laws, with the weight of the arm."""
    bench.run("fmu", "pack", "FlexibleArm", "--structure", "drive=torque", "--structure", "solver=fixed", "--fmi", "3", "-o", "delian")
    bench.run("fmu", "pack", "ManipulatorController", "--preset", "delian", "--fmi", "3", "-o", "delian")
    axes = Axes("x of the hand while shoulder and elbow move", "s", "m", range(11), [0.95, 1.0, 1.05, 1.1, 1.15, 1.2, 1.25])
    laws = {"P_PI": RED, "WBC": GREY, "VWBC": BLUE, "VWBC_WASHOUT": GREEN}
    for law, color in laws.items():
        bench.run("simulate", "examples/08-delian/delian.toml", "--set", f"controller.strategy={law}", "-o", "run.csv")
        rows = zip(*column(bench.folder / "run.csv", "time", "arm.tipPosition[1,1]"))
        axes.curve([(t - 4, x) for t, x in rows if t >= 4], color)
    axes.legend(laws, top=200)
    return axes.drawn()


def flexible_joint(bench):
    """Figures 4 to 8 of the paper: rigid, flexible, measured, one panel a test."""
    deg = lambda points: [(t, math.degrees(v)) for t, v in points]
    items = [text(20, 24, "Angle of the flexible joint, deg, over time, s: tests 1 to 5 (Figures 4 to 8)", kind="t")]
    for k in range(5):
        left, top = 40 + 250 * (k % 3), 50 + 200 * (k // 3)
        x, y = (lambda t: left + 21 * t), (lambda v: top + 150 - 6 * (v - 5))
        rigid = bench.folder / "examples/09-flexible-joint" / f"rigid-{k + 1}.toml"
        rigid.write_text((EXAMPLES / "09-flexible-joint/rigid.toml").read_text().replace("test-2", f"test-{k + 1}"))
        fits = []
        for case in rigid, rigid.with_name(f"case-{k + 1}.toml"):
            bench.run("identify", case, "--fast", "--plot", "fit.html")
            _, simulated = curves((bench.folder / "fit.html").read_text(), f"test-{k + 1}.csv: jointAngle[1]")
            fits.append([(10 * share, v) for share, v in simulated])
        measured = list(zip(*column(EXAMPLES / "09-flexible-joint" / f"test-{k + 1}.csv", "time", "jointAngle[1]")))
        for tick in (5, 10, 15, 20, 25, 30):
            items += [line([(x(0), y(tick)), (x(10), y(tick))], "#e3e5e8", 1), text(x(0) - 4, y(tick) + 4, f"{tick}", "end")]
        items += [text(x(t), top + 166, f"{t}", "middle") for t in (0, 5, 10)]
        items += [f'<circle cx="{x(t):.1f}" cy="{y(v):.1f}" r="1.6" fill="{GREY}"/>' for t, v in deg(measured)[::3]]
        for points, color in zip(fits, (RED, BLUE)):
            items.append(line([(x(t), y(v)) for t, v in deg(points)], color))
        items.append(text(x(0) + 8, top + 12, f"test {k + 1}"))
    for k, (name, color) in enumerate({"rigid": RED, "flexible, identified": BLUE, "measured (made)": GREY}.items()):
        items.append(text(560, 290 + 22 * k, name, color=color))
    return svg(780, 450, items)


def attitude(bench):
    """What one panel does after it is let go, by itself and damped by the arm or by the base."""
    bench.run("fmu", "pack", "SpatialFreeFlyer", "SpaceController", "--preset", "table-1-with-panels", "--fmi", "3", "-o", "panels")
    axes = Axes("Tip of a panel that is let go bent, from its root's line", "s", "m", range(0, 13, 2), [-0.06, -0.04, -0.02, 0, 0.02, 0.04, 0.06])
    laws = {
        "nothing damps it": ([], GREY),
        "the arm, vibrationGain 6": (["controller.vibrationGain=6"], BLUE),
        "the base, baseVibrationGain 0.02": (
            ["controller.baseControl=attitude", "controller.baseVelocityGain=5", "controller.baseTrackingGain=6", "controller.baseVibrationGain=0.02"],
            RED,
        ),
    }
    for changes, color in laws.values():
        sets = [word for change in changes for word in ("--set", change)]
        bench.run("simulate", "examples/10-attitude/panels.toml", "--stop", 12, *sets, "-o", "run.csv")
        axes.curve(zip(*column(bench.folder / "run.csv", "time", "robot.modalCoordinate[1]")), color)
    axes.legend({name: color for name, (_, color) in laws.items()}, at=380, top=240)
    return axes.drawn()


PICTURES = {
    "01-joint": ("step.svg", joint),
    "02-arm": ("motion.svg", arm),
    "03-sweep": ("reached.svg", sweep),
    "04-capture": ("map.svg", capture),
    "05-coupled-capture": ("speeds.svg", coupled),
    "06-backlash": ("gap.svg", backlash),
    "07-space-arm": ("path.svg", space_arm),
    "08-delian": ("hand.svg", delian),
    "09-flexible-joint": ("figures.svg", flexible_joint),
    "10-attitude": ("panels.svg", attitude),
}


def main():
    read = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    read.add_argument("trueup", type=Path)
    read.add_argument("names", nargs="*", choices=[[], *PICTURES], metavar="NAME")
    read.add_argument("--into", type=Path, default=EXAMPLES)
    given = read.parse_args()
    for name in given.names or PICTURES:
        file, draw = PICTURES[name]
        with tempfile.TemporaryDirectory() as folder:
            drawn = draw(Bench(given.trueup.resolve(), Path(folder)))
        target = given.into / name / file
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(drawn)
        print(target)


if __name__ == "__main__":
    main()
