//! Anderson's acceleration of a fixed-point iteration u = Phi(u), for loops over a step that a plain repetition would not
//! bring to rest. With as many stored differences as there are unknowns a linear map is solved exactly.

/// Differences that are kept.
const DEPTH: usize = 8;

#[derive(Default)]
pub(super) struct Anderson {
    n: usize,
    /// The point and its residual Phi(u) - u, as they are put in.
    u: Vec<f64>,
    r: Vec<f64>,
    before: Option<(Vec<f64>, Vec<f64>)>,
    /// Differences of residuals, orthonormal, and of u + r, transformed alike.
    q: Vec<Vec<f64>>,
    w: Vec<Vec<f64>>,
}

impl Anderson {
    /// Forgets everything.
    pub(super) fn begin(&mut self, n: usize) {
        self.n = n;
        self.u.clear();
        self.r.clear();
        self.before = None;
        self.q.clear();
        self.w.clear();
    }

    /// The next component of the point and of its residual.
    pub(super) fn put(&mut self, u: f64, r: f64) {
        self.u.push(u);
        self.r.push(r);
    }

    /// The next point.
    pub(super) fn next(&mut self) -> Vec<f64> {
        let (u, r) = (std::mem::take(&mut self.u), std::mem::take(&mut self.r));
        if let Some((u0, r0)) = &self.before {
            let dr: Vec<f64> = r.iter().zip(r0).map(|(a, b)| a - b).collect();
            let dw: Vec<f64> = (0..self.n).map(|i| u[i] - u0[i] + dr[i]).collect();
            self.add(dr, dw);
        }
        // u + r, less what the differences explain.
        let mut next: Vec<f64> = u.iter().zip(&r).map(|(u, r)| u + r).collect();
        for (q, w) in self.q.iter().zip(&self.w) {
            let part: f64 = q.iter().zip(&r).map(|(q, r)| q * r).sum();
            next.iter_mut().zip(w).for_each(|(x, w)| *x -= part * w);
        }
        self.before = Some((u, r));
        next
    }

    /// Modified Gram-Schmidt; what adds nothing new is left out.
    fn add(&mut self, mut dr: Vec<f64>, mut dw: Vec<f64>) {
        let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if self.q.len() == DEPTH {
            self.q.remove(0);
            self.w.remove(0);
        }
        let before = size(&dr);
        for (q, w) in self.q.iter().zip(&self.w) {
            let part: f64 = q.iter().zip(&dr).map(|(a, b)| a * b).sum();
            dr.iter_mut().zip(q).for_each(|(x, q)| *x -= part * q);
            dw.iter_mut().zip(w).for_each(|(x, w)| *x -= part * w);
        }
        let norm = size(&dr);
        if norm > 1e-10 * before && norm > 0.0 {
            dr.iter_mut().chain(&mut dw).for_each(|x| *x /= norm);
            self.q.push(dr);
            self.w.push(dw);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_expands_is_solved() {
        // u = A u + b with eigenvalues far beyond 1; the solution is (1, 2, 3).
        let a = [[4.0, 1.0, 0.0], [-2.0, -30.0, 5.0], [0.5, 0.0, 100.0]];
        let solution = [1.0, 2.0, 3.0];
        let phi = |u: &[f64]| -> Vec<f64> {
            (0..3)
                .map(|i| (0..3).map(|j| a[i][j] * (u[j] - solution[j])).sum::<f64>() + solution[i])
                .collect()
        };
        let (mut u, mut anderson) = (vec![0.0; 3], Anderson::default());
        anderson.begin(3);
        for _ in 0..6 {
            for (u, phi) in u.iter().zip(phi(&u)) {
                anderson.put(*u, phi - u);
            }
            u = anderson.next();
        }
        assert!(u.iter().zip(solution).all(|(u, s)| (u - s).abs() < 1e-9), "{u:?}");
    }
}
