//! What a perfect model would leave of each recording, octave by octave.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rand::SeedableRng;
use trueup_identification::run::Run;
use trueup_models::effect::Plant;
use trueup_models::joint;
use trueup_numerics::hybrid::Hybrid;

use super::balance::{FORM, Led, PART, kernel};
use super::problem::{Compared, Comparison};
use super::recordings::Prepared;

/// Recordings on their grids, with floors.
#[derive(Clone, Debug)]
pub struct Floors {
    /// Those for fitting, then those held out.
    pub led: Vec<Led>,
    /// Sum of squares that a perfect model leaves of each.
    pub expected: Vec<f64>,
}

/// Sums of products by octave, with their counts.
type Products = Vec<(Vec<f64>, f64)>;

/// Share of the typical torque up to which noise of a sensor may come through a spring: more, and it does not lead.
const THROUGH: f64 = 0.01;
/// By how much noise may exceed what is declared (power).
const MORE_NOISE: f64 = 4.0;

/// Finds them.
///
/// # Errors
/// A recording that is too short.
pub fn floors(case: &Prepared, seed: u64) -> Result<Floors, String> {
    let inputs = case.model.sizes().inputs;
    let runs: Vec<&Compared> = case.train.iter().chain(&case.holdout).collect();
    let mut led = Vec::with_capacity(runs.len());
    // By list of channels: what noise leaves, what the terms are, what the nominal model misses.
    let mut found: BTreeMap<Vec<String>, [Products; 3]> = BTreeMap::new();
    let kernel = kernel(runs.iter().map(|r| &r.run));
    let grids: Vec<Option<Led>> = runs.iter().map(|r| Led::new(&r.run, inputs, kernel)).collect();
    let part = PART[usize::from(case.subject.plant == Plant::Arm)];
    let lead = leading(case, &grids.iter().flatten().collect::<Vec<_>>());
    for ((index, run), grid) in runs.iter().enumerate().zip(grids) {
        let short = || format!("{}: it is too short: 40 readings of a channel are the least", run.run.name);
        let mut own = grid.ok_or_else(short)?;
        own.leading.clone_from(&lead);
        own.part = part;
        let links = own.links(&case.model, &case.coordinates);
        own.mark_reversals(&links);
        let offsets = vec![0.0; case.model.sizes().outputs];
        let mut p = case.nominal.clone();
        run.known.iter().for_each(|(i, v)| p[*i] = *v);
        let all = found.entry(names(run)).or_default();
        let made = perfect(case, run, seed.wrapping_add(index as u64));
        if let Some(mut perfect) = Led::new(&made, inputs, kernel) {
            perfect.leading.clone_from(&own.leading);
            perfect.part = part;
            perfect.mark_reversals(&links);
            if let Ok(series) = perfect.missing(&case.model, &links, &p, &offsets) {
                merge(&mut all[0], perfect.products(&series));
            }
        }
        let (a, b): (Vec<_>, Vec<_>) =
            own.terms(&links, &case.coordinates).into_iter().map(|[a, b]| (a, b)).unzip();
        let sizes = own.products(&a).into_iter().zip(own.products(&b));
        let larger =
            sizes.map(|((a, n), (b, _))| (a.into_iter().zip(b).map(|(a, b)| f64::max(a, b)).collect(), n));
        merge(&mut all[1], larger.collect());
        if let Ok(series) = own.missing(&case.model, &links, &p, &offsets) {
            merge(&mut all[2], own.products(&series));
        }
        led.push(own);
    }
    let mut expected = Vec::new();
    for (led, run) in led.iter_mut().zip(&runs) {
        let Some([noise, terms, real]) = found.get(&names(run)) else { continue };
        let m = led.channels.len();
        led.floors = vec![Vec::new(); m];
        let mut perfect = Vec::new();
        let mut more = vec![1.0; m];
        for (o, term) in terms.iter().enumerate() {
            let mean = |v: &(Vec<f64>, f64), at: usize| v.0[at] / v.1.max(1.0);
            let form: Vec<f64> = (0..m).map(|c| FORM * FORM * mean(term, c * m + c)).collect();
            let noise = noise.get(o);
            if o == 0 {
                // The highest octave shows hardly anything but noise: how much more there is than declared.
                for c in 0..m {
                    let (Some(noise), Some(real)) = (noise, real.first()) else { continue };
                    let (own, there) = (mean(noise, c * m + c), mean(real, c * m + c));
                    more[c] = ((there - form[c]) / own.max(f64::MIN_POSITIVE)).clamp(1.0, MORE_NOISE);
                }
            }
            // No perfect model leaves more than the nominal one does.
            let scale: Vec<f64> = (0..m)
                .map(|c| {
                    let made = more[c] * noise.map_or(0.0, |n| mean(n, c * m + c));
                    let there = real.get(o).map_or(made, |r| mean(r, c * m + c));
                    (more[c] * (there / made.max(f64::MIN_POSITIVE)).min(1.0)).sqrt()
                })
                .collect();
            let own = DMatrix::from_fn(m, m, |i, j| {
                noise.map_or(0.0, |n| mean(n, i * m + j)) * scale[i] * scale[j]
            });
            let mut all = own.clone();
            for c in 0..m {
                all[(c, c)] += form[c] + 1e-9 * own[(c, c)] + f64::MIN_POSITIVE;
                led.floors[c].push(all[(c, c)].sqrt());
            }
            let alone = |i: usize, j: usize| if i == j { all[(i, i)].powf(-0.5) } else { 0.0 };
            let w = (all.clone().cholesky().and_then(|c| c.l().try_inverse()))
                .unwrap_or_else(|| DMatrix::from_fn(m, m, alone));
            perfect.push((&w * own * w.transpose()).trace());
            led.whiten.push(w.transpose().iter().copied().collect());
        }
        expected.push(led.parts.iter().filter_map(|p| perfect.get(p.octave)).sum());
    }
    Ok(Floors { led, expected })
}

/// Which coordinates may lead: those whose sensors let less noise through the springs than [`THROUGH`]. In all
/// recordings the same.
fn leading(case: &Prepared, all: &[&Led]) -> Vec<bool> {
    let mut lead = vec![true; case.coordinates.len()];
    let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64).sqrt();
    let p = &case.nominal;
    if case.subject.plant == Plant::Joint && lead.len() == 2 {
        use joint::parameter as q;
        let (mut typical, mut noise) = (0.0f64, 0.0f64);
        for led in all {
            let links = led.links(&case.model, &case.coordinates);
            let [motor, load] = [0, 1].map(|i| links.lead_of(i).map(|c| led.channels[c].smooth_sigma));
            typical = typical.max(p[q::TORQUE_CONSTANT] * led.inputs.first().map_or(0.0, |u| rms(u)));
            if let (Some(_), Some(load)) = (motor, load) {
                noise = noise.max(p[q::STIFFNESS] * p[q::GEAR_RATIO] * load);
            }
        }
        lead[1] = noise < THROUGH * typical;
    }
    lead
}

fn names(run: &Compared) -> Vec<String> {
    run.run.channels.iter().map(|c| c.name.clone()).collect()
}
fn merge(own: &mut Products, more: Products) {
    for (o, more) in more.into_iter().enumerate() {
        if o == own.len() {
            own.push(more);
            continue;
        }
        own[o].0.iter_mut().zip(more.0).for_each(|(a, b)| *a += b);
        own[o].1 += more.1;
    }
}

/// The recording as the nominal model would have made it, with noise of sensors and inputs. Where the model cannot be
/// simulated the recording itself stays, with the noise once more.
fn perfect(case: &Prepared, run: &Compared, seed: u64) -> Run {
    let mut made = run.run.clone();
    let one = [run.clone()];
    let free = Comparison::free(&case.model, case.nominal.clone(), &one);
    if let Ok(shown) = free.shown(0, &[]) {
        made.channels.iter_mut().zip(shown).for_each(|(c, y)| c.y = y);
    }
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    case.read_noisily(&mut made, &mut rng);
    made
}
