//! A hypothesis put into numbers: its unknowns.

use super::*;

/// A hypothesis put into numbers.
#[derive(Clone, Debug, Default)]
pub struct PosedHypothesis {
    /// Its unknowns.
    pub unknowns: Vec<BalanceUnknown>,
    /// The order of a shaft with which it repeats.
    pub order: Option<usize>,
    /// First states of its own, of one recording each.
    pub initial: Vec<usize>,
}

/// What happens within this share of the time between two readings is instantaneous in the readings (and stiff).
const AT_ONCE: f64 = 0.1;
/// The quantity of an impulse that an unknown gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PushPart {
    Start,
    Duration,
    Edge,
    /// Its torque or a component of its force.
    Size,
}

impl PushPart {
    fn of(u: &BalanceUnknown) -> Self {
        // As `external-force` names them, whatever its place and the number of the push.
        match u.stem() {
            name if name.ends_with("Start") => Self::Start,
            name if name.ends_with("Duration") => Self::Duration,
            name if name.ends_with("Edge") => Self::Edge,
            _ => Self::Size,
        }
    }
}

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
        match self.shifted {
            true => self.pose_shift(p, self.choice),
            false => self.pose_effect(p, sizes, names, self.choice),
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
        for (s, target) in choice.parameters().iter().zip(targets) {
            let (search, size) = (s.search_in(p.subject.plant), s.scale.factor);
            let bounds = (s.min, s.max.min(search.most));
            posed.unknowns.push(amplitude(
                &self.here(&choice.variable(s.name)),
                s.unit,
                target,
                size,
                bounds,
            ));
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
        let mut posed = PosedHypothesis::default();
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
                    posed.unknowns.push(amplitude(name, b.unit, target, size, (0.0, f64::INFINITY)));
                }
                effect::Neutral::Value(v) => {
                    let u = amplitude(name, b.unit, BalanceTarget::Parameter(at), size, (v, f64::INFINITY));
                    posed.unknowns.push(u);
                }
                effect::Neutral::Structure => {
                    let target = BalanceTarget::Parameter(at);
                    posed.unknowns.push(logarithmic(name, b.unit, target, size, 3.0));
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
                self.pose_parameter(&mut posed, &s, &along, &name, at, s.scale.value(measure).max(least));
            }
        }
        if self.is_push() {
            self.pose_push(p, &mut posed);
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
        for run in 0..p.train.len() {
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
        let bounded = || amplitude(name, unit, target, size, (s.min, s.max));
        match s.role {
            ParameterRole::Reference => {
                // The typical size at hand is the unit of measure; its bounds hold it.
                let u = BalanceUnknown { start: size, ..logarithmic(name, unit, target, size, 1e-6) };
                posed.unknowns.push(BalanceUnknown { lower: u.start, upper: u.start, ..u });
            }
            // `begins` has it, of each recording.
            ParameterRole::Initial => {}
            ParameterRole::Amplitude if s.neutral.is_infinite() => {
                posed.unknowns.push(logarithmic(name, unit, target, size, 0.7));
            }
            ParameterRole::Amplitude => posed.unknowns.push(bounded()),
            ParameterRole::Shape if s.log => {
                let mut u = logarithmic(name, unit, target, size, s.search.doubt);
                (u.lower, u.upper) = (s.min.max(size * 1e-5), s.max.min(size * 1e5));
                if s.order {
                    let [least, most] = effect::SEARCHED_ORDERS;
                    u.prior = Some(UnknownPrior::normal(size.ln(), 1.5));
                    (u.lower, u.upper) = (s.min.max(least), most);
                    posed.order = Some(posed.unknowns.len());
                }
                posed.unknowns.push(u);
            }
            ParameterRole::Shape => {
                let size = if s.unit == "rad" { 1.0 } else { size };
                let mut u = amplitude(name, unit, target, size, (s.min, s.max));
                u.prior = Some(UnknownPrior::normal(0.0, 2.0));
                posed.unknowns.push(u);
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
            let t = compared.run.channels.iter().filter_map(|c| c.t.last());
            passed += t.fold(compared.run.start, |a, t| a.max(*t)) - compared.run.start;
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
