//! The picture of a two-mass joint.

use std::collections::BTreeMap;

use trueup_models::compiled::Compiled;
use trueup_models::joint::{TwoMassJoint, input, parameter as j};
use trueup_numerics::hybrid::At;
use trueup_plant::Plant;
use trueup_signals::process::ChannelGrid;
use trueup_signals::{Interpolation, Loaded};

use super::{Picture, PictureComponent, QuantityCourse, at_motor, deviation, titled};
use crate::locate::map::{curve, surface};
use crate::locate::unknown_input::{UnknownInputEstimate, place_shares};
use crate::locate::{
    Interval, JointColumns, ResidualSeries, bands, joint_balances, joint_intervals, joint_unknown_inputs,
    orders,
};
use trueup_numerics::order::descending;

/// Highest order of a motor's turn that is looked at.
const ORDERS: f64 = 12.0;
/// Balances are looked at below this part of the sampling rate.
const CUTOFF: f64 = 0.05;

/// Velocities are slopes over twice this, s.
const SMOOTH: f64 = 0.02;

/// A recording on even steps.
struct EvenRecording<'a> {
    name: &'a str,
    grid: ChannelGrid,
    hold: bool,
    at: BTreeMap<&'static str, usize>,
}

impl EvenRecording<'_> {
    fn column(&self, name: &str) -> &[f64] {
        self.at.get(name).map_or(&[], |k| &self.grid.columns[*k])
    }
}

impl EvenRecording<'_> {
    /// Adds what the effects of the nominal model do to what drives it: to the torque on the load, and to the current.
    /// Laws with states of their own are as at their start.
    fn drive_by(&mut self, joint: &TwoMassJoint, plain: &TwoMassJoint, p: &[f64]) {
        let n = self.grid.columns.first().map_or(0, Vec::len);
        let gear = p[j::GEAR_RATIO];
        let angle = |name: &str, other: &str, factor: f64| -> Vec<f64> {
            let own = self.column(name);
            if own.is_empty() {
                self.column(other).iter().map(|q| q * factor).collect()
            } else {
                own.to_vec()
            }
        };
        let motor = angle("motorAngle", "loadAngle", gear);
        let load = angle("loadAngle", "motorAngle", 1.0 / gear);
        let reach = ((SMOOTH / self.grid.step).ceil() as usize).max(1);
        let slope = |q: &[f64], k: usize| {
            let (a, b) = (k.saturating_sub(reach), (k + reach).min(n - 1));
            (q[b] - q[a]) / ((b - a).max(1) as f64 * self.grid.step)
        };
        let both = [joint, plain].map(|m| Compiled::new(m.clone()));
        let mut begin = p.to_vec();
        let (mut at_motor, mut at_load) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for k in 0..n {
            begin[j::INITIAL_MOTOR_ANGLE] = motor[k];
            begin[j::INITIAL_LOAD_ANGLE] = load[k];
            begin[j::INITIAL_MOTOR_VELOCITY] = slope(&motor, k);
            begin[j::INITIAL_LOAD_VELOCITY] = slope(&load, k);
            let rates = |model: &dyn Plant| {
                let size = model.sizes();
                let (mut x, mut dx) = (vec![0.0; size.states], vec![0.0; size.states]);
                let (u, moves) = ([0.0; input::COUNT], [begin[j::INITIAL_MOTOR_VELOCITY].signum() as i32]);
                let mut modes = vec![0; size.modes];
                modes.iter_mut().zip(moves).for_each(|(m, v)| *m = v);
                model.start(&begin[..size.parameters], &mut x);
                let at = At {
                    t: self.grid.start + k as f64 * self.grid.step,
                    x: &x,
                    u: &u,
                    p: &begin,
                    modes: &modes,
                };
                model.rates(at, &[], &mut dx);
                dx
            };
            let [with, without] = both.each_ref().map(|m| rates(m.plant()));
            at_motor.push(p[j::MOTOR_INERTIA] * (with[1] - without[1]));
            at_load.push(if joint.flexible() { p[j::LOAD_INERTIA] * (with[3] - without[3]) } else { 0.0 });
        }
        let whole = if joint.flexible() {
            1.0
        } else {
            1.0 + p[j::LOAD_INERTIA] / (p[j::MOTOR_INERTIA] * gear * gear)
        };
        let mut add = |name: &'static str, by: Vec<f64>| match self.at.get(name) {
            Some(k) => self.grid.columns[*k].iter_mut().zip(by).for_each(|(own, by)| *own += by),
            None => {
                self.at.insert(name, self.grid.columns.len());
                self.grid.columns.push(by);
            }
        };
        add("motorCurrent", at_motor.iter().map(|t| whole * t / p[j::TORQUE_CONSTANT]).collect());
        add("externalTorque", at_load);
    }
}

pub(super) fn look(out: &mut Picture, loaded: &Loaded, joint: &TwoMassJoint, p: &[f64]) {
    let flexible = joint.flexible();
    let floors = |name: &str| deviation(&out.floors, name).unwrap_or(0.0);
    let [current_floor, motor_floor, load_floor] = ["motorCurrent", "motorAngle", "loadAngle"].map(floors);
    let mut runs: Vec<EvenRecording<'_>> = loaded.train().into_iter().filter_map(run).collect();
    if let (true, Ok(plain)) =
        (joint.effects().iter().next().is_some(), TwoMassJoint::new::<&str>(flexible, &[]))
    {
        runs.iter_mut().for_each(|run| run.drive_by(joint, &plain, p));
    }
    fn columns<'a>(run: &'a EvenRecording<'_>, floors: [f64; 3]) -> JointColumns<'a> {
        JointColumns {
            step: run.grid.step,
            current: run.column("motorCurrent"),
            hold: run.hold,
            external: run.column("externalTorque"),
            motor: run.column("motorAngle"),
            load: run.column("loadAngle"),
            current_floor: floors[0],
            motor_floor: floors[1],
            load_floor: floors[2],
        }
    }
    let floors = [current_floor, motor_floor, load_floor];
    let estimates: Vec<Vec<UnknownInputEstimate>> =
        runs.iter().map(|run| joint_unknown_inputs(p, flexible, &columns(run, floors))).collect();
    // Over all recordings: gains add up, what is explained by weight of what there is to explain.
    let mut pooled: Vec<UnknownInputEstimate> = Vec::new();
    for e in estimates.iter().flatten() {
        match pooled.iter_mut().find(|q| q.place == e.place) {
            Some(q) => {
                let sum = q.gain.max(0.0) + e.gain.max(0.0);
                if sum > 0.0 {
                    q.explained = (q.explained * q.gain.max(0.0) + e.explained * e.gain.max(0.0)) / sum;
                }
                q.gain += e.gain;
            }
            None => {
                pooled.push(UnknownInputEstimate { value: Vec::new(), deviation: Vec::new(), ..e.clone() })
            }
        }
    }
    descending(&mut pooled, |item| item.gain);
    let Some(best) = pooled.first().map(|e| e.place.clone()) else { return };
    let Some(gear) = p.get(j::GEAR_RATIO).copied() else { return };
    let torque = !best.starts_with("sensor");
    let unit = if torque { "N.m" } else { "rad" };
    let title = match best.as_str() {
        "motor" => "Unknown torque at the motor".to_owned(),
        "transmission" => "Unknown torque in the transmission (motor side)".to_owned(),
        "load" => "Unknown torque at the load (motor side)".to_owned(),
        sensor => format!("Unknown error of {sensor}"),
    };
    let (mut velocity, mut motor, mut twist, mut load) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut unknown = Vec::new();
    // Shares of a recording become shares of all, by their power.
    let power = |found: &[UnknownInputEstimate]| -> f64 {
        found.iter().filter(|e| e.place == best).flat_map(|e| &e.value).map(|d| d * d).sum()
    };
    let whole: f64 = estimates.iter().map(|found| power(found)).sum();
    let mut intervals = Vec::new();
    for (run, found) in runs.iter().zip(&estimates) {
        let Some(e) = found.iter().find(|e| e.place == best) else { continue };
        let c = columns(run, floors);
        let weight = if whole > 0.0 { power(found) / whole } else { 0.0 };
        let here = joint_intervals(p, flexible, &c, e, run.name, run.grid.start, 0.02);
        intervals.extend(here.into_iter().map(|i| Interval { share: i.share * weight, ..i }));
        let (angle, factor) = if c.motor.is_empty() { (c.load, gear) } else { (c.motor, 1.0) };
        let reach = ((SMOOTH / run.grid.step).ceil() as usize).max(1);
        let n = e.value.len();
        velocity.extend((0..n).map(|i| {
            let (a, b) = (i.saturating_sub(reach), (i + reach).min(n - 1));
            factor * (angle[b] - angle[a]) / ((b - a).max(1) as f64 * run.grid.step)
        }));
        motor.extend(angle[..n].iter().map(|q| factor * q));
        if c.load.len() == n {
            load.extend_from_slice(c.load);
            if c.motor.len() == n {
                twist.extend((0..n).map(|i| c.motor[i] - gear * c.load[i]));
            }
        }
        unknown.extend_from_slice(&e.value);
        let time = run.grid.time();
        let (recording, value) = (run.name.to_owned(), e.value.clone());
        out.courses.push(QuantityCourse { title: title.clone(), recording, unit: unit.into(), time, value });
    }
    descending(&mut intervals, |item| item.share);
    out.intervals = intervals;
    for (place, share) in place_shares(&pooled).into_iter().filter(|s| s.1 >= 0.005) {
        let component =
            if place == "motor" && best == "motor" { at_motor(&unknown, &velocity) } else { &place };
        let component = if component == "motor" { "motor-friction" } else { component };
        out.places.push(PictureComponent { component: component.to_owned(), joint: None, share });
    }
    let mut along = |name: &str, unit_x: &str, x: &[f64]| {
        if x.len() == unknown.len()
            && let Some(c) = curve(x, &unknown, 30)
        {
            out.curves.push(titled(&format!("{title}, against {name}"), [name, unit_x], unit, c));
        }
    };
    along("motor speed", "rad/s", &velocity);
    along("load angle", "rad", &load);
    along("twist (motor side)", "rad", &twist);
    let found = orders(&motor, &unknown, ORDERS);
    if !found.is_empty() {
        out.orders.push(titled(
            &format!("{title}, by the motor's turn"),
            ["periods per turn", ""],
            unit,
            found,
        ));
    }
    let residuals: Vec<ResidualSeries<'_>> = runs
        .iter()
        .zip(&estimates)
        .zip(&out.courses)
        .filter_map(|((run, found), course)| {
            let e = found.iter().find(|e| e.place == best)?;
            let mut sorted = e.deviation.clone();
            sorted.sort_unstable_by(f64::total_cmp);
            let floor = sorted.get(sorted.len() / 2).copied().filter(|f| *f > 0.0)?;
            Some(ResidualSeries { recording: run.name, time: &course.time, value: &e.value, floor })
        })
        .collect();
    if let Some(found) = bands(&residuals, None) {
        out.bands.push(titled(&format!("{title}, spectrum"), ["frequency", "Hz"], unit, found));
    }
    // What the transmission carries, by the load's motion.
    if flexible {
        let (mut twist, mut rate, mut carried) = (Vec::new(), Vec::new(), Vec::new());
        for run in &runs {
            let c = columns(run, floors);
            if let Some(b) = joint_balances(p, &c, CUTOFF / run.grid.step) {
                twist.extend(b.twist);
                rate.extend(b.twist_rate);
                carried.extend(b.transmission_torque);
            }
        }
        if let Some(map) = surface(&twist, &rate, &carried, 20) {
            let title = "Torque of the transmission over twist and its rate (motor side)";
            let mut surface = titled(title, ["twist", "rad"], "N.m", map);
            surface.y = ["rate of twist", "rad/s"].map(str::to_owned);
            out.surfaces.push(surface);
        }
    }
}

fn run(recording: &trueup_signals::Recording) -> Option<EvenRecording<'_>> {
    let known = ["motorCurrent", "externalTorque", "motorAngle", "loadAngle"];
    let names: Vec<&'static str> = known.into_iter().filter(|n| recording.channel(n).is_some()).collect();
    let angle = ["motorAngle", "loadAngle"].into_iter().find_map(|n| recording.channel(n))?;
    let current = recording.channel("motorCurrent")?;
    let grid = ChannelGrid::of(recording, &names, angle.median_step()?)?;
    let at = names.iter().enumerate().map(|(k, n)| (*n, k)).collect();
    Some(EvenRecording {
        name: &recording.name,
        grid,
        hold: current.interpolation == Interpolation::Hold,
        at,
    })
}
