//! The search: which set of causes explains the recordings best.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use trueup_identification::lsq::{Options, solve};
use trueup_identification::predict::PredictError;
use trueup_models::{effect, joint};

use super::balance::Led;
use super::floors::{self, Floors};
use super::hypothesis::{self, Hypothesis, KNOWN, Posed};
use super::problem::{Comparison, Target, Unknown};
use super::recordings::Prepared;
use super::sizes::Sizes;
use super::subject::Model;

/// A set of causes put into numbers.
#[derive(Clone, Debug)]
pub struct Stated {
    /// The causes.
    pub set: Vec<Hypothesis>,
    /// The model with their effects.
    pub model: Model,
    /// All parameters of that model.
    pub nominal: Vec<f64>,
    /// Parameters that follow others.
    pub ties: Vec<(usize, usize)>,
    /// Unknowns: the plant's own, offsets, then those of each cause.
    pub unknowns: Vec<Unknown>,
    /// Where each cause's unknowns begin.
    pub begin: Vec<usize>,
    /// What each cause is in numbers.
    pub posed: Vec<Posed>,
}

/// A set of causes fitted to the recordings.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// What was fitted.
    pub stated: Stated,
    /// Coordinates.
    pub theta: Vec<f64>,
    /// Residuals of readings, then priors.
    pub residuals: DVector<f64>,
    /// Their derivatives.
    pub jacobian: DMatrix<f64>,
    /// Sum of squares over the readings.
    pub chi2: f64,
    /// What a perfect model would leave of it.
    pub expected: f64,
    /// Sum of squares over the priors.
    pub prior2: f64,
    /// -1/2 log det(1 + Lambda^-1 F), what the unknowns cost.
    pub occam: f64,
}

impl Fitted {
    /// log of the evidence, up to a constant that all sets share; `dispersion`: by how much readings count less.
    pub fn evidence(&self, dispersion: f64) -> f64 {
        -0.5 * self.chi2 / dispersion - 0.5 * self.prior2 + self.occam
    }
    /// Names of the causes.
    pub fn labels(&self) -> Vec<String> {
        self.stated.set.iter().map(Hypothesis::label).collect()
    }
}

/// A cause as it looks from where the search stands.
#[derive(Clone, Debug)]
pub struct Screened {
    /// Which of the causes.
    pub index: usize,
    /// By how much the sum of squares would fall, half.
    pub gain: f64,
    /// Where to begin.
    pub start: Vec<f64>,
}

/// The search over one case.
#[derive(Debug)]
pub struct Search<'a> {
    /// The case.
    pub case: &'a Prepared,
    /// Typical sizes.
    pub sizes: Sizes,
    /// All causes.
    pub causes: Vec<Hypothesis>,
    /// Recordings for fitting, then those held out.
    pub led: Vec<Led>,
    /// Sum of squares that a perfect model leaves, by recording.
    pub expected: Vec<f64>,
}

impl<'a> Search<'a> {
    /// Ready to search.
    ///
    /// # Errors
    /// A recording that is too short.
    pub fn new(case: &'a Prepared, seed: u64) -> Result<Self, String> {
        let sizes = Sizes::of(case);
        let causes = hypothesis::all(case);
        let Floors { led, expected } = floors::floors(case, seed)?;
        Ok(Self { case, sizes, causes, led, expected })
    }

    /// A set of causes in numbers.
    ///
    /// # Errors
    /// The set cannot be built.
    pub fn state(&self, set: &[Hypothesis]) -> Result<Stated, String> {
        let p = self.case;
        let mut effects: Vec<String> = set.iter().filter_map(Hypothesis::effect).collect();
        effects.dedup();
        effects.sort();
        effects.dedup();
        let model = p.subject.model(&effects)?;
        let named = p.subject.parameters(&model);
        let names: BTreeMap<String, usize> =
            named.iter().enumerate().map(|(i, n)| (n.name.clone(), i)).collect();
        let mut nominal = p.subject.defaults(&model);
        for (named, value) in p.subject.parameters(&p.model).iter().zip(&p.nominal) {
            if let Some(i) = names.get(&named.name) {
                nominal[*i] = *value;
            }
        }
        let mut ties = Vec::new();
        if p.subject.plant == effect::Plant::Joint {
            use joint::parameter as q;
            if p.nominal[q::STATIC_FRICTION] <= p.nominal[q::COULOMB_FRICTION] {
                ties.push((q::STATIC_FRICTION, q::COULOMB_FRICTION));
            }
        } else if let (Some(_), n) = (names.get("staticFriction[1]"), p.subject.joints()) {
            for j in 1..=n {
                ties.push((names[&format!("staticFriction[{j}]")], names[&format!("coulombFriction[{j}]")]));
            }
        }
        let mut unknowns = Vec::new();
        for index in hypothesis::own_parameters(p) {
            let name = &p.subject.parameters(&p.model)[index].name;
            let doubt = p.doubt.get(name).copied().unwrap_or(KNOWN);
            let claimed = set.iter().any(|h| h.claim == hypothesis::Claim::Parameter(index));
            let mut u =
                hypothesis::parameter(p, index, if claimed { doubt.max(hypothesis::WRONG) } else { doubt });
            // The same parameter may lie elsewhere once there are effects.
            if let (Target::Parameter(i), Some(at)) = (&mut u.target, names.get(name)) {
                *i = *at;
            }
            unknowns.push(u);
        }
        for run in 0..p.train.len() {
            for output in &p.offsets {
                if p.train[run].run.channels.iter().any(|c| c.output == *output) {
                    let s = self.sizes.range(*output) * 0.1;
                    unknowns.push(offset(*output, run, s));
                }
            }
        }
        // What nothing leads begins somewhere.
        for (run, (led, compared)) in self.led.iter().zip(&p.train).enumerate() {
            let links = led.links(&model, &p.subject.coordinates(&model, &nominal));
            let free: Vec<usize> = links.unled().collect();
            unknowns.extend(self.first_states(&model, compared, run, |c| free.contains(&c)));
        }
        let (mut begin, mut posed) = (Vec::new(), Vec::new());
        for h in set {
            begin.push(unknowns.len());
            let mut one = h.pose(p, &self.sizes, &names);
            for u in one
                .unknowns
                .iter_mut()
                .filter(|u| u.name.split('[').next().is_some_and(|n| n.ends_with("Order")))
            {
                u.upper = u.upper.min(self.finest(h)).max(2.0 * u.lower);
            }
            let own =
                |u: &Unknown| unknowns.iter().any(|v: &Unknown| v.name == u.name && v.target == u.target);
            let known = matches!(h.claim, hypothesis::Claim::Parameter(_)) && one.unknowns.iter().all(own);
            // A parameter of the plant's own is among the unknowns already.
            if !known {
                unknowns.extend(one.unknowns.iter().cloned());
            }
            posed.push(one);
        }
        Ok(Stated { set: set.to_vec(), model, nominal, ties, unknowns, begin, posed })
    }

    /// The comparison of a set with the recordings for fitting.
    pub fn compare<'b>(&'b self, stated: &'b Stated) -> Comparison<'b> {
        let coordinates = self.case.subject.coordinates(&stated.model, &stated.nominal);
        let led = self.led[..self.case.train.len()].iter();
        Comparison {
            model: &stated.model,
            nominal: stated.nominal.clone(),
            ties: stated.ties.clone(),
            runs: &self.case.train,
            led: led.map(|l| (l, l.links(&stated.model, &coordinates))).collect(),
            unknowns: stated.unknowns.clone(),
            held: BTreeMap::new(),
        }
    }
    /// What a perfect model leaves of the recordings for fitting.
    pub fn expected_of_training(&self) -> f64 {
        self.expected[..self.case.train.len()].iter().sum()
    }

    /// Fits a set from `start`.
    ///
    /// # Errors
    /// The model could not be simulated at the start.
    pub fn fit(&self, stated: Stated, start: &[f64], options: Options) -> Result<Fitted, PredictError> {
        self.fit_holding(stated, start, options, BTreeMap::new())
    }

    /// Fits a set that grew out of `base`, whose columns of the Jacobian are held: they hardly change, and cost most.
    ///
    /// # Errors
    /// See [`Self::fit`].
    pub fn fit_beside(
        &self,
        stated: Stated,
        start: &[f64],
        options: Options,
        base: &Fitted,
    ) -> Result<Fitted, PredictError> {
        let readings = self.compare(&stated).readings();
        let own = stated.begin.last().copied().unwrap_or(0);
        let held = stated.unknowns[..own].iter().enumerate().filter_map(|(k, u)| {
            let old = base.stated.unknowns.iter().position(|v| v.name == u.name && v.run == u.run)?;
            Some((k, base.jacobian.column(old).as_slice()[..readings].to_vec()))
        });
        let held = held.collect();
        self.fit_holding(stated, start, options, held)
    }

    fn fit_holding(
        &self,
        stated: Stated,
        start: &[f64],
        options: Options,
        held: BTreeMap<usize, Vec<f64>>,
    ) -> Result<Fitted, PredictError> {
        let problem = Comparison { held, ..self.compare(&stated) };
        let found = solve(&problem, start, options)?;
        let readings = problem.readings();
        let r = found.residuals;
        let chi2 = r.rows(0, readings).norm_squared();
        let prior2 = r.rows(readings, r.len() - readings).norm_squared();
        let mut fitted = Fitted {
            stated,
            theta: found.x,
            residuals: r,
            jacobian: found.jacobian,
            chi2,
            expected: self.expected_of_training(),
            prior2,
            occam: 0.0,
        };
        fitted.occam = occam(&fitted, readings);
        Ok(fitted)
    }

    /// Coordinates to begin with when `set` grows out of `from`: what is shared is taken over.
    pub fn begin_with(&self, stated: &Stated, from: &Fitted) -> Vec<f64> {
        stated
            .unknowns
            .iter()
            .map(|u| {
                let old = from.stated.unknowns.iter().position(|v| v.name == u.name && v.run == u.run);
                old.map_or_else(|| u.coordinate(), |i| from.theta[i])
            })
            .collect()
    }

    /// How each cause would fare beside those of `base`, from one simulation per look.
    pub fn screen(&self, base: &Fitted) -> Vec<Screened> {
        let projection = Projection::new(base);
        let tasks: Vec<usize> = (0..self.causes.len())
            .filter(|i| !base.stated.set.iter().any(|h| h.same_place(&self.causes[*i])))
            .collect();
        let mut all: Vec<Screened> =
            tasks.par_iter().filter_map(|&i| self.screen_one(base, &projection, i)).collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        all
    }

    /// How one cause would fare beside those of `base`.
    pub fn screen_one_of(&self, base: &Fitted, index: usize) -> Option<Screened> {
        self.screen_one(base, &Projection::new(base), index)
    }

    fn screen_one(&self, base: &Fitted, projection: &Projection, index: usize) -> Option<Screened> {
        let h = &self.causes[index];
        let mut set = base.stated.set.clone();
        set.push(h.clone());
        let stated = self.state(&set).ok()?;
        let from = self.begin_with(&stated, base);
        let last = stated.posed.last()?;
        if let hypothesis::Claim::Parameter(_) = h.claim {
            let known = base.stated.unknowns.iter().position(|u| u.name == h.id && u.run.is_none());
            if let Some(k) = known {
                let (gain, step) = projection.relaxed(base, k, hypothesis::WRONG)?;
                let mut start = from;
                start[k] += step.clamp(-0.7, 0.7);
                return Some(Screened { index, gain, start });
            }
        }
        let begin = *stated.begin.last()?;
        let problem = self.compare(&stated);
        let neutral = |look: &[f64], keep: Option<usize>| {
            let mut theta = from.clone();
            for (k, u) in last.unknowns.iter().enumerate() {
                let value = match last.amplitudes.iter().find(|(a, _)| *a == k) {
                    Some((_, n)) if keep != Some(k) => *n,
                    _ => look[k],
                };
                theta[begin + k] = u.scale.coordinate(value);
            }
            theta
        };
        let mut best: Option<Screened> = None;
        let push = matches!(h.claim, hypothesis::Claim::Effect(c) if hypothesis::is_push(&c));
        let looks: Vec<Vec<f64>> = if push {
            self.push_looks(base, h, &last.unknowns)
        } else if last.looks.is_empty() {
            vec![last.unknowns.iter().map(|u| u.start).collect()]
        } else {
            match self.orders(base, h, &last.unknowns) {
                Some((at, orders)) => {
                    let mut first = last.looks[0].clone();
                    orders
                        .into_iter()
                        .map(|k| {
                            first[at] = k;
                            first.clone()
                        })
                        .collect()
                }
                None => last.looks.clone(),
            }
        };
        for look in &looks {
            let single = last.amplitudes.is_empty();
            let keeps: Vec<Option<usize>> =
                if single { vec![None] } else { last.amplitudes.iter().map(|a| Some(a.0)).collect() };
            let mut columns = Vec::new();
            for keep in &keeps {
                let Ok(there) = problem.residuals(&neutral(look, *keep)) else { continue };
                let difference: Vec<f64> =
                    there.iter().zip(base.residuals.iter()).map(|(a, b)| a - b).collect();
                columns.push((*keep, projection.out(&difference)));
            }
            if columns.is_empty() {
                continue;
            }
            let (gain, s) = projection.best(&columns.iter().map(|c| &c.1).collect::<Vec<_>>());
            let mut theta = neutral(look, None);
            for ((keep, _), s) in columns.iter().zip(&s) {
                let Some(k) = keep else { continue };
                let u = &last.unknowns[*k];
                let n = last.amplitudes.iter().find(|a| a.0 == *k).map_or(0.0, |a| a.1);
                let value = (n + s * (look[*k] - n)).clamp(u.lower, u.upper);
                theta[begin + k] = u.scale.coordinate(value);
            }
            for &k in last.follow.iter().filter(|_| s[0] > 0.0) {
                theta[begin + k] = last.unknowns[k].scale.coordinate(look[k] * s[0]);
            }
            let one_sided = columns.len() == 1
                && (single || last.unknowns[columns[0].0.unwrap_or(0)].lower >= last.amplitudes[0].1);
            let gain = if one_sided && s[0] <= 0.0 { 0.0 } else { gain };
            if best.as_ref().is_none_or(|b| gain > b.gain) {
                best = Some(Screened { index, gain, start: theta });
            }
        }
        best
    }
}

pub(crate) fn offset(output: usize, run: usize, size: f64) -> Unknown {
    Unknown {
        name: format!("offset {output}"),
        unit: String::new(),
        target: Target::Offset(output),
        run: Some(run),
        start: 0.0,
        scale: trueup_identification::unknown::Scale::Linear(size.max(1e-12)),
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        prior: Some((0.0, 1.0)),
    }
}

/// -1/2 log det(1 + D F D), D the standard deviations of the priors, F the information of the readings.
fn occam(f: &Fitted, readings: usize) -> f64 {
    let j = f.jacobian.rows(0, readings);
    let mut m = j.tr_mul(&j);
    let sd: Vec<f64> = f.stated.unknowns.iter().map(|u| u.prior.map_or(1.0, |p| p.1)).collect();
    for a in 0..m.nrows() {
        for b in 0..m.ncols() {
            m[(a, b)] *= sd[a] * sd[b];
        }
        m[(a, a)] += 1.0;
    }
    m.cholesky().map_or(0.0, |c| -c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>())
}

/// What the unknowns of a fit cannot take up.
struct Projection {
    /// Orthonormal columns that span the Jacobian (with the rows of the priors).
    q: DMatrix<f64>,
    residuals: DVector<f64>,
}

impl Projection {
    fn new(base: &Fitted) -> Self {
        let mut j = base.jacobian.clone();
        for mut column in j.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        let q = j.qr().q();
        let residuals = &base.residuals - &q * q.tr_mul(&base.residuals);
        Self { q, residuals }
    }
    /// A change of the readings, less what the unknowns would do against it.
    fn out(&self, readings: &[f64]) -> DVector<f64> {
        let mut v = DVector::zeros(self.residuals.len());
        v.as_mut_slice()[..readings.len()].copy_from_slice(readings);
        let along = self.q.tr_mul(&v);
        v - &self.q * along
    }
    /// Half the fall of the sum of squares with the best factors of these changes, and the factors; a factor of 1 has
    /// the prior's standard deviation.
    fn best(&self, columns: &[&DVector<f64>]) -> (f64, Vec<f64>) {
        let n = columns.len();
        let mut a = DMatrix::from_fn(n, n, |i, j| columns[i].dot(columns[j]));
        let b = DVector::from_fn(n, |i, _| columns[i].dot(&self.residuals));
        let bare = a.clone();
        (0..n).for_each(|i| a[(i, i)] += 1.0);
        let Some(c) = a.cholesky() else { return (0.0, vec![0.0; n]) };
        let mut s = -c.solve(&b);
        // A simulation at one size says little about one that is many times as large.
        let most = s.amax();
        if most > 4.0 {
            s *= 4.0 / most;
        }
        let gain = -(b.dot(&s) + 0.5 * s.dot(&(&bare * &s)) + 0.5 * s.norm_squared());
        (gain.max(0.0), s.iter().copied().collect())
    }
    /// Half the fall of the sum of squares when unknown `k` is doubted by `sd` instead of by its prior, and its step.
    fn relaxed(&self, base: &Fitted, k: usize, sd: f64) -> Option<(f64, f64)> {
        let (_, old) = base.stated.unknowns[k].prior?;
        let mut a = base.jacobian.tr_mul(&base.jacobian);
        let mut b = base.jacobian.tr_mul(&base.residuals);
        let r = base.theta[k] - base.stated.unknowns[k].prior?.0;
        let change = 1.0 / (sd * sd) - 1.0 / (old * old);
        a[(k, k)] += change;
        b[k] += change * r;
        let step = -a.cholesky()?.solve(&b);
        let before = 0.5 * (base.residuals.norm_squared() + change * r * r);
        let gain = -0.5 * step.dot(&b) + 0.5 * base.residuals.norm_squared() - before;
        Some((gain.max(0.0), step[k]))
    }
}
