//! `joint-flexibility`: a joint assumed rigid that is not.
//!
//! (EF-20) the equations of the flexible joint (TMJ-1 to TMJ-3; S0 eq. 7, 8, 10, 11) with the plant's own stiffness,
//! damping and motor inertia in place of the rigid ones; on the arm in every joint that is packed rigid.
//!
//! A joint that is packed flexible stays as it is. The limit of a large stiffness is the rigid joint.

use super::*;

pub(crate) struct JointFlexibility;

impl Effect for JointFlexibility {
    const SPEC: Spec = Spec {
        id: "joint-flexibility",
        component: "transmission",
        summary: "a joint assumed rigid that is not",
        noun: "flexibility of a joint assumed rigid",
        check: "Block the motor and push the link: does the link deflect, and spring back?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        passive: true,
        borrows: &[
            Borrowed {
                joint_name: "stiffness",
                arm_name: "jointStiffness",
                unit: "N.m/rad",
                neutral: Neutral::Structure,
                scale: EffectScale::of(1.0, &[(Measure::Torque, 1), (Measure::Deflection, -1)]),
                known: false,
            },
            Borrowed {
                joint_name: "damping",
                arm_name: "jointDamping",
                unit: "N.m.s/rad",
                neutral: Neutral::Structure,
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1), (Measure::DeflectionRate, -1)]),
                known: false,
            },
            Borrowed {
                joint_name: "motorInertia",
                arm_name: "motorInertia",
                unit: "kg.m2",
                neutral: Neutral::Structure,
                scale: EffectScale::of(1.0, &[(Measure::LoadInertia, 1)]),
                known: true,
            },
        ],
        ..Spec::NONE
    };
}

#[cfg(test)]
mod tests {
    use crate::arm::PlanarManipulator;
    use crate::joint::TwoMassJoint;
    use trueup_numerics::hybrid::Hybrid;

    const NONE: &[&str] = &[];

    #[test]
    fn ef20_makes_the_rigid_plant_flexible() {
        let flexible = TwoMassJoint::new(true, NONE).unwrap();
        let with = TwoMassJoint::new(false, &["joint-flexibility"]).unwrap();
        assert!(with.flexible() && with.sizes() == flexible.sizes());
        let arm = PlanarManipulator::new(&[false, true], &["joint-flexibility"]).unwrap();
        assert!(arm.flexible() == [true, true] && arm.dofs() == 7);
    }
}
