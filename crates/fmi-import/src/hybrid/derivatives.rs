//! Derivatives of an FMU's values: directional derivatives of what its model structure has, differences of the rest.

use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes, Plant};

use super::{HybridFmu, HybridQuery, table};

/// Half the width of a central difference, as a share of what is moved.
const WIDTH: f64 = 6e-6;

/// One direction in which the arguments move.
struct HybridScratch<'a> {
    t: f64,
    x: &'a [f64],
    u: &'a [f64],
    p: &'a [f64],
}

fn values(lanes: &[Lanes]) -> Vec<f64> {
    lanes.iter().map(|v| v.re).collect()
}
fn lane(lanes: &[Lanes], k: usize) -> Vec<f64> {
    lanes.iter().map(|v| v.eps[k]).collect()
}
/// The largest part of a direction, relative to max(|value|, 1).
fn relative_size(along: &[f64], at: &[f64]) -> f64 {
    along.iter().zip(at).map(|(a, v)| a.abs() / v.abs().max(1.0)).fold(0.0, f64::max)
}
fn moved(at: &[f64], by: f64, along: &[f64]) -> Vec<f64> {
    at.iter().zip(along).map(|(v, a)| v + by * a).collect()
}

impl HybridFmu {
    /// Initial states with derivatives, by differences of starts.
    pub(super) fn starts(&self, p: &[Lanes], x: &mut [Lanes]) {
        let plain = values(p);
        let mut column = vec![0.0; x.len()];
        for k in 0..LANES {
            let along = lane(p, k);
            let size = relative_size(&along, &plain);
            if size == 0.0 {
                x.iter_mut().for_each(|v| v.eps[k] = 0.0);
                continue;
            }
            let width = WIDTH / size;
            let mut ends = [column.clone(), column.clone()];
            for (end, by) in ends.iter_mut().zip([-width, width]) {
                self.start(&moved(&plain, by, &along), end);
            }
            let [low, high] = ends;
            for (x, (h, l)) in x.iter_mut().zip(high.iter().zip(low)) {
                x.eps[k] = (h - l) / (2.0 * width);
            }
        }
        // Last, so that the instance is the one of these parameters.
        self.start(&plain, &mut column);
        x.iter_mut().zip(&column).for_each(|(x, v)| x.re = *v);
    }

    /// Along one direction.
    fn along(&self, asked: HybridQuery, at: At<f64>, along: &HybridScratch, result: &mut [f64]) {
        let unknown = &self.unknown;
        let (own, shown) = match asked {
            HybridQuery::Rates => (&unknown.rates, &[][..]),
            HybridQuery::Outputs => (&unknown.outputs, &unknown.shown[..]),
            HybridQuery::Indicators => (&unknown.indicators, &[][..]),
        };
        let mut rest = vec![true; result.len()];
        own.elements.iter().chain(shown.iter().map(|(i, _)| i)).for_each(|i| rest[*i] = false);
        let rest: Vec<usize> = (0..rest.len()).filter(|i| rest[*i]).collect();
        let acting = |place: &&table::ElementReference| along.p[place.elements()].iter().any(|v| *v != 0.0);
        let acting: Vec<&table::ElementReference> = self.places.parameters.iter().filter(acting).collect();
        if let Some(place) = acting.iter().find(|p| !p.directional || !rest.is_empty()) {
            let name = &self.table.parameters[place.begin].name;
            let of = match rest.first().filter(|_| place.directional) {
                Some(i) if asked == HybridQuery::Outputs => format!(" of `{}`", self.table.outputs[*i].name),
                _ => String::new(),
            };
            let file = self.fmu.file().display();
            let what = format!(
                "{file}: no derivative{of} by `{name}` along the way is to be had of this FMU; take differences of whole runs"
            );
            Self::fail(&mut self.way(), what);
            if !place.directional {
                return result.fill(f64::NAN);
            }
        }
        result.fill(0.0);
        shown.iter().for_each(|(i, state)| result[*i] = along.x[*state]);
        if !own.references.is_empty() {
            let (mut by, mut seed) = (unknown.states.clone(), along.x.to_vec());
            let u = self.places.continuous.of(along.u);
            if u.iter().any(|v| *v != 0.0) {
                by.extend(&self.places.continuous.references);
                seed.extend(u);
            }
            for place in &acting {
                by.push(place.reference);
                seed.extend(&along.p[place.elements()]);
            }
            if seed.iter().any(|v| *v != 0.0) {
                let mut column = vec![0.0; own.elements.len()];
                let mut way = self.way();
                let done = match self.seat(&mut way, at) {
                    Ok(Some(seat)) => seat
                        .place(at.t, at.x, &self.places, at.u)
                        .and_then(|()| seat.instance.directional(&own.references, &by, &seed, &mut column)),
                    Ok(None) => return result.fill(f64::NAN),
                    Err(e) => Err(e),
                };
                Self::kept(&mut way, done, &mut column);
                own.elements.iter().zip(column).for_each(|(i, v)| result[*i] = v);
            }
            // No directional derivative is by the time.
            if along.t != 0.0 {
                let later = self.difference(asked, at, &HybridScratch { t: along.t, x: &[], u: &[], p: &[] });
                own.elements.iter().for_each(|i| result[*i] += later[*i]);
            }
        }
        if !rest.is_empty() {
            let all = self.difference(asked, at, along);
            let known = acting.is_empty();
            rest.iter().for_each(|i| result[*i] = if known { all[*i] } else { f64::NAN });
        }
    }

    /// Along time, states and inputs (empty: they stay) by a central difference.
    fn difference(&self, asked: HybridQuery, at: At<f64>, along: &HybridScratch) -> Vec<f64> {
        let count = match asked {
            HybridQuery::Rates => self.sizes.states,
            HybridQuery::Outputs => self.sizes.outputs,
            HybridQuery::Indicators => self.sizes.indicators,
        };
        let size = relative_size(along.x, at.x)
            .max(relative_size(along.u, at.u))
            .max(along.t.abs() / at.t.abs().max(1.0));
        if size == 0.0 {
            return vec![0.0; count];
        }
        let width = WIDTH / size;
        let [low, high] = [-width, width].map(|by| {
            let moved = |at: &[f64], along: &[f64]| {
                if along.is_empty() { at.to_vec() } else { moved(at, by, along) }
            };
            let (x, u, mut end) = (moved(at.x, along.x), moved(at.u, along.u), vec![0.0; count]);
            self.ask(asked, At { t: at.t + by * along.t, x: &x, u: &u, ..at }, &mut end);
            end
        });
        high.iter().zip(low).map(|(h, l)| (h - l) / (2.0 * width)).collect()
    }

    pub(super) fn ask_lanes(&self, asked: HybridQuery, at: At<Lanes>, result: &mut [Lanes]) {
        let (x, u, p) = (values(at.x), values(at.u), values(at.p));
        let plain = At { t: at.t.re, x: &x, u: &u, p: &p, modes: at.modes };
        let mut column = vec![0.0; result.len()];
        self.ask(asked, plain, &mut column);
        result.iter_mut().zip(&column).for_each(|(r, v)| *r = Dual::constant(*v));
        for k in 0..LANES {
            let (x, u, p) = (lane(at.x, k), lane(at.u, k), lane(at.p, k));
            let along = HybridScratch { t: at.t.eps[k], x: &x, u: &u, p: &p };
            if along.t == 0.0 && x.iter().chain(&u).chain(&p).all(|v| *v == 0.0) {
                continue;
            }
            self.along(asked, plain, &along, &mut column);
            result.iter_mut().zip(&column).for_each(|(r, v)| r.eps[k] = *v);
        }
    }
}
