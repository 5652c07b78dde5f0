//! Causality, variability, initial, start values, types, arrays, derivatives.

use std::collections::HashSet;

use super::definitions;
use super::finding::Findings;
use crate::FmiVersion;
use crate::description::{
    ArrayDimension, Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, Initial,
    StartValues, VariableType,
};

pub(super) fn check(d: &Description, f: &mut Findings) {
    let states: HashSet<u32> = d.variables.iter().filter_map(|v| v.derivative).collect();
    for (at, v) in d.variables.iter().enumerate() {
        combination(d, f, v);
        start(d, f, v);
        kind(d, f, v);
        dimensions(d, f, v);
        derivative(d, f, v);
        let reference = if d.version == FmiVersion::V2 { at as u32 + 1 } else { v.value_reference };
        if v.reinit && d.model_exchange.is_some() && !states.contains(&reference) {
            f.error(
                v.line,
                format!("variable `{}` has reinit=\"true\" but is no continuous state: remove it", v.name),
            );
        }
        references(d, f, v);
    }
    let independent: Vec<_> =
        d.variables.iter().filter(|v| v.causality == DescriptionCausality::Independent).collect();
    match (d.version, independent.as_slice()) {
        (FmiVersion::V3, []) => {
            f.error(
                None,
                "there is no independent variable: add a Float64 `time` with causality=\"independent\"",
            );
        }
        (_, [_, second, ..]) => {
            f.error(
                second.line,
                format!("`{}` is the second independent variable: only one is allowed", second.name),
            );
        }
        _ => {}
    }
}

fn word<T: std::fmt::Debug>(x: T) -> String {
    let mut text = format!("{x:?}");
    if let Some(first) = text.get_mut(..1) {
        first.make_ascii_lowercase();
    }
    text
}

/// The tables of allowed combinations: section 2.2.7 of FMI 2.0, section 2.4.7 of FMI 3.0.
fn combination(d: &Description, f: &mut Findings, v: &DescriptionVariable) {
    use DescriptionCausality as C;
    use DescriptionVariability as V;
    let allowed: &[V] = match v.causality {
        C::Parameter | C::CalculatedParameter | C::StructuralParameter => &[V::Fixed, V::Tunable],
        C::Input => &[V::Discrete, V::Continuous],
        C::Output => &[V::Constant, V::Discrete, V::Continuous],
        C::Local => &[V::Constant, V::Fixed, V::Tunable, V::Discrete, V::Continuous],
        C::Independent => &[V::Continuous],
    };
    let name = &v.name;
    if !v.kind.is_float() && v.variability == V::Continuous {
        f.error(
            v.line,
            format!(
                "variable `{name}` is of type {} and cannot be continuous (which is the default of FMI 2.0): \
                     write variability=\"discrete\"",
                v.kind.name(d.version)
            ),
        );
    } else if !allowed.contains(&v.variability) {
        let words: Vec<String> = allowed.iter().map(word).collect();
        f.error(
            v.line,
            format!(
                "variable `{name}`: causality=\"{}\" does not go with variability=\"{}\": use {}",
                word(v.causality),
                word(v.variability),
                words.join(" or ")
            ),
        );
        return;
    }
    let Some(initial) = v.initial else { return };
    let exact_only =
        matches!(v.causality, C::Parameter | C::StructuralParameter) || v.variability == V::Constant;
    let calculated_parameter = v.causality == C::CalculatedParameter
        || matches!(v.variability, V::Fixed | V::Tunable) && !exact_only;
    let wrong = match v.causality {
        C::Independent => Some("the independent variable has no `initial`: remove it"),
        C::Input if d.version == FmiVersion::V2 => Some("an input has no `initial`: remove it"),
        C::Input if initial != Initial::Exact => Some("the `initial` of an input can only be \"exact\""),
        _ if exact_only && initial != Initial::Exact => Some("`initial` can only be \"exact\" here"),
        _ if calculated_parameter && initial == Initial::Exact => {
            Some("`initial` can only be \"calculated\" or \"approx\" here")
        }
        _ => None,
    };
    if let Some(why) = wrong {
        f.error(
            v.line,
            format!(
                "variable `{name}` (causality=\"{}\", variability=\"{}\", initial=\"{}\"): {why}",
                word(v.causality),
                word(v.variability),
                word(initial)
            ),
        );
    }
}

fn start(d: &Description, f: &mut Findings, v: &DescriptionVariable) {
    let name = &v.name;
    let initial = v.effective_initial();
    let demanded = v.causality == DescriptionCausality::Input
        || matches!(initial, Some(Initial::Exact | Initial::Approx));
    let Some(start) = &v.start else {
        if demanded && v.kind != VariableType::Clock {
            f.error(v.line, format!("variable `{name}` has no start value but needs one: add `start`"));
        }
        return;
    };
    if v.causality == DescriptionCausality::Independent
        || v.causality != DescriptionCausality::Input && initial == Some(Initial::Calculated)
    {
        f.error(
            v.line,
            format!(
                "variable `{name}` is calculated and must not have a start value: remove `start`, or write \
                     initial=\"exact\" or \"approx\" where that is meant"
            ),
        );
    }
    if let Some(elements) = d.elements(v)
        && start.len() != elements
        && start.len() != 1
    {
        f.error(
            v.line,
            format!("variable `{name}` has {} start values for {elements} elements", start.len()),
        );
    }
    let a = d.attributes(v);
    for x in start.as_f64().unwrap_or_default() {
        if x.is_nan() || a.min.is_some_and(|min| x < min) || a.max.is_some_and(|max| x > max) {
            let bound = |b: Option<f64>| b.map_or("unbounded".to_owned(), |b| b.to_string());
            f.error(
                v.line,
                format!(
                    "variable `{name}`: the start value {x} is outside min {}, max {}",
                    bound(a.min),
                    bound(a.max)
                ),
            );
            break;
        }
    }
    if let (VariableType::Enumeration, StartValues::Signed(numbers)) = (v.kind, start)
        && let Some(t) = v.declared_type.as_deref().and_then(|t| d.declared_type(t))
        && let Some(number) = numbers.iter().find(|n| !t.items.iter().any(|i| i.value == **n))
    {
        f.error(v.line, format!("variable `{name}`: the start value {number} is no item of `{}`", t.name));
    }
}

fn kind(d: &Description, f: &mut Findings, v: &DescriptionVariable) {
    let name = &v.name;
    match v.declared_type.as_deref().map(|t| (t, d.declared_type(t))) {
        None if v.kind == VariableType::Enumeration => {
            f.error(
                v.line,
                format!("enumeration variable `{name}` has no declaredType: name its enumeration"),
            );
        }
        Some((t, None)) => {
            f.error(
                v.line,
                format!("variable `{name}`: the type `{t}` is not defined: add it to TypeDefinitions"),
            );
        }
        Some((_, Some(t))) if t.kind != v.kind => f.error(
            v.line,
            format!(
                "variable `{name}` is of type {} but its declared type `{}` is {}",
                v.kind.name(d.version),
                t.name,
                t.kind.name(d.version)
            ),
        ),
        _ => {}
    }
    definitions::attributes(d, f, &d.attributes(v), v.line, &format!("variable `{name}`"));
    for alias in &v.aliases {
        if let (Some(unit), Some(display)) = (&d.attributes(v).unit, &alias.display_unit) {
            definitions::display_unit(d, f, unit, display, v.line, &format!("alias `{}`", alias.name));
        }
    }
    if v.intermediate_update && v.variability != DescriptionVariability::Continuous {
        f.error(
            v.line,
            format!("variable `{name}` is not continuous and cannot have intermediateUpdate=\"true\""),
        );
    }
    if v.causality == DescriptionCausality::StructuralParameter
        && v.kind != VariableType::UInt64
        && sizes(d, v)
    {
        f.error(
            v.line,
            format!("structural parameter `{name}` gives a dimension and must be of type UInt64"),
        );
    }
}

fn sizes(d: &Description, parameter: &DescriptionVariable) -> bool {
    let it = ArrayDimension::Variable(parameter.value_reference);
    d.variables.iter().any(|v| v.dimensions.contains(&it))
}

fn dimensions(d: &Description, f: &mut Findings, v: &DescriptionVariable) {
    for x in &v.dimensions {
        match x {
            ArrayDimension::Fixed(0) => f.error(
                v.line,
                format!("array `{}` has a dimension of length 0: it must be at least 1", v.name),
            ),
            ArrayDimension::Fixed(_) => {}
            ArrayDimension::Variable(reference) => {
                let at = d.by_reference.get(reference).and_then(|at| d.variables.get(*at));
                let sized = at.is_some_and(|p| {
                    p.causality == DescriptionCausality::StructuralParameter
                        || p.variability == DescriptionVariability::Constant
                });
                if !sized {
                    f.error(
                        v.line,
                        format!("array `{}` takes a dimension from value reference {reference}, which is no structural \
                                 parameter or constant", v.name),
                    );
                }
            }
        }
    }
}

fn derivative(d: &Description, f: &mut Findings, v: &DescriptionVariable) {
    let Some(reference) = v.derivative else { return };
    let name = &v.name;
    let Some(state) = d.resolve(reference).and_then(|at| d.variables.get(at)) else {
        f.error(v.line, format!("variable `{name}`: derivative=\"{reference}\" leads to no variable"));
        return;
    };
    if state.name == *name {
        f.error(v.line, format!("variable `{name}` is declared as its own derivative"));
    }
    for x in [v, state] {
        if x.variability != DescriptionVariability::Continuous {
            f.error(
                v.line,
                format!(
                    "`{name}` is the derivative of `{}`, so both must be continuous; `{}` is {}",
                    state.name,
                    x.name,
                    word(x.variability)
                ),
            );
        }
    }
    if d.elements(v) != d.elements(state) {
        f.error(v.line, format!("`{name}` and its state `{}` differ in size", state.name));
    }
}

/// Clocks and previous values of FMI 3.0.
fn references(d: &Description, f: &mut Findings, v: &DescriptionVariable) {
    for clock in &v.clocks {
        let known = d.by_reference.get(clock).and_then(|at| d.variables.get(*at));
        if known.is_none_or(|c| c.kind != VariableType::Clock) {
            f.error(
                v.line,
                format!("variable `{}`: the value reference {clock} in `clocks` is no clock", v.name),
            );
        }
    }
    if let Some(previous) = v.previous
        && d.resolve(previous).is_none()
    {
        f.error(v.line, format!("variable `{}`: previous=\"{previous}\" leads to no variable", v.name));
    }
}
