//! What is missing, as a picture rather than a formula: torque against speed or angle, against twist and its rate.

/// Means of a quantity along another, in bins of equally many samples.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Mean abscissa of each bin.
    pub x: Vec<f64>,
    /// Mean ordinate.
    pub mean: Vec<f64>,
    /// Lower end of the 95 % interval of the mean.
    pub low: Vec<f64>,
    /// Upper end.
    pub high: Vec<f64>,
}

/// Means of a quantity over two others, on a grid of equal cells (a restoring-force surface: torque over twist and rate).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForceSurface {
    /// Edges of the cells along x.
    pub x: Vec<f64>,
    /// Edges along y.
    pub y: Vec<f64>,
    /// Means, row by row of y; `None` where fewer than 5 samples fell.
    pub z: Vec<Vec<Option<f64>>>,
}

/// Means of `y` in `bins` of equally many samples along `x`. Consecutive samples in a bin are one visit, and visits are
/// what the interval is made of, because the samples of one are not independent; of fewer than 3 visits it is as wide as
/// the samples scatter. Samples that are not finite are left out. `None` for fewer than 5 samples per bin.
pub fn curve(x: &[f64], y: &[f64], bins: usize) -> Option<Curve> {
    let mut order: Vec<usize> =
        (0..x.len().min(y.len())).filter(|i| x[*i].is_finite() && y[*i].is_finite()).collect();
    let n = order.len();
    if bins == 0 || n < 5 * bins {
        return None;
    }
    trueup_numerics::order::ascending(&mut order, |item| x[*item]);
    let mut out = Curve::default();
    for k in 0..bins {
        let mut members = order[k * n / bins..(k + 1) * n / bins].to_vec();
        members.sort_unstable();
        let mean = |of: &[f64]| members.iter().map(|i| of[*i]).sum::<f64>() / members.len() as f64;
        let centre = mean(y);
        // Deviations summed visit by visit: the variance of a ratio estimate.
        let mut visits: Vec<f64> = Vec::new();
        for (at, i) in members.iter().enumerate() {
            let goes_on = at > 0 && members[at - 1] + 1 == *i;
            match visits.last_mut() {
                Some(sum) if goes_on => *sum += y[*i] - centre,
                _ => visits.push(y[*i] - centre),
            }
        }
        let count = visits.len() as f64;
        let half = if visits.len() >= 3 {
            let variance = visits.iter().map(|s| s * s).sum::<f64>() * count / (count - 1.0);
            student(visits.len() - 1) * variance.sqrt() / members.len() as f64
        } else {
            1.96 * (members.iter().map(|i| (y[*i] - centre).powi(2)).sum::<f64>() / members.len() as f64)
                .sqrt()
        };
        out.x.push(mean(x));
        out.mean.push(centre);
        out.low.push(centre - half);
        out.high.push(centre + half);
    }
    Some(out)
}

/// 97.5 % quantile of Student's t.
fn student(freedom: usize) -> f64 {
    use statrs::distribution::{ContinuousCDF, StudentsT};
    StudentsT::new(0.0, 1.0, freedom as f64).map_or(1.96, |t| t.inverse_cdf(0.975))
}

/// Means of `z` over cells of `x` and `y`, `cells` along each, over where 99 % of the samples are. `None` without
/// variation of both, or fewer than 50 samples.
pub fn surface(x: &[f64], y: &[f64], z: &[f64], cells: usize) -> Option<ForceSurface> {
    let n = x.len().min(y.len()).min(z.len());
    let edges = |v: &[f64]| -> Option<Vec<f64>> {
        let mut sorted: Vec<f64> = v[..n].iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        let (low, high) = (sorted[last / 200], sorted[last - last / 200]);
        let step = (high - low) / cells.max(1) as f64;
        (high > low).then(|| (0..=cells).map(|k| low + step * k as f64).collect())
    };
    if n < 50 || cells == 0 {
        return None;
    }
    let (ex, ey) = (edges(x)?, edges(y)?);
    let mut sums = vec![vec![(0.0, 0_usize); cells]; cells];
    let cell = |edges: &[f64], v: f64| {
        let k = ((v - edges[0]) / (edges[cells] - edges[0]) * cells as f64).floor();
        (k >= 0.0 && k < cells as f64).then_some(k as usize)
    };
    for i in (0..n).filter(|i| z[*i].is_finite()) {
        if let (Some(a), Some(b)) = (cell(&ex, x[i]), cell(&ey, y[i])) {
            sums[b][a].0 += z[i];
            sums[b][a].1 += 1;
        }
    }
    let mean = |(sum, count): &(f64, usize)| (*count >= 5).then(|| sum / *count as f64);
    Some(ForceSurface { x: ex, y: ey, z: sums.iter().map(|row| row.iter().map(mean).collect()).collect() })
}

/// Work that `torque` takes along `angle` per full swing there and back, J: the area of the loop. What only depends on the
/// angle has none. `None` without at least two reversals.
pub fn loop_area(angle: &[f64], torque: &[f64]) -> Option<f64> {
    let n = angle.len().min(torque.len());
    let range =
        angle[..n].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
    // Turning points: where it has come back by a twentieth of its range, so that noise does not count.
    let least = 0.05 * (range.1 - range.0);
    let (mut extreme, mut way) = (0, 0.0);
    let mut turns = Vec::new();
    for i in 1..n {
        let d = angle[i] - angle[extreme];
        if way == 0.0 {
            if d.abs() > least {
                (way, extreme) = (d.signum(), i);
            }
        } else if d * way > 0.0 {
            extreme = i;
        } else if d.abs() > least {
            turns.push(extreme);
            (way, extreme) = (-way, i);
        }
    }
    let swings = turns.len().saturating_sub(1) / 2;
    let (from, to) = (*turns.first()?, *turns.get(2 * swings)?);
    let work: f64 = (from..to).map(|i| 0.5 * (torque[i] + torque[i + 1]) * (angle[i + 1] - angle[i])).sum();
    (swings > 0).then(|| work / swings as f64)
}
