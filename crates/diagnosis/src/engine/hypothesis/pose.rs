//! A hypothesis put into numbers: its unknowns, and where to look from.

use super::*;
use crate::engine::push::PushPart;
use crate::engine::unknown::WRONG;

/// A point to look from: values of the hypothesis' unknowns.
pub type TrialValues = Vec<f64>;

/// A hypothesis put into numbers.
#[derive(Clone, Debug, Default)]
pub struct PosedHypothesis {
    /// Its unknowns.
    pub unknowns: Vec<BalanceUnknown>,
    /// Index of each amplitude among the unknowns, with its neutral value.
    pub amplitudes: Vec<(usize, f64)>,
    /// Where to look from; amplitudes at a size that shows.
    pub looks: Vec<TrialValues>,
    /// Shapes that grow with the first amplitude.
    pub follow: Vec<usize>,
    /// The order of a shaft with which it repeats.
    pub order: Option<usize>,
    /// First states of its own, of one recording each.
    pub initial: Vec<usize>,
}

/// What happens within this share of the time between two readings is instantaneous in the readings (and stiff).
const AT_ONCE: f64 = 0.1;
/// How long the edge of a push may be, in units of its typical one.
const GENTLE: f64 = 20.0;

impl Hypothesis {
    /// In numbers, for a model that has its effect. `names` are the model's parameters.
    pub fn pose(
        &self,
        p: &PreparedCase,
        sizes: &TypicalSizes,
        names: &BTreeMap<String, usize>,
    ) -> PosedHypothesis {
        match self.claim {
            HypothesisClaim::Parameter(index) => {
                let doubt =
                    if p.subject.plant == effect::PlantKind::Joint && index == joint::parameter::GEAR_RATIO {
                        0.02
                    } else {
                        WRONG
                    };
                let u = parameter(p, index, doubt);
                PosedHypothesis { unknowns: vec![u], ..PosedHypothesis::default() }
            }
            HypothesisClaim::Offset(output) => {
                let s = sizes.range(output).max(1e-12) * 0.02;
                let u = amplitude(
                    "offset",
                    "rad",
                    BalanceTarget::Offset(output),
                    s,
                    (f64::NEG_INFINITY, f64::INFINITY),
                );
                PosedHypothesis {
                    unknowns: vec![u],
                    amplitudes: vec![(0, 0.0)],
                    looks: vec![vec![s]],
                    ..PosedHypothesis::default()
                }
            }
            HypothesisClaim::Effect(choice) if self.shifted => self.pose_shift(p, choice),
            HypothesisClaim::Effect(choice) => self.pose_effect(p, sizes, names, choice),
        }
    }

    /// A name with the joint or element.
    pub(crate) fn here(&self, name: &str) -> String {
        if self.per_joint { format!("{name}[{}]", self.site + 1) } else { name.to_owned() }
    }

    /// Lag and dead time of an actuator are looked at together: either does much the same.
    fn pose_shift(&self, p: &PreparedCase, choice: EffectChoice) -> PosedHypothesis {
        let targets = if choice.scope() == Scope::Channel {
            let place = choice.place().map_or("", |p| p.name);
            let output = elements_of(p, place).into_iter().find(|e| e.0 == self.site).map_or(0, |e| e.1);
            vec![BalanceTarget::SensorDelay(output)]
        } else {
            let input = p.subject.motor_input(self.site);
            vec![BalanceTarget::ActuatorLag(input), BalanceTarget::ActuatorDeadTime(input)]
        };
        let mut posed = PosedHypothesis::default();
        for (k, (s, target)) in choice.parameters().iter().zip(targets).enumerate() {
            let (search, size) = (s.search_in(p.subject.plant), s.scale.factor);
            let bounds = (s.min, s.max.min(search.most));
            posed.unknowns.push(amplitude(
                &self.here(&choice.variable(s.name)),
                s.unit,
                target,
                size,
                bounds,
            ));
            posed.amplitudes.push((k, s.neutral));
            posed.looks.resize(search.looks.len(), vec![]);
            posed.looks.iter_mut().zip(search.looks).for_each(|(look, l)| look.push(l * size));
        }
        posed
    }

    fn pose_effect(
        &self,
        p: &PreparedCase,
        sizes: &TypicalSizes,
        names: &BTreeMap<String, usize>,
        choice: EffectChoice,
    ) -> PosedHypothesis {
        let spec = choice.spec();
        let measure = |m: Measure| match m {
            Measure::Reading => {
                let place = choice.place().map_or("", |p| p.name);
                elements_of(p, place).into_iter().find(|e| e.0 == self.site).map_or(1.0, |e| sizes.range(e.1))
            }
            m => sizes.get(self.site, m),
        };
        // When a push comes is looked for elsewhere.
        let looks = if self.is_push() { vec![] } else { vec![vec![]] };
        let mut posed = PosedHypothesis { looks, ..PosedHypothesis::default() };
        let find = |name: &str| {
            names.get(name).or_else(|| names.get(&format!("{name}[{}]", self.site + 1))).copied()
        };
        for b in spec.borrows {
            let name = match p.subject.plant {
                effect::PlantKind::Joint => b.joint_name,
                effect::PlantKind::Arm | effect::PlantKind::Space => b.arm_name,
            };
            let Some(at) = find(name) else { continue };
            let name = &*self.here(name);
            // What the plant has already is among its own unknowns.
            let structure = matches!(b.neutral, effect::Neutral::Structure);
            let own = p.subject.parameters(&p.model).iter().position(|n| n.name == name);
            let known = |i: usize| own_parameters(p).contains(&i) || b.known && p.nominal[i] > 0.0;
            if structure && own.is_some_and(known) {
                continue;
            }
            let size = b.scale.value(measure);
            match b.neutral {
                effect::Neutral::Of(base) => {
                    let Some(base) = find(base) else { continue };
                    let target = BalanceTarget::Above { at, base };
                    posed.amplitude(
                        amplitude(name, b.unit, target, size, (0.0, f64::INFINITY)),
                        0.0,
                        b.looks,
                    );
                }
                effect::Neutral::Value(v) => {
                    let u = amplitude(name, b.unit, BalanceTarget::Parameter(at), size, (v, f64::INFINITY));
                    posed.amplitude(u, v, b.looks);
                }
                effect::Neutral::Structure => {
                    posed.shape(logarithmic(name, b.unit, BalanceTarget::Parameter(at), size, 3.0), b.looks);
                }
            }
        }
        let all = choice.parameters();
        let one_push = self.is_push() && self.times != Times::Several;
        for s in &all[..if one_push { all.len() / effect::PUSHES } else { all.len() }] {
            let name = choice.variable(s.name);
            let Some(at) = find(&name) else { continue };
            if s.role == ParameterRole::Initial {
                if self.times == Times::EachRun {
                    posed.begins(p, &self.here(&name), s, at, s.scale.value(measure));
                }
                continue;
            }
            let below = s.below.map_or(f64::INFINITY, |b| b.value(measure));
            let search = s.search_in(p.subject.plant);
            let s = ParameterSpec { min: s.min.max(-below), max: s.max.min(search.most), search, ..*s };
            self.pose_parameter(&mut posed, &s, &choice, &self.here(&name), at, s.scale.value(measure));
        }
        // It is there in full; its shape is estimated.
        if let Some(along) = self.along() {
            for s in along.parameters().iter().filter(|s| s.role == ParameterRole::Shape) {
                let name = self.here(&along.variable(s.name));
                let Some(at) = find(&name) else { continue };
                let least = AT_ONCE * measure(Measure::Speed) * finest(p);
                let s = ParameterSpec { min: s.min.max(least), ..*s };
                let k = posed.unknowns.len();
                self.pose_parameter(&mut posed, &s, &along, &name, at, s.scale.value(measure).max(least));
                posed.looks.iter_mut().for_each(|look| look[k] = look[k].max(least));
                posed.looks.dedup();
            }
        }
        if self.is_push() {
            self.pose_push(p, &mut posed);
        }
        if spec.resonator {
            posed.resonances(sizes.get(self.site, Measure::Mode));
        }
        posed
    }

    /// An edge of a few samples keeps derivatives by times; it may be as long as it will where all recordings determine it.
    fn pose_push(&self, p: &PreparedCase, posed: &mut PosedHypothesis) {
        let edge = 4.0 * finest(p).clamp(1e-4, 0.1);
        for u in posed.unknowns.iter_mut().filter(|u| PushPart::of(u) == PushPart::Edge) {
            (u.start, u.lower, u.prior) = (edge, edge, Some(UnknownPrior::normal(0.0, GENTLE)));
            u.upper = if self.times == Times::EachRun { edge } else { u.upper };
        }
        for u in posed.unknowns.iter_mut().filter(|u| PushPart::of(u) == PushPart::Duration) {
            u.lower = edge;
        }
        if self.times != Times::EachRun {
            return;
        }
        let one = core::mem::take(&mut posed.unknowns);
        let amplitudes = core::mem::take(&mut posed.amplitudes);
        for run in 0..p.train.len() {
            let begin = posed.unknowns.len();
            posed.amplitudes.extend(amplitudes.iter().map(|(k, n)| (begin + k, *n)));
            posed.unknowns.extend(one.iter().map(|u| BalanceUnknown { run: Some(run), ..u.clone() }));
        }
    }

    fn pose_parameter(
        &self,
        posed: &mut PosedHypothesis,
        s: &ParameterSpec,
        choice: &EffectChoice,
        name: &str,
        at: usize,
        size: f64,
    ) {
        let target = BalanceTarget::Parameter(at);
        let unit = choice.unit(s.unit);
        let looks = |usual: &'static [f64]| if s.search.looks.is_empty() { usual } else { s.search.looks };
        match s.role {
            ParameterRole::Reference => {
                // The typical size at hand is the unit of measure.
                posed.fixed(BalanceUnknown { start: size, ..logarithmic(name, unit, target, size, 1e-6) });
            }
            // `begins` has it, of each recording.
            ParameterRole::Initial => {}
            ParameterRole::Amplitude if s.neutral.is_finite() && !s.log => {
                posed.amplitude(
                    amplitude(name, unit, target, size, (s.min, s.max)),
                    s.neutral,
                    looks(&[1.0]),
                );
            }
            ParameterRole::Amplitude if s.neutral.is_infinite() => {
                let u = logarithmic(name, unit, target, size, 0.7);
                posed.shape(u, looks(&[0.6, 1.0, 1.6, 2.4]));
            }
            ParameterRole::Amplitude => {
                let u = amplitude(name, unit, target, size, (s.min, s.max));
                posed.amplitude(u, s.neutral, looks(&[1.0]));
            }
            ParameterRole::Shape if s.log => {
                let mut u = logarithmic(name, unit, target, size, s.search.doubt);
                (u.lower, u.upper) = (s.min.max(size * 1e-5), s.max.min(size * 1e5));
                if s.order {
                    let [least, most] = effect::SEARCHED_ORDERS;
                    u.prior = Some(UnknownPrior::normal(size.ln(), 1.5));
                    (u.lower, u.upper) = (s.min.max(least), most);
                    posed.order = Some(posed.unknowns.len());
                    let usual = [0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0].map(|o| o / size);
                    let orders: Vec<f64> = usual.into_iter().filter(|o| *o >= s.min).collect();
                    posed.shape(u, &orders);
                } else {
                    posed.shape(u, looks(&[0.03, 0.1, 0.3, 1.0, 4.0]));
                }
            }
            ParameterRole::Shape => {
                let angles = s.unit == "rad";
                let size = if angles { 1.0 } else { size };
                let mut u = amplitude(name, unit, target, size, (s.min, s.max));
                u.prior = Some(UnknownPrior::normal(0.0, 2.0));
                const ANGLES: &[f64] = &[
                    -core::f64::consts::FRAC_PI_2,
                    0.0,
                    core::f64::consts::FRAC_PI_2,
                    core::f64::consts::PI,
                ];
                let looks: Vec<f64> =
                    looks(if angles { ANGLES } else { &[-1.0, 0.0, 1.0] }).iter().map(|l| l * size).collect();
                posed.plain(u, &looks);
            }
        }
    }
}

/// Shortest time between two readings, s.
fn finest(p: &PreparedCase) -> f64 {
    let channels = p.train.iter().flat_map(|c| &c.run.channels);
    let steps = channels.filter_map(|c| crate::engine::coordinate::median_step(&c.t));
    steps.fold(f64::INFINITY, f64::min)
}

impl PosedHypothesis {
    /// Looks for a small inertia on a spring: resonances are narrow, so many frequencies around `mode` (rad/s).
    fn resonances(&mut self, mode: f64) {
        let find = |end: &str| self.unknowns.iter().position(|u| u.stem().ends_with(end));
        let (Some(j), Some(k), Some(d)) = (find("Inertia"), find("Stiffness"), find("Damping")) else {
            return;
        };
        let Scale::Linear(size) = self.unknowns[j].scale else { return };
        self.follow = vec![k, d];
        let inertia = 0.04 * size;
        let base: Vec<f64> = self.unknowns.iter().map(|u| u.start).collect();
        self.looks = (0..18)
            .map(|i| {
                let w = mode * 0.1 * 1.22f64.powi(i);
                let mut look = base.clone();
                (look[j], look[k], look[d]) = (inertia, inertia * w * w, 2.0 * 0.03 * inertia * w);
                look
            })
            .collect();
    }
    fn amplitude(&mut self, u: BalanceUnknown, neutral: f64, sizes: &[f64]) {
        let Scale::Linear(s) = u.scale else { return };
        self.amplitudes.push((self.unknowns.len(), neutral));
        self.unknowns.push(u);
        self.spread(&sizes.iter().map(|f| neutral + f * s).collect::<Vec<_>>());
    }
    fn shape(&mut self, u: BalanceUnknown, factors: &[f64]) {
        let start = u.start;
        self.unknowns.push(u);
        self.spread(&factors.iter().map(|f| f * start).collect::<Vec<_>>());
    }
    fn plain(&mut self, u: BalanceUnknown, values: &[f64]) {
        self.unknowns.push(u);
        self.spread(values);
    }
    /// A first state of each recording's own. They are thought to follow each other in the order in which they are named,
    /// within as many typical sizes as there are.
    fn begins(&mut self, p: &PreparedCase, name: &str, s: &ParameterSpec, at: usize, size: f64) {
        let mut passed = 0.0;
        for (run, compared) in p.train.iter().enumerate() {
            let mut u = amplitude(name, s.unit, BalanceTarget::Parameter(at), size, (s.min, s.max));
            (u.run, u.start) = (Some(run), passed);
            u.prior = Some(UnknownPrior::normal(passed / size, p.train.len() as f64));
            self.initial.push(self.unknowns.len());
            self.unknowns.push(u);
            self.spread(&[passed]);
            let t = compared.run.channels.iter().filter_map(|c| c.t.last());
            passed += t.fold(compared.run.start, |a, t| a.max(*t)) - compared.run.start;
        }
    }
    /// Not searched: its bounds hold it.
    fn fixed(&mut self, u: BalanceUnknown) {
        let start = u.start;
        self.unknowns.push(BalanceUnknown { lower: start, upper: start, ..u });
        self.spread(&[start]);
    }
    fn spread(&mut self, values: &[f64]) {
        let looks = core::mem::take(&mut self.looks);
        for look in looks {
            for v in values {
                let mut look = look.clone();
                look.push(*v);
                self.looks.push(look);
            }
        }
    }
}

fn amplitude(name: &str, unit: &str, target: BalanceTarget, size: f64, bounds: (f64, f64)) -> BalanceUnknown {
    BalanceUnknown {
        name: name.to_owned(),
        unit: unit.to_owned(),
        target,
        run: None,
        start: 0.0,
        scale: Scale::Linear(size),
        lower: bounds.0,
        upper: bounds.1,
        prior: Some(UnknownPrior::heavy(0.0, 1.0)),
    }
}
fn logarithmic(name: &str, unit: &str, target: BalanceTarget, size: f64, doubt: f64) -> BalanceUnknown {
    BalanceUnknown {
        name: name.to_owned(),
        unit: unit.to_owned(),
        target,
        run: None,
        start: size,
        scale: Scale::Log,
        lower: size * 1e-4,
        upper: size * 1e4,
        prior: Some(UnknownPrior::normal(size.ln(), doubt)),
    }
}
