//! The effects packed into one plant, and where their values are in the plant's vectors.

use super::{EffectChoice, EffectError, EffectKind, Local, ParameterRole, PlantKind, Scope, Spec, channel};
use crate::drive::{BaseMotion, BaseWrench, DriveTrain, FlyerBase, Spring};
use crate::friction::Levels;
use crate::space::spatial::SpatialWrench;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, ModelSizes};

/// One effect in a plant: where its values begin.
#[derive(Clone, Copy, Debug)]
pub struct PlacedEffect {
    /// Which effect, and where it acts.
    pub choice: EffectChoice,
    /// How many sites it has (joints, elements of an output, or 1).
    pub sites: usize,
    /// Begin of its values in each of the plant's vectors.
    pub begin: ModelSizes,
    /// First element of the output that a sensor effect acts on.
    pub channel: usize,
    /// It acts between an output and its reading.
    sensor: bool,
}

impl PlacedEffect {
    /// The specification.
    pub fn spec(&self) -> &'static Spec {
        self.choice.spec()
    }
    fn kind(&self) -> EffectKind {
        self.choice.kind
    }
    fn local<'a, T: Scalar>(&self, at: &At<'a, T>, site: usize) -> Local<'a, T> {
        let modes = at.modes.get(self.begin.modes..).unwrap_or_default();
        self.local_of(&at.p[self.begin.parameters..], &at.x[self.begin.states..], modes, site)
            .with_inputs(at.u.get(self.begin.inputs..).unwrap_or_default())
    }
    fn local_of<'a, T: Scalar>(&self, p: &'a [T], x: &'a [T], modes: &'a [i32], site: usize) -> Local<'a, T> {
        Local::new(p, x, modes, site, self.sites).in_place(self.choice.place)
    }
    /// It acts on joint `joint` (one that occurs once: with the first).
    fn acts_at(&self, joint: usize) -> bool {
        joint < self.sites && !self.sensor
    }
    /// It acts between an output and its reading.
    pub fn is_sensor(&self) -> bool {
        self.sensor
    }
}

/// The effects of one plant, in the order in which they act.
#[derive(Clone, Debug, Default)]
pub struct EffectSet {
    placed: Vec<PlacedEffect>,
    friction: bool,
    under_load: bool,
    strained: bool,
    moving: bool,
    sensed: bool,
}

/// Why a reading is not there.
const NO_OUTPUT: &str =
    "this structure does not have that output; leave the effect out, or give the robot a tip";

/// Most states, outputs, modes or indicators of one effect at one site.
const MOST: usize = 8;

impl EffectSet {
    /// No effects.
    pub const fn none() -> Self {
        Self {
            placed: Vec::new(),
            friction: false,
            under_load: false,
            strained: false,
            moving: false,
            sensed: false,
        }
    }
    /// The effects of those ids in `plant` with `joints` joints; their values are laid behind `sizes`, which
    /// grows by them.
    pub fn place<S: AsRef<str>>(
        ids: &[S],
        plant: PlantKind,
        joints: usize,
        sizes: &mut ModelSizes,
    ) -> Result<Self, EffectError> {
        Self::place_with(ids, plant, joints, |channel| channel::span(channel, plant, joints), sizes)
    }
    /// The same where `span` gives first element and number of elements of an output that a sensor may act on.
    pub fn place_with<S: AsRef<str>>(
        ids: &[S],
        plant: PlantKind,
        joints: usize,
        span: impl Fn(&str) -> Option<(usize, usize)>,
        sizes: &mut ModelSizes,
    ) -> Result<Self, EffectError> {
        let mut asked = Vec::new();
        for id in ids {
            let choice = EffectChoice::parse(id.as_ref(), plant)?;
            if asked.contains(&choice) {
                return Err(EffectError::Twice(id.as_ref().to_owned()));
            }
            asked.push(choice);
        }
        let mut placed = Vec::new();
        for choice in EffectChoice::all(plant).filter(|c| asked.contains(c)) {
            let spec = choice.spec();
            let (channel, sites) = match choice.scope() {
                Scope::Joint => (0, joints),
                Scope::Once => (0, 1),
                Scope::Channel => {
                    let name = choice.place().map_or("", |p| p.name);
                    span(name).ok_or(EffectError::Nothing(spec.id, NO_OUTPUT))?
                }
            };
            let sensor = choice.scope() == Scope::Channel;
            placed.push(PlacedEffect { choice, sites, begin: *sizes, channel, sensor });
            sizes.parameters += choice.parameters().len() * sites;
            sizes.states += spec.states.len() * sites;
            sizes.inputs += spec.inputs.len() * sites;
            sizes.outputs += spec.outputs.len() * sites;
            sizes.modes += spec.modes * sites;
            sizes.indicators += spec.indicators * sites;
        }
        let any = |has: fn(&Spec) -> bool| placed.iter().any(|e| has(e.spec()));
        let (friction, under_load) = (any(|s| s.friction), any(|s| s.under_load));
        let strained = any(|s| s.friction && !s.states.is_empty());
        let moving = placed.iter().any(|e| !e.is_sensor() && !e.spec().states.is_empty());
        let sensed = placed.iter().any(|e| e.is_sensor() && !e.spec().states.is_empty());
        Ok(Self { placed, friction, under_load, strained, moving, sensed })
    }
    /// One after another.
    pub fn iter(&self) -> impl Iterator<Item = &PlacedEffect> {
        self.placed.iter()
    }
    /// The standard deviation of that parameter (by its index in the plant) is in its own unit: an angle to turn by has no size that a share
    /// could be of.
    pub fn absolute_doubt(&self, parameter: usize) -> bool {
        self.placed.iter().any(|e| {
            let own = parameter.checked_sub(e.begin.parameters).map(|k| k / e.sites);
            let spec = own.and_then(|k| e.choice.parameters().get(k));
            spec.is_some_and(|s| s.role == ParameterRole::Shape && s.unit == "rad" && !s.log)
        })
    }
    /// The servo that drives the joints, where there is one.
    pub fn servo(&self) -> Option<&PlacedEffect> {
        self.placed.iter().find(|e| e.spec().servo)
    }
    /// One of them needs motor friction.
    pub fn needs_friction(&self) -> bool {
        self.friction
    }
    /// One of them needs the torque that the transmission carries.
    pub fn needs_carried(&self) -> bool {
        self.under_load
    }
    /// Rates of one of them need the levels of motor friction.
    pub fn strains_by_friction(&self) -> bool {
        self.strained
    }
    /// A sensor has states: their rates need the plant's outputs.
    pub fn sensors_have_states(&self) -> bool {
        self.sensed
    }
    fn at_joint(&self, joint: usize) -> impl Iterator<Item = &PlacedEffect> {
        self.placed.iter().filter(move |e| e.acts_at(joint))
    }

    /// What the gear does to a joint's deflection.
    pub fn gear<T: Scalar>(&self, at: &At<T>, joint: usize, d: &mut DriveTrain<T>) {
        self.at_joint(joint).for_each(|e| e.kind().gear(&e.local(at, joint), d));
    }
    /// Motor torque of a joint after the amplifier.
    pub fn actuator<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>) -> T {
        self.at_joint(joint).fold(d.command, |torque, e| e.kind().actuator(&e.local(at, joint), d, torque))
    }
    /// Friction levels of a joint in direction +1 or -1, beginning with the plant's own.
    pub fn friction<T: Scalar>(
        &self,
        at: &At<T>,
        joint: usize,
        d: &DriveTrain<T>,
        direction: f64,
        own: Levels<T>,
    ) -> Levels<T> {
        let mut levels = own;
        self.at_joint(joint).for_each(|e| e.kind().friction(&e.local(at, joint), d, direction, &mut levels));
        levels
    }
    /// An effect makes dry friction at a joint.
    pub fn dry(&self, p: &[f64], joint: usize) -> bool {
        self.at_joint(joint).any(|e| e.kind().dry(&e.local_of(&p[e.begin.parameters..], &[], &[], joint)))
    }
    /// The spring of a joint.
    pub fn spring<T: Scalar>(
        &self,
        at: &At<T>,
        joint: usize,
        d: &DriveTrain<T>,
        mut spring: Spring<T>,
    ) -> Spring<T> {
        self.at_joint(joint).for_each(|e| e.kind().spring(&e.local(at, joint), d, &mut spring));
        spring
    }
    /// Torque on the link of a joint from outside the drive train.
    pub fn link_torque<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>) -> T {
        self.at_joint(joint).fold(T::zero(), |sum, e| sum + e.kind().link_torque(&e.local(at, joint), d))
    }
    /// Torque between the link of a joint and the body that carries it.
    pub fn joint_torque<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>) -> T {
        self.at_joint(joint).fold(T::zero(), |sum, e| sum + e.kind().joint_torque(&e.local(at, joint), d))
    }
    /// The uniform acceleration field.
    pub fn field<T: Scalar>(&self, at: &At<T>) -> [T; 2] {
        self.placed.iter().fold([T::zero(); 2], |sum, e| {
            let a = e.kind().field(&e.local(at, 0));
            [sum[0] + a[0], sum[1] + a[1]]
        })
    }
    /// The wrench on the base.
    pub fn base<T: Scalar>(&self, at: &At<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        self.placed.iter().fold(BaseWrench::default(), |sum, e| sum.plus(e.kind().base(&e.local(at, 0), b)))
    }
    /// The wrench on the last link at its tip.
    pub fn tip<T: Scalar>(&self, at: &At<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        self.placed.iter().fold(BaseWrench::default(), |sum, e| sum.plus(e.kind().tip(&e.local(at, 0), b)))
    }
    /// The wrench on the base of a robot in space.
    pub fn space_base<T: Scalar>(&self, at: &At<T>, b: &FlyerBase<T>) -> SpatialWrench<T> {
        self.placed
            .iter()
            .fold(SpatialWrench::zero(), |sum, e| sum.plus(e.kind().space_base(&e.local(at, 0), b)))
    }
    /// The wrench on the body of its first tip, at that tip.
    pub fn space_tip<T: Scalar>(&self, at: &At<T>, b: &FlyerBase<T>) -> SpatialWrench<T> {
        self.placed
            .iter()
            .fold(SpatialWrench::zero(), |sum, e| sum.plus(e.kind().space_tip(&e.local(at, 0), b)))
    }
    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }
    /// Turns the plant's outputs into what the sensors show.
    pub fn sense<T: Scalar>(&self, at: &At<T>, y: &mut [T]) {
        for e in self.placed.iter().filter(|e| e.is_sensor()) {
            for (site, y) in y[e.channel..][..e.sites].iter_mut().enumerate() {
                *y = e.kind().sensor(&e.local(at, site), at.t, *y);
            }
        }
    }
    /// Initial states of the sensors from the plant's outputs `y`, which become what the sensors show.
    pub fn sensor_start<T: Scalar>(&self, p: &[T], y: &mut [T], x: &mut [T]) {
        for e in self.placed.iter().filter(|e| e.is_sensor()) {
            for site in 0..e.sites {
                let reading = y[e.channel + site];
                let mut own = [T::zero(); MOST];
                let l = e.local_of(&p[e.begin.parameters..], &[], &[], site);
                e.kind().sensor_start(&l, reading, &mut own);
                scatter(&own[..e.spec().states.len()], &mut x[e.begin.states..], site, e.sites);
                let l = e.local_of(&p[e.begin.parameters..], &x[e.begin.states..], &[], site);
                y[e.channel + site] = e.kind().sensor(&l, T::zero(), reading);
            }
        }
    }
    /// Rates of the sensors' states from the plant's outputs `y`, which become what the sensors show.
    pub fn sensor_rates<T: Scalar>(&self, at: &At<T>, y: &mut [T], dx: &mut [T]) {
        for e in self.placed.iter().filter(|e| e.is_sensor()) {
            for site in 0..e.sites {
                let (reading, l) = (y[e.channel + site], e.local(at, site));
                let mut own = [T::zero(); MOST];
                e.kind().sensor_rates(&l, reading, &mut own);
                scatter(&own[..e.spec().states.len()], &mut dx[e.begin.states..], site, e.sites);
                y[e.channel + site] = e.kind().sensor(&l, at.t, reading);
            }
        }
    }
    /// Energy of their own at a joint: kinetic, potential.
    pub fn energy<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>) -> [T; 2] {
        self.at_joint(joint).fold([T::zero(); 2], |sum, e| {
            let own = e.kind().energy(&e.local(at, joint), d);
            [sum[0] + own[0], sum[1] + own[1]]
        })
    }
    /// Angular momentum of their own at a joint.
    pub fn angular_momentum<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>) -> T {
        self.at_joint(joint).fold(T::zero(), |sum, e| sum + e.kind().angular_momentum(&e.local(at, joint), d))
    }
    /// Initial states at a joint into the plant's `x`.
    pub fn start<T: Scalar>(&self, p: &[T], joint: usize, d: &DriveTrain<T>, x: &mut [T]) {
        for e in self.at_joint(joint) {
            let mut own = [T::zero(); MOST];
            e.kind().start(&e.local_of(&p[e.begin.parameters..], &[], &[], joint), d, &mut own);
            scatter(&own[..e.spec().states.len()], &mut x[e.begin.states..], joint, e.sites);
        }
    }
    /// Rates of the states at a joint into the plant's `dx`.
    pub fn rates<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>, s: &Spring<T>, dx: &mut [T]) {
        if !self.moving {
            return;
        }
        let mut d = DriveTrain { torque: d.command, ..*d };
        for e in self.at_joint(joint) {
            let l = e.local(at, joint);
            if !e.spec().states.is_empty() {
                let mut own = [T::zero(); MOST];
                e.kind().rates(&l, &d, s, &mut own);
                scatter(&own[..e.spec().states.len()], &mut dx[e.begin.states..], joint, e.sites);
            }
            d.torque = e.kind().actuator(&l, &d, d.torque);
        }
    }
    /// Outputs at a joint into the plant's `y`.
    pub fn outputs<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>, y: &mut [T]) {
        for e in self.at_joint(joint).filter(|e| !e.spec().outputs.is_empty()) {
            let mut own = [T::zero(); MOST];
            e.kind().outputs(&e.local(at, joint), d, &mut own);
            scatter(&own[..e.spec().outputs.len()], &mut y[e.begin.outputs..], joint, e.sites);
        }
    }
    /// Event indicators at a joint into the plant's `z`.
    pub fn indicators<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>, z: &mut [T]) {
        for e in self.at_joint(joint).filter(|e| e.spec().indicators > 0) {
            let mut own = [T::one(); MOST];
            e.kind().indicators(&e.local(at, joint), d, &mut own);
            scatter(&own[..e.spec().indicators], &mut z[e.begin.indicators..], joint, e.sites);
        }
    }
    /// Modes at a joint into `modes`; true where one changed.
    pub fn update(&self, at: &At<f64>, joint: usize, d: &DriveTrain<f64>, modes: &mut [i32]) -> bool {
        let mut changed = false;
        for e in self.at_joint(joint).filter(|e| e.spec().modes > 0) {
            let (n, stretch) = (e.spec().modes, &mut modes[e.begin.modes..]);
            let mut own = [0; MOST];
            (0..n).for_each(|k| own[k] = stretch[k * e.sites + joint]);
            let before = own;
            e.kind().update(&e.local(at, joint), d, &mut own);
            changed |= before != own;
            scatter(&own[..n], stretch, joint, e.sites);
        }
        changed
    }
    /// The time of the next event that is known beforehand from an effect, s.
    pub fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        let sites = self.placed.iter().flat_map(|e| (0..e.sites).map(move |site| (e, site)));
        let times = sites.map(|(e, site)| {
            let modes = modes.get(e.begin.modes..).unwrap_or_default();
            e.kind().next_event(&e.local_of(&p[e.begin.parameters..], &[], modes, site))
        });
        times.fold(
            None,
            |first: Option<f64>, t| {
                if t.is_finite() { Some(first.map_or(t, |f| f.min(t))) } else { first }
            },
        )
    }
}

/// Writes the values of one site into a stretch that is stored variable by variable.
fn scatter<V: Copy>(own: &[V], stretch: &mut [V], site: usize, sites: usize) {
    for (k, v) in own.iter().enumerate() {
        stretch[k * sites + site] = *v;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_fits_and_names_are_unique() {
        for plant in [PlantKind::Joint, PlantKind::Arm, PlantKind::Space] {
            let mut names = Vec::new();
            for choice in EffectChoice::all(plant) {
                let (spec, id) = (choice.spec(), choice.id());
                assert_eq!(EffectChoice::parse(&id, plant), Ok(choice));
                assert!(spec.states.len() <= MOST && spec.outputs.len() <= MOST, "{id}");
                assert!(spec.indicators <= MOST && spec.modes <= MOST, "{id}");
                assert!(!choice.component().is_empty() && !spec.summary.is_empty(), "{id}");
                for p in choice.parameters() {
                    let start = if plant == PlantKind::Joint { p.joint_start } else { p.arm_start };
                    let fits = start <= p.max && (start > p.min || (start == p.min && !p.above_min));
                    assert!(fits, "{id}: start of {}", p.name);
                    let name = choice.variable(p.name);
                    assert!(!names.contains(&name), "{name} is named twice");
                    names.push(name);
                }
            }
        }
    }

    #[test]
    fn a_wrong_effect_is_refused_with_the_mend() {
        let mut s = ModelSizes::default();
        let place = |ids: &[&str], plant, s: &mut ModelSizes| {
            EffectSet::place(ids, plant, 3, s).unwrap_err().to_string()
        };
        assert!(place(&["slop"], PlantKind::Joint, &mut s).contains("backlash"));
        assert!(place(&["base-drag"], PlantKind::Joint, &mut s).contains("PlanarManipulator"));
        assert!(place(&["backlash", "backlash"], PlantKind::Arm, &mut s).contains("twice"));
        assert!(place(&["backlash:here"], PlantKind::Arm, &mut s).contains("choose from backlash"));
    }
}
