//! A cause in numbers: its unknowns, and points to look at.

use trueup_estimation::evidence::Prior;
use trueup_estimation::intake::Raw;
use trueup_estimation::unknown::{ParametricJoint, Scale, Target, Unknown};
use trueup_models::compiled::Compiled;
use trueup_models::effect::{
    EffectError, Measure, Neutral, PUSHES, ParameterSpec, Placed, Plant, Role, SEARCHED_ORDERS, Scope,
};
use trueup_models::joint::{TwoMassJoint, input, parameter as q};

use crate::baseline::Baseline;
use crate::catalogue::Cause;
use crate::pushes::{Push, pushes};

/// An amplitude of a cause.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplitude {
    /// Which of the cause's unknowns.
    pub unknown: usize,
    /// Its coordinate where the effect vanishes; infinite where it has none.
    pub neutral: f64,
}

/// A model with causes beside what the baseline one has unknown.
#[derive(Clone, Debug)]
pub struct Parametrized {
    /// The baseline model's unknowns first, then the cause's.
    pub parametric: ParametricJoint,
    /// How many of the unknowns are the baseline model's.
    pub own: usize,
    /// Of the cause, numbered from the first of its own unknowns.
    pub amplitudes: Vec<Amplitude>,
    /// Points to look at: coordinates of the cause's unknowns, amplitudes at a size that shows.
    pub points: Vec<Vec<f64>>,
    /// All of its unknowns grow together: a resonator whose frequency and damping ratio stay.
    pub whole: bool,
}

/// The baseline with a cause built in, the cause being neutral; its unknowns are the same, wherever their parameters stand.
fn base_with(baseline: &Baseline, cause: &Cause) -> Result<ParametricJoint, EffectError> {
    let base = &baseline.parametric;
    let mut ids: Vec<String> = base.joint.effects().iter().map(|e| e.choice.id()).collect();
    if cause.built() {
        ids.push(cause.choice.id());
    }
    let joint = Compiled::new(TwoMassJoint::new(base.joint.flexible(), &ids)?);
    let mut p = base.p[..q::COUNT].to_vec();
    let mut moved: Vec<(usize, usize, usize)> = Vec::new();
    for e in joint.effects().iter() {
        let parameters = e.choice.parameters();
        let before = base.joint.effects().iter().find(|b| b.choice == e.choice);
        if let Some(b) = before {
            moved.push((b.begin.parameters, parameters.len(), e.begin.parameters));
            p.extend(&base.p[b.begin.parameters..][..parameters.len()]);
        } else {
            p.extend(parameters.iter().map(|s| match s.role {
                Role::Amplitude => s.neutral,
                _ => s.joint_start,
            }));
        }
    }
    let to = |i: usize| {
        let of = moved.iter().find(|(from, count, _)| (*from..from + count).contains(&i));
        of.map_or(i, |(from, _, to)| i - from + to)
    };
    let mut unknowns = base.unknowns.clone();
    for u in &mut unknowns {
        u.target = match u.target {
            Target::Parameter(i) => Target::Parameter(to(i)),
            Target::Above { at, base } => Target::Above { at: to(at), base: to(base) },
            other => other,
        };
    }
    Ok(ParametricJoint { joint, p, ties: base.ties.clone(), unknowns })
}

/// An unknown with the coordinates to look at.
struct Asked {
    unknown: Unknown,
    points: Vec<f64>,
    neutral: Option<f64>,
}

/// Multiples of a size where a form may not be linear in its amplitude.
const SIZES: [f64; 9] = [0.1, 0.15, 0.23, 0.35, 0.55, 0.85, 1.3, 2.0, 3.0];
/// Limits, in units of the largest torque.
const LIMITS: [f64; 5] = [0.4, 0.65, 0.85, 0.93, 0.98];
const SHAPES: &[f64] = &[0.03, 0.1, 0.3, 1.0, 4.0];
const ORDERS: &[f64] = &[0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 7.0, 8.0, 12.0];
/// Natural frequencies of a link, in units of the joint's: the least, how far apart, how many; and its damping ratio and share
/// of the load's inertia.
const RESONANCES: (f64, f64, i32) = (0.12, 1.1, 38);
const RESONATOR: [f64; 2] = [0.04, 0.03];
/// Length of a push's edges, s: long enough to keep derivatives by its times. It is held.
const EDGE: f64 = 0.02;

impl Cause {
    /// In numbers, beside what is unknown of the baseline model.
    ///
    /// # Errors
    /// The joint cannot have it.
    pub fn parametrize(&self, baseline: &Baseline) -> Result<Parametrized, EffectError> {
        let base = base_with(baseline, self)?;
        let mut p = base.p.clone();
        let joint = base.joint.clone();
        let mut asked = Vec::new();
        let of = |e: &&Placed| e.choice == self.choice;
        let first = joint.effects().iter().find(of).map_or(q::COUNT, |e| e.begin.parameters);
        if self.built() {
            self.borrowed(baseline, &mut asked);
            self.parameters(baseline, first, &mut p, &mut asked);
        } else {
            self.shifts(baseline, &mut asked);
        }
        let pushes =
            if self.is_push() { self.pushes(baseline, first, &mut p, &mut asked) } else { Vec::new() };
        let mut points = vec![Vec::new()];
        for a in &asked {
            let with =
                |point: &Vec<f64>| a.points.iter().map(|l| [&point[..], &[*l]].concat()).collect::<Vec<_>>();
            points = points.iter().flat_map(with).collect();
        }
        if self.is_push() {
            points = pushes;
        }
        if self.choice.spec().resonator {
            points = self.resonances(baseline, &asked);
        }
        if !self.built() && asked.len() > 1 {
            points = vec![vec![1.0, 0.0], vec![0.0, 1.0], vec![0.5, 0.5]];
        }
        let amplitude = |(unknown, a): (usize, &Asked)| Some(Amplitude { unknown, neutral: a.neutral? });
        let amplitudes = asked.iter().enumerate().filter_map(amplitude).collect();
        let own = base.unknowns.len();
        let unknowns = base.unknowns.iter().cloned().chain(asked.into_iter().map(|a| a.unknown)).collect();
        let parametric = ParametricJoint { joint, p, ties: self.ties(&base), unknowns };
        Ok(Parametrized { parametric, own, amplitudes, points, whole: self.choice.spec().resonator })
    }

    /// Static friction no longer follows Coulomb's where it is the cause.
    fn ties(&self, base: &ParametricJoint) -> Vec<(usize, usize)> {
        let sets = |which: usize| {
            self.choice
                .spec()
                .borrows
                .iter()
                .any(|b| q::NAMES[which].0 == b.joint_name && matches!(b.neutral, Neutral::Of(_)))
        };
        let mut ties: Vec<_> = base.ties.iter().copied().filter(|t| !sets(t.0)).collect();
        let coulomb = (q::STATIC_FRICTION, q::COULOMB_FRICTION);
        let levels = self.choice.spec().borrows.iter().any(|b| b.joint_name == "coulombFriction");
        if levels && !ties.contains(&coulomb) {
            ties.push(coulomb);
        }
        ties
    }

    fn borrowed(&self, baseline: &Baseline, asked: &mut Vec<Asked>) {
        let index = |name: &str| q::NAMES.iter().position(|n| n.0 == name);
        for b in self.choice.spec().borrows {
            let Some(at) = index(b.joint_name) else { continue };
            if b.known {
                continue;
            }
            let size = b.scale.value(|m| baseline.sizes.get(m, self.output));
            let linear = |target| Asked {
                unknown: unknown(b.joint_name, target, Scale::Linear(size), [0.0, f64::INFINITY], [0.0, 1.0]),
                points: b.looks.to_vec(),
                neutral: Some(0.0),
            };
            asked.push(match b.neutral {
                Neutral::Of(base) => {
                    let Some(base) = index(base) else { continue };
                    linear(Target::Above { at, base })
                }
                Neutral::Value(_) => linear(Target::Parameter(at)),
                Neutral::Structure => {
                    let bounds = [(size * 1e-4).ln(), (size * 1e4).ln()];
                    let target = Target::Parameter(at);
                    Asked {
                        unknown: unknown(b.joint_name, target, Scale::Log, bounds, [size.ln(), 3.0]),
                        points: b.looks.iter().map(|l| (l * size).ln()).collect(),
                        neutral: None,
                    }
                }
            });
        }
    }

    fn parameters(&self, baseline: &Baseline, first: usize, p: &mut [f64], asked: &mut Vec<Asked>) {
        let all = self.choice.parameters();
        let count = if self.is_push() { 0 } else { all.len() };
        for (k, s) in all.iter().enumerate().take(count) {
            let size = s.scale.value(|m| baseline.sizes.get(m, self.output));
            let at = first + k;
            let name = self.choice.variable(s.name);
            match s.role {
                // The typical size at hand is the unit of measure.
                Role::Reference => p[at] = size,
                Role::Amplitude if s.neutral.is_infinite() => {
                    let peak = baseline.sizes.crest() * size;
                    let points = LIMITS.iter().map(|l| (l * peak).ln()).collect();
                    let bounds = [(s.min.max(size * 1e-3)).ln(), (size * 1e3).ln()];
                    let target = Target::Parameter(at);
                    let unknown = unknown(&name, target, Scale::Log, bounds, [size.ln(), 1.0]);
                    asked.push(Asked { unknown, points, neutral: Some(f64::INFINITY) });
                }
                Role::Amplitude => {
                    let below =
                        s.below.map_or(f64::INFINITY, |b| b.value(|m| baseline.sizes.get(m, self.output)));
                    let bounds = [s.min.max(-below) / size, s.max.min(s.search.most) / size];
                    let target = Target::Parameter(at);
                    let neutral = s.neutral / size;
                    let unknown = unknown(&name, target, Scale::Linear(size), bounds, [neutral, 1.0]);
                    let usual = if s.search.looks.is_empty() { &[1.0] } else { s.search.looks };
                    let points = usual.iter().map(|l| neutral + l).collect();
                    asked.push(Asked { unknown, points, neutral: Some(neutral) });
                }
                Role::Shape => asked.push(shape(s, &name, at, size)),
                // Each recording begins anew.
                Role::Initial => {}
            }
        }
    }

    /// Lag and dead time of an actuator, or delay of a sensor.
    fn shifts(&self, baseline: &Baseline, asked: &mut Vec<Asked>) {
        let latest = baseline.raw.iter().map(Raw::latest).fold(f64::INFINITY, f64::min);
        let targets = match (self.choice.scope(), self.output) {
            (Scope::Channel, Some(output)) => vec![Target::SensorDelay(output)],
            _ => vec![Target::InputLag(input::MOTOR_CURRENT), Target::InputDelay(input::MOTOR_CURRENT)],
        };
        for (s, target) in self.choice.parameters().iter().zip(targets) {
            let (size, search) = (s.scale.factor, s.search_in(Plant::Joint));
            let bounds = [s.min / size, s.max.min(search.most).min(latest) / size];
            let name = self.choice.variable(s.name);
            let unknown = unknown(&name, target, Scale::Linear(size), bounds, [0.0, 1.0]);
            asked.push(Asked { unknown, points: vec![1.0], neutral: Some(0.0) });
        }
    }

    /// Unknowns of all pushes, and points with the first, the first two, all of those that would be likely, length by length.
    fn pushes(
        &self,
        baseline: &Baseline,
        first: usize,
        p: &mut [f64],
        asked: &mut Vec<Asked>,
    ) -> Vec<Vec<f64>> {
        let place = usize::from(self.choice.component() == "load");
        let found = pushes(baseline, place, PUSHES);
        let all = self.choice.parameters();
        let each = all.len() / PUSHES;
        let duration = baseline.sizes.get(Measure::Duration, None);
        let size = |k: usize| all[k].scale.value(|m| baseline.sizes.get(m, None)).max(1e-12);
        for (k, s) in all.iter().enumerate() {
            let name = self.choice.variable(s.name);
            let target = Target::Parameter(first + k);
            let (scale, bounds, prior, neutral) = match k % each {
                0 => (Scale::Linear(size(k)), [f64::NEG_INFINITY, f64::INFINITY], [0.0, 1.0], Some(0.0)),
                1 => (Scale::Linear(1.0), [0.0, duration], [0.5 * duration, duration], None),
                2 => (Scale::Log, [1e-2f64.ln(), duration.ln()], [0.3f64.ln(), 1.0], None),
                _ => {
                    p[first + k] = EDGE;
                    continue;
                }
            };
            asked.push(Asked {
                unknown: unknown(&name, target, scale, bounds, prior),
                points: Vec::new(),
                neutral,
            });
        }
        let point = |found: &[Push]| {
            let one = |n: usize| match found.get(n) {
                Some(p) => [p.torque.signum(), p.start, p.duration.ln()],
                None => [0.0, 0.5 * duration, 0.3f64.ln()],
            };
            (0..PUSHES).flat_map(one).collect()
        };
        found.iter().flat_map(|of| (1..=of.len()).map(|count| point(&of[..count]))).collect()
    }

    /// A small inertia on a spring: resonances are narrow, so many frequencies.
    fn resonances(&self, baseline: &Baseline, asked: &[Asked]) -> Vec<Vec<f64>> {
        let [share, ratio] = RESONATOR;
        let inertia = share * baseline.sizes.get(Measure::LoadInertia, None);
        let mode = baseline.sizes.get(Measure::Mode, None);
        let (least, apart, count) = RESONANCES;
        let point = |k: i32| {
            let w = least * apart.powi(k) * mode;
            let values = [inertia, inertia * w * w, 2.0 * ratio * inertia * w];
            asked.iter().zip(values).map(|(a, v)| a.unknown.scale.coordinate(v)).collect()
        };
        (0..count).map(point).collect()
    }
}

fn shape(s: &ParameterSpec, name: &str, at: usize, size: f64) -> Asked {
    let target = Target::Parameter(at);
    let chosen = |usual: &'static [f64]| if s.search.looks.is_empty() { usual } else { s.search.looks };
    if s.log {
        let order = s.order;
        let bounds = if order {
            let [least, most] = SEARCHED_ORDERS;
            [s.min.max(least).ln(), most.ln()]
        } else {
            [s.min.max(size * 1e-5).ln(), s.max.min(size * 1e5).ln()]
        };
        let points = if order {
            ORDERS.iter().map(|o| o.ln()).filter(|o| *o >= bounds[0]).collect()
        } else {
            chosen(SHAPES).iter().map(|l| (l * size).ln().clamp(bounds[0], bounds[1])).collect()
        };
        let doubt = if order { 1.5 } else { s.search.doubt };
        return Asked {
            unknown: unknown(name, target, Scale::Log, bounds, [size.ln(), doubt]),
            points,
            neutral: None,
        };
    }
    let angle = s.unit == "rad";
    let size = if angle { 1.0 } else { size };
    const ANGLES: &[f64] =
        &[-core::f64::consts::FRAC_PI_2, 0.0, core::f64::consts::FRAC_PI_2, core::f64::consts::PI];
    let points = chosen(if angle { ANGLES } else { &[-1.0, 0.0, 1.0] }).to_vec();
    let bounds = [s.min / size, s.max / size];
    Asked { unknown: unknown(name, target, Scale::Linear(size), bounds, [0.0, 2.0]), points, neutral: None }
}

fn unknown(name: &str, target: Target, scale: Scale, [lower, upper]: [f64; 2], prior: [f64; 2]) -> Unknown {
    let prior = Prior { mean: prior[0], deviation: prior[1] };
    Unknown { name: name.to_owned(), target, scale, lower, upper, prior }
}

impl Parametrized {
    /// What is unknown of the cause.
    pub fn own_unknowns(&self) -> &[Unknown] {
        &self.parametric.unknowns[self.own..]
    }
    /// The points with each amplitude at several multiples of its size, for forms that are not linear in it.
    pub fn sized(&self) -> Vec<Vec<f64>> {
        if self.amplitudes.iter().all(|a| a.neutral.is_infinite()) {
            return self.points.clone();
        }
        let sizes =
            |point: &Vec<f64>| SIZES.map(|s| self.grown(point, &vec![s; self.amplitudes.len()])).into_iter();
        self.points.iter().flat_map(sizes).collect()
    }
    /// A point with each amplitude so many times as large; those that are neutral nowhere stay.
    pub(crate) fn grown(&self, point: &[f64], factors: &[f64]) -> Vec<f64> {
        let mut at = point.to_vec();
        if let Some(factor) = factors.first().filter(|_| self.whole) {
            for (t, u) in at.iter_mut().zip(self.own_unknowns()) {
                *t = u.scale.coordinate(u.scale.value(*t).0 * factor).clamp(u.lower, u.upper);
            }
            return at;
        }
        for (a, factor) in self.amplitudes.iter().zip(factors).filter(|(a, _)| a.neutral.is_finite()) {
            let u = &self.own_unknowns()[a.unknown];
            at[a.unknown] = (a.neutral + factor * (point[a.unknown] - a.neutral)).clamp(u.lower, u.upper);
        }
        at
    }
}
