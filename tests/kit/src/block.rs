//! One block, and its FMU.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs;
use std::io::{Cursor, Error, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, Mutex, PoisonError};

use zip::write::{SimpleFileOptions, ZipWriter};

use crate::describe;

/// Version of FMI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlockVersion {
    /// 2.0
    Two,
    /// 3.0
    Three,
}

/// What a block computes.
#[derive(Clone, Debug, PartialEq)]
pub enum Dynamics {
    /// `x' = A x + B u`, `y = C x + D u`, row by row; stepped exactly for inputs that are polynomials in time.
    Linear {
        /// States by states.
        a: Vec<Vec<f64>>,
        /// States by inputs.
        b: Vec<Vec<f64>>,
        /// Outputs by states.
        c: Vec<Vec<f64>>,
        /// Outputs by inputs.
        d: Vec<Vec<f64>>,
    },
    /// Expressions in C of the inputs `u(0)`, the states `x(0)` and the time `t`.
    Equations {
        /// New value of each state after a time `h`; `u(j)` is the value of input j at the beginning,
        /// `slope(j)` its derivative.
        flow: Vec<String>,
        /// Each output.
        outputs: Vec<String>,
        /// Its derivatives with respect to each input; `None`: it does not depend on it.
        feedthrough: Vec<Vec<Option<String>>>,
    },
}

/// A block and what it can do. All variables are scalars of type Real (Float64); there are also the parameters
/// `fault` (an integer, see `c/block.h`) and `faultTime`.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockFmu {
    /// Name of the model.
    pub name: String,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Names of the outputs.
    pub outputs: Vec<String>,
    /// Names of the states' start values (parameters) with their defaults.
    pub states: Vec<(String, f64)>,
    /// What it computes.
    pub dynamics: Dynamics,
    /// `canGetAndSetFMUState`.
    pub rollback: bool,
    /// Degree of the inputs' polynomials within a step: 0 (held), 1 (FMI 2.0: input derivatives, FMI 3.0: intermediate
    /// update), or more (FMI 2.0 only).
    pub degree: usize,
    /// `maxOutputDerivativeOrder` is 1, else 0.
    pub output_derivatives: bool,
    /// `providesDirectionalDerivatives`.
    pub directional: bool,
    /// `canHandleVariableCommunicationStepSize`.
    pub variable_step: bool,
}

/// There is a C compiler; without one tests skip, and say so.
pub fn compiler() -> bool {
    Command::new("cc").arg("--version").output().is_ok_and(|o| o.status.success())
}

impl BlockFmu {
    /// Able to do everything, with inputs on a line within a step.
    pub fn new(
        name: &str,
        inputs: &[&str],
        outputs: &[&str],
        states: &[(&str, f64)],
        dynamics: Dynamics,
    ) -> Self {
        let owned = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        Self {
            name: name.into(),
            inputs: owned(inputs),
            outputs: owned(outputs),
            states: states.iter().map(|(n, x)| ((*n).to_owned(), *x)).collect(),
            dynamics,
            rollback: true,
            degree: 1,
            output_derivatives: true,
            directional: true,
            variable_step: true,
        }
    }

    /// Held inputs, no rollback, no derivatives: the least that an FMU may offer.
    #[must_use]
    pub fn plain(self) -> Self {
        Self { rollback: false, degree: 0, output_derivatives: false, directional: false, ..self }
    }

    /// Output `i` depends directly on input `j`.
    pub fn feeds_through(&self, i: usize, j: usize) -> bool {
        match &self.dynamics {
            Dynamics::Linear { d, .. } => d[i][j] != 0.0,
            Dynamics::Equations { feedthrough, .. } => feedthrough[i][j].is_some(),
        }
    }

    /// Compiles the block, once in a process, and packs it as `<folder>/<name>.fmi2.fmu` or `.fmi3.fmu`.
    ///
    /// # Errors
    /// No C compiler, one that refuses the code, or files that cannot be written.
    pub fn build(&self, version: BlockVersion, folder: &Path) -> Result<PathBuf, Error> {
        static PACKED: LazyLock<Mutex<HashMap<String, Vec<u8>>>> = LazyLock::new(Mutex::default);
        let packed = || PACKED.lock().unwrap_or_else(PoisonError::into_inner);
        let key = format!("{version:?} {self:?}");
        let found = packed().get(&key).cloned();
        let bytes = match found {
            Some(bytes) => bytes,
            None => {
                let made = self.pack(version)?;
                packed().insert(key, made.clone());
                made
            }
        };
        let file = folder.join(format!("{}.{}.fmu", self.name, version.tag()));
        fs::write(&file, bytes)?;
        Ok(file)
    }

    fn pack(&self, version: BlockVersion) -> Result<Vec<u8>, Error> {
        let work = tempfile::tempdir()?;
        fs::write(work.path().join("model.h"), self.model())?;
        fs::write(work.path().join("equations.h"), self.equations())?;
        for (name, text) in [("block.h", include_str!("../c/block.h")), ("fmu.c", version.source())] {
            fs::write(work.path().join(name), text)?;
        }
        let library = work.path().join("fmu.so");
        let mut cc = Command::new("cc");
        cc.args(["-std=gnu11", "-O0", "-fno-math-errno", "-shared", "-fPIC", "-o"]).arg(&library);
        let done = cc.arg(work.path().join("fmu.c")).arg("-lm").output()?;
        if !done.status.success() {
            return Err(Error::other(String::from_utf8_lossy(&done.stderr).into_owned()));
        }
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        let binary = format!("binaries/{}/{}.so", version.platform(), self.name);
        for (name, bytes) in [
            ("modelDescription.xml", describe::xml(self, version).into_bytes()),
            (binary.as_str(), fs::read(&library)?),
            ("resources/readme.txt", b"A block for tests.\n".to_vec()),
        ] {
            zip.start_file(name, SimpleFileOptions::default())?;
            zip.write_all(&bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    }

    /// `model.h`
    fn model(&self) -> String {
        let flag = u8::from;
        let mut out = format!(
            "enum {{ NX = {}, NU = {}, NY = {}, DEGREE = {}, ROLLBACK = {}, OUTPUT_DERIVATIVES = {}, DIRECTIONAL = {} }};\n",
            self.states.len(),
            self.inputs.len(),
            self.outputs.len(),
            self.degree,
            flag(self.rollback),
            flag(self.output_derivatives),
            flag(self.directional)
        );
        let starts: Vec<String> = self.states.iter().map(|(_, x)| format!("{x:?}")).collect();
        let _ =
            writeln!(out, "#define TOKEN \"{}\"\n#define START {{ {} }}", self.token(), starts.join(", "));
        if let Dynamics::Linear { a, b, c, d } = &self.dynamics {
            out.push_str("#define LINEAR\n");
            let (nx, nu, ny) = (self.states.len(), self.inputs.len(), self.outputs.len());
            for (name, m, rows, columns) in
                [("A", a, nx, nx), ("B", b, nx, nu), ("C", c, ny, nx), ("D", d, ny, nu)]
            {
                let row = |r: &Vec<f64>| r.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", ");
                let text = m.iter().map(|r| format!("{{ {} }}", row(r))).collect::<Vec<_>>().join(", ");
                let _ = writeln!(out, "static const double {name}[{rows}][{columns}] = {{ {text} }};");
            }
        }
        out
    }

    /// `equations.h`
    fn equations(&self) -> String {
        let Dynamics::Equations { flow, outputs, feedthrough } = &self.dynamics else { return String::new() };
        let mut out = String::from(
            "#define u(j) (b->s.u[j][0])\n#define slope(j) (DEGREE > 0 ? b->s.u[j][DEGREE > 0] : 0)\n#define x(i) (b->s.x[i])\n\
             static void flow(Block *b, double t, double h) {\n  (void)t, (void)h;\n  double next[NX + 1] = { 0 };\n",
        );
        for (i, text) in flow.iter().enumerate() {
            let _ = writeln!(out, "  next[{i}] = {text};");
        }
        out.push_str("  memcpy(b->s.x, next, sizeof b->s.x);\n}\nstatic double output(const Block *b, int i) {\n  const double t = b->s.time;\n  (void)t;\n  switch (i) {\n");
        for (i, text) in outputs.iter().enumerate() {
            let _ = writeln!(out, "  case {i}: return {text};");
        }
        out.push_str("  }\n  return 0;\n}\nstatic double output_derivative(const Block *b, int i) { return (void)b, (void)i, 0; }\n");
        out.push_str("static double feedthrough(const Block *b, int i, int j) {\n  const double t = b->s.time;\n  (void)b, (void)t;\n");
        for (i, row) in feedthrough.iter().enumerate() {
            for (j, text) in row.iter().enumerate().filter_map(|(j, t)| t.as_ref().map(|t| (j, t))) {
                let _ = writeln!(out, "  if (i == {i} && j == {j}) return {text};");
            }
        }
        out.push_str("  return (void)i, (void)j, 0;\n}\n");
        out
    }

    /// `guid` or `instantiationToken`.
    pub(crate) fn token(&self) -> String {
        format!("{{testkit-{}}}", self.name)
    }
}

impl BlockVersion {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Two, Self::Three];

    /// `fmi2`, `fmi3`
    pub fn tag(self) -> &'static str {
        match self {
            Self::Two => "fmi2",
            Self::Three => "fmi3",
        }
    }

    fn source(self) -> &'static str {
        match self {
            Self::Two => include_str!("../c/fmi2.c"),
            Self::Three => include_str!("../c/fmi3.c"),
        }
    }

    /// The folder of this machine's binaries.
    fn platform(self) -> String {
        match (self, std::env::consts::ARCH) {
            (Self::Two, "x86_64") => "linux64".into(),
            (_, arch) => format!("{arch}-linux"),
        }
    }
}
