//! Arms that books know: cantilevers, chains of them, a beam with a mass at its tip.

use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, Flexure, RobotDesign};
use trueup_models::space::tree::JointType;
use trueup_numerics::hybrid::{At, Hybrid};

pub(crate) const LENGTHS: [f64; 2] = [0.6, 0.5];
pub(crate) const MODULUS: f64 = 70e9;
pub(crate) const MOMENT: f64 = 2e-8;
pub(crate) const MASS: f64 = 0.8;
const SPRING: f64 = 5000.0;

/// One or two links along x, joints about z (the first about z, too), a point of this mass at the tip.
pub(crate) fn chain(links: usize, shapes: Shapes, tip_mass: f64) -> RobotDesign {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let body = |k: usize, mass: f64| {
        let moment = mass * 1e-8;
        DesignLink {
            name: format!("body {}", k + 1),
            parent: k,
            joint: JointType::Revolute,
            mass,
            center_of_mass: [0.0; 3],
            inertia: [[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]],
            position: [if k == 0 { 0.0 } else { LENGTHS[k - 1] }, 0.0, 0.0],
            orientation: [1.0, 0.0, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            motor: DesignMotor {
                flexible: true,
                inertia: 1e-6,
                gear_ratio: 100.0,
                stiffness: SPRING,
                damping: 0.0,
            },
        }
    };
    let mut bodies: Vec<DesignLink> = (0..links).map(|k| body(k, 1e-6)).collect();
    // The hand: a joint that is as good as stiff.
    bodies.push(body(links, tip_mass));
    bodies[links].motor.stiffness = 1e9;
    let link = |k: usize| Flexure {
        body: k + 1,
        shapes,
        position: [0.0; 3],
        // Its x along the body's y.
        orientation: [0.5, half * half * 2.0 * 0.5, 0.5, 0.5],
        length: LENGTHS[k],
        mass_per_length: MASS,
        youngs_modulus: MODULUS,
        area_moment: [MOMENT; 2],
        poisson_ratio: 0.3,
        torsion_constant: 2.0 * MOMENT,
        polar_inertia_per_length: 1e-4,
        damping_ratio: 0.0,
    };
    let base = trueup_models::flexible_arm::presets::delian();
    RobotDesign {
        name: "chain".into(),
        tips: vec![DesignTip { name: "tip".into(), body: links + 1, offset: [0.0; 3], mount: [0.0; 3] }],
        flexures: (0..links).map(link).collect(),
        links: bodies,
        ..base
    }
}

pub(crate) fn arm_of(design: &RobotDesign) -> (FlexibleArm, Vec<f64>) {
    let arm =
        FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: false }).unwrap();
    let mut p = arm.defaults();
    let of_bodies = design.parameters();
    p[..of_bodies.len()].copy_from_slice(&of_bodies);
    arm.check(&p).unwrap();
    (arm, p)
}

/// Of this output, element by element, at rest.
pub(crate) fn output(arm: &FlexibleArm, p: &[f64], x: &[f64], name: &str) -> Vec<f64> {
    let modes = vec![0; arm.joints()];
    let mut y = vec![0.0; arm.sizes().outputs];
    arm.outputs(At { t: 0.0, x, u: &vec![0.0; arm.sizes().inputs], p, modes: &modes }, &mut y);
    let mut from = 0;
    for e in trueup_models::flexible_arm::layout::outputs(arm.structure()) {
        if e.name == name {
            return y[from..from + e.len()].to_vec();
        }
        from += e.len();
    }
    panic!("{name}")
}

const FORCE: f64 = 1e-3;

/// Checks LNK-5, LNK-7: d = F L^3 / (3 E J) (S3 eq. 9) and what the joint adds.
#[test]
fn lnk5_a_cantilever_bends_as_eq_9_has_it() {
    for n in 1..=5 {
        let design = chain(1, Shapes { x: n, y: n, torsion: 1 }, 0.1);
        let (arm, p) = arm_of(&design);
        let rest = equilibrium(&arm, &p, &[0.0; 2], [0.0, FORCE, 0.0]).unwrap();
        let found = output(&arm, &p, &rest.state, "tipDeflection")[1];
        let l = LENGTHS[0];
        let exact = FORCE * l.powi(3) / (3.0 * MODULUS * MOMENT) + FORCE * l * l / SPRING;
        println!("{n} shapes: off by {:.1e}", found / exact - 1.0);
        assert!((found / exact - 1.0).abs() < 1e-6);
    }
}

/// Checks LNK-1, LNK-3, LNK-5: joints and links of a chain add up (S3 5.1), the second where the end of the first has it.
#[test]
fn lnk5_a_chain_bends_by_the_sum_of_its_elements() {
    let [a, b] = LENGTHS;
    let stiffness = MODULUS * MOMENT;
    for fold in [0.0, 0.7, -2.1] {
        let design = chain(2, Shapes { x: 2, y: 2, torsion: 1 }, 0.1);
        let (arm, p) = arm_of(&design);
        // Across the second link, and along it.
        let (sin, cos) = f64::sin_cos(fold);
        for along in [[-sin, cos], [cos, sin]] {
            let force = along.map(|c| FORCE * c);
            let rest = equilibrium(&arm, &p, &[0.0, fold, 0.0], [force[0], force[1], 0.0]).unwrap();
            let found = output(&arm, &p, &rest.state, "tipDeflection");
            // By unit loads: moments at the joints and along the links, times what each bends.
            let arm_1 = [-b * sin, a + b * cos];
            let moment = |arm: [f64; 2], f: [f64; 2]| arm[0] * f[0] + arm[1] * f[1];
            let arm_2 = [-b * sin, b * cos];
            let unit = |k: usize| [f64::from(u8::from(k == 0)), f64::from(u8::from(k == 1))];
            for (k, found) in found.iter().take(2).enumerate() {
                let u = unit(k);
                let joints = moment(arm_1, force) * moment(arm_1, u) / SPRING
                    + moment(arm_2, force) * moment(arm_2, u) / SPRING;
                // Along link 1 the moment falls from that at its root to that at its end; along link 2 to 0.
                let product = |m: [f64; 2], n: [f64; 2], l: f64| {
                    l / 6.0 * (2.0 * m[0] * n[0] + m[0] * n[1] + m[1] * n[0] + 2.0 * m[1] * n[1])
                };
                let first = product(
                    [moment(arm_1, force), moment(arm_2, force)],
                    [moment(arm_1, u), moment(arm_2, u)],
                    a,
                );
                let second = product([moment(arm_2, force), 0.0], [moment(arm_2, u), 0.0], b);
                let exact = joints + (first + second) / stiffness;
                let size = FORCE * (a + b).powi(3) / (3.0 * stiffness);
                assert!((found - exact).abs() < 1e-6 * size, "{fold} {k}: {found:e} {exact:e}");
            }
        }
    }
}

/// Checks LNK-5: 1 + cos b cosh b + mu b (cos b sinh b - sin b cosh b) = 0, mu being the tip's mass over the beam's.
#[test]
fn lnk5_a_beam_with_a_mass_at_its_tip_swings_as_it_must() {
    for mu in [0.02_f64, 0.2, 1.0, 5.0] {
        let beam_mass = MASS * LENGTHS[0];
        let mut design = chain(1, Shapes { x: 5, y: 0, torsion: 0 }, mu * beam_mass);
        design.links[0].motor.stiffness = 1e12;
        design.links[1].motor.stiffness = 1e6;
        let (arm, p) = arm_of(&design);
        let rest = equilibrium(&arm, &p, &[0.0; 2], [0.0; 3]).unwrap();
        let found = rest.frequencies().unwrap();
        let scale = (MODULUS * MOMENT / MASS).sqrt() / LENGTHS[0].powi(2);
        let f = |b: f64| 1.0 / b.cosh() + b.cos() + mu * b * (b.cos() * b.tanh() - b.sin());
        let mut roots = Vec::new();
        let mut b: f64 = 0.1;
        while roots.len() < 3 {
            if f(b) * f(b + 0.01) < 0.0 {
                let (mut low, mut high) = (b, b + 0.01);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if f(low) * f(middle) <= 0.0 { high = middle } else { low = middle }
                }
                roots.push(low);
            }
            b += 0.01;
        }
        let off: Vec<f64> =
            roots.iter().zip(&found).map(|(root, f)| f / (root * root * scale) - 1.0).collect();
        println!("mu {mu}: {:.1e} {:.1e} {:.1e}", off[0], off[1], off[2]);
        assert!(off[0].abs() < 1e-6 && off[1].abs() < 1e-4 && off[2].abs() < 3e-2, "{off:?}");
    }
}
