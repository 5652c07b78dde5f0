//! The law: from a unit to the exponent, from the exponent to the value.

use trueup_fmi_description::description::DescriptionUnit;

/// Names of the base units, in the order of [`UnitDimension`].
const BASES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
/// Exponents of lambda that the paper's Table 1 gives them (mass, distance, time). An angle is a number. Amperes, kelvins, moles
/// and candelas have no law.
const LAWS: [Option<f64>; 8] = [Some(3.0), Some(1.0), Some(1.0), None, None, None, None, Some(0.0)];

/// What a unit measures: exponents of kg, m, s, A, K, mol, cd, rad; and where its zero is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct UnitDimension {
    /// Exponents of kg, m, s, A, K, mol, cd, rad.
    pub exponents: [i32; 8],
    /// Value in SI where the number is 0, in the number's own unit: 273.15 for degC, else 0.
    pub zero: f64,
}

/// An exponent that the user gives: of a base unit (`A`), or of a variable (`plant.torqueConstant`, an array for its elements).
#[derive(Clone, Debug, PartialEq)]
pub struct GivenExponent {
    /// Base unit or variable.
    pub name: String,
    /// Exponent of lambda.
    pub exponent: f64,
}

/// lambda, which way, and what the user adds to the law.
#[derive(Clone, Debug, PartialEq)]
pub struct ScalingLaw {
    /// Size of the scaled system by that of the full one, above 0.
    pub lambda: f64,
    /// From the scaled size to the full one.
    pub back: bool,
    /// Exponents that the user gives.
    pub given: Vec<GivenExponent>,
}

/// A quantity without an exponent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lawless {
    /// The base unit that has none; empty: the unit is not known.
    pub base: &'static str,
}

/// What becomes of a value, `lambda^w (x + zero) - zero`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineScale {
    /// lambda to the size of w.
    power: f64,
    /// Divide by it: w is below 0, or the way is back.
    divide: bool,
    zero: f64,
}

impl UnitDimension {
    /// Of a unit of an FMU; of one that it does not define, by its name.
    pub fn of(unit: &DescriptionUnit) -> Option<Self> {
        let Some(base) = unit.base else { return Self::named(&unit.name) };
        Some(Self { exponents: base.exponents, zero: base.offset / base.factor })
    }

    /// Of a unit by its name, `N.m/rad`. `None`: it is not known.
    pub fn named(name: &str) -> Option<Self> {
        let unit = trueup_signals::SignalUnit::parse(name)?;
        // Cycles are a number, as an angle is.
        let [kg, m, s, ampere, kelvin, rad, _cycles] = unit.exponents.map(i32::from);
        Some(Self { exponents: [kg, m, s, ampere, kelvin, 0, 0, rad], zero: unit.offset / unit.factor })
    }
}

impl ScalingLaw {
    /// The exponent w of a quantity: that which was given for its name, else 3 kg + m + s.
    ///
    /// # Errors
    /// [`Lawless`]: its unit has a base without a law, and none was given; or its unit is not known.
    pub fn exponent(&self, name: &str, dimension: Option<UnitDimension>) -> Result<f64, Lawless> {
        let array = name.split_once('[').map_or(name, |(array, _)| array);
        if let Some(w) = self.given_for(name).or_else(|| self.given_for(array)) {
            return Ok(w);
        }
        let Some(dimension) = dimension else { return Err(Lawless { base: "" }) };
        let mut w = 0.0;
        for ((base, law), exponent) in BASES.into_iter().zip(LAWS).zip(dimension.exponents) {
            if exponent != 0 {
                let one = self.given_for(base).or(law).ok_or(Lawless { base })?;
                w += one * f64::from(exponent); // (CON-7)
            }
        }
        Ok(w)
    }

    /// What becomes of values with that exponent.
    pub fn scale(&self, exponent: f64, dimension: Option<UnitDimension>) -> AffineScale {
        let zero = dimension.map_or(0.0, |d| d.zero);
        AffineScale { power: power(self.lambda, exponent.abs()), divide: self.back != (exponent < 0.0), zero }
    }

    /// [`exponent`](Self::exponent), then [`scale`](Self::scale).
    ///
    /// # Errors
    /// Those of [`exponent`](Self::exponent).
    pub fn of(&self, name: &str, dimension: Option<UnitDimension>) -> Result<AffineScale, Lawless> {
        Ok(self.scale(self.exponent(name, dimension)?, dimension))
    }

    /// Of times in s.
    pub fn time(&self) -> AffineScale {
        let w = self.given_for("s").or(LAWS[2]).unwrap_or(1.0);
        self.scale(w, None)
    }

    fn given_for(&self, name: &str) -> Option<f64> {
        self.given.iter().rev().find(|g| g.name == name).map(|g| g.exponent)
    }
}

impl AffineScale {
    /// Leaves every value as it is.
    pub fn is_one(&self) -> bool {
        self.power == 1.0
    }

    /// The value at the other size.
    pub fn apply(&self, x: f64) -> f64 {
        // Divided on the way back: to and fro is the same up to the rounding of both.
        let scaled = |x: f64| neat(if self.divide { x / self.power } else { x * self.power });
        match self.zero {
            _ if self.is_one() => x,
            0.0 => scaled(x),
            zero => scaled(x + zero) - zero,
        }
    }

    /// By how much the ratio of a quantity with this scale to one with `other` changes.
    pub fn over(&self, other: &Self) -> f64 {
        let factor = |it: &Self| if it.divide { 1.0 / it.power } else { it.power };
        factor(self) / factor(other)
    }
}

/// lambda^w for w >= 0: of a whole w that of the decimal number which the user wrote, so that 0.3^3 is 0.027.
fn power(lambda: f64, w: f64) -> f64 {
    let decimal = || {
        let text = format!("{lambda:e}");
        let (digits, ten) = text.split_once('e')?;
        let fraction = digits.split_once('.').map_or(0, |(_, after)| after.len() as i64);
        let whole: u128 = digits.replace('.', "").parse().ok()?;
        let (w, ten) = (w as u32, ten.parse::<i64>().ok()? - fraction);
        format!("{}e{}", whole.checked_pow(w)?, ten * i64::from(w)).parse().ok()
    };
    let exact = if w.fract() == 0.0 && w <= 32.0 { decimal() } else { None };
    exact.unwrap_or_else(|| lambda.powf(w))
}

/// Of the number and both of its neighbours the one with the fewest digits: 213.3 for 213.29999999999998.
fn neat(x: f64) -> f64 {
    let length = |x: &f64| format!("{x:?}").len();
    let better = [x.next_down(), x.next_up()].into_iter().filter(|y| length(y) < length(&x));
    better.min_by_key(length).unwrap_or(x)
}

impl std::fmt::Display for Lawless {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.base {
            "" => f.write_str(
                "its unit is not known, so its scale is not defined; give an exponent with --exponent NAME=W",
            ),
            base => write!(
                f,
                "the scale of {base} is not defined; give an exponent with --exponent {base}=W, or of this one alone with --exponent NAME=W"
            ),
        }
    }
}
