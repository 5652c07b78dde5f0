//! The picture of a free-floating manipulator.

use trueup_models::arm::{PlanarManipulator, input, output, parameter};
use trueup_models::layout::LayoutEntry;
use trueup_plant::elements;
use trueup_signals::Loaded;
use trueup_signals::process::ChannelGrid;

use super::{Picture, PictureComponent, QuantityCourse, at_motor, deviation, titled};
use crate::locate::map::curve;
use crate::locate::{
    ArmBalances, ArmColumns, BoundarySide, EquationBalance, ResidualSeries, arm_balances, bands, intervals,
};
use trueup_numerics::order::descending;

/// Balances are looked at below this part of the sampling rate.
const CUTOFF: f64 = 0.08;
/// ... and below this frequency in Hz: arms that float move slowly, and noise of accelerations grows with its square.
const FASTEST: f64 = 3.0;
/// Coordinates of the base.
const BASE: usize = 3;
/// Those of them that give its place, in m: forces act on them.
const PLACE: usize = 2;
/// Relative standard deviation of masses and inertias where none is declared.
const DEVIATION: f64 = 0.05;

pub(super) fn look(out: &mut Picture, loaded: &Loaded, arm: &PlanarManipulator, p: &[f64]) {
    let n = arm.links();
    let deviations = deviations(loaded, n, p);
    let mut all: Vec<(&str, f64, ArmBalances)> = Vec::new();
    for recording in loaded.train() {
        let names = coordinates(arm);
        let inputs = channels(&input::list(&arm.layout()));
        let required: Vec<&str> = names
            .iter()
            .chain(&inputs)
            .map(String::as_str)
            .filter(|c| recording.channel(c).is_some())
            .collect();
        // Base and joints are required, a fixed base only for its sensors; a motor without one turns with its joint.
        let first = if arm.has_fixed_base() { BASE } else { 0 };
        if names[first..BASE + n].iter().any(|c| !required.contains(&c.as_str())) {
            continue;
        }
        let step = names[first..BASE + n]
            .iter()
            .filter_map(|c| recording.channel(c)?.median_step())
            .fold(0.0, f64::max);
        let Some(grid) = ChannelGrid::of(recording, &required, step) else { continue };
        let column = |name: &String| -> &[f64] {
            required.iter().position(|w| w == name).map_or(&[], |k| &grid.columns[k])
        };
        let floor = |name: &String| deviation(&out.floors, name).unwrap_or(0.0);
        let still = vec![0.0; grid.columns.first().map_or(0, Vec::len)];
        let position = |(i, name): (usize, &String)| if i < first { &still[..] } else { column(name) };
        let columns = ArmColumns {
            step,
            position: names.iter().enumerate().map(position).collect(),
            velocity: Vec::new(),
            input: inputs.iter().map(column).collect(),
            position_floor: names.iter().map(floor).collect(),
            velocity_floor: Vec::new(),
        };
        if let Some(b) = arm_balances(arm, p, &columns, &deviations, (CUTOFF / step).min(FASTEST)) {
            let start = grid.start + b.first as f64 * step;
            for (k, (name, row)) in names.iter().zip(&b.missing).enumerate() {
                let unit = if k < PLACE { "N" } else { "N.m" };
                let time = (0..row.value.len()).map(|k| start + k as f64 * step).collect();
                let (title, recording) =
                    (format!("Missing in the balance of {name}"), recording.name.clone());
                out.courses.push(QuantityCourse {
                    title,
                    recording,
                    unit: unit.into(),
                    time,
                    value: row.value.clone(),
                });
            }
            all.push((&recording.name, step, b));
        }
    }
    if all.is_empty() {
        return;
    }
    let worst = |c: BoundarySide| all.iter().any(|(.., b)| b.cause == c);
    let cause = [BoundarySide::External, BoundarySide::Internal]
        .into_iter()
        .find(|c| worst(*c))
        .unwrap_or(BoundarySide::None);
    out.cause = Some(cause);
    // Excess of each row over all recordings, in squared floors.
    let excess: Vec<f64> = (0..arm.dofs())
        .map(|r| all.iter().map(|(.., b)| (b.ratios[r].powi(2) - 1.5).max(0.0)).sum())
        .collect();
    if cause != BoundarySide::None {
        out.places = places(arm, cause, &excess, &all);
    }
    let row = (0..arm.dofs()).max_by(|a, b| excess[*a].total_cmp(&excess[*b])).unwrap_or(0);
    out.courses.retain(|c| c.title.ends_with(&format!(" {}", coordinates(arm)[row])));
    if excess[row] <= 0.0 {
        return;
    }
    let residuals: Vec<ResidualSeries<'_>> = all
        .iter()
        .zip(&out.courses)
        .map(|((name, _, b), c)| ResidualSeries {
            recording: name,
            time: &c.time,
            value: &c.value,
            floor: b.missing[row].floor,
        })
        .collect();
    out.intervals = intervals(&residuals, 0.1);
    let title = out.courses[0].title.clone();
    let unit = out.courses[0].unit.clone();
    if let Some(found) = bands(&residuals, None) {
        out.bands.push(titled(&format!("{title}, spectrum"), ["frequency", "Hz"], &unit, found));
    }
    let speed: Vec<f64> = all.iter().flat_map(|(.., b)| b.velocity[row].iter().copied()).collect();
    let missing: Vec<f64> = all.iter().flat_map(|(.., b)| b.missing[row].value.iter().copied()).collect();
    if let Some(c) = curve(&speed, &missing, 24) {
        let along = if row < 2 { ["speed", "m/s"] } else { ["speed", "rad/s"] };
        out.curves.push(titled(&format!("{title}, against its speed"), along, &unit, c));
    }
}

/// Components by the rows that they show in.
fn places(
    arm: &PlanarManipulator,
    cause: BoundarySide,
    excess: &[f64],
    all: &[(&str, f64, ArmBalances)],
) -> Vec<PictureComponent> {
    let n = arm.links();
    let whole: f64 = excess.iter().sum();
    let mut found = Vec::new();
    let mut add = |component: &str, joint: Option<usize>, size: f64| {
        if size > 0.005 * whole {
            found.push(PictureComponent { component: component.to_owned(), joint, share: size / whole });
        }
    };
    let (base, links) = (excess[..BASE].iter().sum::<f64>(), excess[BASE..BASE + n].iter().sum::<f64>());
    if cause == BoundarySide::External {
        // Forces on the base are in its rows alone; those on the tip are in those of all joints too.
        let on_tip = excess[BASE..BASE + n].iter().filter(|e| **e > 1.0).count() == n && links > 0.1 * base;
        add(if on_tip { "tip" } else { "base" }, None, base + if on_tip { links } else { 0.0 });
    }
    let at_motor = |r: usize| {
        let join =
            |f: &dyn Fn(&ArmBalances) -> Vec<f64>| all.iter().flat_map(|(.., b)| f(b)).collect::<Vec<_>>();
        at_motor(&join(&|b| b.missing[r].value.clone()), &join(&|b| b.velocity[r].clone()))
    };
    let handled = cause == BoundarySide::External
        && found.first().is_some_and(|p: &PictureComponent| p.component == "tip");
    for i in 0..n {
        let (joint, motor) = (BASE + i, arm.motor(i));
        let mut add = |component: &str, size: f64| {
            if size > 0.005 * whole {
                found.push(PictureComponent {
                    component: component.to_owned(),
                    joint: Some(i + 1),
                    share: size / whole,
                });
            }
        };
        if motor == joint {
            add(at_motor(joint), if handled { 0.0 } else { excess[joint] });
        } else if excess[joint].min(excess[motor]) > 0.02 * excess[joint].max(excess[motor])
            && opposed(all, joint, motor)
        {
            add("transmission", excess[joint] + excess[motor]);
        } else {
            add(at_motor(motor), excess[motor]);
            add("load", if handled { 0.0 } else { excess[joint] });
        }
    }
    descending(&mut found, |item| item.share);
    found
}

/// Whether two rows are missing the same, the other way round.
fn opposed(all: &[(&str, f64, ArmBalances)], a: usize, b: usize) -> bool {
    let sum = |f: &dyn Fn(&ArmBalances) -> f64| all.iter().map(|(.., balances)| f(balances)).sum::<f64>();
    let dot = |x: &EquationBalance, y: &EquationBalance| {
        x.value.iter().zip(&y.value).map(|(x, y)| x * y).sum::<f64>()
    };
    // Noise has no counterpart.
    let power = |x: &EquationBalance| dot(x, x) - x.value.len() as f64 * x.floor.powi(2);
    let size = |r: usize| sum(&|x| power(&x.missing[r])).max(0.0);
    sum(&|x| dot(&x.missing[a], &x.missing[b])) < -0.5 * (size(a) * size(b)).sqrt()
}

/// Channels of the coordinates in the model's order, those of a base that is fixed too.
fn coordinates(arm: &PlanarManipulator) -> Vec<String> {
    let n = arm.links();
    let motors = (0..n).filter(|j| arm.flexible()[*j]).map(|j| output::motor_angle(n) + j);
    let joints = (0..n).map(|j| output::joint_angle(n) + j);
    let base = [output::base_position(n), output::base_position(n) + 1, output::base_attitude(n)];
    let all = channels(&output::list(&arm.layout()));
    base.into_iter().chain(joints).chain(motors).map(|k| all[k].clone()).collect()
}

/// Channels of the variables of a list, element by element.
fn channels<K>(list: &[LayoutEntry<K>]) -> Vec<String> {
    list.iter().flat_map(|e| elements(e.name, &e.dimensions)).collect()
}

/// Standard deviations of masses, inertias and centres of mass.
fn deviations(loaded: &Loaded, n: usize, p: &[f64]) -> Vec<(usize, f64)> {
    let mut all = Vec::new();
    let mut add = |index: usize, name: String, scale: f64| {
        let doubt = loaded.case.doubt(&name).unwrap_or(DEVIATION);
        all.push((index, doubt * scale.abs()));
    };
    add(parameter::base_mass(n), "baseMass".into(), p[parameter::base_mass(n)]);
    add(parameter::base_inertia(n), "baseInertia".into(), p[parameter::base_inertia(n)]);
    for i in 0..n {
        for (begin, name) in
            [(parameter::link_mass(n), "linkMass"), (parameter::link_inertia(n), "linkInertia")]
        {
            add(begin + i, format!("{name}[{}]", i + 1), p[begin + i]);
        }
        for axis in 0..2 {
            let name = format!("linkCenterOfMass[{},{}]", i + 1, axis + 1);
            // Both axes have standard deviations in parts of the length.
            add(parameter::link_center_of_mass(n) + 2 * i + axis, name, p[parameter::link_length(n) + i]);
        }
    }
    all.retain(|(_, sd)| *sd > 0.0);
    all
}
