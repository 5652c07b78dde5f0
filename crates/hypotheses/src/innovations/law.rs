//! What a law of an effect is to the search.

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};

use super::along::PlantAlong;
use super::place::JointPlace;
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

/// A law at one of its places where a fit ended.
pub struct LawFit<'a> {
    /// The plant with the units of the columns, its parameters in hand those of the fit.
    pub along: &'a PlantAlong<'a>,
    /// The law's shape.
    pub shape: &'a LawShape,
    /// Joint, from 0.
    pub joint: usize,
    /// Channel of a law of a reading.
    pub channel: Option<usize>,
    /// Whether the readings of that channel were put back by the shape's delay, and amplitudes are of what is left of it.
    pub put_back: bool,
    /// Amplitudes of all terms, 0 of those that were left out; none where the plant's structure is the effect.
    pub amplitudes: &'a [f64],
}

impl LawFit<'_> {
    /// An amplitude; 0 where there are fewer.
    pub fn amplitude(&self, k: usize) -> f64 {
        self.amplitudes.get(k).copied().unwrap_or(0.0)
    }
    /// A number of the shape; 0 where there is none of that name.
    pub fn number(&self, name: &str) -> f64 {
        self.shape.value(name)
    }
    /// The joint.
    pub fn place(&self) -> &JointPlace {
        &self.along.joints[self.joint]
    }
    /// Unit of the channel's errors, in the unit of the reading.
    pub fn reading_unit(&self) -> f64 {
        self.channel.map_or(0.0, |c| self.along.channels[c].error / self.along.channels[c].turns)
    }
}

/// A parameter of an effect, or one of the plant that is another with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawValue {
    /// Its name without place and index.
    pub name: &'static str,
    /// Its value, SI.
    pub value: f64,
    /// The recording that alone has it.
    pub recording: Option<usize>,
    /// The parameter that is its unit of measure, the value of that for which it is, and the exponent of their ratio.
    pub usual: Option<(&'static str, f64, f64)>,
}

impl LawValue {
    /// In all recordings.
    pub fn new(name: &'static str, value: f64) -> Self {
        Self { name, value, recording: None, usual: None }
    }
    /// The size of a power with this exponent where the parameter `unit`, its unit of measure, has the value `usual`.
    pub fn at_usual(self, unit: &'static str, usual: f64, exponent: f64) -> Self {
        Self { usual: Some((unit, usual, exponent)), ..self }
    }
    /// Its value where its unit of measure has the value that `start` gives.
    pub fn with_unit(&self, start: impl Fn(&str) -> Option<f64>) -> f64 {
        self.usual.map_or(self.value, |(unit, usual, exponent)| {
            self.value * (start(unit).unwrap_or(usual) / usual).powf(exponent)
        })
    }
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
    /// The effect that this is in the list of effects.
    fn cause(&self, _shape: &LawShape) -> &'static str {
        self.id()
    }
    /// Its parameters where a fit ended. Columns are linear, an effect's law is not: of a law with companions it has the terms that the
    /// effect has, and of another law that which is nearest.
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue>;
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
