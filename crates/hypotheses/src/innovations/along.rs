//! The smoothed trajectory of a plant as laws see it. Nothing here is a smoothed acceleration or a latent.

use std::rc::Rc;

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn, WeightedSeries};
use trueup_estimation::innovations::numeric::over_steps;

use super::drive::DriveAlong;
use super::mechanics::ChainMechanics;
use super::place::{BasePlace, ChannelPlace, JointPlace, MotionInStep, ShownBy};
use super::run_along::{CoordinateMotion, JointMotion, RunAlong, hermite};
use super::shape::LawShape;
use super::spline::CubicSpline;

/// A frame's trajectory, with the units in which columns are made.
pub struct PlantAlong<'a> {
    /// How far it moves within a step.
    pub motion: MotionInStep,
    /// Its joints, from the base.
    pub joints: Vec<JointPlace>,
    /// Its base, where it is free.
    pub base: Option<BasePlace>,
    /// Its channels.
    pub channels: Vec<ChannelPlace>,
    /// Channels that may be late: those of one instrument together, and each alone.
    pub late_together: Vec<Vec<usize>>,
    /// Recordings.
    pub runs: Vec<RunAlong>,
    /// Longest recording, s.
    pub duration: f64,
    /// Mechanics of a chain; `None`: it is none.
    pub mechanics: Option<&'a dyn ChainMechanics>,
    /// Axes of the place of a chain's tip.
    pub tip_axes: usize,
}

impl<'a> PlantAlong<'a> {
    /// Of a plant without a free base whose channels are late one by one.
    pub fn new(
        motion: MotionInStep,
        joints: Vec<JointPlace>,
        channels: Vec<ChannelPlace>,
        mut runs: Vec<RunAlong>,
    ) -> Self {
        runs.iter_mut().for_each(|r| r.forget_motion(joints.len(), channels.len()));
        let duration = runs.iter().filter_map(|r| r.times.last().copied()).fold(0.0, f64::max);
        let compared = (0..channels.len()).filter(|c| channels[*c].compared);
        let late_together = compared.map(|c| vec![c]).collect();
        Self {
            motion,
            joints,
            base: None,
            channels,
            late_together,
            runs,
            duration,
            mechanics: None,
            tip_axes: 2,
        }
    }

    /// The same with a coordinate's position, or its rate, moved throughout.
    pub fn moved(&self, coordinate: usize, rate: bool, by: f64) -> Self {
        let mut moved = Self {
            joints: self.joints.clone(),
            base: self.base.clone(),
            channels: self.channels.clone(),
            late_together: self.late_together.clone(),
            runs: self.runs.clone(),
            ..*self
        };
        for r in &mut moved.runs {
            let all = if rate { &mut r.rates } else { &mut r.positions };
            all[coordinate].iter_mut().for_each(|x| *x += by);
            r.forget_motion(self.joints.len(), self.channels.len());
        }
        moved
    }

    /// Each joint, and all of them where there are several.
    pub fn joint_sets(&self) -> Vec<Vec<usize>> {
        let each = (0..self.joints.len()).map(|k| vec![k]);
        let all = (self.joints.len() > 1).then(|| (0..self.joints.len()).collect());
        each.chain(all).collect()
    }
    /// Shapes at each joint with a spring.
    pub fn at_springs(&self, shapes: impl Fn(&JointPlace) -> Vec<LawShape>) -> Vec<LawShape> {
        let springs = self.joints.iter().enumerate().filter(|(_, j)| j.stiffness > 0.0);
        springs.flat_map(|(k, j)| shapes(j).into_iter().map(move |s| s.at(&[k]))).collect()
    }
    /// A form at each motor with dry friction in the nominal plant: as it is, or with each of these lengths `x`.
    pub fn at_dry_joints(&self, form: &'static str, lengths: &[f64]) -> Vec<LawShape> {
        let dry = (0..self.joints.len()).filter(|k| self.joints[*k].dry > 0.0);
        let of = |k: usize| -> Vec<LawShape> {
            let shape =
                |values: &[(&'static str, f64)]| LawShape::new("motor-friction", form, values).at(&[k]);
            match lengths {
                [] => vec![shape(&[])],
                _ => lengths.iter().map(|x| shape(&[("x", *x)])).collect(),
            }
        };
        dry.flat_map(of).collect()
    }

    /// Motion of a joint within the steps of a recording.
    pub fn joint_within(&self, recording: usize, joint: usize) -> &JointMotion {
        let (r, j) = (&self.runs[recording], &self.joints[joint]);
        r.joints[joint][1].get_or_init(|| r.joint_within(j, self.motion))
    }
    /// Motion of a joint where laws of transmission and link look at it: at nodes, or within the steps.
    pub fn joint_motion(&self, recording: usize, joint: usize) -> &JointMotion {
        if self.motion == MotionInStep::Curved {
            return self.joint_within(recording, joint);
        }
        let (r, j) = (&self.runs[recording], &self.joints[joint]);
        r.joints[joint][0].get_or_init(|| r.joint_at_nodes(j))
    }
    /// Means over the steps of values at the moments of [`PlantAlong::joint_motion`].
    pub fn means(&self, recording: usize, values: &[f64]) -> Vec<f64> {
        match self.motion {
            MotionInStep::Straight => over_steps(values),
            MotionInStep::Curved => self.runs[recording].means(values),
        }
    }

    fn each_run(&self, part: impl Fn(usize) -> ColumnPart) -> FilterColumn {
        (0..self.runs.len()).map(part).collect()
    }
    /// A torque on a motor from values within the steps.
    pub fn on_motor(&self, joint: usize, f: impl Fn(&JointMotion) -> Vec<f64>) -> FilterColumn {
        self.on_motor_by_run(joint, |_, m| f(m))
    }
    /// The same, with the recording.
    pub fn on_motor_by_run(&self, joint: usize, f: impl Fn(usize, &JointMotion) -> Vec<f64>) -> FilterColumn {
        let on = self.joints[joint].motor;
        self.each_run(|k| ColumnPart::force(on, self.runs[k].means(&f(k, self.joint_within(k, joint)))))
    }
    /// A force on a coordinate over time, s.
    pub fn over_time(&self, coordinate: usize, f: impl Fn(f64) -> f64) -> FilterColumn {
        self.each_run(|k| ColumnPart::force(coordinate, self.time_means(k, &f)))
    }
    /// Means over the steps of a function of time, s.
    fn time_means(&self, recording: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let r = &self.runs[recording];
        match self.motion {
            MotionInStep::Straight => over_steps(&r.times.iter().map(|t| f(*t)).collect::<Vec<_>>()),
            MotionInStep::Curved => r.means(&r.part_times().iter().map(|t| f(*t)).collect::<Vec<_>>()),
        }
    }
    /// A torque on a link.
    pub fn on_link(&self, joint: usize, f: impl Fn(&JointMotion) -> Vec<f64>) -> FilterColumn {
        self.on_link_by_run(joint, |_, m| f(m))
    }
    /// The same, with the recording.
    pub fn on_link_by_run(&self, joint: usize, f: impl Fn(usize, &JointMotion) -> Vec<f64>) -> FilterColumn {
        let on = self.joints[joint].link;
        self.each_run(|k| ColumnPart::force(on, self.means(k, &f(k, self.joint_motion(k, joint)))))
    }
    /// A torque of the attitude of a joint's link, on the links of all joints up to it.
    pub fn up_to_link(&self, joint: usize, f: impl Fn(&[f64]) -> Vec<f64>) -> FilterColumn {
        self.each_run(|k| {
            let mut attitude = vec![0.0; self.joint_motion(k, joint).time.len()];
            for (i, j) in self.joints.iter().enumerate().take(joint + 1) {
                let link = &self.joint_motion(k, i).link;
                attitude.iter_mut().zip(link).for_each(|(a, q)| *a += q / j.turns);
            }
            let values: Rc<[f64]> = self.means(k, &f(&attitude)).into();
            let on = |j: &JointPlace| WeightedSeries { on: j.link, weight: 1.0, values: values.clone() };
            ColumnPart { forces: self.joints[..=joint].iter().map(on).collect(), readings: Vec::new() }
        })
    }
    /// Forces on the three coordinates of a base at each moment within the steps.
    pub fn on_base(
        &self,
        base: &BasePlace,
        f: impl Fn(&[&CoordinateMotion; 3], usize) -> [f64; 3],
    ) -> FilterColumn {
        self.each_run(|k| {
            let r = &self.runs[k];
            let motion = base.coordinates.map(|c| r.within(c));
            let mut forces = [(); 3].map(|()| Vec::with_capacity(motion[0].position.len()));
            for i in 0..motion[0].position.len() {
                forces.iter_mut().zip(f(&motion, i)).for_each(|(all, f)| all.push(f));
            }
            on_coordinates(r, base.coordinates, forces)
        })
    }
    /// Usual force of the tip, N: half of that of a free base.
    pub fn tip_unit(&self) -> f64 {
        let largest = self.joints.iter().map(|j| j.torque).fold(0.0, f64::max);
        self.base.as_ref().map_or(largest, |b| 0.5 * b.force[0])
    }
    /// A force over time (s) on the tip along an axis, from 0, in usual forces of the tip; `None`: the plant is no chain.
    pub fn on_tip(&self, axis: usize, f: impl Fn(f64) -> f64) -> Option<FilterColumn> {
        let mechanics = self.mechanics?;
        let unit = self.tip_unit();
        let part = |k: usize| {
            let (r, pulse) = (&self.runs[k], self.time_means(k, &f));
            let mut part = ColumnPart::default();
            for (c, j) in mechanics.tip(k, axis)?.iter().enumerate() {
                let force = r.by_node(|t| unit * pulse[t] * 0.5 * (j[t] + j[r.next(t)]));
                if force.iter().any(|f| *f != 0.0) {
                    part.forces.extend(ColumnPart::force(c, force).forces);
                }
            }
            Some(part)
        };
        (0..self.runs.len()).map(part).collect()
    }
    /// A torque between motor and link: minus on the motor, plus on the link.
    pub fn in_spring(&self, joint: usize, f: impl Fn(&JointMotion) -> Vec<f64>) -> FilterColumn {
        let j = &self.joints[joint];
        self.each_run(|k| {
            let values: Rc<[f64]> = self.means(k, &f(self.joint_motion(k, joint))).into();
            let on = |on: usize, weight: f64| WeightedSeries { on, weight, values: values.clone() };
            ColumnPart { forces: vec![on(j.motor, -1.0), on(j.link, 1.0)], readings: Vec::new() }
        })
    }
    /// What the torques of other inputs have more than those of the recorded ones, on the motors of these joints.
    pub fn of_drives(&self, joints: &[usize], means: impl Fn(&DriveAlong) -> Vec<f64>) -> FilterColumn {
        let part = |k: usize, joint: usize| {
            let drive = &self.runs[k].drives[joint];
            let other = means(drive);
            let more: Vec<f64> = drive.means.iter().zip(other).map(|(u, o)| -drive.gain * (u - o)).collect();
            ColumnPart::force(self.joints[joint].motor, self.runs[k].means(&more)).forces
        };
        self.each_run(|k| ColumnPart {
            forces: joints.iter().flat_map(|j| part(k, *j)).collect(),
            readings: Vec::new(),
        })
    }
    /// A reading error of a channel, by recording, node and time of the reading.
    pub fn of_reading(&self, channel: usize, f: impl Fn(usize, usize, f64) -> f64) -> FilterColumn {
        self.each_run(|k| {
            let r = &self.runs[k];
            ColumnPart::reading(channel, r.by_node(|t| f(k, t, r.times[t] + r.moments[channel][t])))
        })
    }
    /// What a channel shows by node, without its errors.
    fn shown<'r>(&self, run: &'r RunAlong, channel: usize) -> &'r [f64] {
        match self.channels[channel].shows {
            ShownBy::Position(c) => &run.positions[c],
            ShownBy::Rate(c) => &run.rates[c],
            ShownBy::Tip(_) | ShownBy::Output => &run.shown[channel],
        }
    }
    /// What a channel shows at any time of a recording: a position cubic between nodes, or on a spline.
    pub fn shown_at(&self, recording: usize, channel: usize, time: f64) -> f64 {
        let r = &self.runs[recording];
        match (self.motion, self.channels[channel].shows) {
            (MotionInStep::Straight, ShownBy::Position(c)) => {
                let (q, v, dt) = (&r.positions[c], &r.rates[c], r.steps[0]);
                let k = ((time / dt) as usize).min(r.nodes() - 2);
                let x = (time / dt - k as f64).clamp(0.0, 1.0);
                let h = hermite(x);
                q[k] * h[0] + dt * v[k] * h[1] + q[k + 1] * h[2] + dt * v[k + 1] * h[3]
            }
            _ => self.spline(recording, channel).value(time),
        }
    }
    /// Rate of what a channel shows at a node.
    pub fn shown_rate(&self, recording: usize, channel: usize, node: usize) -> f64 {
        let r = &self.runs[recording];
        match (self.motion, self.channels[channel].shows) {
            (MotionInStep::Straight, ShownBy::Position(c)) => r.rates[c][node],
            _ => self.spline(recording, channel).slope(r.times[node] + r.moments[channel][node]),
        }
    }
    fn spline(&self, recording: usize, channel: usize) -> &CubicSpline {
        let r = &self.runs[recording];
        r.splines[channel].get_or_init(|| CubicSpline::new(&r.times, self.shown(r, channel)))
    }
    /// Means over the steps of sin and of cos of `order` times the motor's angle; exact along straight pieces.
    pub fn order_means(&self, recording: usize, joint: usize, order: f64) -> [Vec<f64>; 2] {
        let r = &self.runs[recording];
        if self.motion == MotionInStep::Curved {
            let angle = &self.joint_within(recording, joint).motor;
            let (sin, cos): (Vec<f64>, Vec<f64>) = angle.iter().map(|q| (order * q).sin_cos()).unzip();
            return [r.means(&sin), r.means(&cos)];
        }
        let motor = &r.positions[self.joints[joint].motor];
        let mut means = [Vec::with_capacity(r.nodes()), Vec::with_capacity(r.nodes())];
        for t in 0..r.nodes() {
            let d = motor[r.next(t)] - motor[t];
            let (sin, cos) = (order * (motor[t] + 0.5 * d)).sin_cos();
            let within = sinc(0.5 * order * d);
            means[0].push(sin * within);
            means[1].push(cos * within);
        }
        means
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

/// Forces on coordinates from values by part; those that are zero throughout are left out.
pub(super) fn on_coordinates(r: &RunAlong, coordinates: [usize; 3], forces: [Vec<f64>; 3]) -> ColumnPart {
    let acting = coordinates.into_iter().zip(forces).filter(|(_, f)| f.iter().any(|f| *f != 0.0));
    let forces = acting.flat_map(|(c, f)| ColumnPart::force(c, r.means(&f)).forces);
    ColumnPart { forces: forces.collect(), readings: Vec::new() }
}
