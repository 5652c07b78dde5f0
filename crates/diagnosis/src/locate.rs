//! Where the excess of residuals over the noise floor sits.
//!
//! Pure functions on slices: nothing here runs a model. What is handed over is a residual (free-running, or of an equation,
//! or an estimated unknown input) with the noise that it would have anyway.

mod band;
mod interval;
pub mod isolability;
mod joint;
mod order;
mod regime;
pub mod unknown_input;

pub use band::{Band, Bands, bands};
pub use interval::{Interval, change_points, intervals};
pub use joint::{
    Balance, JointBalances, JointColumns, joint_balances, joint_edges, joint_intervals, joint_unknown_inputs,
};
pub use order::{Order, orders};
pub use regime::{Feature, Regime, regimes};

/// A residual over time and the standard deviation that noise alone would give it.
#[derive(Clone, Copy, Debug)]
pub struct Residual<'a> {
    /// The recording's name.
    pub recording: &'a str,
    /// Times in s, strictly increasing.
    pub time: &'a [f64],
    /// Values.
    pub value: &'a [f64],
    /// Standard deviation of noise, same unit, > 0.
    pub floor: f64,
}

impl Residual<'_> {
    /// In units of the floor.
    fn whitened(&self) -> Vec<f64> {
        self.value.iter().map(|r| r / self.floor).collect()
    }
}

/// Each channel's share of the overall excess: gap^2 - floor^2 over the sum of all. `gaps` holds pairs (gap, floor).
pub fn shares(gaps: &[(f64, f64)]) -> Vec<f64> {
    let excess: Vec<f64> = gaps.iter().map(|(gap, floor)| (gap * gap - floor * floor).max(0.0)).collect();
    let sum: f64 = excess.iter().sum();
    excess.iter().map(|e| if sum > 0.0 { e / sum } else { 0.0 }).collect()
}
