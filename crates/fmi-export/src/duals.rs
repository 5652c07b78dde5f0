//! Work space of exact partial derivatives: the model's values as dual numbers.

use crate::fault::{CallOutcome, discard};
use crate::model::FmuModel;
use trueup_numerics::hybrid::{At, ModelSizes};
use trueup_numerics::{Dual, Scalar};

pub(crate) const NOT_FINITE: &str = "a derivative is not finite with these states and inputs";

/// Values with their derivative along one direction. Each number of directions is one more copy of all models in the library: adjoint
/// derivatives take one sweep a known instead (docs/decisions/0080-one-direction-in-an-fmu.md).
type Directed = Dual<1>;

/// Work space; grows at first use.
#[derive(Debug, Default)]
pub(crate) struct Duals {
    pub(crate) workspace: DualWorkspace,
    pub(crate) unknowns: Vec<UnknownVariable>,
    pub(crate) knowns: Vec<KnownVariable>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum KnownVariable {
    Time,
    State(usize),
    Input(usize),
    Parameter(usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum UnknownVariable {
    Output(usize),
    Rate(usize),
    State(usize),
    Indicator(usize),
}

#[derive(Debug, Default)]
pub(crate) struct DualWorkspace {
    pub(crate) t: Directed,
    pub(crate) x: Vec<Directed>,
    pub(crate) u: Vec<Directed>,
    pub(crate) p: Vec<Directed>,
    pub(crate) y: Vec<Directed>,
    pub(crate) dx: Vec<Directed>,
    pub(crate) z: Vec<Directed>,
}

impl DualWorkspace {
    pub(crate) fn load(&mut self, n: ModelSizes, t: f64, x: &[f64], u: &[f64], p: &[f64]) {
        let zero = Directed::default();
        let copy = |to: &mut Vec<Directed>, from: &[f64]| {
            to.clear();
            to.extend(from.iter().map(|v| Directed::constant(*v)));
        };
        self.t = Directed::constant(t);
        copy(&mut self.x, x);
        copy(&mut self.u, u);
        copy(&mut self.p, p);
        self.y.resize(n.outputs, zero);
        self.dx.resize(n.states, zero);
        self.z.resize(n.indicators, zero);
    }
    pub(crate) fn known(&mut self, k: KnownVariable) -> &mut Directed {
        match k {
            KnownVariable::Time => &mut self.t,
            KnownVariable::State(i) => &mut self.x[i],
            KnownVariable::Input(i) => &mut self.u[i],
            KnownVariable::Parameter(i) => &mut self.p[i],
        }
    }
    pub(crate) fn unknown(&self, k: UnknownVariable) -> &Directed {
        match k {
            UnknownVariable::Output(i) => &self.y[i],
            UnknownVariable::Rate(i) => &self.dx[i],
            UnknownVariable::State(i) => &self.x[i],
            UnknownVariable::Indicator(i) => &self.z[i],
        }
    }
    /// Evaluates what the unknowns need.
    pub(crate) fn sweep<M: FmuModel>(&mut self, i: &InstanceParts<M>, unknowns: &[UnknownVariable]) {
        i.layout.follow(&mut self.p, i.set);
        if i.initial {
            i.model.start(&self.p, &mut self.x);
        }
        let at = At { t: self.t, x: &self.x, u: &self.u, p: &self.p, modes: i.modes };
        let any = |f: fn(&UnknownVariable) -> bool| unknowns.iter().any(f);
        if any(|k| matches!(k, UnknownVariable::Output(_))) {
            i.model.outputs(at, &mut self.y);
        }
        if any(|k| matches!(k, UnknownVariable::Rate(_))) {
            i.model.rates(at, &mut self.dx);
        }
        if any(|k| matches!(k, UnknownVariable::Indicator(_))) {
            i.model.indicators(at, &mut self.z);
        }
    }
}

impl Duals {
    /// The derivatives that a sweep gave.
    pub(crate) fn results(&self, out: &mut [f64]) -> CallOutcome {
        for (out, k) in out.iter_mut().zip(&self.unknowns) {
            let derivative = self.workspace.unknown(*k).eps[0];
            if !derivative.is_finite() {
                return discard(NOT_FINITE);
            }
            *out = derivative;
        }
        Ok(())
    }
}

/// What a sweep needs of the instance in addition to the work space.
pub(crate) struct InstanceParts<'a, M> {
    pub(crate) model: &'a M,
    pub(crate) layout: &'a crate::layout::Layout,
    pub(crate) set: &'a [bool],
    pub(crate) modes: &'a [i32],
    pub(crate) initial: bool,
}
