"""Balances of TwoMassJoint (docs/equations/joint.md) and what may be missing from them. All on the motor's side."""

import numpy as np
from scipy.ndimage import minimum_filter1d

from plant import Plant, Push, Term, Wave
from signals import Smoother, beyond, carried, dahl, late

# Widths of the window in periods of the joint's own vibration; noise of an acceleration that is small enough.
PARTS, QUIET = (0.25, 0.5, 1.0, 2.0), 0.03
ORDERS = tuple(0.5 * k for k in range(1, 25))  # of the motor's turn
TONES = tuple(0.4 * 0.6**k for k in range(8))  # of a link, in units of the sampling rate


class Joint(Plant):
    def __init__(self, case, channels):
        super().__init__(case)
        self.rigid = not self.p.get("jointFlexible", True)
        self.load = "loadAngle" in channels
        self.gauge = "transmissionTorque" in channels
        # Torque per current stays: with it too, every balance could be explained by making all parameters 0.
        names = ["motorInertia", "loadInertia", "coulombFriction", "viscousFriction"]
        names += [] if self.rigid else ["stiffness", "damping"]
        names += ["gearRatio"] if self.load else []
        self.parameters = [n for n in names if self.p.get(n)]
        # Torques that the balances consist of: a gear ratio multiplies angles of many turns.
        self.parts = [n for n in self.parameters if n != "gearRatio"]
        # The motor's own balance comes last: it alone fails where friction holds the motor.
        two = self.load and not self.rigid
        self.rows = (["load"] if two else []) + (["gauge"] if two and self.gauge else [])
        self.rows += ["twist"] if self.load and self.rigid else []
        self.rows += ["motor"] if two else ["sum"]

    def seconds(self):
        """Width of the smoothing window: as the noise of the motor's acceleration requires."""
        p = self.p
        load = p["loadInertia"] / p["gearRatio"] ** 2
        time, channels = self.case.recording(self.case.train[0])
        torque = p["torqueConstant"] * np.nanstd(channels["motorCurrent"])
        spring = p.get("stiffness", 0.0) * (1 / load + 1 / p["motorInertia"])
        period = 2 * np.pi / np.sqrt(spring) if spring else 0.1
        for part in PARTS:
            kernel = Smoother(1 / np.median(np.diff(time)), part * period).kernels[:, 2]
            if p["motorInertia"] * self.case.deviation("motorAngle") * np.linalg.norm(kernel) < QUIET * torque:
                break
        return part * period

    def begin(self, run):
        """Signals of a recording that balances and terms use."""
        p, n = self.p, self.p["gearRatio"]
        motor = run.full["motorAngle"]
        run.w = motor[1]
        # Where the speed is within the noise its sign is not known.
        doubt = self.case.deviation("motorAngle") * np.linalg.norm(run.fine.kernels[:, 1])
        run.sign = np.tanh(run.w / (2 * doubt))
        run.turning = np.abs(run.w) > np.maximum(3 * doubt, 0.01 * np.quantile(np.abs(run.w), 0.95))
        run.y = {c: run.at(x) for c, x in run.raw.items()} | {"sign": run.at(run.sign)}
        friction = p.get("coulombFriction", 0) * run.sign + p.get("viscousFriction", 0) * run.w
        torque = p["torqueConstant"] * run.full["motorCurrent"][0] - friction
        run.tau = torque - p["motorInertia"] * motor[2]
        # The load's acceleration by the current: that of an angle has the noise that is in the balances too.
        run.drive = torque / (p["motorInertia"] * n + p["loadInertia"] / n)
        run.q = motor[0] / n
        if self.load and not self.rigid:
            # Twist by the encoders, unless the motor's balance gives the torque with less noise.
            load = run.full["loadAngle"]
            value, _, bend = np.linalg.norm(run.fine.kernels, axis=0)
            of_motor, of_load = self.case.deviation("motorAngle"), n * self.case.deviation("loadAngle")
            if p["stiffness"] * np.hypot(of_motor, of_load) * value < p["motorInertia"] * of_motor * bend:
                run.tau = p["stiffness"] * (motor[0] - n * load[0]) + p["damping"] * (motor[1] - n * load[1])
            run.q = run.smoother(run.raw["loadAngle"])[0]
        if self.gauge:
            run.tau = run.full["transmissionTorque"][0]
        run.twist = run.tau / p.get("stiffness", 1.0)
        run.rate_of_twist = run.fine(run.twist)[1]

    def sizes(self, runs):
        """What large means, over all recordings."""
        most = lambda signals: np.quantile(np.abs(np.concatenate(signals)), 0.95)
        self.speed, self.most_twist = most([r.w for r in runs]), most([r.twist for r in runs])
        self.current = max(np.abs(r.raw["motorCurrent"]).max() for r in runs)
        self.travel = np.mean([np.ptp(r.raw["motorAngle"]) for r in runs])

    def valid(self, run):
        valid = super().valid(run)
        turning = minimum_filter1d(run.turning, 2 * run.smoother.half + 1)
        valid[-1] = turning[:: run.step][run.points]
        return valid

    def balances(self, p, y, f={}):
        n, motor, sign = p["gearRatio"], y["motorAngle"], y["sign"][0]
        at = lambda port: f[port][0] if port in f else 0.0
        drive = p["torqueConstant"] * y["motorCurrent"][0] + at("motor")
        friction = p.get("coulombFriction", 0) * sign + p.get("viscousFriction", 0) * motor[1]
        load = y["loadAngle"] if self.load else motor / n
        inertia = p["loadInertia"] * load[2] / n - at("load") / n
        alone = p["motorInertia"] * motor[2] + friction - drive
        if self.rigid and self.load:
            return np.array([motor[0] - n * load[0] - f.get("twist", [0.0])[0], alone + inertia])
        if not self.load:
            return np.array([alone + inertia])
        twist = motor - n * load - f.get("twist", 0.0)
        spring = p["stiffness"] * twist[0] + p["damping"] * twist[1] + at("spring")
        if self.gauge:
            gauge = y["transmissionTorque"][0]
            return np.array([inertia - gauge, gauge - spring, alone + gauge])
        return np.array([inertia - spring, alone + spring])

    def terms(self):
        p, kt, n = self.p, self.p["torqueConstant"], self.p["gearRatio"]
        load = lambda *signals: [{"load": x} for x in signals]
        angle = lambda r: r.full["motorAngle"][0]
        gates = lambda r, s: [{"motor": -kt * beyond(r.raw["motorCurrent"], s * self.current)}]
        delays = lambda r, s: [{"motor": kt * late(r.raw["motorCurrent"], r.rate, s)}]
        terms = [
            Term("current-saturation", "actuator", gates, (0.2, 0.4, 0.6, 0.8)),
            Term("actuator-lag", "actuator", delays, (2e-3, 1e-2, 4e-2)),
            Wave("torque-ripple", "actuator", "motor", angle, ORDERS),
            Push("external-force", "actuator", ["motor"]),
            Push("external-force", "load", ["load"]),
            Term("load-friction", "load", lambda r, s: load(dahl(r.q, s * self.travel / n)), (1e-4, 1e-2)),
            Term("gravity-torque", "load", lambda r, _: load(np.sin(r.q), np.cos(r.q))),
            Term("cable-stiffness", "load", lambda r, _: load(r.q, np.ones_like(r.q))),
            Term("flexible-link", "load", lambda r, hz: load(carried(r.drive, r.rate, hz * r.rate)), TONES),
        ]
        terms += self._friction() + self._sensor("motorAngle")
        if self.load:
            terms += self._sensor("loadAngle") + [Wave("kinematic-error", "transmission", "twist", angle, ORDERS)]
            terms += self._transmission()
        return terms

    def _friction(self):
        """Changes of a friction that the model has, or friction where it has none."""
        motor = lambda *signals: [{"motor": x} for x in signals]
        place, speed = "motor-friction", self.speed
        if not (self.p.get("coulombFriction") or self.p.get("viscousFriction")):
            return [Term("motor-friction", place, lambda r, _: motor(r.sign, r.w))]
        falls = lambda r, s: motor(r.sign * np.exp(-np.abs(r.w) / (s * speed)))
        bends = lambda r, s: motor(r.sign * np.abs(r.w / speed) ** s)
        sticks = lambda r, s: motor(dahl(r.full["motorAngle"][0], s * self.travel) - r.sign)
        return [
            Term("stribeck-friction", place, falls, (0.03, 0.1, 0.3)),
            Term("nonlinear-viscous-friction", place, bends, (0.5, 2.0, 3.0)),
            Term("presliding-friction", place, sticks, (1e-3, 1e-2, 1e-1)),
            Term("asymmetric-friction", place, lambda r, _: motor(np.abs(r.sign), np.abs(r.w))),
            Term("load-dependent-friction", place, lambda r, _: motor(np.abs(r.tau) * r.sign)),
            Term("friction-drift", place, lambda r, _: motor(r.t * r.sign, r.t * r.w)),
        ]

    def _sensor(self, channel):
        place, reading = f"sensor:{channel}", f"reading:{channel}"
        return [
            Term("sensor-delay", place, lambda r, _: [{reading: r.full[channel][1]}]),
            Term("sensor-drift", place, lambda r, _: [{reading: r.t}]),
            Wave("sensor-eccentricity", place, reading, lambda r: r.full[channel][0], (1, 2)),
        ]

    def _transmission(self):
        place, most = "transmission", self.most_twist
        if self.rigid:
            return [Term("joint-flexibility", place, lambda r, _: [{"twist": r.tau}])]
        power = lambda x, s: [{"spring": np.sign(x) * np.abs(x) ** s}]
        return [
            Term("backlash", place, lambda r, s: [{"spring": np.clip(r.twist, -s * most, s * most)}], (0.05, 0.2, 0.5)),
            Term("nonlinear-stiffness", place, lambda r, s: power(r.twist, s), (2, 3)),
            Term("nonlinear-damping", place, lambda r, s: power(r.rate_of_twist, s), (0.5, 2)),
            Term("transmission-hysteresis", place, lambda r, s: [{"spring": dahl(r.twist, s * most)}], (0.1, 0.5)),
        ]
