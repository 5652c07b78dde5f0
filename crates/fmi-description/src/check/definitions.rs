//! Units, type definitions, log categories.

use std::collections::HashSet;

use super::finding::Findings;
use crate::FmiVersion;
use crate::description::{Attributes, Description, VariableType};

pub(super) fn check(d: &Description, f: &mut Findings) {
    let mut seen = HashSet::new();
    for u in &d.units {
        if !seen.insert(&u.name) {
            f.error(u.line, format!("unit `{}` is defined twice: remove one definition", u.name));
        }
        let mut displays = HashSet::new();
        for x in &u.display {
            if !displays.insert(&x.name) {
                f.error(
                    u.line,
                    format!("unit `{}` has the display unit `{}` twice: remove one", u.name, x.name),
                );
            }
            if x.factor == 0.0 {
                f.error(u.line, format!("display unit `{}` of `{}` has the factor 0", x.name, u.name));
            }
        }
        if u.base.is_some_and(|b| b.factor == 0.0) {
            f.error(u.line, format!("unit `{}` has the factor 0", u.name));
        }
    }
    let mut seen = HashSet::new();
    for t in &d.types {
        if !seen.insert(&t.name) {
            f.error(t.line, format!("type `{}` is defined twice: remove one definition", t.name));
        }
        if d.version == FmiVersion::V2 && d.find(&t.name).is_some() {
            f.warning(
                t.line,
                format!("type `{0}` and variable `{0}` have the same name: rename one", t.name),
            );
        }
        attributes(d, f, &t.attributes, t.line, &format!("type `{}`", t.name));
        if t.kind == VariableType::Enumeration {
            if t.items.is_empty() {
                f.error(t.line, format!("enumeration `{}` has no items: give at least one", t.name));
            }
            let (mut names, mut values) = (HashSet::new(), HashSet::new());
            for i in &t.items {
                if !names.insert(&i.name) {
                    f.error(t.line, format!("enumeration `{}` has the item `{}` twice", t.name, i.name));
                }
                if !values.insert(i.value) {
                    f.error(
                        t.line,
                        format!("enumeration `{}` gives the number {} to two items", t.name, i.value),
                    );
                }
            }
        }
    }
    let mut seen = HashSet::new();
    for (name, _) in &d.log_categories {
        if name.is_empty() || !seen.insert(name) {
            f.error(None, format!("log category `{name}` has no name or is listed twice"));
        }
    }
}

/// Bounds, nominal value and units of a variable or a type.
pub(super) fn attributes(d: &Description, f: &mut Findings, a: &Attributes, line: u32, subject: &str) {
    if let (Some(min), Some(max)) = (a.min, a.max)
        && min > max
    {
        f.error(line, format!("{subject}: min {min} is greater than max {max}"));
    }
    if let Some(nominal) = a.nominal.filter(|n| !(*n > 0.0 && n.is_finite())) {
        f.error(line, format!("{subject}: nominal {nominal} must be greater than 0: it is a magnitude"));
    }
    if a.clock.as_ref().is_some_and(|c| c.interval_variability.is_empty()) {
        f.error(line, format!("{subject}: a clock needs `intervalVariability`"));
    }
    let unit = a.unit.as_deref();
    if let Some(unit) = unit
        && d.unit(unit).is_none()
    {
        f.error(line, format!("{subject}: the unit `{unit}` is not defined: add it to UnitDefinitions"));
    }
    match (&a.display_unit, unit) {
        (Some(display), None) => {
            f.error(line, format!("{subject}: displayUnit `{display}` without a unit: give `unit` too"));
        }
        (Some(display), Some(unit)) => display_unit(d, f, unit, display, line, subject),
        _ => {}
    }
}

pub(super) fn display_unit(
    d: &Description,
    f: &mut Findings,
    unit: &str,
    display: &str,
    line: u32,
    subject: &str,
) {
    let defined = d.unit(unit).is_none_or(|u| u.display.iter().any(|x| x.name == display));
    if !defined {
        let mend = format!("add a DisplayUnit to the unit `{unit}`");
        f.error(line, format!("{subject}: the display unit `{display}` is not defined: {mend}"));
    }
}
