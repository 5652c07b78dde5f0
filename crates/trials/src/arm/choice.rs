//! Which law represents an effect of an arm, and the bounds of its size.

use super::law::ArmLaw;
use super::plant::ArmValues;
use crate::draw::SeededDraw;
use crate::joint::{draw_pulses, spells};

/// How large things are in a run without effects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArmScales {
    /// Largest torque and speed per joint.
    pub(crate) torque: [f64; 3],
    pub(crate) speed: [f64; 3],
    /// Largest deflection of joint 1 and its rate.
    pub(crate) deflection: f64,
    pub(crate) rate: f64,
    /// How fast the base goes and turns.
    pub(crate) velocity: f64,
    pub(crate) base_rate: f64,
    pub(crate) middle: [f64; 3],
    pub(crate) span: f64,
}

/// An effect before its size is known.
#[derive(Clone, Debug)]
pub(crate) struct ArmEffectDraw {
    pub(crate) id: &'static str,
    pub(crate) component: String,
    pub(crate) name: &'static str,
    pub(crate) law: ArmLaw,
    pub(crate) joint: usize,
    /// It is an effect of one joint.
    pub(crate) of_joint: bool,
    pub(crate) least: f64,
    pub(crate) most: f64,
}

/// Effects that an arm can have; the last one changes the nominal model.
pub(crate) const IDS: [&str; 22] = [
    "table-tilt",
    "motor-friction",
    "backlash",
    "base-drag",
    "external-force",
    "nonlinear-stiffness",
    "sensor-delay",
    "base-thrust",
    "actuator-lag",
    "cable-stiffness",
    "transmission-hysteresis",
    "external-force",
    "appendage-mode",
    "kinematic-error",
    "current-saturation",
    "torque-ripple",
    "sensor-drift",
    "external-force",
    "load-friction",
    "sensor-eccentricity",
    "nonlinear-damping",
    "joint-flexibility",
];

/// What the list of effects does not have.
pub(crate) const OUTSIDE: [&str; 5] =
    ["sliding-payload", "spring-thermal", "joint-harness", "camera-holds", "slosh-blows"];

/// Channels by number: the coordinates, the motor of joint 1 behind them.
pub(crate) const CHANNELS: [&str; 7] = [
    "basePosition[1]",
    "basePosition[2]",
    "baseAttitude",
    "jointAngle[1]",
    "jointAngle[2]",
    "jointAngle[3]",
    "motorAngle[1]",
];

/// Draws a law for `id`; nothing where this arm cannot have it.
pub(crate) fn choose(
    id: &'static str,
    turn: usize,
    d: &mut SeededDraw,
    v: &ArmValues,
    s: &ArmScales,
    channels: &[usize],
) -> Option<ArmEffectDraw> {
    let flexible = v.flexible[0];
    let (a, b, way) = (d.phase(), d.phase(), d.phase());
    let j = d.below(3);
    let channel = d.pick(channels);
    let at = format!("sensor:{}", CHANNELS[channel].split('[').next().unwrap_or_default());
    let sensed = if (3..6).contains(&channel) { channel - 3 } else { 0 };
    let made = |component: &str, joint: Option<usize>, name, law, least, most| {
        Some(ArmEffectDraw {
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
    let gear = Some(0);
    match id {
        "current-saturation" => {
            made("actuator", Some(j), "clip", ArmLaw::Clip { peak: s.torque[j] }, 0.02, 0.8)
        }
        "actuator-lag" => made("actuator", Some(j), "dead-time", ArmLaw::DeadTime, 2e-3, 0.4),
        // Orders of the motor's shaft: the angle here is that of the joint.
        "torque-ripple" => {
            let law = ArmLaw::Ripple { torque: s.torque[j], order: v.gear_ratio * d.pick(&[1.0, 2.0]), a, b };
            made("actuator", Some(j), "two-orders", law, 1e-3, 1.5)
        }
        "motor-friction" => {
            let law = ArmLaw::MotorSlip { torque: s.torque[j], reach: 4e-4, speed: s.speed[j] };
            made("motor-friction", Some(j), "maxwell-slip", law, 2e-3, 0.4)
        }
        "backlash" if flexible => {
            let e = s.deflection;
            made("transmission", gear, "contact", ArmLaw::Play { depth: 0.3 * e }, 0.01 * e, 6.0 * e)
        }
        "nonlinear-stiffness" if flexible => {
            let reach = s.deflection;
            match d.chance(0.6) {
                true => made("transmission", gear, "power-2.5", ArmLaw::Power { reach }, 0.03, 8.0),
                false => made("transmission", gear, "softening", ArmLaw::Soft { reach }, 0.03, 4.0),
            }
        }
        "transmission-hysteresis" if flexible => {
            let law = ArmLaw::Hysteresis { torque: v.stiffness[0] * s.deflection, reach: s.deflection };
            made("transmission", gear, "maxwell-slip", law, 0.01, 1.5)
        }
        "nonlinear-damping" if flexible => {
            made("transmission", gear, "quadratic", ArmLaw::RateDamping { rate: s.rate }, 0.1, 40.0)
        }
        "kinematic-error" if flexible => {
            let law = ArmLaw::GearError { order: v.gear_ratio * d.pick(&[1.0, 2.0]), a, b };
            made("transmission", gear, "two-orders", law, 2e-5, 0.01)
        }
        "joint-flexibility" if flexible => made("transmission", gear, "linear", ArmLaw::Compliant, 0.02, 3.0),
        "load-friction" if flexible => {
            let law = ArmLaw::LoadSlip { torque: s.torque[0], reach: 1e-3 };
            made("load", gear, "maxwell-slip", law, 1e-3, 0.4)
        }
        "cable-stiffness" => {
            let law = ArmLaw::Umbilical {
                force: 1.0,
                center: [s.middle[0] + d.uniform(-0.5, 0.5), s.middle[1] + d.uniform(-0.5, 0.5)],
                width: 0.8,
                torque: 0.6,
                attitude: s.middle[2] + d.uniform(-0.3, 0.3),
            };
            made("base", None, "sinh", law, 1e-4, 3.0)
        }
        "external-force" => match turn % 3 {
            0 => made(
                "base",
                None,
                "pulses",
                ArmLaw::PushBase { pulses: draw_pulses(d, s.span), way, lever: d.uniform(-0.3, 0.3) },
                1e-3,
                20.0,
            ),
            1 => made(
                "tip",
                None,
                "pulses",
                ArmLaw::PushTip { pulses: draw_pulses(d, s.span), way },
                1e-3,
                10.0,
            ),
            _ => {
                let mut pulses = draw_pulses(d, s.span);
                pulses.iter_mut().for_each(|p| p.height *= s.torque[j]);
                made("actuator", Some(j), "pulses", ArmLaw::PushMotor { pulses }, 5e-3, 2.0)
            }
        },
        "base-drag" => {
            let law = ArmLaw::Drag { force: 1.0, speed: s.velocity, torque: 0.3, rate: s.base_rate };
            made("base", None, "more-than-linear", law, 1e-4, 5.0)
        }
        "table-tilt" => made("base", None, "constant", ArmLaw::Tilt { way }, 1e-6, 0.03),
        "base-thrust" => {
            made("base", None, "leak", ArmLaw::Leak { way, lever: d.uniform(-0.25, 0.25) }, 1e-5, 1.0)
        }
        "appendage-mode" => {
            let law = ArmLaw::Panel {
                inertia: v.base_inertia,
                frequency: d.uniform(2.0, 9.0),
                ratio: d.uniform(0.005, 0.02),
            };
            made("base", None, "panel", law, 5e-3, 0.6)
        }
        "sensor-delay" => {
            made(&at, (channel > 2).then_some(sensed), "buffer", ArmLaw::Late { channel }, 2e-3, 0.4)
        }
        "sensor-eccentricity" if channel > 2 => {
            let law = ArmLaw::Eccentric { channel, phase: a, order: 1.0 };
            made(&at, Some(sensed), "disc", law, 2e-4, 0.3)
        }
        "sensor-drift" => {
            let bend = if d.chance(0.4) { d.uniform(0.2, 0.6) } else { 0.0 };
            let name = if bend > 0.0 { "bend" } else { "line" };
            made(&at, (channel > 2).then_some(sensed), name, ArmLaw::Creep { channel, bend }, 1e-4, 0.5)
        }
        "sliding-payload" => {
            let law = ArmLaw::Slides { middle: d.uniform(0.35, 0.65) * s.span, width: 0.15 * s.span };
            made("load", None, "slides", law, 1e-3, 0.15)
        }
        "spring-thermal" if flexible => made("transmission", gear, "softer", ArmLaw::Warmer, 0.05, 0.85),
        "joint-harness" => made("load", gear, "harness", ArmLaw::Harness { torque: s.torque[0] }, 5e-3, 1.0),
        "camera-holds" => {
            let law = ArmLaw::Stutter { channel, holds: spells(d, s.span, 1.0) };
            made(&at, None, "holds", law, 1.0, 1.0)
        }
        "slosh-blows" => {
            let law = ArmLaw::Blows { torque: s.torque[0], rate: s.base_rate };
            made("base", None, "blows", law, 1e-2, 2.0)
        }
        _ => None,
    }
}
