//! Properties of the gripper at any instant, and of bodies.

use super::run::{TIGHT, place, run};
use trueup_models::contact::layout::{BodyOutputs, BodyParameters, Outputs, Parameters, Poses};
use trueup_models::contact::{FreeBody, GripperContact, GripperStructure};
use trueup_numerics::hybrid::{At, Hybrid};

/// Numbers between -1 and 1 without a pattern.
struct Numbers(u64);
impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Forces on hand and target are one wrench and its opposite about any point, with friction too.
#[test]
fn action_is_reaction_about_any_point() {
    let s = GripperStructure::default();
    let g = GripperContact::new(s).unwrap();
    let (n, mut p) = (g.sizes(), g.defaults());
    p[place(&Parameters::list(&s), "frictionCoefficient")] = 0.4;
    let (mut r, mut met, mut worst) = (Numbers(7), 0, 0.0f64);
    let poses = Poses::list(&s);
    let outputs = Outputs::list(&s);
    for _ in 0..2000 {
        let mut u = vec![0.0; n.inputs];
        let mut put = |name: &str, values: &[f64]| super::run::set(&poses, &mut u, name, values);
        let hand = [r.next(), r.next()];
        let attitude = r.next();
        let (c, s) = (attitude.cos(), attitude.sin());
        let (a, b) = (0.15 + 0.08 * r.next(), 0.1 * r.next());
        let port = [hand[0] + c * a - s * b, hand[1] + s * a + c * b];
        put("hostPosition", &hand);
        put("hostAttitude", &[attitude]);
        put("hostVelocity", &[r.next(), r.next()]);
        put("hostRate", &[r.next()]);
        put("portPosition", &port);
        put("portAttitude", &[r.next()]);
        put("portVelocity", &[r.next(), r.next()]);
        put("portRate", &[r.next()]);
        let (mut x, mut modes, mut y) = (vec![0.0; n.states], vec![0; n.modes], vec![0.0; n.outputs]);
        x[0] = 0.5 + 0.5 * r.next();
        g.start_modes(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes.clone() }, &mut modes);
        g.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes }, &mut y);
        let out = |name: &str| place(&outputs, name);
        let (h, t) = (out("hostForce"), out("portForce"));
        let size = (y[t].hypot(y[t + 1])).max(1.0);
        met += usize::from(y[t] != 0.0);
        let about = |force: usize, torque: usize, point: [f64; 2]| {
            y[torque] + point[0] * y[force + 1] - point[1] * y[force]
        };
        let sum = [
            y[h] + y[t],
            y[h + 1] + y[t + 1],
            about(h, out("hostTorque"), hand) + about(t, out("portTorque"), port),
        ];
        worst = sum.iter().fold(worst, |w, v| w.max(v.abs() / size));
    }
    println!("{met} of 2000 touch; wrenches add up to {worst:.1e}");
    assert!(met > 500 && worst < 1e-14);
}

/// Checks CON-9: a body under a steady force at a docking point off its centre, against an integral by hand for small angles,
/// and its outputs.
#[test]
fn a_body_floats() {
    let body = FreeBody::new(2).unwrap();
    let (n, mut p) = (body.sizes(), body.defaults());
    let at = |name: &str| place(&BodyParameters::list(&2), name);
    p[at("mass")] = 2.0;
    p[at("inertia")] = 0.5;
    p[at("initialPosition")..at("initialPosition") + 2].copy_from_slice(&[1.0, -1.0]);
    p[at("portPosition")..at("portPosition") + 4].copy_from_slice(&[0.0, 0.0, 0.3, 0.0]);
    // A torque alone turns it, a force at the centre moves it: both are steady.
    let u = [4.0, 0.0, 0.0, 0.0, 0.0, 0.25];
    let all = run(&body, &p, &u, &[2.0], &vec![1e-3; n.states], TIGHT);
    let y = all.end();
    let out = |name: &str| place(&BodyOutputs::list(&2), name);
    assert!((y[out("position")] - 5.0).abs() < 1e-12 && (y[out("velocity")] - 4.0).abs() < 1e-12);
    assert!((y[out("attitude")] - 1.0).abs() < 1e-12 && (y[out("rate")] - 1.0).abs() < 1e-12);
    let tip = out("portPoint") + 2;
    assert!(
        (y[tip] - 5.0 - 0.3 * 1.0f64.cos()).abs() < 1e-12
            && (y[tip + 1] + 1.0 - 0.3 * 1.0f64.sin()).abs() < 1e-12
    );
    assert!((y[out("kineticEnergy")] - 16.25).abs() < 1e-11);
    assert!((y[out("angularMomentum")] - (0.5 + 8.0)).abs() < 1e-11);
    // The same force at the other docking point turns it, by its lever.
    let (mut dx, mut x) = (vec![0.0; n.states], vec![0.0; n.states]);
    body.start(&p, &mut x);
    body.rates(At { t: 0.0, x: &x, u: &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0], p: &p, modes: &[] }, &mut dx);
    assert!((dx[4] - 2.0).abs() < 1e-15 && (dx[5] - 2.4).abs() < 1e-15, "{dx:?}");
}
