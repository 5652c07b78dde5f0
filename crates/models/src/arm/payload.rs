//! What is given of a body that a link carries (ARM-16).

/// A parameter of a payload.
#[derive(Clone, Copy, Debug)]
pub struct PayloadParameter {
    /// Its name in cases and results.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Its standard deviation is in its unit: it may be 0, which has no share.
    pub absolute_doubt: bool,
}

const fn carried(name: &'static str, unit: &'static str, min: f64) -> PayloadParameter {
    PayloadParameter { name, unit, min, absolute_doubt: true }
}

/// Parameters of a payload, in their order.
pub static PAYLOAD: [PayloadParameter; 4] = [
    carried("payload.mass", "kg", 0.0),
    carried("payload.centerOfMass[1]", "m", f64::NEG_INFINITY),
    carried("payload.centerOfMass[2]", "m", f64::NEG_INFINITY),
    carried("payload.inertia", "kg.m2", 0.0),
];

impl PayloadParameter {
    /// The one of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        PAYLOAD.iter().find(|p| p.name == name)
    }
}
