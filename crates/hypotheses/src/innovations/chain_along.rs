//! The trajectory of a chain's frame as laws see it.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use nalgebra::DMatrix;

use trueup_estimation::innovations::numeric::{median, over_steps, quantile};
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::{TrajectoryPlant, TrajectoryPoint};
use trueup_estimation::innovations::trajectory::run::TrajectoryRun;

use super::along::PlantAlong;
use super::drive::DriveAlong;
use super::mechanics::{ChainMechanics, HingeAlong};
use super::place::{BasePlace, ChannelPlace, JointPlace, MotionInStep, ShownBy};
use super::run_along::RunAlong;

/// Unit of reading errors, in standard deviations of one reading.
const ERROR: f64 = 30.0;
/// Unit of errors of a gear, in usual twists.
const GEAR_ERROR: f64 = 0.02;
/// Least damping that a law of damping takes as usual, in usual torques of the spring over usual rates.
const LEAST_DAMPING: f64 = 0.02;
/// A twist, rad, that hardly bends the line of a spring.
const LITTLE: f64 = 1e-4;
/// Relative difference of slopes up to which a spring is a line.
const LINE: f64 = 1e-6;
/// Quantiles that are usual: of speeds and twists, of rates of twist.
const USUAL: [f64; 2] = [0.97, 0.9];

/// Usual sizes along the trajectory that a search begins with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChainSizes {
    /// Speed of each coordinate, reached 3 % of the time.
    pub speed: Vec<f64>,
    /// Largest torque of each drive, N.m.
    pub torque: Vec<f64>,
    /// Middle of each coordinate.
    pub middle: Vec<f64>,
    /// Half the range of each coordinate.
    pub reach: Vec<f64>,
    /// Twist of each joint about its median, reached 3 % of the time, rad; 1 where it is rigid.
    pub twist: Vec<f64>,
    /// Rate of twist of each joint, reached 10 % of the time, rad/s; 1 where it is rigid.
    pub twist_rate: Vec<f64>,
}

impl ChainSizes {
    /// Of a frame's trajectory.
    pub fn of(frame: &TrajectoryFrame) -> Self {
        let n = frame.coordinates();
        let series =
            |k: usize| -> Vec<f64> { frame.runs.iter().flat_map(|r| column(&r.states, 2 * n, k)).collect() };
        let size = |values: &[f64], usual: f64| quantile(values.iter().map(|v| v.abs()).collect(), usual);
        let mut sizes = Self::default();
        for k in 0..n {
            let (q, v) = (series(k), series(n + k));
            let (low, high) = q.iter().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(*x), b.max(*x)));
            sizes.speed.push(size(&v, USUAL[0]).max(1e-6));
            sizes.middle.push(q.iter().sum::<f64>() / q.len().max(1) as f64);
            sizes.reach.push(0.5 * (high - low) + 1e-6);
        }
        for (j, (motor, joint)) in frame.plant.drives.iter().zip(&frame.plant.joints).enumerate() {
            let gain = frame.plant.drive_gains[j].abs();
            let all = frame.runs.iter().flat_map(|r| column(&r.nodes.torque, r.nodes.inputs.len(), j));
            sizes.torque.push(gain * all.fold(0.0, |m: f64, u| m.max(u.abs())));
            if motor == joint {
                sizes.twist.push(1.0);
                sizes.twist_rate.push(1.0);
                continue;
            }
            let apart = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>();
            let twist = apart(series(*motor), series(*joint));
            let middle = median(twist.clone());
            let twist: Vec<f64> = twist.iter().map(|w| w - middle).collect();
            sizes.twist.push(size(&twist, USUAL[0]) + 1e-9);
            sizes.twist_rate.push(size(&apart(series(n + motor), series(n + joint)), USUAL[1]) + 1e-9);
        }
        sizes
    }
}

/// Every `width`-th value from the `k`-th one.
fn column(values: &[f64], width: usize, k: usize) -> Vec<f64> {
    values.iter().skip(k).step_by(width).copied().collect()
}

/// Stiffness and damping of the spring between a joint and its motor: what the motor's coordinate takes more for a twist and a rate
/// of 1, of a spring that is no line for a small twist; 0 of a rigid joint.
fn spring(frame: &TrajectoryFrame, input: usize) -> [f64; 2] {
    let (plant, n) = (&frame.plant, frame.coordinates());
    if !plant.flexible(input) {
        return [0.0; 2];
    }
    let motor = plant.drives[input];
    let needed = |by: f64, k: usize| {
        let mut state = vec![0.0; 2 * n];
        state[k] = by;
        plant.needed(&frame.theta, &state, &vec![0.0; n]).map_or(0.0, |f| f[motor])
    };
    let rest = needed(0.0, motor);
    let [whole, little] = [1.0, LITTLE].map(|by| (needed(by, motor) - rest) / by);
    let stiffness = if (whole - little).abs() < LINE * whole.abs() { whole } else { little };
    [stiffness, needed(1.0, n + motor) - rest]
}

/// Along the present trajectory of a frame.
pub fn along_chain<'a>(
    frame: &TrajectoryFrame,
    sizes: &ChainSizes,
    mechanics: &'a dyn ChainMechanics,
) -> PlantAlong<'a> {
    let (plant, n) = (&frame.plant, frame.coordinates());
    let table = plant.plant().table();
    let parameter = |name: &str| table.parameter(name).map_or(0.0, |k| frame.theta[k]);
    let coordinates = plant.plant().coordinates();
    let joint = |input: usize| {
        let (motor, link) = (plant.drives[input], plant.joints[input]);
        let [stiffness, damping] = spring(frame, input);
        let (twist, twist_rate) = (sizes.twist[input], sizes.twist_rate[input]);
        JointPlace {
            motor,
            link,
            torque: frame.intake.usual_torque[input],
            gear_error: GEAR_ERROR * twist,
            stiffness,
            stiffness_name: "jointStiffness",
            damping,
            link_inertia: 0.0,
            least_damping: damping.max(LEAST_DAMPING * stiffness * twist / twist_rate),
            turns: 1.0,
            rotor_turns: parameter(&format!("gearRatio[{}]", input + 1)),
            dry: coordinates[motor].dry_friction.map_or(0.0, |[slides, _]| frame.theta[slides]),
            viscous: parameter(&format!("viscousFriction[{}]", input + 1)),
            resolution: 0.0,
            motor_read: true,
            drive: sizes.torque[input],
            motor_speed: sizes.speed[motor],
            link_speed: sizes.speed[link],
            twist,
            twist_rate,
            range: 2.0 * sizes.reach[motor],
            reach: [sizes.middle[link], sizes.reach[link]],
        }
    };
    let channels: Vec<ChannelPlace> = frame
        .intake
        .channels
        .iter()
        .map(|c| ChannelPlace {
            place: "sensor",
            shows: match c.state {
                Some(k) if k < n => ShownBy::Position(k),
                Some(k) => ShownBy::Rate(k - n),
                None => shown_by_output(&c.name),
            },
            error: ERROR * c.variance.sqrt(),
            turns: 1.0,
            compared: true,
        })
        .collect();
    let runs = frame.runs.iter().map(|r| run_along(frame, r, &channels)).collect();
    let joints = (0..plant.drives.len()).map(joint).collect();
    let mut along = PlantAlong::new(MotionInStep::Curved, joints, channels, runs);
    along.mechanics = Some(mechanics);
    along.tip_axes = plant.tip_axes();
    along.late_together = Vec::new();
    for (_, group) in &frame.intake.groups {
        along.late_together.push(group.clone());
        let apart = group.len() > 1 && !group_of_groups(frame, group);
        along.late_together.extend(group.iter().filter(|_| apart).map(|c| vec![*c]));
    }
    if plant.floats() {
        let of = |values: &[f64]| [values[0], values[1], values[2]];
        along.base = Some(BasePlace {
            coordinates: [0, 1, 2],
            force: of(&frame.usual_force),
            speed: of(&sizes.speed),
            middle: of(&sizes.middle),
            reach: of(&sizes.reach),
            mass: parameter("baseMass"),
            inertia: parameter("baseInertia"),
        });
    }
    along
}

/// Whether a group has channels that another group has, too.
fn group_of_groups(frame: &TrajectoryFrame, group: &[usize]) -> bool {
    let smaller = frame.intake.groups.iter().filter(|g| g.1.len() < group.len());
    smaller.into_iter().any(|g| g.1.iter().any(|c| group.contains(c)))
}

/// What a channel that shows several coordinates is, by its name.
fn shown_by_output(name: &str) -> ShownBy {
    match name {
        "tipPosition[1]" => ShownBy::Tip(0),
        "tipPosition[2]" => ShownBy::Tip(1),
        "tipAttitude" => ShownBy::Tip(2),
        _ => ShownBy::Output,
    }
}

fn run_along(frame: &TrajectoryFrame, r: &TrajectoryRun, channels: &[ChannelPlace]) -> RunAlong {
    let (n, nodes) = (frame.coordinates(), &r.nodes);
    let width = channels.len();
    let times: Vec<f64> = nodes.time.iter().map(|t| t - nodes.time[0]).collect();
    let series = |first: usize| (first..first + n).map(|k| column(&r.states, 2 * n, k)).collect();
    let end = |k: usize| [k, n + k].map(|k| column(&r.accelerations, 2 * n, k));
    let part = median(nodes.step.clone()) / nodes.parts as f64;
    let rest = vec![0.0; frame.plant.drives.len()];
    let drive = |j: usize| DriveAlong::of_nodes(nodes, j, frame.plant.drive_gains[j], part);
    let shown = |c: usize| -> Vec<f64> {
        if !matches!(channels[c].shows, ShownBy::Tip(_) | ShownBy::Output) {
            return Vec::new();
        }
        let output = frame.intake.channels[c].output;
        let at = |t: usize| TrajectoryPoint {
            theta: &frame.theta,
            state: r.state(t),
            torque: &rest,
            time: r.nodes.since(t),
        };
        (0..nodes.len()).map(|t| frame.plant.output(at(t), output)).collect()
    };
    let moments = |c: usize| r.readings.moments.iter().skip(c).step_by(width).map(|m| m[0]).collect();
    RunAlong {
        accelerations: (0..n).map(end).collect(),
        moments: (0..width).map(moments).collect(),
        shown: (0..width).map(shown).collect(),
        drives: (0..rest.len()).map(drive).collect(),
        own_forces: (0..n).map(|k| column(&r.own, n, k)).collect(),
        ..RunAlong::new(times, nodes.step.clone(), nodes.parts, series(0), series(n))
    }
}

/// An arm with a hinge inside link `link` (from 0) at a share of its length, with its parameters; the hinge is the joint behind that
/// link's own.
pub type HingedChain<'a> = dyn Fn(&[f64], usize, f64) -> Option<(TrajectoryPlant, Vec<f64>)> + 'a;

/// Series by what they are of.
type KeptSeries<K, V> = RefCell<BTreeMap<K, Rc<V>>>;

/// Mechanics of a chain along the present trajectory of a frame.
pub struct FrameMechanics<'a> {
    frame: &'a TrajectoryFrame,
    hinged: &'a HingedChain<'a>,
    tips: KeptSeries<(usize, usize), Vec<Vec<f64>>>,
    hinges: KeptSeries<(usize, usize, u64), HingeAlong>,
}

impl<'a> FrameMechanics<'a> {
    /// Of a frame; `hinged` makes its arm with a hinge.
    pub fn new(frame: &'a TrajectoryFrame, hinged: &'a HingedChain<'a>) -> Self {
        Self { frame, hinged, tips: KeptSeries::default(), hinges: KeptSeries::default() }
    }

    /// Places and rates of the arm with a hinge, and accelerations at both ends of a step, the hinge at rest.
    fn with_rest(&self, values: &[f64], hinge: usize) -> Vec<f64> {
        let n = self.frame.coordinates();
        let each = values.chunks(n).flat_map(|v| v[..hinge].iter().chain([&0.0]).chain(&v[hinge..]));
        each.copied().collect()
    }

    fn make_hinge(&self, recording: usize, link: usize, at: f64) -> Option<HingeAlong> {
        let (frame, r) = (self.frame, &self.frame.runs[recording]);
        let (plant, theta) = (self.hinged)(&frame.theta, link, at)?;
        let n = plant.coordinates();
        let hinge = frame.plant.joints[link] + 1;
        let kept: Vec<usize> = (0..n).filter(|k| *k != hinge).collect();
        let tip =
            ["tipPosition[1]", "tipPosition[2]", "tipAttitude"].map(|o| plant.plant().table().output(o));
        let tip: Vec<usize> = tip.into_iter().collect::<Option<_>>()?;
        let rest = vec![0.0; plant.drives.len()];
        let mut out = HingeAlong { inertia: vec![Vec::new(); kept.len()], ..HingeAlong::default() };
        let mut next = None;
        for t in 0..r.nodes.len() {
            let at = |node: usize| {
                let state = self.with_rest(r.state(node), hinge);
                let inverse = plant.inverse_mass(&theta, &state).ok()?;
                let mass = DMatrix::from_row_slice(n, n, &inverse.mass());
                Some((state, inverse, mass))
            };
            let begin = next.take().or_else(|| at(t))?;
            let end = at((t + 1).min(r.nodes.len() - 1))?;
            let mut torque = 0.0;
            for (k, (state, inverse, _)) in [&begin, &end].into_iter().enumerate() {
                let a = self.with_rest(r.acceleration(t, k), hinge);
                torque += 0.5 * plant.needed_by(&theta, state, &a, inverse)[hinge];
            }
            let mass = 0.5 * (&begin.2 + &end.2);
            let point =
                TrajectoryPoint { theta: &theta, state: &begin.0, torque: &rest, time: r.nodes.since(t) };
            let slopes = plant.outputs_along(point, &tip, hinge);
            out.torque.push(torque);
            out.inertia.iter_mut().zip(&kept).for_each(|(m, k)| m.push(mass[(*k, hinge)]));
            out.mobility.push(mass.try_inverse()?[(hinge, hinge)]);
            out.tip.iter_mut().zip(slopes).for_each(|(j, slope)| j.push(slope));
            next = Some(end);
        }
        Some(out)
    }
}

impl ChainMechanics for FrameMechanics<'_> {
    fn field(&self, recording: usize, axis: usize) -> Option<Vec<Vec<f64>>> {
        let (frame, r) = (self.frame, &self.frame.runs[recording]);
        let n = frame.coordinates();
        let gravity = frame.plant.plant().table().parameter(&format!("gravity[{}]", axis + 1));
        let mut forces = vec![Vec::with_capacity(r.nodes.len()); n];
        for t in 0..r.nodes.len() {
            let at: Vec<f64> = if frame.plant.floats() {
                // All bodies accelerate alike.
                column(&r.inverse_mass(t).mass(), n, axis)
            } else {
                let rest = vec![0.0; frame.plant.drives.len()];
                let point = TrajectoryPoint {
                    theta: &frame.theta,
                    state: r.state(t),
                    torque: &rest,
                    time: r.nodes.since(t),
                };
                frame.plant.sensitivity(point, &vec![0.0; n], &[(gravity?, 1.0)], r.inverse_mass(t))
            };
            forces.iter_mut().zip(at).for_each(|(all, f)| all.push(f));
        }
        Some(forces.iter().map(|f| over_steps(f)).collect())
    }
    fn tip(&self, recording: usize, axis: usize) -> Option<Rc<Vec<Vec<f64>>>> {
        if let Some(found) = self.tips.borrow().get(&(recording, axis)) {
            return Some(found.clone());
        }
        let (frame, r) = (self.frame, &self.frame.runs[recording]);
        let n = frame.coordinates();
        let output = frame.plant.tip_output(axis)?;
        let rest = vec![0.0; frame.plant.drives.len()];
        let mut tip = vec![Vec::with_capacity(r.nodes.len()); n];
        for t in 0..r.nodes.len() {
            let at = TrajectoryPoint {
                theta: &frame.theta,
                state: r.state(t),
                torque: &rest,
                time: r.nodes.since(t),
            };
            let gradient = frame.plant.outputs(at, &[output]).1;
            tip.iter_mut().zip(gradient).for_each(|(j, g)| j.push(g));
        }
        let tip = Rc::new(tip);
        self.tips.borrow_mut().insert((recording, axis), tip.clone());
        Some(tip)
    }
    fn hinge(&self, recording: usize, link: usize, at: f64) -> Option<Rc<HingeAlong>> {
        let key = (recording, link, at.to_bits());
        if let Some(found) = self.hinges.borrow().get(&key) {
            return Some(found.clone());
        }
        let made = Rc::new(self.make_hinge(recording, link, at)?);
        self.hinges.borrow_mut().insert(key, made.clone());
        Some(made)
    }
}
