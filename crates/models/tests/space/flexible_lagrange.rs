//! Lagrange's equations of a robot whose energy is written point by point along its beams, in inertial axes and with Euler
//! angles, against the kernel's forces: another derivation and other coordinates, derivatives by numbers with two
//! infinitesimals (exact).

use super::machine::Machine;
use super::properties::{turned, vector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_models::space::appendage::{Beam, Shapes};
use trueup_models::space::articulated::{SweepResult, accelerations};
use trueup_models::space::composite::{BASE, forces};
use trueup_models::space::ritz;
use trueup_models::space::shapes::{bending_at, torsion_at};
use trueup_models::space::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use trueup_models::space::tree::{JointType, Tree, TreeBody};

/// v + a e1 + b e2 + ab e1 e2, squares of both infinitesimals being 0.
#[derive(Clone, Copy)]
struct Hyper {
    v: f64,
    a: f64,
    b: f64,
    ab: f64,
}
impl std::ops::Add for Hyper {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { v: self.v + o.v, a: self.a + o.a, b: self.b + o.b, ab: self.ab + o.ab }
    }
}
impl std::ops::Mul for Hyper {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        let ab = self.ab * o.v + self.a * o.b + self.b * o.a + self.v * o.ab;
        Self { v: self.v * o.v, a: self.a * o.v + self.v * o.a, b: self.b * o.v + self.v * o.b, ab }
    }
}
fn number(v: f64) -> Hyper {
    Hyper { v, a: 0.0, b: 0.0, ab: 0.0 }
}
impl Hyper {
    fn of(self, f: f64, df: f64, ddf: f64) -> Self {
        Self { v: f, a: df * self.a, b: df * self.b, ab: df * self.ab + ddf * self.a * self.b }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.v.sin_cos();
        (self.of(s, c, -s), self.of(c, -s, -c))
    }
}

type V = [Hyper; 3];
type M = [V; 3];
fn plus(a: V, b: V) -> V {
    [0, 1, 2].map(|i| a[i] + b[i])
}
fn by(s: Hyper, a: V) -> V {
    a.map(|x| s * x)
}
fn dot(a: V, b: V) -> Hyper {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: V, b: V) -> V {
    let minus = |x: Hyper| number(-1.0) * x;
    [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] + minus(a[k] * b[j])
    })
}
fn times(m: &M, a: V) -> V {
    m.map(|row| dot(row, a))
}
fn product(a: &M, b: &M) -> M {
    a.map(|row| [0, 1, 2].map(|j| dot(row, [b[0][j], b[1][j], b[2][j]])))
}
fn column(m: &M, j: usize) -> V {
    [m[0][j], m[1][j], m[2][j]]
}
fn numbers(v: [f64; 3]) -> V {
    v.map(number)
}
/// About axis k of the axes before.
fn turn(k: usize, angle: Hyper) -> M {
    let (s, c) = angle.sin_cos();
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let mut m = [numbers([0.0; 3]); 3];
    (m[k][k], m[i][i], m[j][j], m[j][i], m[i][j]) = (number(1.0), c, c, s, number(-1.0) * s);
    m
}

/// A body's axes in the inertial frame, and how they move, inertial axes.
#[derive(Clone, Copy)]
struct At {
    origin: V,
    turned: M,
    velocity: V,
    omega: V,
}
impl At {
    fn velocity_of(&self, r: V, relative: V) -> V {
        let (r, relative) = (times(&self.turned, r), times(&self.turned, relative));
        plus(plus(self.velocity, cross(self.omega, r)), relative)
    }
}

/// Points (mass, place) of each body, the joints that carry them, beams.
struct Robot {
    points: Vec<Vec<(f64, [f64; 3])>>,
    mounts: Vec<SpatialFrame<f64>>,
    joints: Vec<JointType>,
    parent: Vec<usize>,
    beams: Vec<(usize, Shapes, Beam<f64>)>,
    /// How many of the beams, the last ones, carry what their bodies carry.
    links: usize,
    /// Their displacements of second order count.
    stiffening: bool,
    /// Place and weight on 0 .. 1.
    quadrature: Vec<(f64, f64)>,
}

impl Robot {
    fn size(&self) -> usize {
        6 + self.joints.len() + self.beams.iter().map(|b| b.1.modes()).sum::<usize>()
    }

    /// Axes of the base by its Euler angles z, y, x, and the axes that each angle turns about (inertial).
    fn base(q: &[Hyper]) -> (M, [V; 3]) {
        let yaw = turn(2, q[3]);
        let pitched = product(&yaw, &turn(1, q[4]));
        let all = product(&pitched, &turn(0, q[5]));
        (all, [numbers([0.0, 0.0, 1.0]), column(&yaw, 1), column(&pitched, 0)])
    }

    fn place(&self, q: &[Hyper], rates: &[Hyper]) -> Vec<At> {
        let (turned, axes) = Self::base(q);
        let omega = (0..3).fold(numbers([0.0; 3]), |sum, k| plus(sum, by(rates[3 + k], axes[k])));
        let mut all =
            vec![At { origin: [q[0], q[1], q[2]], turned, velocity: [rates[0], rates[1], rates[2]], omega }];
        for (i, joint) in self.joints.iter().enumerate() {
            let (carrier, mount) = (self.carrier(&all, self.parent[i], q, rates), &self.mounts[i]);
            let (angle, rate) = (q[6 + i], rates[6 + i]);
            let mounted = mount.rotation.map(numbers);
            let axis = column(&mounted, 2);
            let (own, slid, sliding, turning) = match joint {
                JointType::Revolute => (product(&mounted, &turn(2, angle)), number(0.0), number(0.0), rate),
                JointType::Prismatic => (mounted, angle, rate, number(0.0)),
            };
            let place = plus(numbers(mount.origin), by(slid, axis));
            all.push(At {
                origin: plus(carrier.origin, times(&carrier.turned, place)),
                turned: product(&carrier.turned, &own),
                velocity: carrier.velocity_of(place, by(sliding, axis)),
                omega: plus(carrier.omega, by(turning, times(&carrier.turned, axis))),
            });
        }
        all
    }

    /// Axes that carry what hangs on a body: its own, or those that move with the end of its link and are its own unbent.
    fn carrier(&self, all: &[At], body: usize, q: &[Hyper], rates: &[Hyper]) -> At {
        let own = all[body];
        let first =
            |k: usize| 6 + self.joints.len() + self.beams[..k].iter().map(|b| b.1.modes()).sum::<usize>();
        let from = self.beams.len() - self.links;
        let Some(k) = (from..self.beams.len()).find(|k| self.beams[*k].0 == body) else { return own };
        let (_, shapes, beam) = &self.beams[k];
        // Shift and turn of the end, link's axes.
        let end = |of: &[Hyper]| {
            let (mut shift, mut turn) = ([number(0.0); 2], [number(0.0); 3]);
            let of = &of[first(k)..][..shapes.modes()];
            let n = shapes.x.max(shapes.y);
            for j in 0..shapes.x {
                shift[0] = shift[0] + of[j];
                turn[1] = turn[1] + number(ritz::bending(n, j).unwrap().slope / beam.length) * of[j];
            }
            for j in 0..shapes.y {
                let eta = of[shapes.x + j];
                shift[1] = shift[1] + eta;
                turn[0] = turn[0] + number(-ritz::bending(n, j).unwrap().slope / beam.length) * eta;
            }
            (0..shapes.torsion).for_each(|j| turn[2] = turn[2] + of[shapes.x + shapes.y + j]);
            ([shift[0], shift[1], number(0.0)], turn)
        };
        let ((mut shift, mut turn), (mut shifting, mut turning)) = (end(q), end(rates));
        if self.stiffening {
            let [place, section] = self.beyond(k, &q[first(k)..], &rates[first(k)..], 1.0);
            (shift, shifting) = (plus(shift, place.0), plus(shifting, place.1));
            (turn, turning) = (plus(turn, section.0), plus(turning, section.1));
        }
        let axes = beam.frame.rotation.map(numbers);
        let of_body = |v: V| times(&axes, v);
        // A quaternion 1, theta / 2 that is not normalised.
        let half = of_body(by(number(0.5), turn));
        let square = number(1.0) + dot(half, half);
        let inverse = square.of(1.0 / square.v, -1.0 / square.v.powi(2), 2.0 / square.v.powi(3));
        let rotated = |v: V| {
            let once = plus(v, cross(half, v));
            plus(v, by(number(2.0) * inverse, cross(half, once)))
        };
        let rate = of_body(turning);
        let omega = by(inverse, plus(rate, cross(half, rate)));
        let unbent =
            plus(numbers(beam.frame.origin), of_body([number(0.0), number(0.0), number(beam.length)]));
        let place = plus(unbent, of_body(shift));
        let minus = |v: V| by(number(-1.0), v);
        // The point that was at the body's origin.
        let from_end = rotated(minus(unbent));
        let origin = plus(place, from_end);
        let moving = plus(of_body(shifting), cross(omega, from_end));
        let columns = [0, 1, 2].map(|j| rotated([0, 1, 2].map(|i| number(f64::from(u8::from(i == j))))));
        let turned = [0, 1, 2].map(|i| [columns[0][i], columns[1][i], columns[2][i]]);
        At {
            origin: plus(own.origin, times(&own.turned, origin)),
            turned: product(&own.turned, &turned),
            velocity: own.velocity_of(origin, moving),
            omega: plus(own.omega, times(&own.turned, omega)),
        }
    }

    /// Angles of beam k's sections and their slope, at the share z of the length: Theta, kappa, link's axes.
    fn sections(&self, k: usize, eta: &[Hyper], z: f64) -> [V; 2] {
        let (_, shapes, beam) = &self.beams[k];
        let mut all = [numbers([0.0; 3]); 2];
        let mut put = |axis: usize, j: usize, of: [f64; 2], power: i32| {
            for (d, (to, value)) in all.iter_mut().zip(of).enumerate() {
                let value = value / beam.length.powi(power + d as i32);
                to[axis] = to[axis] + number(value) * eta[j];
            }
        };
        let bent = |j: usize| ritz::bending(shapes.x.max(shapes.y), j).unwrap();
        for j in 0..shapes.x {
            put(1, j, [bent(j).slope_at(z), bent(j).curvature_at(z)], 1);
        }
        for j in 0..shapes.y {
            put(0, shapes.x + j, [-bent(j).slope_at(z), -bent(j).curvature_at(z)], 1);
        }
        for j in 0..shapes.torsion {
            let twisted = ritz::torsion(shapes.torsion, j).unwrap();
            put(2, shapes.x + shapes.y + j, [twisted.torsion_at(z), twisted.twist_at(z)], 0);
        }
        all
    }

    /// What comes second, after the shapes, in the series of Peano of dR/dz = R [kappa x], dr/dz = R z, at the share z of beam
    /// k's length: of the place r, and of the rotation R the vector of its skew part. Each with its rate; by numbers.
    fn beyond(&self, k: usize, eta: &[Hyper], rates: &[Hyper], z: f64) -> [(V, V); 2] {
        let none = numbers([0.0; 3]);
        let (mut place, mut section) = ((none, none), (none, none));
        let length = self.beams[k].2.length;
        let axis = numbers([0.0, 0.0, 1.0]);
        for (y, weight) in &self.quadrature {
            let [[theta, kappa], [turning, curving]] = [eta, rates].map(|of| self.sections(k, of, z * y));
            let part = number(weight * z * length);
            let left = number(z * (1.0 - y) * length) * part;
            let column = |theta: V, kappa: V| cross(theta, cross(kappa, axis));
            place.0 = plus(place.0, by(left, column(theta, kappa)));
            place.1 = plus(place.1, by(left, plus(column(turning, kappa), column(theta, curving))));
            let half = number(0.5) * part;
            section.0 = plus(section.0, by(half, cross(theta, kappa)));
            section.1 = plus(section.1, by(half, plus(cross(turning, kappa), cross(theta, curving))));
        }
        [place, section]
    }

    fn kinetic(&self, q: &[Hyper], rates: &[Hyper]) -> Hyper {
        let all = self.place(q, rates);
        let (mut twice, mut displaced) = (number(0.0), number(0.0));
        let mut take = |mass: f64, v: V| twice = twice + number(mass) * dot(v, v);
        for (points, at) in self.points.iter().zip(&all) {
            for (mass, place) in points {
                take(*mass, at.velocity_of(numbers(*place), numbers([0.0; 3])));
            }
        }
        let mut first = 6 + self.joints.len();
        for (number_of, (on, shapes, beam)) in self.beams.iter().enumerate() {
            let link = number_of >= self.beams.len() - self.links;
            let bending = |j: usize, z: f64| match link {
                true => ritz::bending(shapes.x.max(shapes.y), j).unwrap().bending_at(z),
                false => bending_at(j, z),
            };
            let twisting = |j: usize, z: f64| match link {
                true => ritz::torsion(shapes.torsion, j).unwrap().torsion_at(z),
                false => torsion_at(j, z),
            };
            let (at, turned) = (&all[*on], beam.frame.rotation.map(numbers));
            let along = |of: &[Hyper], from: usize, count: usize, f: &dyn Fn(usize, f64) -> f64, z: f64| {
                (0..count).fold(number(0.0), |sum, j| sum + number(f(j, z)) * of[first + from + j])
            };
            let bowed = |of: &[Hyper], z: f64| {
                let x = along(of, 0, shapes.x, &bending, z);
                [x, along(of, shapes.x, shapes.y, &bending, z), number(0.0)]
            };
            for (z, weight) in &self.quadrature {
                let mut place = bowed(q, *z);
                place[2] = number(z * beam.length);
                let place = plus(numbers(beam.frame.origin), times(&turned, place));
                let moving = times(&turned, bowed(rates, *z));
                take(beam.mass_per_length * beam.length * weight, at.velocity_of(place, moving));
                // The section turns with the body and twists.
                let axis = times(&at.turned, column(&turned, 2));
                let twist = along(rates, shapes.x + shapes.y, shapes.torsion, &twisting, *z);
                let spin = dot(axis, at.omega) + twist;
                let polar = beam.polar_inertia_per_length * beam.length * weight;
                take(polar, [spin, number(0.0), number(0.0)]);
                if link && self.stiffening {
                    // What is of first order in the displacement of second order along the link.
                    let [along, _] = self.beyond(number_of, &q[first..], &rates[first..], *z);
                    let [d, moving] = [along.0, along.1].map(|v| [number(0.0), number(0.0), v[2]]);
                    let unbent = [0.0, 0.0, z * beam.length];
                    let unbent = plus(numbers(beam.frame.origin), times(&turned, numbers(unbent)));
                    let still = at.velocity_of(unbent, numbers([0.0; 3]));
                    let [d, moving] = [d, moving].map(|v| times(&at.turned, times(&turned, v)));
                    let by_it = plus(cross(at.omega, d), moving);
                    let mass = beam.mass_per_length * beam.length * weight;
                    displaced = displaced + number(2.0 * mass) * dot(still, by_it);
                }
            }
            first += shapes.modes();
        }
        number(0.5) * (twice + displaced)
    }

    /// d/dt of dT/d(rates) less dT/dq.
    fn lagrange(&self, q: &[f64], rates: &[f64], accelerations: &[f64]) -> Vec<f64> {
        let n = self.size();
        let path = |x: &[f64], d: Option<&[f64]>, one: Option<usize>| -> Vec<Hyper> {
            (0..n)
                .map(|i| Hyper {
                    v: x[i],
                    a: if one == Some(i) { 1.0 } else { 0.0 },
                    b: d.map_or(0.0, |d| d[i]),
                    ab: 0.0,
                })
                .collect()
        };
        (0..n)
            .map(|i| {
                let changing =
                    self.kinetic(&path(q, Some(rates), None), &path(rates, Some(accelerations), Some(i))).ab;
                changing - self.kinetic(&path(q, None, Some(i)), &path(rates, None, None)).a
            })
            .collect()
    }
}

/// Gauss-Legendre of five points in each of 16 pieces: exact to rounding for the shapes used here.
fn quadrature() -> Vec<(f64, f64)> {
    let (a, b) = (0.538_469_310_105_683_1, 0.906_179_845_938_664);
    let (wa, wb) = (0.478_628_670_499_366_47, 0.236_926_885_056_189_08);
    let points = [(0.0, 128.0 / 225.0), (a, wa), (-a, wa), (b, wb), (-b, wb)];
    let piece = |k: i32| points.map(|(x, w)| ((f64::from(k) + 0.5 + 0.5 * x) / 16.0, w / 32.0));
    (0..16).flat_map(piece).collect()
}

/// `links`: bodies 1 and 2 have links, on whose ends hang bodies 2 and 4.
fn robot(rng: &mut StdRng, links: bool, stiffening: bool) -> (Robot, Machine) {
    let cloud = |rng: &mut StdRng| -> Vec<(f64, [f64; 3])> {
        (0..5).map(|_| (rng.random_range(0.2..0.6), vector(rng))).collect()
    };
    let points: Vec<_> = (0..5).map(|_| cloud(rng)).collect();
    let rigid = |points: &Vec<(f64, [f64; 3])>| {
        points.iter().fold(Rigid::new(0.0, [0.0; 3], &[[0.0; 3]; 3]), |sum, (mass, place)| {
            sum.plus(&Rigid::new(*mass, *place, &[[0.0; 3]; 3]))
        })
    };
    let joints = vec![JointType::Revolute, JointType::Prismatic, JointType::Revolute, JointType::Revolute];
    let mounts: Vec<_> =
        (0..4).map(|_| SpatialFrame { rotation: turned(rng), origin: vector(rng) }).collect();
    let parent = vec![0, 1, 0, 2];
    let shapes = [
        Shapes { x: 2, y: 3, torsion: 2 },
        Shapes { x: 1, y: 1, torsion: 1 },
        Shapes { x: 2, y: 0, torsion: 0 },
    ];
    let beams: Vec<_> = [0, 2, 3]
        .iter()
        .zip(shapes)
        .map(|(on, shapes)| (*on, shapes, super::flexible_properties::beam(rng)))
        .collect();
    let own = [Shapes { x: 2, y: 2, torsion: 1 }, Shapes { x: 3, y: 0, torsion: 2 }];
    let own =
        [1, 2].into_iter().zip(own).map(|(on, shapes)| (on, shapes, super::flexible_properties::beam(rng)));
    let carrying: Vec<_> = own.filter(|_| links).collect();
    let body =
        |i: usize| TreeBody { rigid: rigid(&points[i]), mount: mounts[i.max(1) - 1], axis: [0.0, 0.0, 1.0] };
    let machine = Machine {
        tree: Tree { parent: parent.clone(), joint: joints.clone() },
        base: rigid(&points[0]),
        bodies: (0..5).map(body).collect(),
        gears: vec![(0.0, 0.0, false); 4],
        beams: beams.clone(),
        tables: vec![],
        links: carrying.clone(),
        stiffening,
        link_tables: Vec::new(),
    };
    let all = [beams, carrying].concat();
    let links = machine.links.len();
    (
        Robot { points, mounts, joints, parent, beams: all, links, stiffening, quadrature: quadrature() },
        machine,
    )
}

/// Checks SFF-5, SFF-6, LNK-2, LNK-3, LNK-4, LNK-11: all forces of both algorithms, at any accelerations, are Lagrange's.
#[test]
fn lagrange_s_equations_from_energy_point_by_point() {
    against_lagrange_s_equations(2..3);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn lagrange_s_equations_of_twenty_robots() {
    against_lagrange_s_equations(0..20);
}

/// Of drawn robots, those of a multiple of three rigid, the base of the next one bending, base and links of the third.
fn against_lagrange_s_equations(robots: core::ops::Range<usize>) {
    let mut rng = StdRng::seed_from_u64(59);
    let (mut inverse, mut forward): (f64, f64) = (0.0, 0.0);
    for k in robots {
        let (r, m) = robot(&mut rng, k % 3 > 0, k % 3 == 2);
        let (n, l) = (r.size(), m.layout());
        let mut any = |size: f64| -> Vec<f64> { (0..n).map(|_| rng.random_range(-size..size)).collect() };
        let (mut q, rates, second) = (any(1.0), any(1.0), any(2.0));
        q[10..].iter_mut().for_each(|e| *e *= 0.4);
        let wanted = r.lagrange(&q, &rates, &second);
        // The base's velocity in its own axes along the path, and the rate of that: spatial velocity and acceleration.
        let path = |x: &[f64], d: &[f64]| -> Vec<Hyper> {
            x.iter().zip(d).map(|(v, b)| Hyper { v: *v, a: 0.0, b: *b, ab: 0.0 }).collect()
        };
        let at = r.place(&path(&q, &rates), &path(&rates, &second))[0];
        let own = |v: V| [0, 1, 2].map(|j| dot(column(&at.turned, j), v));
        let (v, omega) = (own(at.velocity), own(at.omega));
        let base = SpatialMotion { angular: omega.map(|w| w.b), linear: v.map(|v| v.b) };
        let mut x = vec![0.0; l.size()];
        x[..3].copy_from_slice(&q[..3]);
        x[3..7].copy_from_slice(&euler(&q[3..6]));
        x[7..7 + n - 6].copy_from_slice(&q[6..]);
        x[l.velocity()..][..3].copy_from_slice(&v.map(|v| v.v));
        x[l.velocity() + 3..][..3].copy_from_slice(&omega.map(|w| w.v));
        x[l.rates()..][..4].copy_from_slice(&rates[6..10]);
        x[l.eta_rates()..].copy_from_slice(&rates[10..]);
        m.at(&x, &[0.0; 4], |now, _| {
            let mut f = vec![0.0; n];
            forces(now, (base, &second[6..10], &[0.0; 4]), &second[10..], &mut f);
            let turned = at.turned.map(|row| row.map(|e| e.v));
            let inertial = |w: [f64; 3]| trueup_models::space::vector::times(&turned, w);
            let (force, torque) = (inertial([f[0], f[1], f[2]]), inertial([f[3], f[4], f[5]]));
            let axes = Robot::base(&path(&q, &rates)).1;
            let about = axes.map(|e| (0..3).map(|i| e[i].v * torque[i]).sum::<f64>());
            let found = [&force[..], &about, &f[BASE..]].concat();
            let largest = wanted.iter().fold(1.0_f64, |m, w| m.max(w.abs()));
            let off = found.iter().zip(&wanted).map(|(f, w)| (f - w).abs()).fold(0.0, f64::max);
            inverse = inverse.max(off / largest);
            // And back: those forces give those accelerations.
            let mut forced = *now;
            let force: Vec<f64> = f[10..].to_vec();
            forced.flexing.force = &force;
            let drives: Vec<_> = (0..4)
                .map(|i| {
                    let moves = trueup_models::space::articulated::Moves::Driven(f[BASE + i]);
                    trueup_models::space::articulated::JointDrive { moves, ..now.drives[i] }
                })
                .collect();
            forced.drives = &drives;
            let mut applied = [SpatialWrench::zero(); 5];
            applied[0] = SpatialWrench { force: [f[0], f[1], f[2]], torque: [f[3], f[4], f[5]] };
            let [mut joint, mut rotor, mut modal] = [vec![0.0; 4], vec![0.0; 4], vec![0.0; l.modes]];
            let out = SweepResult { joint: &mut joint, rotor: &mut rotor, modal: &mut modal };
            let a = accelerations(&forced, &applied, None, out);
            let found = [&a.linear[..], &a.angular, &joint, &modal].concat();
            let given = [&base.linear[..], &base.angular, &second[6..]].concat();
            let off = found.iter().zip(&given).map(|(f, w)| (f - w).abs()).fold(0.0, f64::max);
            forward = forward.max(off / given.iter().fold(1.0_f64, |m, w| m.max(w.abs())));
        });
    }
    println!("forces off Lagrange's by {inverse:.1e}, accelerations by {forward:.1e}");
    assert!(inverse < 1e-12 && forward < 1e-11, "{inverse:e} {forward:e}");
}

/// The quaternion of Euler angles z, y, x.
fn euler(angles: &[f64]) -> [f64; 4] {
    let half = [0, 1, 2].map(|k| (0.5 * angles[k]).sin_cos());
    let [(sz, cz), (sy, cy), (sx, cx)] = half;
    [
        cz * cy * cx + sz * sy * sx,
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
    ]
}
