//! Coupling of higher order through inputs that are lines (docs/master-adaptive.md, sections 1 and 2).

/// Points of time that the polynomials of the inputs go through, which is the order of the coupling.
pub(super) const NODES: usize = 4;

/// Values of all inputs at the last points of time, newest last.
#[derive(Clone, Debug, Default)]
pub(super) struct History {
    times: Vec<f64>,
    values: Vec<Vec<f64>>,
}

impl History {
    /// Adds a point; drops the oldest one beyond [`NODES`].
    pub(super) fn push(&mut self, time: f64, values: &[f64]) {
        let mut row = if self.times.len() == NODES { self.values.remove(0) } else { Vec::new() };
        self.times.drain(..self.times.len().saturating_sub(NODES - 1));
        row.clear();
        row.extend_from_slice(values);
        self.times.push(time);
        self.values.push(row);
    }

    /// Only the newest point is left: earlier points do not predict later ones.
    pub(super) fn restart(&mut self) {
        let keep = self.times.len().saturating_sub(1);
        self.times.drain(..keep);
        self.values.drain(..keep);
    }

    /// The newest value of input `i`.
    pub(super) fn newest(&self, i: usize) -> f64 {
        self.values.last().map_or(0.0, |row| row[i])
    }

    /// Points.
    pub(super) fn len(&self) -> usize {
        self.times.len()
    }

    /// Nodes of the predictor for a step of `h` s, in parts of that step.
    pub(super) fn predictor(&self, h: f64) -> Nodes {
        let last = self.times.last().copied().unwrap_or(0.0);
        let mut nodes = Nodes::default();
        self.times.iter().for_each(|t| nodes.push((t - last) / h));
        nodes
    }

    /// The inputs at the step's end by the polynomial through the nodes of the predictor.
    pub(super) fn extrapolate(&self, nodes: &Nodes, values: &mut [f64]) {
        values.fill(0.0);
        let rows = self.values.iter().skip(self.len() - nodes.len());
        for (row, weight) in rows.zip(nodes.end_weights()) {
            values.iter_mut().zip(row).for_each(|(value, u)| *value += weight * u);
        }
    }

    /// The line for the step, `value + slope s` with `s` in parts of the step, from the newest rows of the history and,
    /// if the nodes have it, the value at the step's end.
    pub(super) fn line(&self, nodes: &Nodes, end: Option<&[f64]>, value: &mut [f64], slope: &mut [f64]) {
        let weights = nodes.line_weights();
        let rows =
            self.values.iter().map(Vec::as_slice).skip(self.len() + usize::from(end.is_some()) - nodes.len());
        value.fill(0.0);
        slope.fill(0.0);
        for (row, [a, b]) in rows.chain(end).zip(weights) {
            for ((value, slope), u) in value.iter_mut().zip(&mut *slope).zip(row) {
                *value += a * u;
                *slope += b * u;
            }
        }
    }
}

/// Nodes of an interpolation in parts of a step: 0 is its beginning, 1 its end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Nodes {
    at: [f64; NODES],
    count: usize,
}

impl Nodes {
    fn push(&mut self, s: f64) {
        if self.count < NODES {
            self.at[self.count] = s;
            self.count += 1;
        }
    }

    pub(super) fn len(&self) -> usize {
        self.count
    }

    fn slice(&self) -> &[f64] {
        &self.at[..self.count]
    }

    /// Those of the corrector: the step's end instead of the oldest one (of a single node: in addition to it).
    pub(super) fn corrector(&self) -> Self {
        let mut nodes = Self::default();
        self.slice().iter().skip(usize::from(self.count > 1)).for_each(|s| nodes.push(*s));
        nodes.push(1.0);
        nodes
    }

    /// For each node the line (value, slope) that has the same moments of order 0 and 1 over the step as its Lagrange
    /// polynomial: of `s^2` this is `s - 1/6`, of `s^3` it is `9/10 s - 1/5`.
    fn line_weights(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        (0..self.count).map(|i| {
            let others = || self.slice().iter().enumerate().filter(move |(j, _)| *j != i).map(|(_, s)| *s);
            let scale: f64 = others().map(|s| self.at[i] - s).product();
            let c = monic(others());
            [(c[0] - c[2] / 6.0 - c[3] / 5.0) / scale, (c[1] + c[2] + 0.9 * c[3]) / scale]
        })
    }

    /// Values of the Lagrange polynomials at the step's end.
    fn end_weights(&self) -> impl Iterator<Item = f64> + '_ {
        let of = |i: usize| {
            let others = self.slice().iter().enumerate().filter(move |(j, _)| *j != i);
            others.map(|(_, s)| (1.0 - s) / (self.at[i] - s)).product()
        };
        (0..self.count).map(of)
    }

    /// Integral over the step of the polynomial that is zero at the nodes.
    fn defect(&self) -> f64 {
        monic(self.slice().iter().copied()).iter().zip(1..).map(|(c, k)| c / f64::from(k)).sum()
    }

    /// The corrector's local error as a part of the difference between it and the predictor (Milne).
    pub(super) fn milne(&self) -> f64 {
        if self.count < 2 {
            return 0.5; // held inputs against a line: the line's own error is of a higher order
        }
        let (predictor, corrector) = (self.defect(), self.corrector().defect());
        (corrector / (predictor - corrector)).abs()
    }

    /// The mean over the step by which the corrector's polynomial misses the inputs, as a part of what the predictor's
    /// misses them by at the step's end; 0 of a single node, which defines no line.
    pub(super) fn missed(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        let end: f64 = self.slice().iter().map(|s| 1.0 - s).product();
        (self.corrector().defect() / end).abs()
    }
}

/// Coefficients of `(s - r0) (s - r1) ...`, ascending.
fn monic(roots: impl Iterator<Item = f64>) -> [f64; NODES + 1] {
    let mut c = [0.0; NODES + 1];
    c[0] = 1.0;
    for r in roots {
        for k in (0..=NODES).rev() {
            c[k] = if k > 0 { c[k - 1] } else { 0.0 } - r * c[k];
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(times: &[f64], u: impl Fn(f64) -> f64) -> History {
        let mut history = History::default();
        times.iter().for_each(|t| history.push(*t, &[u(*t)]));
        history
    }

    /// Moments of order 0 and 1 over [0, h] by Gauss's rule of three points, exact up to degree 5.
    fn moments(h: f64, u: impl Fn(f64) -> f64) -> [f64; 2] {
        let r = 0.6_f64.sqrt();
        let points =
            [(-r, 5.0 / 18.0), (0.0, 8.0 / 18.0), (r, 5.0 / 18.0)].map(|(x, w)| (h * (x + 1.0) / 2.0, w * h));
        [0, 1].map(|k| points.iter().map(|(s, w)| w * u(*s) * s.powi(k)).sum())
    }

    #[test]
    fn lines_have_the_moments_of_the_polynomial() {
        let u = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t - 0.7 * t * t * t;
        let (h, now) = (0.3, 1.1);
        let history = history(&[0.2, 0.5, 0.95, now], u);
        let nodes = history.predictor(h);
        for (nodes, end) in [(nodes, None), (nodes.corrector(), Some([u(now + h)]))] {
            let (mut value, mut slope) = ([0.0], [0.0]);
            history.line(&nodes, end.as_ref().map(|e| &e[..]), &mut value, &mut slope);
            let line = moments(h, |s| value[0] + slope[0] * s / h);
            let exact = moments(h, |s| u(now + s));
            for (line, exact) in line.iter().zip(exact) {
                assert!((line - exact).abs() < 1e-14, "{line} {exact}");
            }
        }
    }

    #[test]
    fn the_error_of_equal_steps_is_that_of_adams_pairs() {
        // Error constants of Adams-Bashforth and Adams-Moulton, orders 2 to 4 (Hairer, Norsett, Wanner, III.1).
        let constants = [(5.0 / 12.0, 1.0 / 12.0), (3.0 / 8.0, 1.0 / 24.0), (251.0 / 720.0, 19.0 / 720.0)];
        for (n, (predictor, corrector)) in (2..).zip(constants) {
            let times: Vec<f64> = (0..n).map(f64::from).collect();
            let nodes = history(&times, |t| t).predictor(1.0);
            let (milne, missed) = (nodes.milne(), nodes.missed());
            assert!((milne - corrector / (predictor + corrector)).abs() < 1e-14, "{n}: {milne}");
            // The predictor misses by n! times the divided difference at the end, of which the constants are a part, too.
            assert!((missed - corrector).abs() < 1e-14, "{n}: {missed}");
        }
    }

    #[test]
    fn polynomials_go_on() {
        let u = |t: f64| 1.0 - 2.0 * t + 3.0 * t * t - 0.7 * t * t * t;
        let history = history(&[0.2, 0.5, 0.95, 1.1], u);
        let mut end = [0.0];
        history.extrapolate(&history.predictor(0.3), &mut end);
        assert!((end[0] - u(1.4)).abs() < 1e-13, "{end:?} {}", u(1.4));
    }

    #[test]
    fn a_history_forgets() {
        let mut h = history(&[0.0, 1.0, 2.0, 3.0, 4.0], |t| t);
        assert_eq!((h.len(), h.predictor(2.0).slice()), (4, &[-1.5, -1.0, -0.5, 0.0][..]));
        assert_eq!(h.predictor(2.0).corrector().slice(), [-1.0, -0.5, 0.0, 1.0]);
        h.restart();
        assert_eq!((h.len(), h.predictor(2.0).corrector().slice()), (1, &[0.0, 1.0][..]));
    }
}
