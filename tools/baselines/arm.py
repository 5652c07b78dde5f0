"""Balances of PlanarManipulator (docs/equations/arm.md) and what may be missing from them."""

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.signal import bilinear, lfilter

from plant import Plant, Push, Term, TooLittle, Wave
from signals import Smoother, beyond, carried, dahl, late

WIDTHS, QUIET = (0.25, 0.5, 1.0, 1.5), 0.03


def _filled(x):
    """Without gaps."""
    good = np.flatnonzero(np.isfinite(x))
    return np.interp(np.arange(len(x)), good, x[good])


def turned(v):
    """By 90 degrees."""
    return np.stack([-v[1], v[0]])


class Arm(Plant):
    """Coordinates and rows: x_0, y_0, q_0, joints, motors of flexible joints.

    An unmeasured base moves so that momentum stays 0; an unmeasured motor moves by its own balance.
    """

    def __init__(self, case, channels):
        super().__init__(case)
        p = self.p
        self.n = n = sum(name.startswith("linkMass[") for name in p)
        self.joints = range(1, n + 1)
        if not all(f"jointAngle[{i}]" in channels for i in self.joints):
            raise TooLittle("not all joint angles are measured")
        self.flexible = [i for i in self.joints if p.get(f"jointFlexible[{i}]", i == 1)]
        self.motor = {i: 2 + n + k for k, i in enumerate(self.flexible, 1)} | {
            i: 2 + i for i in self.joints if i not in self.flexible
        }
        self.seen = {i for i in self.joints if f"motorAngle[{i}]" in channels}
        self.base = {"basePosition[1]", "basePosition[2]", "baseAttitude"} <= set(channels)
        self.angles = [c for c in channels if "Angle" in c or c == "baseAttitude"]
        # A joint that is assumed rigid has the same angle on both sides.
        self.both = [i for i in self.joints if i in self.seen and i not in self.flexible]
        self.rows = [f"twist {i}" for i in self.both] + (["base x", "base y", "base torque"] if self.base else [])
        self.rows += [f"joint {i}" for i in self.joints] + [f"motor {i}" for i in self.flexible if i in self.seen]
        names = ["baseMass", "baseInertia"]
        for i in self.joints:
            names += [f"linkMass[{i}]", f"linkInertia[{i}]", f"linkCenterOfMass[{i},1]", f"motorInertia[{i}]"]
            names += [f"jointStiffness[{i}]", f"jointDamping[{i}]"] if i in self.flexible else []
        self._kept = {}  # what signals at ports do not change, by recording
        # Rows that remember what happened before.
        self.slow = np.array([row.startswith("base") for row in self.rows])
        self.parameters = self.parts = [name for name in names if p.get(name)]

    def seconds(self):
        """Width of the smoothing window: as the noise of the joints' accelerations requires."""
        time, channels = self.case.recording(self.case.train[0])
        rate = 1 / np.median(np.diff(time))
        for width in WIDTHS:
            smoother = Smoother(rate, width)
            angles = [channels[f"jointAngle[{i}]"] for i in self.joints]
            known = slice(smoother.half, -smoother.half)
            size = np.array([np.std(smoother(_filled(x))[2][known]) for x in angles])
            noise = np.array([self.case.deviation(f"jointAngle[{i}]") for i in self.joints])
            if np.all(noise * np.linalg.norm(smoother.kernels[:, 2]) < QUIET * size):
                break
        return width

    def begin(self, run):
        run.y = dict(run.full) | {"rate": run.rate}
        run.x = self._motion(self.p, run.y, {})
        run.y["share"] = self._share(self.p, run.x)
        if self.seen >= set(self.flexible):
            self._kept[id(run.y)] = self._state(self.p, run.y, {})
        run.torque = {i: run.raw[f"jointTorque[{i}]"] for i in self.joints}
        run.w, run.sign, run.twist = {}, {}, {}
        for i in self.joints:
            for side, at in (("motor", self.motor[i]), ("link", 2 + i)):
                doubt = self.case.deviation(f"jointAngle[{i}]") * np.linalg.norm(run.fine.kernels[:, 1])
                run.w[side, i] = run.x[1, at]
                run.sign[side, i] = np.tanh(run.x[1, at] / (2 * doubt))
            run.twist[i] = run.x[:, self.motor[i]] - run.x[:, 2 + i]

    def sizes(self, runs):
        self.torque = {i: max(np.abs(r.torque[i]).max() for r in runs) for i in self.joints}
        twist = lambda i, d: np.quantile(np.abs(np.concatenate([r.twist[i][d] for r in runs])), 0.95)
        self.most = {i: twist(i, 0) for i in self.joints}

    def ready(self, run, x):
        return run.fine(x)

    def points(self, run, rows):
        """Smoothed only now: products of smooth angles and accelerations are not the smooth product. Balances of the
        base are integrated twice: noise of a camera drowns accelerations, not the way of the centre of mass."""
        dt = 1 / run.rate
        rows = rows.copy()
        for _ in range(2):
            rows[self.slow] = cumulative_trapezoid(rows[self.slow], dx=dt, initial=0)
        return run.values(rows)

    def nuisance(self, run):
        """What integrating twice leaves open. The start of a motor that is not measured is not known: two impulses
        at it make any."""
        t = run.at(run.t - run.t[0])[0]
        loose = [np.outer(row, x) for row in np.eye(len(self.rows))[self.slow] for x in (t**0, t)]
        for i in set(self.flexible) - self.seen:
            loose += [self.by_signals(run, {f"motor {i}": x}) for x in np.eye(len(run.t))[:2] * run.rate]
        return loose

    def _motion(self, p, y, f):
        """(derivative, coordinate, sample)"""
        x = np.zeros((3, 3 + self.n + len(self.flexible), len(y["jointAngle[1]"][0])))
        for i in self.joints:
            x[:, 2 + i] = y[f"jointAngle[{i}]"]
        if self.base:
            for k, name in enumerate(("basePosition[1]", "basePosition[2]", "baseAttitude")):
                x[:, k] = y[name]
        for i in self.flexible:
            x[:, self.motor[i]] = y[f"motorAngle[{i}]"] if i in self.seen else self._lead(p, y, f, x, i)
        if not self.base:
            self._float(p, y["rate"], x)
        return x

    def _lead(self, p, y, f, x, i):
        """The motor of joint i by its own balance, in which its twist is a damped oscillator."""
        inertia, k, b = p[f"motorInertia[{i}]"], p[f"jointStiffness[{i}]"], p[f"jointDamping[{i}]"]
        body = x[2, 2 : 2 + i].sum(axis=0) * (1 / p[f"gearRatio[{i}]"] if p.get("motorCoupling") == "geared" else 1)
        at = lambda port: f.get(f"{port} {i}", np.zeros((3, 1)))
        force = y[f"jointTorque[{i}]"][0] + at("motor")[0] - at("spring")[0] - inertia * (body + x[2, 2 + i])
        force = force + k * at("twist")[0] + b * at("twist")[1]
        filters = ([1.0], [1.0, 0.0], [1.0, 0.0, 0.0])
        return x[:, 2 + i] + [lfilter(*bilinear(d, [inertia, b, k], y["rate"]), force) for d in filters]

    def _carrier(self, p, x):
        """Columns of the mass matrix for the base: (3, rows, samples)."""
        still = np.zeros_like(x[0])
        units = np.eye(len(still))[:3, :, None]
        return np.array([self._inertial(p, x[0], still, still + unit)[0] for unit in units])

    def _float(self, p, rate, x):
        """Velocity and attitude of the base from a momentum of 0, first in its own axes."""
        momentum = self._inertial(p, x[0], np.zeros_like(x[0]), x[1])[0][:3]
        v = -np.linalg.solve(self._carrier(p, x)[:, :3].transpose(2, 1, 0), momentum.T[:, :, None])[:, :, 0].T
        x[1, 2], x[0, 2] = v[2], cumulative_trapezoid(v[2], dx=1 / rate, initial=0)
        c, s = np.cos(x[0, 2]), np.sin(x[0, 2])
        x[1, 0], x[1, 1] = c * v[0] - s * v[1], s * v[0] + c * v[1]
        x[0, :2] = cumulative_trapezoid(x[1, :2], dx=1 / rate, initial=0)

    def _inertial(self, p, x, v, a):
        """(M + J*) a + C v, and the chain's levers A and G (ARM-1 to ARM-6)."""
        n = self.n
        mass = np.array([p["baseMass"]] + [p[f"linkMass[{i}]"] for i in self.joints])
        inertia = [p["baseInertia"]] + [p[f"linkInertia[{i}]"] for i in self.joints]
        center = np.array([[0, 0]] + [[p[f"linkCenterOfMass[{i},{k}]"] for k in (1, 2)] for i in self.joints])
        mount = [p["mountPosition[1]"], p["mountPosition[2]"]]
        ends = np.array([mount] + [[p[f"linkLength[{i}]"], 0] for i in self.joints])
        beyond_it = mass.sum() - np.cumsum(mass)
        gamma = mass[:, None] * center + beyond_it[:, None] * ends
        alpha = mass * (center**2).sum(axis=1) + beyond_it * (ends**2).sum(axis=1)
        phi, w, w_dot = (np.cumsum(z[2 : 3 + n], axis=0) for z in (x, v, a))
        cos, sin = np.cos(phi), np.sin(phi)
        frame = lambda v: np.stack([cos * v[:, :1] - sin * v[:, 1:], sin * v[:, :1] + cos * v[:, 1:]])
        lever, moment = frame(ends), frame(gamma)  # A, G: (2, body, sample)
        side = turned(moment)
        q = np.zeros_like(x)
        q[:2] = mass.sum() * a[:2] + (side * w_dot - moment * w**2).sum(axis=1)
        turn = (side * a[:2, None]).sum(axis=0) + (alpha + inertia)[:, None] * w_dot
        for k in range(n + 1):
            for j in range(k + 1, n + 1):
                coupling = (lever[:, k] * moment[:, j]).sum(axis=0)
                cross = (lever[:, k] * turned(moment[:, j])).sum(axis=0)
                turn[k] += coupling * w_dot[j] + cross * w[j] ** 2
                turn[j] += coupling * w_dot[k] - cross * w[k] ** 2
        q[2 : 3 + n] = np.cumsum(turn[::-1], axis=0)[::-1]
        for i in self.joints:
            rotor, at = p.get(f"motorInertia[{i}]", 0.0), self.motor[i]
            gear = p[f"gearRatio[{i}]"] if p.get("motorCoupling") == "geared" else 1.0
            q[2 : 2 + i] += rotor / gear * (a[at] + w_dot[i - 1] / gear)
            q[at] += rotor * (a[at] + w_dot[i - 1] / gear)
        return q, lever, moment

    def _share(self, p, x):
        """What a force on the base does to every row by way of the base's acceleration."""
        carrier = self._carrier(p, x).transpose(2, 0, 1)
        return np.linalg.solve(carrier[:, :, :3], carrier).transpose(1, 2, 0)

    def _state(self, p, y, f):
        """Motion, inertial forces and levers."""
        x = self._motion(p, y, f)
        return x, *self._inertial(p, *x)

    def balances(self, p, y, f={}):
        kept = self._kept.get(id(y)) if p is self.p else None
        n, (x, q, lever, moment) = self.n, kept or self._state(p, y, f)
        q = q.copy()
        port = lambda name: f[name][0] if name in f else 0.0
        for i in self.joints:
            q[self.motor[i]] -= y[f"jointTorque[{i}]"][0] + port(f"motor {i}")
            q[2 + i] -= port(f"link {i}")
            if i in self.flexible:
                twist = x[:, self.motor[i]] - x[:, 2 + i] - f.get(f"twist {i}", np.zeros((3, 1)))
                spring = p[f"jointStiffness[{i}]"] * twist[0] + p[f"jointDamping[{i}]"] * twist[1]
                spring = spring + port(f"spring {i}")
                q[2 + i] -= spring
                q[self.motor[i]] += spring
        for k, axis in enumerate("xy"):
            q[k] -= port(f"base {axis}") + port(f"tip {axis}") + self._mass(p) * port(f"field {axis}")
            turn = turned(lever)[k] * port(f"tip {axis}") + turned(moment)[k] * port(f"field {axis}")
            q[2 : 3 + n] -= np.cumsum(turn[::-1], axis=0)[::-1]
        q[2] -= port("base torque")
        rows = [x[0, 2 + i] + f.get(f"twist {i}", [0.0])[0] - y[f"motorAngle[{i}]"][0] for i in self.both]
        rows += list(q[:3]) if self.base else []
        # The other balances with a base that accelerates so that its own are 0: free of the noise of its measurement.
        q = q - np.einsum("ks,krs->rs", q[:3], y["share"] if "share" in y else self._share(p, x))
        rows += [q[2 + i] for i in self.joints]
        return np.array(rows + [q[self.motor[i]] for i in self.flexible if i in self.seen])

    def _mass(self, p):
        return p["baseMass"] + sum(p[f"linkMass[{i}]"] for i in self.joints)

    def terms(self):
        still = lambda x: x - x[0]
        terms = [
            Term("table-tilt", "base", lambda r, _: [{f"field {a}": np.ones_like(r.t)} for a in "xy"]),
            Term("base-thrust", "base", lambda r, _: _body(r) + [{"base torque": np.ones_like(r.t)}]),
            Term("base-drag", "base", lambda r, _: _base(*r.x[1, :3])),
            Term("cable-stiffness", "base", lambda r, _: _base(*map(still, r.x[0, :3]))),
            Term(
                "appendage-mode",
                "base",
                lambda r, hz: [{"base torque": carried(r.torque[1], r.rate, hz)}],
                (0.3, 0.6, 1.2, 2.4),
            ),
            Push("external-force", "base", ["base x", "base y", "base torque"]),
            Push("external-force", "tip", ["tip x", "tip y"]),
        ]
        for i in self.joints:
            terms += self._drive(i) + (self._transmission(i) if i in self.flexible else [])
        ways = ["basePosition[1]", "basePosition[2]"]
        for c in [c for c in self.angles + ways if self.base or "base" not in c]:
            place, reading = f"sensor:{c}", f"reading:{c}"
            terms.append(Term("sensor-delay", place, lambda r, _, c=c, k=reading: [{k: r.full[c][1]}]))
            terms.append(Term("sensor-drift", place, lambda r, _, k=reading: [{k: r.t}]))
            if c in self.angles:
                terms.append(Wave("sensor-eccentricity", place, reading, lambda r, c=c: r.full[c][0], (1, 2)))
        return terms

    def _shaft(self, i):
        gear = self.p[f"gearRatio[{i}]"]
        return lambda r: gear * r.x[0, self.motor[i]]

    def _drive(self, i):
        motor, place, tall = f"motor {i}", f"actuator {i}", self.torque[i]
        gates = lambda r, s: [{motor: -beyond(r.torque[i], s * tall)}]
        terms = [
            Term("current-saturation", place, gates, (0.2, 0.4, 0.6, 0.8)),
            Term("actuator-lag", place, lambda r, s: [{motor: late(r.torque[i], r.rate, s)}], (0.02, 0.1, 0.3)),
            Wave("torque-ripple", place, motor, self._shaft(i), (1, 2)),
            Push("external-force", place, [motor]),
            Term(
                "motor-friction",
                f"motor-friction {i}",
                lambda r, _: [{motor: r.sign["motor", i]}, {motor: r.w["motor", i]}],
            ),
        ]
        # A motor without inertia has nothing to swing against.
        if i not in self.flexible and self.p.get(f"motorInertia[{i}]"):
            swing = lambda r, hz: [{motor: carried(r.torque[i], r.rate, hz)}]
            terms.append(Term("joint-flexibility", f"transmission {i}", swing, (0.2, 0.4, 0.8, 1.6)))
        return terms

    def _transmission(self, i):
        """Of a flexible joint. At a rigid one friction of the link is that of the motor."""
        spring, link, place, most = f"spring {i}", f"link {i}", f"transmission {i}", self.most[i]
        power = lambda x, s: [{spring: np.sign(x) * np.abs(x) ** s}]
        clip = lambda r, s: [{spring: np.clip(r.twist[i][0], -s * most, s * most)}]
        return [
            Term("load-friction", f"load {i}", lambda r, _: [{link: r.sign["link", i]}, {link: r.w["link", i]}]),
            Term("backlash", place, clip, (0.05, 0.2, 0.5)),
            Term("nonlinear-stiffness", place, lambda r, s: power(r.twist[i][0], s), (2, 3)),
            Term("nonlinear-damping", place, lambda r, s: power(r.twist[i][1], s), (0.5, 2)),
            Term("transmission-hysteresis", place, lambda r, s: [{spring: dahl(r.twist[i][0], s * most)}], (0.1, 0.5)),
            Wave("kinematic-error", place, f"twist {i}", self._shaft(i), (1, 2)),
        ]


def _base(x, y, angle):
    """The same along both axes, and about the base's centre."""
    return [{"base x": x, "base y": y}, {"base torque": angle}]


def _body(r):
    """Unit forces along the base's own axes."""
    c, s = np.cos(r.x[0, 2]), np.sin(r.x[0, 2])
    return [{"base x": c, "base y": s}, {"base x": -s, "base y": c}]
