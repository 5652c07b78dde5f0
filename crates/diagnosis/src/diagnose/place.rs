//! Where the gap sits, from what the search left and the held-out traces.

use crate::engine::unknown::UnknownPrior;
use std::collections::BTreeMap;

use trueup_models::{effect, joint};
use trueup_signals::Loaded;

use super::ChannelTrace;
use crate::engine::decide::Decision;
use crate::engine::hypothesis::{Hypothesis, joint_of};
use crate::engine::recordings::PreparedCase;
use crate::engine::result::SearchResult;
use crate::engine::search::CaseSearch;
use crate::locate;
use crate::outcome::*;
use crate::picture::{Picture, picture};
use trueup_numerics::order::descending;

/// As many stretches of time are reported, those with most first.
const INTERVALS: usize = 60;

/// What the case shows with the plant's own parameters as they were fitted, whatever effect was fitted with them.
pub(super) fn look(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    found: &SearchResult,
    decision: &Decision,
) -> Picture {
    let case = search.case;
    // With a wrong cause they would be biased.
    let fitted = if decision.verdict == Verdict::Unknown { &found.plain } else { &found.best };
    let stated = &fitted.stated;
    let own = stated.begin.first().copied().unwrap_or(stated.unknowns.len());
    let mut p = case.nominal.clone();
    for (i, named) in case.subject.parameters(&case.model).iter().enumerate() {
        let at = stated.unknowns[..own].iter().position(|u| u.name == named.name && u.run.is_none());
        if let Some(k) = at.filter(|_| decision.verdict != Verdict::NoGap) {
            let u = &stated.unknowns[k];
            let mut x = fitted.theta[k];
            // What is missing biases them, too: no further than the prior allows.
            if let (Verdict::Unknown, Some(UnknownPrior { mean, deviation: sd, .. })) =
                (decision.verdict, u.prior)
            {
                x = x.clamp(mean - 2.0 * sd, mean + 2.0 * sd);
            }
            p[i] = u.scale.value(x).0;
        }
    }
    if case.subject.plant == effect::PlantKind::Joint {
        let (coulomb, held) = (joint::parameter::COULOMB_FRICTION, joint::parameter::STATIC_FRICTION);
        p[held] = p[held].max(p[coulomb]);
        if case.nominal[held] <= case.nominal[coulomb] {
            p[held] = p[coulomb];
        }
    }
    picture(loaded, &case.subject, &p)
}

/// By component: as much of the excess as goes with a cause alone, or comes back without it; of what has no known form
/// the equation error there.
fn components(
    plant: effect::PlantKind,
    found: &SearchResult,
    decision: &Decision,
    picture: &Picture,
) -> Vec<ComponentShare> {
    let mut all: Vec<ComponentShare> = Vec::new();
    let mut add = |id: &str, joint: Option<usize>, share: f64| match all
        .iter_mut()
        .find(|c| c.id == id && c.joint == joint)
    {
        Some(c) => c.share = c.share.max(share),
        None => all.push(ComponentShare { id: id.to_owned(), share, joint }),
    };
    let joint = |h: &Hypothesis| if plant == effect::PlantKind::Arm { joint_of(h, plant) } else { None };
    let unknown = decision.verdict == Verdict::Unknown;
    if !unknown && !found.best.stated.set.is_empty() {
        for (h, share) in of_claims(found, decision) {
            add(&h.component, joint(h), share);
        }
    } else if unknown && !picture.places.is_empty() {
        picture.places.iter().for_each(|p| add(&p.component, p.joint, p.share));
    } else {
        let total = explainable(found);
        for f in &found.sets {
            if let [h] = &f.stated.set[..] {
                add(&h.component, joint(h), ((found.plain.excess() - f.excess()) / total).clamp(0.0, 1.0));
            }
        }
    }
    descending(&mut all, |item| item.share);
    let sum: f64 = all.iter().map(|c| c.share).sum();
    if sum > 1.0 {
        all.iter_mut().for_each(|c| c.share /= sum);
    }
    all.retain(|c| c.share >= 0.005);
    all
}

/// What the set that was chosen takes of the excess.
fn explainable(found: &SearchResult) -> f64 {
    (found.plain.excess() - found.best.excess().min(0.0)).max(1e-12)
}

/// The share of the excess that each effect claimed takes alone, or leaves where it alone is missing.
fn of_claims<'a>(found: &'a SearchResult, decision: &Decision) -> Vec<(&'a Hypothesis, f64)> {
    let (set, total) = (&found.best.stated.set, explainable(found));
    if set.len() == 1 {
        return set.iter().map(|h| (h, decision.explained)).collect();
    }
    let share = |h: &Hypothesis| {
        let sets = found.sets.iter().filter_map(|f| match f.stated.set.contains(h) {
            true => (f.stated.set.len() == 1).then(|| found.plain.excess() - f.excess()),
            false => (f.stated.set.len() + 1 == set.len() && f.stated.set.iter().all(|o| set.contains(o)))
                .then(|| f.excess() - found.best.excess()),
        });
        (sets.fold(0.0, f64::max) / total).clamp(0.0, 1.0)
    };
    set.iter().map(|h| (h, share(h))).collect()
}

/// Where the gap sits: components, channels, times, bands, regimes.
pub(super) fn locate_gap(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    found: &SearchResult,
    decision: &Decision,
    picture: &Picture,
    traces: &[ChannelTrace],
    seed: u64,
) -> GapLocation {
    if decision.verdict == Verdict::NoGap {
        return GapLocation::default();
    }
    let plant = search.case.subject.plant;
    let components = components(plant, found, decision, picture);
    // Channels: of the tuned model, held out.
    let mut names: Vec<&str> = Vec::new();
    traces.iter().for_each(|t| {
        if !names.contains(&t.channel.as_str()) {
            names.push(&t.channel);
        }
    });
    let pairs: Vec<(f64, f64)> = names
        .iter()
        .map(|name| {
            let (mut error, mut floor, mut variation) = (0.0, 0.0, 0.0);
            for t in traces.iter().filter(|t| t.channel == *name) {
                let mean = t.measured.iter().sum::<f64>() / t.measured.len().max(1) as f64;
                for (s, m) in t.tuned.iter().zip(&t.measured) {
                    error += (s - m) * (s - m);
                    variation += (m - mean) * (m - mean);
                    floor += t.floor * t.floor;
                }
            }
            let v = f64::max(variation, f64::MIN_POSITIVE);
            (f64::sqrt(error / v), f64::sqrt(floor / v))
        })
        .collect();
    let channels: Vec<ChannelShare> = names
        .iter()
        .zip(locate::shares(&pairs))
        .map(|(name, share)| ChannelShare { name: (*name).to_owned(), share })
        .collect();
    missing_by_place(loaded, search, found, picture, (components, channels), seed)
}

/// Times, bands and regimes of what the plain model misses: there a cause shows while it acts.
fn missing_by_place(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    found: &SearchResult,
    picture: &Picture,
    (components, mut channels): (Vec<ComponentShare>, Vec<ChannelShare>),
    seed: u64,
) -> GapLocation {
    let case = search.case;
    let problem = search.compare(&found.plain.stated);
    let mut series: Vec<(String, String, Vec<f64>, Vec<f64>)> = Vec::new();
    for (r, run) in case.train.iter().enumerate() {
        let Ok(missing) = problem.missing(r, &found.plain.theta) else { continue };
        let prescribed = &search.prescribed[r];
        for ((channel, missing), floors) in run.run.channels.iter().zip(missing).zip(&prescribed.floors) {
            let floor = floors.iter().map(|f| f * f).sum::<f64>().sqrt();
            let value = missing[prescribed.counts.clone()].iter().map(|v| v / floor).collect();
            let time = prescribed.t[prescribed.counts.clone()].to_vec();
            series.push((run.run.name.clone(), channel.name.clone(), time, value));
        }
    }
    // The channel in which most of it shows.
    let power = |v: &[f64]| v.iter().map(|r| r * r - 1.0).sum::<f64>().max(0.0);
    let mut by_channel: BTreeMap<&str, f64> = BTreeMap::new();
    series.iter().for_each(|(_, c, _, v)| *by_channel.entry(c).or_default() += power(v));
    let Some(main) = by_channel.iter().max_by(|a, b| a.1.total_cmp(b.1)).map(|m| m.0.to_string()) else {
        return GapLocation { components, channels, ..GapLocation::default() };
    };
    let residuals: Vec<locate::ResidualSeries<'_>> = series
        .iter()
        .filter(|(_, c, ..)| *c == main)
        .map(|(recording, _, time, value)| locate::ResidualSeries { recording, time, value, floor: 1.0 })
        .collect();
    // An estimate of what is missing has sharper edges than what it leaves in a channel.
    let seen = picture.intervals.clone();
    let intervals = if seen.is_empty() { locate::intervals(&residuals, 0.02) } else { seen };
    let intervals = intervals
        .into_iter()
        .filter(|i| i.end > i.start)
        .take(INTERVALS)
        .map(|i| IntervalShare {
            recording: i.recording,
            start: i.start,
            end: i.end,
            share: i.share.clamp(0.0, 1.0),
        })
        .collect();
    let bands = locate::bands(&residuals, None).map_or_else(Vec::new, |b| {
        b.bands
            .into_iter()
            .take(6)
            .map(|b| BandShare { low_hz: b.low, high_hz: b.high, share: b.share.clamp(0.0, 1.0) })
            .collect()
    });
    let velocities = case.subject.velocities();
    let regimes =
        regimes(case, &residuals, &velocities, &|variable| unit(loaded, &velocities, variable), seed);
    descending(&mut channels, |item| item.share);
    let cause = match picture.cause {
        Some(locate::BoundarySide::Internal) => Some("internal".to_owned()),
        Some(locate::BoundarySide::External) => Some("external".to_owned()),
        _ => None,
    };
    GapLocation { components, channels, intervals, regimes, bands, cause }
}

fn regimes(
    case: &PreparedCase,
    residuals: &[locate::ResidualSeries<'_>],
    velocities: &[(String, String)],
    units: &dyn Fn(&str) -> String,
    seed: u64,
) -> Vec<RegimeShare> {
    let mut features: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut whitened = Vec::new();
    for (run, residual) in case.train.iter().zip(residuals) {
        whitened.extend_from_slice(residual.value);
        for channel in &run.run.channels {
            let angle = at_times(&channel.t, &channel.y, residual.time);
            let ends = residual.time.len();
            let step = residual.time.get(1).map_or(0.01, |t| t - residual.time[0]);
            let reach = ((0.02 / step).ceil() as usize).max(1);
            let speed: Vec<f64> = (0..ends)
                .map(|i| {
                    let (a, b) = (i.saturating_sub(reach), (i + reach).min(ends - 1));
                    (angle[b] - angle[a]) / (residual.time[b] - residual.time[a]).max(1e-12)
                })
                .collect();
            if let Some((_, rate)) = velocities.iter().find(|(position, _)| *position == channel.name) {
                features.entry(format!("|{rate}|")).or_default().extend(speed.iter().map(|v| v.abs()));
                features.entry(rate.clone()).or_default().extend(speed);
            }
            features.entry(channel.name.clone()).or_default().extend(angle);
        }
        let inputs = case.subject.inputs();
        for drive in &run.run.drives {
            let u = at_times(&drive.t, &drive.u, residual.time);
            features.entry(inputs[drive.input].clone()).or_default().extend(u);
        }
    }
    let list: Vec<locate::Feature<'_>> = features
        .iter()
        .filter(|(_, v)| v.len() == whitened.len())
        .map(|(name, value)| locate::Feature { name, value })
        .collect();
    locate::regimes(&list, &whitened, seed)
        .into_iter()
        .take(6)
        .filter_map(|r| {
            let (variable, low, high) = r.main()?;
            let unit = units(&variable);
            Some(RegimeShare { variable, low, high, unit, share: r.share.clamp(0.0, 1.0) })
        })
        .collect()
}

/// The unit of a variable by which regimes are reported, by those of the channels; `velocities` are positions, each with its velocity.
fn unit(loaded: &Loaded, velocities: &[(String, String)], variable: &str) -> String {
    let of = |name: &str| {
        let mut all = loaded.recordings.values().flat_map(|r| &r.channels);
        all.find(|c| c.name == name).map(|c| c.unit.clone())
    };
    let name = variable.trim_matches('|');
    let position = velocities.iter().find(|(_, velocity)| velocity == name);
    let rate = position.and_then(|(position, _)| of(position)).filter(|u| !u.is_empty());
    of(name).or_else(|| rate.map(|u| format!("{u}/s"))).unwrap_or_default()
}

fn at_times(t: &[f64], y: &[f64], times: &[f64]) -> Vec<f64> {
    let mut k = 0;
    times
        .iter()
        .map(|time| {
            while k + 1 < t.len() && t[k + 1] <= *time {
                k += 1;
            }
            y.get(k).copied().unwrap_or(0.0)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::made::{fitted, found};

    #[test]
    fn a_regime_has_the_unit_of_its_channel() {
        use trueup_signals::{Channel, Recording};
        let channel = |name: &str, unit: &str| Channel::new(name, unit, vec![0.0], vec![0.0]);
        let channels = vec![channel("motorAngle[1]", "rad"), channel("motorCurrent", "A")];
        let recordings = [("a.csv".to_owned(), Recording { channels, ..Recording::default() })].into();
        let loaded = Loaded { recordings, ..Loaded::default() };
        let velocities = [("motorAngle[1]".to_owned(), "motorVelocity[1]".to_owned())];
        for (variable, expected) in
            [("|motorVelocity[1]|", "rad/s"), ("motorAngle[1]", "rad"), ("motorCurrent", "A"), ("twist", "")]
        {
            assert_eq!(unit(&loaded, &velocities, variable), expected, "{variable}");
        }
    }

    #[test]
    fn a_claim_has_what_goes_with_it_alone_or_comes_back_without_it() {
        let shares = |sets: &[(&str, f64)], best: usize, explained: f64| -> Vec<f64> {
            let sets = sets.iter().map(|(set, left)| fitted(set, *left, 10.0)).collect();
            let decision = Decision {
                verdict: Verdict::Effects,
                rivals: Vec::new(),
                probability: Vec::new(),
                explained,
                unknown: 0.0,
            };
            of_claims(&found(sets, Some(best), 10.0), &decision)
                .iter()
                .map(|c| (100.0 * c.1).round())
                .collect()
        };
        // The plain model leaves 100 floors, an excess of 99.
        let pair = [("backlash", 50.5), ("backlash cable-stiffness", 1.0)];
        assert_eq!(shares(&pair, 1, 1.0), [50.0, 50.0], "the second is behind the first");
        let pair = [("cable-stiffness", 90.1), ("backlash", 10.9), ("backlash cable-stiffness", 1.0)];
        assert_eq!(shares(&pair, 2, 1.0), [90.0, 10.0]);
        assert_eq!(shares(&[("backlash", 1.0)], 0, 0.8), [80.0]);
    }
}
