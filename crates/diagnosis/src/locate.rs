//! Where the excess of residuals over the noise floor sits.
//!
//! Pure functions on slices: nothing here runs a model. What is handed over is a residual (free-running, or of an equation,
//! or an estimated unknown input) with the noise that it would have anyway.

mod arm;
mod band;
mod derivative;
mod interval;
pub mod isolability;
mod joint;
pub mod map;
mod order;
mod regime;
pub mod unknown_input;

pub use arm::{ArmBalances, ArmColumns, arm_balances};
pub use band::{Band, Bands, bands};
pub use interval::{Interval, change_points, intervals};
pub use joint::{
    JointBalances, JointColumns, joint_balances, joint_edges, joint_intervals, joint_unknown_inputs,
};
pub use order::{ResidualOrder, orders};
pub use regime::{Feature, Regime, regimes};

/// A residual over time and the standard deviation that noise alone would give it.
#[derive(Clone, Copy, Debug)]
pub struct ResidualSeries<'a> {
    /// The recording's name.
    pub recording: &'a str,
    /// Times in s, strictly increasing.
    pub time: &'a [f64],
    /// Values.
    pub value: &'a [f64],
    /// Standard deviation of noise, same unit, > 0.
    pub floor: f64,
}

impl ResidualSeries<'_> {
    /// In units of the floor.
    fn whitened(&self) -> Vec<f64> {
        self.value.iter().map(|r| r / self.floor).collect()
    }
}

/// A balance that would be 0 if nothing were missing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EquationBalance {
    /// What is missing, in the balance's unit, sample by sample.
    pub value: Vec<f64>,
    /// Standard deviation that the sensors' noise gives it.
    pub floor: f64,
}

/// On which side of a free-floating system's boundary the cause of a gap is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundarySide {
    /// Nothing is missing beyond noise.
    None,
    /// Momentum stays, a joint's balance does not: friction, transmission, actuator.
    Internal,
    /// Momentum does not stay: a force from outside. Something inside may be missing, too.
    External,
}

/// Each channel's share of the overall excess: gap^2 - floor^2 over the sum of all. `gaps` holds pairs (gap, floor).
pub fn shares(gaps: &[(f64, f64)]) -> Vec<f64> {
    let excess: Vec<f64> = gaps.iter().map(|(gap, floor)| (gap * gap - floor * floor).max(0.0)).collect();
    let sum: f64 = excess.iter().sum();
    excess.iter().map(|e| if sum > 0.0 { e / sum } else { 0.0 }).collect()
}
