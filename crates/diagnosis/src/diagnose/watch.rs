//! When suspect recordings part from a model that was fitted to healthy ones.
//!
//! Both drive the fitted model; what its accelerations miss in healthy recordings, over short windows, is what it
//! may miss at any time. What a suspect one misses beyond that is a departure, from where it first rises to half of its
//! height to where it last is as high.

use trueup_identification::model::PlantQuantity;
use trueup_identification::parallel;
use trueup_models::effect::PlantKind;

use crate::engine::balance::GriddedRecording;
use crate::engine::problem::{BalanceProblem, Compared};
use crate::engine::replay::CompleteModel;
use crate::engine::search::CaseSearch;
use crate::outcome::{Departure, SimilarCause};
use crate::picture::at_motor;

/// Times what healthy recordings miss at the most that a suspect one has to miss.
const BEYOND: f64 = 1.5;
/// Length of a window, in deviations of the kernel that readings are smoothed by.
const WINDOW: f64 = 4.0;

/// What a model misses of one recording.
struct Missed {
    recording: String,
    t: Vec<f64>,
    channels: Vec<ChannelWatch>,
    /// Instants of a window, at least two.
    window: usize,
}

/// Of one channel of it.
struct ChannelWatch {
    /// Of the model's outputs.
    output: usize,
    /// Coordinate whose acceleration it prescribes; `None`: it is compared as it is.
    leads: Option<usize>,
    name: String,
    missed: Vec<f64>,
    /// Rate of what it shows.
    rate: Vec<f64>,
    /// Input that drives that coordinate, and the acceleration that it shows per unit of that.
    driven: Option<(usize, f64)>,
}

/// Departures in the recordings held out, in the order of their times.
pub(super) fn watch(search: &CaseSearch<'_>, fitted: &CompleteModel) -> Vec<Departure> {
    let case = search.case;
    let of = |runs: &[Compared]| -> Vec<Missed> {
        parallel::map(0..runs.len(), |k| missed(search, fitted, &runs[k])).into_iter().flatten().collect()
    };
    let healthy = of(&case.train);
    let suspect = of(&case.holdout);
    let mut all: Vec<Departure> = Vec::new();
    for run in &suspect {
        let mut own: Vec<(f64, Departure)> = Vec::new();
        for c in &run.channels {
            let like = |m: &'_ Missed| -> f64 {
                let same = m.channels.iter().filter(|o| o.output == c.output);
                same.flat_map(|o| rms(&o.missed, m.window)).fold(0.0, f64::max)
            };
            let most = BEYOND * healthy.iter().map(like).fold(0.0, f64::max);
            if most <= 0.0 {
                continue;
            }
            let stretches = beyond(&c.missed, run.window, most);
            let (component, joint) = place(search, c, &stretches);
            for (begin, end) in stretches {
                let inside = &c.missed[begin..end];
                let length = inside.len() as f64;
                let height = (inside.iter().map(|m| m * m).sum::<f64>() / length).sqrt() / most;
                let like = c.driven.and_then(|(input, per)| {
                    let PlantQuantity { name, unit, .. } = search.case.inputs.get(input)?;
                    let value = -inside.iter().sum::<f64>() / length / per;
                    Some(SimilarCause { input: name.clone(), value, unit: (*unit).to_owned() })
                });
                let departure = Departure {
                    recording: run.recording.clone(),
                    component: component.clone(),
                    joint,
                    start: run.t[begin],
                    end: run.t[end - 1],
                    like,
                };
                own.push((height, departure));
            }
        }
        // What shows in several channels at once is reported where it is highest.
        own.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut kept: Vec<Departure> = Vec::new();
        for (_, d) in own {
            if !kept.iter().any(|k| k.start <= d.end && d.start <= k.end) {
                kept.push(d);
            }
        }
        kept.sort_by(|a, b| a.start.total_cmp(&b.start));
        all.extend(kept);
    }
    all
}

fn missed(search: &CaseSearch<'_>, fitted: &CompleteModel, run: &Compared) -> Option<Missed> {
    let prescribed: &GriddedRecording = search.prescribed.iter().find(|l| l.name == run.run.name)?;
    let alone = search.alone(fitted, run);
    let coordinates = search.case.subject.coordinates(alone.model, &alone.nominal);
    let links = prescribed.links(alone.model, &coordinates);
    let lead = |c: usize| (0..coordinates.len()).find(|i| links.lead_of(*i) == Some(c));
    let leads: Vec<Option<usize>> = (0..prescribed.channels.len()).map(lead).collect();
    let problem = BalanceProblem {
        prescribed: vec![(prescribed, links)],
        unknowns: alone.unknowns.clone(),
        ..BalanceProblem::free(alone.model, alone.nominal.clone(), alone.runs)
    };
    let series = problem.missing(0, &problem.start()).ok()?;
    let counts = prescribed.counts.clone();
    let channels = series.into_iter().zip(&prescribed.channels).zip(leads).zip(&run.run.channels);
    let channels = channels.map(|(((missed, s), leads), c)| ChannelWatch {
        output: s.output,
        leads,
        name: c.name.clone(),
        missed: missed[counts.clone()].to_vec(),
        rate: s.dy[counts.clone()].to_vec(),
        driven: leads.and_then(|i| {
            let shown = [&coordinates[i].positions, &coordinates[i].velocities].into_iter().flatten();
            let factor = shown.into_iter().find(|s| s.0 == c.output)?.1;
            coordinates[i].driven.first().map(|(input, per)| (*input, per * factor))
        }),
    });
    Some(Missed {
        recording: run.run.name.clone(),
        t: prescribed.t[counts.clone()].to_vec(),
        channels: channels.collect(),
        window: ((WINDOW * prescribed.kernel).ceil() as usize).max(2),
    })
}

/// Root mean squares over a window about each instant.
fn rms(values: &[f64], window: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    values.iter().for_each(|v| sums.push(sums[sums.len() - 1] + v * v));
    let half = window / 2;
    let of = |k: usize| {
        let (a, b) = (k.saturating_sub(half), (k + window - half).min(values.len()));
        ((sums[b] - sums[a]).max(0.0) / (b - a).max(1) as f64).sqrt()
    };
    (0..values.len()).map(of).collect()
}

/// Stretches over which a window's root mean square exceeds `most`, each from where half of its height is first reached to
/// where it is last, and split where the sign of what is missed changes for good.
fn beyond(missed: &[f64], window: usize, most: f64) -> Vec<(usize, usize)> {
    let size = rms(missed, window);
    let mut all = Vec::new();
    let mut k = 0;
    while k < size.len() {
        if size[k] <= most {
            k += 1;
            continue;
        }
        let end = (k..size.len()).find(|i| size[*i] <= most).unwrap_or(size.len());
        let (from, to) = (k.saturating_sub(window), (end + window).min(missed.len()));
        let mut inside: Vec<f64> = missed[k..end].iter().map(|v| v.abs()).collect();
        inside.sort_by(f64::total_cmp);
        let half = 0.5 * inside[inside.len() / 2];
        let first = (from..to).find(|i| missed[*i].abs() >= half);
        let last = (from..to).rev().find(|i| missed[*i].abs() >= half);
        if let (Some(a), Some(b)) = (first, last) {
            all.push((a, b + 1));
        }
        k = end;
    }
    all
}

/// Where the departures of a channel act: a force both with and against the motion over all of them is no friction.
fn place(search: &CaseSearch<'_>, c: &ChannelWatch, stretches: &[(usize, usize)]) -> (String, Option<usize>) {
    let Some(i) = c.leads else { return (format!("sensor:{}", c.name), None) };
    let subject = &search.case.subject;
    let driven = search.case.coordinates.get(i).is_some_and(|k| !k.driven.is_empty());
    let motor = || {
        let inside = |of: &[f64]| -> Vec<f64> {
            stretches.iter().flat_map(|(a, b)| of[*a..*b].iter().copied()).collect()
        };
        let torque: Vec<f64> = inside(&c.missed).iter().map(|m| -m).collect();
        at_motor(&torque, &inside(&c.rate)).to_owned()
    };
    match subject.plant {
        // The load's only input is a torque from outside.
        PlantKind::Joint if i == 0 => (motor(), None),
        PlantKind::Joint => ("load".into(), None),
        PlantKind::Arm if i < 3 => ("base".into(), None),
        PlantKind::Arm | PlantKind::Space => {
            let element = c.name.split(['[', ']']).nth(1).and_then(|j| j.parse().ok());
            (if driven { motor() } else { "load".to_owned() }, element)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_departure_lasts_from_half_its_height_to_half_its_height() {
        // A push with edges of four instants from 100 to 150, in what is missed otherwise.
        let height = |k: usize| {
            ((k as f64 - 98.0) / 4.0).clamp(0.0, 1.0).min(((152.0 - k as f64) / 4.0).clamp(0.0, 1.0))
        };
        let missed: Vec<f64> = (0..300).map(|k| -5.0 * height(k) + 0.3 * (k as f64).sin()).collect();
        let found = beyond(&missed, 8, 1.0);
        assert_eq!(found.len(), 1);
        let (a, b) = found[0];
        assert!(a.abs_diff(100) <= 1 && b.abs_diff(151) <= 1, "{a} {b}");
        assert!(beyond(&missed, 8, 6.0).is_empty());
        // One that lasts to the end has no other end.
        assert_eq!(beyond(&missed[..130], 8, 1.0)[0].1, 130);
    }
}
