//! What identification has to know of a model beyond its equations.

use std::fmt::Debug;

use trueup_models::effect::EffectSet;
use trueup_models::joint::{TwoMassJoint, input as ji, parameter as j};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::Hybrid;

/// A model whose parameters can be fitted.
pub trait Plant: Hybrid + Debug + Sync {
    /// Rates and outputs are affine in states and inputs while the modes are frozen, and do not depend on time: steps
    /// are then exact, by the matrix exponential. Wrongly claimed, predictions are wrong.
    fn affine(&self) -> bool {
        false
    }
    /// States that follow others at a rate of their own, however fast (strained bristles): dx/dt = g - lambda x. Steps
    /// take lambda exactly, so that they need not be as short.
    fn followers(&self) -> Vec<usize> {
        Vec::new()
    }
    /// Sets the initial-state parameters such that the run starts at rest, in equilibrium with the inputs `u`.
    /// What the equilibrium does not determine stays.
    fn rest<T: Scalar>(&self, p: &mut [T], u: &[T]);
}

/// Indices of the states of effects that follow ([`Plant::followers`]).
pub fn followers(effects: &EffectSet) -> Vec<usize> {
    let following = effects.iter().filter(|e| e.spec().bristles);
    following.flat_map(|e| (0..e.spec().states.len() * e.sites).map(|k| e.begin.states + k)).collect()
}

impl Plant for TwoMassJoint {
    fn affine(&self) -> bool {
        self.effects().iter().all(|e| e.spec().affine)
    }
    fn followers(&self) -> Vec<usize> {
        followers(self.effects())
    }
    /// Both velocities 0, the spring carries the external torque; the motor angle stays, friction holds it.
    fn rest<T: Scalar>(&self, p: &mut [T], u: &[T]) {
        p[j::INITIAL_MOTOR_VELOCITY] = T::zero();
        p[j::INITIAL_LOAD_VELOCITY] = T::zero();
        let n = p[j::GEAR_RATIO];
        let twist = if self.flexible() { -u[ji::EXTERNAL_TORQUE] / (n * p[j::STIFFNESS]) } else { T::zero() };
        p[j::INITIAL_LOAD_ANGLE] = (p[j::INITIAL_MOTOR_ANGLE] - twist) / n;
    }
}
