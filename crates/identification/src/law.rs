//! The motion while the modes are frozen: one step of dx/dt = f(x, u(t)) with u on a straight line.
//!
//! An affine law dx/dt = A x + B u + c is stepped exactly (Taylor series of the matrix exponential, step times largest
//! eigenvalue below [`AFFINE_STEP`]); its matrices come from the rates at unit vectors, so with duals they carry their
//! derivatives. Any other law is stepped by the exponential Runge-Kutta method of order 4 (Cox and Matthews 2002), which
//! takes the rates of [`Plant::followers`] exactly and is the classical one for all other states.

use std::collections::HashMap;

use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{LANES, Lanes, Plant, PlantScalar};

use crate::plan::PredictionPlan;

/// Step times largest eigenvalue of an affine law: short enough that no event is stepped over.
pub(crate) const AFFINE_STEP: f64 = 0.4;
/// Terms of the Taylor series at most: 0.4^14/14! is below rounding.
const TERMS: usize = 14;
/// What is left out of the series, relative to 1.
const ROUNDING: f64 = 1e-18;

/// Terms of the Taylor series over a step of this many radians.
pub(crate) fn terms(radians: f64) -> usize {
    let mut term = 1.0;
    (1..TERMS)
        .find(|k| {
            term *= radians / *k as f64;
            term < ROUNDING
        })
        .unwrap_or(TERMS)
}
/// Step sizes whose maps are kept, per mode; with jittered clocks there is no end of them.
pub(crate) const KEPT: usize = 24;

/// A linear map as its entries that are not 0, row by row: row, column, value.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sparse<T>(pub(crate) Vec<(usize, usize, T)>);

impl<T: Scalar> Sparse<T> {
    fn new(mut entries: Vec<(usize, usize, T)>) -> Self {
        entries.sort_by_key(|e| (e.0, e.1));
        Self(entries)
    }

    fn apply(&self, z: &[T], out: &mut [T]) {
        out.fill(T::zero());
        for row in self.0.chunk_by(|a, b| a.0 == b.0) {
            let mut sum = T::zero();
            row.iter().for_each(|(_, column, value)| sum += *value * z[*column]);
            out[row[0].0] = sum;
        }
    }
}

/// What holds in one set of modes.
#[derive(Debug)]
pub(crate) struct LinearStepLaw<T> {
    /// [dx/dt] from [x, u, 1].
    pub(crate) rates: Sparse<T>,
    /// Requested outputs from [x, u, 1].
    pub(crate) readout: Sparse<T>,
    /// Whether state `row` at the end of a step depends on `[x, u, 1][column]` at its start.
    reach: Vec<Vec<bool>>,
    /// x at the end of a step from [x, u, 1, du/dt], by the bits of the step size.
    maps: HashMap<u64, Sparse<T>>,
    /// Longest step, s.
    pub(crate) longest: f64,
    affine: bool,
    pub(crate) states: usize,
    pub(crate) inputs: usize,
    z: Vec<T>,
    k: [Vec<T>; 8],
    followers: Vec<usize>,
    moved: MovedState,
    /// Per state: the weights of a step that follows at a rate of its own.
    weights: Vec<Weights>,
}

/// Weights of the exponential method for dx/dt = g + lambda x over a step h; with lambda = 0 those of Runge and Kutta.
#[derive(Clone, Copy, Debug)]
struct Weights {
    lambda: f64,
    /// e^(lambda h/2), e^(lambda h), phi_1(lambda h/2)/2.
    half: f64,
    whole: f64,
    stage: f64,
    /// Of g at the four stages: first, both in the middle, last.
    first: f64,
    middle: f64,
    last: f64,
}

impl Weights {
    const PLAIN: Self = Self {
        lambda: 0.0,
        half: 1.0,
        whole: 1.0,
        stage: 0.5,
        first: 1.0 / 6.0,
        middle: 1.0 / 3.0,
        last: 1.0 / 6.0,
    };

    fn new(lambda: f64, h: f64) -> Self {
        let z = lambda * h;
        if z > -1e-3 {
            return Self::PLAIN;
        }
        let [_, phi1, phi2, phi3] = phi(z);
        Self {
            lambda,
            half: (0.5 * z).exp(),
            whole: z.exp(),
            stage: 0.5 * phi(0.5 * z)[1],
            first: phi1 - 3.0 * phi2 + 4.0 * phi3,
            middle: 2.0 * phi2 - 4.0 * phi3,
            last: 4.0 * phi3 - phi2,
        }
    }
}

/// phi_k(z) = sum_j z^j / (j + k)!.
fn phi(z: f64) -> [f64; 4] {
    if z.abs() > 0.5 {
        let phi1 = z.exp_m1() / z;
        let phi2 = (phi1 - 1.0) / z;
        return [z.exp(), phi1, phi2, (phi2 - 0.5) / z];
    }
    let mut phi3 = 0.0;
    let mut term = 1.0 / 6.0;
    for j in 1..14 {
        phi3 += term;
        term *= z / (j + 3) as f64;
    }
    let phi2 = 0.5 + z * phi3;
    let phi1 = 1.0 + z * phi2;
    [1.0 + z * phi1, phi1, phi2, phi3]
}

/// The model with its parameters.
pub(crate) struct FrozenPlant<'a, T> {
    pub(crate) model: &'a dyn Plant,
    pub(crate) p: &'a [T],
    pub(crate) modes: &'a [i32],
}

impl<T: PlantScalar> FrozenPlant<'_, T> {
    fn rates(&self, t: f64, x: &[T], u: &[T], dx: &mut [T]) {
        T::rates(self.model, At { t: T::constant(t), x, u, p: self.p, modes: self.modes }, &[], dx);
    }
    fn outputs(&self, t: f64, x: &[T], u: &[T], y: &mut [T]) {
        T::outputs(self.model, At { t: T::constant(t), x, u, p: self.p, modes: self.modes }, y);
    }
}

impl<T: PlantScalar> LinearStepLaw<T> {
    /// Begins at `x`, `u`, for the steps and the outputs of a plan.
    pub(crate) fn new(f: &FrozenPlant<T>, t: f64, x: &[T], u: &[T], plan: &PredictionPlan) -> Self {
        let n = f.model.sizes();
        let mut law = Self {
            rates: Sparse(Vec::new()),
            readout: Sparse(Vec::new()),
            reach: Vec::new(),
            maps: HashMap::new(),
            longest: f64::INFINITY,
            affine: f.model.affine(),
            states: n.states,
            inputs: n.inputs,
            z: vec![T::zero(); n.states + 2 * n.inputs + 1],
            k: core::array::from_fn(|_| vec![T::zero(); n.states]),
            followers: f.model.followers().to_vec(),
            moved: MovedState::default(),
            weights: vec![Weights::PLAIN; n.states],
        };
        if law.affine {
            law.find_matrices(f, &plan.wanted);
        }
        let values: Vec<f64> = f.p.iter().map(|p| p.value()).collect();
        let frozen = FrozenPlant { model: f.model, p: &values, modes: f.modes };
        let (x, u): (Vec<f64>, Vec<f64>) =
            (x.iter().map(|v| v.value()).collect(), u.iter().map(|v| v.value()).collect());
        let fastest = fastest(&frozen, t, &x, &u);
        law.longest = if law.affine { AFFINE_STEP } else { plan.radians } / fastest;
        law
    }

    fn find_matrices(&mut self, f: &FrozenPlant<T>, wanted: &[usize]) {
        let n = f.model.sizes();
        // A parameter that is 0 hides entries that depend on it: where they are is found with another value.
        let some: Vec<f64> = f.p.iter().map(|p| if p.value() == 0.0 { 1e-3 } else { p.value() }).collect();
        let pattern = columns(&FrozenPlant { model: f.model, p: &some, modes: f.modes }, wanted);
        let values = columns(f, wanted);
        let last = n.states + n.inputs;
        self.reach = vec![vec![false; last + 1]; n.states];
        (0..n.states).for_each(|i| self.reach[i][i] = true);
        let mut rows = [Vec::new(), Vec::new()];
        for (column, ((rates, outputs), (dx, y))) in pattern.iter().zip(values).enumerate() {
            let kept = |pattern: &[f64], v: Vec<T>| {
                let entries = v.into_iter().enumerate().map(move |(row, v)| (row, column, v));
                entries.zip(pattern.to_vec()).filter(|(_, p)| *p != 0.0).map(|(entry, _)| entry)
            };
            rows[0].extend(kept(rates, dx));
            rows[1].extend(kept(outputs, y));
        }
        [self.rates, self.readout] = rows.map(Sparse::new);
        for _ in 0..=n.states {
            for &(row, k, _) in &self.rates.0 {
                for column in 0..=last {
                    self.reach[row][column] |= k == column || k < n.states && self.reach[k][column];
                }
            }
        }
    }

    /// The same law without derivatives.
    pub(crate) fn values(&self) -> LinearStepLaw<f64> {
        let plain = |s: &Sparse<T>| Sparse(s.0.iter().map(|&(r, c, v)| (r, c, v.value())).collect());
        LinearStepLaw {
            rates: plain(&self.rates),
            readout: plain(&self.readout),
            reach: self.reach.clone(),
            maps: HashMap::new(),
            longest: self.longest,
            affine: self.affine,
            states: self.states,
            inputs: self.inputs,
            z: vec![0.0; self.z.len()],
            k: core::array::from_fn(|_| vec![0.0; self.states]),
            followers: self.followers.clone(),
            moved: MovedState::default(),
            weights: self.weights.clone(),
        }
    }

    /// The requested outputs.
    pub(crate) fn read(
        &mut self,
        f: &FrozenPlant<T>,
        t: f64,
        x: &[T],
        u: &[T],
        wanted: &[usize],
        y: &mut [T],
    ) {
        if self.affine {
            self.z[..self.states].copy_from_slice(x);
            self.z[self.states..][..self.inputs].copy_from_slice(u);
            self.z[self.states + self.inputs] = T::one();
            self.readout.apply(&self.z, y);
        } else {
            let mut all = vec![T::zero(); f.model.sizes().outputs];
            f.outputs(t, x, u, &mut all);
            wanted.iter().zip(y).for_each(|(&o, y)| *y = all[o]);
        }
    }

    /// A step of a size that will come again: by a map that is kept.
    pub(crate) fn step(&mut self, f: &FrozenPlant<T>, t: f64, x: &mut [T], u: &[T], du: &[T], h: f64) {
        if !self.affine || (self.maps.len() >= KEPT && !self.maps.contains_key(&h.to_bits())) {
            return self.step_once(f, t, x, u, du, h);
        }
        let (n, m) = (self.states, self.inputs);
        if !self.maps.contains_key(&h.to_bits()) {
            let map = self.map(n + 2 * m + 1, h);
            self.maps.insert(h.to_bits(), map);
        }
        self.z[..n].copy_from_slice(x);
        self.z[n..n + m].copy_from_slice(u);
        self.z[n + m] = T::one();
        self.z[n + m + 1..].copy_from_slice(du);
        if let Some(map) = self.maps.get(&h.to_bits()) {
            map.apply(&self.z, x);
        }
    }

    /// x at the end of a step of an affine law from these `columns`: [x, u, 1, du/dt].
    pub(crate) fn map(&mut self, columns: usize, h: f64) -> Sparse<T> {
        let (n, m) = (self.states, self.inputs);
        let mut entries = Vec::new();
        for column in 0..columns {
            let mut z = vec![T::zero(); columns];
            z[column] = T::one();
            let (x, u, one, du) = (&z[..n], &z[n..n + m], z[n + m], &z[n + m + 1..]);
            let mut end = x.to_vec();
            self.taylor(&mut end, u, one, du, h);
            // A slope reaches what its input reaches.
            let source = if column > n + m { column - m - 1 } else { column };
            let kept = end.into_iter().enumerate().filter(|(row, _)| self.reach[*row][source]);
            entries.extend(kept.map(|(row, v)| (row, column, v)));
        }
        Sparse::new(entries)
    }

    /// A step of any size up to [`LinearStepLaw::longest`].
    pub(crate) fn step_once(&mut self, f: &FrozenPlant<T>, t: f64, x: &mut [T], u: &[T], du: &[T], h: f64) {
        if self.affine { self.taylor(x, u, T::one(), du, h) } else { self.runge_kutta(f, t, x, u, du, h) }
    }

    fn taylor(&mut self, x: &mut [T], u: &[T], one: T, du: &[T], h: f64) {
        let (n, m) = (self.states, self.inputs);
        let [d, ..] = &mut self.k;
        let z = &mut self.z[..n + m + 1];
        z[..n].copy_from_slice(x);
        z[n..n + m].copy_from_slice(u);
        z[n + m] = one;
        let mut factor = 1.0;
        for k in 1..=terms(AFFINE_STEP * h / self.longest) {
            self.rates.apply(z, d);
            factor *= h / k as f64;
            x.iter_mut().zip(d.iter()).for_each(|(x, d)| *x += *d * factor);
            z[..n].copy_from_slice(d);
            if k == 1 {
                z[n..n + m].copy_from_slice(du);
            } else {
                z[n..].fill(T::zero());
            }
            z[n + m] = T::zero();
        }
    }

    fn runge_kutta(&mut self, f: &FrozenPlant<T>, t: f64, x: &mut [T], u: &[T], du: &[T], h: f64) {
        let [k1, k2, k3, k4, a, b, c, input] = &mut self.k;
        input.clear();
        input.extend_from_slice(u);
        f.rates(t, x, input, k1);
        for row in &self.followers {
            self.weights[*row] = Weights::new(self.moved.own_rate(f, t, x, u, *row, k1[*row].value()), h);
        }
        let w = &self.weights;
        // g = f - lambda x at a stage.
        let less_own = |y: &[T], g: &mut [T]| {
            for i in 0..y.len() {
                if w[i].lambda != 0.0 {
                    g[i] -= y[i] * w[i].lambda;
                }
            }
        };
        let mut rates = |at: f64, y: &[T], g: &mut [T]| {
            input.iter_mut().zip(u.iter().zip(du)).for_each(|(v, (u, du))| *v = *u + *du * at);
            f.rates(t + at, y, input, g);
            less_own(y, g);
        };
        let n = x.len();
        less_own(x, k1);
        (0..n).for_each(|i| a[i] = x[i] * w[i].half + k1[i] * (w[i].stage * h));
        rates(0.5 * h, a, k2);
        (0..n).for_each(|i| b[i] = x[i] * w[i].half + k2[i] * (w[i].stage * h));
        rates(0.5 * h, b, k3);
        (0..n).for_each(|i| c[i] = a[i] * w[i].half + (k3[i] * 2.0 - k1[i]) * (w[i].stage * h));
        rates(h, c, k4);
        for i in 0..n {
            let w = &w[i];
            x[i] = x[i] * w.whole + (k1[i] * w.first + (k2[i] + k3[i]) * w.middle + k4[i] * w.last) * h;
        }
    }
}

/// Values at an instant, one state of them moved; kept from step to step.
#[derive(Clone, Debug, Default)]
struct MovedState {
    p: Vec<f64>,
    x: Vec<f64>,
    u: Vec<f64>,
    dx: Vec<f64>,
}

impl MovedState {
    /// df_i/dx_i of a state that follows, whose rate is `rate` here: it is affine in the state, so that a difference is exact.
    fn own_rate<T: PlantScalar>(
        &mut self,
        f: &FrozenPlant<T>,
        t: f64,
        x: &[T],
        u: &[T],
        i: usize,
        rate: f64,
    ) -> f64 {
        for (to, from) in [(&mut self.p, f.p), (&mut self.x, x), (&mut self.u, u)] {
            to.clear();
            to.extend(from.iter().map(|v| v.value()));
        }
        self.dx.resize(x.len(), 0.0);
        // In a strain's own unit, towards 0, so that it stays where bristles are.
        let by = if self.x[i] > 0.0 { -1.0 } else { 1.0 };
        self.x[i] += by;
        FrozenPlant { model: f.model, p: &self.p, modes: f.modes }.rates(t, &self.x, &self.u, &mut self.dx);
        (self.dx[i] - rate) / by
    }
}

/// Rates and outputs requested at unit states and inputs, less those at 0; last those at 0.
fn columns<T: PlantScalar>(f: &FrozenPlant<T>, wanted: &[usize]) -> Vec<(Vec<T>, Vec<T>)> {
    let n = f.model.sizes();
    let (mut x, mut u) = (vec![T::zero(); n.states], vec![T::zero(); n.inputs]);
    let at = |x: &[T], u: &[T]| {
        let (mut dx, mut y) = (vec![T::zero(); n.states], vec![T::zero(); n.outputs]);
        f.rates(0.0, x, u, &mut dx);
        f.outputs(0.0, x, u, &mut y);
        (dx, wanted.iter().map(|&o| y[o]).collect::<Vec<T>>())
    };
    let less = |a: &[T], b: &[T]| a.iter().zip(b).map(|(a, b)| *a - *b).collect::<Vec<T>>();
    let (dx0, y0) = at(&x, &u);
    let mut all = Vec::new();
    for column in 0..n.states + n.inputs {
        let e = if column < n.states { &mut x[column] } else { &mut u[column - n.states] };
        *e = T::one();
        let (dx, y) = at(&x, &u);
        x.fill(T::zero());
        u.fill(T::zero());
        all.push((less(&dx, &dx0), less(&y, &y0)));
    }
    all.push((dx0, y0));
    all
}

/// Magnitude of the fastest eigenvalue of df/dx, 1/s, from above: norm(A^64)^(1/64), which forgets units.
fn fastest(f: &FrozenPlant<f64>, t: f64, x: &[f64], u: &[f64]) -> f64 {
    let n = x.len();
    let dual = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
    let (p, u) = (dual(f.p), dual(u));
    let frozen = FrozenPlant { model: f.model, p: &p, modes: f.modes };
    let followers = f.model.followers();
    let mut a = nalgebra::DMatrix::<f64>::zeros(n, n);
    let own: Vec<usize> = (0..n).filter(|c| !followers.contains(c)).collect();
    for group in own.chunks(LANES) {
        let (mut at, mut dx) = (dual(x), dual(x));
        group.iter().enumerate().for_each(|(lane, column)| at[*column].eps[lane] = 1.0);
        frozen.rates(t, &at, &u, &mut dx);
        for (lane, column) in group.iter().enumerate() {
            own.iter().for_each(|row| a[(*row, *column)] = dx[*row].eps[lane]);
        }
    }
    let mut log = 0.0;
    for k in 0..6 {
        let norm = a.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            return 1e-3;
        }
        a /= norm;
        log += norm.ln() / f64::from(1 << k);
        a = &a * &a;
    }
    (log + a.norm().max(f64::MIN_POSITIVE).ln() / 64.0).exp().max(1e-3)
}
