//! A smooth model with its sensitivities: the variational equations, integrated next to the states.

use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes, Plant};

/// `model` whose states carry their derivatives to `N` unknowns, at most [`LANES`]. For models without events: a jump would need the
/// jump of the derivatives too.
///
/// States: of state i its value, then its N derivatives. Parameters are the model's; outputs are not computed.
#[derive(Clone, Debug)]
pub struct TangentModel<'a, const N: usize> {
    model: &'a dyn Plant,
    /// Parameters with their derivatives to the unknowns.
    p: Vec<Lanes>,
}

impl<'a, const N: usize> TangentModel<'a, N> {
    const FITS: () = assert!(N <= LANES, "no more unknowns than lanes");

    /// Parameters `p`, unknown k moving the parameter `unknowns[k]` one to one.
    ///
    /// # Panics
    /// An unknown beyond the parameters; debug builds check that the model has no events.
    pub fn new(model: &'a dyn Plant, p: &[f64], unknowns: &[usize; N]) -> Self {
        let () = Self::FITS;
        debug_assert_eq!(model.sizes().indicators, 0, "a smooth model");
        let mut p: Vec<_> = p.iter().map(|v| Dual::constant(*v)).collect();
        for (k, at) in unknowns.iter().enumerate() {
            p[*at].eps[k] = 1.0;
        }
        Self { model, p }
    }

    /// How many values of each kind; outputs are not computed.
    pub fn counts(&self) -> ModelSizes {
        let sizes = self.model.sizes();
        ModelSizes { states: sizes.states * (N + 1), outputs: 0, ..sizes }
    }

    /// State `i` among the states of this model.
    pub fn state(x: &[f64], i: usize) -> Dual<N> {
        let row = &x[i * (N + 1)..][..N + 1];
        Dual::new(row[0], std::array::from_fn(|k| row[k + 1]))
    }

    fn store<T: Scalar>(x: &[Lanes], out: &mut [T]) {
        for (row, x) in out.chunks_exact_mut(N + 1).zip(x) {
            row[0] = T::constant(x.re);
            (0..N).for_each(|k| row[k + 1] = T::constant(x.eps[k]));
        }
    }
}

impl<const N: usize> Hybrid for TangentModel<'_, N> {
    fn sizes(&self) -> ModelSizes {
        self.counts()
    }
    fn start<T: Scalar>(&self, _: &[T], x: &mut [T]) {
        let mut start = vec![Dual::constant(0.0); self.model.sizes().states];
        self.model.start_lanes(&self.p, &mut start);
        Self::store(&start, x);
    }
    fn start_modes(&self, _: At<f64>, _: &mut [i32]) {}
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let n = self.model.sizes().states;
        let dual = |row: &[T]| -> Lanes {
            Dual::new(row[0].value(), std::array::from_fn(|k| if k < N { row[k + 1].value() } else { 0.0 }))
        };
        let x: Vec<Lanes> = at.x.chunks_exact(N + 1).map(dual).collect();
        let u: Vec<Lanes> = at.u.iter().map(|u| Dual::constant(u.value())).collect();
        let mut rates = vec![Dual::constant(0.0); n];
        let at = At { t: Dual::constant(at.t.value()), x: &x, u: &u, p: &self.p, modes: at.modes };
        self.model.rates_lanes(at, &[], &mut rates);
        Self::store(&rates, dx);
    }
    fn outputs<T: Scalar>(&self, _: At<T>, _: &mut [T]) {}
    fn indicators<T: Scalar>(&self, _: At<T>, _: &mut [T]) {}
    fn update(&self, _: f64, _: &mut [f64], _: &[f64], _: &[f64], _: &mut [i32]) -> EventUpdate {
        EventUpdate::default()
    }
}
