//! modelDescription.xml of a block.

use std::fmt::Write as _;

use crate::block::{BlockFmu, BlockVersion};

/// As in `c/block.h`.
const INPUT: usize = 1;
const OUTPUT: usize = 101;
const STATE: usize = 201;
const FAULT: usize = 301;

pub(crate) fn xml(block: &BlockFmu, version: BlockVersion) -> String {
    match version {
        BlockVersion::Two => two(block),
        BlockVersion::Three => three(block),
    }
}

/// The inputs on which output `i` depends directly.
fn inputs_of(block: &BlockFmu, i: usize) -> impl Iterator<Item = usize> + '_ {
    (0..block.inputs.len()).filter(move |j| block.feeds_through(i, *j))
}

fn join(numbers: impl Iterator<Item = usize>) -> String {
    numbers.map(|n| n.to_string()).collect::<Vec<_>>().join(" ")
}

fn two(b: &BlockFmu) -> String {
    let mut variables = String::new();
    let mut real = |name: &str, reference: usize, attributes: &str, start: Option<f64>| {
        let start = start.map_or(String::new(), |x| format!(" start=\"{x:?}\""));
        let _ = writeln!(
            variables,
            "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" {attributes}><Real{start}/></ScalarVariable>"
        );
    };
    real("time", 0, "causality=\"independent\" variability=\"continuous\"", None);
    for (i, name) in b.inputs.iter().enumerate() {
        real(name, INPUT + i, "causality=\"input\"", Some(0.0));
    }
    for (i, name) in b.outputs.iter().enumerate() {
        real(name, OUTPUT + i, "causality=\"output\"", None);
    }
    for (i, (name, start)) in b.states.iter().enumerate() {
        real(name, STATE + i, "causality=\"parameter\" variability=\"fixed\"", Some(*start));
    }
    real("faultTime", FAULT + 1, "causality=\"parameter\" variability=\"fixed\"", Some(0.0));
    let _ = writeln!(
        variables,
        "    <ScalarVariable name=\"fault\" valueReference=\"{FAULT}\" causality=\"parameter\" variability=\"fixed\"><Integer start=\"0\"/></ScalarVariable>"
    );
    // Indices count from 1; the time is the first.
    let unknowns = |states: bool| {
        (0..b.outputs.len()).fold(String::new(), |mut out, i| {
            let starts =
                (0..b.states.len()).filter(|_| states).map(|k| 2 + b.inputs.len() + b.outputs.len() + k);
            let on = join(inputs_of(b, i).map(|j| 2 + j).chain(starts));
            let _ = write!(out, "<Unknown index=\"{}\" dependencies=\"{on}\"/>", 2 + b.inputs.len() + i);
            out
        })
    };
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{token}\" generationTool=\"trueup-testkit\">\n  \
         <CoSimulation modelIdentifier=\"{name}\" canHandleVariableCommunicationStepSize=\"{variable}\" canInterpolateInputs=\"{interpolate}\" maxOutputDerivativeOrder=\"{order}\" canGetAndSetFMUstate=\"{rollback}\" providesDirectionalDerivative=\"{directional}\"/>\n  \
         <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.01\"/>\n  \
         <ModelVariables>\n{variables}  </ModelVariables>\n  \
         <ModelStructure>\n    <Outputs>{outputs}</Outputs>\n    <InitialUnknowns>{initial}</InitialUnknowns>\n  </ModelStructure>\n\
         </fmiModelDescription>\n",
        name = b.name,
        token = b.token(),
        variable = b.variable_step,
        interpolate = b.degree > 0,
        order = u8::from(b.output_derivatives),
        rollback = b.rollback,
        directional = b.directional,
        outputs = unknowns(false),
        initial = unknowns(true),
    )
}

fn three(b: &BlockFmu) -> String {
    let mut variables = String::new();
    let mut float = |name: &str, reference: usize, attributes: &str, start: Option<f64>| {
        let start = start.map_or(String::new(), |x| format!(" start=\"{x:?}\""));
        let _ = writeln!(
            variables,
            "    <Float64 name=\"{name}\" valueReference=\"{reference}\" {attributes}{start}/>"
        );
    };
    let during = if b.degree > 0 { " intermediateUpdate=\"true\"" } else { "" };
    float("time", 0, "causality=\"independent\" variability=\"continuous\"", None);
    for (i, name) in b.inputs.iter().enumerate() {
        float(name, INPUT + i, &format!("causality=\"input\"{during}"), Some(0.0));
    }
    for (i, name) in b.outputs.iter().enumerate() {
        float(name, OUTPUT + i, "causality=\"output\"", None);
    }
    for (i, (name, start)) in b.states.iter().enumerate() {
        float(name, STATE + i, "causality=\"parameter\" variability=\"fixed\"", Some(*start));
    }
    float("faultTime", FAULT + 1, "causality=\"parameter\" variability=\"fixed\"", Some(0.0));
    let _ = writeln!(
        variables,
        "    <Int32 name=\"fault\" valueReference=\"{FAULT}\" causality=\"parameter\" variability=\"fixed\" start=\"0\"/>"
    );
    let unknowns = |element: &str, states: bool| {
        (0..b.outputs.len()).fold(String::new(), |mut out, i| {
            let starts = (0..b.states.len()).filter(|_| states).map(|k| STATE + k);
            let on = join(inputs_of(b, i).map(|j| INPUT + j).chain(starts));
            let _ = writeln!(out, "    <{element} valueReference=\"{}\" dependencies=\"{on}\"/>", OUTPUT + i);
            out
        })
    };
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"3.0\" modelName=\"{name}\" instantiationToken=\"{token}\" generationTool=\"trueup-testkit\">\n  \
         <CoSimulation modelIdentifier=\"{name}\" canHandleVariableCommunicationStepSize=\"{variable}\" providesIntermediateUpdate=\"{interpolate}\" mightReturnEarlyFromDoStep=\"true\" maxOutputDerivativeOrder=\"{order}\" canGetAndSetFMUState=\"{rollback}\" providesDirectionalDerivatives=\"{directional}\"/>\n  \
         <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.01\"/>\n  \
         <ModelVariables>\n{variables}  </ModelVariables>\n  \
         <ModelStructure>\n{outputs}{initial}  </ModelStructure>\n\
         </fmiModelDescription>\n",
        name = b.name,
        token = b.token(),
        variable = b.variable_step,
        interpolate = b.degree > 0,
        order = u8::from(b.output_derivatives),
        rollback = b.rollback,
        directional = b.directional,
        outputs = unknowns("Output", false),
        initial = unknowns("InitialUnknown", true),
    )
}
