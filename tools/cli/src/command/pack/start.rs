//! `--set NAME=VALUE`

use trueup_fmi::table::{BoundaryType, Causality, ModelTable, TableVariable, Variability};
use trueup_signals::did_you_mean;

/// Sets the start value of an element; the last one counts.
pub(crate) fn assign(start: &mut Vec<(String, f64)>, name: &str, value: f64) {
    match start.iter_mut().find(|(n, _)| n == name) {
        Some(slot) => slot.1 = value,
        None => start.push((name.to_owned(), value)),
    }
}

/// Element names and values of `name=value`, `name[i]=value` or `name=value,value,..`.
pub(crate) fn parse(table: &ModelTable, set: &str) -> Result<Vec<(String, f64)>, String> {
    let (name, values) = set.split_once('=').ok_or_else(|| format!("--set {set}: write it as name=value"))?;
    let (name, values) = (name.trim(), values.split(',').map(str::trim));
    let (variable, elements) = find(table, name).ok_or_else(|| {
        let names = table.variables.iter().map(|v| v.name.as_str());
        let mend = did_you_mean(name, names, "pack the model and look with `trueup fmu info`");
        format!("--set {set}: there is no variable `{name}`; {mend}")
    })?;
    let settable = matches!(variable.causality, Causality::Parameter | Causality::Input)
        && variable.variability != Variability::Constant;
    if !settable {
        return Err(format!(
            "--set {set}: `{name}` is calculated; only parameters and inputs have start values"
        ));
    }
    let values: Vec<f64> = values.map(|v| number(table, variable, v)).collect::<Result<_, _>>()?;
    if values.len() != elements.len() {
        let (given, wanted) = (values.len(), elements.len());
        return Err(format!(
            "--set {set}: `{name}` has {wanted} elements and {given} are given; give all, or one as `{}=..`",
            variable.element_name(0)
        ));
    }
    for (e, v) in elements.iter().zip(&values) {
        variable.allows(*e, *v)?;
    }
    Ok(elements.into_iter().map(|e| variable.element_name(e)).zip(values).collect())
}

fn find<'a>(table: &'a ModelTable, name: &str) -> Option<(&'a TableVariable, Vec<usize>)> {
    table.variables.iter().find_map(|v| {
        if v.name == name {
            return Some((v, (0..v.len()).collect()));
        }
        (0..v.len()).find(|e| v.element_name(*e) == name).map(|e| (v, vec![e]))
    })
}

/// The number that a text gives.
fn number(table: &ModelTable, v: &TableVariable, text: &str) -> Result<f64, String> {
    let real = || text.parse::<f64>().ok().filter(|x| x.is_finite());
    let whole = || real().filter(|x| x.fract() == 0.0);
    let (value, wanted) = match v.kind {
        BoundaryType::Real => (real(), "a number".to_owned()),
        BoundaryType::Integer => (whole(), "a whole number".to_owned()),
        BoundaryType::Boolean => (text.parse::<bool>().ok().map(f64::from), "true or false".to_owned()),
        BoundaryType::Enumeration(i) => {
            let items = table.enumerations.get(i).map(|e| e.items.as_slice()).unwrap_or_default();
            let names: Vec<&str> = items.iter().map(|(name, _)| *name).collect();
            let position = names.iter().position(|name| *name == text);
            (position.map(|p| (p + 1) as f64), format!("one of {}", names.join(", ")))
        }
    };
    value.ok_or_else(|| format!("`{}` requires {wanted}, not `{text}`", v.name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_fmi::table::{Enumeration, Storage, TableExperiment};

    fn table() -> ModelTable {
        let parameter = |name: &str| {
            TableVariable::new(
                name,
                Causality::Parameter,
                Variability::Fixed,
                Storage::Parameter(0),
                "kg",
                "",
            )
        };
        let law = Enumeration { name: "Law", description: "", items: vec![("soft", ""), ("hard", "")] };
        ModelTable {
            name: "M".to_owned(),
            title: None,
            description: String::new(),
            variables: vec![
                parameter("mass").array(&[2]).start(&[1.0, 1.0]).above(0.0),
                parameter("law").kind(BoundaryType::Enumeration(0)).start(&[1.0]),
                TableVariable::new(
                    "y",
                    Causality::Output,
                    Variability::Continuous,
                    Storage::Output(0),
                    "m",
                    "",
                ),
            ],
            enumerations: vec![law],
            terminals: Vec::new(),
            indicators: 0,
            experiment: TableExperiment { stop_time: 1.0, tolerance: 1e-6, step_size: 0.1 },
        }
    }

    #[test]
    fn elements_arrays_and_items() {
        let t = table();
        assert_eq!(parse(&t, "mass[2]=4"), Ok(vec![("mass[2]".to_owned(), 4.0)]));
        assert_eq!(
            parse(&t, "mass = 4, 3"),
            Ok(vec![("mass[1]".to_owned(), 4.0), ("mass[2]".to_owned(), 3.0)])
        );
        assert_eq!(parse(&t, "law=hard"), Ok(vec![("law".to_owned(), 2.0)]));
    }

    #[test]
    fn what_is_wrong_is_said() {
        let t = table();
        for (set, said) in [
            ("mass", "name=value"),
            ("mas=1", "no variable `mas`; did you mean `mass`?"),
            ("mass[3]=1", "no variable `mass[3]`"),
            ("mass=1", "2 elements and 1 are given"),
            ("mass[1]=0", "above 0 kg"),
            ("mass[1]=nan", "requires a number"),
            ("law=firm", "one of soft, hard"),
            ("y=1", "calculated"),
        ] {
            let message = parse(&t, set).unwrap_err();
            assert!(message.contains(said), "{set}: {message}");
        }
    }

    #[test]
    fn the_last_value_counts() {
        let mut start = Vec::new();
        assign(&mut start, "a", 1.0);
        assign(&mut start, "a", 2.0);
        assert_eq!(start, [("a".to_owned(), 2.0)]);
    }
}
