//! Inputs in another unit or with the opposite sign: a free gain of each of them, before any cause is looked for.

use crate::engine::balance::Led;
use crate::engine::problem::Comparison;
use crate::engine::search::Search;
use crate::outcome::{Noticed, Severity};

/// What a gain comes from that is near it. Fewer than between channels (`trueup_signals::check`), whose slopes are sharp: a gain of
/// 6 or 10 may be a wrong parameter, so neither revolutions nor rpm are among them.
const CAUSES: [(f64, &str); 5] = [
    (1e-3, "thousandths were taken for units"),
    (1e3, "units were taken for thousandths"),
    (std::f64::consts::PI / 180.0, "degrees were taken for radians"),
    (180.0 / std::f64::consts::PI, "radians were taken for degrees"),
    (-1.0, "it had the opposite sign"),
];
/// As near to it (logarithm of a factor of 3): what is missing besides moves the gain. Causes are a factor of 17 apart.
const NEAR: f64 = 1.1;
/// The balances then miss less than this of what they missed, as a power, octave by octave alike.
const LEFT: f64 = 0.1;

/// Says so where one gain of an input, or of all of them alike, takes nearly all of what the nominal model misses, and is that of a
/// unit or a sign. The gain is the one of least squares: what the balances miss is linear in it, but for dry friction.
pub fn mistaken(search: &Search<'_>) -> Option<Noticed> {
    let stated = search.state(&[]).ok()?;
    let (whole, start) = (search.compare(&stated), search.compare(&stated).start());
    let names = search.case.subject.inputs();
    let runs = &search.led[..search.case.train.len()];
    let recorded = |input: &usize| runs.iter().all(|l| l.inputs.get(*input).is_some_and(|u| !u.is_empty()));
    let recorded: Vec<usize> = (0..names.len()).filter(recorded).collect();
    let missed = |without: &[usize]| -> Option<Vec<f64>> {
        let silenced: Vec<Led> = runs.iter().map(|led| silenced(led, without)).collect();
        let led = silenced.iter().zip(&whole.led).map(|(led, (_, links))| (led, links.clone())).collect();
        let mut all = Comparison { led, ..whole.clone() }.residuals(&start).ok()?;
        all.truncate(whole.readings());
        // Octaves count alike, as they do for an excess: what is fast would drown what is slow.
        let octaves = search.octaves(&all);
        let parts = runs.iter().flat_map(|led| led.parts.iter().map(|p| (p.octave, led.channels.len())));
        let weights = parts.flat_map(|(octave, m)| std::iter::repeat_n(octaves[octave].count.sqrt(), m));
        all.iter_mut().zip(weights).for_each(|(r, w)| *r /= w);
        Some(all)
    };
    let with = missed(&[])?;
    let each = recorded.iter().map(|input| vec![*input]);
    let all = (recorded.len() > 1).then(|| recorded.clone());
    for inputs in all.into_iter().chain(each) {
        let (gain, left) = gain(&missed(&inputs)?, &with);
        let cause = CAUSES.iter().find(|(c, _)| (gain / c).ln().abs() < NEAR);
        if let Some((_, cause)) = cause.filter(|_| left < LEFT) {
            let called = inputs.iter().map(|i| names[*i].as_str()).collect::<Vec<_>>().join(", ");
            return Some(Noticed {
                severity: Severity::Grave,
                kind: "input-scale".into(),
                file: "case.toml".into(),
                line: None,
                channel: (inputs.len() == 1).then(|| called.clone()),
                text: format!(
                    "{called}: it looks as if {cause}: times {gain:.3e} the model misses {:.1} % of what it misses (as powers); \
                     give the unit or the scale of the column in the sidecar",
                    100.0 * left
                ),
            });
        }
    }
    None
}

/// A recording in which these inputs are 0.
fn silenced(led: &Led, without: &[usize]) -> Led {
    let mut led = led.clone();
    without.iter().for_each(|input| led.inputs[*input].fill(0.0));
    led
}

/// The gain g at which `without` + g (`with` - `without`) is least, and its square over that of `with`.
fn gain(without: &[f64], with: &[f64]) -> (f64, f64) {
    let (mut along, mut square, mut before) = (0.0, 0.0, 0.0);
    for (a, b) in without.iter().zip(with) {
        along -= a * (b - a);
        square += (b - a) * (b - a);
        before += b * b;
    }
    let gain = along / square;
    let left: f64 = without.iter().zip(with).map(|(a, b)| (a + gain * (b - a)).powi(2)).sum();
    (gain, left / before)
}
