//! Small hybrid models with known solutions.
#![allow(dead_code, missing_docs, unreachable_pub)]

use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// A model without outputs, inputs, modes and events.
macro_rules! smooth {
    ($name:ident, $states:expr, $start:expr, |$t:ident, $x:ident, $dx:ident| $rates:block) => {
        pub struct $name;
        impl Hybrid for $name {
            fn sizes(&self) -> ModelSizes {
                ModelSizes { states: $states, ..ModelSizes::default() }
            }
            fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
                x.iter_mut().zip($start).for_each(|(x, v)| *x = T::constant(v));
            }
            fn start_modes(&self, _at: At<f64>, _modes: &mut [i32]) {}
            fn rates<T: Scalar>(&self, at: At<T>, $dx: &mut [T]) {
                let ($t, $x) = (at.t, at.x);
                let _ = $t;
                $rates
            }
            fn outputs<T: Scalar>(&self, _at: At<T>, _y: &mut [T]) {}
            fn indicators<T: Scalar>(&self, _at: At<T>, _z: &mut [T]) {}
            fn update(
                &self,
                _t: f64,
                _x: &mut [f64],
                _u: &[f64],
                _p: &[f64],
                _modes: &mut [i32],
            ) -> EventUpdate {
                EventUpdate::default()
            }
        }
    };
}

// x1' = -2 t x1^2, x2' = x1 - x2: x1 = 1/(1 + t^2).
smooth!(Bell, 2, [1.0, 0.5], |t, x, dx| {
    dx[0] = -(t * x[0] * x[0]) * 2.0;
    dx[1] = x[0] - x[1];
});
// Harmonic oscillator: (cos t, -sin t).
smooth!(Circle, 2, [1.0, 0.0], |t, x, dx| {
    dx[0] = x[1];
    dx[1] = -x[0];
});
// Prothero and Robinson: x = sin t whatever the stiffness.
smooth!(Prothero, 1, [0.0], |t, x, dx| {
    dx[0] = (x[0] - t.sin()) * -1e6 + t.cos();
});
smooth!(Robertson, 3, [1.0, 0.0, 0.0], |t, x, dx| {
    let (slow, fast) = (x[0] * 0.04, x[1] * x[1] * 3e7);
    let back = x[1] * x[2] * 1e4;
    dx[0] = back - slow;
    dx[1] = slow - back - fast;
    dx[2] = fast;
});
// Van der Pol as in Hairer and Wanner: eps = 1e-6, (2, 0).
smooth!(VanDerPol, 2, [2.0, 0.0], |t, x, dx| {
    dx[0] = x[1];
    dx[1] = ((T::one() - x[0] * x[0]) * x[1] - x[0]) * 1e6;
});
// sqrt of a state that falls through 0.
smooth!(Falls, 2, [0.0, 1.0], |t, x, dx| {
    dx[0] = x[1].sqrt();
    dx[1] = T::constant(-1.0);
});

/// A ball dropped from 1 m that keeps `p[0]` of its speed at each bounce; gravity 9.81 m/s^2.
pub struct Ball(pub Direction);
pub const GRAVITY: f64 = 9.81;

impl Hybrid for Ball {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { states: 2, parameters: 1, indicators: 1, outputs: 1, ..ModelSizes::default() }
    }
    fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
        (x[0], x[1]) = (T::one(), T::zero());
    }
    fn start_modes(&self, _at: At<f64>, _modes: &mut [i32]) {}
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        (dx[0], dx[1]) = (at.x[1], T::constant(-GRAVITY));
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        y[0] = at.x[0];
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        z[0] = at.x[0];
    }
    fn direction(&self, _indicator: usize) -> Direction {
        self.0
    }
    fn update(&self, _t: f64, x: &mut [f64], _u: &[f64], p: &[f64], _modes: &mut [i32]) -> EventUpdate {
        let hit = x[0] <= 0.0 && x[1] < 0.0;
        if hit {
            x[1] *= -p[0];
        }
        EventUpdate { states: hit, modes: false }
    }
}

/// A block (m = 1 kg) on a belt that runs at `p[0]` m/s, held by a spring (`p[1]` N/m), with static friction
/// `p[2]` N and kinetic friction `p[3]` N. States: position, velocity. Mode 0 sticks, 1 slips back.
pub struct Block;

impl Block {
    pub const P: [f64; 4] = [0.5, 25.0, 4.0, 2.0];

    /// Durations of stick and slip in steady state, and the position at the onset of slip.
    pub fn exact(p: &[f64]) -> (f64, f64, f64) {
        let (v, omega, xi) = (p[0], p[1].sqrt(), (p[2] - p[3]) / p[1]);
        let phi = (xi * omega / v).atan();
        (2.0 * xi / v, (2.0 * std::f64::consts::PI - 2.0 * phi) / omega, p[2] / p[1])
    }
}

impl Hybrid for Block {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { states: 2, parameters: 4, modes: 1, indicators: 2, outputs: 1, ..ModelSizes::default() }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        (x[0], x[1]) = (T::zero(), p[0]);
    }
    fn start_modes(&self, _at: At<f64>, modes: &mut [i32]) {
        modes[0] = 0;
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        (dx[0], dx[1]) = match at.modes[0] {
            0 => (at.p[0], T::zero()),
            _ => (at.x[1], at.p[3] - at.p[1] * at.x[0]),
        };
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        y[0] = at.x[0];
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let stuck = at.modes[0] == 0;
        z[0] = if stuck { at.p[2] - at.p[1] * at.x[0] } else { T::one() };
        z[1] = if stuck { T::one() } else { at.p[0] - at.x[1] };
    }
    fn direction(&self, _indicator: usize) -> Direction {
        Direction::Down
    }
    fn update(&self, _t: f64, x: &mut [f64], _u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let holds = p[2] - p[1] * x[0] > 0.0;
        match (modes[0], holds) {
            (0, false) => modes[0] = 1,
            (1, true) if p[0] - x[1] <= 0.0 => (modes[0], x[1]) = (0, p[0]),
            _ => return EventUpdate::default(),
        }
        EventUpdate { modes: true, states: true }
    }
}

/// Oscillator x = cos t with an event where x exceeds `p[0]`; the mode counts the times.
pub struct Graze;

impl Hybrid for Graze {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { states: 2, parameters: 1, modes: 2, indicators: 1, ..ModelSizes::default() }
    }
    fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
        (x[0], x[1]) = (-T::one(), T::zero());
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        modes.copy_from_slice(at.modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        (dx[0], dx[1]) = (at.x[1], -at.x[0]);
    }
    fn outputs<T: Scalar>(&self, _at: At<T>, _y: &mut [T]) {}
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        z[0] = at.x[0] - at.p[0];
    }
    fn update(&self, _t: f64, x: &mut [f64], _u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let above = i32::from(x[0] - p[0] > 0.0);
        let changed = above != modes[0];
        modes[0] = above;
        modes[1] += i32::from(changed);
        EventUpdate { modes: changed, states: false }
    }
}
