//! A controller's table in the making.

use trueup_fmi::table::{Causality, Storage, TableVariable, Variability};

/// What the two controllers call differently.
pub(super) struct ControllerNames {
    pub(super) load: &'static str,
    pub(super) output: &'static str,
    pub(super) unit: &'static str,
    pub(super) limit: &'static str,
    pub(super) torque_constant: &'static str,
    pub(super) torque_constant_text: &'static str,
    /// Excitation threshold in rad: a few steps of usual sensors.
    pub(super) threshold: f64,
}

pub(super) struct ControllerTableBuilder {
    pub(super) names: ControllerNames,
    /// Number of joints; `None`: one, as scalars.
    pub(super) joints: Option<usize>,
}

impl ControllerTableBuilder {
    pub(super) fn variable(
        &self,
        name: &str,
        causality: Causality,
        variability: Variability,
        storage: fn(usize) -> Storage,
        index: usize,
        unit: &'static str,
        text: &str,
    ) -> TableVariable {
        let n = self.joints.unwrap_or(1);
        let v = TableVariable::new(name, causality, variability, storage(index * n), unit, text);
        match self.joints {
            Some(n) => v.array(&[n]),
            None => v,
        }
    }
}
