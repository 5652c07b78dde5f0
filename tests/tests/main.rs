//! Integration tests, one module a file.

mod closed_loops;
mod effects_document;
mod fmi_rs_witness;
mod hostile;
mod layers;
mod model_description;
