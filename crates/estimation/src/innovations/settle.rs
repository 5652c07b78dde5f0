//! What the data decide about the undisturbed model, each by its evidence alone: rest speed, white force, scale of the readings'
//! variance, intensities, events that are misplaced, the impulse of a release.

use std::rc::Rc;

use super::evidence::log_evidence;
use super::frame::{INTENSITY, InnovationsFrame};
use super::intensity::alike;
use super::numeric::quantile;
use super::signs::DrySigns;

/// Rest speeds tried, in usual speeds.
const REST: [f64; 4] = [0.001, 0.003, 0.01, 0.02];
/// White forces tried, in usual forces.
const WHITE: [f64; 4] = [0.02, 0.006, 0.002, 0.0006];
/// Speeds of what rests tried, in speeds of rest.
const CREEP: [f64; 4] = [1.0, 0.3, 0.1, 0.03];
/// Factors of the readings' variance tried.
const SCALE: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
/// Standard deviations of an innovation that is too large near an event.
const ODD: f64 = 5.0;
/// Nats that misplaced events have to gain, and the impulse of a release.
const GAIN: [f64; 2] = [10.0, 5.0];
/// Torque held at rest, in levels of dry friction, beyond which a release has an impulse, and the largest that is accepted.
const RELEASE: [f64; 2] = [1.3, 6.0];

/// Rest and signs with the intensities about which they were found.
struct Settling {
    evidence: f64,
    rest: f64,
    q: Vec<f64>,
    signs: Vec<Rc<DrySigns>>,
}

impl InnovationsFrame {
    /// Signs and rest from the readings' speed, then from the smoothed one, again: the best by evidence at a few intensities,
    /// about which the trajectory is smoothed. Returns these.
    pub fn settle_signs(&mut self, q: &[f64], rounds: usize) -> Vec<f64> {
        let mut best: Option<Settling> = None;
        for k in 0..rounds {
            if k == 0 {
                self.signs_from_readings();
            } else {
                self.signs_from_states();
            }
            self.smooth(q, None);
            let base = self.packed(&[]);
            let tried = [q.to_vec(), self.intensities(0.02, 0.02), self.intensities(0.002, 0.02)];
            let found = self.best_of(&base, &tried);
            let (at, evidence) = (found.q, found.found.log);
            if best.as_ref().is_none_or(|b| evidence > b.evidence) {
                best = Some(Settling { evidence, rest: self.rest, q: at, signs: self.signs() });
            }
        }
        let Some(best) = best else { return q.to_vec() };
        self.evidence = best.evidence;
        self.restore_signs(&best.signs);
        self.smooth(&best.q, None);
        best.q
    }

    /// Trajectory and intensities until they belong together: an evidence along a trajectory of other intensities can be false
    /// by thousands.
    fn agree(&mut self, rounds: usize) {
        let mut rounds = rounds;
        for _ in 0..5 {
            self.smooth(&self.q.clone(), None);
            let (q, evidence) = self.null(&self.q.clone(), rounds, true);
            let same = alike(&q, &self.q);
            (self.q, self.evidence) = (q, evidence);
            rounds = 1;
            if same {
                break;
            }
        }
        self.smooth(&self.q.clone(), None)
    }

    /// All of it; `quick`: rest speed, white force and scale stay.
    pub fn settle(&mut self, quick: bool) {
        let speeds = if self.breakaway() > 0.0 && !quick {
            REST.map(|x| x * self.usual_speed).to_vec()
        } else {
            vec![self.rest]
        };
        let mut speeds: Vec<f64> = speeds.into_iter().map(|v| v.max(self.least_rest)).collect();
        speeds.sort_unstable_by(f64::total_cmp);
        speeds.dedup();
        let mut found = Vec::new();
        for rest in speeds {
            self.rest = rest;
            let q = self.settle_signs(&self.q.clone(), 3);
            found.push(Settling { evidence: self.evidence, rest, q, signs: self.signs() });
        }
        found.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        let mut best: Option<Settling> = None;
        for s in found.into_iter().take(2) {
            self.rest = s.rest;
            self.restore_signs(&s.signs);
            self.smooth(&s.q, None);
            let (q, evidence) = self.null(&s.q, 1, true);
            if best.as_ref().is_none_or(|b| evidence > b.evidence) {
                best = Some(Settling { evidence, q, ..s });
            }
        }
        if let Some(best) = best {
            self.rest = best.rest;
            self.restore_signs(&best.signs);
            self.q = best.q;
        }
        if !quick {
            self.smooth(&self.q.clone(), None);
            self.settle_noise();
        }
        self.agree(2);
        self.settle_events();
        self.smooth(&self.q.clone(), None);
        self.settle_release()
    }

    /// Where the encoder leaves no choice of the speed of rest, how fast what rests creeps; white force, then the scale of the readings'
    /// variance.
    fn settle_noise(&mut self) {
        let base = self.packed(&[]);
        type Field = fn(&mut InnovationsFrame) -> &mut f64;
        let fields: [(Field, [f64; 4]); 3] =
            [(|f| &mut f.creep, CREEP), (|f| &mut f.white, WHITE), (|f| &mut f.scale, SCALE)];
        let bounded = self.breakaway() > 0.0 && self.least_rest >= REST[REST.len() - 1] * self.usual_speed;
        for (value, grid) in fields.into_iter().skip(usize::from(!bounded)) {
            let quieter: Vec<f64> = self.q.iter().map(|q| (0.3 * q).max(INTENSITY[0])).collect();
            let tried = [self.q.clone(), quieter];
            let mut best: Option<(f64, f64, Vec<f64>)> = None;
            for x in grid {
                *value(self) = x;
                let found = self.best_of(&base, &tried);
                let (q, evidence) = (found.q, found.found.log);
                if best.as_ref().is_none_or(|b| evidence > b.0) {
                    best = Some((evidence, x, q));
                }
            }
            if let Some((_, x, q)) = best {
                *value(self) = x;
                self.q = q;
            }
        }
    }

    /// Events that are misplaced: the force there is not known, where evidence likes that.
    fn settle_events(&mut self) {
        for _ in 0..2 {
            if self.breakaway() <= 0.0 {
                return;
            }
            let (packed, priors) = self.packed(&[]);
            let passed = self.pass_base(&packed, &self.q.clone());
            let amplitudes = log_evidence(&passed.gram, &priors).amplitudes;
            let kept = (self.signs(), self.q.clone(), self.evidence);
            let mut hits = 0;
            for (k, e) in passed.innovations.iter().enumerate() {
                let signs = &self.runs[k].signs;
                let odd = odd_nodes((e, passed.gram.stride()), &amplitudes, signs, self.channels());
                hits += odd.len();
                let mut misplaced = signs.misplaced.clone();
                for t in odd {
                    misplaced[t.saturating_sub(3)..=t].fill(true);
                }
                let signs = DrySigns { misplaced, ..DrySigns::clone(signs) };
                self.runs[k].signs = Rc::new(signs);
            }
            if hits > 0 {
                self.signs_from_states();
                self.agree(1);
                if self.evidence > kept.2 + GAIN[0] {
                    continue;
                }
            }
            self.restore_signs(&kept.0);
            (self.q, self.evidence) = (kept.1, kept.2);
            break;
        }
    }

    /// The largest torque held at rest; where evidence likes it, it is also the impulse of a release.
    fn settle_release(&mut self) {
        self.release = 1.0;
        let level = self.breakaway();
        if level <= 0.0 || self.plant.elements().is_empty() {
            return;
        }
        let mut held = Vec::new();
        for k in 0..self.runs.len() {
            let mode = self.runs[k].signs.mode.clone();
            let torque = self.held_torque(k);
            held.extend(
                (0..mode.len()).filter(|t| mode[*t] == 1 && *t > 0 && mode[t - 1] == 1).map(|t| torque[t]),
            );
        }
        let many = held.len() > 25;
        let release = if many { quantile(held, 0.99) / level } else { 1.0 };
        if release < RELEASE[0] {
            return;
        }
        let kept = self.signs();
        for r in &mut self.runs {
            let mut near: Vec<bool> = r.signs.unknown.iter().map(|x| *x > 0.0).collect();
            for _ in 0..2 {
                let w = near.clone();
                let n = w.len();
                near = (0..n).map(|t| w[t] || t > 0 && w[t - 1] || t + 1 < n && w[t + 1]).collect();
            }
            let least = (level * release.min(RELEASE[1])).powi(2);
            let unknown = near.iter().zip(&r.signs.unknown);
            let unknown = unknown.map(|(w, x)| if *w { x.max(least) } else { 0.0 }).collect();
            r.signs = Rc::new(DrySigns { unknown, ..DrySigns::clone(&r.signs) });
        }
        let base = self.packed(&[]);
        let q = self.q.clone();
        if self.best_of(&base, &[q]).found.log > self.evidence + GAIN[1] {
            self.release = release;
            (self.q, self.evidence) = self.null(&self.q.clone(), 1, false);
            self.smooth(&self.q.clone(), None);
        } else {
            self.restore_signs(&kept);
        }
    }

    /// Size of the torque on the driven coordinate by input and elastic elements, by node, N.m.
    fn held_torque(&self, recording: usize) -> Vec<f64> {
        let r = &self.runs[recording];
        let size = self.plant.states() + self.coordinates();
        let drive = self.drive_torque(recording);
        let Some(force) = self.plant.input_forces().first() else { return vec![0.0; r.nodes] };
        let theta = self.parameters_in(recording);
        let torque = |t: usize| {
            let x = &r.states[size * t..size * (t + 1)];
            let along = |row: &[f64]| row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
            let elastic = self.plant.elements().iter().map(|e| {
                let [k, d] = self.plant.elastic(&theta, e);
                e.weights[force.coordinate] * (k * along(&e.deflection) + d * along(&e.rate))
            });
            (drive[t] + elastic.sum::<f64>()).abs()
        };
        (0..r.nodes).map(torque).collect()
    }
}

/// Nodes near an event of dry friction with an innovation that is too large.
fn odd_nodes(
    (e, stride): (&[f64], usize),
    amplitudes: &[f64],
    signs: &DrySigns,
    channels: usize,
) -> Vec<usize> {
    let n = signs.sign.len();
    let s = &signs.sign;
    let event = |t: usize| t + 1 < n && s[t + 1] != s[t] || s[t] == 0.0 && t > 0 && s[t - 1] != 0.0;
    let near = |t: usize| (t.saturating_sub(3)..(t + 4).min(n)).any(event);
    let left = |k: usize| {
        let x = &e[stride * k..stride * (k + 1)];
        x[0] - x[1..].iter().zip(amplitudes).map(|(x, a)| x * a).sum::<f64>()
    };
    let odd = |t: &usize| (channels * t..channels * (t + 1)).any(|k| left(k).powi(2) > ODD * ODD);
    (0..n).filter(odd).filter(|t| near(*t)).collect()
}
