//! The variables of [`SpatialFreeFlyer`](super::SpatialFreeFlyer): what each is, and where its values are in the vectors.

use super::structure::RobotStructure;
use crate::layout::AllowedValues::{self, NotNegative, OneUp, Positive};
use crate::layout::{INITIAL, InputStart, Items, LayoutState, Parameter, Shows, layout, state, tunable};

/// How a rotor is coupled to the body that carries it.
pub static COUPLING: Items = Items {
    name: "MotorCoupling",
    text: "How a motor's rotor is coupled to the body that carries it",
    items: &[
        (
            "paper",
            "as printed: the rotor turns with the motor angle, the carrier takes the reaction of all of I_m",
        ),
        ("geared", "rotor behind a gear: the carrier takes that of I_m/N and I_m/N^2"),
    ],
};
const fn following(follows: &'static str) -> Parameter {
    Parameter::following(follows)
}

layout! {
    /// Where parameters begin.
    Parameters of Parameter, s: RobotStructure:
    base_mass "baseMass" [], "kg", tunable(Positive), "Base, m_s (SFF-8)";
    base_inertia "baseInertia" [3, 3], "kg.m2", tunable(AllowedValues::Any), "Base about its centre of mass, base axes (SFF-8)";
    body_mass "bodyMass" [s.bodies()], "kg", tunable(Positive), "m_i (SFF-8)";
    body_center "bodyCenterOfMass" [s.bodies(), 3], "m", tunable(AllowedValues::Any), "From the body's joint, body axes";
    body_inertia "bodyInertia" [s.bodies(), 3, 3], "kg.m2", tunable(AllowedValues::Any), "About the body's own centre of mass, body axes";
    joint_position "jointPosition" [s.bodies(), 3], "m", tunable(AllowedValues::Any), "The joint in the axes of the body that carries it";
    joint_orientation "jointOrientation" [s.bodies(), 4], "1", tunable(AllowedValues::Any),
        "Body axes at joint angle 0 to those of the body that carries it, quaternion w, x, y, z";
    joint_axis "jointAxis" [s.bodies(), 3], "1", tunable(AllowedValues::Any), "The joint's axis, body axes";
    tip_offset "tipOffset" [s.tips.len(), 3], "m", tunable(AllowedValues::Any), "The tip from its body's joint, body axes";
    motor_inertia "motorInertia" [s.bodies()], "kg.m2", tunable(NotNegative),
        "Rotor, gear ratio squared included (kg of a prismatic joint; SFF-12)";
    gear_ratio "gearRatio" [s.bodies()], "1", Parameter::fixed(OneUp),
        "Motor turns per joint turn, N; used by the geared coupling";
    joint_stiffness "jointStiffness" [s.bodies()], "N.m/rad", tunable(NotNegative),
        "Spring of a flexible joint (N/m of a prismatic one)";
    joint_damping "jointDamping" [s.bodies()], "N.m.s/rad", tunable(NotNegative),
        "In parallel with the spring of a flexible joint (N.s/m of a prismatic one)";
    motor_coupling "motorCoupling" [], "", Parameter::fixed(AllowedValues::Item(&COUPLING)),
        "How the rotors are coupled to the bodies that carry them (SFF-12)";
    thruster_position "thrusterPosition" [s.thrusters, 3], "m", tunable(AllowedValues::Any), "From the base's centre of mass, base axes";
    thruster_direction "thrusterDirection" [s.thrusters, 3], "1", tunable(AllowedValues::Any), "Of the force on the base, base axes";
    appendage_position "appendagePosition" [s.panels(), 3], "m", tunable(AllowedValues::Any), "The appendage's root, base axes (SFF-5)";
    appendage_orientation "appendageOrientation" [s.panels(), 4], "1", tunable(AllowedValues::Any),
        "Appendage's axes (z along it) to base axes, quaternion w, x, y, z";
    appendage_length "appendageLength" [s.appendages.len()], "m", tunable(Positive), "From root to tip (SFF-5)";
    mass_per_length "appendageMassPerLength" [s.appendages.len()], "kg/m", tunable(Positive), "rho A (SFF-5)";
    bending_x "bendingStiffnessX" [s.appendages.len()], "N.m2", tunable(Positive), "E I of bending along the appendage's x (SFF-5)";
    bending_y "bendingStiffnessY" [s.appendages.len()], "N.m2", tunable(Positive), "E I of bending along the appendage's y (SFF-5)";
    torsion "torsionStiffness" [s.appendages.len()], "N.m2", tunable(Positive), "G J (SFF-5)";
    polar_inertia "polarInertiaPerLength" [s.appendages.len()], "kg.m", tunable(Positive), "rho I_p (SFF-5)";
    damping_ratio "dampingRatio" [s.appendages.len()], "1", tunable(NotNegative), "Of every mode of the appendage";
    table_mass "appendageMass" [s.tables.len()], "kg", tunable(Positive), "Of an appendage given by a table of modes (SFF-5)";
    table_center "appendageCenterOfMass" [s.tables.len(), 3], "m", tunable(AllowedValues::Any), "Its centre of mass from its root, own axes";
    table_inertia "appendageInertia" [s.tables.len(), 3, 3], "kg.m2", tunable(AllowedValues::Any), "About its centre of mass, own axes";
    mode_frequency "modeFrequency" [s.tabled()], "rad/s", tunable(Positive), "Of the modes of tables, clamped, one table after the other";
    mode_damping "modeDampingRatio" [s.tabled()], "1", tunable(NotNegative), "Of the modes of tables";
    mode_participation "modeParticipation" [s.tabled(), 6], "", tunable(AllowedValues::Any),
        "Momentum (kg^0.5) and angular momentum about the root (kg^0.5 m) per unit of rate of the mass-normalised mode, own axes";
    link_position "linkPosition" [s.links(), 3], "m", tunable(AllowedValues::Any), "Root of a link that bends, axes of its body; beams first, then tables of modes (LNK-5)";
    link_orientation "linkOrientation" [s.links(), 4], "1", tunable(AllowedValues::Any), "Link's axes (z along a beam) to those of its body, quaternion w, x, y, z";
    link_length "linkLength" [s.beams().count()], "m", tunable(Positive), "From root to end (LNK-5)";
    link_mass "massPerLength" [s.beams().count()], "kg/m", tunable(Positive), "rho A of a link that bends (LNK-5)";
    youngs_modulus "youngsModulus" [s.beams().count()], "Pa", tunable(Positive), "E (S3 4.3)";
    area_moment "areaMoment" [s.beams().count(), 2], "m4", tunable(Positive), "J of bending along the link's x and along its y (S3 eq. 9)";
    poisson_ratio "poissonRatio" [s.beams().count()], "1", tunable(NotNegative), "nu: the shear modulus is E / (2 (1 + nu))";
    torsion_constant "torsionConstant" [s.beams().count()], "m4", tunable(Positive), "Of the link's section: torsion stiffness over shear modulus";
    link_polar "linkPolarInertiaPerLength" [s.beams().count()], "kg.m", tunable(Positive), "rho I_p of a link that bends (LNK-5)";
    link_damping "linkDampingRatio" [s.beams().count()], "1", tunable(NotNegative), "Of every mode of the link";
    link_table_mass "linkMass" [s.link_tables().count()], "kg", tunable(Positive), "Of a link that is given by a table of modes (LNK-5)";
    link_table_center "linkCenterOfMass" [s.link_tables().count(), 3], "m", tunable(AllowedValues::Any), "Its centre of mass unbent from its root, own axes";
    link_table_inertia "linkInertia" [s.link_tables().count(), 3, 3], "kg.m2", tunable(AllowedValues::Any), "Unbent, about its centre of mass, own axes";
    link_end "linkEndPosition" [s.link_tables().count(), 3], "m", tunable(AllowedValues::Any), "Its end unbent from its root, own axes: what its body carries hangs there";
    link_mode_frequency "linkModeFrequency" [s.linked_tabled()], "rad/s", tunable(Positive),
        "Of the modes of links, clamped at the root, nothing on the end, one table after the other";
    link_mode_damping "linkModeDampingRatio" [s.linked_tabled()], "1", tunable(NotNegative), "Of the modes of links";
    link_mode_participation "linkModeParticipation" [s.linked_tabled(), 6], "", tunable(AllowedValues::Any),
        "Momentum (kg^0.5) and angular momentum about the root (kg^0.5 m) per unit of rate of the mass-normalised mode, own axes";
    link_mode_shift "linkModeEndShift" [s.linked_tabled(), 3], "", tunable(AllowedValues::Any), "Shift of the end per unit of the mass-normalised mode, own axes, S (kg^-0.5; LNK-1)";
    link_mode_turn "linkModeEndTurn" [s.linked_tabled(), 3], "", tunable(AllowedValues::Any), "Turn of the end per unit of the mass-normalised mode, own axes, Theta (kg^-0.5/m; LNK-1)";
    gravity "gravity" [3] if s.held, "m/s2", tunable(AllowedValues::Any), "Acceleration of free fall, inertial axes; a base that is held alone has it";
    initial_base_position "initialBasePosition" [3], "m", INITIAL, "r at the start; of a base that is held: always";
    initial_base_quaternion "initialBaseQuaternion" [4], "1", INITIAL, "Q at the start (w, x, y, z), taken with length 1";
    initial_base_velocity "initialBaseVelocity" [3] if !s.held, "m/s", INITIAL, "v at the start, inertial axes";
    initial_base_angular_velocity "initialBaseAngularVelocity" [3] if !s.held, "rad/s", INITIAL, "omega at the start, base axes";
    initial_joint_angle "initialJointAngle" [s.bodies()], "rad", INITIAL, "q_i at the start (m of a prismatic joint)";
    initial_joint_velocity "initialJointVelocity" [s.bodies()], "rad/s", INITIAL, "d(q_i) at the start (m/s of a prismatic joint)";
    initial_motor_angle "initialMotorAngle" [s.bodies()], "rad", following("initialJointAngle"),
        "q_mi at the start; unset: the joint's, so that the spring is unstrained";
    initial_motor_velocity "initialMotorVelocity" [s.bodies()], "rad/s", following("initialJointVelocity"),
        "d(q_mi) at the start; unset: the joint's";
    initial_modal_coordinate "initialModalCoordinate" [s.modes() - s.linked()], "m", INITIAL, "eta at the start (rad of torsion)";
    initial_modal_velocity "initialModalVelocity" [s.modes() - s.linked()], "m/s", INITIAL, "d(eta) at the start (rad/s of torsion)";
    initial_link_coordinate "initialLinkModalCoordinate" [s.linked()], "m", INITIAL, "xi of the links at the start (rad of torsion)";
    initial_link_velocity "initialLinkModalVelocity" [s.linked()], "m/s", INITIAL, "d(xi) of the links at the start (rad/s of torsion)";
    arm_mount "armMount" [s.tips.len(), 3] if s.analysis, "m", tunable(AllowedValues::Any),
        "Point of the base that the measures take this tip's arm's torques about, base axes (SFF-3)";
}

layout! {
    /// Where inputs begin.
    Inputs of InputStart, s: RobotStructure:
    joint_torque "jointTorque" [s.bodies()], "N.m", &[], "On the motors, joint side (N of a prismatic joint); positive turns the joint forward (SFF-11)";
    thruster_force "thrusterForce" [s.thrusters], "N", &[], "On the base along the thruster's direction";
    base_force "baseForce" [3] if !s.held, "N", &[], "On the base at its centre of mass, inertial axes, F_s (SFF-11)";
    base_torque "baseTorque" [3] if !s.held, "N.m", &[], "On the base, inertial axes, H_s (SFF-11)";
    tip_force "tipForce" [s.tips.len(), 3], "N", &[], "At the tip, inertial axes, F_ee (SFF-11)";
    tip_torque "tipTorque" [s.tips.len(), 3], "N.m", &[], "On the tip's body, inertial axes, T_ee (SFF-11)";
}

layout! {
    /// Where outputs begin.
    Outputs of Shows, s: RobotStructure:
    base_position "basePosition" [3], "m", if s.held { Shows::States } else { Shows::State("basePosition") }, "The base's centre of mass, inertial axes, r";
    base_quaternion "baseQuaternion" [4], "1", Shows::States, "Base axes to inertial ones, Q: w, x, y, z (SFF-1)";
    base_velocity "baseVelocity" [3], "m/s", if s.held { Shows::States } else { Shows::State("baseVelocity") }, "d(r)/dt, inertial axes";
    base_angular_velocity "baseAngularVelocity" [3], "rad/s", if s.held { Shows::States } else { Shows::State("baseAngularVelocity") }, "omega, base axes: what a gyro reads";
    joint_angle "jointAngle" [s.bodies()], "rad", Shows::State("jointAngle"), "q_i (m of a prismatic joint)";
    joint_velocity "jointVelocity" [s.bodies()], "rad/s", Shows::State("jointVelocity"), "d(q_i)/dt (m/s of a prismatic joint)";
    motor_angle "motorAngle" [s.bodies()], "rad", Shows::States, "Motor, joint side, q_mi; of a rigid joint: the joint's";
    motor_velocity "motorVelocity" [s.bodies()], "rad/s", Shows::States, "d(q_mi)/dt";
    tip_position "tipPosition" [s.tips.len(), 3], "m", Shows::States, "Inertial axes, r_ee (SFF-7)";
    tip_quaternion "tipQuaternion" [s.tips.len(), 4], "1", Shows::States, "Axes of the tip's body to inertial ones: w, x, y, z";
    tip_velocity "tipVelocity" [s.tips.len(), 3], "m/s", Shows::States, "Inertial axes, v_ee (SFF-7)";
    tip_angular_velocity "tipAngularVelocity" [s.tips.len(), 3], "rad/s", Shows::States, "Inertial axes, omega_ee (SFF-7)";
    modal_coordinate "modalCoordinate" [s.modes() - s.linked()], "m", Shows::State("modalCoordinate"),
        "eta: what each shape moves the appendage's tip, along x, then y, then torsion (rad), appendage by appendage; of tables (kg^0.5 m) behind them (SFF-5)";
    modal_velocity "modalVelocity" [s.modes() - s.linked()], "m/s", Shows::State("modalVelocity"), "d(eta)/dt (rad/s of torsion)";
    link_coordinate "linkModalCoordinate" [s.linked()], "m", Shows::State("linkModalCoordinate"),
        "xi: what each shape moves the link's end, along x, then y, then torsion (rad), link by link; of tables (kg^0.5 m) behind them (LNK-1)";
    link_velocity "linkModalVelocity" [s.linked()], "m/s", Shows::State("linkModalVelocity"), "d(xi)/dt (rad/s of torsion)";
    appendage_tip "appendageTipPosition" [s.appendages.len(), 3], "m", Shows::States, "Tip of the appendage, inertial axes";
    reaction_force "reactionForce" [3], "N", Shows::All, "Of all that the base carries on the base, inertial axes, F_IF (SFF-3)";
    reaction_torque "reactionTorque" [3], "N.m", Shows::All, "Of all that the base carries on the base, about its centre of mass, inertial axes, tau_IF (SFF-3)";
    arm_force "reactionForceOfArm" [s.tips.len(), 3], "N", Shows::All, "Of this tip's arm on the base, inertial axes";
    arm_torque "reactionTorqueOfArm" [s.tips.len(), 3], "N.m", Shows::All, "Of this tip's arm on the base, about the arm's first joint, inertial axes";
    linear_momentum "linearMomentum" [3], "kg.m/s", Shows::States, "Of the whole system, inertial axes, P (SFF-9)";
    angular_momentum "angularMomentum" [3], "kg.m2/s", Shows::States, "Of the whole system about the inertial origin, L (SFF-9), rotors included";
    kinetic_energy "kineticEnergy" [], "J", Shows::States, "T, rotors included (SFF-8)";
    potential_energy "potentialEnergy" [], "J", Shows::States, "Of springs and appendages, and of the weight where the base is held";
    center_of_mass "centerOfMass" [3], "m", Shows::States, "Of the whole system, inertial axes";
    force_measure "forceMeasure" [s.tips.len()] if s.analysis, "", Shows::States,
        "det(B_f^T B_f) of this tip's arm, (kg.m) to the power of twice its joints (SFF-4); 0 of more than 3 joints";
    torque_measure "torqueMeasure" [s.tips.len()] if s.analysis, "", Shows::States,
        "det(B_tau^T B_tau), (kg.m2) to the power of twice the joints (SFF-4); 0 where joints give parallel torques, and of more than 3";
    combined_measure "combinedMeasure" [s.tips.len()] if s.analysis, "", Shows::States, "det(B^T B) of force and torque together (SFF-4); 0 of more than 6 joints";
    jacobian_smallest "generalizedJacobianSmallest" [s.tips.len()] if s.analysis, "", Shows::States,
        "Smallest singular value of J_g, twist of the tip by all joints (SFF-10), rows m and rad; of J_M where the base is held";
    manipulability "manipulability" [s.tips.len()] if s.analysis, "", Shows::States, "sqrt(det(J J^T)) of that matrix: the product of its singular values";
}

layout! {
    /// Where states begin; velocities are in the order of what they are the rates of.
    States of LayoutState, s: RobotStructure:
    base_position "basePosition" [3] if !s.held, "m", state("m/s", 0.01, Shows::State("baseVelocity")), "the base's position, r";
    base_quaternion "baseQuaternion" [4] if !s.held, "1", state("1/s", 1.0, Shows::States), "the base's attitude, Q";
    joint_angle "jointAngle" [s.bodies()], "rad", state("rad/s", 0.01, Shows::State("jointVelocity")), "joint angles, q_i";
    motor_angle "motorAngle" [s.springs()], "rad", state("rad/s", 0.01, Shows::State("motorVelocity")), "motor angles of the flexible joints, q_mi";
    modal_coordinate "modalCoordinate" [s.modes() - s.linked()], "m", state("m/s", 0.01, Shows::State("modalVelocity")), "modal coordinates, eta";
    link_coordinate "linkModalCoordinate" [s.linked()], "m", state("m/s", 0.01, Shows::State("linkModalVelocity")), "modal coordinates of links, xi";
    base_velocity "baseVelocity" [3] if !s.held, "m/s", state("m/s2", 0.001, Shows::All), "the base's velocity (SFF-11)";
    base_angular_velocity "baseAngularVelocity" [3] if !s.held, "rad/s", state("rad/s2", 0.001, Shows::All), "the base's rate, base axes (SFF-11)";
    joint_velocity "jointVelocity" [s.bodies()], "rad/s", state("rad/s2", 0.001, Shows::All), "joint velocities (SFF-11)";
    motor_velocity "motorVelocity" [s.springs()], "rad/s", state("rad/s2", 0.001, Shows::All), "motor velocities of the flexible joints (SFF-12)";
    modal_velocity "modalVelocity" [s.modes() - s.linked()], "m/s", state("m/s2", 0.01, Shows::All), "modal rates (SFF-6)";
    link_velocity "linkModalVelocity" [s.linked()], "m/s", state("m/s2", 0.01, Shows::All), "modal rates of links (LNK-3)";
}

layout! {
    /// Where parameters of friction begin that an effect brings to every joint, behind those of the robot.
    FrictionParameters of Parameter, n: usize:
    coulomb "coulombFriction" [*n], "N.m", tunable(NotNegative), "Sliding friction of the motor, joint side, tau_c (EF-1)";
    breakaway "staticFriction" [*n], "N.m", tunable(NotNegative), "Largest friction at rest, tau_s (EF-1); a smaller value counts as tau_c";
    viscous "viscousFriction" [*n], "N.m.s/rad", tunable(NotNegative), "Viscous friction of the motor, joint side, D_m (EF-1)";
}

layout! {
    /// Where outputs of that friction begin, behind those of the robot.
    FrictionOutputs of Shows, n: usize:
    torque "frictionTorque" [*n], "N.m", Shows::All, "Of the motor's friction against positive motion; balances what is applied while it sticks (EF-1)";
    sticking "sticking" [*n], "", Shows::Flag, "The motor sticks; of a rigid joint: the joint";
}
