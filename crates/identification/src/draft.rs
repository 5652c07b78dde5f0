//! A model as a drafted case has it: its variables, and its parameters with the values of the preset.

use trueup_models::plants::{self, PlantStructure};
use trueup_signals::base_name;
use trueup_signals::draft::{DraftModel, DraftParameter};

use crate::model::{ModelError, PlantQuantity, SimulatedPlant};

/// The model of that name; an arm with so many joints, `None`: as many as the preset has.
///
/// # Errors
/// No such model, or a number of joints that it cannot have.
pub fn draft_model(name: &str, joints: Option<usize>) -> Result<DraftModel, ModelError> {
    let usual = plants::usual_flexible(name);
    let mut flexible = usual.to_vec();
    if let Some(n) = joints.filter(|_| usual.len() > 1) {
        flexible.resize(n, false);
    }
    let structure = match flexible == usual {
        true => Vec::new(),
        false => vec![format!(
            "jointFlexible = {flexible:?}   # GUESS: a joint for each drive; which have a spring?"
        )],
    };
    let model = SimulatedPlant::new(PlantStructure {
        model: name.to_owned(),
        flexible,
        ..PlantStructure::default()
    })?;
    Ok(DraftModel {
        name: name.to_owned(),
        guessed: false,
        known: model.variables(),
        parameters: parameters(&model),
        preset: plants::preset(name).to_owned(),
        structure,
    })
}

/// Those that a case gives; first states are estimated in every recording.
fn parameters(model: &SimulatedPlant) -> Vec<DraftParameter> {
    let defaults = model.defaults();
    let mut all: Vec<DraftParameter> = Vec::new();
    let given = |q: &&PlantQuantity| !q.is_initial() && q.items.is_empty();
    let bases: Vec<&str> = model.parameters().iter().filter(given).map(|q| base_name(&q.name)).collect();
    for base in bases {
        if all.iter().any(|p| p.name == base) {
            continue;
        }
        let elements = model.parameters().iter().zip(&defaults).filter(|(q, _)| base_name(&q.name) == base);
        let own: Vec<(&PlantQuantity, f64)> = elements.map(|(q, x)| (q, *x)).collect();
        let unit = own.first().map_or("", |(q, _)| q.unit).to_owned();
        all.push(DraftParameter { name: base.to_owned(), unit, value: value(&own) });
    }
    all
}

/// A number, a list, or of a matrix a list of rows.
fn value(elements: &[(&PlantQuantity, f64)]) -> String {
    let row = |q: &PlantQuantity| {
        let inside = q.name[base_name(&q.name).len()..].trim_matches(['[', ']']).to_owned();
        inside.split_once(',').map(|(row, _)| row.to_owned())
    };
    match elements {
        [(q, x)] if base_name(&q.name) == q.name => format!("{x:?}"),
        [(q, _), ..] if row(q).is_some() => {
            let rows = elements.chunk_by(|a, b| row(a.0) == row(b.0));
            let rows: Vec<String> =
                rows.map(|r| format!("{:?}", r.iter().map(|e| e.1).collect::<Vec<_>>())).collect();
            format!("[{}]", rows.join(", "))
        }
        _ => format!("{:?}", elements.iter().map(|e| e.1).collect::<Vec<_>>()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::unwrap_used, clippy::panic)]
    fn every_model_s_parameters_are_read_as_they_are_written() {
        for (name, joints) in
            [("TwoMassJoint", None), ("PlanarManipulator", None), ("PlanarManipulator", Some(2))]
        {
            let model = draft_model(name, joints).unwrap();
            let given: String =
                model.parameters.iter().map(|p| format!("{} = {}\n", p.name, p.value)).collect();
            let text = format!(
                "model = {name:?}\ntrain = [\"a.csv\"]\n[parameters]\n{}\n{given}",
                model.structure.join("\n")
            );
            let read = trueup_signals::Case::parse(std::path::Path::new("case.toml"), &text, &model.known);
            let (case, findings) = read.unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert!(findings.is_empty(), "{findings:?}");
            assert!(case.parameters.len() >= model.parameters.len());
        }
    }
}
