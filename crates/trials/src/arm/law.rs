//! What a real arm does beyond its simulation, other than in the effect library; size 0 is no effect.

use super::state::{ArmState, COORDINATES};
use crate::joint::{Pulse, pulses};
use crate::slip::Slip;

/// The laws.
#[derive(Clone, Debug)]
pub(crate) enum ArmLaw {
    /// Above peak (1 - size) the slope is 0.12.
    Clip {
        peak: f64,
    },
    /// Dead time of `size` s.
    DeadTime,
    /// Two orders of the motor's shaft.
    Ripple {
        torque: f64,
        order: f64,
        a: f64,
        b: f64,
    },
    /// Maxwell-slip with short elements, and |omega|^0.85.
    MotorSlip {
        torque: f64,
        reach: f64,
        speed: f64,
    },
    /// Contact that never pulls behind a gap of `size` rad.
    Play {
        depth: f64,
    },
    /// K eps (1 + size |eps / E|^1.5).
    Power {
        reach: f64,
    },
    /// K eps / (1 + size |eps| / E).
    Soft {
        reach: f64,
    },
    /// Maxwell-slip in parallel with the spring.
    Hysteresis {
        torque: f64,
        reach: f64,
    },
    /// D rate size (|rate| / R).
    RateDamping {
        rate: f64,
    },
    /// Two orders of the wave generator.
    GearError {
        order: f64,
        a: f64,
        b: f64,
    },
    /// A joint assumed rigid: stiffness K / size.
    Compliant,
    /// Friction between a flexible joint's link and its carrier.
    LoadSlip {
        torque: f64,
        reach: f64,
    },
    /// An umbilical: sinh of the distance, a stiffer turn, a sheath that rubs.
    Umbilical {
        force: f64,
        center: [f64; 2],
        width: f64,
        torque: f64,
        attitude: f64,
    },
    /// A push on the tip, the base, or a motor.
    PushTip {
        pulses: Vec<Pulse>,
        way: f64,
    },
    PushBase {
        pulses: Vec<Pulse>,
        way: f64,
        lever: f64,
    },
    PushMotor {
        pulses: Vec<Pulse>,
    },
    /// Drag that grows a little more than in proportion.
    Drag {
        force: f64,
        speed: f64,
        torque: f64,
        rate: f64,
    },
    /// A tilted table.
    Tilt {
        way: f64,
    },
    /// A leak fixed to the body.
    Leak {
        way: f64,
        lever: f64,
    },
    /// A panel on a spring.
    Panel {
        inertia: f64,
        frequency: f64,
        ratio: f64,
    },
    /// Channel late, eccentric, creeping.
    Late {
        channel: usize,
    },
    Eccentric {
        channel: usize,
        phase: f64,
        order: f64,
    },
    Creep {
        channel: usize,
        bend: f64,
    },

    // Not on the list.
    /// The payload slides along the last link.
    Slides {
        middle: f64,
        width: f64,
    },
    /// The spring loses `size` of its stiffness.
    Warmer,
    /// A cable between joints 1 and 3: torque from the product of their angles.
    Harness {
        torque: f64,
    },
    /// The camera holds its value now and then.
    Stutter {
        channel: usize,
        holds: Vec<(f64, f64)>,
    },
    /// A liquid that hits its tank: blows when the base turns fast.
    Blows {
        torque: f64,
        rate: f64,
    },
}

/// A law with its amplitude and its joint (from 0).
#[derive(Clone, Debug)]
pub(crate) struct ArmLawEffect {
    pub(crate) size: f64,
    pub(crate) law: ArmLaw,
    pub(crate) joint: usize,
}

impl ArmLawEffect {
    pub(crate) fn yields(&self) -> Vec<(f64, f64)> {
        let bank = |torque: f64, reach: f64| {
            [(0.3, 0.5), (1.0, 0.3), (2.0, 0.2)]
                .iter()
                .map(|(d, f)| (reach * d, self.size * torque * f))
                .collect()
        };
        match &self.law {
            ArmLaw::MotorSlip { torque, reach, .. } | ArmLaw::LoadSlip { torque, reach } => {
                bank(*torque, *reach)
            }
            ArmLaw::Hysteresis { torque, reach } => bank(*torque, 0.45 * reach),
            ArmLaw::Umbilical { torque, .. } => vec![(0.01, 0.1 * self.size * torque)],
            _ => Vec::new(),
        }
    }
    /// The displacement that its bank follows.
    pub(crate) fn place(&self, x: &ArmState, motor: usize) -> f64 {
        match self.law {
            ArmLaw::MotorSlip { .. } => x[motor],
            ArmLaw::Hysteresis { .. } => x[motor] - x[3 + self.joint],
            ArmLaw::Umbilical { .. } => x[2],
            _ => x[3 + self.joint],
        }
    }
    pub(crate) fn dead_time(&self) -> f64 {
        if matches!(self.law, ArmLaw::DeadTime) { self.size } else { 0.0 }
    }
    /// Torque on the motor.
    pub(crate) fn motor(&self, t: f64, angle: f64, omega: f64, torque: f64, slip: &Slip) -> f64 {
        let s = self.size;
        match &self.law {
            ArmLaw::Clip { peak } => {
                let limit = peak * (1.0 - s);
                0.88 * torque.clamp(-limit, limit) + 0.12 * torque
            }
            ArmLaw::Ripple { torque: scale, order, a, b } => {
                let phi = order * angle;
                torque + s * scale * ((phi + a).sin() + 0.35 * (2.0 * phi + b).sin())
            }
            ArmLaw::MotorSlip { torque: scale, speed, .. } => {
                torque
                    - slip.torque(angle)
                    - 0.4 * s * scale * (omega / speed).abs().powf(0.85) * omega.signum()
            }
            ArmLaw::PushMotor { pulses: list } => torque + s * pulses(list, t),
            _ => torque,
        }
    }
    pub(crate) fn gear_error(&self, angle: f64) -> (f64, f64) {
        let ArmLaw::GearError { order, a, b } = self.law else { return (0.0, 0.0) };
        let phi = order * angle;
        let e = (phi + a).sin() + 0.4 * (2.0 * phi + b).sin();
        let de = order * ((phi + a).cos() + 0.8 * (2.0 * phi + b).cos());
        (self.size * e, self.size * de)
    }
    pub(crate) fn stiffness_factor(&self, joint: usize, t: f64, span: f64) -> f64 {
        match self.law {
            ArmLaw::Warmer if joint == self.joint => 1.0 - self.size * (t / span).clamp(0.0, 1.0),
            ArmLaw::Compliant if joint == self.joint => 1.0 / self.size,
            _ => 1.0,
        }
    }
    pub(crate) fn spring(&self, k: f64, b: f64, eps: f64, rate: f64, linear: f64) -> f64 {
        let s = self.size;
        match self.law {
            ArmLaw::Play { depth } => {
                let pressed = eps.abs() - 0.5 * s;
                if pressed <= 0.0 {
                    return 0.0;
                }
                let damping = b * (pressed / depth).min(1.0) * rate * eps.signum();
                (k * pressed + damping).max(0.0) * eps.signum()
            }
            ArmLaw::Power { reach } => linear + k * eps * s * (eps / reach).abs().powf(1.5),
            ArmLaw::Soft { reach } => linear + k * eps * (1.0 / (1.0 + s * eps.abs() / reach) - 1.0),
            ArmLaw::RateDamping { rate: r } => linear + s * b * rate * rate.abs() / r,
            _ => linear,
        }
    }
    /// Torque between the link and its carrier.
    pub(crate) fn joint(&self, _: f64, x: &ArmState, slip: &Slip) -> f64 {
        match self.law {
            ArmLaw::LoadSlip { .. } => -slip.torque(x[3 + self.joint]),
            ArmLaw::Harness { torque } => -self.size * torque * (2.0 * x[5]).sin(),
            _ => 0.0,
        }
    }
    pub(crate) fn field(&self) -> [f64; 2] {
        match self.law {
            ArmLaw::Tilt { way } => [self.size * way.cos(), self.size * way.sin()],
            _ => [0.0; 2],
        }
    }
    /// Force at the base's centre of mass and torque.
    pub(crate) fn base(&self, t: f64, x: &ArmState, slip: &Slip) -> ([f64; 2], f64) {
        let s = self.size;
        let v = &x[COORDINATES..];
        match &self.law {
            ArmLaw::Umbilical { force, center, width, torque, attitude } => {
                let d = [x[0] - center[0], x[1] - center[1]];
                let r = d[0].hypot(d[1]).max(1e-9);
                let pull = -s * force * (r / width).sinh() / r;
                ([pull * d[0], pull * d[1]], -s * torque * (x[2] - attitude) - slip.torque(x[2]))
            }
            ArmLaw::PushBase { pulses: list, way, lever } => {
                let f = s * pulses(list, t);
                ([f * way.cos(), f * way.sin()], f * lever)
            }
            ArmLaw::Drag { force, speed, torque, rate } => {
                let r = v[0].hypot(v[1]) / speed;
                let c = -s * force * (1.0 + 0.5 * r) / speed;
                let w = v[2] / rate;
                ([c * v[0], c * v[1]], -s * torque * w * (1.0 + 0.5 * w.abs()))
            }
            ArmLaw::Leak { way, lever } => {
                let angle = way + x[2];
                ([s * angle.cos(), s * angle.sin()], s * lever)
            }
            ArmLaw::Blows { torque, rate } => {
                // A blow per wall: short peaks over the base's rate.
                let w = v[2] / rate;
                let near = (w.abs() - 0.6) / 0.08;
                ([0.0; 2], -s * torque * w.signum() * (-near * near).exp())
            }
            _ => ([0.0; 2], 0.0),
        }
    }
    pub(crate) fn tip(&self, t: f64) -> [f64; 2] {
        match &self.law {
            ArmLaw::PushTip { pulses: list, way } => {
                let f = self.size * pulses(list, t);
                [f * way.cos(), f * way.sin()]
            }
            _ => [0.0; 2],
        }
    }
    /// Inertia, frequency, damping ratio.
    pub(crate) fn appendage(&self) -> Option<(f64, f64, f64)> {
        match self.law {
            ArmLaw::Panel { inertia, frequency, ratio } => Some((self.size * inertia, frequency, ratio)),
            _ => None,
        }
    }
    /// Changes (mass, inertia, centre of mass) of the last link.
    pub(crate) fn payload(&self, t: f64, _: f64, body: &mut (f64, f64, [f64; 2])) {
        if let ArmLaw::Slides { middle, width } = self.law {
            body.2[0] += self.size * (0.5 + 0.5 * ((t - middle) / width).tanh());
        }
    }
}
