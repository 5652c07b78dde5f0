//! The menu: courses of inputs that engineers play.

use core::f64::consts::PI;

/// One experiment's inputs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct InputCourse {
    /// In words.
    pub(super) what: String,
    /// Inputs by index with their values, sample by sample.
    pub(super) inputs: Vec<(usize, Vec<f64>)>,
}

/// A shape between -1 and 1 over the part of its time that has passed, the length in s and the step in s.
type InputShape = fn(part: f64, length: f64, step: f64) -> f64;

const SHAPES: [(&str, InputShape); 4] = [
    ("A sum of sines of rising amplitude", multisine),
    ("Slow triangles of rising amplitude with reversals", triangles),
    ("Steps with rests between them", steps),
    ("A chirp", chirp),
];
/// Parts of the largest value that was recorded.
const SIZES: [f64; 3] = [1.0, 0.6, 0.3];

/// Everything on the menu for these inputs (index, largest value): all at once, of several those favoured alone, and none.
pub(super) fn courses(
    driven: &[(usize, f64)],
    step: f64,
    length: f64,
    favoured: &[usize],
) -> Vec<InputCourse> {
    let count = (length / step).floor() as usize + 1;
    let mut all = Vec::new();
    let mut groups: Vec<Vec<(usize, f64)>> = vec![driven.to_vec()];
    if driven.len() > 1 {
        groups.extend(favoured.iter().filter_map(|f| Some(vec![*driven.iter().find(|d| d.0 == *f)?])));
    }
    for group in &groups {
        for (what, shape) in SHAPES {
            for size in SIZES {
                let course = |k: usize, most: f64| -> Vec<f64> {
                    // Of several each a little later, so that they do not go hand in hand.
                    let late = 0.13 * k as f64;
                    let value = |i: usize| {
                        let part = i as f64 / count as f64;
                        if part < late { 0.0 } else { shape((part - late) / (1.0 - late), length, step) }
                    };
                    (0..count).map(|i| size * most * value(i)).collect()
                };
                let mut inputs: Vec<(usize, Vec<f64>)> =
                    group.iter().enumerate().map(|(k, (input, most))| (*input, course(k, *most))).collect();
                let still = driven.iter().filter(|d| !group.contains(d));
                inputs.extend(still.map(|d| (d.0, vec![0.0; count])));
                all.push(InputCourse { what: format!("{what}, up to {:.0} %", 100.0 * size), inputs });
            }
        }
    }
    // What comes from outside shows best on a plant that floats while nothing is commanded.
    if driven.len() > 1 {
        let inputs = driven.iter().map(|d| (d.0, vec![0.0; count])).collect();
        all.push(InputCourse { what: "Nothing, 0 %".into(), inputs });
    }
    all
}

/// Eight sines from two periods in all the time to a fiftieth of the sampling rate, phases as M. Schroeder has them.
fn multisine(part: f64, length: f64, step: f64) -> f64 {
    const LINES: i32 = 8;
    let (low, high) = (2.0 / length, (0.02 / step).max(4.0 / length));
    let sum: f64 = (0..LINES)
        .map(|k| {
            let k = f64::from(k);
            let f = low * (high / low).powf(k / f64::from(LINES - 1));
            let phase = -PI * k * (k + 1.0) / f64::from(LINES);
            // Less of the fast ones: what they move is little anyway.
            (2.0 * PI * f * part * length + phase).sin()
        })
        .sum();
    (0.3 + 0.7 * part) * (sum / 4.5).clamp(-1.0, 1.0)
}

/// Five periods, each larger than the one before.
fn triangles(part: f64, _: f64, _: f64) -> f64 {
    let period = (5.0 * part).floor();
    let x = 5.0 * part - period;
    let triangle = if x < 0.25 {
        4.0 * x
    } else if x < 0.75 {
        2.0 - 4.0 * x
    } else {
        4.0 * x - 4.0
    };
    (period + 1.0) / 5.0 * triangle
}

/// A push, its contrary, a rest; three sizes, the order turned round in between so that the plant comes back.
fn steps(part: f64, _: f64, _: f64) -> f64 {
    const PUSHES: [f64; 12] = [0.4, -0.4, 0.0, 0.0, -0.7, 0.7, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0];
    PUSHES[((12.0 * part) as usize).min(11)]
}

/// From two periods in all the time to a twentieth of the sampling rate.
fn chirp(part: f64, length: f64, step: f64) -> f64 {
    let (low, high) = (2.0 / length, (0.05 / step).max(4.0 / length));
    let rate = (high / low).ln();
    (2.0 * PI * low * length * ((rate * part).exp() - 1.0) / rate).sin()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_course_leaves_its_limits_and_none_is_like_another() {
        let all = courses(&[(0, 2.0), (3, 0.5)], 0.002, 10.0, &[3]);
        assert_eq!(all.len(), 2 * 12 + 1);
        for c in &all {
            for (input, value) in &c.inputs {
                let most = value.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                let limit = if *input == 0 { 2.0 } else { 0.5 };
                assert_eq!(value.len(), 5001);
                assert!(most <= limit * (1.0 + 1e-12), "{}: {most}", c.what);
            }
        }
        // At full size a course uses most of what it may.
        for c in all.iter().filter(|c| c.what.ends_with("100 %") && c.inputs[0].0 == 0) {
            let most = c.inputs[0].1.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!(most > 1.5, "{}: {most}", c.what);
        }
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a.inputs != b.inputs));
        }
    }
}
