//! Values of an arm by their names, those that a refit moves, and what the nominal model has of them.

use super::chain::JOINTS;
use super::plant::HeldArmValues;
use super::scene::{HeldRecord, HeldScene};
use super::size::ratio;
use crate::case::TrialSplit;
use crate::draw::SeededDraw;
use crate::joint::short;

/// A value of an arm; numbers from 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HeldValue {
    Mass(usize),
    Center(usize, usize),
    Inertia(usize, usize, usize),
    Motor(usize),
    Coulomb(usize),
    Breakaway(usize),
    Viscous(usize),
    Stiffness(usize),
    Damping(usize),
}

impl HeldValue {
    /// Variable of the FMU without its indices.
    pub(super) fn variable(self) -> &'static str {
        match self {
            Self::Mass(_) => "bodyMass",
            Self::Center(..) => "bodyCenterOfMass",
            Self::Inertia(..) => "bodyInertia",
            Self::Motor(_) => "motorInertia",
            Self::Coulomb(_) => "coulombFriction",
            Self::Breakaway(_) => "staticFriction",
            Self::Viscous(_) => "viscousFriction",
            Self::Stiffness(_) => "jointStiffness",
            Self::Damping(_) => "jointDamping",
        }
    }
    pub(super) fn name(self) -> String {
        let indices = match self {
            Self::Center(j, k) => format!("{},{}", j + 1, k + 1),
            Self::Inertia(j, i, k) => format!("{},{},{}", j + 1, i + 1, k + 1),
            Self::Mass(j)
            | Self::Motor(j)
            | Self::Coulomb(j)
            | Self::Breakaway(j)
            | Self::Viscous(j)
            | Self::Stiffness(j)
            | Self::Damping(j) => format!("{}", j + 1),
        };
        format!("{}[{indices}]", self.variable())
    }
    /// A value of the friction that the nominal model has as an effect.
    pub(super) fn of_friction(self) -> bool {
        matches!(self, Self::Coulomb(_) | Self::Breakaway(_) | Self::Viscous(_))
    }
    pub(super) fn get(self, v: &HeldArmValues) -> f64 {
        match self {
            Self::Mass(j) => v.chain.bodies[j].mass,
            Self::Center(j, k) => v.chain.bodies[j].center[k],
            Self::Inertia(j, i, k) => v.chain.bodies[j].inertia[i][k],
            Self::Motor(j) => v.chain.rotor[j],
            Self::Coulomb(j) => v.coulomb[j],
            Self::Breakaway(j) => v.breakaway[j],
            Self::Viscous(j) => v.viscous[j],
            Self::Stiffness(j) => v.stiffness[j],
            Self::Damping(j) => v.damping[j],
        }
    }
    /// Friction breaks away in the same ratio to where it slides.
    pub(super) fn set(self, v: &mut HeldArmValues, x: f64) {
        match self {
            Self::Mass(j) => v.chain.bodies[j].mass = x,
            Self::Center(j, k) => v.chain.bodies[j].center[k] = x,
            Self::Inertia(j, i, k) => v.chain.bodies[j].inertia[i][k] = x,
            Self::Motor(j) => v.chain.rotor[j] = x,
            Self::Coulomb(j) => {
                v.breakaway[j] *= x / v.coulomb[j];
                v.coulomb[j] = x;
            }
            Self::Breakaway(j) => v.breakaway[j] = x,
            Self::Viscous(j) => v.viscous[j] = x,
            Self::Stiffness(j) => v.stiffness[j] = x,
            Self::Damping(j) => v.damping[j] = x,
        }
    }
}

/// What a refit moves: masses, the largest component of each centre of mass, rotors, friction, springs. Values of the
/// first body that turns about the vertical show nothing but its inertia about it, which the rotor has, too.
pub(super) fn free_values(v: &HeldArmValues) -> Vec<HeldValue> {
    let mut list: Vec<HeldValue> = (1..JOINTS).map(HeldValue::Mass).collect();
    for (j, b) in v.chain.bodies.iter().enumerate().skip(1) {
        let largest = (0..3).max_by(|a, c| b.center[*a].abs().total_cmp(&b.center[*c].abs()));
        list.extend(largest.map(|k| HeldValue::Center(j, k)));
    }
    list.extend((0..JOINTS).map(HeldValue::Motor));
    list.extend((0..JOINTS).flat_map(|j| [HeldValue::Coulomb(j), HeldValue::Viscous(j)]));
    let sprung = (0..JOINTS).filter(|j| v.flexible[*j]);
    list.extend(sprung.flat_map(|j| [HeldValue::Stiffness(j), HeldValue::Damping(j)]));
    list
}

/// The nominal model and what a case declares of it.
#[derive(Clone, Debug)]
pub(super) struct NominalArm {
    pub(super) values: HeldArmValues,
    /// Relative standard deviations by name; of friction: for all of it.
    pub(super) uncertain: Vec<(String, f64)>,
    pub(super) friction: f64,
}

/// Nothing where wrong values do not show.
pub(super) fn nominal(
    split: TrialSplit,
    s: &HeldScene,
    base: &HeldArmValues,
    runs: &[HeldRecord],
    floor: &[f64],
    d: &mut SeededDraw,
) -> Option<NominalArm> {
    let mut own = NominalArm { values: *base, uncertain: Vec::new(), friction: d.pick(&[0.05, 0.1, 0.2]) };
    let free = free_values(base);
    if split == TrialSplit::Parameters {
        let mut moved: Vec<(HeldValue, f64)> = Vec::new();
        for _ in 0..1 + d.below(3) {
            let value = d.pick(&free);
            if moved.iter().all(|(k, _)| *k != value) {
                moved.push((value, d.sign() * d.uniform(0.5, 1.0)));
            }
        }
        let target = d.log(2.0, 30.0);
        let (mut size, mut reached) = (0.1, 0.0);
        for _ in 0..6 {
            own.values = *base;
            for (value, m) in &moved {
                value.set(&mut own.values, short(value.get(base) * (1.0 + size * m)));
            }
            reached = ratio(s, base, own.values, &[], runs, floor, &[]);
            if (reached / target).ln().abs() < 0.3 {
                break;
            }
            let factor = ((target * target - 1.0) / (reached * reached - 1.0).max(1e-4)).sqrt();
            size = (size * factor.clamp(0.1, 8.0)).clamp(2e-4, 0.6);
        }
        if !(1.5..60.0).contains(&reached) {
            return None;
        }
        for (value, m) in moved {
            let doubt = short((size * m.abs() / d.uniform(0.5, 2.0)).max(0.005));
            if value.of_friction() {
                own.friction = own.friction.max(doubt);
            } else if d.chance(0.85) {
                own.uncertain.push((value.name(), doubt));
            }
        }
        return Some(own);
    }
    let off = split != TrialSplit::None && d.chance(0.6);
    if off {
        for value in &free {
            let by = if value.of_friction() { own.friction } else { 0.05 };
            value.set(&mut own.values, short(value.get(base) * (1.0 + d.sign() * by * d.uniform(0.2, 1.0))));
        }
    }
    if off || d.chance(0.7) {
        let mut names: Vec<&str> =
            free.iter().filter(|v| !v.of_friction()).map(|value| value.variable()).collect();
        names.dedup();
        names.sort_unstable();
        names.dedup();
        for name in names {
            own.uncertain.push((name.to_owned(), d.pick(&[0.03, 0.05, 0.1])));
        }
    }
    Some(own)
}
