//! Sobol's sequence with the direction numbers of S. Joe and F. Y. Kuo, "Constructing Sobol sequences with better
//! two-dimensional projections", SIAM J. Sci. Comput. 30 (2008), their set "new-joe-kuo-6". A point is found from its number
//! alone, so that runs can be shared out.

/// Dimensions.
pub const MOST: usize = NUMBERS.len() + 1;

const BITS: usize = 32;

/// The `at`-th point (from 0) along a dimension, in [0, 1). `shift` flips bits of all points of that dimension alike, which
/// keeps the net.
pub(super) fn part(dimension: usize, at: u32, shift: u32) -> f64 {
    // In Gray's order (Antonov and Saleev), as tables of the sequence have it.
    let gray = at ^ (at >> 1);
    let directions = directions(dimension);
    let set = (0..BITS).filter(|bit| gray >> bit & 1 == 1);
    let x = set.fold(shift, |x, bit| x ^ directions[bit]);
    f64::from(x) / 2f64.powi(BITS as i32)
}

/// The direction numbers, the first one 1/2, as 32-bit fractions.
fn directions(dimension: usize) -> [u32; BITS] {
    let mut v = [0; BITS];
    let Some((polynomial, first)) = dimension.checked_sub(1).map(|at| NUMBERS[at]) else {
        (0..BITS).for_each(|bit| v[bit] = 1 << (BITS - 1 - bit));
        return v;
    };
    let degree = first.len();
    for bit in 0..BITS {
        v[bit] = match first.get(bit) {
            Some(m) => m << (BITS - 1 - bit),
            None => {
                let inner = (1..degree).filter(|k| polynomial >> (degree - 1 - k) & 1 == 1);
                inner.fold(v[bit - degree] ^ (v[bit - degree] >> degree), |x, k| x ^ v[bit - k])
            }
        };
    }
    v
}

/// Of the dimensions after the first: the inner coefficients of the primitive polynomial, and the first numbers m, as many as its
/// degree.
const NUMBERS: [(u32, &[u32]); 31] = [
    (0, &[1]),
    (1, &[1, 3]),
    (1, &[1, 3, 1]),
    (2, &[1, 1, 1]),
    (1, &[1, 1, 3, 3]),
    (4, &[1, 3, 5, 13]),
    (2, &[1, 1, 5, 5, 17]),
    (4, &[1, 1, 5, 5, 5]),
    (7, &[1, 1, 7, 11, 19]),
    (11, &[1, 1, 5, 1, 1]),
    (13, &[1, 1, 1, 3, 11]),
    (14, &[1, 3, 5, 5, 31]),
    (1, &[1, 3, 3, 9, 7, 49]),
    (13, &[1, 1, 1, 15, 21, 21]),
    (16, &[1, 3, 1, 13, 27, 49]),
    (19, &[1, 1, 1, 15, 7, 5]),
    (22, &[1, 3, 1, 15, 13, 25]),
    (25, &[1, 1, 5, 5, 19, 61]),
    (1, &[1, 3, 7, 11, 23, 15, 103]),
    (4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, &[1, 1, 3, 13, 7, 35, 63]),
    (8, &[1, 3, 5, 9, 1, 25, 53]),
    (14, &[1, 3, 1, 13, 9, 35, 107]),
    (19, &[1, 3, 1, 5, 27, 61, 31]),
    (21, &[1, 1, 5, 11, 19, 41, 61]),
    (28, &[1, 3, 5, 3, 3, 13, 69]),
    (31, &[1, 1, 7, 13, 1, 19, 1]),
    (32, &[1, 3, 7, 5, 13, 19, 59]),
    (37, &[1, 1, 3, 9, 25, 29, 41]),
    (41, &[1, 3, 5, 13, 23, 1, 55]),
    (42, &[1, 3, 7, 3, 13, 59, 17]),
];
