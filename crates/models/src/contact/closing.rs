//! How jaws close.

use trueup_numerics::Scalar;

/// The jaws close; with a motor: they are between their stops.
pub(super) const CLOSING: i32 = 0;
/// They are closed.
pub(super) const CLOSED: i32 = 1;
/// Of jaws with a motor: they are at the stop where they are open.
pub(super) const OPEN: i32 = 3;
/// They have stopped at their limit of force: a spindle that locks itself.
pub(super) const JAMMED: i32 = 2;

/// Which modes those of a hand are: behind one for each ball.
#[derive(Clone, Copy, Debug)]
pub(super) struct HandModes {
    /// Of the jaws.
    pub jaws: usize,
    /// The outcome.
    pub outcome: usize,
    /// Whether the run has begun.
    pub begun: usize,
    /// How many there are.
    pub count: usize,
}

impl HandModes {
    /// Of a hand with so many balls.
    pub(super) fn of(balls: usize) -> Self {
        Self { jaws: balls, outcome: balls + 1, begun: balls + 2, count: balls + 3 }
    }
}

/// Where jaws are: 0 open, 1 closed; and their rate in 1/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jaws<T> {
    pub position: T,
    pub rate: T,
}

/// By the share `u` of the closing time in s that is over: at rest at both ends, where a solver looks beyond them too.
pub(super) fn scheduled<T: Scalar>(u: T, closing_time: T, mode: i32) -> Jaws<T> {
    let u = u.max(T::zero()).min(T::one());
    let position = u * u * (-u * 2.0 + 3.0);
    let rate = if mode == CLOSING { u * (-u + 1.0) * 6.0 / closing_time } else { T::zero() };
    Jaws { position, rate }
}

/// By a motor: wherever their states say (CON-11).
pub(super) fn driven<T: Scalar>(position: T, rate: T, mode: i32) -> Jaws<T> {
    Jaws { position, rate: if mode == CLOSING { rate } else { T::zero() } }
}

/// By a command, which is held to 0 .. 1.
pub(super) fn commanded<T: Scalar>(close: T, rate: T) -> Jaws<T> {
    let within = close.value() > 0.0 && close.value() < 1.0;
    Jaws { position: close.max(T::zero()).min(T::one()), rate: if within { rate } else { T::zero() } }
}
