//! Builds the logger of FMI 2.0: variadic functions cannot be defined in stable Rust.

fn main() {
    println!("cargo:rerun-if-changed=src/logger.c");
    cc::Build::new().file("src/logger.c").warnings(true).compile("trueup_fmi_logger");
}
