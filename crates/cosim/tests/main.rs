//! Integration tests, one module a file.

mod coupled;
mod coupling;
mod faults;
mod model_exchange;
mod reference_fmus;
mod results;
mod system;
