//! All that may be missing, weighed at once about the baseline: nothing is refitted.

use trueup_estimation::evidence::{Further, Gram, Posterior, Prior};
use trueup_estimation::filter::Filter;
use trueup_estimation::fit::priors;
use trueup_estimation::intake::Raw;
use trueup_estimation::joint::{Along, Column, FULL, LEAN, Model, PLACES, Parts, has_effect_states};
use trueup_estimation::run::Run;
use trueup_estimation::system::{Latent, System};
use trueup_estimation::unknown::{Target, Unknown};
use trueup_models::effect::Scope;

use crate::baseline::Baseline;
use crate::catalogue::{Cause, all};
use crate::levels::{BEGIN, FIXED, INTENSITIES, LINEAR, SMALL};
use crate::parametrize::Parametrized;
use trueup_numerics::order::descending;

/// Shapes whose columns are held at once.
const GROUP: usize = 8;

/// A cause at a point, as columns.
struct Shape {
    cause: usize,
    point: Vec<f64>,
    /// By recording: a column an amplitude where the form is linear in them, else one.
    columns: Vec<Vec<Column>>,
    /// Of the factors on the columns.
    priors: Vec<Prior>,
    /// Bounds of these factors.
    bounds: Vec<[f64; 2]>,
    /// Which amplitude each column is; none: the form as a whole.
    of: Vec<usize>,
}

/// A cause where it is likeliest.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// What.
    pub cause: Cause,
    /// In numbers.
    pub parametrized: Parametrized,
    /// Coordinates of its unknowns, amplitudes as they were found.
    pub at: Vec<f64>,
    /// By how much the baseline's unknowns move with it.
    pub by: Vec<f64>,
    /// What it gains over the baseline, in nats.
    pub gain: f64,
    /// Where the intensities are then.
    pub latent: [Latent; PLACES],
}

impl Candidate {
    /// Coordinates of all unknowns, the baseline's first.
    pub fn start(&self, baseline: &Baseline) -> Vec<f64> {
        let own = baseline.fit.theta.iter().zip(&self.by).map(|(t, by)| t + by);
        let all = own.chain(self.at.iter().copied()).zip(&self.parametrized.parametric.unknowns);
        all.map(|(t, u)| t.clamp(u.lower, u.upper)).collect()
    }
    /// A cause at each of its points, unseen, with latent torques to begin with.
    pub fn points(baseline: &Baseline, cause: &Cause) -> Vec<Self> {
        let Ok(parametrized) = cause.parametrize(baseline) else { return Vec::new() };
        let torques = baseline.sizes.torques();
        let latent =
            core::array::from_fn(|k| Latent { deviation: BEGIN * torques[k], ..baseline.fit.latent[k] });
        let of = |at: &Vec<f64>| Self {
            cause: cause.clone(),
            parametrized: parametrized.clone(),
            at: at.clone(),
            by: vec![0.0; parametrized.own],
            gain: 0.0,
            latent,
        };
        parametrized.points.iter().map(of).collect()
    }
}

/// Everything that may be missing, the likeliest first.
pub fn screen(baseline: &Baseline) -> Vec<Candidate> {
    if has_effect_states(&baseline.parametric.joint) {
        screen_in::<FULL>(baseline)
    } else {
        screen_in::<LEAN>(baseline)
    }
}

fn screen_in<const N: usize>(baseline: &Baseline) -> Vec<Candidate> {
    let causes: Vec<(Cause, Parametrized)> = (all(baseline).into_iter())
        .filter(|c| !c.restructures())
        .filter_map(|c| c.parametrize(baseline).ok().map(|p| (c, p)))
        .collect();
    let about = About::<N>::new(baseline);
    let shapes: Vec<Shape> = causes.iter().enumerate().flat_map(|(k, (_, p))| shapes(&about, k, p)).collect();
    let mut best: Vec<Option<Candidate>> = vec![None; causes.len()];
    let mut scores = vec![f64::NEG_INFINITY; causes.len()];
    let mut gains = vec![f64::NEG_INFINITY; shapes.len()];
    let mut alone = f64::NEG_INFINITY;
    let pairs: Vec<[f64; PLACES]> = INTENSITIES
        .iter()
        .flat_map(|m| INTENSITIES.map(|l| [*m, l]))
        .filter(|p| !FIRST.contains(p))
        .collect();
    let mut asked: Vec<usize> = (0..shapes.len()).collect();
    for (k, scales) in FIRST.into_iter().chain(pairs).enumerate() {
        if k == FIRST.len() {
            asked = promising(&shapes, &gains);
        }
        let latent = core::array::from_fn(|k| {
            let own = baseline.fit.latent[k];
            Latent { deviation: (own.deviation * scales[k]).max(baseline.bounds.floor[k]), ..own }
        });
        let those: Vec<&Shape> = asked.iter().map(|k| &shapes[*k]).collect();
        let Some((none, with)) = about.weigh(&those, latent) else { continue };
        alone = alone.max(none.log_evidence);
        for (at, posterior) in asked.iter().zip(with) {
            let Some(posterior) = posterior else { continue };
            let s = &shapes[*at];
            let factors: Vec<f64> = posterior.mean.iter().skip(about.own()).copied().collect();
            if !s.allows(&factors) {
                continue;
            }
            let gain = posterior.log_evidence;
            gains[*at] = gains[*at].max(gain - none.log_evidence);
            // Latent torques take what rings: a resonance shows where they are held down, though all is worse there.
            let rings = causes[s.cause].1.whole;
            let score = if rings { gain - none.log_evidence } else { gain };
            if score > scores[s.cause] {
                scores[s.cause] = score;
                let (cause, parametrized) = causes[s.cause].clone();
                best[s.cause] = Some(if rings {
                    let by = vec![0.0; about.own()];
                    Candidate {
                        cause,
                        parametrized,
                        at: s.point.clone(),
                        by,
                        gain,
                        latent: baseline.fit.latent,
                    }
                } else {
                    let by = posterior.mean.iter().take(about.own()).copied().collect();
                    let at = parametrized.grown(&s.point, &s.factors(&factors, &parametrized));
                    Candidate { cause, parametrized, at, by, gain, latent }
                });
            }
        }
    }
    let mut found: Vec<Candidate> = best.into_iter().flatten().collect();
    found.iter_mut().for_each(|c| c.gain -= alone);
    descending(&mut found, |item| item.gain);
    found
}

/// Pairs of intensities at which every shape is looked at, in units of the baseline's.
const FIRST: [[f64; PLACES]; 2] = [[1.0, 1.0], [0.3, 0.3]];
/// Shapes of a cause that are looked at further.
const KEPT: usize = 3;

/// Of each cause the shapes that gain most.
fn promising(shapes: &[Shape], gains: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    descending(&mut order, |item| gains[*item]);
    let mut kept = vec![0; shapes.iter().map(|s| s.cause + 1).max().unwrap_or(0)];
    order.retain(|k| {
        kept[shapes[*k].cause] += 1;
        kept[shapes[*k].cause] <= KEPT
    });
    order
}

/// The baseline with its recordings as linear systems.
struct About<'a, const N: usize> {
    baseline: &'a Baseline,
    inertia: [f64; PLACES],
    /// By recording: what the baseline does.
    along: Vec<Along>,
    systems: Vec<System<N, PLACES>>,
    /// By recording and unknown of the baseline.
    columns: Vec<Vec<Column>>,
}

impl<'a, const N: usize> About<'a, N> {
    fn new(baseline: &'a Baseline) -> Self {
        let (fit, parametric) = (&baseline.fit, &baseline.parametric);
        let at = parametric.assign(&fit.theta);
        let model = Model { joint: &parametric.joint, p: &at.p, latent: fit.latent };
        let inertia = model.inertia();
        let runs = || fit.runs.iter();
        Self {
            baseline,
            inertia,
            along: runs()
                .map(|r| Along::new(&model, &r.recording, &r.trajectory, inertia, Parts::ALL))
                .collect(),
            systems: runs().map(|r| r.system(&model, &at.offsets)).collect(),
            columns: (runs().zip(&baseline.raw))
                .map(|(r, raw)| r.columns(raw, parametric, &fit.theta, fit.latent))
                .collect(),
        }
    }
    /// How many unknowns the baseline has.
    fn own(&self) -> usize {
        self.baseline.parametric.unknowns.len()
    }

    /// Posteriors without any cause and with each shape of one, at these intensities.
    fn weigh(
        &self,
        shapes: &[&Shape],
        latent: [Latent; PLACES],
    ) -> Option<(Posterior, Vec<Option<Posterior>>)> {
        let count = self.own();
        let mut own_gram = Gram::new(count);
        let mut all: Vec<Further> = shapes.iter().map(|s| Further::new(count, s.priors.len())).collect();
        for (run, system) in self.systems.iter().enumerate() {
            let mut system = system.clone();
            system.set_latent(&latent, self.baseline.fit.runs[run].recording.dt);
            let filter = Filter::new(&system);
            let data = filter.data(&system, false).whitened;
            let passed = |columns: &mut dyn Iterator<Item = &Column>| {
                filter.columns(&system, &columns.map(Column::parts).collect::<Vec<_>>())
            };
            let own = passed(&mut self.columns[run].iter());
            own_gram.add(&data, &own, filter.log_determinant);
            for (group, further) in shapes.chunks(GROUP).zip(all.chunks_mut(GROUP)) {
                let others = passed(&mut group.iter().flat_map(|s| &s.columns[run]));
                let mut others = &others[..];
                for (further, s) in further.iter_mut().zip(group) {
                    let (these, rest) = others.split_at(s.priors.len());
                    further.add(&data, &own, these);
                    others = rest;
                }
            }
        }
        let own = priors(&self.baseline.parametric, &self.baseline.fit.theta);
        let with = |(s, further): (&&Shape, &Further)| {
            let theirs = s.priors.iter().enumerate().map(|(k, p)| (count + k, *p));
            own_gram.with(further).posterior(&own.iter().copied().chain(theirs).collect::<Vec<_>>())
        };
        Some((own_gram.posterior(&own)?, shapes.iter().zip(&all).map(with).collect()))
    }

    /// What a cause does at a point, by recording.
    fn columns(&self, parametrized: &Parametrized, point: &[f64]) -> Vec<Column> {
        let (fit, before) = (&self.baseline.fit, &self.baseline.parametric);
        let theta = [&fit.theta[..], point].concat();
        let (at, to) = (before.assign(&fit.theta), parametrized.parametric.assign(&theta));
        let model = Model { joint: &parametrized.parametric.joint, p: &to.p, latent: fit.latent };
        let late = |u: &Unknown| matches!(u.target, Target::SensorDelay(_));
        let sensed = parametrized.own_unknowns().iter().any(late)
            || parametrized.parametric.joint.effects().iter().any(|e| e.choice.scope() == Scope::Channel);
        let column = |((r, raw), own): ((&Run, &Raw), &Along)| {
            // What a sensor does moves nothing.
            let parts = Parts { torques: !sensed, readings: sensed || !model.shows_states(&r.recording) };
            r.moved(raw, (&at, &to), &model, self.inertia, parts).beyond(own)
        };
        fit.runs.iter().zip(&self.baseline.raw).zip(&self.along).map(column).collect()
    }

    /// Half of the amplitudes do half as much.
    fn is_linear(&self, parametrized: &Parametrized, point: &[f64]) -> bool {
        let amplitudes = &parametrized.amplitudes;
        if amplitudes.is_empty() || amplitudes.iter().any(|a| a.neutral.is_infinite()) {
            return false;
        }
        let half = vec![0.5; amplitudes.len()];
        let values = |point: &[f64]| -> Vec<f64> {
            let inertia = self.inertia;
            let of = |c: Column| {
                let torques = c.torques.into_iter().flat_map(move |t| [t[0] / inertia[0], t[1] / inertia[1]]);
                torques.chain(c.errors)
            };
            self.columns(parametrized, point).into_iter().flat_map(of).collect()
        };
        let (whole, half) = (values(point), values(&parametrized.grown(point, &half)));
        let off: f64 = whole.iter().zip(&half).map(|(w, h)| (w - 2.0 * h).powi(2)).sum();
        off <= LINEAR * LINEAR * whole.iter().map(|w| w * w).sum::<f64>()
    }
}

/// A cause's shapes as columns about the baseline; those that do nothing are left out.
fn shapes<const N: usize>(about: &About<N>, cause: usize, parametrized: &Parametrized) -> Vec<Shape> {
    let Some(first) = parametrized.points.first() else { return Vec::new() };
    let amplitudes = parametrized.amplitudes.len();
    let grown = |point: &[f64], by: f64| parametrized.grown(point, &vec![by; amplitudes]);
    let small = SMALL.into_iter().find(|by| about.is_linear(parametrized, &grown(first, *by)));
    let shapes: Vec<Shape> = match small {
        Some(by) => {
            let linear = |p: &Vec<f64>| Shape::linear(about, cause, parametrized, grown(p, by));
            parametrized.points.iter().map(linear).collect()
        }
        None => {
            let fixed = |point| Shape::fixed(about, cause, parametrized, point);
            parametrized.sized().into_iter().map(fixed).collect()
        }
    };
    let acts = |s: &Shape| !s.columns.iter().flatten().all(Column::is_zero);
    shapes.into_iter().filter(acts).collect()
}

impl Shape {
    /// A form whose size is part of it.
    fn fixed<const N: usize>(
        about: &About<N>,
        cause: usize,
        parametrized: &Parametrized,
        point: Vec<f64>,
    ) -> Self {
        Self {
            cause,
            columns: about.columns(parametrized, &point).into_iter().map(|c| vec![c]).collect(),
            priors: vec![Prior { mean: 1.0, deviation: FIXED }],
            bounds: vec![[1.0 - 3.0 * FIXED, 1.0 + 3.0 * FIXED]],
            of: Vec::new(),
            point,
        }
    }
    /// A form that is linear in its amplitudes: a column for each that the point does not leave neutral.
    fn linear<const N: usize>(
        about: &About<N>,
        cause: usize,
        parametrized: &Parametrized,
        point: Vec<f64>,
    ) -> Self {
        let amplitudes = &parametrized.amplitudes;
        let size = |k: usize| point[amplitudes[k].unknown] - amplitudes[k].neutral;
        let of: Vec<usize> = (0..amplitudes.len()).filter(|k| size(*k) != 0.0).collect();
        let mut columns = vec![Vec::new(); about.systems.len()];
        for k in &of {
            let only: Vec<f64> = (0..amplitudes.len()).map(|i| if i == *k { 1.0 } else { 0.0 }).collect();
            let alone = about.columns(parametrized, &parametrized.grown(&point, &only));
            columns.iter_mut().zip(alone).for_each(|(all, c)| all.push(c));
        }
        let bound = |k: &usize| {
            let u = &parametrized.parametric.unknowns[parametrized.own + amplitudes[*k].unknown];
            let at = |edge: f64| (edge - amplitudes[*k].neutral) / size(*k);
            let (a, b) = (at(u.lower), at(u.upper));
            // A bound that is nearly met is met.
            [a.min(b) - 1e-3, a.max(b) + 1e-3]
        };
        let prior = |k: &usize| Prior { mean: 0.0, deviation: 1.0 / size(*k).abs() };
        let (priors, bounds) = (of.iter().map(prior).collect(), of.iter().map(bound).collect());
        Self { cause, point, columns, priors, bounds, of }
    }
    fn allows(&self, factors: &[f64]) -> bool {
        factors.iter().zip(&self.bounds).all(|(f, b)| *f >= b[0] && *f <= b[1])
    }
    /// A factor for each amplitude: for those without a column 1.
    fn factors(&self, found: &[f64], parametrized: &Parametrized) -> Vec<f64> {
        let whole = if self.of.is_empty() { found.first().copied() } else { None };
        let mut all = vec![whole.unwrap_or(1.0); parametrized.amplitudes.len()];
        self.of.iter().zip(found).for_each(|(k, f)| all[*k] = *f);
        all
    }
}
