//! What a real joint does beyond its simulation: laws other than those of the effect library.
//!
//! Each law is one amplitude, [`JointLawEffect::size`], times fixed shapes; size 0 is no effect.

use super::values::{JointState, JointValues};
use crate::slip::Slip;

/// A push over time.
#[derive(Clone, Debug)]
pub(crate) struct Pulse {
    pub(crate) start: f64,
    pub(crate) length: f64,
    pub(crate) height: f64,
    /// Triangle, else half a sine.
    pub(crate) triangle: bool,
}

/// Sum of impulses at `t`.
pub(crate) fn pulses(list: &[Pulse], t: f64) -> f64 {
    list.iter()
        .map(|p| {
            let s = (t - p.start) / p.length;
            let shape = match (s > 0.0 && s < 1.0, p.triangle) {
                (false, _) => 0.0,
                (true, true) => 1.0 - (2.0 * s - 1.0).abs(),
                (true, false) => (std::f64::consts::PI * s).sin(),
            };
            p.height * shape
        })
        .sum()
}

/// The laws; capital letters as in the comments, torques motor side unless stated.
#[derive(Clone, Debug)]
pub(crate) enum JointLaw {
    /// Above L = peak (1 - size): slope `slope`, or L tanh(T / L).
    Clip { peak: f64, slope: Option<f64> },
    /// Dead time of `size` seconds.
    DeadTime,
    /// Two equal lags in series, together `size` seconds.
    TwoLags,
    /// T sin(k theta + a) + 0.35 T sin(2 k theta + b).
    Ripple { torque: f64, order: f64, a: f64, b: f64 },
    /// Extra dry friction tau_c size / (1 + (omega / w)^2).
    Lorentz { width: f64 },
    /// All friction times 1 +- size, the speed-dependent part by 0.4 of it.
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
    /// The same over `runs` runs, one after the other; this one begins when `past` of them are over.
    Session { sign: f64, runs: f64, past: f64 },
    /// Dry friction as a Maxwell-slip bank: elements yield at size times these shares of `reach`.
    Presliding { reach: f64 },
    /// Friction where the model has none: dry and |omega|^0.85.
    Plain { coulomb: f64, viscous: f64, width: f64 },
    /// Gap of `size` rad, contact that never pulls, damping that grows with the penetration.
    Play { depth: f64 },
    /// K eps (1 + size |eps / E|^1.5).
    Power { reach: f64 },
    /// Slope K beyond 0.4 E is K (1 + size).
    Piecewise { reach: f64 },
    /// K eps / (1 + size |eps| / E).
    Soft { reach: f64 },
    /// Maxwell-slip bank in the spring.
    Hysteresis { torque: f64, reach: f64 },
    /// D rate (1 + size |rate| / R) beyond the linear.
    RateDamping { damping: f64, rate: f64 },
    /// D rate size (eps / E)^2.
    StrainDamping { damping: f64, reach: f64 },
    /// size (sin(2 theta + a) + 0.4 sin(4 theta + b)), times an order.
    GearError { order: f64, a: f64, b: f64 },
    /// A joint assumed rigid: its stiffness is K / size, the spring slightly progressive.
    Compliant { reach: f64 },
    /// Two modes of the link, participation size and 0.1 size of the load's inertia.
    LinkModes { frequency: [f64; 2], ratio: f64 },
    /// Friction of the load: Maxwell-slip bank and 30 % viscous, load side.
    LoadSlip { torque: f64, reach: f64, speed: f64 },
    /// Unbalanced load: -(g_x sin q + g_y cos q).
    Unbalance { x: f64, y: f64 },
    /// -T sinh((q - c) / w), and a sheath that rubs.
    Cable { torque: f64, center: f64, width: f64 },
    /// Impulses on the load, load side.
    PushLoad { pulses: Vec<Pulse> },
    /// Impulses on the motor that the command does not show.
    PushMotor { pulses: Vec<Pulse> },
    /// The channel late by `size` seconds.
    Late { channel: usize },
    /// An eccentric disc: reading atan2(sin q + e sin a, cos q + e cos a) unwrapped.
    Eccentric { channel: usize, phase: f64 },
    /// Offset `size` t / T, or a bend in the middle of the run.
    Creep { channel: usize, bend: f64 },

    // What the list of effects does not have.
    /// A cracked tooth: an impact of random strength per turn of the load-side wheel, in one direction only.
    Cracked { torque: f64, per_turn: f64, phase: f64 },
    /// The encoder holds its value now and then.
    Stutter { channel: usize, holds: Vec<(f64, f64)> },
    /// The spring loses the share `size` of its stiffness over the run.
    Warmer,
    /// A neighbouring axis shakes the load.
    Neighbour { torque: f64, lines: [(f64, f64); 5] },
    /// The load's inertia grows by `size` of it while a payload slides out.
    Slides { middle: f64, width: f64 },
    /// The torque constant drops by `size` in short spells.
    Brushes { spells: Vec<(f64, f64)> },
}

/// A law with its amplitude.
#[derive(Clone, Debug)]
pub(crate) struct JointLawEffect {
    pub(crate) size: f64,
    pub(crate) law: JointLaw,
    /// Where its states begin.
    pub(crate) at: usize,
}

impl JointLaw {
    pub(crate) fn states(&self) -> usize {
        match self {
            Self::TwoLags => 2,
            Self::Heat { .. } => 1,
            Self::LinkModes { .. } => 4,
            _ => 0,
        }
    }
}

/// tanh-shaped 0 -> 1 and its slope.
fn rise(t: f64, middle: f64, width: f64) -> (f64, f64) {
    let e = ((t - middle) / width).tanh();
    (0.5 * (1.0 + e), 0.5 * (1.0 - e * e) / width)
}

impl JointLawEffect {
    pub(crate) fn new(law: JointLaw, size: f64) -> Self {
        Self { size, law, at: 0 }
    }

    /// As it is in run `i`.
    pub(crate) fn in_run(&self, i: usize) -> Self {
        let mut own = self.clone();
        if let JointLaw::Session { past, .. } = &mut own.law {
            *past = i as f64;
        }
        own
    }

    pub(crate) fn yields(&self, v: &JointValues) -> Vec<(f64, f64)> {
        let s = self.size;
        match &self.law {
            JointLaw::Presliding { reach } => {
                [0.25, 0.6, 1.0, 1.6, 2.4].iter().map(|d| (s * reach * d, v.coulomb / 5.0)).collect()
            }
            JointLaw::Hysteresis { torque, reach } => [(0.1, 0.2), (0.25, 0.3), (0.5, 0.3), (0.9, 0.2)]
                .iter()
                .map(|(d, f)| (reach * d, s * torque * f))
                .collect(),
            JointLaw::LoadSlip { torque, reach, .. } => [(0.3, 0.5), (1.0, 0.3), (2.0, 0.2)]
                .iter()
                .map(|(d, f)| (reach * d, s * torque * f))
                .collect(),
            JointLaw::Cable { torque, width, .. } => vec![(0.05 * width, 0.15 * s * torque)],
            _ => Vec::new(),
        }
    }

    pub(crate) fn dead_time(&self) -> f64 {
        if matches!(self.law, JointLaw::DeadTime) { self.size } else { 0.0 }
    }
    pub(crate) fn lagged(&self, x: &JointState, torque: f64) -> f64 {
        if matches!(self.law, JointLaw::TwoLags) { x[self.at + 1] } else { torque }
    }
    pub(crate) fn clipped(&self, t: f64, torque: f64) -> f64 {
        match &self.law {
            JointLaw::Clip { peak, slope } => {
                let limit = peak * (1.0 - self.size);
                match slope {
                    Some(s) => torque.clamp(-limit, limit) * (1.0 - s) + torque * s,
                    None => limit * (torque / limit).tanh(),
                }
            }
            JointLaw::Brushes { spells } if spells.iter().any(|(a, b)| t > *a && t < *b) => {
                torque * (1.0 - self.size)
            }
            _ => torque,
        }
    }
    pub(crate) fn on_motor(&self, t: f64, theta: f64) -> f64 {
        match &self.law {
            JointLaw::Ripple { torque, order, a, b } => {
                let phi = order * theta;
                self.size * torque * ((phi + a).sin() + 0.35 * (2.0 * phi + b).sin())
            }
            JointLaw::PushMotor { pulses: list } => self.size * pulses(list, t),
            _ => 0.0,
        }
    }
    /// Gear error and its slope.
    pub(crate) fn gear_error(&self, theta: f64) -> (f64, f64) {
        let JointLaw::GearError { order, a, b } = self.law else { return (0.0, 0.0) };
        let phi = order * theta;
        let e = (phi + a).sin() + 0.4 * (2.0 * phi + b).sin();
        let de = order * ((phi + a).cos() + 0.8 * (2.0 * phi + b).cos());
        (self.size * e, self.size * de)
    }
    pub(crate) fn stiffness_factor(&self, t: f64, span: f64) -> f64 {
        match self.law {
            JointLaw::Warmer => 1.0 - self.size * (t / span).clamp(0.0, 1.0),
            JointLaw::Compliant { .. } => 1.0 / self.size,
            _ => 1.0,
        }
    }
    pub(crate) fn spring(&self, v: &JointValues, eps: f64, rate: f64, linear: f64) -> f64 {
        let (k, s) = (v.stiffness, self.size);
        linear
            + match self.law {
                JointLaw::Play { depth } => {
                    let pressed = eps.abs() - 0.5 * s;
                    let contact = if pressed > 0.0 {
                        let damping = v.damping * (pressed / depth).min(1.0) * rate * eps.signum();
                        (k * pressed + damping).max(0.0) * eps.signum()
                    } else {
                        0.0
                    };
                    contact - linear
                }
                JointLaw::Power { reach } => k * eps * s * (eps / reach).abs().powf(1.5),
                JointLaw::Piecewise { reach } => s * k * (eps.abs() - 0.4 * reach).max(0.0) * eps.signum(),
                JointLaw::Soft { reach } => k * eps * (1.0 / (1.0 + s * eps.abs() / reach) - 1.0),
                JointLaw::RateDamping { damping, rate: r } => s * damping * rate * rate.abs() / r,
                JointLaw::StrainDamping { damping, reach } => s * damping * rate * (eps / reach).powi(2),
                JointLaw::Compliant { reach } => 0.1 * (k / s) * eps * (eps / (reach * s)).abs(),
                _ => 0.0,
            }
    }
    pub(crate) fn friction(
        &self,
        v: &JointValues,
        speed: f64,
        way: f64,
        carried: f64,
        dry: f64,
        viscous: f64,
    ) -> (f64, f64) {
        let s = self.size;
        match self.law {
            JointLaw::Lorentz { width } => (dry + v.coulomb * s / (1.0 + (speed / width).powi(2)), viscous),
            JointLaw::Asymmetry => (dry * (1.0 + s * way), viscous * (1.0 + 0.4 * s * way)),
            JointLaw::Carried { soft } => (dry + s * (carried.hypot(soft) - soft), viscous),
            JointLaw::Shear { torque, width } => (dry, viscous + s * torque * (speed / width).asinh() * way),
            JointLaw::Churn { torque, width } => {
                let w = (speed / width).abs();
                (dry, viscous + s * torque * (w * w + 0.5 * w * w * w) * (speed * way).signum())
            }
            JointLaw::Plain { coulomb, viscous: d, width } => {
                let drag = d * width * (speed / width).abs().powf(0.85);
                (dry + s * coulomb, viscous + s * drag * (speed * way).signum())
            }
            _ => (dry, viscous),
        }
    }
    pub(crate) fn friction_factor(&self, t: f64, span: f64, x: &JointState) -> f64 {
        match self.law {
            JointLaw::Heat { .. } => 1.0 / (1.0 + self.size * x[self.at]),
            JointLaw::Ramp { sign } => 1.0 + sign * self.size * (t / span).clamp(0.0, 1.0),
            JointLaw::Session { sign, runs, past } => {
                1.0 + sign * self.size * ((past + t / span) / runs).clamp(0.0, 1.0)
            }
            _ => 1.0,
        }
    }
    /// Torque on the load, load side.
    pub(crate) fn on_load(&self, t: f64, x: &JointState, slip: &Slip, span: f64) -> f64 {
        let (s, q, rate) = (self.size, x[2], x[3]);
        let _ = span;
        match &self.law {
            JointLaw::LoadSlip { torque, speed, .. } => -slip.torque(q) - 0.3 * s * torque * rate / speed,
            JointLaw::Unbalance { x: gx, y: gy } => -s * (gx * q.sin() + gy * q.cos()),
            JointLaw::Cable { torque, center, width } => {
                -s * torque * ((q - center) / width).sinh() - slip.torque(q)
            }
            JointLaw::PushLoad { pulses: list } => s * pulses(list, t),
            JointLaw::Neighbour { torque, lines } => {
                s * torque * lines.iter().map(|(w, p)| (w * t + p).sin()).sum::<f64>()
            }
            JointLaw::Cracked { torque, per_turn, phase } => {
                let turns = q * per_turn + phase;
                let number = turns.round();
                // A strength between 0.3 and 1 that differs from tooth to tooth.
                let strength = 0.3 + 0.7 * (number * 12.9898).sin().abs();
                let near = (turns - number) / 0.02;
                if rate > 0.0 { -s * torque * strength * (-near * near).exp() } else { 0.0 }
            }
            _ => 0.0,
        }
    }
    /// Change of the load's inertia and its rate.
    pub(crate) fn inertia(&self, v: &JointValues, t: f64, _: f64) -> (f64, f64) {
        let JointLaw::Slides { middle, width } = self.law else { return (0.0, 0.0) };
        let (share, slope) = rise(t, middle, width);
        (self.size * v.load_inertia * share, self.size * v.load_inertia * slope)
    }
    /// Calls `each(g, own, at)` per mode of the link: g^2 its inertia, `own` its acceleration by itself, its states.
    pub(crate) fn modes(&self, v: &JointValues, x: &JointState, mut each: impl FnMut(f64, f64, usize)) {
        let JointLaw::LinkModes { frequency, ratio } = self.law else { return };
        for (i, share) in [1.0, 0.1].into_iter().enumerate() {
            let (w, at) = (frequency[i], self.at + 2 * i);
            each(
                (share * self.size * v.load_inertia).sqrt(),
                -w * w * x[at] - 2.0 * ratio * w * x[at + 1],
                at,
            );
        }
    }
    /// Rates of the effect's own states.
    pub(crate) fn own_rates(&self, x: &JointState, command: f64, friction: f64, dx: &mut JointState) {
        match self.law {
            JointLaw::TwoLags => {
                let tau = 0.5 * self.size;
                dx[self.at] = (command - x[self.at]) / tau;
                dx[self.at + 1] = (x[self.at] - x[self.at + 1]) / tau;
            }
            JointLaw::Heat { power } => dx[self.at] = (friction * x[1]).abs() / power,
            _ => {}
        }
    }
}
