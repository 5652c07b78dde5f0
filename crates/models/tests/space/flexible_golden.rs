//! Golden facts B38-B49 (two arms; panels on the robot of S1): computed twice by others than this code, by Newton-Euler and by
//! Lagrange with complex steps; B40-B45 are roots of transcendental equations.

use super::facts::fact;
use super::machine::{Layout, Machine, body};
use nalgebra::DMatrix;
use trueup_models::space::analysis::RigidRobot;
use trueup_models::space::appendage::{Beam, Shapes};
use trueup_models::space::attitude::rotation;
use trueup_models::space::composite::{BASE, forces, mass_matrix};
use trueup_models::space::presets;
use trueup_models::space::shapes::{bending, bending_at, torsion, torsion_at};
use trueup_models::space::spatial::{Rigid, SpatialFrame, SpatialMotion};
use trueup_models::space::tree::{JointType, Tree, TreeBody};
use trueup_models::space::vector::{cross, times, transposed_times};
use trueup_numerics::{Dual, Scalar};

fn worst(found: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(found.len(), wanted.len());
    found.iter().zip(wanted).map(|(f, w)| (f - w).abs()).fold(0.0, f64::max)
}

/// Checks SFF-3: N_R and N_C are derivatives of B (B38).
#[test]
fn b38_forces_of_rates_are_derivatives_of_those_of_accelerations() {
    let robot = presets::table_1().robot();
    let lifted: RigidRobot<Dual<1>> = RigidRobot {
        tree: robot.tree.clone(),
        base: body(&TreeBody { rigid: robot.base, ..robot.bodies[1] }).rigid,
        bodies: robot.bodies.iter().map(body).collect(),
    };
    let mut off: f64 = 0.0;
    for angles in [[0.4, 0.7, -1.1], [-1.3, 1.7, 0.5], [2.2, -0.4, 1.6]] {
        let plain = robot.reaction(&angles, [0.0; 3]);
        let moved = [0, 1, 2].map(|k| {
            let mut q = angles.map(Dual::<1>::constant);
            q[k].eps[0] = 1.0;
            lifted.reaction(&q, [Scalar::zero(); 3])
        });
        let all = |c: &trueup_models::space::analysis::SpatialColumn<Dual<1>>| [c.force, c.torque].concat();
        let flat = |c: &trueup_models::space::analysis::SpatialColumn<f64>| [c.force, c.torque].concat();
        for i in 0..6 {
            let by = |j: usize, k: usize| all(&moved[k].inertial[j])[i].eps[0];
            (0..3).for_each(|k| off = off.max((flat(&plain.centrifugal[k])[i] - by(k, k)).abs()));
            for (j, k, c) in &plain.coriolis {
                off = off.max((flat(c)[i] - by(*j, *k) - by(*k, *j)).abs());
            }
        }
    }
    println!("B38: off by {off:.1e}");
    assert!(off < 1e-12, "{off:e}");
}

/// An arm of S1 without its post on a bus, or two of them, the second turned by 180 degrees about x.
pub(super) fn arms(count: usize) -> Machine {
    let one = presets::table_1_with_panels();
    let robot = one.robot();
    let mut bodies = vec![robot.bodies[0]];
    for k in 0..count {
        let side = if k == 0 { 1.0 } else { -1.0 };
        bodies.extend_from_slice(&robot.bodies[1..=3]);
        let at = 3 * k + 1;
        bodies[at].mount = SpatialFrame {
            rotation: [[1.0, 0.0, 0.0], [0.0, side, 0.0], [0.0, 0.0, side]],
            origin: [0.0, 0.0, 0.65 * side],
        };
    }
    let parent = [0, 1, 2, 0, 4, 5][..3 * count].to_vec();
    let joint = vec![JointType::Revolute; 3 * count];
    Machine {
        tree: Tree { parent, joint },
        base: Rigid::new(one.base_mass, [0.0; 3], &one.base_inertia),
        bodies,
        gears: vec![(0.0, 0.0, false); 3 * count],
        beams: vec![],
        tables: vec![],
        links: vec![],
        stiffening: false,
        link_tables: Vec::new(),
    }
}

/// The two panels at this height with these shapes.
pub(super) fn panels(height: f64, shapes: Shapes) -> Vec<(usize, Shapes, Beam<f64>)> {
    let placed = |(_, mut beam): (Shapes, Beam<f64>)| {
        beam.frame.origin[2] = height;
        (0, shapes, beam)
    };
    presets::panels().map(placed).to_vec()
}

pub(super) fn at_rest(l: &Layout) -> Vec<f64> {
    let mut x = vec![0.0; l.size()];
    x[3] = 1.0;
    x
}

/// Checks SFF-11: the bias of two arms (B39).
#[test]
fn b39_two_arms_on_one_bus() {
    let m = arms(2);
    let l = m.layout();
    let mut x = at_rest(&l);
    x[3..7].copy_from_slice(&unit4([0.8, 0.2, -0.4, 0.4]));
    let turned = rotation([0.8, 0.2, -0.4, 0.4]);
    let q = [20.0_f64, 40.0, -60.0, -75.0, 100.0, 30.0].map(f64::to_radians);
    x[7..13].copy_from_slice(&q);
    x[l.velocity()..][..3].copy_from_slice(&transposed_times(&turned, [0.1, -0.2, 0.3]));
    x[l.velocity() + 3..][..3].copy_from_slice(&transposed_times(&turned, [0.2, -0.1, 0.15]));
    x[l.rates()..][..6].copy_from_slice(&[0.5, -0.4, 0.3, -0.2, 0.6, 0.1]);
    let mut c = [0.0; 12];
    // Spatial: the acceleration of the base's origin is 0 when its linear part is - omega x v.
    m.at(&x, &[0.0; 6], |now, _| {
        let v = now.placed[0].velocity;
        let linear = cross(v.linear, v.angular);
        let still = SpatialMotion { linear, ..SpatialMotion::zero() };
        forces(now, (still, &[0.0; 6], &[0.0; 6]), &[], &mut c);
    });
    let (force, torque) = (times(&turned, [c[0], c[1], c[2]]), times(&turned, [c[3], c[4], c[5]]));
    let off = worst(&[&force[..], &torque, &c[6..]].concat(), fact("B39"));
    println!("B39: off by {off:.1e}");
    assert!(off < 1e-10, "{off:e}");
}

fn unit4(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    q.map(|v| v / length)
}

/// Checks SFF-5: clamped frequencies (B40), and the integrals of the shapes against quadrature.
#[test]
fn b40_clamped_shapes_and_their_integrals() {
    let mut m = arms(1);
    m.beams = panels(0.0, Shapes { x: 3, y: 2, torsion: 2 });
    let all = m.appendages::<f64>();
    let found: Vec<f64> = all.modes()[..7].iter().map(|m| (m.stiffness / m.mass).sqrt()).collect();
    let off = worst(&found, fact("B40"));
    println!("B40: off by {off:.1e}");
    assert!(off < 1e-12 * 64.0, "{off:e}");
    // Gauss-Legendre, five points in each of 200 pieces.
    let (a, b) = (0.538469310105683, 0.906179845938664);
    let (wa, wb) = (0.478628670499366, 0.236926885056189);
    let points = [(0.0, 128.0 / 225.0), (a, wa), (-a, wa), (b, wb), (-b, wb)];
    let integral = |f: &dyn Fn(f64) -> f64| -> f64 {
        let piece = |k: usize| {
            points.iter().map(|(x, w)| w * f((k as f64 + 0.5 + 0.5 * x) / 200.0)).sum::<f64>() / 400.0
        };
        (0..200).map(piece).sum()
    };
    let mut off: f64 = 0.0;
    for j in 0..12 {
        for (s, at) in
            [(bending(j).unwrap(), bending_at as fn(usize, f64) -> f64), (torsion(j).unwrap(), torsion_at)]
        {
            off = off.max((integral(&|z| at(j, z)) - s.area).abs());
            off = off.max((integral(&|z| z * at(j, z)) - s.moment).abs());
            off = off.max((at(j, 1.0) - 1.0).abs()).max(at(j, 0.0).abs());
            for k in 0..12 {
                let wanted = if j == k { s.square } else { 0.0 };
                off = off.max((integral(&|z| at(j, z) * at(k, z)) - wanted).abs());
            }
        }
    }
    println!("integrals of shapes: off by {off:.1e}");
    assert!(off < 1e-12 && bending(12).is_none() && torsion(12).is_none(), "{off:e}");
}

/// Frequencies of base and modes, rad/s, joints locked.
pub(super) fn frequencies(m: &Machine, x: &[f64]) -> Vec<f64> {
    let l = m.layout();
    m.at(x, &vec![0.0; l.n], |now, appendages| {
        let size = BASE + l.n + l.modes;
        let mut mass = vec![0.0; size * size];
        mass_matrix(now, &mut mass);
        let all = DMatrix::from_row_slice(size, size, &mass);
        let modal = BASE + l.n;
        let base = all.view((0, 0), (BASE, BASE)).clone_owned();
        let by = all.view((0, modal), (BASE, l.modes)).clone_owned();
        // A free base follows: what is left of the modes' mass.
        let left =
            all.view((modal, modal), (l.modes, l.modes)) - by.transpose() * base.lu().solve(&by).unwrap();
        let stiffness =
            DMatrix::from_fn(
                l.modes,
                l.modes,
                |i, j| {
                    if i == j { appendages.modes()[i].stiffness } else { 0.0 }
                },
            );
        let lower = left.cholesky().unwrap().l();
        let half = lower.solve_lower_triangular(&stiffness).unwrap();
        let form = lower.solve_lower_triangular(&half.transpose()).unwrap();
        let mut found: Vec<f64> =
            form.symmetric_eigen().eigenvalues.iter().map(|e| e.max(0.0).sqrt()).collect();
        found.sort_by(f64::total_cmp);
        found
    })
}

/// The first roots of what must vanish at a frequency of two panels on a base, without poles.
pub(super) fn roots(f: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut found = vec![];
    for k in 10..8000 {
        let (mut a, mut b) = (0.01 * f64::from(k), 0.01 * f64::from(k + 1));
        if f(a) * f(b) <= 0.0 {
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if f(a) * f(middle) <= 0.0 { b = middle } else { a = middle }
            }
            found.push(0.5 * (a + b));
        }
    }
    found
}

/// What bends of the panels must bring when the base moves by `lift` and turns by `turn`: by Krylov's functions.
pub(super) fn bent(stiffness: f64, inert: f64, lift: f64, turn: f64) -> impl Fn(f64) -> f64 {
    move |omega: f64| {
        let beta = (omega * omega / stiffness).powf(0.25);
        let x = 4.0 * beta;
        let (c, s, k, h) = (x.cos(), x.sin(), x.cosh(), x.sinh());
        let [k1, k2, k3, k4] = [k + c, h + s, k - c, h - s].map(|v| 0.5 * v);
        let det = k1 * k1 - k2 * k4;
        let (a, b) = (lift + 0.6 * turn, turn / beta);
        // Moment and shear at the root, times det, such that the tip has none.
        let (m, q) = (a * k3 + b * k4, a * k2 + b * k3);
        let (moment, shear) = (q * k2 - m * k1, m * k4 - q * k1);
        let pull = beta.powi(3) * shear * (lift + 0.6 * turn) - beta.powi(2) * moment * turn;
        inert * omega * omega * det - 2.0 * stiffness * pull
    }
}

/// Checks SFF-5 and SFF-6: frequencies of two panels on a free base come down on the exact ones as shapes are added.
#[test]
fn b41_to_b46_free_frequencies() {
    let twist = |omega: f64| {
        let k = omega * (0.02_f64 / 60.0).sqrt();
        14.0 * omega * omega * (4.0 * k).cos() + 2.0 * 60.0 * k * (4.0 * k).sin()
    };
    let exact = [
        roots(bent(200.0, 120.0, 1.0, 0.0)),
        roots(bent(200.0, 12.0, 0.0, 1.0)),
        roots(bent(800.0, 120.0, 1.0, 0.0)),
        roots(bent(800.0, 10.0, 0.0, 1.0)),
        roots(twist),
    ];
    let off = worst(
        &exact.each_ref().map(|roots| &roots[..2]).concat(),
        &["B41", "B42", "B43", "B44", "B45"].map(fact).concat(),
    );
    println!("B41-B45: roots off by {off:.1e}");
    assert!(off < 1e-8, "{off:e}");
    let mut last = [f64::INFINITY; 5];
    let mut off: f64 = 0.0;
    for (shapes, errors) in [1, 2, 3, 6].iter().zip(fact("B46").chunks(5)) {
        let mut m = arms(0);
        m.beams = panels(0.0, Shapes { x: *shapes, y: *shapes, torsion: *shapes });
        let found = frequencies(&m, &at_rest(&m.layout()));
        for (k, wanted) in errors.iter().enumerate() {
            let nearest =
                |a: &&f64, b: &&f64| (**a - exact[k][0]).abs().total_cmp(&(**b - exact[k][0]).abs());
            let error = found.iter().min_by(nearest).unwrap() / exact[k][0] - 1.0;
            off = off.max((error - wanted).abs());
            assert!(error > 0.0 && error < last[k], "{shapes} shapes, {k}: {error:e}");
            last[k] = error;
        }
    }
    println!("B46: off by {off:.1e}");
    assert!(off < 1e-9, "{off:e}");
}

fn whole() -> Machine {
    let mut m = arms(1);
    m.beams = presets::panels().map(|(shapes, beam)| (0, shapes, beam)).to_vec();
    m
}
fn start(m: &Machine) -> Vec<f64> {
    let mut x = at_rest(&m.layout());
    x[7..10].copy_from_slice(&[20.0_f64, 40.0, -60.0].map(f64::to_radians));
    x
}

/// Checks SFF-6.
#[test]
fn b47_modes_of_the_robot() {
    let m = whole();
    let hertz: Vec<f64> =
        frequencies(&m, &start(&m)).iter().map(|f| f / (2.0 * std::f64::consts::PI)).collect();
    let off = worst(&hertz, fact("B47"));
    println!("B47: off by {off:.1e}");
    assert!(off < 1e-9, "{off:e} {hertz:?}");
}

/// Checks SFF-5 and SFF-6: 3 s of the arm's motion, and what must stay.
#[test]
fn b48_and_b49_the_robot_for_three_seconds() {
    let m = whole();
    let l = m.layout();
    // One more state each: work of the motors, heat of the dampers.
    let rates = |t: f64, x: &[f64]| {
        let s = (2.0 * std::f64::consts::PI * t / 3.0).sin();
        let torques = [2.0 * s, 6.0 * s, -1.5 * s];
        let (own, _) = x.split_at(l.size());
        let mut dx = m.rates(own, &torques);
        let heat = m.appendages::<f64>().dissipation(&own[l.eta_rates()..]);
        dx.push((0..3).map(|i| torques[i] * own[l.rates() + i]).sum());
        dx.push(heat);
        dx
    };
    let mut x = [start(&m), vec![0.0; 2]].concat();
    let steps = 4000;
    let h = 3.0 / f64::from(steps);
    let moved =
        |x: &[f64], s: f64, k: &[f64]| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + s * k).collect() };
    for step in 0..steps {
        let t = f64::from(step) * h;
        let k1 = rates(t, &x);
        let k2 = rates(t + 0.5 * h, &moved(&x, 0.5 * h, &k1));
        let k3 = rates(t + 0.5 * h, &moved(&x, 0.5 * h, &k2));
        let k4 = rates(t + h, &moved(&x, h, &k3));
        for i in 0..x.len() {
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    let (momenta, energy, _) = m.books(&x[..l.size()]);
    let drift = momenta.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
    let balance = energy - x[l.size()] + x[l.size() + 1];
    let mut found = x[..18].to_vec();
    // Bending y of the panel at -y is along (-1, 0, 0) here.
    found[16] = -found[16];
    let off = worst(&found, fact("B48"));
    println!("B48: off by {off:.1e}; B49: momenta {drift:.1e}, energy {balance:.1e} of {energy:.2} J");
    assert!(off < 1e-7 && drift < 1e-8 && balance.abs() < 1e-8, "{off:e} {found:?}");
}
