//! What model descriptions say of dependencies, held to exact derivatives of every model with every effect at random states:
//! what is not listed has no influence, and a factor that is `constant`, `fixed` or `tunable` is.

use std::collections::{BTreeMap, BTreeSet};

use crate::model_description::{configurations, written};
use fmu_library::AnyModel;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, ModelTable, Storage, Variability};
use trueup_fmi_description::description::{Description, StructureUnknown};
use trueup_fmi_description::{FmiVersion, read};
use trueup_fmi_export::FmuModel;
use trueup_numerics::Dual;
use trueup_numerics::hybrid::{At, Hybrid};

/// Random numbers between -1 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Values of parameters near those of `from`, as far as the model allows them; only those that `moves` picks differ.
fn parameters(
    model: &AnyModel,
    table: &ModelTable,
    from: &[f64],
    moves: impl Fn(Variability) -> bool,
    random: &mut Random,
) -> Vec<f64> {
    let mut p = from.to_vec();
    for v in &table.variables {
        let Storage::Parameter(at) = v.storage else { continue };
        if v.kind != BoundaryType::Real || !moves(v.variability) {
            continue;
        }
        for e in 0..v.len() {
            let old = p[at + e];
            // What is 0 would hide what it scales.
            p[at + e] = match old {
                0.0 => 0.3 * random.next().abs(),
                old => old * (1.0 + 0.3 * random.next()),
            };
            if v.allows(e, p[at + e]).is_err() || model.check(&p).is_err() {
                p[at + e] = old;
            }
        }
    }
    p
}

/// Derivatives of outputs, then rates, by states, then inputs, at a random point; `rest`: as the run begins.
fn jacobian(
    model: &AnyModel,
    table: &ModelTable,
    p: &[f64],
    rest: bool,
    random: &mut Random,
) -> Vec<Vec<f64>> {
    let sizes = model.sizes();
    let (mut x, mut u) = (vec![0.0; sizes.states], table.input_starts());
    model.start(p, &mut x);
    let t = if rest { 0.0 } else { random.next().abs() };
    if !rest {
        for v in &table.variables {
            if let Storage::State(at) = v.storage {
                let size = 3.0 * v.nominal.unwrap_or(1.0);
                x[at..at + v.len()].iter_mut().for_each(|x| *x += size * random.next());
            }
        }
        u.iter_mut().for_each(|u| *u += random.next());
    }
    let mut modes = vec![0; sizes.modes];
    let before = modes.clone();
    model.start_modes(At { t, x: &x, u: &u, p, modes: &before }, &mut modes);
    for _ in 0..20 {
        if model.update(t, &mut x, &u, p, &mut modes).settled() {
            break;
        }
    }
    let constant = |values: &[f64]| values.iter().map(|v| Dual::<1>::new(*v, [0.0])).collect::<Vec<_>>();
    let (mut x, mut u, p) = (constant(&x), constant(&u), constant(p));
    let mut columns = Vec::new();
    for known in 0..sizes.states + sizes.inputs {
        let seed = |x: &mut [Dual<1>], u: &mut [Dual<1>], value| match known.checked_sub(x.len()) {
            None => x[known].eps = [value],
            Some(input) => u[input].eps = [value],
        };
        seed(&mut x, &mut u, 1.0);
        let at = At { t: Dual::new(t, [0.0]), x: &x, u: &u, p: &p, modes: &modes };
        let (mut y, mut dx) = (constant(&vec![0.0; sizes.outputs]), constant(&vec![0.0; sizes.states]));
        model.outputs(at, &mut y);
        model.rates(at, &mut dx);
        columns.push(y.iter().chain(&dx).map(|d| d.eps[0]).collect());
        seed(&mut x, &mut u, 0.0);
    }
    columns
}

/// Where scalars are in a column (unknowns) and which column is theirs (knowns), by name.
fn places(model: &AnyModel, table: &ModelTable) -> BTreeMap<String, usize> {
    let sizes = model.sizes();
    let place = |storage| match storage {
        Storage::Output(i) | Storage::State(i) => Some(i),
        Storage::Rate(i) => Some(sizes.outputs + i),
        Storage::Input(i) => Some(sizes.states + i),
        Storage::Time | Storage::Parameter(_) | Storage::Constant => None,
    };
    let elements = |v: &trueup_fmi::table::TableVariable| {
        let at = place(v.storage)?;
        Some((0..v.len()).map(|e| (v.element_name(e), at + e)).collect::<Vec<_>>())
    };
    table.variables.iter().filter_map(elements).flatten().collect()
}

fn unknowns(d: &Description) -> impl Iterator<Item = &StructureUnknown> {
    d.structure.outputs.iter().chain(&d.structure.derivatives)
}
fn name(d: &Description, reference: u32) -> &str {
    &d.variables[d.resolve(reference).expect("it leads to a variable")].name
}
/// Kinds by what depends and what it depends on.
fn kinds(d: &Description) -> BTreeMap<(&str, &str), &'static str> {
    let of = |u: &StructureUnknown| {
        let given = u.dependencies.clone().unwrap_or_default();
        let kinds = u.kinds.clone().unwrap_or_else(|| vec!["dependent".to_owned(); given.len()]);
        let own = name(d, u.reference);
        given.into_iter().zip(kinds).map(move |(on, kind)| ((own, name(d, on)), kind)).collect::<Vec<_>>()
    };
    let word = |kind: String| -> &'static str {
        let known = ["constant", "fixed", "tunable", "dependent"].into_iter().find(|k| *k == kind);
        known.expect("a kind that the test handles")
    };
    unknowns(d).flat_map(of).map(|(pair, kind)| (pair, word(kind))).collect()
}

/// What of a description (FMI 2.0: by scalars) of that model is not so.
fn wrong(model: &AnyModel, table: &ModelTable, d: &Description) -> Vec<String> {
    let places = places(model, table);
    let mut random = Random(7);
    let start = table.parameter_starts();
    let fixed_held = parameters(model, table, &start, |v| v == Variability::Tunable, &mut random);
    let all_moved = parameters(model, table, &start, |_| true, &mut random);
    // By values of parameters, by point.
    let seen: Vec<Vec<_>> = [&start, &fixed_held, &all_moved]
        .map(|p| (0..4).map(|k| jacobian(model, table, p, k == 0, &mut random)).collect())
        .into();
    let kinds = kinds(d);
    let knowns: Vec<&String> = table
        .variables
        .iter()
        .filter(|v| matches!(v.storage, Storage::State(_) | Storage::Input(_)))
        .flat_map(|v| (0..v.len()).map(|e| v.element_name(e)))
        .map(|n| places.get_key_value(&n).expect("all are there").0)
        .collect();
    let mut wrong = Vec::new();
    for u in unknowns(d).filter(|u| u.dependencies.is_some()) {
        let own = name(d, u.reference);
        let row = seen.iter().flatten().flatten().map(|column| column[places[own]].abs());
        // Of a velocity that is turned into other axes and back rounding is left.
        let rounding = 1e-15 * row.fold(0.0, f64::max);
        for known in &knowns {
            let factors: Vec<Vec<f64>> =
                seen.iter().map(|at| at.iter().map(|j| j[places[*known]][places[own]]).collect()).collect();
            let same = |values: &mut dyn Iterator<Item = f64>| {
                let values: Vec<f64> = values.collect();
                values.iter().all(|v| (v - values[0]).abs() <= 1e-12 * values[0].abs())
            };
            let held = |given: &[Vec<f64>]| same(&mut given.iter().flatten().copied());
            let each = factors.iter().all(|f| same(&mut f.iter().copied()));
            let kind = kinds.get(&(own, known.as_str())).copied();
            let holds = match kind {
                None => factors.iter().flatten().all(|f| f.abs() <= rounding),
                Some("constant") => held(&factors),
                Some("fixed") => held(&factors[..2]) && each,
                Some("tunable") => each,
                Some(_) => true,
            };
            if !holds {
                wrong.push(format!("{own} by {known}: {}, but {factors:?}", kind.unwrap_or("independent")));
            }
        }
    }
    wrong
}

fn of(c: &Configuration) -> (AnyModel, ModelTable, String) {
    let table = fmu_library::table(c).expect("a configuration that can be had");
    (AnyModel::build(c).expect("a model that can be had"), table, written(c, FmiVersion::V2))
}

#[test]
fn what_is_said_of_dependencies_holds() {
    // Every model, every sixteenth of those with an effect.
    holds_for(
        configurations()
            .into_iter()
            .enumerate()
            .filter(|(k, c)| k % 16 == 0 || c.effects.is_empty())
            .map(|(_, c)| c),
    );
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn what_is_said_of_dependencies_holds_for_every_model_with_every_effect() {
    holds_for(configurations());
}

fn holds_for(configurations: impl IntoIterator<Item = Configuration>) {
    let mut said = BTreeMap::<(String, &str), usize>::new();
    let mut mistakes = Vec::new();
    for c in configurations {
        let (model, table, xml) = of(&c);
        let d = read::read(xml.as_bytes()).expect("what is written can be read");
        let title = format!("{} {:?} {:?} {:?}", c.model, c.effects, c.joint_flexible, c.structure);
        mistakes.extend(wrong(&model, &table, &d).into_iter().map(|w| format!("{title}: {w}")));
        for kind in kinds(&d).into_values() {
            *said.entry((c.model.clone(), kind)).or_default() += 1;
        }
        // FMI 3.0 defines the same for arrays.
        let third = written(&c, FmiVersion::V3);
        let third = read::read(third.as_bytes()).expect("what is written can be read");
        let base = |name: &str| name.replace(')', "").split('[').next().unwrap_or_default().to_owned();
        let of_arrays = |d: &Description| {
            let pairs = kinds(d).into_iter().map(|((own, on), kind)| (base(own), base(on), kind));
            pairs.collect::<BTreeSet<_>>()
        };
        assert_eq!(of_arrays(&d), of_arrays(&third), "{title}");
    }
    assert!(mistakes.is_empty(), "{} are not so:\n{}", mistakes.len(), mistakes.join("\n"));
    println!("{said:#?}");
    let times = |model: &str, kind| said.get(&(model.to_owned(), kind)).copied().unwrap_or(0);
    for model in ["PlanarManipulator", "SpatialFreeFlyer", "FlexibleArm", "FreeBody", "CaptureScene"] {
        assert!(times(model, "constant") > 4, "{model}");
    }
    for kind in ["constant", "fixed", "tunable"] {
        assert!(times("TwoMassJoint", kind) > 1, "{kind}");
    }
}

#[test]
fn what_is_not_so_is_found() {
    let (model, table, xml) = of(&Configuration::of("FreeBody"));
    let index = |name: &str| {
        let d = read::read(xml.as_bytes()).expect("what is written can be read");
        d.variables.iter().position(|v| v.name == name).expect("it is there") + 1
    };
    let energy = format!("<Unknown index=\"{}\" dependencies", index("kineticEnergy"));
    assert!(xml.contains(&energy));
    let velocity = index("state.velocity[1]");
    let claims = |kind: &str| {
        format!(
            "<Unknown index=\"{}\" dependencies=\"{velocity}\" dependenciesKind=\"{kind}\"/>",
            index("kineticEnergy")
        )
    };
    let at = xml.find(&energy).expect("it is there");
    let end = at + xml[at..].find("/>").expect("it ends") + 2;
    for kind in ["constant", "fixed", "tunable", "dependent"] {
        let told = format!("{}{}{}", &xml[..at], claims(kind), &xml[end..]);
        let d = read::read(told.as_bytes()).expect("it can be read");
        let wrong = wrong(&model, &table, &d);
        let about = |known: &str| wrong.iter().any(|w| w.starts_with(&format!("kineticEnergy by {known}:")));
        assert_eq!(about("state.velocity[1]"), kind != "dependent", "{wrong:?}");
        assert!(about("state.velocity[2]"), "{wrong:?}");
    }
}
