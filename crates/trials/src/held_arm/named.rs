//! Values of an arm by their names, and those that a refit moves.

use super::chain::JOINTS;
use super::values::HeldArmValues;

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
