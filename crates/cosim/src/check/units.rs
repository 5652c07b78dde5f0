//! Units: may one be handed on as the other, and by which factor and offset?

use trueup_fmi_description::description::{BaseUnit, Description, DescriptionUnit, DescriptionVariable};

/// A unit in common use by its name (mm, deg, rpm), as sidecars of recordings do.
pub(crate) fn of_everybody(name: &str) -> Option<DescriptionUnit> {
    // Some tools write `[rad]`.
    let bare = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name);
    let known = trueup_signals::SignalUnit::parse(bare)?;
    let [kg, m, s, a, k, rad, _cycles] = known.exponents.map(i32::from);
    let base =
        BaseUnit { exponents: [kg, m, s, a, k, 0, 0, rad], factor: known.factor, offset: known.offset };
    Some(DescriptionUnit { name: name.into(), base: Some(base), display: Vec::new(), line: 0 })
}

/// What a unit is, by its definition, else by what everybody means by its name.
fn base(unit: &DescriptionUnit) -> Option<BaseUnit> {
    unit.base.or_else(|| of_everybody(&unit.name)?.base)
}

/// Result of a comparison.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Conversion {
    /// Nothing to do.
    Same,
    /// target = factor * source + offset
    By(f64, f64),
    /// They differ and are not defined; values are handed on as they are.
    Unknown,
    /// The quantities differ in angle alone, which SI counts as 1: converted, but worth a word.
    Angle(f64, f64),
    /// Different quantities.
    Different,
}

/// The unit of a variable, as far as it is described.
pub(crate) fn of(d: &Description, v: &DescriptionVariable) -> Option<DescriptionUnit> {
    let name = d.attributes(v).unit?;
    let unit = d.unit(&name).cloned();
    Some(unit.unwrap_or(DescriptionUnit { name, base: None, display: Vec::new(), line: 0 }))
}

/// Values in `from` become values in `to`. A relative quantity (a difference of temperatures) has no offset.
pub(crate) fn conversion(from: &DescriptionUnit, to: &DescriptionUnit, relative: bool) -> Conversion {
    if from.name == to.name && (from.base.is_none() || to.base.is_none()) {
        return Conversion::Same;
    }
    let (Some(a), Some(b)) = (base(from), base(to)) else { return Conversion::Unknown };
    let same = a.exponents == b.exponents;
    if !same && a.exponents[..7] != b.exponents[..7] {
        return Conversion::Different;
    }
    let (factor, offset) = between(&a, &b, relative);
    match (same, (factor, offset) == (1.0, 0.0)) {
        (true, true) => Conversion::Same,
        (true, false) => Conversion::By(factor, offset),
        (false, _) => Conversion::Angle(factor, offset),
    }
}

fn between(a: &BaseUnit, b: &BaseUnit, relative: bool) -> (f64, f64) {
    let offset = if relative { 0.0 } else { (a.offset - b.offset) / b.factor };
    (a.factor / b.factor, offset)
}

/// A unit that is known by its name alone, looked up among those of the FMU and among the display units of the
/// variable's own, and among those of everybody.
pub(super) fn named(d: &Description, own: Option<&DescriptionUnit>, name: &str) -> Option<DescriptionUnit> {
    if let Some(unit) = d.unit(name) {
        return Some(unit.clone());
    }
    let shown = own.and_then(|own| own.display.iter().find(|u| u.name == name && !u.inverse));
    let (Some(shown), Some(base)) = (shown, own.and_then(|own| own.base)) else { return of_everybody(name) };
    // displayed = factor * value + offset, base = base.factor * value + base.offset
    let factor = base.factor / shown.factor;
    let base = BaseUnit { factor, offset: base.offset - factor * shown.offset, ..base };
    Some(DescriptionUnit { name: name.into(), base: Some(base), display: Vec::new(), line: 0 })
}

/// Exponents as text, for messages.
pub(crate) fn dimension(unit: &DescriptionUnit) -> String {
    let Some(base) = base(unit) else { return "unknown".into() };
    let names = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
    let factors: Vec<String> = names
        .iter()
        .zip(base.exponents)
        .filter(|(_, e)| *e != 0)
        .map(|(n, e)| if e == 1 { (*n).to_owned() } else { format!("{n}{e}") })
        .collect();
    if factors.is_empty() { "1".into() } else { factors.join(".") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(name: &str, exponents: [i32; 8], factor: f64, offset: f64) -> DescriptionUnit {
        let base = Some(BaseUnit { exponents, factor, offset });
        DescriptionUnit { name: name.into(), base, display: Vec::new(), line: 0 }
    }

    #[test]
    fn conversions() {
        let angle = [0, 0, 0, 0, 0, 0, 0, 1];
        let kelvin = [0, 0, 0, 0, 1, 0, 0, 0];
        let deg = unit("deg", angle, std::f64::consts::PI / 180.0, 0.0);
        let rad = unit("rad", angle, 1.0, 0.0);
        let Conversion::By(factor, offset) = conversion(&rad, &deg, false) else { panic!() };
        assert!((factor * std::f64::consts::PI - 180.0).abs() < 1e-12 && offset == 0.0);
        // 20 degC are 68 degF and 293.15 K; a difference of 20 degC is one of 36 degF.
        let celsius = unit("degC", kelvin, 1.0, 273.15);
        let fahrenheit = unit("degF", kelvin, 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0);
        let Conversion::By(factor, offset) = conversion(&celsius, &fahrenheit, false) else { panic!() };
        assert!((factor * 20.0 + offset - 68.0).abs() < 1e-12, "{factor} {offset}");
        let Conversion::By(factor, offset) = conversion(&celsius, &fahrenheit, true) else { panic!() };
        assert!((factor * 20.0 + offset - 36.0).abs() < 1e-12);
        assert_eq!(conversion(&celsius, &celsius, false), Conversion::Same);
        assert_eq!(conversion(&celsius, &rad, false), Conversion::Different);
        let one = unit("1", [0; 8], 1.0, 0.0);
        assert_eq!(conversion(&one, &rad, false), Conversion::Angle(1.0, 0.0));
        let odd = DescriptionUnit { name: "odd".into(), base: None, display: Vec::new(), line: 0 };
        assert_eq!(conversion(&odd, &rad, false), Conversion::Unknown);
        assert_eq!(conversion(&odd, &odd, false), Conversion::Same);
    }
}
