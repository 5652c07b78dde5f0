//! Carriages on the jaws of a gripper (S2 section 3.1): rollers that slide with them on springs, between stops, until they are locked.
//!
//! What it gets wrong: carriages without mass, so that their rate is where spring, damper and rollers balance; rollers without
//! friction on their pins, as in S2; the stops are rigid.

use super::ball::{moved, pair};
use super::closing::Jaws;
use super::frame::{ContactVector, dot, scale, two};
use super::law::ContactLaw;
use super::view::{Gripper, GripperView};
use trueup_numerics::Scalar;

/// A carriage moves on its spring.
pub(super) const SLIDING: i32 = 0;
/// It is at its stop against its way.
pub(super) const BEHIND: i32 = 1;
/// It is at its stop along its way.
pub(super) const AHEAD: i32 = 2;
/// It is locked where it is.
pub(super) const LOCKED: i32 = 3;

/// The carriage that carries this ball: of the jaw of P2, P4, .. or of that of P3, P5, ..; P1 is on none.
pub(super) fn of_ball(ball: usize) -> Option<usize> {
    ball.checked_sub(1).map(|k| k % 2)
}

/// A carriage at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct CarriageSlide<T> {
    /// Its way, hand's axes, length 1.
    pub way: ContactVector<T>,
    /// Along its way, m.
    pub position: T,
    /// m/s.
    pub rate: T,
    /// What pulls it along its way if it does not move, N.
    pub load: T,
    /// Of its spring, J.
    pub energy: T,
    /// Taken by its damper, W.
    pub loss: T,
}

impl<T: Scalar> CarriageSlide<T> {
    /// At rest.
    pub(super) fn none() -> Self {
        let o = T::zero();
        Self { way: [o; 2], position: o, rate: o, load: o, energy: o, loss: o }
    }
}

/// Both carriages: C_s d' = -K_s d - sum (n . e) F, F = k delta + c (a + (n . e) d') (CON-12).
pub(super) fn slides<T: Scalar>(
    g: &Gripper,
    v: &GripperView<'_, T>,
    law: &ContactLaw<T>,
    jaws: &Jaws<T>,
) -> [CarriageSlide<T>; 2] {
    let at = &g.parameters;
    let along = two(v.p, at.carriage_direction);
    let length = dot(along, along).sqrt();
    let [x, y] = along.map(|a| a / length);
    let (stiffness, damping) = (v.p[at.carriage_stiffness], v.p[at.carriage_damping]);
    let one = |carriage: usize, way: ContactVector<T>| {
        let position = v.x[g.states.carriage + carriage];
        let mut slide = CarriageSlide { way, position, ..CarriageSlide::none() };
        let (mut load, mut resists) = (-stiffness * position, damping);
        for i in (0..g.structure.balls).filter(|i| of_ball(*i) == Some(carriage)) {
            let ball = moved(g, v, jaws, i, Some(scale(position, way))).ball;
            let still = pair(&g.structure, v.p, at, &v.port, &ball);
            let against = dot(still.normal, v.host.out(way));
            let damper = law.damping(v.modes[i], still.penetration);
            load -= against * law.force(v.modes[i], still.penetration, still.approach);
            resists += damper * against * against;
        }
        slide.load = load;
        if g.carriage_mode(v.modes, carriage) == SLIDING {
            slide.rate = load / resists; // (CON-12)
        }
        slide.energy = stiffness * position * position * 0.5;
        slide.loss = damping * slide.rate * slide.rate;
        slide
    };
    [one(0, [x, y]), one(1, [x, -y])]
}

impl Gripper {
    /// Mode of a carriage; sliding as long as there are no modes yet.
    pub(super) fn carriage_mode(&self, modes: &[i32], carriage: usize) -> i32 {
        modes.get(self.carriage_modes() + carriage).copied().unwrap_or(SLIDING)
    }
    /// Indicators of both carriages, two each, and of their lock.
    pub(super) fn indicate_carriages<T: Scalar>(
        &self,
        v: &GripperView<'_, T>,
        slides: &[CarriageSlide<T>; 2],
        locks: bool,
        z: &mut [T],
    ) {
        let travel = v.p[self.parameters.carriage_travel];
        for (c, slide) in slides.iter().enumerate() {
            [z[2 * c], z[2 * c + 1]] = match self.carriage_mode(v.modes, c) {
                SLIDING => [travel - slide.position, travel + slide.position],
                BEHIND => [T::one(), -slide.load],
                AHEAD => [slide.load, T::one()],
                _ => [T::one(); 2],
            };
        }
        let locked = self.carriage_mode(v.modes, 0) == LOCKED;
        z[4] = T::constant(if locks == locked { 1.0 } else { -1.0 });
    }
    /// One pass of event iteration; whether a mode changed.
    pub(super) fn update_carriages(
        &self,
        v: &GripperView<'_, f64>,
        slides: &[CarriageSlide<f64>; 2],
        locks: bool,
        (x, modes): (&mut [f64], &mut [i32]),
    ) -> bool {
        let travel = v.p[self.parameters.carriage_travel];
        let mut changed = false;
        for (c, slide) in slides.iter().enumerate() {
            let mode = &mut modes[self.carriage_modes() + c];
            let next = match *mode {
                _ if locks => LOCKED, // (CON-14)
                LOCKED => SLIDING,
                SLIDING if slide.position >= travel && slide.rate > 0.0 => AHEAD,
                SLIDING if slide.position <= -travel && slide.rate < 0.0 => BEHIND,
                AHEAD if slide.load < 0.0 => SLIDING,
                BEHIND if slide.load > 0.0 => SLIDING,
                same => same,
            };
            if next == *mode {
                continue;
            }
            if let AHEAD | BEHIND = next {
                x[self.states.carriage + c] = if next == AHEAD { travel } else { -travel };
            }
            (*mode, changed) = (next, true);
        }
        changed
    }
}
