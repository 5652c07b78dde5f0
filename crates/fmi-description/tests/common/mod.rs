//! A small model with everything that a table can hold: arrays, an enumeration, a Boolean, a constant, event
//! indicators, every kind of dependency.
#![allow(dead_code, unreachable_pub, missing_docs)]

use trueup_fmi::table::*;

pub fn table() -> ModelTable {
    use Causality::*;
    use Storage as S;
    use Variability::*;
    let v = TableVariable::new;
    let mut table = ModelTable {
        name: "Sample".to_owned(),
        title: None,
        description: "Two masses & a <spring>".to_owned(),
        variables: vec![
            v("time", Independent, Continuous, S::Time, "s", "time"),
            v("force", Input, Continuous, S::Input(0), "N", "F").array(&[2]).start(&[0.0, 1.5]),
            v("enable", Input, Discrete, S::Input(2), "", "on").kind(BoundaryType::Boolean).start(&[1.0]),
            v("position", Output, Continuous, S::Output(0), "m", "x").array(&[2]).on(&["x"]),
            v("acceleration", Output, Continuous, S::Output(2), "m/s2", "a")
                .array(&[2])
                .on_states_and(&["force"]),
            v("angle", Output, Continuous, S::Output(4), "rad", "q").on(&[]),
            v("touching", Output, Discrete, S::Output(5), "", "contact").kind(BoundaryType::Boolean),
            v("mass", Parameter, Fixed, S::Parameter(0), "kg", "m")
                .array(&[2])
                .start(&[1.0, 2e-7])
                .above(0.0)
                .nominal(1.0),
            v("offset", Parameter, Tunable, S::Parameter(2), "m", "c")
                .array(&[2, 2])
                .start(&[1.0, 2.0, 3.0, 4.0]),
            v("initialOffset", Parameter, Fixed, S::Parameter(6), "m", "c0").start(&[0.0]).follows("offset"),
            v("law", Parameter, Fixed, S::Parameter(7), "", "law")
                .kind(BoundaryType::Enumeration(0))
                .start(&[2.0]),
            v("count", Local, Constant, S::Constant, "", "n").kind(BoundaryType::Integer).start(&[2.0]),
            v("x", Local, Continuous, S::State(0), "m", "x").array(&[2]).nominal(0.1),
            v("w", Local, Continuous, S::State(2), "m/s", "w").array(&[2]),
            v("der(w)", Local, Continuous, S::Rate(2), "m/s2", "dw").array(&[2]).derivative_of("w"),
            TableVariable {
                depends: Depends::linear(&[("w", LinearFactor::Fixed), ("force", LinearFactor::Tunable)]),
                ..v("der(x)", Local, Continuous, S::Rate(0), "m/s", "dx").array(&[2]).derivative_of("x")
            },
        ],
        enumerations: vec![Enumeration {
            name: "Law",
            description: "which law",
            items: vec![("soft", "a < b"), ("hard", "")],
        }],
        terminals: vec![Terminal {
            name: "drive".to_owned(),
            description: "motor side".to_owned(),
            members: vec![("force".to_owned(), "force".to_owned())],
        }],
        indicators: 2,
        experiment: TableExperiment { stop_time: 2.0, tolerance: 1e-6, step_size: 0.01 },
    };
    table.number();
    table
}
