//! Differences.

/// dx/dt of second order at uneven times, one-sided at the ends (NumPy's `gradient`). `None` for fewer than 2 samples or
/// other lengths.
pub fn gradient(t: &[f64], x: &[f64]) -> Option<Vec<f64>> {
    let n = t.len();
    if n < 2 || x.len() != n {
        return None;
    }
    let slope = |i: usize| (x[i + 1] - x[i]) / (t[i + 1] - t[i]);
    let inner = (1..n - 1).map(|i| {
        let (before, after) = (t[i] - t[i - 1], t[i + 1] - t[i]);
        (after * slope(i - 1) + before * slope(i)) / (before + after)
    });
    Some(std::iter::once(slope(0)).chain(inner).chain(std::iter::once(slope(n - 2))).collect())
}
