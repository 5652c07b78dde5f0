//! Joints and links one by one (S3 5.1, 5.2).

use super::equilibrium::{Equilibrium, EquilibriumError, modes, settled};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::space::layout::{Parameters, States};

/// What bends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlexibleElement {
    /// A joint's spring; the joint counts from 1.
    Joint(usize),
    /// A link; it is that of the body that counts from 1 among those that bend: beams, then tables of modes.
    Link(usize),
}

impl std::fmt::Display for FlexibleElement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Joint(j) => write!(f, "joint {j}"),
            Self::Link(l) => write!(f, "link {l}"),
        }
    }
}

/// What an element does at a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Which one.
    pub element: FlexibleElement,
    /// Its deflection under the load: the twist of a joint, the rotation of a link's end against its root, rad (S3 Table 4).
    pub deflection: f64,
    /// Its magnitude as a share of the sum over all elements; 0 where nothing deflects.
    pub share: f64,
    /// By what share the first frequency rises when its stiffness does by [`INCREMENT`] (S3 Table 5).
    pub rise: f64,
    /// Its part of the energy of springs in the first mode: d ln(omega^2) / d ln(stiffness), where weight does not count.
    pub energy: f64,
}

/// How much stiffer an element is made (S3 Table 5).
pub const INCREMENT: f64 = 0.2;

/// All elements of an arm at rest: joints with a spring, then links.
fn elements(rest: &Equilibrium, links: usize) -> impl Iterator<Item = FlexibleElement> + '_ {
    rest.joints.iter().map(|j| FlexibleElement::Joint(j + 1)).chain((1..=links).map(FlexibleElement::Link))
}

/// What every element contributes at rest.
///
/// # Errors
/// An arm that has no equilibrium once an element is stiffer.
pub fn contributions(
    arm: &FlexibleArm,
    p: &[f64],
    rest: &Equilibrium,
    tip_force: [f64; 3],
) -> Result<Vec<Contribution>, EquilibriumError> {
    let s = &arm.structure().robot;
    let (at, parameter) = (States::new(s), Parameters::new(s));
    let (frequencies, shapes) = modes(&rest.mass, &rest.stiffness)?;
    let (first, shape) = (frequencies[0], shapes.column(0));
    let spring_energy: f64 = rest.springs.iter().zip(shape.iter()).map(|(k, s)| k * s * s).sum();
    let mut found = Vec::new();
    let mut mode = 0;
    for (index, element) in elements(rest, s.links()).enumerate() {
        let mut stiffer = p.to_vec();
        let (rows, deflection) = match element {
            FlexibleElement::Joint(j) => {
                stiffer[parameter.joint_stiffness + j - 1] *= 1.0 + INCREMENT;
                (index..index + 1, rest.state[at.joint_angle + j - 1] - rest.motors[j - 1])
            }
            FlexibleElement::Link(l) => {
                let (body, count) = s.bending().nth(l - 1).unwrap_or_default();
                if l <= s.beams().count() {
                    stiffer[parameter.youngs_modulus + l - 1] *= 1.0 + INCREMENT;
                } else {
                    let first = parameter.link_mode_frequency + mode - (s.linked() - s.linked_tabled());
                    stiffer[first..first + count].iter_mut().for_each(|f| *f *= (1.0 + INCREMENT).sqrt());
                }
                let own = rest.joints.len() + mode..rest.joints.len() + mode + count;
                mode += count;
                (own, arm.bodies().end_turn(&rest.state, &p[..parameter.count], body))
            }
        };
        let energy = rows.map(|r| rest.springs[r] * shape[r] * shape[r]).sum::<f64>() / spring_energy; // (LNK-9)
        let stiff = settled(arm, &stiffer, &rest.motors, tip_force, rest.state.clone())?;
        let rise = stiff.frequencies()?[0] / first - 1.0; // (LNK-9)
        found.push(Contribution { element, deflection, share: 0.0, rise, energy });
    }
    let whole: f64 = found.iter().map(|c| c.deflection.abs()).sum();
    if whole > 0.0 {
        found.iter_mut().for_each(|c| c.share = c.deflection.abs() / whole); // (LNK-9)
    }
    Ok(found)
}

/// By how much the squares of the first frequency rise, added up over all elements: in a linear conservative model without
/// weight [`INCREMENT`] at most (Rayleigh).
pub fn squares(rises: impl IntoIterator<Item = f64>) -> f64 {
    rises.into_iter().map(|rise| (1.0 + rise).powi(2) - 1.0).sum() // (LNK-9)
}
