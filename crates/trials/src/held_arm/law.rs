//! What a real arm on a base that does not move does beyond its simulation, other than in the effect library; size 0 is no
//! effect. Angles and torques on the joint's side of the gear.

use super::chain::JOINTS;
use super::space::{Arrow, times};
use super::values::{HeldArmState, HeldArmValues, OWN, RATE};
use crate::joint::{Pulse, pulses};
use crate::slip::Slip;

/// The laws.
#[derive(Clone, Debug)]
pub(crate) enum HeldLaw {
    /// Above L = peak (1 - size): slope 0.12, or w tanh((T - L) / w) in addition with w = 0.3 size peak.
    Clip { peak: f64, slope: bool },
    /// Dead time of `size` s.
    DeadTime,
    /// Two equal lags in series, together `size` s.
    TwoLags,
    /// T sin(k theta + a) + 0.35 T sin(2 k theta + b).
    Ripple { torque: f64, order: f64, a: f64, b: f64 },
    /// Impulses on the motor that the command does not show.
    PushMotor { pulses: Vec<Pulse> },
    /// Extra dry friction tau_c size / (1 + (omega / w)^2).
    Lorentz { width: f64 },
    /// Dry friction times 1 +- size, the speed-dependent part by 0.4 of it.
    Asymmetry,
    /// size (sqrt(T^2 + T0^2) - T0).
    Carried { soft: f64 },
    /// tau size asinh(omega / w): shear thinning.
    Shear { torque: f64, width: f64 },
    /// tau size (w^2 + w^3 / 2), w = omega / W.
    Churn { torque: f64, width: f64 },
    /// Friction falls with the heat that it makes: 1 / (1 + size h).
    Heat { power: f64 },
    /// Friction rises or falls in a straight line over the run.
    Ramp { sign: f64 },
    /// Dry friction as a Maxwell-slip bank: elements yield at size times these shares of `reach`.
    Presliding { reach: f64 },
    /// Gap of `size` rad, contact that never pulls, damping that grows with the penetration.
    Play { depth: f64 },
    /// K eps (1 + size |eps / E|^1.5).
    Power { reach: f64 },
    /// K eps / (1 + size |eps| / E).
    Soft { reach: f64 },
    /// Maxwell-slip bank in parallel with the spring.
    Hysteresis { torque: f64, reach: f64 },
    /// D rate size (|rate| / R).
    RateDamping { damping: f64, rate: f64 },
    /// Two orders of the wave generator.
    GearError { order: f64, a: f64, b: f64 },
    /// A joint assumed rigid: its stiffness is K / size, the spring slightly progressive.
    Compliant { reach: f64 },
    /// Friction of the link against its carrier: Maxwell-slip bank and 30 % viscous.
    LoadSlip { torque: f64, reach: f64, speed: f64 },
    /// Impulses on the tip along `way`, axes of the ground.
    PushTip { pulses: Vec<Pulse>, way: Arrow },
    /// Channel late by `size` s.
    Late { channel: usize },
    /// An eccentric disc.
    Eccentric { channel: usize, phase: f64 },
    /// Offset `size` t / T, or a bend in the middle of the run.
    Creep { channel: usize, bend: f64 },

    // What the list of effects does not have, or not for such a robot.
    /// A payload slides along the last body by `size` m.
    Slides { way: Arrow, middle: f64, width: f64 },
    /// The spring loses `size` of its stiffness over the run.
    Warmer,
    /// A dress pack between joints `joint` and the next: torque from the sum of their angles.
    DressPack { torque: f64, center: f64, width: f64 },
    /// The encoder holds its value now and then.
    Stutter { channel: usize, holds: Vec<(f64, f64)> },
    /// The torque drops by `size` in short spells.
    Brushes { spells: Vec<(f64, f64)> },
    /// A share of the torque commanded of the next joint.
    Crosstalk,
}

/// A law with its amplitude and its joint (from 0).
#[derive(Clone, Debug)]
pub(crate) struct HeldLawEffect {
    pub(crate) size: f64,
    pub(crate) law: HeldLaw,
    pub(crate) joint: usize,
    /// Where its states begin.
    pub(crate) at: usize,
}

/// Friction of a motor at one instant: sliding and break-away level, speed-dependent part with the sign of the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldFriction {
    pub(crate) dry: f64,
    pub(crate) breakaway: f64,
    pub(crate) viscous: f64,
}

impl HeldLawEffect {
    pub(crate) fn new(law: HeldLaw, size: f64, joint: usize) -> Self {
        Self { size, law, joint, at: 0 }
    }
    /// It acts at some times of a run alone.
    pub(crate) fn in_spells(law: &HeldLaw) -> bool {
        matches!(
            law,
            HeldLaw::PushMotor { .. }
                | HeldLaw::PushTip { .. }
                | HeldLaw::Brushes { .. }
                | HeldLaw::Stutter { .. }
        )
    }
    pub(crate) fn states(&self) -> usize {
        match self.law {
            HeldLaw::TwoLags => 2,
            HeldLaw::Heat { .. } => 1,
            _ => 0,
        }
    }
    pub(crate) fn yields(&self, v: &HeldArmValues) -> Vec<(f64, f64)> {
        let s = self.size;
        let bank = |torque: f64, reach: f64| {
            [(0.3, 0.5), (1.0, 0.3), (2.0, 0.2)].iter().map(|(d, f)| (reach * d, s * torque * f)).collect()
        };
        match self.law {
            HeldLaw::Presliding { reach } => [0.25, 0.6, 1.0, 1.6, 2.4]
                .iter()
                .map(|d| (s * reach * d, v.coulomb[self.joint] / 5.0))
                .collect(),
            HeldLaw::Hysteresis { torque, reach } => bank(torque, 0.45 * reach),
            HeldLaw::LoadSlip { torque, reach, .. } => bank(torque, reach),
            _ => Vec::new(),
        }
    }
    /// The displacement that its bank follows; `motor`: coordinate of the motor.
    pub(crate) fn place(&self, x: &HeldArmState, motor: usize) -> f64 {
        match self.law {
            HeldLaw::Presliding { .. } => x[motor],
            HeldLaw::Hysteresis { .. } => x[motor] - x[self.joint],
            _ => x[self.joint],
        }
    }
    pub(crate) fn dead_time(&self) -> f64 {
        if matches!(self.law, HeldLaw::DeadTime) { self.size } else { 0.0 }
    }
    pub(crate) fn lagged(&self, x: &HeldArmState, torque: f64) -> f64 {
        if matches!(self.law, HeldLaw::TwoLags) { x[self.at + 1] } else { torque }
    }
    pub(crate) fn clipped(&self, t: f64, torque: f64) -> f64 {
        match &self.law {
            HeldLaw::Clip { peak, slope } => {
                let limit = peak * (1.0 - self.size);
                if *slope {
                    0.88 * torque.clamp(-limit, limit) + 0.12 * torque
                } else {
                    let (within, soft) = (torque.clamp(-limit, limit), (0.3 * self.size * peak).max(1e-9));
                    within + soft * ((torque - within) / soft).tanh()
                }
            }
            HeldLaw::Brushes { spells } if spells.iter().any(|(a, b)| t > *a && t < *b) => {
                torque * (1.0 - self.size)
            }
            _ => torque,
        }
    }
    /// Torque that the motor gets in addition; `next`: what is commanded of the next joint.
    pub(crate) fn on_motor(&self, t: f64, theta: f64, next: f64) -> f64 {
        match &self.law {
            HeldLaw::Ripple { torque, order, a, b } => {
                let phi = order * theta;
                self.size * torque * ((phi + a).sin() + 0.35 * (2.0 * phi + b).sin())
            }
            HeldLaw::PushMotor { pulses: list } => self.size * pulses(list, t),
            HeldLaw::Crosstalk => self.size * next,
            _ => 0.0,
        }
    }
    /// Gear error and its slope.
    pub(crate) fn gear_error(&self, theta: f64) -> (f64, f64) {
        let HeldLaw::GearError { order, a, b } = self.law else { return (0.0, 0.0) };
        let phi = order * theta;
        let e = (phi + a).sin() + 0.4 * (2.0 * phi + b).sin();
        let de = order * ((phi + a).cos() + 0.8 * (2.0 * phi + b).cos());
        (self.size * e, self.size * de)
    }
    pub(crate) fn stiffness_factor(&self, t: f64, span: f64) -> f64 {
        match self.law {
            HeldLaw::Warmer => 1.0 - self.size * (t / span).clamp(0.0, 1.0),
            HeldLaw::Compliant { .. } => 1.0 / self.size,
            _ => 1.0,
        }
    }
    /// The spring's torque with this law; `k`, `b`: stiffness and damping of the plant.
    pub(crate) fn spring(&self, k: f64, b: f64, eps: f64, rate: f64, linear: f64) -> f64 {
        let s = self.size;
        match self.law {
            HeldLaw::Play { depth } => {
                let pressed = eps.abs() - 0.5 * s;
                if pressed <= 0.0 {
                    return 0.0;
                }
                let damping = b * (pressed / depth).min(1.0) * rate * eps.signum();
                (k * pressed + damping).max(0.0) * eps.signum()
            }
            HeldLaw::Power { reach } => linear + k * eps * s * (eps / reach).abs().powf(1.5),
            HeldLaw::Soft { reach } => linear + k * eps * (1.0 / (1.0 + s * eps.abs() / reach) - 1.0),
            HeldLaw::RateDamping { damping, rate: r } => linear + s * damping * rate * rate.abs() / r,
            HeldLaw::Compliant { reach } => linear + 0.1 * (k / s) * eps * (eps / (reach * s)).abs(),
            _ => linear,
        }
    }
    /// Friction with this law: `speed` along the direction `way`, `carried`: torque of the transmission.
    pub(crate) fn friction(
        &self,
        coulomb: f64,
        (speed, way, carried): (f64, f64, f64),
        mut f: HeldFriction,
    ) -> HeldFriction {
        let s = self.size;
        let sign = (speed * way).signum();
        match self.law {
            HeldLaw::Lorentz { width } => {
                f.dry += coulomb * s / (1.0 + (speed / width).powi(2));
                f.breakaway += coulomb * s;
            }
            HeldLaw::Asymmetry => {
                (f.dry, f.breakaway) = (f.dry * (1.0 + s * way), f.breakaway * (1.0 + s * way));
                f.viscous *= 1.0 + 0.4 * s * way;
            }
            HeldLaw::Carried { soft } => {
                let more = s * (carried.hypot(soft) - soft);
                (f.dry, f.breakaway) = (f.dry + more, f.breakaway + more);
            }
            HeldLaw::Shear { torque, width } => f.viscous += s * torque * (speed / width).asinh() * way,
            HeldLaw::Churn { torque, width } => {
                let w = (speed / width).abs();
                f.viscous += s * torque * (w * w + 0.5 * w * w * w) * sign;
            }
            _ => {}
        }
        f
    }
    pub(crate) fn friction_factor(&self, t: f64, span: f64, x: &HeldArmState) -> f64 {
        match self.law {
            HeldLaw::Heat { .. } => 1.0 / (1.0 + self.size * x[self.at]),
            HeldLaw::Ramp { sign } => 1.0 + sign * self.size * (t / span).clamp(0.0, 1.0),
            _ => 1.0,
        }
    }
    /// Adds the torques between links and their carriers.
    pub(crate) fn on_links(&self, x: &HeldArmState, slip: &Slip, torque: &mut [f64]) {
        let j = self.joint;
        match self.law {
            HeldLaw::LoadSlip { torque: scale, speed, .. } => {
                torque[j] -= slip.torque(x[j]) + 0.3 * self.size * scale * x[RATE + j] / speed;
            }
            HeldLaw::DressPack { torque: scale, center, width } => {
                let other = (j + 1).min(JOINTS - 1);
                let pull = self.size * scale * ((x[j] + x[other] - center) / width).sinh();
                torque[j] -= pull;
                torque[other] -= pull;
            }
            _ => {}
        }
    }
    /// Force on the tip.
    pub(crate) fn on_tip(&self, t: f64) -> Arrow {
        match &self.law {
            HeldLaw::PushTip { pulses: list, way } => times(self.size * pulses(list, t), *way),
            _ => [0.0; 3],
        }
    }
    /// How far the centre of mass of the last body has moved.
    pub(crate) fn slid(&self, t: f64) -> Option<Arrow> {
        let HeldLaw::Slides { way, middle, width } = self.law else { return None };
        Some(times(self.size * (0.5 + 0.5 * ((t - middle) / width).tanh()), way))
    }
    /// Rates of its own states; `friction`: of its motor.
    pub(crate) fn own_rates(
        &self,
        x: &HeldArmState,
        command: f64,
        friction: f64,
        rate: f64,
        dx: &mut HeldArmState,
    ) {
        match self.law {
            HeldLaw::TwoLags => {
                let tau = 0.5 * self.size;
                dx[self.at] = (command - x[self.at]) / tau;
                dx[self.at + 1] = (x[self.at] - x[self.at + 1]) / tau;
            }
            HeldLaw::Heat { power } => dx[self.at] = (friction * rate).abs() / power,
            _ => {}
        }
    }
}

/// Gives each effect its states.
pub(super) fn placed(mut effects: Vec<HeldLawEffect>) -> Vec<HeldLawEffect> {
    let mut at = OWN;
    for e in &mut effects {
        e.at = at;
        at += e.states();
    }
    effects
}
