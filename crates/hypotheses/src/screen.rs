//! All that may be missing, weighed at once about the plain model: nothing is refitted.

use trueup_estimation::evidence::{Gram, Prior};
use trueup_estimation::filter::Filter;
use trueup_estimation::fit::priors;
use trueup_estimation::joint::{Along, Column, Model};
use trueup_estimation::system::{Latent, System};

use crate::catalogue::{Cause, all};
use crate::levels::{FIXED, INTENSITIES, LINEAR};
use crate::parametrize::Posed;
use crate::plain::Plain;

/// A cause in a shape, as columns.
struct Shaped {
    cause: usize,
    look: Vec<f64>,
    /// A column an amplitude where the form is linear in them, else one; by recording.
    columns: Vec<Vec<Column>>,
    priors: Vec<Prior>,
    /// Which amplitude each column is; none: the form as a whole.
    of: Vec<usize>,
    /// Bounds of the factors.
    bounds: Vec<[f64; 2]>,
}

impl Shaped {
    /// Factors on all amplitudes: of those without a column 1.
    fn each(&self, factors: &[f64], amplitudes: usize) -> Vec<f64> {
        if self.of.is_empty() {
            return factors.to_vec();
        }
        let mut all = vec![1.0; amplitudes];
        self.of.iter().zip(factors).for_each(|(k, f)| all[*k] = *f);
        all
    }
}

/// A cause where it is best.
#[derive(Clone, Debug)]
pub struct Seen {
    /// What.
    pub cause: Cause,
    /// In numbers.
    pub posed: Posed,
    /// Coordinates of its unknowns, amplitudes as they were found.
    pub at: Vec<f64>,
    /// Factors on the columns.
    pub amplitudes: Vec<f64>,
    /// What it gains over the plain model, in nats.
    pub gain: f64,
    /// Where the intensities are then.
    pub latent: [Latent; 2],
}

/// Everything that may be missing, the likeliest first.
pub fn screen(plain: &Plain) -> Vec<Seen> {
    let posed: Vec<(Cause, Posed)> =
        all(plain).into_iter().filter_map(|c| Some((c.clone(), c.pose(plain).ok()?))).collect();
    let latent = plain.fit.latent;
    let at = plain.stated.assign(&plain.fit.theta);
    let model = Model { joint: &plain.stated.joint, p: &at.p, latent };
    let inertia = model.inertia();
    let runs = &plain.fit.runs;
    let base: Vec<Along> =
        runs.iter().map(|r| Along::new(&model, &r.recording, &r.trajectory, inertia)).collect();
    let shaped: Vec<Shaped> =
        posed.iter().enumerate().flat_map(|(k, (_, p))| shapes(plain, k, p, &base, inertia)).collect();
    let systems: Vec<System<6, 2>> = runs.iter().map(|r| r.filtered(&model, &at.offsets).system).collect();
    let own: Vec<Vec<Column>> = (runs.iter().zip(&plain.raw))
        .map(|(r, raw)| r.columns(raw, &plain.stated, &plain.fit.theta, latent))
        .collect();
    let count = plain.stated.unknowns.len();
    let mut best: Vec<Option<Seen>> = vec![None; posed.len()];
    let mut plainest = f64::NEG_INFINITY;
    for scales in INTENSITIES.iter().flat_map(|m| INTENSITIES.map(|l| [*m, l])) {
        let place = |k: usize| {
            let deviation = (latent[k].deviation * scales[k]).max(plain.walls.floor[k]);
            Latent { deviation, ..latent[k] }
        };
        let latent = [place(0), place(1)];
        let mut own_gram = Gram::new(count);
        let mut grams: Vec<Gram> = shaped.iter().map(|s| Gram::new(count + s.priors.len())).collect();
        for (run, system) in systems.iter().enumerate() {
            let system = system.with_latent(&latent, runs[run].recording.dt);
            let filter = Filter::new(&system);
            let data = filter.data(&system, false).whitened;
            let parts: Vec<_> = own[run].iter().map(Column::parts).collect();
            let own = filter.columns(&system, &parts);
            own_gram.add(&data, &own, filter.log_determinant);
            let parts: Vec<_> =
                shaped.iter().flat_map(|s| s.columns[run].iter().map(Column::parts)).collect();
            let mut passed = filter.columns(&system, &parts).into_iter();
            for (gram, s) in grams.iter_mut().zip(&shaped) {
                let mut columns = own.clone();
                columns.extend(passed.by_ref().take(s.priors.len()));
                gram.add(&data, &columns, filter.log_determinant);
            }
        }
        let own_priors = priors(&plain.stated, &plain.fit.theta);
        let Some(none) = own_gram.posterior(&own_priors) else { continue };
        plainest = plainest.max(none.log_evidence);
        for (s, gram) in shaped.iter().zip(&grams) {
            let mut set = own_priors.clone();
            set.extend(s.priors.iter().enumerate().map(|(k, p)| (count + k, *p)));
            let Some(posterior) = gram.posterior(&set) else { continue };
            let factors: Vec<f64> = posterior.mean.iter().skip(count).copied().collect();
            let allowed = factors.iter().zip(&s.bounds).all(|(f, b)| *f >= b[0] && *f <= b[1]);
            let better = best[s.cause].as_ref().is_none_or(|b| posterior.log_evidence > b.gain);
            if allowed && better {
                let (cause, posed) = &posed[s.cause];
                let at = posed.grown(&s.look, &s.each(&factors, posed.amplitudes.len()));
                let gain = posterior.log_evidence;
                let (cause, posed) = (cause.clone(), posed.clone());
                best[s.cause] = Some(Seen { cause, posed, at, amplitudes: factors, gain, latent });
            }
        }
    }
    let mut seen: Vec<Seen> = best.into_iter().flatten().collect();
    seen.iter_mut().for_each(|s| s.gain -= plainest);
    seen.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    seen
}

/// A cause's shapes as columns about the plain model.
fn shapes(plain: &Plain, cause: usize, posed: &Posed, base: &[Along], inertia: [f64; 2]) -> Vec<Shaped> {
    let columns = |look: &[f64]| -> Vec<Column> {
        let mut theta = plain.fit.theta.clone();
        theta.extend(look);
        let (at, to) = (plain.stated.assign(&plain.fit.theta), posed.stated.assign(&theta));
        let model = Model { joint: &posed.stated.joint, p: &to.p, latent: plain.fit.latent };
        let runs = plain.fit.runs.iter().zip(&plain.raw).zip(base);
        runs.map(|((r, raw), base)| r.moved(raw, &at, &to, &model, inertia).beyond(base)).collect()
    };
    let Some(first) = posed.looks.first() else { return Vec::new() };
    let finite = !posed.amplitudes.is_empty() && posed.amplitudes.iter().all(|a| a.neutral.is_finite());
    let linear = finite && {
        let (whole, half) = (columns(first), columns(&posed.grown(first, &[0.5])));
        let (mut off, mut size) = (0.0, 0.0);
        for (w, h) in whole.iter().zip(&half) {
            let both = |c: &Column| -> Vec<f64> {
                c.torques
                    .iter()
                    .flat_map(|t| [t[0] / inertia[0], t[1] / inertia[1]])
                    .chain(c.errors.clone())
                    .collect()
            };
            for (w, h) in both(w).iter().zip(both(h)) {
                off += (w - 2.0 * h).powi(2);
                size += w * w;
            }
        }
        off <= LINEAR * LINEAR * size
    };
    let looks = if linear { posed.looks.clone() } else { posed.sized() };
    // Of an amplitude that a look leaves out there is no column.
    let there = |look: &[f64]| -> Vec<usize> {
        let differs = |a: &crate::parametrize::Amplitude| look[a.unknown] != a.neutral;
        (0..posed.amplitudes.len()).filter(|k| differs(&posed.amplitudes[*k])).collect()
    };
    let shaped = |look: Vec<f64>| {
        let there = there(&look);
        let by_run = |all: Vec<Vec<Column>>| {
            // From amplitude by recording to recording by amplitude.
            let runs = all.first().map_or(0, Vec::len);
            (0..runs).map(|r| all.iter().map(|a| a[r].clone()).collect()).collect()
        };
        if !linear {
            let columns = by_run(vec![columns(&look)]);
            let priors = vec![Prior { mean: 1.0, deviation: FIXED }];
            let of = Vec::new();
            return Shaped {
                cause,
                look,
                columns,
                priors,
                of,
                bounds: vec![[1.0 - 3.0 * FIXED, 1.0 + 3.0 * FIXED]],
            };
        }
        let only = |k: usize| {
            let factors: Vec<f64> =
                (0..posed.amplitudes.len()).map(|i| if i == k { 1.0 } else { 0.0 }).collect();
            columns(&posed.grown(&look, &factors))
        };
        let all = there.iter().map(|k| only(*k)).collect();
        let size = |k: usize| look[posed.amplitudes[k].unknown] - posed.amplitudes[k].neutral;
        let prior = |k: usize| Prior { mean: 0.0, deviation: 1.0 / size(k).abs().max(1e-12) };
        let bound = |k: usize| {
            let u = &posed.stated.unknowns[posed.own + posed.amplitudes[k].unknown];
            let at = |edge: f64| (edge - posed.amplitudes[k].neutral) / size(k);
            let (a, b) = (at(u.lower), at(u.upper));
            // A bound that is nearly met is met.
            [a.min(b) - 1e-3, a.max(b) + 1e-3]
        };
        Shaped {
            cause,
            columns: by_run(all),
            priors: there.iter().map(|k| prior(*k)).collect(),
            bounds: there.iter().map(|k| bound(*k)).collect(),
            of: there,
            look,
        }
    };
    looks.into_iter().map(shaped).filter(|s| !s.columns.iter().flatten().all(Column::is_zero)).collect()
}

impl Posed {
    /// A look with its amplitudes so many times as large; one factor: all of them.
    pub(crate) fn grown(&self, look: &[f64], factors: &[f64]) -> Vec<f64> {
        let mut at = look.to_vec();
        let finite = self.amplitudes.iter().filter(|a| a.neutral.is_finite());
        for (k, a) in finite.enumerate() {
            let factor = factors.get(if factors.len() == 1 { 0 } else { k }).copied().unwrap_or(1.0);
            let u = &self.stated.unknowns[self.own + a.unknown];
            at[a.unknown] = (a.neutral + factor * (look[a.unknown] - a.neutral)).clamp(u.lower, u.upper);
        }
        at
    }
}
