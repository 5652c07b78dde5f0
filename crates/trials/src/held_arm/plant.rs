//! An arm of six revolute joints on a base that does not move: rigid bodies and rotors, springs between motors and links
//! where there are any, dry friction at the motors.

use super::chain::JOINTS;
use super::law::{HeldFriction, HeldLaw, HeldLawEffect, placed};
use super::solve::solve;
use super::space::plus;
use super::values::{COORDINATES, HeldArmState, HeldArmValues, RATE};
use crate::slip::Slip;

/// How a motor moves: dry friction holds it, or works against this direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum HeldMode {
    Stuck,
    Slides(f64),
}

/// What happens at one instant.
pub(crate) struct HeldInstant {
    pub(crate) rates: HeldArmState,
    /// Of each motor that is stuck: torque that friction has to hold, and up to which it can.
    pub(crate) holds: [(f64, f64); JOINTS],
}

/// The arm with what its simulation lacks.
#[derive(Clone, Debug)]
pub(crate) struct HeldArm {
    pub(crate) values: HeldArmValues,
    pub(crate) effects: Vec<HeldLawEffect>,
    pub(crate) slips: Vec<Slip>,
    /// Length of the recording in s, for what changes along it.
    pub(crate) span: f64,
}

impl HeldArm {
    pub(crate) fn new(values: HeldArmValues, effects: Vec<HeldLawEffect>, span: f64) -> Self {
        let effects = placed(effects);
        let slips = effects.iter().map(|e| Slip::new(e.yields(&values))).collect();
        Self { values, effects, slips, span }
    }

    fn of(&self, j: usize) -> impl Iterator<Item = (&HeldLawEffect, &Slip)> {
        self.effects.iter().zip(&self.slips).filter(move |(e, _)| e.joint == j)
    }

    /// Torque of joint `j`'s spring on the link, and by how much the gear's error grows with the motor's angle.
    fn spring(&self, t: f64, x: &HeldArmState, j: usize) -> (f64, f64) {
        let v = &self.values;
        if !v.flexible[j] {
            return (0.0, 0.0);
        }
        let m = JOINTS + j;
        let (mut eps, mut rate, mut slope) = (x[m] - x[j], x[RATE + m] - x[RATE + j], 0.0);
        for (e, _) in self.of(j) {
            let (error, de) = e.gear_error(x[m]);
            eps -= error;
            rate -= de * x[RATE + m];
            slope += de;
        }
        let k = self.of(j).fold(v.stiffness[j], |k, (e, _)| k * e.stiffness_factor(t, self.span));
        let mut torque = k * eps + v.damping[j] * rate;
        for (e, s) in self.of(j) {
            torque = e.spring(v.stiffness[j], v.damping[j], eps, rate, torque);
            if matches!(e.law, HeldLaw::Hysteresis { .. }) {
                torque += s.torque(eps);
            }
        }
        (torque, slope)
    }

    /// Friction of joint `j`'s motor along `way`; `carried`: torque of the transmission.
    fn friction(&self, t: f64, x: &HeldArmState, j: usize, way: f64, carried: f64) -> HeldFriction {
        let v = &self.values;
        let omega = x[RATE + v.motor(j)];
        let (dry, breakaway) = (v.coulomb[j], v.breakaway[j]);
        let mut f = HeldFriction { dry, breakaway, viscous: v.viscous[j] * omega };
        let mut scale = 1.0;
        for (e, _) in self.of(j) {
            f = e.friction(v.coulomb[j], (omega * way, way, carried), f);
            scale *= e.friction_factor(t, self.span, x);
        }
        // Bristles carry all of it.
        if self.of(j).any(|(e, _)| matches!(e.law, HeldLaw::Presliding { .. })) {
            (f.dry, f.breakaway) = (0.0, 0.0);
        }
        HeldFriction {
            dry: f.dry.max(0.0) * scale,
            breakaway: f.breakaway.max(0.0) * scale,
            viscous: f.viscous * scale,
        }
    }

    /// All accelerations under torques `past(joint, t)`.
    pub(crate) fn instant(
        &self,
        t: f64,
        x: &HeldArmState,
        modes: &[HeldMode; JOINTS],
        past: impl Fn(usize, f64) -> f64,
    ) -> HeldInstant {
        let v = &self.values;
        let mut slid = None;
        let mut tip = [0.0; 3];
        for e in &self.effects {
            if let Some(by) = e.slid(t) {
                let chain = slid.get_or_insert(v.chain);
                chain.bodies[JOINTS - 1].center = plus(chain.bodies[JOINTS - 1].center, by);
            }
            tip = plus(tip, e.on_tip(t));
        }
        let chain = slid.as_ref().unwrap_or(&v.chain);
        let motion = chain.motion(&x[..JOINTS], &x[RATE..RATE + JOINTS]);
        let bodies = chain.mass_matrix(&motion);
        let bias = chain.bias(&motion, (tip, motion.place(v.tip), [0.0; 3]));
        let mut m = [[0.0; COORDINATES]; COORDINATES];
        let mut f = [0.0; COORDINATES];
        for j in 0..JOINTS {
            f[j] = -bias[j];
            (0..=j).for_each(|i| m[j][i] = bodies[i][j]);
        }
        for (e, s) in self.effects.iter().zip(&self.slips) {
            e.on_links(x, s, &mut f);
        }
        let (mut carried, mut drag) = ([0.0; JOINTS], [0.0; JOINTS]);
        for j in 0..JOINTS {
            let (sigma, inertia, own) = (1.0 / chain.gear_ratio[j], chain.rotor[j], v.motor(j));
            let omega = x[RATE + own];
            let share = motion.share(j, sigma);
            let (on_links, on_motor) = motion.rotor_bias(j, sigma, inertia, omega);
            for k in 0..j {
                f[k] -= on_links[k];
                (0..=k).for_each(|i| m[k][i] += inertia * share[k] * share[i]);
                m[own][k] += inertia * share[k];
            }
            m[own][own] += inertia;
            f[own] -= on_motor;
            // What comes late first, then what clips, then what adds.
            let late: f64 = self.of(j).map(|(e, _)| e.dead_time()).sum();
            let mut drive = past(j, t - late);
            drive = self.of(j).fold(drive, |u, (e, _)| e.lagged(x, u));
            drive = self.of(j).fold(drive, |u, (e, _)| e.clipped(t, u));
            let next = past((j + 1) % JOINTS, t);
            drive += self.of(j).map(|(e, _)| e.on_motor(t, x[own], next)).sum::<f64>();
            let (spring, slope) = self.spring(t, x, j);
            carried[j] = if v.flexible[j] { spring } else { drive };
            if v.flexible[j] {
                f[j] += spring;
            }
            f[own] += drive - spring * (1.0 - slope);
            if let HeldMode::Slides(way) = modes[j] {
                let friction = self.friction(t, x, j, way, carried[j]);
                drag[j] = friction.viscous + friction.dry * way;
                for (e, s) in self.of(j).filter(|(e, _)| matches!(e.law, HeldLaw::Presliding { .. })) {
                    drag[j] += s.torque(x[own]) * e.friction_factor(t, self.span, x);
                }
                f[own] -= drag[j];
            }
        }
        // What is stuck, and what is no coordinate of its own, does not accelerate.
        let mut free = [0; COORDINATES];
        let mut count = 0;
        for i in 0..COORDINATES {
            let j = i % JOINTS;
            let moves = if i == v.motor(j) { modes[j] != HeldMode::Stuck } else { i < JOINTS };
            if moves {
                free[count] = i;
                count += 1;
            }
        }
        let (mut small, mut a) = ([[0.0; COORDINATES]; COORDINATES], [0.0; COORDINATES]);
        for r in 0..count {
            a[r] = f[free[r]];
            (0..=r).for_each(|c| small[r][c] = m[free[r]][free[c]]);
        }
        // Not positive definite: NaN, and the case is drawn again.
        if !solve(&mut small, count, &mut a) {
            a = [f64::NAN; COORDINATES];
        }
        let mut rates = [0.0; 2 * COORDINATES + 4];
        for r in 0..count {
            rates[free[r]] = x[RATE + free[r]];
            rates[RATE + free[r]] = a[r];
        }
        let mut holds = [(0.0, 0.0); JOINTS];
        for j in (0..JOINTS).filter(|j| modes[*j] == HeldMode::Stuck) {
            let own = v.motor(j);
            let with = |r: usize| m[own.max(free[r])][own.min(free[r])] * a[r];
            let applied = f[own] - (0..count).map(with).sum::<f64>();
            holds[j] = (applied, self.friction(t, x, j, applied.signum(), carried[j]).breakaway);
        }
        for e in &self.effects {
            let j = e.joint;
            e.own_rates(x, past(j, t), drag[j], x[RATE + v.motor(j)], &mut rates);
        }
        HeldInstant { rates, holds }
    }

    /// The state is reached: what remembers moves on.
    pub(crate) fn commit(&mut self, x: &HeldArmState) {
        self.remember(x, Slip::commit);
    }
    /// All that remembers is relaxed at this state.
    pub(crate) fn rest(&mut self, x: &HeldArmState) {
        self.remember(x, Slip::rest);
    }
    fn remember(&mut self, x: &HeldArmState, how: impl Fn(&mut Slip, f64)) {
        for (e, s) in self.effects.iter().zip(&mut self.slips) {
            how(s, e.place(x, self.values.motor(e.joint)));
        }
    }
}
