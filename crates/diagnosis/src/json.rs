//! Numbers in JSON.

use serde::{Deserialize, Deserializer};

/// A number where JSON has none that is not finite and `null` was written: NaN.
pub(crate) fn number<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Option::<f64>::deserialize(from).map(|x| x.unwrap_or(f64::NAN))
}
