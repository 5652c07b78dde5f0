//! Where DELIAN with sampled controllers on all joints (1 kHz, the velocity loop at 60 rad/s) is stable: over the angle of the
//! elbow, the payload, the wave frequency and the position gain.
//!
//! The loop is linear about a rest with the upper arm raised by 0.9 rad; dry friction left out.
//! `cargo run --release -p trueup-flexibility --example stability -- [ground|orbit]`
#![allow(clippy::print_stdout)]

mod loops;

use loops::{N, settings, with_payload};
use std::error::Error;
use trueup_flexibility::closed_loop::{
    ClosedLoopError, Poles, SampledController, SampledPlant, closed, law, linearised, poles,
};
use trueup_flexibility::droop::droop;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::controller::Strategy;
use trueup_models::flexible_arm::FlexibleArm;

const STEP: f64 = 1e-3;
const RAISED: f64 = 0.9;
const ELBOWS: [f64; 3] = [0.0, -1.2, -2.4];
const PAYLOADS: [f64; 3] = [0.0, 2.15, 10.0];
const OMEGAS: [f64; 7] = [5.0, 20.0, 41.648, 100.0, 200.0, 400.0, 1000.0];
/// Position gains tried, 1/s, a factor of the square root of 2 apart; the boundary is then halved into.
const LEAST: f64 = 0.25;
const TRIED: usize = 16;
/// The gain at which damping is printed, 1/s.
const GAIN: f64 = 2.0;
/// What turns more slowly than this, rad/s, and grows runs away; it does not vibrate.
const TURNS: f64 = 1.0;

struct Case<'a> {
    arm: &'a FlexibleArm,
    p: Vec<f64>,
    plant: SampledPlant,
}

impl Case<'_> {
    fn poles(&self, strategy: Strategy, gain: f64, omega: f64) -> Result<Poles, ClosedLoopError> {
        let laws = (0..N)
            .map(|j| law(strategy, &settings(self.arm, &self.p, j, gain, omega), STEP))
            .collect::<Result<Vec<SampledController>, _>>()?;
        poles(&closed(&self.plant, &laws)?, STEP)
    }

    /// Whether no vibration grows.
    fn stable(&self, strategy: Strategy, gain: f64, omega: f64) -> Result<bool, ClosedLoopError> {
        let found = self.poles(strategy, gain, omega)?;
        Ok(found.moving().all(|p| p.z.norm() < 1.0 || p.s.im.abs() < TURNS))
    }

    /// The least gain, of those tried, beyond which a vibration grows, 1/s.
    fn boundary(&self, strategy: Strategy, omega: f64) -> Result<Option<f64>, ClosedLoopError> {
        let tried = |k: usize| LEAST * 2f64.powf(k as f64 / 2.0);
        for k in 0..TRIED {
            if self.stable(strategy, tried(k), omega)? {
                continue;
            }
            let (mut low, mut high) = (if k == 0 { 0.0 } else { tried(k - 1) }, tried(k));
            while k > 0 && high / low > 1.01 {
                let middle = (low * high).sqrt();
                *(if self.stable(strategy, middle, omega)? { &mut low } else { &mut high }) = middle;
            }
            return Ok(Some(low));
        }
        Ok(None)
    }

    fn told(&self, strategy: Strategy, omega: f64) -> Result<String, ClosedLoopError> {
        let boundary = self.boundary(strategy, omega)?.map_or(
            format!("> {:.0}", LEAST * 2f64.powf((TRIED - 1) as f64 / 2.0)),
            |k| {
                if k > 0.0 { format!("{k:.2}") } else { "none".into() }
            },
        );
        let found = self.poles(strategy, GAIN, omega)?;
        let damping = found
            .moving()
            .filter(|p| p.s.im.abs() > TURNS && p.s.norm() < 100.0)
            .map(|p| p.damping())
            .fold(f64::INFINITY, f64::min);
        let away = found
            .moving()
            .filter(|p| p.s.im.abs() <= TURNS)
            .map(|p| p.s.re)
            .fold(f64::NEG_INFINITY, f64::max);
        let away = if away > 0.0 { format!("{away:+.3}") } else { "-".into() };
        Ok(format!("{boundary:>6} {damping:8.4} {:8.5} {away:>6}", found.largest()))
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let orbit = std::env::args().any(|a| a == "orbit");
    let arm = loops::arm()?;
    println!(
        "K_p in 1/s up to which no vibration grows; at K_p = {GAIN}: damping ratio of the least damped vibration below 100 rad/s, largest |z|, how fast it runs away in 1/s"
    );
    for elbow in ELBOWS {
        for payload in PAYLOADS {
            let p = with_payload(&arm, payload, orbit);
            let plant = linearised(&arm, &p, &[0.0, RAISED, elbow, 0.0, 0.0, 0.0])?;
            let limit =
                GAIN / droop(&equilibrium(&arm, &p, &[0.0, RAISED, elbow, 0.0, 0.0, 0.0], [0.0; 3])?)?;
            let case = Case { arm: &arm, p, plant: plant.sampled(STEP)? };
            println!(
                "elbow {elbow:4.1} rad, {payload:5.2} kg: P/PI {}; VWBC must run away above {limit:.0} rad/s",
                case.told(Strategy::PPi, 1.0)?
            );
            for omega in OMEGAS {
                println!(
                    "    omega_n {omega:6.1} rad/s   VWBC {}   WBC {}",
                    case.told(Strategy::Vwbc, omega)?,
                    case.told(Strategy::Wbc, omega)?
                );
            }
        }
    }
    Ok(())
}
