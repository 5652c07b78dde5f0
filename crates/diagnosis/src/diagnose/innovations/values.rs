//! Amplitudes and shapes of the innovations engine's columns as parameters of the effects: where a last fit begins.
//!
//! The engine's columns are linear, an effect's law is not: of a law with companions the terms that the effect has are taken. Torques
//! and angles of the engine are on the motor's side.

use std::f64::consts::PI;

use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::two_mass::parameter as p;
use trueup_hypotheses::innovations::joint_along::{UsualSizes, gear_ratio};
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_models::joint::parameter::{self as joint, NAMES};

/// Longest recordings in which a drift along a line is the beginning of one that settles.
const LONG: f64 = 10.0;
/// Largest share of dry friction that bristles carry: all of it has no level left.
const SHARE: f64 = 0.99;

/// Units of the engine's columns.
pub(super) struct ColumnUnits<'a> {
    /// N.m at the motor.
    torque: f64,
    /// rad at the motor, of reading errors.
    angle: f64,
    /// Turns of the motor per turn of the load.
    gear: f64,
    sizes: &'a UsualSizes,
}

impl<'a> ColumnUnits<'a> {
    /// Of a frame.
    pub(super) fn of(frame: &InnovationsFrame, sizes: &'a UsualSizes) -> Self {
        let (angle, gear) = (sizes.angle_unit(frame), gear_ratio(frame));
        Self { torque: frame.plant.usual_force(), angle, gear, sizes }
    }
}

/// An effect where the engine's fit ended.
pub(super) struct ColumnFit<'a> {
    /// Its id.
    pub id: &'a str,
    /// Shape of its law.
    pub shape: &'a LawShape,
    /// Amplitudes of its law; none where the plant's structure is the effect.
    pub amplitudes: &'a [f64],
    /// The plant's parameters.
    pub theta: &'a [f64],
}

impl ColumnFit<'_> {
    /// Parameters of the effect, and those of the plant that are others with it: name and value; `start`: what a parameter that is
    /// the unit of another is.
    pub(super) fn values(
        &self,
        u: &ColumnUnits<'_>,
        start: impl Fn(&str) -> Option<f64>,
    ) -> Vec<(&'static str, f64)> {
        let a = |k: usize| self.amplitudes.get(k).copied().unwrap_or(0.0);
        let (s, n) = (|name: &str| self.shape.value(name), u.gear);
        let plant = |k: usize| self.theta.get(k).copied().unwrap_or(0.0);
        let power = |name: &str, usual: f64| (start(name).unwrap_or(usual) / usual).powf(s("p"));
        // Readings of the load are in turns of the load.
        let read = if self.shape.place == "sensor:loadAngle" { u.angle / n } else { u.angle };
        let [stiffness, coulomb, viscous, load] =
            [joint::STIFFNESS, joint::COULOMB_FRICTION, joint::VISCOUS_FRICTION, joint::LOAD_INERTIA]
                .map(|k| NAMES[k].0);
        match self.id {
            "current-saturation" => vec![("saturationTorque", s("limit") * plant(p::TORQUE_CONSTANT))],
            "actuator-lag" => vec![("actuatorLag", s("lag")), ("actuatorDelay", s("delay"))],
            "stribeck-friction" => {
                vec![("staticFriction", a(0) * u.torque), ("stribeckVelocity", s("speed"))]
            }
            "asymmetric-friction" => vec![("coulombAsymmetry", a(0) * u.torque), ("viscousAsymmetry", 0.0)],
            "load-dependent-friction" => vec![("loadFrictionCoefficient", a(0))],
            "nonlinear-viscous-friction" => {
                let torque = a(0) * u.torque * power("dragReferenceSpeed", u.sizes.motor_speed);
                vec![("dragTorque", torque), ("dragExponent", s("p"))]
            }
            "friction-drift" => {
                // 1 + a exp(-t/T) = (1 + a) (1 - a / (1 + a) (1 - exp(-t/T))); along a line it begins at 1 - a/2.
                let (time, duration) = (s("time"), u.sizes.duration);
                let begins = if time > 0.0 { 1.0 + a(0) } else { 1.0 - 0.5 * a(0) }.max(0.1);
                let rate = if time > 0.0 { -a(0) / (begins * time) } else { a(0) / (begins * duration) };
                let time = if time > 0.0 { time } else { LONG * duration };
                vec![
                    ("frictionDriftRate", rate),
                    ("frictionDriftTime", time),
                    (coulomb, begins * plant(p::COULOMB_FRICTION)),
                    (viscous, begins * plant(p::VISCOUS_FRICTION)),
                ]
            }
            "presliding-friction" => {
                let share = a(0) * u.torque / plant(p::COULOMB_FRICTION).max(f64::MIN_POSITIVE);
                vec![("preslidingShare", share.clamp(0.0, SHARE)), ("preslidingDisplacement", s("x"))]
            }
            "motor-friction" if self.amplitudes.is_empty() => {
                vec![(coulomb, plant(p::COULOMB_FRICTION)), (viscous, plant(p::VISCOUS_FRICTION))]
            }
            "motor-friction" => {
                vec![(coulomb, a(0) * u.torque), (viscous, a(1) * u.torque / u.sizes.motor_speed)]
            }
            "backlash" if self.amplitudes.len() > 1 => {
                // A spring of two slopes that has none inside.
                vec![("backlashGap", s("gap")), (stiffness, (1.0 + a(1)) * plant(p::STIFFNESS))]
            }
            "backlash" => vec![("backlashGap", s("gap"))],
            "nonlinear-stiffness" if self.shape.form == "slopes" => vec![
                ("cubicStiffness", 0.0),
                ("kneeStiffness", -a(0) * plant(p::STIFFNESS)),
                ("kneeDeflection", s("bend")),
                (stiffness, (1.0 + a(0) + a(1)) * plant(p::STIFFNESS)),
            ],
            "nonlinear-stiffness" => vec![
                ("cubicStiffness", a(0) * plant(p::STIFFNESS) / u.sizes.twist.powi(2)),
                ("kneeStiffness", 0.0),
            ],
            "transmission-hysteresis" => {
                let torque = u.torque * (a(0) + a(1) + a(2));
                vec![("hysteresisTorque", torque), ("hysteresisDisplacement", s("x"))]
            }
            "nonlinear-damping" => {
                let usual = u.sizes.twist_rate;
                let unit = plant(p::DAMPING).max(2e-4 * plant(p::STIFFNESS)) * usual;
                let torque = a(0) * unit * power("dampingReferenceRate", usual);
                vec![("dampingTorque", torque), ("dampingExponent", s("p"))]
            }
            "flexible-link" => {
                // Of a pole that is free the amplitude is m / (1 - m), and its frequency is that of the held tip over sqrt(1 - m).
                let held = self.amplitudes.is_empty();
                let share = if held { s("m") } else { a(0).max(1e-3) / (1.0 + a(0).max(1e-3)) };
                let hertz = if held { s("f") } else { s("f") * (1.0 - share).sqrt() };
                let (tip, w) = (share * plant(p::LOAD_INERTIA), 2.0 * PI * hertz);
                vec![
                    ("tipInertia", tip),
                    ("linkStiffness", tip * w * w),
                    ("linkDamping", 2.0 * s("z") * tip * w),
                    (load, (1.0 - share) * plant(p::LOAD_INERTIA)),
                ]
            }
            "load-friction" => {
                let level = self.shape.get("a").map_or(a(0) + a(2), |level| a(0) * level);
                let torque = (level * u.torque * n).max(0.0);
                let more = (a(1) * u.torque * n * n / u.sizes.load_speed).max(0.0);
                let mut all = vec![("loadFriction", torque), ("loadViscousFriction", more)];
                all.extend(self.shape.get("x").map(|x| ("loadFrictionDisplacement", x / n)));
                all
            }
            "gravity-torque" => {
                let [sine, cosine] = [a(0), a(1)].map(|a| a * u.torque * n);
                vec![("gravityTorque", sine.hypot(cosine)), ("gravityAngle", cosine.atan2(-sine))]
            }
            "cable-stiffness" => {
                let torque = u.torque * n;
                let k = (-torque * a(0) / u.sizes.load_angle).max(f64::MIN_POSITIVE);
                vec![("cableStiffness", k), ("cableAngle", torque * a(1) / k)]
            }
            "sensor-delay" => vec![("delay", s("d"))],
            "sensor-drift" => {
                let duration = u.sizes.duration;
                let line = a(1) * read / duration;
                match self.shape.get("time") {
                    Some(time) if (a(0) / time).abs() > (a(1) / duration).abs() => {
                        vec![("driftRate", a(0) * read / time), ("driftTime", time), ("driftStart", 0.0)]
                    }
                    None if a(0).abs() > a(1).abs() => vec![
                        ("driftRate", a(0) * read / duration),
                        ("driftTime", LONG * duration),
                        ("driftStart", s("k") * duration),
                    ],
                    _ => vec![("driftRate", line), ("driftTime", LONG * duration), ("driftStart", 0.0)],
                }
            }
            "sensor-eccentricity" => vec![
                ("eccentricitySine", a(0) * read),
                ("eccentricityCosine", a(1) * read),
                ("eccentricityOrder", s("h")),
            ],
            "torque-ripple" => vec![
                ("rippleSine", a(0) * u.torque),
                ("rippleCosine", a(1) * u.torque),
                ("rippleSine2", a(2) * u.torque),
                ("rippleCosine2", a(3) * u.torque),
                ("rippleOrder", s("h")),
            ],
            // The engine adds to the twist what the effect takes from it.
            "kinematic-error" => vec![
                ("kinematicErrorSine", -a(0) * u.angle),
                ("kinematicErrorCosine", -a(1) * u.angle),
                ("kinematicErrorSine2", -a(2) * u.angle),
                ("kinematicErrorCosine2", -a(3) * u.angle),
                ("kinematicErrorOrder", s("h")),
            ],
            "external-force" => self.pushes(u),
            "joint-flexibility" => {
                vec![(stiffness, plant(p::STIFFNESS)), (NAMES[joint::DAMPING].0, plant(p::DAMPING))]
            }
            _ => Vec::new(),
        }
    }

    /// The largest impulses in the order of their times. A raised cosine of a width is edges of half of it.
    fn pushes(&self, u: &ColumnUnits<'_>) -> Vec<(&'static str, f64)> {
        const PUSHES: [[&str; 4]; trueup_models::effect::PUSHES] = [
            ["torque", "start", "duration", "edge"],
            ["secondTorque", "secondStart", "secondDuration", "secondEdge"],
            ["thirdTorque", "thirdStart", "thirdDuration", "thirdEdge"],
        ];
        let unit = if self.shape.place == "load" { u.torque * u.gear } else { u.torque };
        let mut all: Vec<([f64; 2], f64)> =
            self.shape.pulses.iter().copied().zip(self.amplitudes.iter().map(|a| a * unit)).collect();
        all.sort_by(|a, b| (b.1 * b.0[1]).abs().total_cmp(&(a.1 * a.0[1]).abs()));
        all.truncate(PUSHES.len());
        all.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let own = |(names, ([begin, width], size)): (&[&'static str; 4], ([f64; 2], f64))| {
            let half = 0.5 * width;
            [(names[0], size), (names[1], begin), (names[2], half), (names[3], half)]
        };
        PUSHES.iter().zip(all).flat_map(own).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: UsualSizes = UsualSizes {
        current: 1.0,
        motor_speed: 20.0,
        load_speed: 15.0,
        load_angle: 0.7,
        twist: 0.1,
        twist_rate: 2.0,
        range: 90.0,
        duration: 8.0,
    };
    const GEAR: f64 = 50.0;
    const TORQUE: f64 = 0.01;

    fn theta() -> Vec<f64> {
        let mut theta = vec![0.0; p::COUNT];
        (theta[p::STIFFNESS], theta[p::COULOMB_FRICTION], theta[p::LOAD_INERTIA]) = (0.2, 0.012, 0.6);
        theta
    }

    fn values(id: &str, shape: &LawShape, amplitudes: &[f64]) -> impl Fn(&str) -> f64 + use<> {
        let units = ColumnUnits { torque: TORQUE, angle: 0.05, gear: GEAR, sizes: &USUAL };
        let all = ColumnFit { id, shape, amplitudes, theta: &theta() }.values(&units, |_| None);
        move |name| all.iter().rev().find(|v| v.0 == name).unwrap().1
    }

    fn alike(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
    }

    /// The effect's law with these values is what the columns add to the plant's friction.
    #[test]
    fn friction_that_drifts_is_that_of_the_columns() {
        for (time, a) in [(3.0, 0.6), (3.0, -0.4), (0.0, 0.5), (0.0, -0.5)] {
            let of =
                values("friction-drift", &LawShape::new("motor-friction", "time", &[("time", time)]), &[a]);
            let (rate, settles) = (of("frictionDriftRate"), of("frictionDriftTime"));
            for t in [0.0, 1.0, 5.0, 8.0] {
                let course = if time > 0.0 { f64::exp(-t / time) } else { t / USUAL.duration - 0.5 };
                let columns = 0.012 * (1.0 + a * course);
                let grown = if time > 0.0 { settles * (1.0 - f64::exp(-t / settles)) } else { t };
                alike(of("coulombFriction") * (1.0 + rate * grown), columns);
            }
        }
    }

    #[test]
    fn a_spring_of_two_slopes_is_that_of_the_columns() {
        let (a, bend) = ([-0.5, 0.3], 0.04);
        let of =
            values("nonlinear-stiffness", &LawShape::new("transmission", "slopes", &[("bend", bend)]), &a);
        for x in [-0.2f64, -0.04, 0.01, 0.039, 0.3] {
            let columns = 0.2 * (x + a[0] * x.clamp(-bend, bend) + a[1] * x);
            let beyond = x.signum() * (x.abs() - of("kneeDeflection")).max(0.0);
            alike(of("stiffness") * x + of("kneeStiffness") * beyond, columns);
        }
        // One without a slope inside is play: outside it has the same slope and the same zero.
        let free = values("backlash", &LawShape::new("transmission", "gap", &[("gap", 0.08)]), &[-1.3, 0.3]);
        alike(free("stiffness") * (0.3 - 0.5 * free("backlashGap")), 0.2 * (1.3 * 0.3 - 1.3 * 0.04));
    }

    #[test]
    fn weight_tips_and_pushes_are_those_of_the_columns() {
        let of = values("gravity-torque", &LawShape::new("load", "weight", &[]), &[-0.3, 0.8]);
        for q in [-2.0f64, 0.1, 1.4] {
            let columns = TORQUE * GEAR * (-0.3 * q.sin() + 0.8 * q.cos());
            alike(-of("gravityTorque") * (q - of("gravityAngle")).sin(), columns);
        }
        // Motor and load free, tip and hub swing against each other at the pole; together they are the load.
        let of = values("flexible-link", &LawShape::new("load", "pole", &[("f", 7.0), ("z", 0.03)]), &[0.25]);
        let (tip, hub) = (of("tipInertia"), of("loadInertia"));
        alike(tip + hub, 0.6);
        alike((of("linkStiffness") * (1.0 / tip + 1.0 / hub)).sqrt(), 2.0 * PI * 7.0);
        alike(tip / hub, 0.25);
        // The largest three of four, in the order of their times.
        let pulses = vec![[3.0, 0.4], [1.0, 0.2], [5.0, 0.6], [2.0, 0.1]];
        let shape = LawShape { pulses, ..LawShape::new("load", "pulses", &[]) };
        let of = values("external-force", &shape, &[1.0, -2.0, 0.5, 0.1]);
        assert_eq!(["start", "secondStart", "thirdStart"].map(&of), [1.0, 3.0, 5.0]);
        let risen = |s: f64, edge: f64| match s / edge {
            x if x <= 0.0 => 0.0,
            x if x >= 1.0 => 1.0,
            x => 0.5 * (1.0 - (PI * x).cos()),
        };
        for t in [2.9f64, 3.05, 3.2, 3.39, 3.5] {
            let since = t - of("secondStart");
            let edge = of("secondEdge");
            let push = of("secondTorque") * (risen(since, edge) - risen(since - of("secondDuration"), edge));
            let inside = t > 3.0 && t < 3.4;
            let columns = if inside { 0.5 * (1.0 - (2.0 * PI * (t - 3.0) / 0.4).cos()) } else { 0.0 };
            alike(push, TORQUE * GEAR * columns);
        }
    }
}
