//! What wave-based control gains on DELIAN where its frequency follows the arm: the best frequency of every move against the best
//! one for all moves, and the frequency that the controllers estimate from their encoders.
//!
//! Moves of the shoulder's and the elbow's pitch between random postures with payloads of 0 to 10 kg. The plant is linear about
//! the posture where the move ends, without dry friction; the controllers are those of the FMU, sampled at 1 kHz. Vibration: root
//! mean square of the tip's way less its mean over one period of the first mode, in 6 s; `late`: after the first second.
//! `cargo run --release -p trueup-flexibility --example wave_frequency -- [MOVES] [ideal|sensors] [ground|orbit] [all|late]`
#![allow(clippy::print_stdout)]

mod loops;

use loops::{N, settings, with_payload};
use nalgebra::DVector;
use std::error::Error;
use trueup_flexibility::closed_loop::{SampledPlant, linearised, measured};
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::controller::adaptation::{KNOTS, parameter as adapt, state as adapted};
use trueup_models::controller::{ManipulatorController, Strategy, parameter, state};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::flexible_arm::presets::structure;
use trueup_models::space::layout::{Parameters, States};
use trueup_numerics::hybrid::{At, Hybrid};

const STEP: f64 = 1e-3;
const TIME: f64 = 6.0;
/// The reference takes this long, s.
const RAMP: f64 = 0.5;
const GAIN: f64 = 2.0;
/// Of the sensors on the joint's side, rad; counts a turn of the motor.
const LOAD_STEP: f64 = 0.001 * std::f64::consts::PI / 180.0;
const COUNTS: f64 = 16.0;
const OMEGAS: [f64; 11] = [5.0, 10.0, 20.0, 40.0, 60.0, 100.0, 150.0, 250.0, 400.0, 600.0, 1000.0];
/// By how much a move may vibrate more than with P/PI, %, for a constant frequency to count.
const WORSE: f64 = 10.0;
const RATIOS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];

/// xorshift64*.
struct Random(u64);
impl Random {
    fn between(&mut self, a: f64, b: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        a + (b - a) * bits as f64 / (1u64 << 53) as f64
    }
}

/// A move: the plant about where it ends, and where it starts from.
struct Move {
    p: Vec<f64>,
    plant: SampledPlant,
    /// Deviation of all states at the start.
    start: DVector<f64>,
    /// Torques of the motors at the start and at the end, N.m.
    drive: [Vec<f64>; 2],
    /// Angles of the joints at the end, rad.
    goal: Vec<f64>,
    /// First mode at the end, motors held, rad/s.
    first: f64,
}

/// Of one run.
struct Outcome {
    /// Vibration of the tip, m, and how far from its goal it is in the end.
    vibration: f64,
    error: f64,
    /// Wave frequencies in the end, rad/s.
    used: [f64; N],
}

fn draw(arm: &FlexibleArm, count: usize, orbit: bool) -> Result<Vec<Move>, Box<dyn Error>> {
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (at, joint) =
        (Parameters::new(&arm.structure().robot), States::new(&arm.structure().robot).joint_angle);
    let mut all = Vec::new();
    while all.len() < count {
        let payload = random.between(0.0, 10.0);
        let mut from = [0.0; N];
        from[1] = random.between(0.0, 1.8);
        from[2] = random.between(-2.4, 0.0);
        let mut to = from;
        to[1] += random.between(-0.2, 0.2);
        to[2] += random.between(-0.3, 0.3);
        // What the motors can hold on the ground with something to spare.
        let heavy = with_payload(arm, payload, false);
        let fits = [&from, &to].iter().all(|pose| {
            equilibrium(arm, &heavy, *pose, [0.0; 3]).is_ok_and(|rest| {
                (0..N).all(|j| {
                    let torque = heavy[at.joint_stiffness + j] * (rest.state[joint + j] - pose[j]);
                    torque.abs() < 0.3 * 0.02 * heavy[at.gear_ratio + j]
                })
            })
        });
        if !fits {
            continue;
        }
        let p = with_payload(arm, payload, orbit);
        let end = linearised(arm, &p, &to)?;
        let (start, more) = end.rest(&core::array::from_fn::<f64, N, _>(|j| from[j] - to[j]))?;
        let goal = end.state[joint..][..N].to_vec();
        let drive = [(0..N).map(|j| end.drive[j] + more[j]).collect(), end.drive.clone()];
        let first = equilibrium(arm, &p, &to, [0.0; 3])?.frequencies()?[0];
        all.push(Move { p, plant: end.sampled(STEP)?, start, drive, goal, first });
    }
    Ok(all)
}

impl Move {
    fn run(
        &self,
        arm: &FlexibleArm,
        control: &[f64],
        sensors: bool,
        late: bool,
    ) -> Result<Outcome, Box<dyn Error>> {
        let controller = ManipulatorController { joints: N };
        controller.check(control).map_err(|e| e.1)?;
        let own = controller.sizes();
        let (mut cx, mut modes) = (vec![0.0; own.states], vec![0; own.modes]);
        let mut x = self.start.clone();
        let mut y = &self.plant.c * &x;
        let from: Vec<f64> = (0..N).map(|j| y[measured::JOINT_ANGLE * N + j]).collect();
        let ratio = Parameters::new(&arm.structure().robot).gear_ratio;
        let (mut next, mut drive) = (x.clone(), DVector::zeros(N));
        let mut sensed = vec![0.0; own.inputs];
        let mut before = [[0.0; N]; 2];
        let mut way = Vec::new();
        for k in 0..(TIME / STEP) as usize {
            let now = k as f64 * STEP;
            y.gemv(1.0, &self.plant.c, &x, 0.0);
            way.push([0, 1, 2].map(|i| y[measured::COUNT * N + i]));
            for j in 0..N {
                let left = 1.0 - (now / RAMP).min(1.0);
                sensed[j] = self.goal[j] + from[j] * left;
                // Motors count from where their joints are at the start.
                let motor = self.goal[j] + y[measured::MOTOR_ANGLE * N + j] + from[j]
                    - self.start[States::new(&arm.structure().robot).motor_angle + j];
                let load = self.goal[j] + y[measured::JOINT_ANGLE * N + j];
                let (mut seen, mut rates) = (
                    [motor, load],
                    [y[measured::MOTOR_VELOCITY * N + j], y[measured::JOINT_VELOCITY * N + j]],
                );
                if sensors {
                    let step = std::f64::consts::TAU / COUNTS / self.p[ratio + j];
                    seen = [(motor / step).floor() * step, (load / LOAD_STEP).floor() * LOAD_STEP];
                    rates = [0, 1].map(|i| if k > 0 { (seen[i] - before[i][j]) / STEP } else { 0.0 });
                }
                (before[0][j], before[1][j]) = (seen[0], seen[1]);
                for (i, value) in [seen[0], rates[0], seen[1], rates[1]].into_iter().enumerate() {
                    sensed[(2 + i) * N + j] = value;
                }
            }
            if k == 0 {
                // States from the inputs, the first sample later; the integral holds the weight already.
                let at = At { t: STEP, x: &cx, u: &[], p: control, modes: &[] };
                controller.start_modes(at, &mut modes);
                controller.update(now, &mut cx, &sensed, control, &mut modes);
                cx[state::INTEGRAL_TORQUE * N..][..N].copy_from_slice(&self.drive[0]);
            }
            controller.update(now + STEP, &mut cx, &sensed, control, &mut modes);
            (0..N).for_each(|j| drive[j] = cx[state::HELD_OUTPUT * N + j] - self.drive[1][j]);
            next.gemv(1.0, &self.plant.a, &x, 0.0);
            next.gemv(1.0, &self.plant.b, &drive, 1.0);
            std::mem::swap(&mut x, &mut next);
        }
        let window = (std::f64::consts::TAU / self.first / STEP) as usize | 1;
        let error = way.last().map_or(0.0, |tip| tip.iter().map(|v| v * v).sum::<f64>().sqrt());
        let offset = adapted::first(N) + adapted::OFFSET * N;
        let used = core::array::from_fn(|j| cx[offset + j] + control[parameter::WAVE_FREQUENCY * N + j]);
        Ok(Outcome {
            vibration: vibration(&way, window, if late { (1.0 / STEP) as usize } else { 0 }),
            error,
            used,
        })
    }
}

/// Root mean square of a way less its centred mean over a window, from this sample on.
fn vibration(way: &[[f64; 3]], window: usize, from: usize) -> f64 {
    let half = window / 2;
    let at = |i: isize| way[i.clamp(0, way.len() as isize - 1) as usize];
    let mut square = 0.0;
    for c in 0..3 {
        let mut sum: f64 = (-(half as isize)..=half as isize).map(|i| at(i)[c]).sum();
        for i in 0..way.len() as isize {
            if i >= from as isize {
                square += (at(i)[c] - sum / window as f64).powi(2);
            }
            sum += at(i + half as isize + 1)[c] - at(i - half as isize)[c];
        }
    }
    (square / (way.len() - from) as f64).sqrt()
}

/// Controllers of all joints: omega_n of each at the start, and over the estimated mode where it adapts.
fn control(
    arm: &FlexibleArm,
    p: &[f64],
    strategy: Strategy,
    omega: [f64; N],
    ratio: Option<f64>,
) -> Vec<f64> {
    let mut c = vec![0.0; ManipulatorController { joints: N }.sizes().parameters];
    let first = adapt::first(N);
    let (rate, ratio) = ratio.map_or((0.0, 1.0), |ratio| (2.0, ratio));
    c[parameter::COUNT * N] = STEP;
    c[parameter::COUNT * N + 1] = f64::from(strategy as u8);
    for j in 0..N {
        let own = settings(arm, p, j, GAIN, omega[j]);
        own.iter().enumerate().for_each(|(i, v)| c[i * N + j] = *v);
        let estimate = [2.0, rate, 2.0 * ratio, 100.0 * ratio, ratio, 2.0 * LOAD_STEP];
        estimate.iter().enumerate().for_each(|(i, v)| c[first + i * N + j] = *v);
        for k in 0..KNOTS {
            c[adapt::schedule_angle(N) + j * KNOTS + k] = k as f64;
            c[adapt::schedule_frequency(N) + j * KNOTS + k] = omega[j];
        }
        c[adapt::schedule_joint(N) + j] = (j + 1) as f64;
    }
    c
}

/// Least, median, most.
fn spread(values: &[f64]) -> [f64; 3] {
    let mut v = values.to_vec();
    v.sort_by(f64::total_cmp);
    [v[0], v[v.len() / 2], v[v.len() - 1]]
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| args.iter().any(|a| a == word);
    let count: usize = args.iter().find_map(|a| a.parse().ok()).unwrap_or(50).max(1);
    let (sensors, orbit, late) = (has("sensors"), has("orbit"), has("late"));
    let arm = FlexibleArm::new(structure(false))?;
    let moves = draw(&arm, count, orbit)?;
    let run = |m: &Move, strategy, omega, ratio| {
        m.run(&arm, &control(&arm, &m.p, strategy, omega, ratio), sensors, late)
    };
    let base = moves.iter().map(|m| run(m, Strategy::PPi, [40.0; N], None)).collect::<Result<Vec<_>, _>>()?;
    let millimetres = |of: fn(&Outcome) -> f64, all: &[Outcome]| {
        spread(&all.iter().map(|o| 1e3 * of(o)).collect::<Vec<_>>())
    };
    let [least, median, most] = millimetres(|o| o.vibration, &base);
    let [slow, _, fast] = spread(&moves.iter().map(|m| m.first).collect::<Vec<_>>());
    println!(
        "{count} moves, {} sensors, {}; first modes of {slow:.1} to {fast:.1} rad/s. P/PI: {median:.3} mm at the median ({least:.3} to {most:.3}), {:.3} mm from the goal",
        if sensors { "quantised" } else { "ideal" },
        if orbit { "no weight" } else { "on the ground" },
        millimetres(|o| o.error, &base)[1],
    );
    let less = |all: &[Outcome]| -> Vec<f64> {
        all.iter().zip(&base).map(|(o, b)| 100.0 * (1.0 - o.vibration / b.vibration)).collect()
    };
    // Half of what wave-based control launches comes back only later: P/PI with half the gain starts as slowly.
    let halved = moves
        .iter()
        .map(|m| {
            let mut c = control(&arm, &m.p, Strategy::PPi, [40.0; N], None);
            c[parameter::POSITION_GAIN * N..][..N].fill(0.5 * GAIN);
            m.run(&arm, &c, sensors, late)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let [least, median, _] = spread(&less(&halved));
    println!("P/PI with half the gain: {median:.2} % less at the median, {least:.2} at the least");
    for (constant, adaptive) in
        [(Strategy::Vwbc, Strategy::VwbcAdaptive), (Strategy::Wbc, Strategy::WbcAdaptive)]
    {
        println!(
            "{constant:?}: omega_n, less vibration than P/PI in % (median, least), from the goal in mm (median)"
        );
        let mut table = Vec::new();
        for omega in OMEGAS {
            let all =
                moves.iter().map(|m| run(m, constant, [omega; N], None)).collect::<Result<Vec<_>, _>>()?;
            let row = less(&all);
            let [least, median, _] = spread(&row);
            println!("  {omega:6} {median:8.2} {least:8.2} {:10.3}", millimetres(|o| o.error, &all)[1]);
            table.push(row);
        }
        let median_of = |k: &usize| spread(&table[*k])[1];
        let highest = (0..OMEGAS.len()).max_by(|a, b| median_of(a).total_cmp(&median_of(b))).unwrap_or(0);
        // One that may be set once: it makes no move much worse than P/PI does.
        let best = (0..OMEGAS.len())
            .filter(|k| spread(&table[*k])[0] > -WORSE)
            .max_by(|a, b| median_of(a).total_cmp(&median_of(b)))
            .unwrap_or(0);
        let over =
            |row: &[f64]| spread(&row.iter().zip(&table[best]).map(|(a, c)| a - c).collect::<Vec<_>>());
        let oracle: Vec<f64> =
            (0..count).map(|m| table.iter().map(|r| r[m]).fold(f64::NEG_INFINITY, f64::max)).collect();
        let [_, median, most] = over(&oracle);
        println!(
            "  highest median at {} rad/s; best constant that makes no move worse than P/PI by {WORSE} %: {} rad/s; the best one of every move gains {median:.2} points at the median, {most:.2} at most",
            OMEGAS[highest], OMEGAS[best]
        );
        println!(
            "  {adaptive:?}: ratio, then for the first run and one that starts with what it learnt: less than P/PI in %, points over the best constant (median, least), joint 2's omega_n"
        );
        for ratio in RATIOS {
            let within = |w: f64| w.clamp(2.0 * ratio, 100.0 * ratio);
            let mut starts = vec![[within(OMEGAS[best]); N]; count];
            print!("  {ratio:6}");
            for _ in 0..2 {
                let all = moves
                    .iter()
                    .zip(&starts)
                    .map(|(m, start)| run(m, adaptive, *start, Some(ratio)))
                    .collect::<Result<Vec<_>, _>>()?;
                // What it uses lies between its bounds.
                starts = all.iter().map(|o| o.used.map(within)).collect();
                let row = less(&all);
                let ([least, median, _], of) = (over(&row), spread(&row)[1]);
                let omega = spread(&starts.iter().map(|w| w[1]).collect::<Vec<_>>())[1];
                print!(" | {of:7.2} {median:7.2} {least:8.2} {omega:6.1}");
            }
            println!();
        }
    }
    Ok(())
}
