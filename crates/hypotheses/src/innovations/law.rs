//! What a law of an effect is to the search.

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};

use super::along::PlantAlong;
use super::shape::LawShape;
use super::slope::LawSlopes;
use super::spectrum::OrderPeaks;

/// A column with the prior mean and standard deviation of its amplitude.
pub type LawTerm = (FilterColumn, f64, f64);

/// Columns of a law with its priors.
#[derive(Clone, Debug, Default)]
pub struct LawTerms {
    /// What the filter takes.
    pub applied: AppliedLaw,
    /// Amplitudes that can only be positive.
    pub positive: Vec<usize>,
}

impl LawTerms {
    /// Columns with the prior means and standard deviations of their amplitudes, and those that can only be positive.
    pub fn new(terms: Vec<LawTerm>, positive: &[usize]) -> Self {
        let mut applied = AppliedLaw::default();
        for (column, mean, deviation) in terms {
            applied.columns.push(column);
            applied.mean.push(mean);
            applied.deviation.push(deviation);
        }
        Self { applied, positive: positive.to_vec() }
    }
    /// A law whose shape determines its size: one amplitude of 1 give or take `deviation`.
    pub fn of_fixed_size(column: FilterColumn, deviation: f64) -> Self {
        Self::new(vec![(column, 1.0, deviation)], &[0])
    }
    /// The same, in the plant's first spring.
    pub fn in_spring(mut self) -> Self {
        self.applied.spring = Some(0);
        self
    }
}

/// How a number of a shape is refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Which number.
    pub name: &'static str,
    /// First step, relative; an order: in widths of an order.
    pub step: f64,
    /// An order.
    pub order: bool,
}

impl Refinement {
    /// Of a number by relative steps.
    pub const fn relative(name: &'static str, step: f64) -> Self {
        Self { name, step, order: false }
    }
    /// Of an order.
    pub const ORDER: Self = Self { name: "h", step: 1.0, order: true };
}

/// Dry friction of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DryFriction {
    /// One level.
    Plain,
    /// A level that falls with speed.
    Falling,
}

/// An effect as columns. The first amplitude is the effect; companions absorb the form of its law and have no name.
pub trait EffectLaw: Sync {
    /// Its id in the list of effects.
    fn id(&self) -> &'static str;
    /// Shapes with which a screen looks for it, with the orders of each joint; none where the plant cannot have it.
    fn shapes(&self, along: &PlantAlong<'_>, orders: &[OrderPeaks]) -> Vec<LawShape>;
    /// Columns of a shape; `None` where a channel that it needs was not recorded.
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms>;
    /// What its forces change with the states at these amplitudes; `None`: nothing that a filter has to know.
    fn slopes(&self, _along: &PlantAlong<'_>, _shape: &LawShape, _amplitudes: &[f64]) -> Option<LawSlopes> {
        None
    }
    /// Which numbers of a shape a pattern search moves, in which order.
    fn refined(&self, _shape: &LawShape) -> Vec<Refinement> {
        Vec::new()
    }
    /// Whether the same cause at further joints is one effect.
    fn spreads(&self) -> bool {
        false
    }
    /// Terms with a longer length than the effect's own, which only add up: how many terms there are, and which of them those are.
    fn companions(&self) -> (usize, &'static [usize]) {
        (0, &[])
    }
    /// Which dry friction of a motor it is; `None`: none.
    fn dry_friction(&self) -> Option<DryFriction> {
        None
    }
    /// Whether it is a reading that is late: its fit puts the readings back, in a frame of its own.
    fn is_late(&self) -> bool {
        false
    }
    /// Whether it is impulses, which no grid searches and which have no shape to refine.
    fn is_impulses(&self) -> bool {
        false
    }
    /// Whether its fit takes a plant of another structure.
    fn is_structure(&self) -> bool {
        false
    }
    /// Whether its forms are fitted each by itself.
    fn forms_apart(&self) -> bool {
        false
    }
    /// The value nearest to `value` that a number may have.
    fn bounded(&self, _along: &PlantAlong<'_>, _shape: &LawShape, _name: &str, value: f64) -> f64 {
        value
    }
}
