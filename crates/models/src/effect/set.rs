//! The effects packed into one plant, and where their values lie in the plant's vectors.

use super::{ALL, Kind, Local, Plant, Scope, Spec};
use crate::drive::{Base, Drive, Spring, Wrench};
use crate::friction::Levels;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, Sizes};

/// One effect in a plant: where its values begin.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Which effect.
    pub kind: Kind,
    /// How many sites it has (joints, or 1).
    pub sites: usize,
    /// Begin of its values in each of the plant's vectors.
    pub begin: Sizes,
}

impl Placed {
    /// What it is.
    pub fn spec(&self) -> &'static Spec {
        self.kind.spec()
    }
    fn local<'a, T: Scalar>(&self, at: &At<'a, T>, site: usize) -> Local<'a, T> {
        Local::new(
            &at.p[self.begin.parameters..],
            &at.x[self.begin.states..],
            at.modes.get(self.begin.modes..).unwrap_or_default(),
            site,
            self.sites,
        )
    }
    /// The sites at which it acts on joint `joint` (none if it stands once and the joint is not the first).
    fn acts_at(&self, joint: usize) -> bool {
        joint < self.sites
    }
}

/// An effect that was asked for and cannot be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EffectError {
    /// No effect has that id.
    Unknown(String),
    /// It does not act in that plant.
    NotHere(&'static str, Plant),
    /// Named twice.
    Twice(&'static str),
}

impl std::fmt::Display for EffectError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown(id) => {
                let known: Vec<_> = ALL.iter().map(|k| k.spec().id).collect();
                write!(f, "there is no effect {id:?}; choose from {}", known.join(", "))
            }
            Self::NotHere(id, plant) => {
                let (here, other) = match plant {
                    Plant::Joint => ("TwoMassJoint", "PlanarManipulator"),
                    Plant::Arm => ("PlanarManipulator", "TwoMassJoint"),
                };
                write!(f, "the effect {id:?} does not act in {here}; pack it with {other}")
            }
            Self::Twice(id) => write!(f, "the effect {id:?} is named twice; name it once"),
        }
    }
}
impl std::error::Error for EffectError {}

/// The effects of one plant, in the order in which they act.
#[derive(Clone, Debug, Default)]
pub struct EffectSet {
    placed: Vec<Placed>,
    friction: bool,
}

/// Most states, outputs or indicators of one effect at one site.
const MOST: usize = 4;

impl EffectSet {
    /// The effects of those ids in `plant` with `joints` joints; their values are laid behind `sizes`, which
    /// grows by them.
    pub fn place<S: AsRef<str>>(
        ids: &[S],
        plant: Plant,
        joints: usize,
        sizes: &mut Sizes,
    ) -> Result<Self, EffectError> {
        for (i, id) in ids.iter().enumerate() {
            let id = id.as_ref();
            let kind =
                ALL.iter().find(|k| k.spec().id == id).ok_or_else(|| EffectError::Unknown(id.to_owned()))?;
            if !kind.spec().plants.contains(&plant) {
                return Err(EffectError::NotHere(kind.spec().id, plant));
            }
            if ids[..i].iter().any(|other| other.as_ref() == id) {
                return Err(EffectError::Twice(kind.spec().id));
            }
        }
        let mut placed = Vec::new();
        for kind in ALL.iter().filter(|k| ids.iter().any(|id| id.as_ref() == k.spec().id)) {
            let spec = kind.spec();
            let sites = if spec.scope == Scope::Joint { joints } else { 1 };
            placed.push(Placed { kind: *kind, sites, begin: *sizes });
            sizes.parameters += spec.parameters.len() * sites;
            sizes.states += spec.states.len() * sites;
            sizes.outputs += spec.outputs.len() * sites;
            sizes.modes += spec.modes * sites;
            sizes.indicators += spec.indicators * sites;
        }
        let friction = placed.iter().any(|e| e.spec().friction);
        Ok(Self { placed, friction })
    }
    /// One after another.
    pub fn iter(&self) -> impl Iterator<Item = &Placed> {
        self.placed.iter()
    }
    /// One of them needs motor friction.
    pub fn needs_friction(&self) -> bool {
        self.friction
    }
    fn at_joint(&self, joint: usize) -> impl Iterator<Item = &Placed> {
        self.placed.iter().filter(move |e| e.acts_at(joint))
    }

    /// Motor torque of a joint after the amplifier.
    pub fn actuator<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>) -> T {
        self.at_joint(joint).fold(d.command, |torque, e| e.kind.actuator(&e.local(at, joint), d, torque))
    }
    /// Friction levels of a joint in direction +1 or -1, beginning with the plant's own.
    pub fn friction<T: Scalar>(
        &self,
        at: &At<T>,
        joint: usize,
        d: &Drive<T>,
        direction: f64,
        own: Levels<T>,
    ) -> Levels<T> {
        let mut levels = own;
        self.at_joint(joint).for_each(|e| e.kind.friction(&e.local(at, joint), d, direction, &mut levels));
        levels
    }
    /// The spring of a joint.
    pub fn spring<T: Scalar>(
        &self,
        at: &At<T>,
        joint: usize,
        d: &Drive<T>,
        mut spring: Spring<T>,
    ) -> Spring<T> {
        self.at_joint(joint).for_each(|e| e.kind.spring(&e.local(at, joint), d, &mut spring));
        spring
    }
    /// Torque on the link of a joint from outside the drive train.
    pub fn link_torque<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>) -> T {
        self.at_joint(joint).fold(T::zero(), |sum, e| sum + e.kind.link_torque(&e.local(at, joint), d))
    }
    /// The uniform acceleration field.
    pub fn field<T: Scalar>(&self, at: &At<T>) -> [T; 2] {
        self.placed.iter().fold([T::zero(); 2], |sum, e| {
            let a = e.kind.field(&e.local(at, 0));
            [sum[0] + a[0], sum[1] + a[1]]
        })
    }
    /// The wrench on the base.
    pub fn base<T: Scalar>(&self, at: &At<T>, b: &Base<T>) -> Wrench<T> {
        self.placed.iter().fold(Wrench::default(), |sum, e| {
            let w = e.kind.base(&e.local(at, 0), b);
            Wrench {
                force: [sum.force[0] + w.force[0], sum.force[1] + w.force[1]],
                torque: sum.torque + w.torque,
            }
        })
    }
    /// What a sensor of a joint shows.
    pub fn sensor<T: Scalar>(&self, at: &At<T>, joint: usize, channel: &str, d: &Drive<T>, reading: T) -> T {
        self.at_joint(joint).fold(reading, |r, e| e.kind.sensor(&e.local(at, joint), channel, d, r))
    }
    /// Energy of their own at a joint: kinetic, potential.
    pub fn energy<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>) -> [T; 2] {
        self.at_joint(joint).fold([T::zero(); 2], |sum, e| {
            let own = e.kind.energy(&e.local(at, joint), d);
            [sum[0] + own[0], sum[1] + own[1]]
        })
    }
    /// Angular momentum of their own at a joint.
    pub fn angular_momentum<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>) -> T {
        self.at_joint(joint).fold(T::zero(), |sum, e| sum + e.kind.angular_momentum(&e.local(at, joint), d))
    }
    /// Initial states at a joint into the plant's `x`.
    pub fn start<T: Scalar>(&self, p: &[T], joint: usize, d: &Drive<T>, x: &mut [T]) {
        for e in self.at_joint(joint) {
            let mut own = [T::zero(); MOST];
            e.kind.start(&Local::new(&p[e.begin.parameters..], &[], &[], joint, e.sites), d, &mut own);
            scatter(&own[..e.spec().states.len()], &mut x[e.begin.states..], joint, e.sites);
        }
    }
    /// Rates of the states at a joint into the plant's `dx`.
    pub fn rates<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>, s: &Spring<T>, dx: &mut [T]) {
        for e in self.at_joint(joint).filter(|e| !e.spec().states.is_empty()) {
            let mut own = [T::zero(); MOST];
            e.kind.rates(&e.local(at, joint), d, s, &mut own);
            scatter(&own[..e.spec().states.len()], &mut dx[e.begin.states..], joint, e.sites);
        }
    }
    /// Outputs at a joint into the plant's `y`.
    pub fn outputs<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>, y: &mut [T]) {
        for e in self.at_joint(joint).filter(|e| !e.spec().outputs.is_empty()) {
            let mut own = [T::zero(); MOST];
            e.kind.outputs(&e.local(at, joint), d, &mut own);
            scatter(&own[..e.spec().outputs.len()], &mut y[e.begin.outputs..], joint, e.sites);
        }
    }
    /// Event indicators at a joint into the plant's `z`.
    pub fn indicators<T: Scalar>(&self, at: &At<T>, joint: usize, d: &Drive<T>, z: &mut [T]) {
        for e in self.at_joint(joint).filter(|e| e.spec().indicators > 0) {
            let mut own = [T::one(); MOST];
            e.kind.indicators(&e.local(at, joint), d, &mut own);
            scatter(&own[..e.spec().indicators], &mut z[e.begin.indicators..], joint, e.sites);
        }
    }
    /// Modes at a joint into `modes`; true where one changed.
    pub fn update(&self, at: &At<f64>, joint: usize, d: &Drive<f64>, modes: &mut [i32]) -> bool {
        let mut changed = false;
        for e in self.at_joint(joint).filter(|e| e.spec().modes > 0) {
            let (n, stretch) = (e.spec().modes, &mut modes[e.begin.modes..]);
            let mut own = [0; MOST];
            (0..n).for_each(|k| own[k] = stretch[k * e.sites + joint]);
            let before = own;
            e.kind.update(&e.local(at, joint), d, &mut own);
            changed |= before != own;
            scatter(&own[..n], stretch, joint, e.sites);
        }
        changed
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
        let mut names = Vec::new();
        for kind in ALL {
            let spec = kind.spec();
            assert!(spec.states.len() <= MOST && spec.outputs.len() <= MOST, "{}", spec.id);
            assert!(spec.indicators <= MOST && spec.modes <= MOST, "{}", spec.id);
            assert!(!spec.plants.is_empty() && !spec.summary.is_empty(), "{}", spec.id);
            for p in spec.parameters {
                for (plant, start) in [(Plant::Joint, p.joint_start), (Plant::Arm, p.arm_start)] {
                    let fits = start <= p.max && (start > p.min || (start == p.min && !p.above_min));
                    assert!(fits || !spec.plants.contains(&plant), "{}: start of {}", spec.id, p.name);
                }
                assert!(!names.contains(&p.name), "{} is named twice", p.name);
                names.push(p.name);
            }
        }
    }

    #[test]
    fn a_wrong_effect_is_refused_with_the_mend() {
        let mut s = Sizes::default();
        let place =
            |ids: &[&str], plant, s: &mut Sizes| EffectSet::place(ids, plant, 3, s).unwrap_err().to_string();
        assert!(place(&["slop"], Plant::Joint, &mut s).contains("backlash"));
        assert!(place(&["base-drag"], Plant::Joint, &mut s).contains("PlanarManipulator"));
        assert!(place(&["backlash", "backlash"], Plant::Arm, &mut s).contains("twice"));
    }
}
