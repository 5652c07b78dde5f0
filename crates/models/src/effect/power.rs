//! Power laws that are smooth at rest.

use trueup_numerics::Scalar;

/// Below this share of the reference a power law goes over into a straight line.
const SMOOTH: f64 = 0.01;

/// r |r|^(p-1), as r (r^2 + 0.01^2)^((p-1)/2): odd, of the sign of r, linear for p = 1 exactly.
pub(super) fn odd_power<T: Scalar>(r: T, p: T) -> T {
    r * (r * r + SMOOTH * SMOOTH).powf((p - 1.0) * 0.5)
}

#[cfg(test)]
mod tests {
    use super::odd_power;

    #[test]
    fn it_is_the_power_away_from_rest_and_the_line_for_1() {
        for r in [-3.0f64, -0.4, 0.4, 3.0] {
            for p in [0.5f64, 1.7, 2.0, 3.0] {
                let exact = r.signum() * r.abs().powf(p);
                assert!((odd_power(r, p) / exact - 1.0).abs() < 1e-3, "{r}^{p}");
            }
            assert_eq!(odd_power(r, 1.0), r);
        }
        assert_eq!(odd_power(0.0, 0.5), 0.0);
    }
}
