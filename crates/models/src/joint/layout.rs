//! The variables of [`TwoMassJoint`](super::TwoMassJoint): what each is, and where its value is in the vectors.

use crate::layout::{LayoutEntry, LayoutState, Shows, TermFactor};

/// What of a joint decides which variables it has, and what they say.
#[derive(Clone, Copy, Debug)]
pub struct JointLayout {
    /// It has its spring.
    pub flexible: bool,
    /// It has no effects: it is linear where its equations are.
    pub plain: bool,
    /// Motor turns per load turn, for typical magnitudes.
    pub gear_ratio: f64,
}

/// Indices, and the list of the variables in their order.
macro_rules! variables {
    ($kind:ty, $s:ident: $($index:ident $name:literal $unit:literal, $more:expr, $text:expr;)*) => {
        #[allow(non_camel_case_types, clippy::upper_case_acronyms)]
        enum Index { $($index,)* End }
        $(#[doc = concat!("Index of `", $name, "`.")] pub const $index: usize = Index::$index as usize;)*
        /// How many there are.
        pub const COUNT: usize = Index::End as usize;
        /// FMU variables with their units.
        pub const NAMES: [(&str, &str); COUNT] = [$(($name, $unit)),*];
        /// The variables in order.
        pub fn list($s: &JointLayout) -> Vec<LayoutEntry<$kind>> {
            let _ = $s;
            vec![$(LayoutEntry { name: $name, dimensions: Vec::new(), unit: $unit, kind: $more, text: $text }),*]
        }
    };
}

/// An additional text for a rigid joint.
macro_rules! unless_flexible {
    ($s:ident, $text:literal, $more:literal) => {
        if $s.flexible { $text } else { concat!($text, $more) }
    };
}

/// Indices of the parameters.
pub mod parameter {
    use super::{JointLayout, LayoutEntry};
    use crate::layout::AllowedValues::{Any, NotNegative, Positive};
    use crate::layout::Parameter;

    variables! { Parameter, s:
        MOTOR_INERTIA "motorInertia" "kg.m2", Parameter::tunable(Positive), "Motor with planetary stage, J_motor (TMJ-1)";
        LOAD_INERTIA "loadInertia" "kg.m2", Parameter::tunable(Positive), "Load, load side, J_load (TMJ-3); with a flexible link its hub";
        GEAR_RATIO "gearRatio" "1", Parameter::fixed(Positive), "Motor turns per load turn, n_eq (TMJ-2)";
        TORQUE_CONSTANT "torqueConstant" "N.m/A", Parameter::tunable(Any), "Motor torque per current, K_t (TMJ-1)";
        STIFFNESS "stiffness" "N.m/rad", Parameter::tunable(if s.flexible { Positive } else { NotNegative }),
            unless_flexible!(s, "Transmission, motor side, K_eq (TMJ-2)", " (unused: the joint is rigid)");
        DAMPING "damping" "N.m.s/rad", Parameter::tunable(NotNegative),
            unless_flexible!(s, "Transmission, motor side, D_eq (TMJ-2)", " (unused: the joint is rigid)");
        COULOMB_FRICTION "coulombFriction" "N.m", Parameter::tunable(NotNegative), "At the motor, tau_c (TMJ-4)";
        STATIC_FRICTION "staticFriction" "N.m", Parameter::tunable(NotNegative),
            "Break-away level at the motor, tau_s (TMJ-4); taken as tau_c where it is below";
        VISCOUS_FRICTION "viscousFriction" "N.m.s/rad", Parameter::tunable(NotNegative), "At the motor, D_m (TMJ-4)";
        INITIAL_MOTOR_ANGLE "initialMotorAngle" "rad", Parameter::initial(), "q_m at the start";
        INITIAL_MOTOR_VELOCITY "initialMotorVelocity" "rad/s", Parameter::initial(), "d(q_m)/dt at the start";
        INITIAL_LOAD_ANGLE "initialLoadAngle" "rad", Parameter::initial(),
            unless_flexible!(s, "q_l at the start", " (unused: the joint is rigid, the load follows the motor)");
        INITIAL_LOAD_VELOCITY "initialLoadVelocity" "rad/s", Parameter::initial(),
            unless_flexible!(s, "d(q_l)/dt at the start", " (unused: the joint is rigid, the load follows the motor)");
    }
}

/// Indices of the inputs.
pub mod input {
    use super::{JointLayout, LayoutEntry};
    use crate::layout::InputStart;

    variables! { InputStart, s:
        MOTOR_CURRENT "motorCurrent" "A", &[], "Motor current, I (TMJ-1); positive drives the motor forward";
        EXTERNAL_TORQUE "externalTorque" "N.m", &[], "Torque on the load, tau_ext (TMJ-3); positive drives the load forward";
    }
}

const ANGLE: &str = "state.motorAngle";
const VELOCITY: &str = "state.motorVelocity";
const TWIST: &str = "state.twist";
const LOAD: &str = "state.loadVelocity";
/// What the spring's torque is made of, and what the load's acceleration is.
const SPRING: &[(&str, TermFactor)] =
    &[(TWIST, TermFactor::Tunable), (VELOCITY, TermFactor::Tunable), (LOAD, TermFactor::Tunable)];
const PUSHED: &[(&str, TermFactor)] = &[
    (TWIST, TermFactor::Tunable),
    (VELOCITY, TermFactor::Tunable),
    (LOAD, TermFactor::Tunable),
    ("externalTorque", TermFactor::Tunable),
];

/// Linear without effects; with one, it is what it would be with any.
fn linear(s: &JointLayout, terms: &'static [(&'static str, TermFactor)], with_effects: Shows) -> Shows {
    if s.plain { Shows::Linear(terms) } else { with_effects }
}

/// Indices of the outputs.
pub mod output {
    use super::{ANGLE, JointLayout, LOAD, LayoutEntry, PUSHED, SPRING, TWIST, TermFactor, VELOCITY, linear};
    use crate::layout::Shows;

    fn load_angle(s: &JointLayout) -> Shows {
        const BOTH: &[(&str, TermFactor)] = &[(ANGLE, TermFactor::Fixed), (TWIST, TermFactor::Fixed)];
        if s.flexible {
            linear(s, BOTH, Shows::On(&[ANGLE, TWIST]))
        } else {
            linear(s, &[(ANGLE, TermFactor::Fixed)], Shows::On(&[ANGLE]))
        }
    }
    fn load_velocity(s: &JointLayout) -> Shows {
        if s.flexible {
            linear(s, &[(LOAD, TermFactor::Constant)], Shows::On(&[LOAD]))
        } else {
            linear(s, &[(VELOCITY, TermFactor::Fixed)], Shows::On(&[VELOCITY]))
        }
    }

    variables! { Shows, s:
        MOTOR_ANGLE "motorAngle" "rad", Shows::State("motorAngle"), "Motor angle, q_m";
        MOTOR_VELOCITY "motorVelocity" "rad/s", Shows::State("motorVelocity"), "Motor velocity, d(q_m)/dt";
        MOTOR_ACCELERATION "motorAcceleration" "rad/s2", Shows::All, "Motor acceleration, dd(q_m)/dt2 (TMJ-1)";
        LOAD_ANGLE "loadAngle" "rad", load_angle(s), "Load angle, q_l";
        LOAD_VELOCITY "loadVelocity" "rad/s", load_velocity(s), "Load velocity, d(q_l)/dt";
        LOAD_ACCELERATION "loadAcceleration" "rad/s2", if s.flexible { linear(s, PUSHED, Shows::All) } else { Shows::All },
            "Load acceleration, dd(q_l)/dt2 (TMJ-3)";
        MOTOR_TORQUE "motorTorque" "N.m", linear(s, &[("motorCurrent", TermFactor::Tunable)], Shows::StatesAnd(&["motorCurrent"])),
            "Torque of the motor, K_t I (TMJ-1)";
        TRANSMISSION_TORQUE "transmissionTorque" "N.m", if s.flexible { linear(s, SPRING, Shows::States) } else { Shows::All },
            "Motor side, tau_lm (TMJ-2); positive drives the load forward";
        FRICTION_TORQUE "frictionTorque" "N.m", Shows::All, "At the motor, tau_fr (TMJ-4); positive against forward motion";
        STICKING "sticking" "", Shows::Flag, "The motor sticks (TMJ-4)";
    }
    /// Those that the states alone determine.
    pub const STATES: [usize; 4] = [MOTOR_ANGLE, MOTOR_VELOCITY, LOAD_ANGLE, LOAD_VELOCITY];
}

/// The states in order. Magnitudes are what a solver should resolve, not what the joint reaches: tolerances are relative to
/// them near zero.
pub fn states(s: &JointLayout) -> Vec<LayoutEntry<LayoutState>> {
    let state = |name, unit, rate, nominal, depends, text| LayoutEntry {
        name,
        dimensions: Vec::new(),
        unit,
        kind: LayoutState::new(rate, nominal, depends),
        text,
    };
    let mut all = vec![
        state("motorAngle", "rad", "rad/s", 0.1, Shows::State("motorVelocity"), "motor angle, q_m"),
        state("motorVelocity", "rad/s", "rad/s2", 1.0, Shows::All, "motor velocity, d(q_m)/dt (TMJ-1)"),
    ];
    if s.flexible {
        const TURNING: &[(&str, TermFactor)] = &[(VELOCITY, TermFactor::Constant), (LOAD, TermFactor::Fixed)];
        let turning = linear(s, TURNING, Shows::On(&[VELOCITY, LOAD]));
        all.push(state("twist", "rad", "rad/s", 0.01, turning, "twist, motor side, epsilon = q_m - n q_l"));
        let pushed = linear(s, PUSHED, Shows::StatesAnd(&["externalTorque"]));
        let nominal = 1.0 / s.gear_ratio;
        all.push(state(
            "loadVelocity",
            "rad/s",
            "rad/s2",
            nominal,
            pushed,
            "load velocity, d(q_l)/dt (TMJ-3)",
        ));
    }
    all
}
