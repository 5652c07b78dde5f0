//! Sets of causes in numbers, and their fits to the equation error of the recordings.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use trueup_identification::lsq::{SolverOptions, evaluate, solve};
use trueup_identification::predict::PredictError;
use trueup_identification::run::IdentificationRun;
use trueup_identification::sizes::{Rig, TypicalSizes};
use trueup_models::{effect, joint};

use super::balance::GriddedRecording;
use super::floors::{self, Floors};
use super::hypothesis::{self, Hypothesis, PosedHypothesis};
use super::kept::KeptResults;
use super::problem::{BalanceProblem, BalanceTarget, BalanceUnknown, Belief};
use super::recordings::PreparedCase;
use super::subject::EngineModel;
use super::unknown::KNOWN;

/// A set of causes put into numbers.
#[derive(Clone, Debug)]
pub struct PosedSet {
    /// The causes.
    pub set: Vec<Hypothesis>,
    /// The model with their effects.
    pub model: EngineModel,
    /// All parameters of that model.
    pub nominal: Vec<f64>,
    /// Parameters that follow others.
    pub ties: Vec<(usize, usize)>,
    /// Unknowns: the plant's own, offsets, then those of each cause.
    pub unknowns: Vec<BalanceUnknown>,
    /// Where each cause's unknowns begin.
    pub begin: Vec<usize>,
    /// What each cause is in numbers.
    pub posed: Vec<PosedHypothesis>,
    /// It runs freely, and may miss readings by these deviations, by recording and output; `None`: the recordings drive it.
    pub free: Option<Vec<Vec<f64>>>,
    /// The estimate of the unknowns by the balances.
    pub belief: Option<Belief>,
}

/// How many times as long a fit with an order of a shaft goes on: its amplitudes are known only once the order is.
const PATIENCE: usize = 4;

impl PosedSet {
    /// Coordinates to begin with: each unknown as the first of these fits has it that contains it.
    pub fn begin_with(&self, fits: &[&FittedSet]) -> Vec<f64> {
        let known = |u: &BalanceUnknown| fits.iter().find_map(|f| f.coordinate_of(u));
        self.unknowns.iter().map(|u| known(u).unwrap_or_else(|| u.coordinate())).collect()
    }
    /// Coordinates to begin another set with, what both share as these are.
    pub(crate) fn begins_like(&self, other: &Self, theta: &[f64]) -> Vec<f64> {
        let there =
            |u: &BalanceUnknown| self.unknowns.iter().position(|v| v.name == u.name && v.run == u.run);
        other.unknowns.iter().map(|u| there(u).map_or(u.coordinate(), |k| theta[k])).collect()
    }
}

/// What residuals come to in one octave.
#[derive(Clone, Copy, Debug, Default)]
pub struct Octave {
    /// Sum of squares.
    pub squares: f64,
    /// The same of a perfect model.
    pub expected: f64,
    /// How many there are.
    pub count: f64,
}

/// Power of residuals beyond that of a perfect model's, in units of the floor's, as a mean over octaves: what is slow has
/// few values, and would be hidden by the many of what is fast.
pub fn excess(octaves: &[Octave]) -> f64 {
    let beyond = octaves.iter().map(|o| (o.squares - o.expected) / o.count.max(1.0));
    beyond.sum::<f64>() / octaves.len().max(1) as f64
}

/// A set of causes fitted to the recordings.
#[derive(Clone, Debug)]
pub struct FittedSet {
    /// What was fitted.
    pub stated: PosedSet,
    /// Coordinates.
    pub theta: Vec<f64>,
    /// Information of readings and priors on the unknowns: J'J.
    pub information: DMatrix<f64>,
    /// How many readings there are.
    pub readings: usize,
    /// Sum of squares over the readings.
    pub chi2: f64,
    /// By octave of the balances what is left, and what a perfect model would leave.
    pub octaves: Vec<Octave>,
    /// Sum of squares over the priors.
    pub prior2: f64,
    /// -1/2 log det(1 + Lambda^-1 F), what the unknowns cost.
    pub occam: f64,
}

impl FittedSet {
    /// log of the evidence, up to a constant that all sets share; `dispersion`: by how much readings count less.
    pub fn evidence(&self, dispersion: f64) -> f64 {
        -0.5 * self.chi2 / dispersion - 0.5 * self.prior2 + self.occam
    }
    /// Which of its unknowns another set's is.
    pub fn place_of(&self, unknown: &BalanceUnknown) -> Option<usize> {
        self.stated.unknowns.iter().position(|v| v.name == unknown.name && v.run == unknown.run)
    }
    /// Coordinate of an unknown that another set shares.
    pub fn coordinate_of(&self, unknown: &BalanceUnknown) -> Option<f64> {
        self.place_of(unknown).map(|k| self.theta[k])
    }
}

/// The search over one case.
#[derive(Debug)]
pub struct CaseSearch<'a> {
    /// The case.
    pub case: &'a PreparedCase,
    /// Typical sizes.
    pub sizes: TypicalSizes,
    /// All causes that this plant may have.
    pub causes: Vec<Hypothesis>,
    /// Recordings for fitting, then those held out.
    pub prescribed: Vec<GriddedRecording>,
    /// Mean square that a perfect model leaves, by recording and octave.
    pub expected: Vec<Vec<f64>>,
    /// Where first states that no recording shows begin, by recording and state.
    pub(super) drifting_starts: BTreeMap<(String, String), f64>,
    /// What was computed of models.
    pub(super) memory: KeptResults,
}

impl<'a> CaseSearch<'a> {
    /// Ready to search.
    ///
    /// # Errors
    /// A recording that is too short.
    pub fn new(case: &'a PreparedCase, seed: u64) -> Result<Self, String> {
        let runs: Vec<&IdentificationRun> = case.train.iter().map(|c| &c.run).collect();
        let subject = &case.subject;
        let (plant, flexible, values) = (subject.plant, &subject.flexible, &case.nominal);
        let sizes = TypicalSizes::of(&Rig { plant, flexible, values, runs: &runs });
        let causes = hypothesis::all(case);
        let Floors { prescribed, expected } = floors::floors(case, seed)?;
        let (starts, memory) = (BTreeMap::new(), KeptResults::default());
        let mut own = Self { case, sizes, causes, prescribed, expected, drifting_starts: starts, memory };
        own.drifting_starts = own.drifting_starts();
        Ok(own)
    }

    /// A set of causes in numbers, driven by the recordings.
    ///
    /// # Errors
    /// The set cannot be built.
    pub fn state(&self, set: &[Hypothesis]) -> Result<PosedSet, String> {
        self.state_like(set, None)
    }

    /// A set of causes in numbers; `free`: see [`PosedSet::free`].
    ///
    /// # Errors
    /// The set cannot be built.
    pub fn state_like(&self, set: &[Hypothesis], free: Option<Vec<Vec<f64>>>) -> Result<PosedSet, String> {
        let p = self.case;
        let mut effects: Vec<String> = set.iter().flat_map(Hypothesis::effects).collect();
        effects.sort();
        effects.dedup();
        let mut subject = p.subject.clone();
        set.iter().filter_map(Hypothesis::loosens).for_each(|joint| subject.flexible[joint] = true);
        let model = subject.model(&effects)?;
        let named = p.subject.parameters(&model);
        let names: BTreeMap<String, usize> =
            named.iter().enumerate().map(|(i, n)| (n.name.clone(), i)).collect();
        let mut nominal = p.subject.defaults(&model);
        for (named, value) in p.subject.parameters(&p.model).iter().zip(&p.nominal) {
            if let Some(i) = names.get(&named.name) {
                nominal[*i] = *value;
            }
        }
        for (h, along) in set.iter().filter_map(|h| Some((h, h.along()?))) {
            for spec in along.parameters() {
                if let Some(at) = names.get(&h.here(&along.variable(spec.name))) {
                    nominal[*at] = spec.arm_start;
                }
            }
        }
        let mut ties = Vec::new();
        if p.subject.plant == effect::PlantKind::Joint {
            use joint::parameter as q;
            if p.nominal[q::STATIC_FRICTION] <= p.nominal[q::COULOMB_FRICTION] {
                ties.push((q::STATIC_FRICTION, q::COULOMB_FRICTION));
            }
        } else if let (Some(_), n) = (names.get("staticFriction[1]"), p.subject.joints()) {
            for j in 1..=n {
                let [held, slides] = ["static", "coulomb"].map(|of| names[&format!("{of}Friction[{j}]")]);
                if nominal[held] <= nominal[slides] {
                    ties.push((held, slides));
                }
            }
        }
        let mut unknowns = Vec::new();
        for index in hypothesis::own_parameters(p) {
            let name = &p.subject.parameters(&p.model)[index].name;
            let doubt = p.doubt.get(name).copied().unwrap_or(KNOWN);
            let mut u = hypothesis::parameter(p, index, doubt);
            // The same parameter may be elsewhere once there are effects.
            if let (BalanceTarget::Parameter(i), Some(at)) = (&mut u.target, names.get(name)) {
                *i = *at;
            }
            unknowns.push(u);
        }
        unknowns.extend(p.sensors.iter().cloned());
        for run in 0..p.train.len() {
            for output in &p.offsets {
                if let Some(c) = p.train[run].run.channels.iter().find(|c| c.output == *output) {
                    unknowns.push(self.offset(c, run));
                }
            }
        }
        // What nothing prescribes has initial states.
        for (run, compared) in p.train.iter().enumerate() {
            let coordinates = || p.subject.coordinates(&model, &nominal);
            let prescribed = self.prescribed.get(run).filter(|_| free.is_none());
            let unprescribed: Option<Vec<usize>> =
                prescribed.map(|l| l.links(&model, &coordinates()).unprescribed().collect());
            let which = |c: usize| unprescribed.as_ref().is_none_or(|unprescribed| unprescribed.contains(&c));
            unknowns.extend(self.first_states((&model, &nominal), compared, run, which));
        }
        let (mut begin, mut posed) = (Vec::new(), Vec::new());
        for h in set {
            begin.push(unknowns.len());
            let mut one = h.pose(p, &self.sizes, &names);
            if let Some(k) = one.order {
                let u = &mut one.unknowns[k];
                u.lower = u.lower.max(self.coarsest(h));
                u.upper = u.upper.min(self.finest(h)).max(2.0 * u.lower);
                u.start = u.start.clamp(u.lower, u.upper);
            }
            unknowns.extend(one.unknowns.iter().cloned());
            posed.push(one);
        }
        Ok(PosedSet { set: set.to_vec(), model, nominal, ties, unknowns, begin, posed, free, belief: None })
    }

    /// The comparison of a set with the recordings for fitting.
    pub fn compare<'b>(&'b self, stated: &'b PosedSet) -> BalanceProblem<'b> {
        let coordinates = self.case.subject.coordinates(&stated.model, &stated.nominal);
        let lead = if stated.free.is_none() { self.case.train.len() } else { 0 };
        let prescribed = self.prescribed[..lead].iter();
        let orders = stated.posed.iter().zip(&stated.begin).zip(&stated.set);
        let orders = orders.filter_map(|((p, begin), h)| Some((begin + p.order?, self.angle_turned(h))));
        BalanceProblem {
            orders: orders.collect(),
            ties: stated.ties.clone(),
            prescribed: prescribed.map(|l| (l, l.links(&stated.model, &coordinates))).collect(),
            unknowns: stated.unknowns.clone(),
            allowed: stated.free.clone().unwrap_or_default(),
            belief: stated.belief.as_ref(),
            ..BalanceProblem::free(&stated.model, stated.nominal.clone(), &self.case.train)
        }
    }
    /// What residuals of the recordings for fitting come to, octave by octave.
    pub fn octaves(&self, residuals: &[f64]) -> Vec<Octave> {
        let mut all: Vec<Octave> = Vec::new();
        let mut left = residuals.iter();
        for (prescribed, expected) in self.prescribed[..self.case.train.len()].iter().zip(&self.expected) {
            let m = prescribed.channels.len();
            for part in &prescribed.parts {
                all.resize(all.len().max(part.octave + 1), Octave::default());
                let own = &mut all[part.octave];
                own.squares += left.by_ref().take(m).map(|r| r * r).sum::<f64>();
                let count = prescribed.share.get(part.octave).copied().unwrap_or(1.0) * m as f64;
                own.expected += expected.get(part.octave).copied().unwrap_or(1.0) * count;
                own.count += count;
            }
        }
        all
    }

    /// Fits a set from `start`.
    ///
    /// # Errors
    /// The model could not be simulated at the start.
    pub fn fit(
        &self,
        stated: PosedSet,
        start: &[f64],
        options: SolverOptions,
    ) -> Result<FittedSet, PredictError> {
        let problem = self.compare(&stated);
        let times = if problem.orders.is_empty() { 1 } else { PATIENCE };
        let options = SolverOptions { max_iterations: times * options.max_iterations, ..options };
        let found = if stated.free.is_some() {
            solve(&problem, start, options)?
        } else {
            self.solve_believing(problem, &stated, start, options)?
        };
        Ok(self.fitted(stated, found.x, &found.residuals, &found.jacobian))
    }

    /// A set as it is, instead of a fit of it; `None`: its model cannot be simulated there.
    pub fn standing(&self, stated: PosedSet, theta: Vec<f64>) -> Option<FittedSet> {
        let (residuals, jacobian) = evaluate(&self.compare(&stated), &theta).ok()?;
        let finite = residuals.norm_squared().is_finite();
        finite.then(|| self.fitted(stated, theta, &residuals, &jacobian))
    }

    fn fitted(
        &self,
        stated: PosedSet,
        theta: Vec<f64>,
        r: &DVector<f64>,
        jacobian: &DMatrix<f64>,
    ) -> FittedSet {
        let readings = self.compare(&stated).readings();
        let chi2 = r.rows(0, readings).norm_squared();
        let prescribed = stated.free.is_none();
        let prior2 = r.rows(readings, r.len() - readings).norm_squared();
        let octaves = if prescribed { self.octaves(&r.as_slice()[..readings]) } else { Vec::new() };
        let information = jacobian.tr_mul(jacobian);
        let occam = occam(&stated, jacobian, readings);
        FittedSet { stated, theta, information, readings, chi2, octaves, prior2, occam }
    }

    /// Coordinates to begin with when `set` grows out of `from`: what is shared is taken over.
    pub fn begin_with(&self, stated: &PosedSet, from: &FittedSet) -> Vec<f64> {
        stated.begin_with(&[from])
    }
}

/// -1/2 log det(1 + D F D), D the standard deviations of the priors, F the information of the readings.
fn occam(stated: &PosedSet, jacobian: &DMatrix<f64>, readings: usize) -> f64 {
    let j = jacobian.rows(0, readings);
    let mut m = j.tr_mul(&j);
    let sd: Vec<f64> = stated.unknowns.iter().map(|u| u.prior.map_or(1.0, |p| p.deviation)).collect();
    for a in 0..m.nrows() {
        for b in 0..m.ncols() {
            m[(a, b)] *= sd[a] * sd[b];
        }
        m[(a, a)] += 1.0;
    }
    m.cholesky().map_or(0.0, |c| -c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use crate::engine::made::{fitted, stated};
    use crate::engine::offset::offset;

    #[test]
    fn a_set_begins_where_the_first_with_an_unknown_has_it() {
        // Offsets of outputs in recordings.
        let one = |(o, run): &(usize, usize)| offset((&o.to_string(), ""), *o, *run, (0.0, 1.0));
        let unknowns = |all: &[(usize, usize)]| all.iter().map(one).collect();
        let known = |all: &[(usize, usize)], theta: &[f64]| {
            let mut f = fitted("", 1.0, 10.0);
            (f.stated.unknowns, f.theta) = (unknowns(all), theta.to_vec());
            f
        };
        let base = known(&[(1, 0), (0, 0)], &[3.0, 4.0]);
        let set = known(&[(0, 0), (0, 1)], &[5.0, 6.0]);
        let mut stated = stated(Vec::new());
        stated.unknowns = unknowns(&[(0, 0), (0, 1), (1, 0), (1, 1)]);
        stated.unknowns[3].start = 7.0;
        assert_eq!(stated.begin_with(&[&base, &set]), [4.0, 6.0, 3.0, 7.0]);
        assert_eq!(stated.begin_with(&[&set, &base]), [5.0, 6.0, 3.0, 7.0]);
    }
}
