//! Model Exchange: linearised where it starts, and at points nearby.

use std::collections::HashMap;
use std::sync::Arc;

use trueup_fmi_description::description::Description;
use trueup_fmi_import::{EventInfo, HybridFmu, UnpackedFmu, UsedInterface, iterate_events};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{LANES, Lanes, Plant};

use super::{
    Experiment, FmuCapabilities, ObservedMotion, RestPoint, SensitivityRows, directional, effort, velocity,
};
use crate::error::PortsError;
use crate::quantity::FmuQuantities;

/// Inputs that are tried, in their nominal values: friction is overcome by one of them.
const LADDER: [f64; 5] = [0.0, 1.0, 1e2, 1e4, 1e6];
/// Points nearby.
const POINTS: usize = 3;
/// How far states are moved, relative to their size or nominal value.
const REACH: f64 = 0.3;

/// Numbers between -1 and 1 (SplitMix64).
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

struct Place {
    x: Vec<f64>,
    u: Vec<f64>,
    modes: [i32; 1],
}

struct MovedFmu<'a> {
    plant: HybridFmu,
    all: &'a FmuQuantities,
    start: f64,
    p: Vec<f64>,
    x0: Vec<f64>,
    u0: Vec<f64>,
    /// Size of each state.
    size: Vec<f64>,
    /// Places of the outputs in the plant's list.
    pick: Vec<usize>,
}

impl<'a> MovedFmu<'a> {
    fn new(plant: HybridFmu, d: &Description, all: &'a FmuQuantities, start: f64) -> Self {
        let table = plant.table();
        let place: HashMap<&str, usize> =
            table.outputs.iter().enumerate().map(|(at, q)| (q.name.as_str(), at)).collect();
        let pick = all.outputs.iter().filter_map(|q| place.get(q.name.as_str()).copied()).collect();
        let p = table.parameters.iter().map(|q| q.start).collect();
        let u0 = table.inputs.iter().map(|q| q.start).collect();
        let nominal = |name: &str| {
            let v = d.variables.iter().find(|v| v.name == name)?;
            d.attributes(v).nominal.filter(|n| n.is_finite() && *n != 0.0).map(f64::abs)
        };
        let size = (0..plant.sizes().states)
            .map(|i| {
                table.states.get(i).and_then(|q| nominal(trueup_signals::base_name(&q.name))).unwrap_or(1.0)
            })
            .collect();
        let x0 = vec![0.0; plant.sizes().states];
        Self { plant, all, start, p, x0, u0, size, pick }
    }

    fn failure(&self) -> Result<(), PortsError> {
        self.plant.failure().map_or(Ok(()), |what| Err(PortsError::Fmu(self.named(&what))))
    }
    fn named(&self, what: &str) -> String {
        let file = self.plant.fmu().file().display().to_string();
        if what.starts_with(&file) { what.to_owned() } else { format!("{file}: {what}") }
    }

    fn at<'b>(&'b self, place: &'b Place, u: &'b [f64]) -> At<'b, f64> {
        At { t: self.start, x: &place.x, u, p: &self.p, modes: &place.modes }
    }

    /// Started with these inputs, then moved to these states, its events processed.
    fn go(&self, x: &[f64], u: Vec<f64>) -> Result<Place, PortsError> {
        let mut place = Place { x: self.x0.clone(), u, modes: [0] };
        self.plant.start(&self.p, &mut place.x);
        let mut modes = [0];
        self.plant.start_modes(At { modes: &modes.clone(), ..self.at(&place, &place.u) }, &mut modes);
        self.failure()?;
        place.modes = modes;
        // Its first events end where it started; after that it can be moved.
        self.rates(&place, &place.u);
        self.failure()?;
        place.x.copy_from_slice(x);
        let settled = iterate_events(|| {
            let update = self.plant.update(self.start, &mut place.x, &place.u, &self.p, &mut modes);
            self.failure()?;
            Ok(EventInfo { again: !update.settled(), ..EventInfo::default() })
        })?;
        if settled.is_none() {
            return Err(PortsError::Fmu(self.named("its event iteration does not end")));
        }
        place.modes = modes;
        Ok(place)
    }

    fn outputs(&self, place: &Place, u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.plant.sizes().outputs];
        self.plant.outputs(self.at(place, u), &mut y);
        self.pick.iter().zip(&self.all.outputs).map(|(at, q)| q.factor * y[*at]).collect()
    }
    fn rates(&self, place: &Place, u: &[f64]) -> Vec<f64> {
        let mut dx = vec![0.0; place.x.len()];
        self.plant.rates(self.at(place, u), &[], &mut dx);
        dx
    }

    /// Derivatives of rates and outputs by the states.
    fn by_states(&self, place: &Place) -> [SensitivityRows; 2] {
        let n = place.x.len();
        let constant = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
        let (u, p) = (constant(&place.u), constant(&self.p));
        let mut found = [vec![vec![0.0; n]; n], vec![vec![0.0; n]; self.pick.len()]];
        for first in (0..n).step_by(LANES) {
            let mut x = constant(&place.x);
            let lanes = LANES.min(n - first);
            for k in 0..lanes {
                x[first + k].eps[k] = 1.0;
            }
            let at = At { t: Lanes::constant(self.start), x: &x, u: &u, p: &p, modes: &place.modes };
            let mut dx = vec![Lanes::constant(0.0); n];
            let mut y = vec![Lanes::constant(0.0); self.plant.sizes().outputs];
            self.plant.rates_lanes(at, &[], &mut dx);
            self.plant.outputs_lanes(at, &mut y);
            for k in 0..lanes {
                dx.iter().zip(&mut found[0]).for_each(|(v, row)| row[first + k] = v.eps[k]);
                let rows = self.pick.iter().zip(&self.all.outputs).zip(&mut found[1]);
                rows.for_each(|((at, q), row)| row[first + k] = q.factor * y[*at].eps[k]);
            }
        }
        found
    }

    /// d(dy/dt)/du and dy/du by steps of the inputs of this size: mechanical systems are affine in them.
    fn by_inputs(&self, place: &Place, by_states: &SensitivityRows, step: f64) -> [SensitivityRows; 2] {
        let outputs = self.pick.len();
        let mut found = [vec![vec![0.0; place.u.len()]; outputs], vec![vec![0.0; place.u.len()]; outputs]];
        for (j, q) in self.all.inputs.iter().enumerate() {
            let by = q.nominal * step.max(1.0);
            let ends = [by, -by].map(|by| {
                let mut u = place.u.clone();
                u[j] += by;
                (self.rates(place, &u), self.outputs(place, &u))
            });
            let width = 2.0 * by * q.factor;
            let difference = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter().zip(b).map(|(a, b)| (a - b) / width).collect()
            };
            let rates = difference(&ends[0].0, &ends[1].0);
            let direct = difference(&ends[0].1, &ends[1].1);
            for k in 0..outputs {
                found[0][k][j] = dot(&by_states[k], &rates);
                found[1][k][j] = direct[k];
            }
        }
        found
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).filter(|(a, _)| **a != 0.0).map(|(a, b)| a * b).sum()
}
/// Derivatives of dy/dt by the states.
fn flows(rates: &SensitivityRows, outputs: &SensitivityRows) -> SensitivityRows {
    let column = |i: usize| rates.iter().map(|row| row[i]).collect::<Vec<_>>();
    let columns: Vec<Vec<f64>> = (0..rates.len()).map(column).collect();
    outputs.iter().map(|row| columns.iter().map(|by| dot(row, by)).collect()).collect()
}
fn finite(rows: &SensitivityRows) -> bool {
    rows.iter().flatten().all(|v| v.is_finite())
}

pub(super) fn run(fmu: &Arc<UnpackedFmu>, all: &FmuQuantities) -> Result<Experiment, PortsError> {
    let d = fmu.description();
    let start = d.experiment.start_time.unwrap_or(0.0);
    let plant = HybridFmu::new(fmu, start).map_err(|e| PortsError::Fmu(e.to_string()))?;
    let mut m = MovedFmu::new(plant.by_differences(), d, all, start);
    let mut x0 = m.x0.clone();
    m.plant.start(&m.p, &mut x0);
    m.failure()?;
    m.size.iter_mut().zip(&x0).for_each(|(s, x)| *s = s.max(x.abs()));
    m.x0 = x0;

    let [a, c] = m.by_states(&m.go(&m.x0, m.u0.clone())?);
    m.failure()?;
    if !finite(&a) || !finite(&c) {
        let what = "its rates or outputs are not finite at its start: set parameters with which it can start";
        return Err(PortsError::Fmu(m.named(what)));
    }
    let acting = |i: &usize| a.iter().chain(&c).any(|row| row[*i] != 0.0);
    let mut offers = FmuCapabilities {
        states: [m.x0.len(), (0..m.x0.len()).filter(acting).count()],
        indicators: m.plant.sizes().indicators,
        directional: d.model_exchange.as_ref().is_some_and(|i| i.provides_directional_derivatives),
        ..FmuCapabilities::default()
    };
    if offers.directional {
        offers.directional_error = Some(directional::error(fmu, all, [&a, &c]).map_err(|e| e.to_string()));
    }

    let mut draws = Draws(1);
    let signs: Vec<f64> = m.u0.iter().map(|_| draws.next()).collect();
    let nudged = |by: f64| -> Vec<f64> {
        let each = m.u0.iter().zip(&m.all.inputs).zip(&signs);
        each.map(|((u, q), s)| if effort(q) { u + by * q.nominal * (s + s.signum()) } else { *u }).collect()
    };
    let answers = |mobility: &SensitivityRows, j: usize| {
        all.outputs.iter().zip(mobility).any(|(q, row)| velocity(q) && row[j] != 0.0)
    };
    let mut best: Option<(usize, f64, [SensitivityRows; 2], RestPoint)> = None;
    let efforts: Vec<usize> = (0..all.inputs.len()).filter(|j| effort(&all.inputs[*j])).collect();
    for by in LADDER {
        let Ok(place) = m.go(&m.x0, nudged(by)) else { continue };
        let [a, c] = m.by_states(&place);
        let found = m.by_inputs(&place, &c, by);
        if m.plant.failure().is_some() || !finite(&c) || !finite(&found[0]) || !finite(&found[1]) {
            continue;
        }
        let count = efforts.iter().filter(|j| answers(&found[0], **j)).count();
        if best.as_ref().is_none_or(|(most, ..)| count > *most) {
            best = Some((count, by, found, RestPoint { flows: flows(&a, &c), outputs: c }));
        }
        if count == efforts.len() {
            break;
        }
    }
    let (_, by, [mobility, direct], rest) = best
        .ok_or_else(|| PortsError::Fmu(m.named("its rates are not finite with any of its inputs stepped")))?;
    let amplitudes = (0..all.inputs.len())
        .map(|j| answers(&mobility, j).then_some(by.max(1.0) * all.inputs[j].nominal * all.inputs[j].factor))
        .collect();
    let mut mobilities = vec![mobility];

    let mut points = Vec::new();
    let mut reach = REACH;
    for _ in 0..4 * POINTS {
        if points.len() == POINTS {
            break;
        }
        let x: Vec<f64> = m.x0.iter().zip(&m.size).map(|(x, s)| x + reach * s * draws.next()).collect();
        let Ok(place) = m.go(&x, nudged(by)) else {
            reach *= 0.3;
            continue;
        };
        let [_, c] = m.by_states(&place);
        let (rates, y) = (m.rates(&place, &place.u), m.outputs(&place, &place.u));
        let flow: Vec<f64> = c.iter().map(|row| dot(row, &rates)).collect();
        let found = m.by_inputs(&place, &c, by);
        let good = finite(&c) && finite(&found[0]) && flow.iter().chain(&y).all(|v| v.is_finite());
        if m.plant.failure().is_some() || !good {
            reach *= 0.3;
            continue;
        }
        if points.is_empty() {
            mobilities.push(found.into_iter().next().unwrap_or_default());
        }
        points.push([y, flow]);
    }
    Ok(Experiment {
        interface: UsedInterface::ModelExchange,
        offers,
        mobilities,
        direct,
        amplitudes,
        late: vec![false; all.inputs.len()],
        motion: ObservedMotion::Points(points),
        rest: Some(rest),
        alone: vec![None; all.inputs.len()],
    })
}
