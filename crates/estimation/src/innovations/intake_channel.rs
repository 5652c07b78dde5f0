//! A channel of the intake.

/// What is known of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct IntakeChannel {
    /// Its name.
    pub name: String,
    /// Index among the readings of the plant.
    pub reading: usize,
    /// State that it shows; `None`: the force of an elastic element.
    pub state: Option<usize>,
    /// An angle; else a rate.
    pub angle: bool,
    /// One count and the width of white noise together, in the state's unit.
    pub resolution: f64,
    /// Variance of one reading, in the square of the state's unit.
    pub variance: f64,
}
