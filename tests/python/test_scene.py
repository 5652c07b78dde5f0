"""Moving pictures: joints are drawn where forward kinematics, written here again, has them; the page loads nothing and is fast."""

import csv
import json
import math
import re

import numpy as np
import pytest
from chromium import answer

# Searches the picture for the ring of a joint's marker about a place: the mean of the pixels of its colour.
FIND = """
const found = (figure, places) => {
  const canvas = figure.querySelector('canvas'), ratio = canvas.width / canvas.clientWidth, context = canvas.getContext('2d');
  const ink = getComputedStyle(document.documentElement).getPropertyValue('--ink').trim().slice(1);
  const rgb = [0, 2, 4].map((k) => parseInt(ink.slice(k, k + 2), 16));
  return places.map(([x, y]) => {
    const [size, left, top] = [Math.round(20 * ratio), Math.round((x - 10) * ratio), Math.round((y - 10) * ratio)];
    const pixels = context.getImageData(left, top, size, size).data;
    let n = 0, sx = 0, sy = 0;
    for (let i = 0; i < size * size; i++) {
      if (pixels[4 * i + 3] > 200 && rgb.every((w, c) => Math.abs(pixels[4 * i + c] - w) < 12)) { n++; sx += i % size; sy += Math.floor(i / size); }
    }
    return n ? [(left + sx / n + 0.5) / ratio, (top + sy / n + 0.5) / ratio] : null;
  });
};
const figure = document.querySelector('figure.scene');
"""


def scene_of(page):
    html = page.read_text()
    found = re.search(r'<figure class="scene">.*?<script type="application/json">(.*?)</script>', html, re.S)
    assert found, "no scene on the page"
    return json.loads(found.group(1))


def projected(view, planar, size, points):
    """Pixels of points, by the view that the page declares (docs/scenes.md)."""
    points = np.asarray(points, float) - view["center"][: 2 if planar else 3]
    scale = min(size[0] / (2 * view["half"][0]), size[1] / (2 * view["half"][1]))
    if planar:
        return np.column_stack([size[0] / 2 + scale * points[:, 0], size[1] / 2 - scale * points[:, 1]])
    a, e = view["azimuth"], view["elevation"]
    right = np.array([-math.sin(a), math.cos(a), 0])
    up = np.array([-math.sin(e) * math.cos(a), -math.sin(e) * math.sin(a), math.cos(e)])
    return np.column_stack([size[0] / 2 + scale * points @ right, size[1] / 2 - scale * points @ up])


def columns(file):
    with open(file, newline="") as lines:
        head, *rows = csv.reader(lines)
    return {name: np.array([float(row[k]) for row in rows]) for k, name in enumerate(head)}


def turn(axis, angle):
    """Rodrigues."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def of_quaternion(w, x, y, z):
    angle = 2 * math.atan2(math.sqrt(x * x + y * y + z * z), w)
    return turn([x, y, z], angle) if angle else np.eye(3)


def check_markers(page, times, places_at, count, width=1280):
    """Marker by marker at these times: what is drawn against forward kinematics, in pixels."""
    scene = scene_of(page)
    size = answer(page, FIND + "const c = figure.querySelector('canvas'); return [c.clientWidth, c.clientHeight];", width)
    expected = [projected(scene["view"], scene["planar"], size, places_at(t)).tolist() for t in times]
    assert all(len(places) == count for places in expected)
    script = FIND + f"""
      return {json.dumps(list(zip(times, expected)))}.map(([t, places]) => {{
        figure.scene.seek(t);
        return [figure.scene.markers().map((m) => [m.x, m.y]), found(figure, places)];
      }});"""
    worst, seen = 0.0, 0
    for places, (reported, pixels) in zip(expected, answer(page, script, width)):
        assert len(reported) == count
        for place, marker, pixel in zip(places, reported, pixels):
            worst = max(worst, math.dist(place, marker))
            # Rings that touch have no mean of their own.
            alone = sum(math.dist(place, other) < 24 for other in places) == 1
            if pixel and alone:
                seen += 1
                worst = max(worst, math.dist(place, pixel))
    print(f"largest distance {worst:.2f} pixels, {seen} markers found in the picture")
    assert seen >= 2
    assert worst < 2.0


def times_of(page, shares=(0.0, 0.31, 0.77, 1.0)):
    """Times of rows that the page has."""
    time = scene_of(page)["time"]
    return [time[round(share * (len(time) - 1))] for share in shares]


def test_joints_of_a_planar_arm_are_where_they_are(trueup, fmu, tmp_path):
    inputs, page, results = tmp_path / "in.csv", tmp_path / "plot.html", tmp_path / "r.csv"
    inputs.write_text("time,jointTorque[1],jointTorque[2],jointTorque[3]\n0,0.3,-0.2,0.1\n4,-0.3,0.1,-0.1\n8,0,0,0\n")
    done = trueup("simulate", fmu("PlanarManipulator", 3), "--input", inputs, "--stop", 8, "--plot", page, "-o", results)
    assert done.returncode == 0, done.stderr
    r = columns(results)

    def places_at(t):
        k = int(np.argmin(np.abs(r["time"] - t)))
        angle = r["baseAttitude"][k]
        at = np.array([r["basePosition[1]"][k], r["basePosition[2]"][k]])
        rotated = lambda p: np.array([math.cos(angle) * p[0] - math.sin(angle) * p[1], math.sin(angle) * p[0] + math.cos(angle) * p[1]])
        at = at + rotated([0.337, -0.001])  # Table 1 of the test-bed
        places = []
        for joint, length in enumerate([0.449, 0.449, 0.310], 1):
            places.append(at)
            angle += r[f"jointAngle[{joint}]"][k]
            at = at + rotated([length, 0])
        return places

    check_markers(page, times_of(page), places_at, 3)
    loaded = answer(page, "return performance.getEntriesByType('resource').map((e) => e.name);")
    assert loaded == []


ARM = """
name = "drawn"
[base]
mass = 400.0
inertia = [[80.0, 0.0, 0.0], [0.0, 90.0, 0.0], [0.0, 0.0, 70.0]]
"""


def spatial_robot(bodies, seed):
    """TOML of a chain of bodies with drawn axes and places, and its geometry."""
    dice = np.random.default_rng(seed)
    text, geometry = [ARM], []
    for k in range(bodies):
        place = [0.2, 0.1, 0.5] if k == 0 else (dice.uniform(-0.15, 0.15, 3) + [0.25, 0, 0]).tolist()
        orientation = dice.normal(size=4)
        orientation = (orientation / np.linalg.norm(orientation)).tolist()
        axis = dice.normal(size=3)
        axis = (axis / np.linalg.norm(axis)).tolist()
        geometry.append((np.array(place), of_quaternion(*orientation), axis))
        text.append(
            f"[[body]]\nmass = 4.0\ncenter-of-mass = [0.1, 0.0, 0.0]\ninertia = [[0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, 0.0, 0.05]]\n"
            f"position = {place}\norientation = {orientation}\naxis = {axis}\n"
        )
    return "".join(text) + "[[tip]]\noffset = [0.3, 0.0, 0.0]\n", geometry


def run_spatial(trueup, folder, bodies, seed):
    text, geometry = spatial_robot(bodies, seed)
    (folder / "robot.toml").write_text(text)
    done = trueup("fmu", "pack", "SpatialFreeFlyer", "--robot", folder / "robot.toml", "--fmi", 3, "-o", folder)
    assert done.returncode == 0, done.stderr
    page, results = folder / "plot.html", folder / "r.csv"
    names = ",".join(f"jointTorque[{k + 1}]" for k in range(bodies))
    rows = [[0, *[(-1) ** k * 1.5 for k in range(bodies)]], [2, *[(-1) ** k * -1.0 for k in range(bodies)]], [5, *[0] * bodies]]
    (folder / "in.csv").write_text("time," + names + "\n" + "\n".join(",".join(map(str, row)) for row in rows) + "\n")
    fmu = folder / "SpatialFreeFlyer.fmi3.fmu"
    done = trueup("simulate", fmu, "--input", folder / "in.csv", "--stop", 5, "--step", 0.05, "--plot", page, "-o", results)
    assert done.returncode == 0, done.stderr
    return page, columns(results), geometry


@pytest.mark.parametrize("width", [1280, pytest.param(390, marks=pytest.mark.full)])
def test_joints_of_a_robot_in_space_are_where_they_are(trueup, tmp_path, width):
    page, r, geometry = run_spatial(trueup, tmp_path, 5, 67)

    def places_at(t):
        k = int(np.argmin(np.abs(r["time"] - t)))
        at = np.array([r[f"basePosition[{i}]"][k] for i in (1, 2, 3)])
        frame = of_quaternion(*(r[f"baseQuaternion[{i}]"][k] for i in (1, 2, 3, 4)))
        places = []
        for joint, (place, mount, axis) in enumerate(geometry, 1):
            at = at + frame @ place
            frame = frame @ mount @ turn(axis, r[f"jointAngle[{joint}]"][k])
            places.append(at)
        return places

    check_markers(page, times_of(page), places_at, 5, width)


@pytest.mark.full
def test_twenty_bodies_are_drawn_in_a_sixtieth_of_a_second(trueup, tmp_path):
    page, _, _ = run_spatial(trueup, tmp_path, 20, 68)
    script = FIND + """
      const begin = performance.now();
      for (let k = 0; k < 200; k++) figure.scene.seek(5 * k / 200);
      return (performance.now() - begin) / 200;"""
    each = min(answer(page, script) for _ in range(3))
    print(f"{each:.2f} ms for a picture, {1000 / each:.0f} a second; the page has {page.stat().st_size / 1000:.0f} kB")
    assert each < 1000 / 60
