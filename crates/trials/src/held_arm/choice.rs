//! Which law represents an effect of an arm on a base that does not move, and the bounds of its size.

use super::chain::JOINTS;
use super::channels::channel;
use super::law::HeldLaw;
use super::space::{dot, times};
use super::values::HeldArmValues;
use crate::draw::SeededDraw;
use crate::joint::{draw_pulses, spells};

/// How large things are in a run without effects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HeldScales {
    /// Largest torque and speed per motor.
    pub(crate) torque: [f64; JOINTS],
    pub(crate) speed: [f64; JOINTS],
    /// Largest deflection per spring, and its rate.
    pub(crate) deflection: [f64; JOINTS],
    pub(crate) rate: [f64; JOINTS],
    pub(crate) posture: [f64; JOINTS],
    pub(crate) span: f64,
}

/// An effect before its size is known.
#[derive(Clone, Debug)]
pub(crate) struct HeldEffectDraw {
    pub(crate) id: &'static str,
    pub(crate) component: String,
    pub(crate) name: &'static str,
    pub(crate) law: HeldLaw,
    pub(crate) joint: usize,
    /// It is an effect of one joint.
    pub(crate) of_joint: bool,
    pub(crate) least: f64,
    pub(crate) most: f64,
}

/// Effects that the arm can have; the last one changes the nominal model.
pub(crate) const IDS: [&str; 24] = [
    "stribeck-friction",
    "external-force",
    "asymmetric-friction",
    "actuator-lag",
    "load-dependent-friction",
    "sensor-delay",
    "nonlinear-viscous-friction",
    "current-saturation",
    "presliding-friction",
    "torque-ripple",
    "external-force",
    "backlash",
    "friction-drift",
    "sensor-drift",
    "nonlinear-stiffness",
    "sensor-eccentricity",
    "external-force",
    "transmission-hysteresis",
    "asymmetric-friction",
    "load-friction",
    "stribeck-friction",
    "kinematic-error",
    "nonlinear-damping",
    "joint-flexibility",
];

/// What the list of effects does not have.
pub(crate) const OUTSIDE: [&str; 6] =
    ["sliding-payload", "dress-pack", "encoder-holds", "brush-dropout", "input-crosstalk", "spring-thermal"];

/// Whether `id` requires a spring.
pub(crate) fn needs_spring(id: &str) -> bool {
    matches!(
        id,
        "backlash"
            | "nonlinear-stiffness"
            | "transmission-hysteresis"
            | "load-friction"
            | "kinematic-error"
            | "nonlinear-damping"
            | "joint-flexibility"
            | "spring-thermal"
    )
}

/// Draws a law for `id`; nothing where this arm cannot have it. `alone`: its joint.
pub(crate) fn choose(
    id: &'static str,
    turn: usize,
    d: &mut SeededDraw,
    v: &HeldArmValues,
    s: &HeldScales,
    channels: &[usize],
    alone: Option<usize>,
) -> Option<HeldEffectDraw> {
    let (a, b, kind) = (d.phase(), d.phase(), d.below(3));
    let any = d.below(JOINTS);
    let sprung: Vec<usize> = (0..JOINTS).filter(|j| v.flexible[*j]).collect();
    let j = match (alone, needs_spring(id)) {
        (Some(j), _) => j,
        (None, false) => any,
        (None, true) if sprung.is_empty() => return None,
        (None, true) => d.pick(&sprung),
    };
    // Of the angles only.
    let angles: Vec<usize> = channels.iter().copied().filter(|c| *c < 2 * JOINTS).collect();
    let sensor = d.pick(&angles);
    let (variable, sensed) = channel(sensor);
    let sensor_component = format!("sensor:{variable}");
    let made = |component: &str, joint: Option<usize>, name, law, least, most| {
        Some(HeldEffectDraw {
            id,
            component: component.to_owned(),
            name,
            law,
            joint: joint.unwrap_or(0),
            of_joint: joint.is_some(),
            least,
            most,
        })
    };
    let (at, read) = (Some(j), Some(sensed));
    let coulomb = v.coulomb[j];
    match id {
        "current-saturation" => {
            let law = HeldLaw::Clip { peak: s.torque[j], slope: kind == 0 };
            made("actuator", at, "clip", law, 5e-3, 0.7)
        }
        "actuator-lag" if kind == 0 && alone.is_none() => {
            made("actuator", at, "two-lags", HeldLaw::TwoLags, 1e-3, 0.08)
        }
        "actuator-lag" => made("actuator", at, "dead-time", HeldLaw::DeadTime, 5e-4, 0.08),
        "torque-ripple" => {
            let order = v.chain.gear_ratio[j] * d.pick(&[1.0, 2.0]);
            made(
                "actuator",
                at,
                "two-orders",
                HeldLaw::Ripple { torque: s.torque[j], order, a, b },
                1e-3,
                1.0,
            )
        }
        "stribeck-friction" => {
            let width = d.log(0.02, 0.15) * s.speed[j];
            made("motor-friction", at, "lorentz", HeldLaw::Lorentz { width }, 0.05, 3.0)
        }
        "asymmetric-friction" => made("motor-friction", at, "factor", HeldLaw::Asymmetry, 3e-3, 0.8),
        "load-dependent-friction" => {
            let law = HeldLaw::Carried { soft: 0.1 * s.torque[j] };
            made("motor-friction", at, "hypot", law, 1e-3, 0.4)
        }
        "nonlinear-viscous-friction" if kind == 0 => {
            let law = HeldLaw::Shear { torque: coulomb, width: d.uniform(0.03, 0.1) * s.speed[j] };
            made("motor-friction", at, "asinh", law, 0.02, 1.0)
        }
        "nonlinear-viscous-friction" => {
            let law = HeldLaw::Churn { torque: coulomb, width: s.speed[j] };
            made("motor-friction", at, "quadratic-cubic", law, 0.05, 5.0)
        }
        "friction-drift" if kind == 0 => {
            let power = coulomb * 0.3 * s.speed[j] * s.span;
            made("motor-friction", at, "heat", HeldLaw::Heat { power }, 0.01, 3.0)
        }
        "friction-drift" => {
            let law = HeldLaw::Ramp { sign: if kind == 1 { -1.0 } else { 1.0 } };
            made("motor-friction", at, "ramp", law, 5e-3, 0.8)
        }
        "presliding-friction" => {
            let law = HeldLaw::Presliding { reach: 0.1 };
            made("motor-friction", at, "maxwell-slip", law, 3e-3, 0.5)
        }
        "backlash" => {
            let e = s.deflection[j];
            made("transmission", at, "contact", HeldLaw::Play { depth: 0.3 * e }, 0.01 * e, 4.0 * e)
        }
        "nonlinear-stiffness" => {
            let reach = s.deflection[j];
            match kind {
                0 => made("transmission", at, "softening", HeldLaw::Soft { reach }, 0.03, 2.0),
                _ => made("transmission", at, "power-2.5", HeldLaw::Power { reach }, 0.03, 5.0),
            }
        }
        "transmission-hysteresis" => {
            let reach = s.deflection[j];
            let law = HeldLaw::Hysteresis { torque: v.stiffness[j] * reach, reach };
            made("transmission", at, "maxwell-slip", law, 0.01, 1.0)
        }
        "nonlinear-damping" => {
            let law = HeldLaw::RateDamping { damping: v.damping[j], rate: s.rate[j] };
            made("transmission", at, "quadratic", law, 0.2, 200.0)
        }
        "kinematic-error" => {
            let law = HeldLaw::GearError { order: v.chain.gear_ratio[j] * d.pick(&[1.0, 2.0]), a, b };
            made("transmission", at, "two-orders", law, 2e-6, 2e-3)
        }
        "joint-flexibility" => {
            let law = HeldLaw::Compliant { reach: s.deflection[j] };
            made("transmission", at, "progressive", law, 0.05, 4.0)
        }
        "load-friction" => {
            let law = HeldLaw::LoadSlip { torque: s.torque[j], reach: 2e-3, speed: s.speed[j] };
            made("load", at, "maxwell-slip", law, 1e-3, 0.3)
        }
        "external-force" if turn.is_multiple_of(3) => {
            let mut pulses = draw_pulses(d, s.span);
            pulses.iter_mut().for_each(|p| p.height *= s.torque[j]);
            made("actuator", at, "pulses", HeldLaw::PushMotor { pulses }, 5e-3, 1.0)
        }
        "external-force" => {
            let way = [d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0)];
            let way = times(1.0 / dot(way, way).sqrt().max(1e-3), way);
            let law = HeldLaw::PushTip { pulses: draw_pulses(d, s.span), way };
            made("tip", None, "pulses", law, 0.1, 60.0)
        }
        "sensor-delay" => {
            made(&sensor_component, read, "buffer", HeldLaw::Late { channel: sensor }, 5e-4, 0.08)
        }
        "sensor-eccentricity" => {
            let law = HeldLaw::Eccentric { channel: sensor, phase: a };
            made(&sensor_component, read, "disc", law, 1e-4, 0.06)
        }
        "sensor-drift" => {
            let bend = if d.chance(0.4) { d.uniform(0.2, 0.6) } else { 0.0 };
            let name = if bend > 0.0 { "bend" } else { "line" };
            made(&sensor_component, read, name, HeldLaw::Creep { channel: sensor, bend }, 1e-4, 0.06)
        }
        "sliding-payload" => {
            let way = [d.uniform(-1.0, 1.0), d.uniform(-1.0, 1.0), d.uniform(-0.3, 0.3)];
            let middle = d.uniform(0.35, 0.65) * s.span;
            let law = HeldLaw::Slides { way, middle, width: 0.1 * s.span };
            made("load", None, "slides", law, 1e-3, 0.15)
        }
        "dress-pack" => {
            // Between two neighbours from the elbow on.
            let j = 2 + d.below(3);
            let center = s.posture[j] + s.posture[j + 1] + d.uniform(-0.5, 0.5);
            let law = HeldLaw::DressPack { torque: 0.3 * s.torque[j], center, width: 1.2 };
            made("load", Some(j), "sinh", law, 5e-3, 1.0)
        }
        "encoder-holds" => {
            let law = HeldLaw::Stutter { channel: sensor, holds: spells(d, s.span, 0.25) };
            made(&sensor_component, read, "holds", law, 1.0, 1.0)
        }
        "brush-dropout" => {
            let law = HeldLaw::Brushes { spells: spells(d, s.span, 0.12) };
            made("actuator", at, "spells", law, 0.02, 1.0)
        }
        "input-crosstalk" => {
            made("actuator", Some(j.min(JOINTS - 2)), "share", HeldLaw::Crosstalk, 1e-3, 0.3)
        }
        "spring-thermal" => made("transmission", at, "softer", HeldLaw::Warmer, 0.05, 0.8),
        _ => None,
    }
}
