//! Where the values of a manipulator with `n` links lie in its vectors, and what may be chosen of its base.

use crate::layout::Items;

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

/// Functions `name(n)`: the begin of each variable's elements, one after another.
macro_rules! layout {
    ($n:ident: $($text:literal $name:ident = $length:expr;)*) => {
        /// Names of the variables in order, each with its number of elements for `n` links.
        pub const NAMES: &[(&str, fn(usize) -> usize)] = &[$(($text, |$n| { let _ = $n; $length })),*];
        layout! { @next $n (0) $($text $name = $length;)* }
    };
    (@next $n:ident ($begin:expr) $text:literal $name:ident = $length:expr; $($rest:tt)*) => {
        #[doc = concat!("Begin of `", $text, "`.")]
        #[inline]
        pub const fn $name($n: usize) -> usize {
            let _ = $n;
            $begin
        }
        layout! { @next $n ($name($n) + $length) $($rest)* }
    };
    (@next $n:ident ($begin:expr)) => {
        /// How many values there are.
        #[inline]
        pub const fn count($n: usize) -> usize { $begin }
    };
}

/// Indices of the parameters.
pub mod parameter {
    layout! { n:
        "baseMass" base_mass = 1;
        "baseInertia" base_inertia = 1;
        "mountPosition" mount_position = 2;
        "linkMass" link_mass = n;
        "linkInertia" link_inertia = n;
        "linkLength" link_length = n;
        "linkCenterOfMass" link_center_of_mass = 2 * n;
        "motorInertia" motor_inertia = n;
        "gearRatio" gear_ratio = n;
        "jointStiffness" joint_stiffness = n;
        "jointDamping" joint_damping = n;
        "initialBasePosition" initial_base_position = 2;
        "initialBaseAttitude" initial_base_attitude = 1;
        "initialBaseVelocity" initial_base_velocity = 2;
        "initialBaseRate" initial_base_rate = 1;
        "initialJointAngle" initial_joint_angle = n;
        "initialJointVelocity" initial_joint_velocity = n;
        "initialMotorAngle" initial_motor_angle = n;
        "initialMotorVelocity" initial_motor_velocity = n;
        "motorCoupling" motor_coupling = 1;
        "gravity" gravity = 2;
    }
    // Only with an effect that needs motor friction.
    /// Begin of `coulombFriction`, where there is friction.
    pub const fn coulomb_friction(n: usize) -> usize {
        count(n)
    }
    /// Begin of `staticFriction`, where there is friction.
    pub const fn static_friction(n: usize) -> usize {
        count(n) + n
    }
    /// Begin of `viscousFriction`, where there is friction.
    pub const fn viscous_friction(n: usize) -> usize {
        count(n) + 2 * n
    }
    /// How many values there are with friction.
    pub const fn count_with_friction(n: usize) -> usize {
        count(n) + 3 * n
    }
}

/// Indices of the inputs.
pub mod input {
    layout! { n:
        "jointTorque" joint_torque = n;
        "baseForce" base_force = 2;
        "baseTorque" base_torque = 1;
        "tipForce" tip_force = 2;
        "tipTorque" tip_torque = 1;
    }
}

/// Indices of the outputs.
pub mod output {
    layout! { n:
        "basePosition" base_position = 2;
        "baseAttitude" base_attitude = 1;
        "baseVelocity" base_velocity = 2;
        "baseRate" base_rate = 1;
        "jointAngle" joint_angle = n;
        "jointVelocity" joint_velocity = n;
        "motorAngle" motor_angle = n;
        "motorVelocity" motor_velocity = n;
        "tipPosition" tip_position = 2;
        "tipAttitude" tip_attitude = 1;
        "tipVelocity" tip_velocity = 2;
        "linearMomentum" linear_momentum = 2;
        "angularMomentum" angular_momentum = 1;
        "kineticEnergy" kinetic_energy = 1;
        "potentialEnergy" potential_energy = 1;
        "tipRate" tip_rate = 1;
    }
    /// Begin of `frictionTorque`, where there is friction.
    pub const fn friction_torque(n: usize) -> usize {
        count(n)
    }
    /// Begin of `sticking`, where there is friction.
    pub const fn sticking(n: usize) -> usize {
        count(n) + n
    }
    /// How many values there are with friction.
    pub const fn count_with_friction(n: usize) -> usize {
        count(n) + 2 * n
    }
}
