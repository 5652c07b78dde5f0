//! Savitzky-Golay: a polynomial through each window.

/// The `derivative`-th derivative (0: smoothing) of evenly sampled values, `step` in s apart: at each sample that of the
/// polynomial of degree `degree` fitted to the window of `window` samples around it; at the ends that of the first and
/// last window (SciPy's `savgol_filter`, mode "interp").
///
/// `None` unless the window is odd, longer than the degree and not longer than the signal, and `step` > 0.
pub fn savitzky_golay(
    x: &[f64],
    window: usize,
    degree: usize,
    derivative: usize,
    step: f64,
) -> Option<Vec<f64>> {
    let n = x.len();
    if window.is_multiple_of(2) || window <= degree || window > n || step.is_nan() || step <= 0.0 {
        return None;
    }
    let half = window / 2;
    let weights = |at: f64| weights(half, degree, derivative, at, step);
    let fit = |w: &[f64], x: &[f64]| w.iter().zip(x).map(|(w, x)| w * x).sum::<f64>();
    let middle = weights(0.0);
    let mut y = Vec::with_capacity(n);
    y.extend((0..half).map(|i| fit(&weights(i as f64 - half as f64), &x[..window])));
    y.extend(x.windows(window).map(|x| fit(&middle, x)));
    y.extend((1..=half).map(|i| fit(&weights(i as f64), &x[n - window..])));
    Some(y)
}

/// What each sample of a window from -half to half adds to the derivative at `at`, by discrete orthogonal polynomials
/// p_0 = 1, p_k+1 = t p_k - b_k p_k-1, which are well conditioned for any window.
fn weights(half: usize, degree: usize, derivative: usize, at: f64, step: f64) -> Vec<f64> {
    // Abscissae from -1 to 1.
    let scale = (half as f64).max(1.0);
    let t: Vec<f64> = (0..=2 * half).map(|i| (i as f64 - half as f64) / scale).collect();
    let at = at / scale;
    let mut weights = vec![0.0; t.len()];
    let (mut before, mut p) = (vec![0.0; t.len()], vec![1.0; t.len()]);
    // Derivatives 0.. of both polynomials at `at`.
    let (mut d_before, mut d) = (vec![0.0; derivative + 1], vec![0.0; derivative + 1]);
    d[0] = 1.0;
    let mut norm_before = 1.0;
    for k in 0..=degree {
        let norm: f64 = p.iter().map(|p| p * p).sum();
        for (w, p) in weights.iter_mut().zip(&p) {
            *w += p * d[derivative] / norm;
        }
        let b = if k == 0 { 0.0 } else { norm / norm_before };
        let next = t.iter().zip(p.iter().zip(&before)).map(|(t, (p, q))| t * p - b * q).collect();
        // (t p)^(m) = t p^(m) + m p^(m-1)
        let d_next = (0..=derivative)
            .map(|m| at * d[m] + if m == 0 { 0.0 } else { m as f64 * d[m - 1] } - b * d_before[m])
            .collect();
        before = std::mem::replace(&mut p, next);
        d_before = std::mem::replace(&mut d, d_next);
        norm_before = norm;
    }
    let unit = (scale * step).powi(i32::try_from(derivative).unwrap_or(i32::MAX));
    weights.iter().map(|w| w / unit).collect()
}
