//! What SSP has no words for, in annotations of our own: steps, tolerance, algorithm, what is recorded, inputs.

use std::path::PathBuf;

use super::xml::SspNode;
use crate::mistake::InputMistake;
use crate::system::{Algorithm, RecordedVariable, SourceSpan};

/// Type of the annotations.
pub(super) const TYPE: &str = "trueup";
/// Their namespace.
pub(super) const NAMESPACE: &str = "urn:trueup:system:1";

/// Annotations of the description as a whole.
#[derive(Default)]
pub(super) struct OwnAnnotation {
    pub(super) step: Option<f64>,
    pub(super) tolerance: Option<f64>,
    pub(super) algorithm: Option<Algorithm>,
    pub(super) event_rows: Option<bool>,
    pub(super) record: Vec<RecordedVariable>,
    pub(super) inputs: Option<InputAnnotation>,
}

/// A table that drives inputs.
pub(super) struct InputAnnotation {
    pub(super) file: PathBuf,
    /// Column and `component.variable`.
    pub(super) columns: Vec<(String, String)>,
    pub(super) place: SourceSpan,
}

/// Our annotation of an element.
fn own<'d>(node: SspNode<'d>) -> impl Iterator<Item = SspNode<'d>> {
    let annotations = node.list("Annotations");
    annotations
        .filter(|a| a.name() == "Annotation" && a.attribute("type") == Some(TYPE))
        .flat_map(SspNode::children)
}

/// Communication step of a component.
pub(super) fn step(component: SspNode) -> Result<Option<f64>, InputMistake> {
    own(component).find(|n| n.name() == "Component").map_or(Ok(None), |n| n.number("step"))
}

pub(super) fn read(
    root: SspNode,
    mut locate: impl FnMut(&str) -> Result<PathBuf, String>,
) -> Result<OwnAnnotation, InputMistake> {
    let mut own_words = OwnAnnotation::default();
    for node in own(root) {
        match node.name() {
            "Run" => {
                own_words.step = node.number("step")?;
                own_words.tolerance = node.number("tolerance")?;
                let algorithm = node.attribute("algorithm").map(str::parse).transpose();
                own_words.algorithm = algorithm.map_err(|why: String| node.wrong(why))?;
                let said = node.attribute("eventRows").is_some();
                own_words.event_rows = said.then(|| node.flag("eventRows")).transpose()?;
            }
            "Record" => own_words.record.push(RecordedVariable {
                name: node.required("variable")?.to_owned(),
                column: node.attribute("as").map(str::to_owned),
                every: node.value("every")?.unwrap_or(0),
                place: node.place(),
            }),
            "Inputs" => {
                let file = locate(node.required("file")?).map_err(|why| node.wrong(why))?;
                let columns = node.children().filter(|n| n.name() == "Column");
                let columns = columns.map(|n| Ok((n.required("name")?.into(), n.required("to")?.into())));
                let columns = columns.collect::<Result<_, InputMistake>>()?;
                own_words.inputs = Some(InputAnnotation { file, columns, place: node.place() });
            }
            _ => {}
        }
    }
    Ok(own_words)
}
