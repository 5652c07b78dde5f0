//! A system whose every name has been found in its FMUs and whose every value fits: numbers instead of names.

use std::sync::Arc;

use trueup_fmi_description::description::Description;
use trueup_fmi_import::UnpackedFmu;

use crate::buffer::VariableBlock;
use crate::grid::CommunicationGrid;
use crate::inputs::InputFileTable;
use crate::system::{Algorithm, ComponentInterface};

/// What the master runs.
pub struct MasterPlan {
    /// The components in their order.
    pub components: Vec<PlannedComponent>,
    /// Connections, element by element.
    pub links: Vec<LinearLink>,
    /// Inputs from a file, element by element.
    pub driven: Vec<DrivenInput>,
    /// That file.
    pub inputs: Option<InputFileTable>,
    /// What is recorded, element by element, in the order of the table's columns.
    pub recorded: Vec<RecordedElement>,
    /// Communication points.
    pub grid: CommunicationGrid,
    /// Relative tolerance; `None`: each FMU's own.
    pub tolerance: Option<f64>,
    /// `None`: the master chooses.
    pub algorithm: Option<Algorithm>,
    /// Rows at both sides of events between communication points; `None`: if all is one unit.
    pub event_rows: Option<bool>,
    /// Tables of [`LinearLink::map`]: value of the output, value of the input; what is not listed stays as it is.
    pub maps: Vec<Vec<(i64, i64)>>,
    /// What was chosen or converted on the way, to be reported to the user.
    pub notes: Vec<String>,
}

/// A component ready to be instantiated.
pub struct PlannedComponent {
    /// Its name, also that of the instance; empty if it is the only one and its variables go without a component.
    pub name: String,
    /// The FMU.
    pub fmu: Arc<UnpackedFmu>,
    /// How it is run.
    pub interface: ComponentInterface,
    /// Structural parameters (FMI 3.0), set in configuration mode before all others.
    pub structural: Vec<VariableBlock>,
    /// The FMU's description with those values, where they change the size of arrays.
    pub resized: Option<Arc<Description>>,
    /// Start values, set before initialization.
    pub start: Vec<VariableBlock>,
    /// Steps of the grid that it takes at once.
    pub every: u32,
}

impl PlannedComponent {
    /// The description with arrays as they are sized in this system.
    pub fn description(&self) -> &Description {
        self.resized.as_deref().unwrap_or_else(|| self.fmu.description())
    }
}

/// One element of one variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ElementIndex {
    /// Index of the component.
    pub component: usize,
    /// Index of the variable in its description.
    pub variable: usize,
    /// Index of the element, row-major from 0.
    pub element: usize,
}

/// `to = factor * from + offset`, units already converted; of what is not a number a plain copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearLink {
    /// Output.
    pub from: ElementIndex,
    /// Input.
    pub to: ElementIndex,
    /// Factor; 1 for a plain copy.
    pub factor: f64,
    /// Offset; 0 for a plain copy.
    pub offset: f64,
    /// Index in [`MasterPlan::maps`]: integers, items of an enumeration (their numbers) and Booleans (0, 1) are replaced.
    pub map: Option<usize>,
}

/// An input that a column of the inputs' file drives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenInput {
    /// Input.
    pub to: ElementIndex,
    /// Column of the file.
    pub column: usize,
    /// On the line between samples, else held.
    pub linear: bool,
}

/// An element to record.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedElement {
    /// What.
    pub from: ElementIndex,
    /// Name of its column.
    pub name: String,
    /// Every this many communication points (at least 1).
    pub every: u32,
}
