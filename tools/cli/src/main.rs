//! The program `trueup`.
fn main() {}
