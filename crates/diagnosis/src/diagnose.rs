//! From a case to a diagnosis.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use trueup_models::effect;
use trueup_signals::Loaded;

use crate::engine::decide::{Decision, Free, Thresholds, decide};
use crate::engine::hypothesis::{Claim, Hypothesis};
use crate::engine::recordings::{Prepared, Unfit};
use crate::engine::replay::{Complete, Replayed};
use crate::engine::search::{Fitted, Search};
use crate::engine::select::{Effort, Found};
use crate::floor;
use crate::locate;
use crate::outcome::*;

/// How to diagnose.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// For everything that is drawn.
    pub seed: u64,
    /// How far to search.
    pub effort: Effort,
    /// Where the lines between verdicts are.
    pub limits: Thresholds,
}

impl Default for Options {
    fn default() -> Self {
        Self { seed: 1, effort: Effort::default(), limits: Thresholds::default() }
    }
}

/// A diagnosis that could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// The case is not fit for it.
    #[error(transparent)]
    Unfit(#[from] Unfit),
    /// The nominal model cannot be simulated.
    #[error(
        "the nominal model cannot be compared with the recordings: {0}; look at the parameters of case.toml"
    )]
    Nominal(String),
}

/// Time series of a channel of a recording, for pictures.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Recording.
    pub recording: String,
    /// FMU variable.
    pub channel: String,
    /// s.
    pub time: Vec<f64>,
    /// What was measured.
    pub measured: Vec<f64>,
    /// Nominal parameters.
    pub before: Vec<f64>,
    /// Own parameters refitted.
    pub tuned: Vec<f64>,
    /// With the effects.
    pub after: Vec<f64>,
    /// Standard deviation that noise alone would leave.
    pub floor: f64,
}

/// A diagnosis with what it was made from.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// What `diagnosis.json` holds.
    pub diagnosis: Diagnosis,
    /// Held-out recordings (of cases without: those for fitting).
    pub traces: Vec<Trace>,
    /// Which joints of the nominal model have a spring.
    pub flexible: Vec<bool>,
    /// The augmented model, where an effect is claimed.
    pub augmented: Option<Augmented>,
}

/// The model with what was claimed.
#[derive(Clone, Debug, PartialEq)]
pub struct Augmented {
    /// Effects that it is packed with (ids, places behind a colon).
    pub effects: Vec<String>,
    /// Its parameters by name.
    pub values: Vec<(String, f64)>,
}

/// Diagnoses a case; `tell` hears how far it is (0 to 1) and what is being done.
///
/// # Errors
/// See [`DiagnoseError`].
pub fn diagnose(
    loaded: &Loaded,
    options: &Options,
    tell: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let case = Prepared::new(loaded)?;
    tell(0.01, "what a perfect model would leave");
    let search = Search::new(&case, options.seed).map_err(DiagnoseError::Nominal)?;
    tell(0.02, "comparing the nominal model");
    let raw = raw_excess(&search)?;
    let mut done = 0.05;
    let mut found = search
        .select(options.effort, |what| {
            done = (done + 0.8) * 0.5;
            tell(done, what);
        })
        .map_err(DiagnoseError::Nominal)?;
    tell(0.7, "free-running simulations");
    let before =
        Complete { stated: found.plain.stated.clone(), theta: search.compare(&found.plain.stated).start() };
    let tuned = search.polish(&tuned_start(&search, &found), 8);
    let runs = if case.holdout.is_empty() { &case.train } else { &case.holdout };
    let replay = |c: &Complete| search.replay(c, runs).map_err(|e| DiagnoseError::Nominal(e.to_string()));
    let shown_before = replay(&before)?;
    let shown_tuned = replay(&tuned).unwrap_or_else(|_| shown_before.clone());
    let nominal_floors =
        search.floors(&before, runs, options.seed).map_err(|e| DiagnoseError::Nominal(e.to_string()))?;
    let gap_of = |after: &Replayed| {
        gap_report(&traces(&case, [&shown_before, &shown_tuned, after], &nominal_floors), options.seed)
            .overall
            .map(|g| Free { before: g.before, tuned: g.tuned, after: g.after, floor: g.floor })
    };
    let mut polished: Option<Complete> = None;
    let mut free = gap_of(&shown_tuned).unwrap_or_default();
    // What the balances leave open the free-running simulation has to tell.
    if free.tuned > options.limits.free * free.floor {
        let own = found.best.stated.set.iter().any(Hypothesis::is_effect);
        let mut contenders: Vec<usize> = Vec::new();
        if !own {
            let singles = found.sets.iter().enumerate().filter(|(_, f)| {
                f.stated.set.len() == 1
                    && f.stated.set[0].is_effect()
                    && f.evidence(1.0) > found.plain.evidence(1.0) + 20.0
            });
            contenders = singles.map(|s| s.0).take(3).collect();
        }
        let mut best: Option<(f64, Complete, usize)> = None;
        for i in contenders {
            tell(0.75, &format!("free-running: {:?}", found.sets[i].labels()));
            let complete = search.polish(&found.sets[i], 8);
            let Ok(shown) = replay(&complete) else { continue };
            let Some(g) = gap_of(&shown) else { continue };
            if best.as_ref().is_none_or(|b| g.after < b.0) {
                best = Some((g.after, complete, i));
            }
        }
        if let Some((after, complete, i)) = best {
            let left = |v: f64| (v * v - free.floor * free.floor).max(0.0);
            if left(after) < 0.5 * left(free.tuned) {
                found.best = found.sets[i].clone();
                free.after = after;
                polished = Some(complete);
            }
        }
    }
    let decision = decide(&found, raw, Some(&free), &options.limits);
    let claimed = matches!(decision.verdict, Verdict::Effects | Verdict::Ambiguous);
    tell(0.85, "free-running: what was chosen");
    let tuned = if decision.verdict == Verdict::NoGap { before.clone() } else { tuned };
    let shown_tuned = if decision.verdict == Verdict::NoGap { shown_before.clone() } else { shown_tuned };
    let after = match (claimed, polished) {
        (true, Some(p)) => p,
        (true, None) => search.polish(&found.best, 8),
        _ => tuned.clone(),
    };
    let shown_after = if claimed { replay(&after)? } else { shown_tuned.clone() };
    let floors =
        search.floors(&after, runs, options.seed).map_err(|e| DiagnoseError::Nominal(e.to_string()))?;
    let traces = traces(&case, [&shown_before, &shown_tuned, &shown_after], &floors);
    let gap = gap_report(&traces, options.seed);
    tell(0.95, "where it lies");
    let location = where_it_lies(&search, &found, &decision, &traces, options.seed);
    let diagnosis = Diagnosis {
        schema: SCHEMA.into(),
        model: loaded.case.model.clone(),
        verdict: decision.verdict,
        gap,
        location,
        effects: effects(&search, &found, &decision),
        candidates: candidates(&found, &decision),
        parameters: parameters(&case, &found, &decision),
        indistinguishable: indistinguishable(&found, &decision),
        unknown: Unknown { present: decision.verdict == Verdict::Unknown, probability: decision.unknown },
        next_experiment: None,
        augmented: None,
        notes: if case.holdout.is_empty() {
            vec!["the case has no hold-out: the figures are of the recordings for fitting".into()]
        } else {
            Vec::new()
        },
    };
    let augmented = claimed.then(|| augmented(&search, &after));
    tell(1.0, "done");
    Ok(Diagnosed { diagnosis, traces, flexible: case.subject.flexible.clone(), augmented })
}

fn raw_excess(search: &Search<'_>) -> Result<f64, DiagnoseError> {
    let stated = search.state(&[]).map_err(DiagnoseError::Nominal)?;
    let problem = search.compare(&stated);
    let r = problem.residuals(&problem.start()).map_err(|e| DiagnoseError::Nominal(e.to_string()))?;
    Ok((r.iter().map(|r| r * r).sum::<f64>() - search.expected_of_training()) / r.len() as f64)
}

/// The plain model with all its parameters free, from where the search left it.
fn tuned_start(search: &Search<'_>, found: &Found) -> Fitted {
    let wide: Vec<Hypothesis> =
        search.causes.iter().filter(|h| matches!(h.claim, Claim::Parameter(_))).cloned().collect();
    let options = trueup_identification::lsq::Options {
        max_iterations: 10,
        cost_tolerance: 1e-4,
        radius: 1.0,
        ..Default::default()
    };
    let start_from =
        if found.best.stated.set.iter().any(Hypothesis::is_effect) { &found.plain } else { &found.best };
    let fitted = search.state(&wide).ok().and_then(|stated| {
        let start = search.begin_with(&stated, start_from);
        search.fit(stated, &start, options).ok()
    });
    fitted.unwrap_or_else(|| start_from.clone())
}

fn traces(case: &Prepared, shown: [&Replayed; 3], floors: &[Vec<f64>]) -> Vec<Trace> {
    let runs = if case.holdout.is_empty() { &case.train } else { &case.holdout };
    let mut all = Vec::new();
    for (r, run) in runs.iter().enumerate() {
        for (c, channel) in run.run.channels.iter().enumerate() {
            all.push(Trace {
                recording: run.run.name.clone(),
                channel: channel.name.clone(),
                time: channel.t.clone(),
                measured: channel.y.clone(),
                before: shown[0][r][c].clone(),
                tuned: shown[1][r][c].clone(),
                after: shown[2][r][c].clone(),
                floor: floors[r][c],
            });
        }
    }
    all
}

fn gap_report(traces: &[Trace], seed: u64) -> GapReport {
    let replayed: Vec<floor::Replayed<'_>> = traces
        .iter()
        .map(|t| floor::Replayed {
            recording: &t.recording,
            channel: &t.channel,
            measured: &t.measured,
            before: &t.before,
            tuned: &t.tuned,
            after: &t.after,
            floor: t.floor,
        })
        .collect();
    let found = floor::gaps(&replayed, seed);
    let of = |g: &floor::Gap| Gap {
        before: g.before,
        tuned: g.tuned,
        after: g.after,
        floor: g.floor,
        closed: g.closed,
        ci95: g.ci95,
    };
    GapReport {
        overall: found.overall.as_ref().map(of),
        channels: found.channels.iter().map(|(name, g)| (name.clone(), of(g))).collect(),
        left_out: found.left_out,
    }
}

fn joint_of(h: &Hypothesis, plant: effect::Plant) -> Option<usize> {
    match plant {
        effect::Plant::Joint => Some(1),
        effect::Plant::Arm => h.per_joint.then_some(h.site + 1),
    }
}

fn where_it_lies(
    search: &Search<'_>,
    found: &Found,
    decision: &Decision,
    traces: &[Trace],
    seed: u64,
) -> Where {
    if decision.verdict == Verdict::NoGap {
        return Where::default();
    }
    let plant = search.case.subject.plant;
    // By component: by how much the excess grows without what was claimed there; of what is unknown, as the screen has it.
    let mut components: Vec<ComponentShare> = Vec::new();
    let mut add = |id: &str, joint: Option<usize>, share: f64| match components
        .iter_mut()
        .find(|c| c.id == id && c.joint == joint)
    {
        Some(c) => c.share = c.share.max(share),
        None => components.push(ComponentShare { id: id.to_owned(), share, joint }),
    };
    let total = (found.plain.excess() - found.best.excess().min(0.0)).max(1e-12);
    let singles = found.sets.iter().filter(|f| f.stated.set.len() == 1 && f.stated.set[0].is_effect());
    if found.best.stated.set.iter().any(Hypothesis::is_effect) && decision.verdict != Verdict::Unknown {
        for h in found.best.stated.set.iter().filter(|h| h.is_effect()) {
            let alone = found
                .sets
                .iter()
                .filter(|f| f.stated.set.len() == 1 && f.stated.set[0] == *h)
                .map(|f| (found.plain.excess() - f.excess()) / total)
                .fold(0.0, f64::max);
            let share = if found.best.stated.set.len() == 1 { decision.explained } else { alone };
            let joint = if plant == effect::Plant::Arm { joint_of(h, plant) } else { None };
            add(&h.component, joint, share.clamp(0.0, 1.0));
        }
    } else {
        for f in singles {
            let h = &f.stated.set[0];
            let joint = if plant == effect::Plant::Arm { joint_of(h, plant) } else { None };
            add(&h.component, joint, ((found.plain.excess() - f.excess()) / total).clamp(0.0, 1.0));
        }
    }
    components.sort_by(|a, b| b.share.total_cmp(&a.share));
    let sum: f64 = components.iter().map(|c| c.share).sum();
    if sum > 1.0 {
        components.iter_mut().for_each(|c| c.share /= sum);
    }
    components.retain(|c| c.share >= 0.005);
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
    missing_by_place(search, found, components, channels, seed)
}

/// Times, bands and regimes of what the plain model misses: there a cause shows while it acts.
fn missing_by_place(
    search: &Search<'_>,
    found: &Found,
    components: Vec<ComponentShare>,
    mut channels: Vec<ChannelShare>,
    seed: u64,
) -> Where {
    let case = search.case;
    let problem = search.compare(&found.plain.stated);
    let mut series: Vec<(String, String, Vec<f64>, Vec<f64>)> = Vec::new();
    for (r, run) in case.train.iter().enumerate() {
        let Ok(missing) = problem.missing(r, &found.plain.theta) else { continue };
        let led = &search.led[r];
        for ((channel, missing), floors) in run.run.channels.iter().zip(missing).zip(&led.floors) {
            let floor = floors.iter().map(|f| f * f).sum::<f64>().sqrt();
            let value = missing[led.counts.clone()].iter().map(|v| v / floor).collect();
            let time = led.t[led.counts.clone()].to_vec();
            series.push((run.run.name.clone(), channel.name.clone(), time, value));
        }
    }
    // The channel in which most of it shows.
    let power = |v: &[f64]| v.iter().map(|r| r * r - 1.0).sum::<f64>().max(0.0);
    let mut by_channel: BTreeMap<&str, f64> = BTreeMap::new();
    series.iter().for_each(|(_, c, _, v)| *by_channel.entry(c).or_default() += power(v));
    let Some(main) = by_channel.iter().max_by(|a, b| a.1.total_cmp(b.1)).map(|m| m.0.to_string()) else {
        return Where { components, channels, ..Where::default() };
    };
    let residuals: Vec<locate::Residual<'_>> = series
        .iter()
        .filter(|(_, c, ..)| *c == main)
        .map(|(recording, _, time, value)| locate::Residual { recording, time, value, floor: 1.0 })
        .collect();
    let intervals = locate::intervals(&residuals, 0.02)
        .into_iter()
        .take(12)
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
    let regimes = regimes(case, &main, &residuals, seed);
    channels.sort_by(|a, b| b.share.total_cmp(&a.share));
    Where { components, channels, intervals, regimes, bands }
}

fn regimes(case: &Prepared, main: &str, residuals: &[locate::Residual<'_>], seed: u64) -> Vec<RegimeShare> {
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
            let rate = channel
                .name
                .replace("Angle", "Velocity")
                .replace("Attitude", "Rate")
                .replace("Position", "Velocity");
            if rate != channel.name {
                features.entry(format!("|{rate}|")).or_default().extend(speed.iter().map(|v| v.abs()));
                features.entry(rate).or_default().extend(speed);
            }
            features.entry(channel.name.clone()).or_default().extend(angle);
        }
        let inputs = case.subject.inputs();
        for drive in &run.run.drives {
            let u = at_times(&drive.t, &drive.u, residual.time);
            features.entry(inputs[drive.input].clone()).or_default().extend(u);
        }
    }
    let _ = main;
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
            Some(RegimeShare { variable, low, high, share: r.share.clamp(0.0, 1.0) })
        })
        .collect()
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

/// Standard deviations of the coordinates of a fit, misfit included.
fn deviations(f: &Fitted) -> Vec<f64> {
    let information: DMatrix<f64> = f.jacobian.tr_mul(&f.jacobian);
    let inflation = (1.0 + f.excess()).max(1.0);
    let n = information.nrows();
    let covariance = information.pseudo_inverse(1e-14).unwrap_or_else(|_| DMatrix::zeros(n, n));
    (0..n).map(|k| (covariance[(k, k)].max(0.0) * inflation).sqrt()).collect()
}

fn amount(f: &Fitted, k: usize, sd: &[f64]) -> Amount {
    let u = &f.stated.unknowns[k];
    let value = u.scale.value(f.theta[k]).0;
    let end = |sign: f64| {
        let v = u.scale.value(f.theta[k] + sign * 1.96 * sd[k]).0;
        v.is_finite().then(|| v.clamp(u.lower, u.upper))
    };
    Amount { value, unit: u.unit.clone(), ci95: [end(-1.0), end(1.0)] }
}

fn effects(search: &Search<'_>, found: &Found, decision: &Decision) -> Vec<Claimed> {
    if !matches!(decision.verdict, Verdict::Effects | Verdict::Ambiguous) {
        return Vec::new();
    }
    let plant = search.case.subject.plant;
    let total = (found.plain.excess() - found.best.excess().min(0.0)).max(1e-12);
    let claim = |f: &Fitted, h: &Hypothesis, probability: f64| {
        let sd = deviations(f);
        let at = f.stated.set.iter().position(|o| o == h).unwrap_or(0);
        let begin = f.stated.begin[at];
        let end = f.stated.begin.get(at + 1).copied().unwrap_or(f.stated.unknowns.len());
        let alone = found.sets.iter().find(|s| s.stated.set.len() == 1 && s.stated.set[0] == *h);
        Claimed {
            id: h.id.clone(),
            component: h.component.clone(),
            joint: joint_of(h, plant),
            probability,
            parameters: (begin..end)
                .filter(|&k| f.stated.unknowns[k].lower < f.stated.unknowns[k].upper)
                .map(|k| (f.stated.unknowns[k].name.clone(), amount(f, k, &sd)))
                .collect(),
            closed_alone: alone.map(|s| ((found.plain.excess() - s.excess()) / total).clamp(0.0, 1.0)),
        }
    };
    let mut all: Vec<Claimed> = Vec::new();
    for (i, h) in found.best.stated.set.iter().enumerate().filter(|(_, h)| h.is_effect()) {
        all.push(claim(&found.best, h, decision.probability[i]));
        if decision.verdict == Verdict::Ambiguous {
            for (at, odds) in decision.rivals[i].iter().filter(|r| -r.1 < 3.0).take(2) {
                let f = &found.sets[*at];
                let other = f.stated.set.iter().find(|o| !found.best.stated.set.contains(o));
                let known = |o: &&Hypothesis| all.iter().any(|c| c.id == o.id && c.component == o.component);
                if let Some(other) = other.filter(|o| o.is_effect() && !known(o)) {
                    all.push(claim(f, other, decision.probability[i] * odds.exp()));
                }
            }
        }
    }
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

fn candidates(found: &Found, decision: &Decision) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = Vec::new();
    let mut add = |h: &Hypothesis, probability: f64, evidence: f64| {
        if h.is_effect()
            && !all.iter().any(|c| c.id == h.id && c.component == h.component && c.joint == Some(h.site + 1))
        {
            all.push(Candidate {
                id: h.id.clone(),
                component: h.component.clone(),
                joint: Some(h.site + 1),
                probability,
                evidence,
                holdout_gap: None,
            });
        }
    };
    let base = found.plain.evidence(1.0);
    if decision.verdict != Verdict::NoGap {
        let mut chosen: Vec<(usize, &Hypothesis)> = found.best.stated.set.iter().enumerate().collect();
        chosen.sort_by(|a, b| decision.probability[b.0].total_cmp(&decision.probability[a.0]));
        for (i, h) in &chosen {
            add(h, decision.probability[*i], found.best.evidence(1.0) - base);
        }
        for (i, _) in &chosen {
            for (at, odds) in &decision.rivals[*i] {
                let f = &found.sets[*at];
                let other = f.stated.set.iter().find(|o| !found.best.stated.set.contains(o));
                if let Some(other) = other {
                    add(other, decision.probability[*i] * odds.exp(), f.evidence(1.0) - base);
                }
            }
        }
    }
    for f in found.sets.iter().filter(|f| f.stated.set.len() == 1) {
        add(&f.stated.set[0], 0.0, f.evidence(1.0) - base);
    }
    all
}

fn parameters(case: &Prepared, found: &Found, decision: &Decision) -> BTreeMap<String, Amount> {
    let _ = case;
    if decision.verdict == Verdict::NoGap {
        return BTreeMap::new();
    }
    let sd = deviations(&found.best);
    let own = found.best.stated.begin.first().copied().unwrap_or(found.best.stated.unknowns.len());
    (0..found.best.stated.unknowns.len())
        .filter(|&k| k < own && found.best.stated.unknowns[k].run.is_none())
        .map(|k| (found.best.stated.unknowns[k].name.clone(), amount(&found.best, k, &sd)))
        .collect()
}

fn indistinguishable(found: &Found, decision: &Decision) -> Vec<Vec<String>> {
    if decision.verdict != Verdict::Ambiguous {
        return Vec::new();
    }
    let mut sets = Vec::new();
    for (i, h) in found.best.stated.set.iter().enumerate().filter(|(_, h)| h.is_effect()) {
        let mut set = vec![h.id.clone()];
        for (at, _) in decision.rivals[i].iter().filter(|r| -r.1 < 3.0) {
            let f = &found.sets[*at];
            let other = f.stated.set.iter().find(|o| !found.best.stated.set.contains(o) && o.is_effect());
            set.extend(other.map(|o| o.id.clone()));
        }
        set.dedup();
        if set.len() > 1 {
            sets.push(set);
        }
    }
    sets
}

fn augmented(search: &Search<'_>, after: &Complete) -> Augmented {
    let stated = &after.stated;
    let problem = search.compare(stated);
    let values = problem.parameters(0, &after.theta);
    let named = search.case.subject.parameters(&stated.model);
    let mut all: Vec<(String, f64)> = named
        .iter()
        .zip(values)
        .filter(|(n, _)| !n.name.starts_with("initial"))
        .map(|(n, v)| (n.name.clone(), v))
        .collect();
    // What the search makes by shifting signals the FMU has as effects.
    let mut effects: Vec<String> = stated
        .set
        .iter()
        .filter_map(|h| match h.claim {
            Claim::Effect(c) => Some(c.id()),
            _ => None,
        })
        .collect();
    effects.sort();
    effects.dedup();
    for (u, x) in stated.unknowns.iter().zip(&after.theta) {
        if !all.iter().any(|(n, _)| *n == u.name) && u.run.is_none() {
            all.push((u.name.clone(), u.scale.value(*x).0));
        }
    }
    Augmented { effects, values: all }
}
