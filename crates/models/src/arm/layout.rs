//! The variables of a manipulator with `n` links: what each is, where its values are in the vectors, and what may be chosen
//! of its base.

use crate::layout::{Items, LayoutEntry, LayoutState, Shows};

/// Name of the choice of [`BASE`], in an FMU and among the parameters of a case.
pub const BASE_CHOICE: &str = "base";
/// Item of [`BASE`], counted from 1.
pub const FIXED_BASE: u32 = 2;
/// What becomes of the base, in the order of its choice.
pub static BASE: Items = Items {
    name: "Base",
    text: "What becomes of the base",
    items: &[
        ("free", "it floats"),
        ("fixed", "it stays where it begins, whatever force that takes; there may be gravity"),
    ],
};

/// How a motor's rotor is coupled to the body that carries it.
pub static COUPLING: Items = Items {
    name: "MotorCoupling",
    text: "How a motor's rotor is coupled to the body that carries it",
    items: &[
        ("paper", "as printed: I_m turns with the motor angle, the carrier takes the reaction of all of I_m"),
        ("geared", "rotor behind a gear: the carrier takes that of I_m/N and I_m/N^2"),
    ],
};

/// What of a manipulator decides which variables it has.
#[derive(Clone, Copy, Debug)]
pub struct ArmLayout {
    /// Number of links, n.
    pub links: usize,
    /// How many of its joints are flexible.
    pub motors: usize,
    /// Its motors have dry friction.
    pub friction: bool,
}

/// Functions `name(n)`: the begin of each variable's elements, one after another; and the list of the variables. Those in
/// `friction` are there with an effect that needs motor friction.
macro_rules! layout {
    ($kind:ty, $n:ident, $s:ident:
        { $($name:ident $text:literal [$($d:expr),*] $unit:literal, $more:expr, $what:literal;)* }
        friction { $($dry:ident $dry_text:literal $dry_unit:literal, $dry_more:expr, $dry_what:literal;)* }
    ) => {
        /// Names of the variables in order, each with its number of elements for `n` links; those of friction are not among them.
        pub const NAMES: &[(&str, fn(usize) -> usize)] = &[$(($text, |$n| { let _ = $n; layout!(@length $($d),*) })),*];
        layout! { @next $n (0) count $($text $name = layout!(@length $($d),*);)* }
        layout! { @next $n (count($n)) count_with_friction $($dry_text $dry = $n;)* }
        /// The variables of such a manipulator in order, those of effects not among them.
        pub fn list($s: &ArmLayout) -> Vec<LayoutEntry<$kind>> {
            let $n = $s.links;
            let mut all: Vec<LayoutEntry<$kind>> = vec![
                $(LayoutEntry { name: $text, dimensions: vec![$($d),*], unit: $unit, kind: $more, text: $what }),*
            ];
            if $s.friction {
                all.extend([
                    $(LayoutEntry { name: $dry_text, dimensions: vec![$n], unit: $dry_unit, kind: $dry_more, text: $dry_what }),*
                ]);
            }
            all
        }
    };
    (@length) => { 1 };
    (@length $a:expr) => { $a };
    (@length $a:expr, $b:expr) => { $a * $b };
    (@next $n:ident ($begin:expr) $count:ident $text:literal $name:ident = $length:expr; $($rest:tt)*) => {
        #[doc = concat!("Begin of `", $text, "`.")]
        #[inline]
        pub const fn $name($n: usize) -> usize {
            let _ = $n;
            $begin
        }
        layout! { @next $n ($name($n) + $length) $count $($rest)* }
    };
    (@next $n:ident ($begin:expr) $count:ident) => {
        /// How many values there are.
        #[inline]
        pub const fn $count($n: usize) -> usize { $begin }
    };
}

/// Indices of the parameters.
pub mod parameter {
    use super::{ArmLayout, COUPLING, LayoutEntry};
    use crate::layout::AllowedValues::{Any, Item, NotNegative, OneUp, Positive};
    use crate::layout::{INITIAL, Parameter, tunable};

    layout! { Parameter, n, s: {
        base_mass "baseMass" [] "kg", tunable(Positive), "Satellite, m_0 (ARM-1)";
        base_inertia "baseInertia" [] "kg.m2", tunable(Positive), "Satellite about its centre of mass, I_0 (ARM-1)";
        mount_position "mountPosition" [2] "m", tunable(Any),
            "Joint 1 from the satellite's centre of mass, in the satellite's axes, p_m (eq. 21)";
        link_mass "linkMass" [n] "kg", tunable(Positive), "m_i (eq. 5)";
        link_inertia "linkInertia" [n] "kg.m2", tunable(Positive), "About the link's centre of mass, I_i (eq. 5)";
        link_length "linkLength" [n] "m", tunable(NotNegative), "From joint to joint, l_i (eq. 21)";
        link_center_of_mass "linkCenterOfMass" [n, 2] "m", tunable(Any), "From the link's joint, in the link's axes";
        motor_inertia "motorInertia" [n] "kg.m2", tunable(NotNegative),
            "Gear ratio squared included, I_mi (eq. 6); of a rigid joint: turns with it";
        gear_ratio "gearRatio" [n] "1", Parameter::fixed(OneUp), "Motor turns per joint turn, N; used by the geared coupling";
        joint_stiffness "jointStiffness" [n] "N.m/rad", tunable(NotNegative), "k_i (eq. 7); unused for a rigid joint";
        joint_damping "jointDamping" [n] "N.m.s/rad", tunable(NotNegative), "b_i (eq. 8); unused for a rigid joint";
        initial_base_position "initialBasePosition" [2] "m", INITIAL, "x_0, y_0 at the start";
        initial_base_attitude "initialBaseAttitude" [] "rad", INITIAL, "q_0 at the start";
        initial_base_velocity "initialBaseVelocity" [2] "m/s", INITIAL, "d(x_0), d(y_0) at the start";
        initial_base_rate "initialBaseRate" [] "rad/s", INITIAL, "d(q_0) at the start";
        initial_joint_angle "initialJointAngle" [n] "rad", INITIAL, "q_i at the start";
        initial_joint_velocity "initialJointVelocity" [n] "rad/s", INITIAL, "d(q_i) at the start";
        initial_motor_angle "initialMotorAngle" [n] "rad", Parameter::following("initialJointAngle"),
            "q_mi at the start; unset: the joint's angle, so that the spring is unstrained";
        initial_motor_velocity "initialMotorVelocity" [n] "rad/s", Parameter::following("initialJointVelocity"),
            "d(q_mi) at the start; unset: the joint's velocity";
        motor_coupling "motorCoupling" [] "", Parameter::fixed(Item(&COUPLING)),
            "How the rotors are coupled to the bodies that carry them";
        gravity "gravity" [2] "m/s2", tunable(Any),
            "Acceleration of free fall, inertial frame (ARM-13); 0 where the base floats";
        } friction {
        coulomb_friction "coulombFriction" "N.m", tunable(NotNegative), "At the motor, joint side, tau_c (EF-1)";
        static_friction "staticFriction" "N.m", tunable(NotNegative),
            "Break-away level, tau_s (EF-1); taken as tau_c where it is below";
        viscous_friction "viscousFriction" "N.m.s/rad", tunable(NotNegative), "At the motor, joint side, D_m (EF-1)";
        }
    }
}

/// Indices of the inputs.
pub mod input {
    use super::{ArmLayout, LayoutEntry};
    use crate::layout::InputStart;

    layout! { InputStart, n, s: {
        joint_torque "jointTorque" [n] "N.m", &[], "Motor torques, tau (eq. 2), joint side; positive turns the joint forward";
        base_force "baseForce" [2] "N", &[], "Force on the satellite at its centre of mass, inertial frame";
        base_torque "baseTorque" [] "N.m", &[], "Torque on the satellite";
        tip_force "tipForce" [2] "N", &[], "Force on the last link at its tip, inertial frame";
        tip_torque "tipTorque" [] "N.m", &[], "Torque on the last link";
        } friction {}
    }
}

/// What a motor's output shows: a state, where every joint has one.
fn of_motors(s: &ArmLayout, state: &'static str) -> Shows {
    if s.motors == s.links { Shows::State(state) } else { Shows::States }
}

/// Indices of the outputs.
pub mod output {
    use super::{ArmLayout, LayoutEntry, of_motors};
    use crate::layout::Shows;

    layout! { Shows, n, s: {
        base_position "basePosition" [2] "m", Shows::State("basePosition"), "Satellite's centre of mass, x_0, y_0, inertial frame";
        base_attitude "baseAttitude" [] "rad", Shows::State("baseAttitude"), "Satellite's attitude, q_0";
        base_velocity "baseVelocity" [2] "m/s", Shows::State("baseVelocity"), "d(x_0)/dt, d(y_0)/dt";
        base_rate "baseRate" [] "rad/s", Shows::State("baseRate"), "d(q_0)/dt";
        joint_angle "jointAngle" [n] "rad", Shows::State("jointAngle"), "Link against the link before, q_i";
        joint_velocity "jointVelocity" [n] "rad/s", Shows::State("jointVelocity"), "d(q_i)/dt";
        motor_angle "motorAngle" [n] "rad", of_motors(s, "motorAngle"),
            "Motor, joint side, against the link before, q_mi; of a rigid joint: the joint's";
        motor_velocity "motorVelocity" [n] "rad/s", of_motors(s, "motorVelocity"), "d(q_mi)/dt";
        tip_position "tipPosition" [2] "m", Shows::States, "End-effector, x_e, y_e, inertial frame (eq. 21)";
        tip_attitude "tipAttitude" [] "rad", Shows::States, "Attitude of the last link";
        tip_velocity "tipVelocity" [2] "m/s", Shows::States, "d(x_e)/dt, d(y_e)/dt";
        linear_momentum "linearMomentum" [2] "kg.m/s", Shows::States, "Of the whole system, inertial frame";
        angular_momentum "angularMomentum" [] "kg.m2/s", Shows::States,
            "Of the whole system about the inertial origin, rotors included";
        kinetic_energy "kineticEnergy" [] "J", Shows::States, "T (eq. 4-6), rotors included";
        potential_energy "potentialEnergy" [] "J", Shows::States, "V (eq. 7)";
        tip_rate "tipRate" [] "rad/s", Shows::States, "Of the last link";
        } friction {
        friction_torque "frictionTorque" "N.m", Shows::All, "At the motors, joint side; positive against forward motion (EF-1)";
        sticking "sticking" "", Shows::Flag, "The motor sticks (EF-1)";
        }
    }
}

/// The states in order, those of effects not among them.
pub fn states(s: &ArmLayout) -> Vec<LayoutEntry<LayoutState>> {
    let state =
        |name, dimensions: &[usize], [unit, rate]: [&'static str; 2], nominal, depends, text| LayoutEntry {
            name,
            dimensions: dimensions.to_vec(),
            unit,
            kind: LayoutState::new(rate, nominal, depends),
            text,
        };
    let (joints, motors) = ([s.links], [s.motors]);
    let (shift, turn) = (["m", "m/s"], ["rad", "rad/s"]);
    let (speed, spin) = (["m/s", "m/s2"], ["rad/s", "rad/s2"]);
    let all = [
        state(
            "basePosition",
            &[2],
            shift,
            0.001,
            Shows::State("baseVelocity"),
            "satellite's position, x_0, y_0",
        ),
        state("baseAttitude", &[], turn, 0.001, Shows::State("baseRate"), "satellite's attitude, q_0"),
        state("jointAngle", &joints, turn, 0.01, Shows::State("jointVelocity"), "joint angles, q_i"),
        state(
            "motorAngle",
            &motors,
            turn,
            0.01,
            Shows::State("motorVelocity"),
            "motor angles of the flexible joints, q_mi",
        ),
        state("baseVelocity", &[2], speed, 0.001, Shows::All, "satellite's velocity (eq. 9)"),
        state("baseRate", &[], spin, 0.001, Shows::All, "satellite's rate (eq. 9)"),
        state("jointVelocity", &joints, spin, 0.001, Shows::All, "joint velocities (eq. 9)"),
        state(
            "motorVelocity",
            &motors,
            spin,
            0.001,
            Shows::All,
            "motor velocities of the flexible joints (eq. 9)",
        ),
    ];
    all.into_iter().filter(|e| !e.is_empty()).collect()
}
