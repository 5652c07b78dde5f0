//! A sphere against a solid: how deep, and along which normal (CON-15).
//!
//! Everything in the axes of the solid's body, its reference point in the origin.
//! What it gets wrong: one contact per sphere, where the solid is nearest. On the axis of a ring or cylinder, where no direction is nearest,
//! one across it is taken; in the middle of a ball or on the middle line of a bar there is none.

use crate::space::attitude::unit;
use crate::space::vector::{Vector3, add, cross, dot, scale, sub};
use trueup_numerics::Scalar;

/// A solid about the origin; its axis has length 1.
#[derive(Clone, Copy, Debug)]
pub enum Solid<T> {
    /// A ball of this radius, m.
    Ball(T),
    /// All behind a plane through the origin with this outward normal.
    Plate(Vector3<T>),
    /// All within this radius, m, of a segment along the axis of this half length, m: a cylinder with round ends.
    Bar(Vector3<T>, T, T),
    /// A cylinder with flat ends: its axis, radius, half length, m.
    Cylinder(Vector3<T>, T, T),
    /// All within the second radius, m, of a circle of the first one across the axis: a docking ring.
    Ring(Vector3<T>, T, T),
}

/// Where a sphere meets a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidContact<T> {
    /// From the sphere's centre into the solid, length 1.
    pub normal: Vector3<T>,
    /// Above 0 where they overlap, m.
    pub penetration: T,
}

/// A sphere of this centre and radius against a line's nearest point, which has a radius of its own.
fn against<T: Scalar>(nearest: Vector3<T>, center: Vector3<T>, radii: T) -> SolidContact<T> {
    let apart = sub(nearest, center);
    let distance = dot(apart, apart).sqrt();
    SolidContact { normal: apart.map(|a| a / distance), penetration: radii - distance } // (CON-15)
}

/// Along the axis, and the unit vector and the distance across it.
fn split<T: Scalar>(axis: Vector3<T>, point: Vector3<T>) -> (T, Vector3<T>, T) {
    let along = dot(axis, point);
    let across = sub(point, scale(along, axis));
    let distance = dot(across, across).sqrt();
    let out = if distance.value() > 0.0 { across.map(|a| a / distance) } else { any_across(axis) };
    (along, out, distance)
}

/// A unit vector across an axis.
fn any_across<T: Scalar>(axis: Vector3<T>) -> Vector3<T> {
    let least = (1..3).fold(0, |l, k| if axis[k].value().abs() < axis[l].value().abs() { k } else { l });
    let other = core::array::from_fn(|k| if k == least { T::one() } else { T::zero() });
    unit(cross(axis, other))
}

impl<T: Scalar> Solid<T> {
    /// Where a sphere of this centre and radius, m, meets it. Where no direction is nearest the normal is NaN.
    pub fn meet(&self, center: Vector3<T>, radius: T) -> SolidContact<T> {
        match *self {
            Self::Ball(own) => against([T::zero(); 3], center, radius + own),
            Self::Plate(outward) => SolidContact {
                normal: outward.map(|a| -a),
                penetration: radius - dot(outward, center), // (CON-15)
            },
            Self::Bar(axis, own, half) => {
                let along = dot(axis, center).max(-half).min(half);
                against(scale(along, axis), center, radius + own) // (CON-15)
            }
            Self::Ring(axis, circle, own) => {
                let (_, out, _) = split(axis, center);
                against(scale(circle, out), center, radius + own) // (CON-15)
            }
            Self::Cylinder(axis, own, half) => {
                let (along, out, distance) = split(axis, center);
                let side = T::constant(if along.value() < 0.0 { -1.0 } else { 1.0 });
                let (end, wall) = (along * side - half, distance - own);
                if end.value() > 0.0 && wall.value() > 0.0 {
                    let rim = add(scale(own, out), scale(half * side, axis));
                    against(rim, center, radius) // (CON-15)
                } else if end.value() > wall.value() {
                    SolidContact { normal: scale(-side, axis), penetration: radius - end } // (CON-15)
                } else {
                    SolidContact { normal: out.map(|a| -a), penetration: radius - wall } // (CON-15)
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -1 and 1 without a pattern.
    struct Numbers(u64);
    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
        fn vector(&mut self) -> Vector3<f64> {
            [self.next(), self.next(), self.next()]
        }
    }

    fn distance(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
        dot(sub(a, b), sub(a, b)).sqrt()
    }

    fn solids(r: &mut Numbers) -> Vec<Solid<f64>> {
        let axis = unit(r.vector());
        let (a, b) = (0.3 + 0.1 * r.next(), 0.06 + 0.02 * r.next());
        vec![
            Solid::Ball(a),
            Solid::Plate(axis),
            Solid::Bar(axis, b, a),
            Solid::Cylinder(axis, b, a),
            Solid::Ring(axis, a, b),
        ]
    }

    /// Checks CON-15: the depth is the radius less the distance to the nearest of many points of the surface.
    #[test]
    fn the_depth_is_that_of_the_nearest_point() {
        let seed = 20261130;
        println!("seed {seed}");
        let mut r = Numbers(seed);
        for _ in 0..8 {
            let solids = solids(&mut r);
            let center = scale(0.6, r.vector());
            for solid in solids {
                let (axis, points) = match solid {
                    Solid::Ball(_) | Solid::Plate(_) => continue,
                    Solid::Bar(axis, own, half) | Solid::Cylinder(axis, own, half) => (axis, (own, half)),
                    Solid::Ring(axis, circle, own) => (axis, (circle, own)),
                };
                let across = unit(cross(axis, [0.3, -0.5, 0.81]));
                let other = cross(axis, across);
                let turn = |angle: f64| add(scale(angle.cos(), across), scale(angle.sin(), other));
                let mut nearest = f64::INFINITY;
                let n = 300;
                for i in 0..n {
                    let out = turn(std::f64::consts::TAU * f64::from(i) / f64::from(n));
                    for k in 0..=n {
                        let share = f64::from(k) / f64::from(n);
                        let surface = match solid {
                            Solid::Ring(..) => {
                                let angle = std::f64::consts::TAU * share;
                                let tube = add(scale(angle.cos(), out), scale(angle.sin(), axis));
                                vec![add(scale(points.0, out), scale(points.1, tube))]
                            }
                            Solid::Bar(..) => {
                                let (own, half) = points;
                                let angle = std::f64::consts::PI * (share - 0.5);
                                let end = if angle < 0.0 { -half } else { half };
                                let round = add(scale(angle.cos(), out), scale(angle.sin(), axis));
                                let wall = add(scale(own, out), scale(half * (2.0 * share - 1.0), axis));
                                vec![add(scale(end, axis), scale(own, round)), wall]
                            }
                            _ => {
                                let (own, half) = points;
                                let end = |h: f64| add(scale(own * share, out), scale(h, axis));
                                let wall = add(scale(own, out), scale(half * (2.0 * share - 1.0), axis));
                                vec![end(half), end(-half), wall]
                            }
                        };
                        for point in surface {
                            nearest = nearest.min(distance(point, center));
                        }
                    }
                }
                let met = solid.meet(center, 0.0);
                // A grid of a few millimetres is off by its square over the distance.
                let off = (met.penetration.abs() - nearest).abs();
                assert!(off < 4e-5 / nearest.max(0.02), "{solid:?} {center:?} {met:?} {nearest}");
            }
        }
    }

    /// Checks CON-15: the normal is the slope of the depth, in every solid and outside of its edges.
    #[test]
    fn the_normal_is_the_slope_of_the_depth() {
        let mut r = Numbers(7);
        let (mut worst, h) = (0.0f64, 1e-6);
        for _ in 0..2000 {
            for solid in solids(&mut r) {
                let center = scale(0.6, r.vector());
                let met = solid.meet(center, 0.05);
                for i in 0..3 {
                    let at = |s: f64| {
                        let mut c = center;
                        c[i] += s * h;
                        solid.meet(c, 0.05)
                    };
                    let (a, b) = (at(-1.0), at(1.0));
                    // At an edge, and near a middle line, the slope itself changes.
                    if distance(a.normal, b.normal) > 1e-4 {
                        continue;
                    }
                    let slope = (b.penetration - a.penetration) / (2.0 * h);
                    worst = worst.max((slope - met.normal[i]).abs());
                }
                assert!((dot(met.normal, met.normal) - 1.0).abs() < 1e-14);
            }
        }
        println!("slopes: within {worst:.1e}");
        assert!(worst < 1e-8);
    }

    /// Checks CON-15 by hand: a sphere at a rim, at an end, at a wall; in and out of a ring.
    #[test]
    fn spheres_meet_solids_where_they_should() {
        let z = [0.0, 0.0, 1.0];
        let near = |met: SolidContact<f64>, normal: Vector3<f64>, depth: f64| {
            let off = distance(met.normal, normal).max((met.penetration - depth).abs());
            assert!(off < 1e-15, "{met:?}");
        };
        let cylinder = Solid::Cylinder(z, 1.0, 2.0);
        near(cylinder.meet([1.3, 0.0, 2.4], 0.75), [-0.6, 0.0, -0.8], 0.25);
        near(cylinder.meet([0.5, 0.2, -2.5], 0.75), [0.0, 0.0, 1.0], 0.25);
        near(cylinder.meet([0.0, -1.5, 1.0], 0.75), [0.0, 1.0, 0.0], 0.25);
        near(cylinder.meet([0.0, 0.5, 0.0], 0.75), [0.0, -1.0, 0.0], 1.25);
        let ring = Solid::Ring(z, 2.0, 0.25);
        near(ring.meet([1.4, 0.0, 0.8], 1.0), [0.6, 0.0, -0.8], 0.25);
        near(ring.meet([0.0, 2.6, 0.0], 0.5), [0.0, -1.0, 0.0], 0.15000000000000002);
        assert!(ring.meet([0.0, 0.0, 1.5], 2.0).penetration == -0.25, "on the axis");
        assert!(Solid::Ball(1.0).meet([0.0; 3], 1.0).normal[0].is_nan(), "in the middle");
        near(Solid::Bar(z, 0.1, 0.5).meet([0.0, 0.3, 0.9], 0.5), [0.0, -0.6, -0.8], 0.1);
        near(Solid::Plate(z).meet([7.0, 8.0, 0.5], 0.75), [0.0, 0.0, -1.0], 0.25);
    }
}
