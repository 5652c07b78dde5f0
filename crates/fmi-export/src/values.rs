//! Reading and setting variables by value reference, with the rules of both standards.
//!
//! A call sets all of its values or none: everything is checked before anything is set.

use crate::fault::{Outcome, error};
use crate::instance::Instance;
use crate::layout::{Reference, Target, setter};
use crate::model::FmuModel;
use crate::state_machine::{Call, Interface, State, Version};
use trueup_fmi::table::{Causality, Kind, Storage, Variability, Variable};

/// Data type that a function reads or sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
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

impl Type {
    fn fits(self, kind: Kind) -> bool {
        match self {
            Self::Real => kind == Kind::Real,
            Self::AnyInteger => matches!(kind, Kind::Integer | Kind::Enumeration(_)),
            Self::Int32 => kind == Kind::Integer,
            Self::Enumeration => matches!(kind, Kind::Enumeration(_)),
            Self::Boolean => kind == Kind::Boolean,
            Self::Other => false,
        }
    }
}

impl<M: FmuModel> Instance<M> {
    fn typed(&self, kind: Type, set: bool, reference: u32) -> Outcome<Target> {
        let version = self.settings.version;
        let target = self.layout.find(version, reference)?;
        let (name, actual) = match target {
            Target::Variable(r) => {
                let v = self.layout.variable(r.variable);
                (v.name.as_str(), v.kind)
            }
            Target::Indicator(_) => ("eventIndicator", Kind::Real),
        };
        if kind.fits(actual) {
            return Ok(target);
        }
        let (major, verb) = (if version == Version::Fmi2 { 2 } else { 3 }, if set { "Set" } else { "Get" });
        error(format!("`{name}` has another data type: use fmi{major}{verb}{}", setter(version, actual)))
    }

    /// Reads the values of `references` in order into exactly `len` places. What was put before a refusal
    /// counts for nothing.
    pub fn get(
        &mut self,
        kind: Type,
        references: &[u32],
        len: usize,
        mut put: impl FnMut(usize, f64),
    ) -> Outcome {
        self.permit(Call::Get)?;
        let mut k = 0;
        let mut next = |value| {
            if k < len {
                put(k, value);
            }
            k += 1;
        };
        for reference in references {
            match self.typed(kind, false, *reference)? {
                Target::Indicator(i) => {
                    self.evaluate_indicators()?;
                    next(self.cache.z[i]);
                }
                Target::Variable(r) => {
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

    fn element(&self, v: &Variable, i: usize) -> f64 {
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

    pub(crate) fn expect_len(&self, needed: usize, len: usize) -> Outcome {
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
        kind: Type,
        references: &[u32],
        len: usize,
        value: impl Fn(usize) -> f64,
    ) -> Outcome {
        self.permit(Call::Set)?;
        let mut k = 0;
        for reference in references {
            let Target::Variable(r) = self.typed(kind, true, *reference)? else {
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
            let Target::Variable(r) = self.layout.find(self.settings.version, *reference)? else { continue };
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

    fn store(&mut self, r: Reference, i: usize, value: f64) {
        let m = &mut self.memory;
        match self.layout.table.variables[r.variable].storage {
            Storage::Parameter(b) => {
                m.p[b + i] = value;
                m.set[b + i] = true;
                m.unchecked = true;
                m.start_stale |=
                    matches!(m.state, State::Instantiated | State::Configuration | State::Initialization);
            }
            Storage::Input(b) => {
                m.u[b + i] = value;
                m.start_stale |=
                    matches!(m.state, State::Instantiated | State::Configuration | State::Initialization);
            }
            _ => {}
        }
    }

    /// Whether the variable may be set in this state; otherwise the reason with the remedy.
    fn settable(&self, v: &Variable) -> Outcome {
        let state = self.memory.state;
        let name = &v.name;
        match v.causality {
            Causality::Input => {
                let between_events = matches!(state, State::ContinuousTime | State::IntermediateUpdate);
                if between_events && (v.variability != Variability::Continuous || v.kind != Kind::Real) {
                    return error(format!("the discrete input `{name}` can be set in event mode only"));
                }
                if state == State::IntermediateUpdate && !self.intermediate.contains(&v.value_reference) {
                    return error(format!(
                        "the input `{name}` was not among the required intermediate variables at instantiation"
                    ));
                }
                Ok(())
            }
            Causality::Parameter => match (v.variability, state) {
                (Variability::Fixed | Variability::Tunable, _) if self.is_initial() => Ok(()),
                (Variability::Tunable, State::Event) => Ok(()),
                (Variability::Tunable, State::Step) if !self.settings.event_mode_used => Ok(()),
                (Variability::Tunable, _) if self.settings.interface == Interface::ModelExchange => error(
                    format!("the tunable parameter `{name}` can be set in event mode only: enter it first"),
                ),
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
    fn acceptable(&self, v: &Variable, i: usize, value: f64) -> Outcome {
        let refuse = |why: String| error(format!("`{}` = {value:?}: {why}", v.element_name(i)));
        match v.kind {
            Kind::Boolean if value != 0.0 && value != 1.0 => return refuse("a Boolean is 0 or 1".to_owned()),
            Kind::Enumeration(k) if value.is_finite() => {
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
