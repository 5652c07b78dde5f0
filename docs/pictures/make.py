"""Draws diagnosis.svg and arm.svg of this folder from runs of the program: python3 docs/pictures/make.py PATH-OF-TRUEUP

diagnosis.svg: `trueup diagnose examples/backlash`; the gaps of its diagnosis.json, and two curves of its report.html. arm.svg: `trueup simulate examples/arm.toml --set controller.positionReference=0.8,0,0`; the base is
a square of 0.6 m. Needs the standard library alone.
"""

import csv
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent.parent / "examples"
RED, BLUE, GREY, INK = "#c0392b", "#1f6fb2", "#8a8f98", "#222"


def svg(width, height, items):
    style = "text{font:13px sans-serif;fill:%s} .t{font-size:15px;font-weight:bold} path,line{fill:none}" % INK
    body = "\n".join(items)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">\n'
        f'<style>{style}</style>\n<rect width="{width}" height="{height}" fill="#fff"/>\n{body}\n</svg>\n'
    )


def text(x, y, words, anchor="start", kind=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" class="{kind}">{words}</text>'


def line(points, color, width=1.5):
    steps = " L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{steps}" stroke="{color}" stroke-width="{width}"/>'


def column(path, *names):
    with open(path) as file:
        rows = list(csv.DictReader(file))
    return [[float(row[name]) for row in rows] for name in names]


def run(trueup, *arguments):
    done = subprocess.run([trueup, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def curve(page, caption):
    """The first curve of a chart of report.html as (share of the time axis, value) by the labels of its axis."""
    (figure,) = [f for f in page.split("<figure")[1:] if f"<figcaption>{caption}</figcaption>" in f]
    labels = re.findall(r'<text x="400" y="(\d+)"[^>]*>\s*([-\d.e]+)\s*</text>', figure)
    (y0, v0), (y1, v1) = ((float(y), float(v)) for y, v in (labels[0], labels[-1]))
    points = max(re.findall(r'<polyline[^>]*points="([^"]*)"', figure), key=len)
    pairs = [tuple(map(float, point.split(","))) for point in points.split()]
    left, right = pairs[0][0], pairs[-1][0]
    return [((x - left) / (right - left), v0 + (y - y0) * (v1 - v0) / (y1 - y0)) for x, y in pairs]


def diagnosis(trueup, folder):
    found = folder / "found"
    run(trueup, "diagnose", EXAMPLES / "backlash", "-o", found)
    gap = json.loads((found / "diagnosis.json").read_text())["gap"]
    page = (found / "report.html").read_text()
    caption = "loadAngle, holdout-1.csv: simulated minus measured, "
    nominal, augmented = ([(8 * s, 1e3 * v) for s, v in curve(page, caption + which)] for which in ("before", "with the effects"))

    (measured,) = column(EXAMPLES / "backlash" / "holdout-1.csv", "loadAngle")
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
    items += [text(70, 62, "nominal model").replace("<text", f'<text style="fill:{RED}"')]
    items += [text(180, 62, "model with backlash").replace("<text", f'<text style="fill:{BLUE}"')]

    bars = [("nominal model", "before", RED), ("parameters refitted", "tuned", RED), ("with backlash", "after", BLUE), ("noise floor", "floor", GREY)]
    items.append(text(520, 30, "Gap, held-out (log scale)", kind="t"))
    # From 1e-4 to 1e-1.
    wide = lambda v: 165 * (math.log10(v) + 4) / 3
    for k, (name, key, color) in enumerate(bars):
        value, low = gap["overall"][key], 60 + 58 * k
        items.append(text(520, low, name))
        items.append(f'<rect x="520" y="{low + 7}" width="{wide(value):.1f}" height="20" fill="{color}"/>')
        items.append(text(526 + wide(value), low + 22, f"{value:.4f}"))
    (HERE / "diagnosis.svg").write_text(svg(760, 320, items))


def arm(trueup, folder):
    """Every link at some times, by the lengths and the mount of the default parameters; the hand is compared with the FMU's."""
    run(trueup, "fmu", "pack", "-o", folder / "out")
    (folder / "examples").mkdir()
    (folder / "examples" / "arm.toml").write_text((EXAMPLES / "arm.toml").read_text())
    run(trueup, "simulate", folder / "examples" / "arm.toml", "--set", "controller.positionReference=0.8,0,0", "-o", folder / "arm.csv")
    names = ["time", "arm.basePosition[1]", "arm.basePosition[2]", "arm.baseAttitude", *(f"arm.jointAngle[{k}]" for k in (1, 2, 3))]
    rows = list(zip(*column(folder / "arm.csv", *names, "arm.tipPosition[1]", "arm.tipPosition[2]")))
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
    (HERE / "arm.svg").write_text(svg(620, 330, items))
    print(f"arm: joint 1 at {last[4]:.4f} rad, base at {last[3]:.4f} rad")


if __name__ == "__main__":
    program = str(Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as place:
        diagnosis(program, Path(place))
        arm(program, Path(place))
