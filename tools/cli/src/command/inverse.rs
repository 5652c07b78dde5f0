//! `trueup inverse`

use fmu_plant::PlantModelTable;
use nalgebra::{DMatrix, DVector};
use trueup_fmi::configuration::Configuration;
use trueup_fmi_export::FmuModel;
use trueup_models::arm::{
    BASE_CHOICE, BY_ACCELERATION, FIXED_BASE, InverseDynamics, JOINT_DRIVE_CHOICE, output,
};
use trueup_numerics::ShortNumber;
use trueup_report::number;
use trueup_signals::spline::Spline;
use trueup_signals::{DeclaredFigures, Finding, Recording, WrittenTable, element_name};

use super::pack::start;
use crate::args::Inverse;
use crate::error::CliError;
use crate::output::{can_be_written, say};
use crate::voice;

const MODEL: &str = "PlanarManipulator";

pub(crate) fn run(args: &Inverse) -> Result<(), CliError> {
    let known = &DeclaredFigures::default();
    let (recording, findings) =
        Recording::read(&args.motion, &[], known).map_err(|e| CliError::Failed(e.to_string()))?;
    crate::case::tell(&findings);
    if findings.iter().any(Finding::is_error) {
        return Err(CliError::Said);
    }
    can_be_written(&args.output)?;
    let motion = Motion::of(args, &recording)?;
    let (inverse, p) = model(args, &motion)?;
    let n = motion.splines.len();
    let accelerations = |t: f64, u: &mut [f64]| {
        u.iter_mut().zip(&motion.splines).for_each(|(a, spline)| *a = spline.at(t)[2]);
    };
    let run = inverse.along(&p, &accelerations, &motion.times).map_err(|e| CliError::at(&args.motion, e))?;
    let own = run.y.first().map_or(0, Vec::len) - n;
    let column = |name: String, at: usize| (name, run.y.iter().map(|y| y[at]).collect::<Vec<f64>>());
    let mut columns = vec![("time".to_owned(), motion.times.clone())];
    columns.extend((0..n).map(|j| column(element_name("jointTorque", &[j + 1]), own + j)));
    columns.extend((0..n).map(|j| column(element_name("jointAngle", &[j + 1]), output::joint_angle(n) + j)));
    columns
        .extend((0..2).map(|i| column(element_name("basePosition", &[i + 1]), output::base_position(n) + i)));
    columns.push(column("baseAttitude".into(), output::base_attitude(n)));
    let mut text = String::new();
    for (name, values) in &columns[1..=n] {
        let most = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        text += &format!("{name}: {} N.m at most\n", number(most));
    }
    if !args.fixed_base {
        let turned = columns.last().and_then(|c| Some(c.1.last()? - c.1.first()?)).unwrap_or(0.0);
        text += &format!("base turned by {} rad\n", number(turned));
    }
    text += &format!("{}: {} rows\n", args.output.display(), motion.times.len());
    WrittenTable { columns }.write(&args.output).map_err(|e| CliError::Failed(e.to_string()))?;
    say(&text)
}

/// Angles of the motors over time, one curve per joint.
struct Motion {
    times: Vec<f64>,
    splines: Vec<Spline>,
    flexible: Vec<bool>,
}

impl Motion {
    fn of(args: &Inverse, recording: &Recording) -> Result<Self, CliError> {
        let wrong = |what: String| CliError::at(&args.motion, what);
        let channel = |of: &str, j: usize| recording.channel(&element_name(of, &[j + 1]));
        let there = |j: &usize| channel("jointAngle", *j).or(channel("motorAngle", *j)).is_some();
        let n = if args.flexible.is_empty() { (0..).take_while(there).count() } else { args.flexible.len() };
        let flexible = if args.flexible.is_empty() { vec![false; n] } else { args.flexible.clone() };
        if n == 0 {
            let what = "it has no angle of joint 1; name a column jointAngle[1] (of a flexible joint motorAngle[1]), in rad, or map one in the sidecar";
            return Err(wrong(what.into()));
        }
        let mut shared: Option<Vec<f64>> = None;
        let mut splines = Vec::new();
        for (j, flexible) in flexible.iter().enumerate() {
            let found = match flexible {
                true => channel("motorAngle", j),
                false => channel("jointAngle", j).or(channel("motorAngle", j)),
            };
            let name = element_name(if *flexible { "motorAngle" } else { "jointAngle" }, &[j + 1]);
            let found = found.ok_or_else(|| {
                wrong(format!("it has no column {name}: the motion of joint {} is not known", j + 1))
            })?;
            let noise = args.noise.or_else(|| found.sensor.deviation()).unwrap_or(0.0);
            let times: Vec<f64> = found.time.iter().map(|t| t - found.sensor.delay).collect();
            let spline = (times.len() >= LEAST).then(|| curve(&times, &found.believed(), noise)).flatten();
            let spline = spline.ok_or_else(|| {
                wrong(format!(
                    "{name} has {} samples; a curve with accelerations takes {LEAST} or more",
                    times.len()
                ))
            })?;
            splines.push(spline);
            // Where all of them are known.
            let of = [times[0], times[times.len() - 1]];
            shared = Some(match shared {
                None => times,
                Some(all) => all.into_iter().filter(|t| (of[0]..=of[1]).contains(t)).collect(),
            });
        }
        let times = shared.filter(|t| t.len() >= 2);
        let times = times.ok_or_else(|| wrong("its joints are never recorded at the same time".into()))?;
        Ok(Self { times, splines, flexible })
    }
}

/// Samples of an angle that a curve takes.
const LEAST: usize = 5;
/// Samples at either end beyond which the motion goes on along their cubic; of noisy angles a share of all, whose curvature is known
/// better.
const END: usize = 8;
const NOISY_END: usize = 8;

/// The smoothest curve within the noise. A natural spline has no acceleration at its ends, so it begins and ends beyond the motion.
fn curve(times: &[f64], values: &[f64], noise: f64) -> Option<Spline> {
    let beyond = |at: std::ops::Range<usize>, from: f64| -> Option<Vec<(f64, f64)>> {
        let (t, y) = (&times[at.clone()], &values[at]);
        let span = t[t.len() - 1] - t[0];
        let a = DMatrix::from_fn(t.len(), 4, |i, k| ((t[i] - from) / span).powi(k as i32));
        let c = a.svd(true, true).solve(&DVector::from_column_slice(y), 1e-12).ok()?;
        // Mirrored about the end.
        let point = |t: &f64| {
            let s = (from - t) / span;
            (2.0 * from - t, c[0] + s * (c[1] + s * (c[2] + s * c[3])))
        };
        Some(t.iter().filter(|t| **t != from).map(point).collect())
    };
    let n = times.len();
    let end = if noise > 0.0 { END.max(n / NOISY_END) } else { END }.min(n);
    let (mut before, mut after) = (beyond(0..end, times[0])?, beyond(n - end..n, times[n - 1])?);
    before.reverse();
    after.reverse();
    let own = times.iter().copied().zip(values.iter().copied());
    let (t, y): (Vec<f64>, Vec<f64>) = before.into_iter().chain(own).chain(after).unzip();
    Spline::new(&t, &y, noise)
}

/// The manipulator at the beginning of the motion.
fn model(args: &Inverse, motion: &Motion) -> Result<(InverseDynamics, Vec<f64>), CliError> {
    let usage = CliError::Usage;
    let mut structure = vec![(JOINT_DRIVE_CHOICE.to_owned(), vec![BY_ACCELERATION])];
    if args.fixed_base {
        structure.push((BASE_CHOICE.to_owned(), vec![FIXED_BASE]));
    }
    let mut configuration =
        Configuration { joint_flexible: motion.flexible.clone(), structure, ..Configuration::of(MODEL) };
    let plant = PlantModelTable::build(&configuration).map_err(usage)?;
    let mut table = plant.table();
    let start = motion.times[0];
    for (j, spline) in motion.splines.iter().enumerate() {
        let [angle, rate, _] = spline.at(start);
        for (name, value) in [("initialJointAngle", angle), ("initialJointVelocity", rate)] {
            start::assign(&mut configuration.start, &element_name(name, &[j + 1]), value);
        }
    }
    for set in &args.set {
        for (name, value) in start::parse(&table, set).map_err(usage)? {
            let prescribed = ["initialJoint", "initialMotor", "motorAcceleration"];
            if prescribed.iter().any(|p| name.starts_with(p)) {
                let what =
                    format!("--set {set}: the motion is that of {}; leave it out", args.motion.display());
                return Err(CliError::Usage(what));
            }
            start::assign(&mut configuration.start, &name, value);
        }
    }
    table.apply(&configuration.start).map_err(usage)?;
    let p = table.parameter_starts();
    plant.check(&p).map_err(|(_, why)| CliError::Usage(why))?;
    let PlantModelTable::InverseDynamics(inverse) = plant else {
        return Err(CliError::Failed(format!("{MODEL} has no inverse dynamics; report this")));
    };
    if start != 0.0 {
        voice::note(&format!("the motion begins at {} s, the base at rest there", ShortNumber(start)));
    }
    Ok((inverse, p))
}
