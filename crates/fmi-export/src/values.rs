//! Reading and setting variables by value reference, with the rules of both standards.
//!
//! A call sets all of its values or none: everything is checked before anything is set.

use crate::fault::{CallOutcome, error};
use crate::instance::ModelInstance;
use crate::layout::{ReferenceElements, ReferenceTarget, setter};
use crate::model::FmuModel;
use crate::state_machine::{CallGroup, InstanceState, InstanceVersion, InterfaceType};
use trueup_fmi::table::{BoundaryType, Causality, Storage, TableVariable, Variability};

/// Data type that a function reads or sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueType {
    /// fmi2Real, fmi3Float64.
    Real,
    /// fmi2Integer: integers and enumerations.
    AnyInteger,
    /// fmi3Int32.
    Int32,
    /// fmi3Int64: enumerations.
    Enumeration,
    /// Boolean.
    Boolean,
    /// A type of which no variable is.
    Other,
}

impl ValueType {
    fn fits(self, kind: BoundaryType) -> bool {
        match self {
            Self::Real => kind == BoundaryType::Real,
            Self::AnyInteger => matches!(kind, BoundaryType::Integer | BoundaryType::Enumeration(_)),
            Self::Int32 => kind == BoundaryType::Integer,
            Self::Enumeration => matches!(kind, BoundaryType::Enumeration(_)),
            Self::Boolean => kind == BoundaryType::Boolean,
            Self::Other => false,
        }
    }
}

impl<M: FmuModel> ModelInstance<M> {
    fn typed(&self, kind: ValueType, set: bool, reference: u32) -> CallOutcome<ReferenceTarget> {
        let version = self.settings.version;
        let target = self.layout.find(version, reference)?;
        let (name, actual) = match target {
            ReferenceTarget::Variable(r) => {
                let v = self.layout.variable(r.variable);
                (v.name.as_str(), v.kind)
            }
            ReferenceTarget::Indicator(_) => ("eventIndicator", BoundaryType::Real),
        };
        if kind.fits(actual) {
            return Ok(target);
        }
        let (major, verb) =
            (if version == InstanceVersion::Fmi2 { 2 } else { 3 }, if set { "Set" } else { "Get" });
        error(format!("`{name}` has another data type: use fmi{major}{verb}{}", setter(version, actual)))
    }

    /// Reads the values of `references` in order into exactly `len` places. What was put before a refusal
    /// counts for nothing.
    pub fn get(
        &mut self,
        kind: ValueType,
        references: &[u32],
        len: usize,
        mut put: impl FnMut(usize, f64),
    ) -> CallOutcome {
        self.permit(CallGroup::Get)?;
        let mut k = 0;
        let mut next = |value| {
            if k < len {
                put(k, value);
            }
            k += 1;
        };
        for reference in references {
            match self.typed(kind, false, *reference)? {
                ReferenceTarget::Indicator(i) => {
                    self.evaluate_indicators()?;
                    next(self.cache.z[i]);
                }
                ReferenceTarget::Variable(r) => {
                    match self.layout.variable(r.variable).storage {
                        Storage::Output(_) => self.evaluate_outputs()?,
                        Storage::Rate(_) => self.evaluate_rates()?,
                        Storage::State(_) => self.ready().and_then(|()| self.finite_states())?,
                        _ => {}
                    }
                    let v = self.layout.variable(r.variable);
                    (r.first..r.first + r.len).for_each(|i| next(self.element(v, i)));
                }
            }
        }
        self.expect_len(k, len)
    }

    fn element(&self, v: &TableVariable, i: usize) -> f64 {
        match v.storage {
            Storage::Time => self.memory.t,
            Storage::Parameter(b) => self.memory.p[b + i],
            Storage::Input(b) => self.memory.u[b + i],
            Storage::Output(b) => self.cache.y[b + i],
            Storage::State(b) => self.memory.x[b + i],
            Storage::Rate(b) => self.cache.dx[b + i],
            Storage::Constant => v.start.get(i).copied().unwrap_or_default(),
        }
    }

    pub(crate) fn expect_len(&self, needed: usize, len: usize) -> CallOutcome {
        if needed == len {
            return Ok(());
        }
        error(format!(
            "{len} values for variables that have {needed} elements together: give exactly {needed}"
        ))
    }

    /// Sets the values of `references` in order; `value(k)` is the k-th one.
    pub fn set(
        &mut self,
        kind: ValueType,
        references: &[u32],
        len: usize,
        value: impl Fn(usize) -> f64,
    ) -> CallOutcome {
        self.permit(CallGroup::Set)?;
        let mut k = 0;
        for reference in references {
            let ReferenceTarget::Variable(r) = self.typed(kind, true, *reference)? else {
                return error("event indicators are computed and cannot be set");
            };
            let v = self.layout.variable(r.variable);
            self.settable(v)?;
            for i in r.first..r.first + r.len {
                if k < len {
                    self.acceptable(v, i, value(k))?;
                }
                k += 1;
            }
        }
        self.expect_len(k, len)?;
        k = 0;
        for reference in references {
            let ReferenceTarget::Variable(r) = self.layout.find(self.settings.version, *reference)? else {
                continue;
            };
            for i in r.first..r.first + r.len {
                self.store(r, i, value(k));
                k += 1;
            }
        }
        if self.memory.unchecked {
            self.layout.follow(&mut self.memory.p, &self.memory.set);
        }
        self.touch();
        Ok(())
    }

    fn store(&mut self, r: ReferenceElements, i: usize, value: f64) {
        let m = &mut self.memory;
        match self.layout.table.variables[r.variable].storage {
            Storage::Parameter(b) => {
                m.p[b + i] = value;
                m.set[b + i] = true;
                m.unchecked = true;
                m.start_stale |= matches!(
                    m.state,
                    InstanceState::Instantiated
                        | InstanceState::Configuration
                        | InstanceState::Initialization
                );
            }
            Storage::Input(b) => {
                m.u[b + i] = value;
                m.start_stale |= matches!(
                    m.state,
                    InstanceState::Instantiated
                        | InstanceState::Configuration
                        | InstanceState::Initialization
                );
            }
            _ => {}
        }
    }

    /// Whether the variable may be set in this state; otherwise the reason with the remedy.
    fn settable(&self, v: &TableVariable) -> CallOutcome {
        let state = self.memory.state;
        let name = &v.name;
        match v.causality {
            Causality::Input => {
                let between_events =
                    matches!(state, InstanceState::ContinuousTime | InstanceState::IntermediateUpdate);
                if between_events
                    && (v.variability != Variability::Continuous || v.kind != BoundaryType::Real)
                {
                    return error(format!("the discrete input `{name}` can be set in event mode only"));
                }
                if state == InstanceState::IntermediateUpdate
                    && !self.intermediate.contains(&v.value_reference)
                {
                    return error(format!(
                        "the input `{name}` was not among the required intermediate variables at instantiation"
                    ));
                }
                Ok(())
            }
            Causality::Parameter => match (v.variability, state) {
                (Variability::Fixed | Variability::Tunable, _) if self.is_initial() => Ok(()),
                (Variability::Tunable, InstanceState::Event) => Ok(()),
                (Variability::Tunable, InstanceState::Step) if !self.settings.event_mode_used => Ok(()),
                (Variability::Tunable, _) if self.settings.interface == InterfaceType::ModelExchange => {
                    error(format!(
                        "the tunable parameter `{name}` can be set in event mode only: enter it first"
                    ))
                }
                (Variability::Tunable, _) => error(format!(
                    "the tunable parameter `{name}` can be set between steps, or in event mode if that is used"
                )),
                (Variability::Fixed, _) => error(format!(
                    "the fixed parameter `{name}` can be set before the end of initialization only: reset the instance first"
                )),
                _ => error(format!("`{name}` is constant and cannot be set")),
            },
            Causality::Output | Causality::Local => {
                error(format!("`{name}` is computed by the model and cannot be set"))
            }
            Causality::Independent => error(format!(
                "`{name}` is the independent variable: it is given by the start time, fmiXSetTime or fmiXDoStep"
            )),
        }
    }

    /// Whether a value is within the variable's bounds.
    fn acceptable(&self, v: &TableVariable, i: usize, value: f64) -> CallOutcome {
        let refuse = |why: String| error(format!("`{}` = {value:?}: {why}", v.element_name(i)));
        match v.kind {
            BoundaryType::Boolean if value != 0.0 && value != 1.0 => {
                return refuse("a Boolean is 0 or 1".to_owned());
            }
            BoundaryType::Enumeration(k) if value.is_finite() => {
                let items = self.layout.table.enumerations.get(k).map_or(&[][..], |e| &e.items);
                if value < 1.0 || value > items.len() as f64 {
                    let names: Vec<_> =
                        items.iter().enumerate().map(|(n, i)| format!("{} = {}", n + 1, i.0)).collect();
                    return refuse(format!("choose one of {}", names.join(", ")));
                }
            }
            _ => {}
        }
        v.allows(i, value).or_else(error)
    }
}
