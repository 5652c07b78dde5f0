//! The noise floor of compared channels and measured inputs, and the gap against it.
