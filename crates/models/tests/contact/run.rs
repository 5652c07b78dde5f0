//! Runs that look at every step and every event.

use trueup_models::layout::LayoutEntry;
use trueup_numerics::driver::{
    Driver, DriverMemory, DriverMoment, DriverOptions, DriverState, Flow, Solver, StepInputs,
};
use trueup_numerics::hybrid::{At, Hybrid};

/// A moment of a run: time, states, outputs, modes; whether it is an event's, after it.
pub(crate) struct Moments {
    pub t: Vec<f64>,
    pub x: Vec<Vec<f64>>,
    pub y: Vec<Vec<f64>>,
    pub modes: Vec<Vec<i32>>,
    pub event: Vec<bool>,
}

impl Moments {
    /// The last outputs.
    pub(crate) fn end(&self) -> &[f64] {
        self.y.last().unwrap()
    }
    /// Times at which the mode of a pair changes, and the mode from there on.
    pub(crate) fn changes(&self, pair: usize) -> Vec<(f64, i32)> {
        let mut all = Vec::new();
        for i in 1..self.t.len() {
            if self.modes[i][pair] != self.modes[i - 1][pair] {
                all.push((self.t[i], self.modes[i][pair]));
            }
        }
        all
    }
    /// Largest value of an output.
    pub(crate) fn largest(&self, output: usize) -> f64 {
        self.y.iter().map(|y| y[output]).fold(f64::NEG_INFINITY, f64::max)
    }
}

pub(crate) const TIGHT: DriverOptions = DriverOptions {
    solver: Solver::Explicit,
    tolerance: 1e-13,
    max_step: f64::INFINITY,
    stop_at_event: false,
    max_steps: 10_000_000,
    max_passes: 100,
    max_chatter: 20,
};

/// All of a run from 0 on through `times`, with the inputs held at `u`.
pub(crate) fn run<M: Hybrid>(
    model: &M,
    p: &[f64],
    u: &[f64],
    times: &[f64],
    nominal: &[f64],
    options: DriverOptions,
) -> Moments {
    let n = model.sizes();
    assert_eq!([p.len(), u.len(), nominal.len()], [n.parameters, n.inputs, n.states]);
    let mut driver = Driver::new(n, nominal, options);
    let (mut t, mut memory) = (0.0, DriverMemory::default());
    let (mut x, mut u, mut modes) = (vec![0.0; n.states], u.to_vec(), vec![0; n.modes]);
    let mut s = DriverState { t: &mut t, x: &mut x, u: &mut u, p, modes: &mut modes, memory: &mut memory };
    driver.initialise(model, &mut s).unwrap();
    let mut all = Moments { t: vec![], x: vec![], y: vec![], modes: vec![], event: vec![] };
    let mut see = |t: f64, x: &[f64], u: &[f64], modes: &[i32], event: bool| {
        let mut y = vec![0.0; n.outputs];
        model.outputs(At { t, x, u, p, modes }, &mut y);
        all.t.push(t);
        all.x.push(x.to_vec());
        all.y.push(y);
        all.modes.push(modes.to_vec());
        all.event.push(event);
    };
    see(*s.t, s.x, s.u, s.modes, true);
    for time in times {
        driver
            .advance_to(model, &mut s, *time, StepInputs::Hold, &mut |v| {
                see(v.t, v.x, v.u, v.modes, v.moment == DriverMoment::Event);
                Flow::Continue
            })
            .unwrap();
    }
    all
}

/// Sets elements of a vector by the names of a list.
pub(crate) fn set<K>(list: &[LayoutEntry<K>], values: &mut [f64], name: &str, new: &[f64]) {
    let begin = place(list, name);
    values[begin..begin + new.len()].copy_from_slice(new);
}

/// Where a variable of a list begins.
pub(crate) fn place<K>(list: &[LayoutEntry<K>], name: &str) -> usize {
    let mut begin = 0;
    for e in list {
        if e.name == name {
            return begin;
        }
        begin += e.len();
    }
    panic!("no {name}");
}
