//! `sensor-delay`: one channel late against the others.
//!
//! (EF-30) reading y(t) = y_true(t - d), from the Legendre memory of the last sqrt(d^2 + (5 ms)^2) seconds; before the
//! start the signal is constant.
//!
//! What it gets wrong: a jump of the signal is rounded off over a third of the delay.

use super::*;
use crate::effect::memory::{DELAY, IN_A_DRIVE, ON_A_FREE_FLYER, ORDER, read};

pub(crate) struct SensorDelay;

fn history<T: Scalar>(l: &Local<T>) -> [T; ORDER] {
    core::array::from_fn(|k| l.x(k))
}

const fn coefficient(name: &'static str) -> SignalSpec {
    SignalSpec {
        name,
        unit: "*",
        arm_name: "",
        description: "Legendre coefficient of the recent past (EF-30)",
        nominal: 1e-2,
        rate_unit: "*/s",
        boolean: false,
    }
}

impl Effect for SensorDelay {
    const SPEC: Spec = Spec {
        id: "sensor-delay",
        component: "sensor:motorAngle",
        summary: "one channel late against the others",
        noun: "a late reading",
        check: "Compare the time stamps of this sensor with those of the others on one sharp event; check filters and the bus.",
        scope: Scope::Channel,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        places: channel::ALL,
        parameters: &[ParameterSpec {
            name: "delay",
            unit: "s",
            description: "How late the channel is, d (EF-30)",
            min: 0.0,
            max: 0.5,
            joint_start: 0.01,
            arm_start: 0.01,
            scale: DELAY,
            search: IN_A_DRIVE,
            arm_search: Some(ON_A_FREE_FLYER),
            ..ParameterSpec::NONE
        }],
        states: &[coefficient("past0"), coefficient("past1"), coefficient("past2"), coefficient("past3")],
        shifts: true,
        ..Spec::NONE
    };

    fn sensor<T: Scalar>(l: &Local<T>, _t: T, reading: T) -> T {
        read(history(l), reading, l.p(0))
    }
    fn sensor_start<T: Scalar>(_l: &Local<T>, reading: T, x: &mut [T]) {
        memory::start(reading, x);
    }
    fn sensor_rates<T: Scalar>(l: &Local<T>, reading: T, dx: &mut [T]) {
        memory::rates(history(l), reading, l.p(0), dx);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef30_a_ramp_is_late_by_the_delay_exactly() {
        // u = t has the coefficients t - W/2, -(W/2): the memory carries them on unchanged in form.
        for d in [0.002, 0.02] {
            let w = f64::sqrt(d * d + 25e-6);
            let x = [3.0 - 0.5 * w, -0.5 * w, 0.0, 0.0];
            let (p, mut dx) = ([d], [0.0; 4]);
            let l = Local::new(&p, &x, &[], 0, 1);
            SensorDelay::sensor_rates(&l, 3.0, &mut dx);
            assert!((dx[0] - 1.0).abs() < 1e-10 && dx[1..].iter().all(|dx| dx.abs() < 1e-10), "{dx:?}");
            assert!((SensorDelay::sensor(&l, 3.0, 3.0) - (3.0 - d)).abs() < 1e-14);
        }
    }
}
