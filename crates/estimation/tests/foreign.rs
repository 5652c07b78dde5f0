//! A joint that is an FMU of others, from evaluations of its rates, against the equations of the two-mass joint.

use std::sync::Arc;

use trueup_estimation::innovations::foreign::{ForeignJoint, JointRoles};
use trueup_estimation::innovations::plant::{ForcedPlant, StepMeans};
use trueup_estimation::innovations::two_mass::TwoMassPlant;
use trueup_models::joint::input;
use trueup_models::plants::{self, PlantStructure};
use trueup_plant::Plant;
use trueup_signals::{Case, ParameterValue};

fn joint(flexible: bool, effects: &[&str]) -> Arc<dyn Plant> {
    plants::build(&PlantStructure {
        model: "TwoMassJoint".into(),
        flexible: vec![flexible],
        effects: effects.iter().map(|e| (*e).to_owned()).collect(),
        ..PlantStructure::default()
    })
    .unwrap()
}

fn case() -> Case {
    let values = [("loadInertia", 40.0), ("staticFriction", 3.1e-4), ("coulombFriction", 2.2e-4)];
    let parameters = values.map(|(name, x)| (name.to_owned(), ParameterValue::Number(x)));
    let uncertain = [("stiffness".to_owned(), 0.2), ("viscousFriction".to_owned(), 0.3)];
    Case { parameters: parameters.into(), uncertain: uncertain.into(), ..Case::default() }
}

fn foreign(flexible: bool, case: &Case) -> ForeignJoint {
    let plant = joint(flexible, &[]);
    let table = plant.table();
    let value = |name: &str, start: f64| case.number(name).unwrap_or(start);
    let nominal: Vec<f64> = table.parameters.iter().map(|q| value(&q.name, q.start)).collect();
    let ratio = table.parameter("gearRatio");
    let roles = JointRoles {
        drive: input::MOTOR_CURRENT,
        external: Some(input::EXTERNAL_TORQUE),
        gear_ratio: ratio.map_or(1.0, |k| nominal[k]),
        ratio,
    };
    ForeignJoint::new(&plant, &roles, case, nominal, [300.0, 0.02], Vec::new()).unwrap()
}

/// Parameters, tangents sliding and stuck, and forces of parameters, at drawn points. Checks EST-23.
#[test]
fn a_joint_by_its_rates_is_the_joint_by_its_equations() {
    let case = case();
    let mut seed = 0x9e37_79b9_7f4a_u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let (own, other) = (TwoMassPlant::of(&case, 0.02), foreign(true, &case));
    assert_eq!(other.parameters().len(), own.parameters().len());
    let place = |p: &str| other.parameters().iter().position(|q| q.name == p).unwrap();
    let order: Vec<usize> = own.parameters().iter().map(|p| place(p.name)).collect();
    for (p, k) in own.parameters().iter().zip(&order) {
        assert_eq!((p, p.unit), (&other.parameters()[*k], other.parameters()[*k].unit));
    }
    assert_eq!(own.readings(), other.readings());
    let (a, b) = (&own.coordinates()[0], &other.coordinates()[0]);
    assert!((a.breakaway / b.breakaway - 1.0).abs() < 1e-9, "{} {}", a.breakaway, b.breakaway);
    assert!((own.usual_force() / other.usual_force() - 1.0).abs() < 1e-9);
    assert!((own.usual_deflection() / other.usual_deflection() - 1.0).abs() < 1e-9);
    let mut largest = [0.0_f64; 3];
    for _ in 0..20 {
        let theta: Vec<f64> = own.parameters().iter().map(|p| p.value * (1.0 + draw())).collect();
        let mut theirs = vec![0.0; theta.len()];
        order.iter().zip(&theta).for_each(|(k, v)| theirs[*k] = *v);
        for (i, f) in own.input_forces().iter().enumerate() {
            let other = other.input_forces()[i].per_unit(&theirs);
            assert!((f.per_unit(&theta) / other - 1.0).abs() < 1e-9, "{}", f.name);
        }
        for stuck in [[false, false], [true, false]] {
            let (mut a, mut b) = ([vec![0.0; 16], vec![0.0; 8]], [vec![0.0; 16], vec![0.0; 8]]);
            let [f, g] = &mut a;
            own.tangent(&theta, &stuck, f, g);
            let [f, g] = &mut b;
            other.tangent(&theirs, &stuck, f, g);
            for (part, (a, b)) in a.iter().zip(&b).enumerate() {
                let row = |x: &[f64], i: usize| x[i * x.len() / 4..(i + 1) * x.len() / 4].to_vec();
                for i in 0..4 {
                    let (a, b) = (row(a, i), row(b, i));
                    let size = a.iter().fold(1e-300, |m: f64, x| m.max(x.abs()));
                    let apart = a.iter().zip(&b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / size;
                    largest[part] = largest[part].max(apart);
                }
            }
        }
        let state: [f64; 4] = std::array::from_fn(|_| 300.0 * draw());
        let (input, signs) = ([0.02 * draw(), 20.0 * draw()], [2.0 * draw(), 0.0]);
        let forces: [f64; 2] = std::array::from_fn(|_| 1e-4 * draw());
        let at = StepMeans { state: &state, input: &input, sign: &signs, own: &forces };
        let (mut a, mut b) = (vec![0.0; 2 * theta.len()], vec![0.0; 2 * theta.len()]);
        own.sensitivities(&theta, &at, &mut a);
        other.sensitivities(&theirs, &at, &mut b);
        for (k, at) in order.iter().enumerate() {
            let size = a[2 * k].abs().max(a[2 * k + 1].abs());
            let apart = (0..2).map(|c| (a[2 * k + c] - b[2 * at + c]).abs()).fold(0.0, f64::max);
            largest[2] = largest[2].max(apart / size);
        }
    }
    println!("tangent by state, by force, forces of parameters: {largest:?}");
    assert!(largest[0] < 1e-8 && largest[1] < 1e-8 && largest[2] < 1e-6, "{largest:?}");
}

/// What is not linear, or has a state more, is refused with the reason.
#[test]
fn what_is_no_linear_joint_is_refused() {
    let refused = |effect: &str, given: &[(&str, f64)]| {
        let plant = joint(true, &[effect]);
        let table = plant.table();
        let value = |name: &str| given.iter().find(|g| g.0 == name).map(|g| g.1);
        let nominal: Vec<f64> = table.parameters.iter().map(|q| value(&q.name).unwrap_or(q.start)).collect();
        let ratio = table.parameter("gearRatio");
        let roles = JointRoles { drive: 0, external: Some(1), gear_ratio: 1.0, ratio };
        let found = ForeignJoint::new(&plant, &roles, &Case::default(), nominal, [300.0, 0.02], Vec::new());
        found.unwrap_err().to_string()
    };
    assert!(refused("gravity-torque", &[("gravityTorque", 50.0)]).contains("not linear"));
    let lag = refused("actuator-lag", &[]);
    assert!(lag.contains("states; causes"), "{lag}");
}
