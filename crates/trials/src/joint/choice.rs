//! Which law represents an effect, and the bounds of its size.

use super::law::{JointLaw, Pulse};
use super::values::JointValues;
use crate::draw::SeededDraw;

/// How large things are in a run without effects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointScales {
    /// Largest motor torque, N.m.
    pub(crate) torque: f64,
    /// Largest motor speed, rad/s.
    pub(crate) speed: f64,
    /// Largest deflection (rad) and its rate (rad/s), motor side.
    pub(crate) deflection: f64,
    pub(crate) rate: f64,
    /// Middle and half range of the load's angle, rad.
    pub(crate) center: f64,
    pub(crate) reach: f64,
    /// Length of a run in s.
    pub(crate) span: f64,
}

/// An effect before its size is known.
#[derive(Clone, Debug)]
pub(crate) struct JointEffectDraw {
    pub(crate) id: &'static str,
    pub(crate) component: String,
    pub(crate) name: &'static str,
    pub(crate) law: JointLaw,
    pub(crate) least: f64,
    pub(crate) most: f64,
}

/// Effects that a joint can have; the last two change the nominal model.
pub(crate) const IDS: [&str; 25] = [
    "stribeck-friction",
    "backlash",
    "gravity-torque",
    "actuator-lag",
    "transmission-hysteresis",
    "asymmetric-friction",
    "nonlinear-stiffness",
    "external-force",
    "sensor-delay",
    "load-friction",
    "current-saturation",
    "kinematic-error",
    "load-dependent-friction",
    "flexible-link",
    "torque-ripple",
    "presliding-friction",
    "cable-stiffness",
    "nonlinear-viscous-friction",
    "sensor-drift",
    "friction-drift",
    "nonlinear-damping",
    "sensor-eccentricity",
    "external-force",
    "motor-friction",
    "joint-flexibility",
];

/// What the list of effects does not have.
pub(crate) const OUTSIDE: [&str; 6] = [
    "cracked-gear",
    "intermittent-encoder",
    "spring-thermal",
    "cross-axis",
    "varying-inertia",
    "brush-dropout",
];

/// One to three impulses of height 1 at most.
pub(crate) fn draw_pulses(d: &mut SeededDraw, span: f64) -> Vec<Pulse> {
    let triangle = d.chance(0.5);
    (0..1 + d.below(3))
        .map(|_| Pulse {
            start: d.uniform(0.1, 0.75) * span,
            length: d.uniform(0.1, 1.2),
            height: d.sign() * d.uniform(0.6, 1.0),
            triangle,
        })
        .collect()
}

/// Spells (begin, end) of up to `longest` s.
pub(crate) fn spells(d: &mut SeededDraw, span: f64, longest: f64) -> Vec<(f64, f64)> {
    (0..4 + d.below(8))
        .map(|_| {
            let begin = d.uniform(0.02, 0.95) * span;
            (begin, begin + d.uniform(0.1, 1.0) * longest)
        })
        .collect()
}

/// Names of the channels by number.
pub(crate) const CHANNELS: [&str; 4] = ["motorAngle", "loadAngle", "motorVelocity", "transmissionTorque"];

/// Draws a law for `id`; nothing where the effect cannot act on this drive.
pub(crate) fn choose(
    id: &'static str,
    d: &mut SeededDraw,
    v: &JointValues,
    s: &JointScales,
    small: bool,
) -> Option<JointEffectDraw> {
    let n = v.gear_ratio;
    let made = |component: &str, name, law, least, most| {
        Some(JointEffectDraw { id, component: component.to_owned(), name, law, least, most })
    };
    let a = d.phase();
    let b = d.phase();
    let channel = d.below(2);
    let at = format!("sensor:{}", CHANNELS[channel]);
    let kind = d.below(3);
    match id {
        "current-saturation" => {
            let slope = (kind == 0).then_some(0.12);
            made("actuator", "clip", JointLaw::Clip { peak: s.torque, slope }, 0.03, 0.75)
        }
        "actuator-lag" if kind == 0 => made("actuator", "two-lags", JointLaw::TwoLags, 1e-3, 0.08),
        "actuator-lag" => made("actuator", "dead-time", JointLaw::DeadTime, 5e-4, 0.06),
        "torque-ripple" if small => {
            let order = d.pick(&[2.0, 4.0, 6.0, 7.0]);
            made("actuator", "two-orders", JointLaw::Ripple { torque: s.torque, order, a, b }, 1e-3, 2.0)
        }
        "stribeck-friction" => {
            let width = d.log(0.01, 0.12) * s.speed;
            made("motor-friction", "lorentz", JointLaw::Lorentz { width }, 0.1, 6.0)
        }
        "asymmetric-friction" => made("motor-friction", "factor", JointLaw::Asymmetry, 0.01, 0.8),
        "load-dependent-friction" => {
            made("motor-friction", "hypot", JointLaw::Carried { soft: 0.15 * s.torque }, 0.01, 0.6)
        }
        "nonlinear-viscous-friction" if kind == 0 => {
            let width = d.uniform(0.03, 0.1) * s.speed;
            made("motor-friction", "asinh", JointLaw::Shear { torque: v.coulomb, width }, 0.02, 3.0)
        }
        "nonlinear-viscous-friction" => {
            let law = JointLaw::Churn { torque: v.coulomb, width: s.speed };
            made("motor-friction", "quadratic-cubic", law, 0.05, 10.0)
        }
        "friction-drift" if kind == 0 => {
            let power = v.coulomb * 0.4 * s.speed * s.span;
            made("motor-friction", "heat", JointLaw::Heat { power }, 0.05, 3.0)
        }
        "friction-drift" => made(
            "motor-friction",
            "ramp",
            JointLaw::Ramp { sign: if kind == 1 { -1.0 } else { 1.0 } },
            0.03,
            0.7,
        ),
        "presliding-friction" => {
            let reach = s.reach * n;
            made("motor-friction", "maxwell-slip", JointLaw::Presliding { reach }, 2e-4, 0.4)
        }
        "motor-friction" => {
            let width = 0.5 * s.speed;
            let law = JointLaw::Plain { coulomb: v.coulomb, viscous: v.viscous, width };
            made("motor-friction", "power-0.85", law, 0.02, 1.5)
        }
        "backlash" => made(
            "transmission",
            "contact",
            JointLaw::Play { depth: 0.3 * s.deflection },
            0.01 * s.deflection,
            8.0 * s.deflection,
        ),
        "nonlinear-stiffness" => {
            let reach = s.deflection;
            match kind {
                0 => made("transmission", "power-2.5", JointLaw::Power { reach }, 0.03, 6.0),
                1 => made("transmission", "piecewise", JointLaw::Piecewise { reach }, 0.03, 6.0),
                _ => made("transmission", "softening", JointLaw::Soft { reach }, 0.03, 3.0),
            }
        }
        "transmission-hysteresis" => {
            let law = JointLaw::Hysteresis { torque: v.stiffness * s.deflection, reach: s.deflection };
            made("transmission", "maxwell-slip", law, 0.01, 1.5)
        }
        "nonlinear-damping" => {
            let (damping, reach) = (v.damping.max(0.02 * v.stiffness / 30.0), s.deflection);
            match kind {
                0 => made("transmission", "strain", JointLaw::StrainDamping { damping, reach }, 0.2, 60.0),
                _ => made(
                    "transmission",
                    "quadratic",
                    JointLaw::RateDamping { damping, rate: s.rate },
                    0.2,
                    60.0,
                ),
            }
        }
        "kinematic-error" if small => {
            let law = JointLaw::GearError { order: d.pick(&[1.0, 2.0]), a, b };
            made("transmission", "two-orders", law, 1e-3, 0.6)
        }
        // The reach of its progression is that of the stiff spring.
        "joint-flexibility" => {
            made("transmission", "progressive", JointLaw::Compliant { reach: s.deflection }, 0.05, 4.0)
        }
        "load-friction" => {
            let law = JointLaw::LoadSlip { torque: n * s.torque, reach: 0.01 * s.reach, speed: s.speed / n };
            made("load", "maxwell-slip", law, 5e-4, 0.3)
        }
        "gravity-torque" => {
            let g = n * s.torque;
            made("load", "pendulum", JointLaw::Unbalance { x: g * a.cos(), y: g * a.sin() }, 5e-4, 0.4)
        }
        "flexible-link" => {
            let w = 0.5 * (v.stiffness * n * n / v.load_inertia).sqrt() * d.uniform(0.8, 1.6);
            let law = JointLaw::LinkModes {
                frequency: [w, w * d.uniform(3.0, 4.0)],
                ratio: d.uniform(0.005, 0.02),
            };
            made("load", "two-modes", law, 5e-3, 0.6)
        }
        "cable-stiffness" => {
            let center = s.center + s.reach * d.uniform(-0.5, 0.5);
            let law = JointLaw::Cable { torque: n * s.torque, center, width: s.reach * d.uniform(0.8, 1.6) };
            made("load", "sinh", law, 5e-4, 0.3)
        }
        "external-force" if kind == 0 => {
            made("actuator", "pulses", JointLaw::PushMotor { pulses: draw_pulses(d, s.span) }, 5e-3, 1.5)
        }
        "external-force" => {
            let mut list = draw_pulses(d, s.span);
            list.iter_mut().for_each(|p| p.height *= n * s.torque);
            made("load", "pulses", JointLaw::PushLoad { pulses: list }, 5e-3, 1.5)
        }
        "sensor-delay" => made(&at, "buffer", JointLaw::Late { channel }, 5e-4, 0.06),
        "sensor-eccentricity" if small => {
            made("sensor:motorAngle", "disc", JointLaw::Eccentric { channel: 0, phase: a }, 1e-3, 0.5)
        }
        "sensor-drift" => {
            let bend = if kind == 0 { d.uniform(0.2, 0.6) } else { 0.0 };
            let reach = if channel == 0 { n * s.reach } else { s.reach };
            made(
                &at,
                if kind == 0 { "bend" } else { "line" },
                JointLaw::Creep { channel, bend },
                1e-4 * reach,
                reach,
            )
        }
        "cracked-gear" => {
            let law = JointLaw::Cracked { torque: n * s.torque, per_turn: 5.0 / s.reach, phase: a };
            made("load", "tooth", law, 0.02, 6.0)
        }
        "intermittent-encoder" => {
            let law = JointLaw::Stutter { channel, holds: spells(d, s.span, 0.25) };
            made(&at, "holds", law, 1.0, 1.0)
        }
        "spring-thermal" => made("transmission", "softer", JointLaw::Warmer, 0.05, 0.8),
        "cross-axis" => {
            let lines = std::array::from_fn(|i| (d.log(2.0, 25.0) * (1.0 + i as f64 * 0.1), d.phase()));
            made("load", "lines", JointLaw::Neighbour { torque: n * s.torque, lines }, 5e-3, 0.6)
        }
        "varying-inertia" => {
            let law = JointLaw::Slides {
                middle: d.uniform(0.35, 0.65) * s.span,
                width: d.uniform(0.1, 0.3) * s.span,
            };
            made("load", "slides", law, 0.05, 2.0)
        }
        "brush-dropout" => {
            made("actuator", "spells", JointLaw::Brushes { spells: spells(d, s.span, 0.12) }, 0.1, 1.0)
        }
        _ => None,
    }
}
