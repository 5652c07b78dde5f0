//! Joint control: P/PI cascade and wave-based control (S3 section 6), for one joint and for n joints.
//!
//! Per joint, load-referred, with θ0 = motorAngle/gearRatio, θ1 the angle of the load and the position
//! error e = r − θ1:
//!
//! ```text
//! P_PI          v = K_p e
//! WBC           v = K_p (r/2 + b0 − θ0)               b0: return wave of (θ0, θ1)
//! VWBC          v = K_p e/2 + b0v                     b0v: return wave of (θ0', θ1')
//! VWBC_WASHOUT  v = K_p e (1 + LP)/2 + (1 − LP) b0v   LP = ω_h/(s + ω_h)
//! WBC_ADAPTIVE, VWBC_ADAPTIVE                         as WBC and VWBC with ω_n as [`adaptation`] has it
//! τ = K_vp (v + v_ff − θ0') + z + τ_ff,   output = limit(τ/(n K_t)),   z' = (limited τ − τ_ff − z)/T_i
//! ```
//!
//! Unlimited, z' is K_vp (v + v_ff − θ0')/T_i: the integral part of the PI. Limited, it is back-calculation
//! with the tracking time T_i, so z never leaves the range of the actuator and, being continuous in the
//! states, the law cannot chatter at the limit.
//!
//! Sampled (samplePeriod T_s > 0), the law is evaluated at k T_s and its output held; both wave filters, the
//! washout and the lag that makes up the PI's integral are each discretised exactly for inputs held over T_s
//! (the integral gain is K_vp (1 − exp(−T_s/T_i)) per sample, K_vp T_s/T_i for T_s ≪ T_i).
//!
//! P_PI and VWBC_WASHOUT leave no static error under a constant load torque with load twist δ = θ0 − θ1;
//! WBC drifts at −ω_n δ, and VWBC keeps an error of magnitude ω_n δ/K_p.
//!
//! The split holds a0 + b0 = θ0 exactly whatever ω_n does: a0 is θ0 − b0, no state of its own. At rest without a twist
//! its filters are at their inputs, and a change of ω_n moves nothing; [`waves::growth_rates`] sees to it that one on
//! the way leaves nothing behind.

pub mod adaptation;
mod check;
mod hybrid;
mod joint;
pub mod law;
pub mod waves;

pub use hybrid::ManipulatorController;
pub use joint::JointController;
pub use law::Strategy;

/// Order of the parameters that each joint has: parameter i of joint j is at `i * n + j`.
pub mod parameter {
    /// K_p in 1/s.
    pub const POSITION_GAIN: usize = 0;
    /// K_vp in N.m.s/rad, load-referred.
    pub const VELOCITY_GAIN: usize = 1;
    /// T_i in s.
    pub const VELOCITY_INTEGRAL_TIME: usize = 2;
    /// n: turns of the motor per turn of the load.
    pub const GEAR_RATIO: usize = 3;
    /// K_t: motor torque per output.
    pub const TORQUE_CONSTANT: usize = 4;
    /// Largest magnitude of the output.
    pub const LIMIT: usize = 5;
    /// ω_n in rad/s.
    pub const WAVE_FREQUENCY: usize = 6;
    /// ω_h in rad/s.
    pub const WASHOUT_FREQUENCY: usize = 7;
    /// Parameters per joint. At `COUNT * n` is the sample period in s, behind it the strategy, and then
    /// what [`super::adaptation::parameter`] has.
    pub const COUNT: usize = 8;
}

/// Order of the inputs: input i of joint j is at `i * n + j`.
pub mod input {
    /// r in rad, load side.
    pub const POSITION_REFERENCE: usize = 0;
    /// Added to the velocity reference, in rad/s, load side.
    pub const VELOCITY_FEEDFORWARD: usize = 1;
    /// n θ0 in rad.
    pub const MOTOR_ANGLE: usize = 2;
    /// n θ0' in rad/s.
    pub const MOTOR_VELOCITY: usize = 3;
    /// θ1 in rad.
    pub const LOAD_ANGLE: usize = 4;
    /// θ1' in rad/s.
    pub const LOAD_VELOCITY: usize = 5;
    /// Inputs per joint; behind those of an arm τ_ff of each joint, in N.m, load-referred.
    pub const COUNT: usize = 6;
}

/// Order of the states: state i of joint j is at `i * n + j`.
pub mod state {
    /// Split of the angles, four states as [`super::waves::WaveSplit`] has them: b0, b0', G a0, (G a0)'.
    pub const POSITION_WAVES: usize = 0;
    /// Split of the velocities, likewise.
    pub const VELOCITY_WAVES: usize = 4;
    /// Output of the washout's low pass in rad/s.
    pub const WASHOUT: usize = 8;
    /// Integral part z of the PI in N.m, load-referred.
    pub const INTEGRAL_TORQUE: usize = 9;
    /// The output of the last sample; unused while continuous.
    pub const HELD_OUTPUT: usize = 10;
    /// States per joint; behind them those of [`super::adaptation::state`].
    pub const COUNT: usize = 11;
}

/// Order of the outputs: output i of joint j is at `i * n + j`.
pub mod output {
    /// Command to the motor, limited.
    pub const COMMAND: usize = 0;
    /// ω_n in rad/s; where the strategy does not adapt, the parameter.
    pub const WAVE_FREQUENCY_USED: usize = 1;
    /// Whether ω_n moves.
    pub const ADAPTATION_ACTIVE: usize = 2;
    /// Outputs per joint.
    pub const COUNT: usize = 3;
}
