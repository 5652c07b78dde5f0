//! `actuator-lag`: current or torque follows its command with a lag or a dead time.
//!
//! (EF-11) T dtau/dt = u(t - d) - tau. The dead time is read from the Legendre memory of the last
//! sqrt(d^2 + (5 ms)^2) seconds; the lag is (1 + s (W - T)) / (1 + s W) with W = sqrt(T^2 + (1 ms)^2), so that both go
//! to 0 smoothly and pass the command exactly there.
//!
//! What it gets wrong: lags far below 1 ms have the right mean delay T only; jumps of the command are rounded off over
//! a third of the dead time.

use super::*;
use crate::effect::memory::{DELAY, IN_A_DRIVE, ON_A_FREE_FLYER, ORDER, read};

pub(crate) struct ActuatorLag;

/// Shortest time constant, s.
const SHORTEST: f64 = 1e-3;

/// Lag and dead time are begun from together, each a little longer than a delay by itself.
const DRIVE: SearchRange = SearchRange { looks: &[0.26, 1.3, 3.9, 9.1], ..IN_A_DRIVE };
const FREE_FLYER: SearchRange = SearchRange { looks: &[0.65, 3.9, 13.0, 39.0], ..ON_A_FREE_FLYER };

/// The command as it comes behind the dead time.
fn delayed<T: Scalar>(l: &Local<T>, command: T) -> T {
    read(core::array::from_fn(|k| l.x(k)), command, l.p(1))
}
fn time<T: Scalar>(l: &Local<T>) -> T {
    (l.p(0) * l.p(0) + SHORTEST * SHORTEST).sqrt()
}

const fn torque(name: &'static str, description: &'static str) -> SignalSpec {
    SignalSpec {
        name,
        unit: "N.m",
        arm_name: "",
        description,
        nominal: 1e-4,
        rate_unit: "N.m/s",
        boolean: false,
    }
}

impl Effect for ActuatorLag {
    const SPEC: Spec = Spec {
        id: "actuator-lag",
        component: "actuator",
        summary: "current or torque follows its command with a lag or a dead time",
        noun: "a lag of the actuator behind its command",
        check: "Command a step of current or torque and measure what is delivered: how late does it come, how fast does it rise?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "actuatorLag",
                unit: "s",
                description: "Time constant of the lag, T (EF-11)",
                min: 0.0,
                max: 5.0,
                joint_start: 0.005,
                arm_start: 0.05,
                scale: DELAY,
                search: DRIVE,
                arm_search: Some(FREE_FLYER),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "actuatorDelay",
                unit: "s",
                description: "Dead time, d (EF-11)",
                min: 0.0,
                max: 0.5,
                scale: DELAY,
                search: DRIVE,
                arm_search: Some(FREE_FLYER),
                ..ParameterSpec::NONE
            },
        ],
        states: &[
            torque("commandPast0", "Legendre coefficient of the recent commands (EF-11)"),
            torque("commandPast1", "Legendre coefficient of the recent commands (EF-11)"),
            torque("commandPast2", "Legendre coefficient of the recent commands (EF-11)"),
            torque("commandPast3", "Legendre coefficient of the recent commands (EF-11)"),
            torque("laggedTorque", "Torque behind the lag (EF-11)"),
        ],
        shifts: true,
        on_command: true,
        ..Spec::NONE
    };

    fn start<T: Scalar>(_l: &Local<T>, d: &DriveTrain<T>, x: &mut [T]) {
        memory::start(d.command, x);
        x[ORDER] = d.command;
    }
    fn rates<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _s: &Spring<T>, dx: &mut [T]) {
        memory::rates(core::array::from_fn(|k| l.x(k)), d.torque, l.p(1), dx);
        dx[ORDER] = (delayed(l, d.torque) - l.x(ORDER)) / time(l);
    }
    fn actuator<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, torque: T) -> T {
        let command = delayed(l, torque);
        command - (command - l.x(ORDER)) * (l.p(0) / time(l))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef11_a_step_follows_the_exponential() {
        // Without dead time: tau = 1 - exp(-t/T) but for the share (1 - T/W) that W > T lets through at once.
        let (lag, h) = (0.02, 1e-5);
        let (p, mut x) = ([lag, 0.0], [0.0; 5]);
        let mut t = 0.0;
        for _ in 0..4000 {
            let slope = |x: &[f64; 5]| {
                let mut dx = [0.0; 5];
                let d = DriveTrain { torque: 1.0, ..DriveTrain::default() };
                ActuatorLag::rates(&Local::new(&p, x, &[], 0, 1), &d, &Spring::default(), &mut dx);
                dx
            };
            let k = slope(&x);
            let k = slope(&core::array::from_fn(|i| x[i] + 0.5 * h * k[i]));
            (0..5).for_each(|i| x[i] += h * k[i]);
            t += h;
        }
        let w = f64::sqrt(lag * lag + 1e-6);
        let torque: f64 = ActuatorLag::actuator(&Local::new(&p, &x, &[], 0, 1), &DriveTrain::default(), 1.0);
        // The midpoint rule is off by t h^2 / (6 W^3) of the exponential.
        let rule = t * h * h / (6.0 * w * w * w);
        assert!((torque - (1.0 - lag / w * (-t / w).exp())).abs() < rule * (-t / w).exp() + 1e-12);
        assert!((torque - (1.0 - (-t / lag).exp())).abs() < 1e-3);
    }

    #[test]
    fn ef11_a_ramp_is_late_by_lag_and_dead_time_together() {
        // In the steady state of u = t: coefficients t - W/2, -W/2; the lagged torque is late by W more.
        let (lag, delay, t) = (0.03, 0.02, 5.0);
        let (w, window) = (f64::sqrt(lag * lag + 1e-6), f64::sqrt(delay * delay + 25e-6));
        let x = [t - 0.5 * window, -0.5 * window, 0.0, 0.0, t - delay - w];
        let (p, mut dx) = ([lag, delay], [0.0; 5]);
        let l = Local::new(&p, &x, &[], 0, 1);
        ActuatorLag::rates(
            &l,
            &DriveTrain { torque: t, ..DriveTrain::default() },
            &Spring::default(),
            &mut dx,
        );
        assert!((dx[0] - 1.0).abs() < 1e-9 && dx[1].abs() < 1e-9 && (dx[4] - 1.0).abs() < 1e-9, "{dx:?}");
        let torque: f64 = ActuatorLag::actuator(&l, &DriveTrain::default(), t);
        assert!((torque - (t - delay - lag)).abs() < 1e-12);
    }
}
