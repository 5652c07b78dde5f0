//! Series of a chart on one common x, thinned so that every peak of every series stays.

use crate::chart::Series;

/// Common x and per series its values, `NaN` where it has no sample.
pub(crate) struct Joined {
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<Vec<f64>>,
}

/// At most about `points` values of x.
pub(crate) fn join(series: &[Series<'_>], points: usize) -> Joined {
    let Some(first) = series.first() else { return Joined { x: Vec::new(), y: Vec::new() } };
    let common = series.iter().all(|s| std::ptr::eq(s.x, first.x) || s.x == first.x);
    let all = if common {
        Joined { x: first.x.to_vec(), y: series.iter().map(|s| s.y.to_vec()).collect() }
    } else {
        merge(series)
    };
    if all.x.len() <= points { all } else { thin(&all, points) }
}

/// All samples by x. An x that a series has twice (before and after an event) stays twice.
fn merge(series: &[Series<'_>]) -> Joined {
    let mut heads = vec![0; series.len()];
    let mut joined = Joined { x: Vec::new(), y: vec![Vec::new(); series.len()] };
    loop {
        let at = |(s, i): (&Series<'_>, &usize)| s.x.get(*i).copied();
        let next = series.iter().zip(&heads).filter_map(at).min_by(f64::total_cmp);
        let Some(x) = next else { return joined };
        joined.x.push(x);
        for ((s, head), y) in series.iter().zip(&mut heads).zip(&mut joined.y) {
            let due = s.x.get(*head).is_some_and(|own| own.total_cmp(&x).is_eq());
            y.push(if due { s.y[*head] } else { f64::NAN });
            *head += usize::from(due);
        }
    }
}

/// Of each stretch the samples at which a series is lowest or highest, and of all the first and the last.
fn thin(all: &Joined, points: usize) -> Joined {
    let n = all.x.len();
    let stretches = (points / (2 * all.y.len()).max(1)).max(1);
    let mut keep = vec![0, n - 1];
    for k in 0..stretches {
        let stretch = k * n / stretches..(k + 1) * n / stretches;
        for y in &all.y {
            let finite = stretch.clone().filter(|i| y[*i].is_finite());
            let by = |a: &usize, b: &usize| y[*a].total_cmp(&y[*b]);
            keep.extend(finite.clone().min_by(by));
            keep.extend(finite.max_by(by));
        }
    }
    keep.sort_unstable();
    keep.dedup();
    let pick = |values: &[f64]| keep.iter().map(|i| values[*i]).collect();
    Joined { x: pick(&all.x), y: all.y.iter().map(|y| pick(y)).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Colour, Style};

    fn series<'a>(x: &'a [f64], y: &'a [f64]) -> Series<'a> {
        Series { name: "s", x, y, style: Style::Line, colour: Colour::Palette(0) }
    }

    #[test]
    fn peaks_of_every_series_survive_thinning() {
        let n = 1_000_000;
        let x: Vec<f64> = (0..n).map(f64::from).collect();
        let spike = |at: usize, height: f64| {
            let mut y = vec![0.0; n as usize];
            y[at] = height;
            y
        };
        let (a, b) = (spike(123_456, 7.0), spike(765_432, -3.0));
        let joined = join(&[series(&x, &a), series(&x, &b)], 2000);
        assert!(joined.x.len() <= 2002, "{}", joined.x.len());
        assert!(joined.x.is_sorted() && joined.x[0] == 0.0 && joined.x.last() == Some(&999_999.0));
        let at = |x: f64| joined.x.iter().position(|v| *v == x).unwrap();
        assert_eq!(joined.y[0][at(123_456.0)], 7.0);
        assert_eq!(joined.y[1][at(765_432.0)], -3.0);
    }

    #[test]
    fn different_samples_are_joined_and_events_stay_twice() {
        let (x, y) = ([0.0, 1.0, 1.0, 2.0], [1.0, 2.0, 3.0, 4.0]);
        let (u, v) = ([0.5, 1.0], [5.0, 6.0]);
        let joined = join(&[series(&x, &y), series(&u, &v)], 100);
        assert_eq!(joined.x, [0.0, 0.5, 1.0, 1.0, 2.0]);
        let defined = |k: usize| joined.y[k].iter().map(|v| v.is_finite().then_some(*v)).collect::<Vec<_>>();
        assert_eq!(defined(0), [Some(1.0), None, Some(2.0), Some(3.0), Some(4.0)]);
        assert_eq!(defined(1), [None, Some(5.0), Some(6.0), None, None]);
    }
}
