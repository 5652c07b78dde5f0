//! The list of effects: a new one is named at the end of this file and nowhere else.

use super::{Effect, Local, Spec};
use crate::drive::{BaseMotion, BaseWrench, DriveTrain, FlyerBase, Spring};
use crate::friction::Levels;
use crate::space::spatial::SpatialWrench;
use trueup_numerics::Scalar;

/// One method of [`EffectKind`] per hook of [`Effect`], passed on to the effect's own file.
macro_rules! effects {
    ($($module:ident :: $name:ident),* $(,)?) => {
        use super::{$($module),*};

        /// An effect of the library.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum EffectKind { $($name),* }

        /// All effects, in the order in which they act.
        pub const ALL: &[EffectKind] = &[$(EffectKind::$name),*];

        effects! { @hooks [$($module::$name),*]
            gear<T>(l: &Local<T>, d: &mut DriveTrain<T>) -> ();
            actuator<T>(l: &Local<T>, d: &DriveTrain<T>, torque: T) -> T;
            friction<T>(l: &Local<T>, d: &DriveTrain<T>, direction: f64, levels: &mut Levels<T>) -> ();
            spring<T>(l: &Local<T>, d: &DriveTrain<T>, s: &mut Spring<T>) -> ();
            link_torque<T>(l: &Local<T>, d: &DriveTrain<T>) -> T;
            joint_torque<T>(l: &Local<T>, d: &DriveTrain<T>) -> T;
            field<T>(l: &Local<T>) -> [T; 2];
            base<T>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T>;
            tip<T>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T>;
            space_base<T>(l: &Local<T>, b: &FlyerBase<T>) -> SpatialWrench<T>;
            space_tip<T>(l: &Local<T>, b: &FlyerBase<T>) -> SpatialWrench<T>;
            sensor<T>(l: &Local<T>, t: T, reading: T) -> T;
            sensor_start<T>(l: &Local<T>, reading: T, x: &mut [T]) -> ();
            sensor_rates<T>(l: &Local<T>, reading: T, dx: &mut [T]) -> ();
            start<T>(l: &Local<T>, d: &DriveTrain<T>, x: &mut [T]) -> ();
            rates<T>(l: &Local<T>, d: &DriveTrain<T>, s: &Spring<T>, dx: &mut [T]) -> ();
            outputs<T>(l: &Local<T>, d: &DriveTrain<T>, y: &mut [T]) -> ();
            indicators<T>(l: &Local<T>, d: &DriveTrain<T>, z: &mut [T]) -> ();
            energy<T>(l: &Local<T>, d: &DriveTrain<T>) -> [T; 2];
            angular_momentum<T>(l: &Local<T>, d: &DriveTrain<T>) -> T;
        }

        impl EffectKind {
            /// What it declares of itself.
            pub fn spec(self) -> &'static Spec {
                match self { $(Self::$name => &<$module::$name as Effect>::SPEC),* }
            }
            pub(crate) fn dry(self, l: &Local<f64>) -> bool {
                match self { $(Self::$name => $module::$name::dry(l)),* }
            }
            pub(crate) fn next_event(self, l: &Local<f64>) -> f64 {
                match self { $(Self::$name => $module::$name::next_event(l)),* }
            }
            pub(crate) fn update(self, l: &Local<f64>, d: &DriveTrain<f64>, modes: &mut [i32]) {
                match self { $(Self::$name => $module::$name::update(l, d, modes)),* }
            }
        }
    };
    (@hooks $list:tt $($hook:ident<T>($($arg:ident: $type:ty),*) -> $out:ty;)*) => {
        $(effects! { @hook $list $hook ($($arg: $type),*) -> $out })*
    };
    (@hook [$($module:ident :: $name:ident),*] $hook:ident $args:tt -> $out:ty) => {
        effects! { @define $hook $args -> $out, { $($module::$name)* } }
    };
    (@define $hook:ident ($($arg:ident: $type:ty),*) -> $out:ty, $effects:tt) => {
        impl EffectKind {
            #[inline]
            pub(crate) fn $hook<T: Scalar>(self, $($arg: $type),*) -> $out {
                effects! { @match self $hook ($($arg),*) $effects }
            }
        }
    };
    (@match $kind:ident $hook:ident $args:tt { $($module:ident :: $name:ident)* }) => {
        match $kind { $(EffectKind::$name => effects! { @call $module::$name $hook $args }),* }
    };
    (@call $module:ident :: $name:ident $hook:ident ($($arg:ident),*)) => {
        <$module::$name as Effect>::$hook($($arg),*)
    };
}

// In the order in which they act on the same thing: what changes the deflection of a spring comes before
// what adds to its torque, what sets a friction level before what shapes it.
effects! {
    external_force::ExternalForce,
    position_servo::PositionServo,
    current_saturation::CurrentSaturation,
    actuator_lag::ActuatorLag,
    torque_ripple::TorqueRipple,
    motor_friction::MotorFriction,
    stribeck_friction::StribeckFriction,
    asymmetric_friction::AsymmetricFriction,
    load_dependent_friction::LoadDependentFriction,
    nonlinear_viscous_friction::NonlinearViscousFriction,
    friction_drift::FrictionDrift,
    presliding_friction::PreslidingFriction,
    kinematic_error::KinematicError,
    joint_flexibility::JointFlexibility,
    backlash::Backlash,
    nonlinear_stiffness::NonlinearStiffness,
    transmission_hysteresis::TransmissionHysteresis,
    nonlinear_damping::NonlinearDamping,
    flexible_link::FlexibleLink,
    load_friction::LoadFriction,
    gravity_torque::GravityTorque,
    cable_stiffness::CableStiffness,
    table_tilt::TableTilt,
    base_drag::BaseDrag,
    base_thrust::BaseThrust,
    appendage_mode::AppendageMode,
    sensor_eccentricity::SensorEccentricity,
    sensor_drift::SensorDrift,
    sensor_delay::SensorDelay,
}
