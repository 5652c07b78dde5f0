//! The balances and the conserved quantities of a free-floating manipulator.
//!
//! Without forces from outside linear and angular momentum stay, whatever happens inside: friction, springs, gears and
//! motors leave them alone; a tilted table, drag, a cable, a thruster or a contact does not. Wrong masses and centres of
//! mass make the *computed* momentum move with the motion, which is distinguished by fitting them within their standard deviations.
//!
//! The model is evaluated at measured states here; it is not simulated.

use nalgebra::{DMatrix, DVector};
use trueup_models::arm::{ArmScalar, PlanarManipulator, input, output, parameter};
use trueup_models::compiled::Compiled;
use trueup_numerics::hybrid::At;
use trueup_signals::process::Butterworth;

use super::derivative::{derivatives, gain};
use super::{BoundarySide, EquationBalance};

/// Measured channels of a manipulator on even steps.
#[derive(Clone, Debug, Default)]
pub struct ArmColumns<'a> {
    /// Step in s.
    pub step: f64,
    /// Of each coordinate (x_0, y_0, q_0, q_1 .. q_n, q_m of the flexible joints) its readings, m or rad. A motor that is
    /// not measured is empty and is taken to turn with its joint.
    pub position: Vec<&'a [f64]>,
    /// Measured velocities in the same order; empty ones are made from the positions.
    pub velocity: Vec<&'a [f64]>,
    /// Inputs in the model's order; an empty one is 0.
    pub input: Vec<&'a [f64]>,
    /// Noise of `position`, standard deviations.
    pub position_floor: Vec<f64>,
    /// Noise of `velocity`.
    pub velocity_floor: Vec<f64>,
}

/// What is missing in each balance of a manipulator, and what should be conserved.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmBalances {
    /// Index of the first sample in the columns: the filter's ends are left out.
    pub first: usize,
    /// Velocities of the coordinates.
    pub velocity: Vec<Vec<f64>>,
    /// Missing generalized force of each coordinate, N or N.m: M (dv/dt measured - dv/dt of the model). A cause inside
    /// leaves the first three quiet; one on the base is in them alone; one at a motor is in its row alone; one in a
    /// transmission is in the rows of its joint and, the other way round, of its motor.
    pub missing: Vec<EquationBalance>,
    /// P_x, P_y (N.s) and H about the inertial origin (N.m.s), less what the known inputs gave them, from 0 on.
    pub drift: [EquationBalance; 3],
    /// Energy less what the known inputs gave and the dampers took, from 0 on, J.
    pub energy: EquationBalance,
    /// Root mean square of each row of `missing` over its floor, at this cutoff or at a quarter of it, whichever is more:
    /// noise of second derivatives hides what is slow.
    pub ratios: Vec<f64>,
    /// Root mean square over the floor of the drift, of its integral if velocities were made from positions (whose noise
    /// the integral has back).
    pub ratio: f64,
    /// The same after the masses and inertias were fitted within their standard deviations.
    pub ratio_fitted: f64,
    /// Whether something acts from outside.
    pub cause: BoundarySide,
}

/// Part of the cutoff at which balances are looked at once more.
const SLOW: f64 = 0.25;
/// A drift this many times its floor is one.
const MARGIN: f64 = 1.5;

/// Balances by a low-pass of fourth order, forwards and backwards, at `cutoff` in Hz. `deviations` are standard deviations of
/// parameters by index (masses, inertias, centres of mass). `None` for missing coordinates, unequal lengths, or fewer than
/// nine periods of the cutoff.
pub fn arm_balances(
    arm: &PlanarManipulator,
    p: &[f64],
    columns: &ArmColumns<'_>,
    deviations: &[(usize, f64)],
    cutoff: f64,
) -> Option<ArmBalances> {
    let (mut out, motion, reach) = balances(arm, p, columns, cutoff)?;
    let model = NominalArm { arm: Compiled::new(arm.clone()), p };
    let slow = Butterworth::low_pass(4, SLOW * cutoff, 1.0 / columns.step)?;
    let floors = motion.missing_floors(&model, &out, &motion.slow_noise);
    for (b, floor) in out.missing.iter().zip(floors) {
        // Its ends are bent again.
        let value = slow.filtfilt(&b.value).map_or_else(Vec::new, |v| v[reach..v.len() - reach].to_vec());
        out.ratios.push(size(b).max(size(&EquationBalance { value, floor })));
    }
    judge(&mut out, &model, &motion, columns, deviations, reach);
    Some(out)
}

/// Root mean square over the floor.
fn size(b: &EquationBalance) -> f64 {
    (b.value.iter().map(|v| (v / b.floor).powi(2)).sum::<f64>() / b.value.len().max(1) as f64).sqrt()
}

/// Balances at one cutoff, the motion, and how many samples the filter reaches.
fn balances(
    arm: &PlanarManipulator,
    p: &[f64],
    columns: &ArmColumns<'_>,
    cutoff: f64,
) -> Option<(ArmBalances, MeasuredMotion, usize)> {
    let (dofs, n, h) = (arm.dofs(), columns.position.first()?.len(), columns.step);
    let reach = ((1.0 / (cutoff * h)).ceil() as usize).max(4);
    let first = 3 * reach;
    let samples = n.checked_sub(2 * first).filter(|s| *s > 3 * reach)?;
    let filter = Butterworth::low_pass(4, cutoff, 1.0 / h)?;
    let slow = Butterworth::low_pass(4, SLOW * cutoff, 1.0 / h)?;
    let motion = MeasuredMotion::new(arm, columns, &filter, &slow)?;
    let model = NominalArm { arm: Compiled::new(arm.clone()), p };

    let mut out = ArmBalances {
        first,
        velocity: (0..dofs).map(|i| motion.rate[i][first..first + samples].to_vec()).collect(),
        missing: vec![EquationBalance::default(); dofs],
        drift: Default::default(),
        energy: EquationBalance::default(),
        ratios: Vec::new(),
        ratio: 0.0,
        ratio_fitted: 0.0,
        cause: BoundarySide::None,
    };
    let mut given = [0.0; 4]; // P_x, P_y, H, energy
    let mut before: Option<[f64; 4]> = None;
    for k in first..first + samples {
        let (x, u) = (motion.state(k), motion.input(k));
        let acceleration = motion.acceleration(k);
        for (row, q) in out.missing.iter_mut().zip(model.missing(&x, &u, &acceleration)) {
            row.value.push(q);
        }
        let (held, flow) = (model.held(&x), model.flow(&x, &u));
        let since = before.map_or([0.0; 4], |b| std::array::from_fn(|i| 0.5 * h * (b[i] + flow[i])));
        (0..4).for_each(|i| given[i] += since[i]);
        before = Some(flow);
        for i in 0..3 {
            out.drift[i].value.push(held[i] - given[i]);
        }
        out.energy.value.push(held[3] - given[3]);
    }
    for b in out.drift.iter_mut().chain([&mut out.energy]) {
        let start = b.value[0];
        b.value.iter_mut().for_each(|v| *v -= start);
    }
    let floors = motion.held_floors(&model, &out);
    (0..3).for_each(|c| out.drift[c].floor = floors[c]);
    out.energy.floor = floors[3];
    let floors = motion.missing_floors(&model, &out, &motion.noise);
    out.missing.iter_mut().zip(floors).for_each(|(b, floor)| b.floor = floor);
    Some((out, motion, reach))
}

#[derive(Default)]
/// Positions, velocities and accelerations of all coordinates through one filter, and their noise.
struct MeasuredMotion {
    position: Vec<Vec<f64>>,
    rate: Vec<Vec<f64>>,
    bend: Vec<Vec<f64>>,
    /// Inputs.
    input: Vec<Vec<f64>>,
    /// Standard deviations: positions, velocities, accelerations.
    noise: Vec<f64>,
    /// The same behind the slow filter.
    slow_noise: Vec<f64>,
}

impl MeasuredMotion {
    fn new(
        arm: &PlanarManipulator,
        c: &ArmColumns<'_>,
        filter: &Butterworth,
        slow: &Butterworth,
    ) -> Option<Self> {
        let (dofs, n, h) = (arm.dofs(), c.position.first()?.len(), c.step);
        let gains = [0, 1, 2].map(|d| gain(filter, |x| derivatives(x, h)[d].clone()));
        let slowly = |x: &[f64]| slow.filtfilt(x).unwrap_or_default();
        let slow_gains = [0, 1, 2].map(|d| gain(filter, |x| slowly(&derivatives(x, h)[d])));
        let input: Option<Vec<Vec<f64>>> = (0..input::count(arm.links()))
            .map(|i| match c.input.get(i).filter(|u| !u.is_empty()) {
                Some(u) => filter.filtfilt(u).filter(|u| u.len() == n),
                None => Some(vec![0.0; n]),
            })
            .collect();
        let mut out = Self { input: input?, ..Self::default() };
        (out.noise, out.slow_noise) = (vec![0.0; 3 * dofs], vec![0.0; 3 * dofs]);
        for i in 0..dofs {
            let measured = |list: &[&[f64]], i: usize| -> Option<Vec<f64>> {
                list.get(i)
                    .filter(|x| !x.is_empty())
                    .and_then(|x| filter.filtfilt(x))
                    .filter(|x| x.len() == n)
            };
            // A motor without a sensor turns with its joint.
            let own = i < 3 + arm.links() || measured(&c.position, i).is_some();
            let from = if own { i } else { (0..arm.links()).find(|j| arm.motor(*j) == i).map(|j| 3 + j)? };
            let [position, mut rate, mut bend] = derivatives(&measured(&c.position, from)?, h);
            let sd = c.position_floor.get(from).copied().unwrap_or(0.0);
            let (mut noise, mut slow_noise) = (gains.map(|g| g * sd), slow_gains.map(|g| g * sd));
            if let Some(v) = measured(&c.velocity, from) {
                [rate, bend, _] = derivatives(&v, h);
                let sd = c.velocity_floor.get(from).copied().unwrap_or(0.0);
                (noise[1], noise[2]) = (gains[0] * sd, gains[1] * sd);
                (slow_noise[1], slow_noise[2]) = (slow_gains[0] * sd, slow_gains[1] * sd);
            }
            for d in 0..3 {
                out.noise[d * dofs + i] = noise[d];
                out.slow_noise[d * dofs + i] = slow_noise[d];
            }
            out.position.push(position);
            out.rate.push(rate);
            out.bend.push(bend);
        }
        Some(out)
    }

    /// Some samples in `out`, to take floors at.
    fn some(out: &ArmBalances) -> impl Iterator<Item = usize> {
        let (first, samples) = (out.first, out.drift[0].value.len());
        (0..SOME).map(move |i| first + i * samples / SOME)
    }

    /// What noise of these states gives the conserved quantities: root of the sum of squared differences.
    fn spread(&self, model: &NominalArm<'_>, out: &ArmBalances, noise: impl Fn(usize) -> f64) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for k in Self::some(out) {
            let x = self.state(k);
            for i in 0..x.len() {
                let (up, down) =
                    (model.held(&shifted(&x, i, noise(i))), model.held(&shifted(&x, i, -noise(i))));
                (0..4).for_each(|c| sums[c] += (0.5 * (up[c] - down[c])).powi(2) / SOME as f64);
            }
        }
        sums.map(|s| s.sqrt().max(f64::MIN_POSITIVE))
    }

    fn held_floors(&self, model: &NominalArm<'_>, out: &ArmBalances) -> [f64; 4] {
        self.spread(model, out, |i| self.noise[i])
    }

    /// Floors of the integrated momenta: what noise of positions leaves, each weighed as its velocity is.
    fn integrated_floors(&self, model: &NominalArm<'_>, out: &ArmBalances) -> [f64; 3] {
        let dofs = model.arm.dofs();
        let [x, y, h, _] = self.spread(model, out, |i| if i < dofs { 0.0 } else { self.noise[i - dofs] });
        [x, y, h]
    }

    /// Floors of the missing forces with this noise of positions, velocities and accelerations.
    fn missing_floors(&self, model: &NominalArm<'_>, out: &ArmBalances, noise: &[f64]) -> Vec<f64> {
        let dofs = model.arm.dofs();
        let mut sums = vec![0.0; dofs];
        for k in Self::some(out) {
            let (x, u, acceleration) = (self.state(k), self.input(k), self.acceleration(k));
            for i in 0..2 * dofs {
                let at = |sd: f64| model.missing(&shifted(&x, i, sd), &u, &acceleration);
                let (up, down) = (at(noise[i]), at(-noise[i]));
                (0..dofs).for_each(|r| sums[r] += (0.5 * (up[r] - down[r])).powi(2));
            }
            let mass = f64::mass_matrix(&model.arm, &model.full(&x), model.p);
            for (r, sum) in sums.iter_mut().enumerate() {
                *sum += (0..dofs).map(|c| (mass.at(r, c) * noise[2 * dofs + c]).powi(2)).sum::<f64>();
            }
        }
        sums.iter().map(|s| (s / SOME as f64).sqrt().max(f64::MIN_POSITIVE)).collect()
    }

    fn input(&self, k: usize) -> Vec<f64> {
        self.input.iter().map(|u| u[k]).collect()
    }

    fn acceleration(&self, k: usize) -> Vec<f64> {
        self.bend.iter().map(|a| a[k]).collect()
    }

    fn state(&self, k: usize) -> Vec<f64> {
        self.position.iter().chain(&self.rate).map(|x| x[k]).collect()
    }
}

/// Floors are means over so many samples.
const SOME: usize = 16;

fn shifted(x: &[f64], i: usize, by: f64) -> Vec<f64> {
    let mut x = x.to_vec();
    x[i] += by;
    x
}

/// The nominal model at measured states.
struct NominalArm<'a> {
    arm: Compiled<PlanarManipulator>,
    p: &'a [f64],
}

impl NominalArm<'_> {
    fn outputs(&self, x: &[f64], p: &[f64]) -> Vec<f64> {
        let sizes = self.arm.plant().sizes();
        let (mut y, u) = (vec![0.0; sizes.outputs], vec![0.0; sizes.inputs]);
        let x = self.full(x);
        let modes = self.modes(&x, &u);
        self.arm.plant().outputs(At { t: 0.0, x: &x, u: &u, p, modes: &modes }, &mut y);
        y
    }

    /// With states of effects, which are not measured, at 0.
    fn full(&self, x: &[f64]) -> Vec<f64> {
        let mut full = x.to_vec();
        full.resize(self.arm.plant().sizes().states, 0.0);
        full
    }

    fn modes(&self, x: &[f64], u: &[f64]) -> Vec<i32> {
        let mut modes = vec![0; self.arm.plant().sizes().modes];
        if !modes.is_empty() {
            self.arm.plant().start_modes(At { t: 0.0, x, u, p: self.p, modes: &[] }, &mut modes);
        }
        modes
    }

    /// P_x, P_y, H, energy.
    fn held(&self, x: &[f64]) -> [f64; 4] {
        self.held_with(x, self.p)
    }

    fn held_with(&self, x: &[f64], p: &[f64]) -> [f64; 4] {
        let (n, y) = (self.arm.links(), self.outputs(x, p));
        let momentum = output::linear_momentum(n);
        let energy = y[output::kinetic_energy(n)] + y[output::potential_energy(n)];
        [y[momentum], y[momentum + 1], y[output::angular_momentum(n)], energy]
    }

    /// What the known inputs give to these per second, and the dampers take.
    fn flow(&self, x: &[f64], u: &[f64]) -> [f64; 4] {
        let (arm, n, y) = (&self.arm, self.arm.links(), self.outputs(x, self.p));
        let v = &x[arm.dofs()..];
        let pair = |at: usize, of: &[f64]| [of[at], of[at + 1]];
        let cross = |r: [f64; 2], f: [f64; 2]| r[0] * f[1] - r[1] * f[0];
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let (on_base, on_tip) = (pair(input::base_force(n), u), pair(input::tip_force(n), u));
        let (base_torque, tip_torque) = (u[input::base_torque(n)], u[input::tip_torque(n)]);
        let tip = pair(output::tip_position(n), &y);
        let tip_rate: f64 = v[2..3 + n].iter().sum();
        let mut power = dot(on_base, [v[0], v[1]]) + base_torque * v[2] + tip_torque * tip_rate;
        power += dot(on_tip, pair(output::tip_velocity(n), &y));
        for j in 0..n {
            let (motor, joint) = (v[arm.motor(j)], v[3 + j]);
            power += u[input::joint_torque(n) + j] * motor;
            power -= self.p[parameter::joint_damping(n) + j] * (motor - joint).powi(2);
        }
        let torque = cross([x[0], x[1]], on_base) + cross(tip, on_tip) + base_torque + tip_torque;
        [on_base[0] + on_tip[0], on_base[1] + on_tip[1], torque, power]
    }

    /// M (measured - computed acceleration).
    fn missing(&self, x: &[f64], u: &[f64], acceleration: &[f64]) -> Vec<f64> {
        let dofs = self.arm.dofs();
        let full = self.full(x);
        let modes = self.modes(&full, u);
        let mut dx = vec![0.0; full.len()];
        self.arm.plant().rates(At { t: 0.0, x: &full, u, p: self.p, modes: &modes }, &[], &mut dx);
        let mass = f64::mass_matrix(&self.arm, &full, self.p);
        let difference: Vec<f64> = acceleration.iter().zip(&dx[dofs..2 * dofs]).map(|(m, c)| m - c).collect();
        // What holds a fixed base takes any force.
        let held = |r: usize| r < 3 && self.arm.has_fixed_base();
        (0..dofs).map(|r| if held(r) { 0.0 } else { mass.row_times(r, &difference) }).collect()
    }
}

/// The drift against its floor, before and after fitting what is uncertain: its ratios and the cause.
fn judge(
    out: &mut ArmBalances,
    model: &NominalArm<'_>,
    motion: &MeasuredMotion,
    columns: &ArmColumns<'_>,
    deviations: &[(usize, f64)],
    reach: usize,
) {
    // On a fixed base momentum is not kept, and the base shows nothing.
    if model.arm.has_fixed_base() {
        let fails = out.ratios.iter().any(|r| *r > MARGIN);
        out.cause = if fails { BoundarySide::Internal } else { BoundarySide::None };
        return;
    }
    let integrated = columns.velocity.iter().all(|v| v.is_empty());
    let floors: [f64; 3] = if integrated {
        motion.integrated_floors(model, out)
    } else {
        std::array::from_fn(|c| out.drift[c].floor)
    };
    // Filtered samples closer than half a period of the cutoff say the same; integrals want a finer grid.
    let fine = (reach / 8).max(1);
    let every = (reach / 2).max(1).div_ceil(fine);
    let grid: Vec<usize> = (0..out.drift[0].value.len()).step_by(fine).collect();
    let states: Vec<Vec<f64>> = grid.iter().map(|k| motion.state(out.first + k)).collect();
    let h = columns.step * fine as f64;
    let column = |value: &dyn Fn(usize) -> f64, floor: f64| -> Vec<f64> {
        let mut sum = 0.0;
        let all = (0..grid.len()).map(|k| {
            if k > 0 && integrated {
                sum += 0.5 * h * (value(k - 1) + value(k));
            }
            (if integrated { sum } else { value(k) }) / floor
        });
        all.step_by(every).collect()
    };
    let picked = grid.len().div_ceil(every);
    let rows = 3 * picked;
    // A constant, and where it is integrated a line, for each of the three.
    let own = if integrated { 6 } else { 3 };
    let fit = |fitted: usize| -> f64 {
        let columns = own + fitted;
        let mut p = model.p.to_vec();
        let mut theta = DVector::<f64>::zeros(fitted);
        let mut left = f64::NAN;
        // Momentum is nearly linear in masses and levers: few steps of Gauss and Newton.
        for _ in 0..if fitted > 0 { 3 } else { 1 } {
            let held: Vec<[f64; 4]> = states.iter().map(|x| model.held_with(x, &p)).collect();
            let nominal: Vec<[f64; 4]> = states.iter().map(|x| model.held(x)).collect();
            let mut design = DMatrix::<f64>::zeros(rows + fitted, columns);
            let mut y = DVector::<f64>::zeros(rows + fitted);
            for c in 0..3 {
                let drift = |k: usize| out.drift[c].value[grid[k]] + held[k][c] - nominal[k][c];
                y.rows_mut(c * picked, picked).copy_from_slice(&column(&drift, floors[c]));
                design.view_mut((c * picked, c), (picked, 1)).fill(1.0);
                if integrated {
                    let line = column(&|_| 1.0, floors[c]);
                    design.view_mut((c * picked, 3 + c), (picked, 1)).copy_from_slice(&line);
                }
            }
            for (k, (index, sd)) in deviations.iter().take(fitted).enumerate() {
                let shifted = |s: f64| {
                    let mut p = p.clone();
                    p[*index] += 0.05 * s * sd;
                    states.iter().map(|x| model.held_with(x, &p)).collect::<Vec<_>>()
                };
                let (up, down) = (shifted(1.0), shifted(-1.0));
                for c in 0..3 {
                    // Per prior standard deviation, so that all priors are 1.
                    let slope = |i: usize| 10.0 * (up[i][c] - down[i][c]);
                    let slope = column(&slope, floors[c]);
                    design.view_mut((c * picked, own + k), (picked, 1)).copy_from_slice(&slope);
                }
                design[(rows + k, own + k)] = 1.0;
                y[rows + k] = theta[k];
            }
            let Some(normal) = design.tr_mul(&design).cholesky() else { return f64::NAN };
            let step = normal.solve(&design.tr_mul(&y));
            left = (&y - &design * &step).norm_squared();
            for k in 0..fitted {
                theta[k] -= step[own + k];
                p[deviations[k].0] = model.p[deviations[k].0] + theta[k] * deviations[k].1;
            }
        }
        (left / (rows - own).max(1) as f64).sqrt()
    };
    (out.ratio, out.ratio_fitted) = (fit(0), fit(deviations.len()));
    let limit = MARGIN + 2.0 * (2.0 / rows as f64).sqrt();
    out.cause = if out.ratio_fitted > limit {
        BoundarySide::External
    } else if out.ratios[3..].iter().any(|r| *r > limit) {
        BoundarySide::Internal
    } else {
        BoundarySide::None
    };
}
