//! What a perfect model would leave of each recording, octave by octave.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use rand::SeedableRng;
use statrs::statistics::{Data, Median, Statistics};
use trueup_identification::parallel;
use trueup_identification::run::IdentificationRun;
use trueup_identification::sensors::SensorSet;
use trueup_models::effect::PlantKind;
use trueup_models::joint;

use super::balance::{FORM_ERROR, GriddedRecording, PART, kernel};
use super::problem::{BalanceProblem, Compared};
use super::recordings::PreparedCase;

/// Recordings on their grids, with floors.
#[derive(Clone, Debug)]
pub struct Floors {
    /// Those for fitting, then those held out.
    pub prescribed: Vec<GriddedRecording>,
    /// Mean square that a perfect model leaves of each, octave by octave.
    pub expected: Vec<Vec<f64>>,
}

/// Sums of products by octave, with their counts.
type Products = Vec<(Vec<f64>, f64)>;

/// Of one recording, octave by octave: what noise leaves, what the terms are, what the nominal model misses.
struct Spectra {
    noise: Products,
    terms: Products,
    real: Products,
}

/// Values of an octave that count in full: of more, each counts less.
const COUNTED: f64 = 400.0;
/// How often noise is drawn.
const DRAWS: usize = 4;
/// Share of the typical torque up to which noise of a sensor may come through a spring: more, and it prescribes nothing.
const THROUGH: f64 = 0.01;
/// Deviations by which a recording's power may fall below its floor's by chance.
const SLACK: f64 = 3.0;
/// By how much noise may exceed what is declared (power).
const MORE_NOISE: f64 = 4.0;

/// Finds them.
///
/// # Errors
/// A recording that is too short.
pub fn floors(case: &PreparedCase, seed: u64) -> Result<Floors, String> {
    let inputs = case.model.sizes().inputs;
    let runs: Vec<&Compared> = case.train.iter().chain(&case.holdout).collect();
    let mut prescribed = Vec::with_capacity(runs.len());
    let kernel = kernel(runs.iter().map(|r| &r.run));
    let grids: Vec<Option<GriddedRecording>> =
        runs.iter().map(|r| GriddedRecording::new(&r.run, inputs, kernel)).collect();
    let part = PART[usize::from(case.subject.plant == PlantKind::Arm)];
    let whole: Vec<&GriddedRecording> = grids.iter().flatten().collect();
    let lead = leading(case, &whole);
    let apart = apart(case, &whole);
    for (run, grid) in runs.iter().zip(grids) {
        let short = || format!("{}: it is too short: 40 readings of a channel are the least", run.run.name);
        let mut own = grid.ok_or_else(short)?;
        own.leading.coordinates.clone_from(&lead);
        own.part = part;
        let secondary = own.links(&case.model, &case.coordinates).secondary().into_iter().map(|[c, _]| c);
        (own.leading.apart, own.leading.secondary) =
            secondary.partition(|c| apart.contains(&own.channels[*c].output));
        let links = own.links(&case.model, &case.coordinates);
        own.mark_reversals(&links);
        prescribed.push(own);
    }
    let made_up = weighed(case, &runs, prescribed, seed);
    let unprescribed =
        |own: &GriddedRecording| own.links(&case.model, &case.coordinates).unprescribed().next().is_some();
    if case.subject.plant == PlantKind::Joint || !made_up.prescribed.iter().any(unprescribed) {
        return Ok(made_up);
    }
    // Accelerations that the model makes up may let what nothing prescribes run away, those that were measured bring in the noise of
    // a camera: whichever leaves less.
    let mut as_measured = made_up.prescribed.clone();
    as_measured.iter_mut().for_each(|own| own.leading.as_measured = true);
    let as_measured = weighed(case, &runs, as_measured, seed);
    Ok(if as_measured.size() < made_up.size() { as_measured } else { made_up })
}

/// Recordings with what a perfect model leaves of them.
fn weighed(
    case: &PreparedCase,
    runs: &[&Compared],
    mut prescribed: Vec<GriddedRecording>,
    seed: u64,
) -> Floors {
    let spectra: Vec<Spectra> =
        parallel::map(prescribed.iter().zip(runs).enumerate(), |(i, (prescribed, run))| {
            Spectra::of(case, prescribed, run, seed.wrapping_add(i as u64))
        });
    let mut counts: Vec<f64> = Vec::new();
    for part in prescribed[..case.train.len()].iter().filter(|l| !l.is_bridged()).flat_map(|l| &l.parts) {
        counts.resize(counts.len().max(part.octave + 1), 0.0);
        counts[part.octave] += 1.0;
    }
    let mut expected = Vec::new();
    for ((prescribed, run), own) in prescribed.iter_mut().zip(runs).zip(&spectra) {
        let like = runs.iter().zip(&spectra).filter(|(other, _)| names(other) == names(run));
        expected.push(weigh(prescribed, own, &like.map(|(_, s)| s).collect::<Vec<_>>(), &counts));
    }
    Floors { prescribed, expected }
}

impl Floors {
    /// Sum of the logarithms of all floors.
    fn size(&self) -> f64 {
        self.prescribed.iter().flat_map(|own| own.floors.iter().flatten()).map(|floor| floor.ln()).sum()
    }
}

impl Spectra {
    fn of(case: &PreparedCase, own: &GriddedRecording, run: &Compared, seed: u64) -> Self {
        let inputs = case.model.sizes().inputs;
        let links = own.links(&case.model, &case.coordinates);
        let sensors = SensorSet::none(inputs, case.model.sizes().outputs);
        let mut p = case.nominal.clone();
        run.known.iter().for_each(|(i, v)| p[*i] = *v);
        let (a, b): (Vec<_>, Vec<_>) =
            own.terms(&links, &case.coordinates).into_iter().map(|[a, b]| (a, b)).unzip();
        let sizes = own.products(&a).into_iter().zip(own.products(&b));
        let terms =
            sizes.map(|((a, n), (b, _))| (a.into_iter().zip(b).map(|(a, b)| f64::max(a, b)).collect(), n));
        let mut all = Self { noise: Vec::new(), terms: terms.collect(), real: Vec::new() };
        if let Ok(series) = own.missing(&case.model, &links, &p, &sensors) {
            all.real = own.products(&series);
        }
        let perfect = perfect(case, run);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..DRAWS {
            let mut made = perfect.clone();
            case.read_noisily(&mut made, &mut rng);
            let Some(mut made) = GriddedRecording::new(&made, inputs, own.kernel) else { continue };
            made.leading.clone_from(&own.leading);
            made.part = own.part;
            made.mark_reversals(&links);
            if let Ok(series) = made.missing(&case.model, &links, &p, &sensors) {
                merge(&mut all.noise, &made.products(&series));
            }
        }
        all
    }

    /// Power that the nominal model misses over that of the noise as made, `more` times as large as declared; from how many
    /// values.
    fn less(&self, octave: usize, at: usize, more: f64) -> Option<(f64, f64)> {
        let (made, real) = (self.noise.get(octave)?, self.real.get(octave)?);
        let power = |v: &(Vec<f64>, f64)| v.0[at] / v.1.max(1.0);
        Some((power(real) / (more * power(made)).max(f64::MIN_POSITIVE), real.1.max(1.0)))
    }
}

/// Sets what a recording's values count by; what a perfect model leaves then, by octave. `like`: those of all
/// recordings with the same channels; `counts`: values of an octave over all recordings.
fn weigh(prescribed: &mut GriddedRecording, own: &Spectra, like: &[&Spectra], counts: &[f64]) -> Vec<f64> {
    let mean = |v: &(Vec<f64>, f64), at: usize| v.0[at] / v.1.max(1.0);
    let m = prescribed.channels.len();
    (prescribed.floors, prescribed.whiten, prescribed.share) = (vec![Vec::new(); m], Vec::new(), Vec::new());
    let bridged = prescribed.is_bridged();
    let mut perfect = Vec::new();
    let mut more = vec![1.0; m];
    for (o, term) in own.terms.iter().enumerate() {
        let form: Vec<f64> = (0..m).map(|c| FORM_ERROR * FORM_ERROR * mean(term, c * m + c)).collect();
        if let (0, Some(noise), Some(real)) = (o, own.noise.first(), own.real.first()) {
            // The highest octave shows hardly anything but noise: how much more there is than declared.
            for c in 0..m {
                let (made, there) = (mean(noise, c * m + c), mean(real, c * m + c));
                more[c] = ((there - form[c]) / made.max(f64::MIN_POSITIVE)).clamp(1.0, MORE_NOISE);
            }
        }
        // No perfect model leaves more than the nominal one does: in most recordings, and in this one as far as its
        // values show.
        let scale: Vec<f64> = (0..m)
            .map(|c| {
                let less = |of: &Spectra| of.less(o, c * m + c, more[c]);
                let most =
                    Data::new(like.iter().filter_map(|of| less(of)).map(|l| l.0).collect::<Vec<f64>>());
                let most = if most.is_empty() { 1.0 } else { most.median() };
                let here = less(own).map_or(1.0, |(ratio, n)| ratio * (1.0 + SLACK * (2.0 / n).sqrt()));
                (more[c] * most.min(here).min(1.0)).sqrt()
            })
            .collect();
        let noise = own.noise.get(o);
        let carried =
            DMatrix::from_fn(m, m, |i, j| noise.map_or(0.0, |n| mean(n, i * m + j)) * scale[i] * scale[j]);
        let mut all = carried.clone();
        for c in 0..m {
            all[(c, c)] += form[c] + 1e-9 * carried[(c, c)] + f64::MIN_POSITIVE;
            prescribed.floors[c].push(all[(c, c)].sqrt());
        }
        let alone = |i: usize, j: usize| if i == j { all[(i, i)].powf(-0.5) } else { 0.0 };
        let w = (all.clone().cholesky().and_then(|c| c.l().try_inverse()))
            .unwrap_or_else(|| DMatrix::from_fn(m, m, alone));
        perfect.push((&w * carried * w.transpose()).trace() / m as f64);
        let share = if bridged { 0.0 } else { counts.get(o).map_or(1.0, |n| (COUNTED / n).min(1.0)) };
        prescribed.whiten.push(w.transpose().iter().map(|w| w * share.sqrt()).collect());
        prescribed.share.push(share);
    }
    perfect
}

/// Which coordinates may be prescribed: those whose sensors let less noise through the springs than [`THROUGH`]. In all
/// recordings the same.
fn leading(case: &PreparedCase, all: &[&GriddedRecording]) -> Vec<bool> {
    let mut lead = vec![true; case.coordinates.len()];
    let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len().max(1) as f64).sqrt();
    let p = &case.nominal;
    if case.subject.plant == PlantKind::Joint && lead.len() == 2 {
        use joint::parameter as q;
        let (mut typical, mut noise) = (0.0f64, 0.0f64);
        for prescribed in all {
            let links = prescribed.links(&case.model, &case.coordinates);
            let [motor, load] = [0, 1].map(|i| links.lead_of(i).map(|c| prescribed.channels[c].smooth_sigma));
            typical = typical.max(p[q::TORQUE_CONSTANT] * prescribed.inputs.first().map_or(0.0, |u| rms(u)));
            if let (Some(_), Some(load)) = (motor, load) {
                noise = noise.max(p[q::STIFFNESS] * p[q::GEAR_RATIO] * load);
            }
        }
        lead[1] = noise < THROUGH * typical;
    }
    lead
}

/// Outputs next to another one from which they differ so much that noise of either hardly comes through a spring between
/// them. Of an arm: its motor would else be integrated with accelerations of a satellite that a camera sees; a joint's load has
/// nothing else to be integrated with.
fn apart(case: &PreparedCase, all: &[&GriddedRecording]) -> Vec<usize> {
    // By output: power of how far the two are apart, and of the noise.
    let mut powers: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
    for prescribed in all.iter().filter(|_| case.subject.plant == PlantKind::Arm) {
        for pair in prescribed.links(&case.model, &case.coordinates).secondary() {
            let [own, other] = pair.map(|c| &prescribed.channels[c]);
            let between: Vec<f64> = own.y.iter().zip(&other.y).map(|(a, b)| a - b).collect();
            let power = powers.entry(own.output).or_default();
            power[0] += (&between).population_variance();
            power[1] += own.smooth_sigma.powi(2) + other.smooth_sigma.powi(2);
        }
    }
    let far = |(_, [between, noise]): &(usize, [f64; 2])| *noise < THROUGH * THROUGH * between;
    powers.into_iter().filter(far).map(|(output, _)| output).collect()
}

/// Channels by name: recordings with the same ones share what their noise is.
fn names(run: &Compared) -> Vec<String> {
    run.run.channels.iter().map(|c| c.name.clone()).collect()
}

/// Adds sums and counts, octave by octave.
fn merge(own: &mut Products, more: &Products) {
    for (o, more) in more.iter().enumerate() {
        if o == own.len() {
            own.push(more.clone());
            continue;
        }
        own[o].0.iter_mut().zip(&more.0).for_each(|(a, b)| *a += b);
        own[o].1 += more.1;
    }
}

/// The recording as the nominal model would have made it, without noise. Where the model cannot be simulated the
/// recording itself stays.
fn perfect(case: &PreparedCase, run: &Compared) -> IdentificationRun {
    let mut made = run.run.clone();
    let one = [run.clone()];
    let free = BalanceProblem::free(&case.model, case.nominal.clone(), &one);
    if let Ok(shown) = free.shown(0, &[]) {
        made.channels.iter_mut().zip(shown).for_each(|(c, y)| c.y = y);
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_identification::run::OutputChannel;

    /// Floors depend on the current driving channels: those of earlier ones leave nothing behind.
    #[test]
    fn what_is_weighed_again_is_weighed_alike() {
        let t: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.01).collect();
        let y: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        let channel = OutputChannel { t, y: y.clone(), sigma: 1e-3, ..OutputChannel::default() };
        let run = IdentificationRun { channels: vec![channel], ..IdentificationRun::default() };
        let mut prescribed = GriddedRecording::new(&run, 0, kernel([&run].into_iter())).unwrap();
        let of = |prescribed: &GriddedRecording, size: f64| {
            prescribed.products(&[y.iter().map(|v| size * v).collect()])
        };
        let made = |prescribed: &GriddedRecording, size: f64| Spectra {
            noise: of(prescribed, size),
            terms: of(prescribed, 1.0),
            real: of(prescribed, 10.0 * size),
        };
        let mut weighed = |size: f64| {
            let own = made(&prescribed, size);
            weigh(&mut prescribed, &own, &[&own], &[]);
            (prescribed.whiten.clone(), prescribed.share.clone(), prescribed.floors.clone())
        };
        let first = weighed(1e-3);
        assert_ne!(weighed(2e-3), first);
        assert_eq!(weighed(1e-3), first);
        assert_eq!(first.0.len(), prescribed.parts.last().unwrap().octave + 1);
    }
}
