//! The fixed point of a hypothesis: amplitudes, parameters and intensities -> forces along the trajectory and tangents of the
//! laws -> smoothed trajectory -> columns again.
//!
//! A round counts only if its trajectory had the laws in force and was smoothed at about the intensities that it finds. It ends
//! when the evidence moves by less than a nat, or falls twice.

use super::column::{AppliedLaw, FilterColumn, OwnForces};
use super::evidence::TRUST;
use super::frame::{INTENSITY, InnovationsFrame};
use super::intensity::alike;
use super::linear::Feedback;
use super::numeric::over_steps;

/// Farthest relative change of a parameter without an effect in hand.
const FARTHEST: f64 = 4.0;
/// With an effect in hand no parameter goes farther than so many of its standard deviations.
const DEVIATIONS: f64 = 5.0;
/// Least value of a parameter, in nominal ones.
const LEAST: f64 = 0.2;
/// Bounds of the slopes of laws in a spring, in its stiffness and damping.
const SLOPE: [[f64; 2]; 2] = [[-0.8, 4.0], [-0.8, 300.0]];

/// Where a fit ended.
#[derive(Clone, Debug, Default)]
pub struct FixedPoint {
    /// Log evidence, nats.
    pub evidence: f64,
    /// Log likelihood with the squares of the priors, nats.
    pub penalised: f64,
    /// Amplitudes of the laws, one after the other.
    pub amplitudes: Vec<f64>,
    /// What the rig adds to readings, then differences of the encoders' zeros, in units of their columns.
    pub zeros: Vec<f64>,
    /// Intensities.
    pub q: Vec<f64>,
    /// Parameters.
    pub theta: Vec<f64>,
    /// Squares that are left, per reading.
    pub squares: f64,
    /// Readings that count.
    pub count: usize,
    /// The laws along the trajectory at which it ended.
    pub laws: Vec<AppliedLaw>,
    /// Whether the trajectory had the laws in force and about these intensities.
    pub agrees: bool,
}

/// Makes the laws of a hypothesis along the present trajectory of a frame.
pub type LawMaker<'a> = &'a dyn Fn(&InnovationsFrame) -> Vec<AppliedLaw>;

impl InnovationsFrame {
    /// Fits a hypothesis in at most `rounds` rounds from intensities `q`; `from_start`: from the parameters and the trajectory with
    /// which hypotheses begin, else from those in hand.
    pub fn fit(&mut self, make: LawMaker<'_>, q: &[f64], rounds: usize, from_start: bool) -> FixedPoint {
        if from_start {
            self.reset(q);
        }
        let (mut q, mut along) = (q.to_vec(), q.to_vec());
        let mut best: Option<FixedPoint> = None;
        let mut worse = 0;
        for round in 0..rounds {
            let laws = make(self);
            let base = self.packed(&laws.iter().map(AppliedLaw::narrowed).collect::<Vec<_>>());
            let own: usize = laws.iter().map(|l| l.columns.len()).sum();
            let mut all = vec![q.clone()];
            if round < 2 {
                let starts = [0.02, 0.002, INTENSITY[0]].map(|x| self.intensities(x, x));
                all.extend(starts.into_iter().filter(|x| !strictly_alike(x, &q)));
            }
            let from = self.best_of(&base, &all);
            let best_here = self.search_intensities(&base, from, 1);
            q = best_here.q;
            let found = best_here.found;
            let nuisances = found.amplitudes.len() - own;
            let (nuisance, amplitudes) = found.amplitudes.split_at(nuisances);
            let zeros = nuisance[self.unknown.len()..].to_vec();
            let mut theta = self.theta.clone();
            self.unknown.iter().zip(nuisance).for_each(|(k, x)| theta[*k] *= 1.0 + x);
            let in_force = round > 0 || laws.is_empty() || !from_start;
            let count = found.count;
            let now = FixedPoint {
                evidence: found.log,
                penalised: found.penalised,
                amplitudes: amplitudes.to_vec(),
                zeros: zeros.clone(),
                q: q.clone(),
                theta,
                squares: found.squares / count.max(1) as f64,
                count,
                laws: laws.clone(),
                agrees: alike(&q, &along) && in_force,
            };
            along.clone_from(&q);
            let rank = |p: &FixedPoint| (p.agrees, p.evidence);
            let settled = best.as_ref().is_some_and(|b| b.agrees && (now.evidence - b.evidence).abs() < 1.0);
            if best.as_ref().is_none_or(|b| rank(&now) > rank(b)) {
                best = Some(now);
                worse = 0;
            } else {
                worse += 1;
            }
            if settled || worse > 1 || round + 1 == rounds {
                break;
            }
            let (nuisance, amplitudes) = (nuisance.to_vec(), amplitudes.to_vec());
            self.move_parameters(&nuisance, !laws.is_empty());
            self.put_in_force(&laws, &amplitudes, &zeros, &q);
        }
        best.unwrap_or_default()
    }

    /// Relative changes of the parameters, at most a trusted step each.
    fn move_parameters(&mut self, changes: &[f64], with_effect: bool) {
        for (k, x) in self.unknown.iter().zip(changes) {
            let [value, deviation] = self.believed(*k);
            let wall = if with_effect { (DEVIATIONS * deviation).clamp(TRUST, FARTHEST) } else { FARTHEST };
            let moved = self.theta[*k] * (1.0 + x.clamp(-TRUST, TRUST));
            self.theta[*k] = moved.clamp((1.0 - wall).max(LEAST) * value, (1.0 + wall) * value);
        }
    }

    /// The trajectory with laws in force at these amplitudes, and what the rig adds and the encoders' zeros put right.
    pub fn put_in_force(&mut self, laws: &[AppliedLaw], amplitudes: &[f64], zeros: &[f64], q: &[f64]) {
        self.take_tangent(laws, amplitudes);
        let nuisances = self.nuisances().0;
        let zero_columns = &nuisances[self.unknown.len()..];
        let columns: Vec<&FilterColumn> = laws.iter().flat_map(|l| &l.columns).chain(zero_columns).collect();
        let all: Vec<f64> = amplitudes.iter().chain(zeros).copied().collect();
        let own = self.own_forces(&columns, &all);
        self.smooth(q, Some(own))
    }

    /// Forces and reading errors of columns at these amplitudes, one entry a recording.
    pub fn own_forces(&self, columns: &[&FilterColumn], amplitudes: &[f64]) -> Vec<OwnForces> {
        let sizes = |nodes: usize| [self.coordinates(), self.channels(), nodes];
        let runs = self.runs.iter().enumerate();
        runs.map(|(k, r)| OwnForces::of(columns.iter().copied(), amplitudes, k, sizes(r.nodes))).collect()
    }

    /// Equivalent stiffness and damping of the laws in each spring, by slopes from step to step.
    fn take_tangent(&mut self, laws: &[AppliedLaw], amplitudes: &[f64]) {
        self.feedback = Feedback::default();
        let states = self.plant.states();
        let mut sum = vec![0.0; states * self.coordinates()];
        let mut any = false;
        for (i, element) in self.plant.elements().iter().enumerate() {
            let mut first = 0;
            let mut inside = Vec::new();
            for law in laws {
                let n = law.columns.len();
                if law.spring == Some(i) {
                    inside.extend(law.columns.iter().zip(&amplitudes[first..first + n]));
                }
                first += n;
            }
            if inside.is_empty() {
                continue;
            }
            let (columns, at): (Vec<&FilterColumn>, Vec<f64>) = inside.into_iter().unzip();
            let own = self.own_forces(&columns, &at);
            let on = element.weights.iter().position(|w| *w > 0.0).unwrap_or(0);
            let mut normal = [0.0; 5];
            for (r, own) in self.runs.iter().zip(&own) {
                let along = |row: &[f64]| {
                    let size = states + self.coordinates();
                    let nodes = r.states.chunks(size);
                    let sums = nodes.map(|x| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>());
                    over_steps(&sums.collect::<Vec<_>>())
                };
                let (x, y, f) = (along(&element.deflection), along(&element.rate), &own.forces[on]);
                for t in 1..f.len() {
                    let (dx, dy, df) = (x[t] - x[t - 1], y[t] - y[t - 1], f[t] - f[t - 1]);
                    let products = [dx * dx, dx * dy, dy * dy, dx * df, dy * df];
                    normal.iter_mut().zip(products).for_each(|(n, p)| *n += p);
                }
            }
            let slopes = two_slopes(normal);
            // A step of a refit may have ended below 0, where neither bounds anything.
            let own = self.plant.elastic(&self.theta, element).map(|x| x.max(0.0));
            let bound = |j: usize| slopes[j].clamp(SLOPE[j][0] * own[j], SLOPE[j][1] * own[j]);
            for (c, w) in element.weights.iter().enumerate() {
                for k in 0..states {
                    let gain = bound(0) * element.deflection[k] + bound(1) * element.rate[k];
                    sum[states * c + k] += w * gain;
                }
            }
            any = true;
        }
        if any {
            self.feedback = Feedback(sum);
        }
    }
}

/// Whether no logarithm of a ratio exceeds that of what is alike.
fn strictly_alike(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a / b).ln().abs() <= super::intensity::ALIKE)
}

/// Least squares of two slopes from the sums xx, xy, yy, xf, yf.
fn two_slopes([xx, xy, yy, xf, yf]: [f64; 5]) -> [f64; 2] {
    let determinant = xx * yy - xy * xy;
    if determinant > 1e-12 * xx * yy {
        return [(yy * xf - xy * yf) / determinant, (xx * yf - xy * xf) / determinant];
    }
    [if xx > 0.0 { xf / xx } else { 0.0 }, 0.0]
}
