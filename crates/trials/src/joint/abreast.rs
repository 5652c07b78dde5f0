//! Joints without effects under one current, several abreast: what [`TrialJoint`] and [`JointRun`] give for each of them,
//! digit by digit. A refit replays the same current for every difference, and one joint alone leaves most of a processor
//! waiting for its last product.

use super::plant::{StickMode, TrialJoint};
use super::run::{JointRun, between};
use super::values::{JointState, JointValues};

/// Motor angle, motor velocity, load angle, load velocity of each joint.
type States<const L: usize> = [[f64; L]; 4];

/// Joints under way.
struct JointsAbreast<const L: usize> {
    gear_ratio: [f64; L],
    torque_constant: [f64; L],
    stiffness: [f64; L],
    damping: [f64; L],
    coulomb: [f64; L],
    viscous: [f64; L],
    load_inertia: [f64; L],
    /// Inertia that the motor accelerates: its own, or with the load where there is no spring.
    inertia: [f64; L],
    rigid: bool,
    time: [f64; L],
    state: States<L>,
    stuck: [bool; L],
    /// Direction in which each motor slides.
    way: [f64; L],
    /// Torque of the current.
    drive: [f64; L],
    /// For a step in which a motor stops or breaks away.
    alone: [JointRun; L],
}

impl<const L: usize> JointsAbreast<L> {
    fn new(values: [JointValues; L], rigid: bool, time: f64, states: &[JointState; L]) -> Self {
        let inertia = values.map(|v| {
            let n = v.gear_ratio;
            if rigid { v.motor_inertia + v.load_inertia / (n * n) } else { v.motor_inertia }
        });
        let alone = std::array::from_fn(|l| {
            JointRun::new(TrialJoint::new(values[l], rigid, Vec::new(), 0.0), time, states[l], f64::INFINITY)
        });
        let state = std::array::from_fn(|i| std::array::from_fn(|l| states[l][i]));
        let mut all = Self {
            gear_ratio: values.map(|v| v.gear_ratio),
            torque_constant: values.map(|v| v.torque_constant),
            stiffness: values.map(|v| v.stiffness),
            damping: values.map(|v| v.damping),
            coulomb: values.map(|v| v.coulomb.max(0.0)),
            viscous: values.map(|v| v.viscous),
            load_inertia: values.map(|v| v.load_inertia),
            inertia,
            rigid,
            time: [time; L],
            state,
            stuck: [false; L],
            way: [0.0; L],
            drive: [0.0; L],
            alone,
        };
        (0..L).for_each(|l| all.set_mode(l));
        all
    }

    /// The mode in which joint `l` is by itself.
    fn set_mode(&mut self, l: usize) {
        (self.stuck[l], self.way[l]) = match self.alone[l].mode {
            StickMode::Stuck => (true, 0.0),
            StickMode::Slides(way) => (false, way),
        };
    }

    #[inline(always)]
    fn spring(&self, x: &States<L>, l: usize) -> f64 {
        let n = self.gear_ratio[l];
        let (eps, rate) = (x[0][l] - n * x[2][l], x[1][l] - n * x[3][l]);
        self.stiffness[l] * eps + self.damping[l] * rate
    }

    #[inline(always)]
    fn rates<const RIGID: bool>(&self, x: &States<L>) -> States<L> {
        let mut dx = [[0.0; L]; 4];
        for l in 0..L {
            let n = self.gear_ratio[l];
            let spring = if RIGID { 0.0 } else { self.spring(x, l) };
            let friction = self.viscous[l] * x[1][l] + self.coulomb[l] * self.way[l];
            let sliding = (self.drive[l] - spring - friction) / self.inertia[l];
            let (speed, acceleration) = if self.stuck[l] { (0.0, 0.0) } else { (x[1][l], sliding) };
            dx[0][l] = speed;
            dx[1][l] = acceleration;
            dx[2][l] = if RIGID { speed / n } else { x[3][l] };
            dx[3][l] = if RIGID { acceleration / n } else { n * spring / self.load_inertia[l] };
        }
        dx
    }

    #[inline(always)]
    fn rk4<const RIGID: bool>(&self, h: &[f64; L]) -> States<L> {
        let x = &self.state;
        let along = |k: &States<L>, share: f64| -> States<L> {
            std::array::from_fn(|i| std::array::from_fn(|l| x[i][l] + share * h[l] * k[i][l]))
        };
        let k1 = self.rates::<RIGID>(x);
        let k2 = self.rates::<RIGID>(&along(&k1, 0.5));
        let k3 = self.rates::<RIGID>(&along(&k2, 0.5));
        let k4 = self.rates::<RIGID>(&along(&k3, 1.0));
        std::array::from_fn(|i| {
            std::array::from_fn(|l| {
                x[i][l] + h[l] / 6.0 * (k1[i][l] + 2.0 * k2[i][l] + 2.0 * k3[i][l] + k4[i][l])
            })
        })
    }

    /// Whether joint `l` is still in its mode at `x`.
    #[inline(always)]
    fn stays(&self, x: &States<L>, l: usize) -> bool {
        let applied = self.drive[l] - if self.rigid { 0.0 } else { self.spring(x, l) };
        if self.stuck[l] { self.coulomb[l] - applied.abs() >= 0.0 } else { x[1][l] * self.way[l] >= 0.0 }
    }

    /// One step, of each to its own time `to`.
    fn step(&mut self, to: &[f64; L], u: f64) {
        let h = std::array::from_fn(|l| to[l] - self.time[l]);
        let next = if self.rigid { self.rk4::<true>(&h) } else { self.rk4::<false>(&h) };
        let stays: [bool; L] =
            std::array::from_fn(|l| self.stays(&next, l) & (!self.stuck[l] | self.stays(&self.state, l)));
        for l in 0..L {
            if h[l] == 0.0 {
                continue;
            }
            if stays[l] {
                self.time[l] += h[l];
                (0..4).for_each(|i| self.state[i][l] = next[i][l]);
            } else {
                self.step_alone(l, h[l], u);
            }
        }
    }

    fn step_alone(&mut self, l: usize, h: f64, u: f64) {
        let run = &mut self.alone[l];
        (0..4).for_each(|i| run.state[i] = self.state[i][l]);
        run.time = self.time[l];
        run.mode = if self.stuck[l] { StickMode::Stuck } else { StickMode::Slides(self.way[l]) };
        run.take(u);
        run.advance(h);
        self.time[l] = run.time;
        (0..4).for_each(|i| self.state[i][l] = run.state[i]);
        self.set_mode(l);
    }

    /// motorAngle, loadAngle, motorVelocity, transmissionTorque of joint `l` at `x`.
    fn channels(&self, x: &States<L>, l: usize) -> [f64; 4] {
        [x[0][l], x[2][l], x[1][l], if self.rigid { 0.0 } else { self.spring(x, l) }]
    }
}

/// What each joint does from its state under currents held from each of these times on: its four channels at `instants`.
pub(super) fn replay_abreast<const L: usize>(
    values: [JointValues; L],
    rigid: bool,
    states: &[JointState; L],
    (time, current): (&[f64], &[f64]),
    step: f64,
    instants: &[f64],
) -> [Vec<[f64; 4]>; L] {
    let mut all = JointsAbreast::new(values, rigid, time[0], states);
    let mut read: [Vec<[f64; 4]>; L] = std::array::from_fn(|_| Vec::with_capacity(instants.len()));
    for (l, read) in read.iter_mut().enumerate() {
        read.extend(instants.iter().take_while(|t| **t <= time[0]).map(|_| all.channels(&all.state, l)));
    }
    for (pair, u) in time.windows(2).zip(current) {
        for l in 0..L {
            all.drive[l] = all.torque_constant[l] * u;
        }
        let begin = all.time;
        let length = begin.map(|begin| pair[1] - begin);
        // Times of two joints differ by a rounding where one of them has stopped: their numbers of steps may differ.
        let steps = length.map(|length| if length > 0.0 { (length / step).ceil().max(1.0) } else { 0.0 });
        for i in 1..=steps.iter().fold(0.0, |a: f64, b| a.max(*b)) as usize {
            let i = i as f64;
            let (before, past) = (all.time, all.state);
            let to = std::array::from_fn(|l| match i {
                i if i < steps[l] => begin[l] + length[l] * i / steps[l],
                i if i == steps[l] => pair[1],
                _ => before[l],
            });
            all.step(&to, *u);
            for (l, read) in read.iter_mut().enumerate() {
                while let Some(t) = instants.get(read.len()).filter(|t| **t <= all.time[l]) {
                    let (a, b) = (all.channels(&past, l), all.channels(&all.state, l));
                    read.push(std::array::from_fn(|c| between((before[l], a[c]), (all.time[l], b[c]), *t)));
                }
            }
        }
    }
    for (l, read) in read.iter_mut().enumerate() {
        read.resize(instants.len(), all.channels(&all.state, l));
    }
    read
}

#[cfg(test)]
mod tests {
    use super::super::run::replay;
    use super::*;
    use crate::draw::SeededDraw;

    /// Random joints, times and currents: abreast and alone, every digit of every reading is the same.
    #[test]
    fn joints_abreast_move_as_each_of_them_alone() {
        let mut stopped = 0;
        for seed in 0..24 {
            let mut d = SeededDraw::new("abreast", seed, 0, 0);
            let rigid = seed % 3 == 0;
            let n = 100.0;
            let values: [JointValues; 4] = std::array::from_fn(|_| JointValues {
                motor_inertia: d.log(1e-5, 4e-5),
                load_inertia: d.uniform(0.1, 0.8),
                gear_ratio: n,
                torque_constant: d.uniform(0.03, 0.08),
                stiffness: d.log(0.01, 0.2),
                damping: d.log(1e-5, 1e-4),
                coulomb: d.uniform(2e-3, 8e-3),
                viscous: d.log(1e-5, 1e-4),
            });
            let states: [JointState; 4] = std::array::from_fn(|_| {
                let mut x = [0.0; 12];
                (x[0], x[1]) =
                    (d.uniform(-1.0, 1.0), if d.chance(0.3) { 0.0 } else { d.uniform(-40.0, 40.0) });
                (x[2], x[3]) = (x[0] / n, x[1] / n);
                x
            });
            let mut time = vec![0.0];
            (0..60).for_each(|i| time.push(time[i] + 2e-3 * d.uniform(0.7, 1.3)));
            let current: Vec<f64> = time.iter().map(|_| d.uniform(-0.3, 0.3)).collect();
            let instants: Vec<f64> = time.iter().step_by(3).copied().collect();
            let four = replay_abreast(values, rigid, &states, (&time, &current), 5e-4, &instants);
            for l in 0..4 {
                let joint = TrialJoint::new(values[l], rigid, Vec::new(), time[60]);
                let track = replay(joint, states[l], &time, &current, 5e-4);
                stopped += track.state.iter().filter(|x| x[1] == 0.0).count();
                let alone: Vec<[f64; 4]> =
                    instants.iter().map(|t| std::array::from_fn(|c| track.at(*t, c))).collect();
                assert_eq!(four[l], alone, "seed {seed}, joint {l} of four");
                let [one] =
                    replay_abreast([values[l]], rigid, &[states[l]], (&time, &current), 5e-4, &instants);
                assert_eq!(one, alone, "seed {seed}, joint {l} by itself");
            }
        }
        assert!(stopped > 1000, "friction has to stop motors in these runs: {stopped}");
    }
}
