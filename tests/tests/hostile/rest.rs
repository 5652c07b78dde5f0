//! Random calls of the functions that have nothing to do in these FMUs, and of logging.

use super::fmu::{Kind, Library};
use super::random::Random;
use super::subject::{Subject, ask};
use core::ffi::c_char;
use core::ptr::{null, null_mut};
use trueup_fmi::abi::fmi3::*;

impl Subject<'_> {
    /// Any value reference of a Float64 variable, or an unknown one.
    fn reference(&self, r: &mut Random) -> u32 {
        let v = &self.fmu.variables[r.below(self.fmu.variables.len())];
        if r.once_in(6) { r.next() as u32 } else { v.reference }
    }
    pub fn logging(&mut self, r: &mut Random) {
        let known = [c"logStatusError", c"logStatusWarning", c"logEvents"];
        let unknown = [c"", c"logAll", c"logstatuserror", c"\xff\xfe"];
        let mut names: Vec<*const c_char> = Vec::new();
        let (mut errors, mut wrong) = (false, false);
        for _ in 0..r.below(4) {
            match r.below(12) {
                0 => {
                    names.push(r.pick(&unknown).as_ptr());
                    wrong = true;
                }
                1 => {
                    names.push(null());
                    wrong = true;
                }
                _ => {
                    let name = r.pick(&known);
                    errors |= name == known[0];
                    names.push(name.as_ptr());
                }
            }
        }
        let on = !r.once_in(4);
        let n = names.len();
        let p = if r.once_in(20) { null() } else { names.as_ptr() };
        self.wrong = wrong || p.is_null() && n > 0;
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2SetDebugLogging(i32::from(on), n, p)),
            Library::Three(f) => ask!(self, f.fmi3SetDebugLogging(on.into(), n, p)),
        };
        if status == 0 {
            self.logs = match n {
                0 => on,
                // FMI 2.0: the named ones alone; FMI 3.0: the others stay.
                _ if errors => on,
                _ => self.fmu.is_fmi3() && self.logs,
            };
        }
    }
    /// There is no clock.
    pub fn clocks(&mut self, r: &mut Random) {
        let Library::Three(f) = &self.fmu.library else { return };
        let references = [self.reference(r), self.reference(r)];
        let n = r.below(3);
        let p = if r.once_in(10) { null() } else { references.as_ptr() };
        let (mut x, mut a, mut b) = ([0.1; 2], [1u64; 2], [2u64; 2]);
        let mut q = [fmi3IntervalQualifier(0); 2];
        let (x, a, b, q) = (x.as_mut_ptr(), a.as_mut_ptr(), b.as_mut_ptr(), q.as_mut_ptr());
        self.wrong = n > 0;
        match r.below(12) {
            0 => ask!(self, f.fmi3GetIntervalDecimal(p, n, x, q)),
            1 => ask!(self, f.fmi3GetIntervalFraction(p, n, a, b, q)),
            2 => ask!(self, f.fmi3GetShiftDecimal(p, n, x)),
            3 => ask!(self, f.fmi3GetShiftFraction(p, n, a, b)),
            4 => ask!(self, f.fmi3SetIntervalDecimal(p, n, x)),
            5 => ask!(self, f.fmi3SetIntervalFraction(p, n, a, b)),
            6 => ask!(self, f.fmi3SetShiftDecimal(p, n, x)),
            7 => ask!(self, f.fmi3SetShiftFraction(p, n, a, b)),
            8 => ask!(self, f.fmi3GetClock(p, n, [fmi3False; 2].as_mut_ptr())),
            9 => ask!(self, f.fmi3SetClock(p, n, [fmi3True; 2].as_ptr())),
            10 => {
                self.wrong = true;
                ask!(self, f.fmi3ActivateModelPartition(references[0], r.number()))
            }
            _ => {
                self.wrong = false;
                ask!(self, f.fmi3EvaluateDiscreteStates())
            }
        };
    }
    /// Data types that no variable has; the buffers are long enough for any pair of variables.
    pub fn other_types(&mut self, r: &mut Random) {
        let references = [self.reference(r), self.reference(r)];
        let n = r.below(3);
        let mut bytes = [0u64; 4];
        let p = references.as_ptr();
        self.wrong = n > 0;
        match &self.fmu.library {
            Library::Two(f) => {
                let mut texts = [c"x".as_ptr(); 2];
                match r.below(2) {
                    0 => ask!(self, f.fmi2GetString(p, n, texts.as_mut_ptr())),
                    _ => ask!(self, f.fmi2SetString(p, n, texts.as_ptr())),
                };
            }
            Library::Three(f) => {
                let len = r.below(3);
                self.wrong = n > 0 || len > 0;
                let b = bytes.as_mut_ptr();
                let mut texts = [c"x".as_ptr(); 2];
                let mut binaries = [b"x".as_ptr(); 2];
                let mut sizes = [1usize; 2];
                match r.below(20) {
                    0 => ask!(self, f.fmi3GetFloat32(p, n, b.cast(), len)),
                    1 => ask!(self, f.fmi3SetFloat32(p, n, b.cast(), len)),
                    2 => ask!(self, f.fmi3GetInt8(p, n, b.cast(), len)),
                    3 => ask!(self, f.fmi3SetInt8(p, n, b.cast(), len)),
                    4 => ask!(self, f.fmi3GetUInt8(p, n, b.cast(), len)),
                    5 => ask!(self, f.fmi3SetUInt8(p, n, b.cast(), len)),
                    6 => ask!(self, f.fmi3GetInt16(p, n, b.cast(), len)),
                    7 => ask!(self, f.fmi3SetInt16(p, n, b.cast(), len)),
                    8 => ask!(self, f.fmi3GetUInt16(p, n, b.cast(), len)),
                    9 => ask!(self, f.fmi3SetUInt16(p, n, b.cast(), len)),
                    10 => ask!(self, f.fmi3GetUInt32(p, n, b.cast(), len)),
                    11 => ask!(self, f.fmi3SetUInt32(p, n, b.cast(), len)),
                    12 => ask!(self, f.fmi3GetUInt64(p, n, b, len)),
                    13 => ask!(self, f.fmi3SetUInt64(p, n, b, len)),
                    14 => ask!(self, f.fmi3GetString(p, n, texts.as_mut_ptr(), len)),
                    15 => ask!(self, f.fmi3SetString(p, n, texts.as_ptr(), len)),
                    16 => ask!(self, f.fmi3GetBinary(p, n, sizes.as_mut_ptr(), binaries.as_mut_ptr(), len)),
                    17 => ask!(self, f.fmi3SetBinary(p, n, sizes.as_ptr(), binaries.as_ptr(), len)),
                    // Int32 does exist for `Integer` variables, of which there are only constants.
                    18 => {
                        self.wrong = false;
                        ask!(self, f.fmi3GetInt32(p, n, b.cast(), len))
                    }
                    _ => {
                        self.wrong = false;
                        ask!(self, f.fmi3SetInt32(p, n, b.cast(), len))
                    }
                };
            }
        }
    }
    /// Counts and dependencies (FMI 3.0), versions.
    pub fn structure(&mut self, r: &mut Random) {
        let Library::Three(f) = &self.fmu.library else { return };
        let mut n = usize::MAX;
        let reals = self.fmu.variables.iter().filter(|v| v.kind == Kind::Real).count();
        match r.below(4) {
            0 if self.is_me() => {
                if ask!(self, f.fmi3GetNumberOfContinuousStates(&mut n)) == 0 && n != self.fmu.states {
                    self.fail("another number of states than described");
                }
            }
            1 if self.is_me() => {
                if ask!(self, f.fmi3GetNumberOfEventIndicators(&mut n)) == 0 && n != self.fmu.indicators {
                    self.fail("another number of event indicators than described");
                }
            }
            2 => {
                self.wrong = true;
                ask!(self, f.fmi3GetNumberOfVariableDependencies(self.reference(r), null_mut()));
            }
            _ => {
                let v = self.reference(r);
                let status = ask!(self, f.fmi3GetNumberOfVariableDependencies(v, &mut n));
                if status != 0 || n > 100 * reals {
                    return;
                }
                let given = if r.once_in(6) { r.below(9) } else { n };
                let (mut i, mut j) = (vec![0usize; given], vec![0usize; given]);
                let mut references = vec![0u32; given];
                let mut kinds = vec![fmi3DependencyKind(-1); given];
                self.wrong = given != n;
                let (a, b, c, d) =
                    (i.as_mut_ptr(), references.as_mut_ptr(), j.as_mut_ptr(), kinds.as_mut_ptr());
                ask!(self, f.fmi3GetVariableDependencies(v, a, b, c, d, given));
            }
        }
    }
}
