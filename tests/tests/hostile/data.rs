//! Random calls that read and write values, stored states and derivatives.

use super::fmu::{Kind, Library, Variable};
use super::random::Random;
use super::subject::{Phase, Subject, ask};
use core::ffi::{c_char, c_void};
use core::ptr::{null, null_mut};
use trueup_fmi::abi::fmi3::*;
use trueup_fmi_description::description::{DescriptionCausality, DescriptionVariability};

/// Serialized states of all instances of a sequence, with what they were taken from.
#[derive(Default)]
pub struct Pool {
    pub bytes: Vec<Bytes>,
    /// Handles that some instance owns or owned.
    pub handles: Vec<*mut c_void>,
}
pub struct Bytes {
    fmu: *const super::fmu::Fmu,
    model_exchange: bool,
    phase: Phase,
    t: f64,
    bytes: Vec<u8>,
}

/// NULL now and then; with a length that makes the call wrong.
fn maybe_null<T>(p: *const T, n: usize, r: &mut Random, wrong: &mut bool) -> *const T {
    if r.once_in(40) {
        *wrong |= n > 0;
        return null();
    }
    p
}

impl Subject<'_> {
    /// A few variables of one data type; now and then one that does not exist.
    fn choose(&self, r: &mut Random, fits: impl Fn(&Variable) -> bool) -> (Vec<u32>, Vec<&Variable>, bool) {
        let all: Vec<_> = self.fmu.variables.iter().filter(|v| fits(v)).collect();
        let (mut references, mut chosen, mut unknown) = (Vec::new(), Vec::new(), false);
        for _ in 0..r.pick(&[0, 1, 1, 1, 2, 3, 5]) {
            if r.once_in(40) || all.is_empty() {
                references.push(r.pick(&[u32::MAX, 100_000, 0x8000_0000]));
                unknown = true;
            } else {
                let v = r.pick(&all);
                references.push(v.reference);
                chosen.push(v);
            }
        }
        (references, chosen, unknown)
    }
    pub fn read(&mut self, r: &mut Random) {
        let kind = r.pick(&[Kind::Real, Kind::Real, Kind::Real, Kind::Boolean, Kind::Enumeration]);
        let (references, chosen, mut wrong) = self.choose(r, |v| v.kind == kind);
        let needed: usize = chosen.iter().map(|v| v.len).sum::<usize>() + references.len() - chosen.len();
        let len = if self.fmu.is_fmi3() && r.once_in(20) { r.below(12) } else { needed };
        wrong |= len != needed;
        let n = references.len();
        let p = maybe_null(references.as_ptr(), n, r, &mut wrong);
        match kind {
            Kind::Real => {
                let mut out = vec![f64::NAN; len];
                let q = maybe_null(out.as_ptr(), len, r, &mut wrong).cast_mut();
                self.wrong = wrong;
                let status = match &self.fmu.library {
                    Library::Two(f) => ask!(self, f.fmi2GetReal(p, n, q)),
                    Library::Three(f) => ask!(self, f.fmi3GetFloat64(p, n, q, len)),
                };
                if !q.is_null() {
                    // Written through the pointer.
                    let out = out.iter_mut().map(|v| *v).collect::<Vec<_>>();
                    self.finite(status, "Get", &out);
                }
            }
            Kind::Boolean => {
                self.wrong = wrong;
                match &self.fmu.library {
                    Library::Two(f) => ask!(self, f.fmi2GetBoolean(p, n, vec![7; len].as_mut_ptr())),
                    Library::Three(f) => {
                        ask!(self, f.fmi3GetBoolean(p, n, vec![fmi3False; len].as_mut_ptr(), len))
                    }
                };
            }
            _ => {
                self.wrong = wrong;
                match &self.fmu.library {
                    Library::Two(f) => ask!(self, f.fmi2GetInteger(p, n, vec![7; len].as_mut_ptr())),
                    Library::Three(f) => ask!(self, f.fmi3GetInt64(p, n, vec![7; len].as_mut_ptr(), len)),
                };
            }
        }
    }
    /// Sets inputs or (`tune`) parameters, now and then anything.
    pub fn write(&mut self, r: &mut Random, tune: bool) {
        let enumeration = tune && r.once_in(6);
        let kind = if enumeration { Kind::Enumeration } else { Kind::Real };
        let causality = if tune { DescriptionCausality::Parameter } else { DescriptionCausality::Input };
        let anything = r.once_in(15);
        let fits = |v: &Variable| v.kind == kind && (anything || v.causality == causality);
        if !self.fmu.variables.iter().any(fits) {
            return;
        }
        let (references, chosen, mut wrong) = self.choose(r, fits);
        let mut values: Vec<f64> =
            chosen.iter().flat_map(|v| (0..v.len).map(|i| r.value(v, i)).collect::<Vec<_>>()).collect();
        values.resize(values.len() + references.len() - chosen.len(), 0.5);
        if self.fmu.is_fmi3() && r.once_in(20) {
            let len = r.below(12);
            wrong |= len != values.len();
            values.resize(len, 0.1);
        }
        let settable = |v: &Variable| {
            matches!(v.causality, DescriptionCausality::Input | DescriptionCausality::Parameter)
                && v.variability != DescriptionVariability::Constant
        };
        wrong |= !chosen.iter().all(|v| settable(v));
        wrong |= values.iter().any(|v| !v.is_finite());
        let n = references.len();
        let len = values.len();
        let p = maybe_null(references.as_ptr(), n, r, &mut wrong);
        if enumeration {
            let integers: Vec<i64> = values.iter().map(|v| *v as i64).collect();
            let narrow: Vec<i32> = values.iter().map(|v| *v as i32).collect();
            // One bound for each element; those behind are no variable's.
            let items = chosen.iter().flat_map(|v| vec![v.items; v.len]);
            self.wrong = wrong || integers.iter().zip(items).any(|(i, last)| !(1..=last).contains(i));
            match &self.fmu.library {
                Library::Two(f) => ask!(self, f.fmi2SetInteger(p, n, narrow.as_ptr())),
                Library::Three(f) => ask!(self, f.fmi3SetInt64(p, n, integers.as_ptr(), len)),
            };
        } else {
            let q = maybe_null(values.as_ptr(), len, r, &mut wrong);
            self.wrong = wrong;
            match &self.fmu.library {
                Library::Two(f) => ask!(self, f.fmi2SetReal(p, n, q)),
                Library::Three(f) => ask!(self, f.fmi3SetFloat64(p, n, q, len)),
            };
        }
    }
    pub fn nominals(&mut self, r: &mut Random) {
        let n = if r.once_in(8) { r.below(30) } else { self.fmu.states };
        let mut out = vec![f64::NAN; n];
        self.wrong = n != self.fmu.states || !self.is_me();
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetNominalsOfContinuousStates(out.as_mut_ptr(), n)),
            Library::Three(f) => ask!(self, f.fmi3GetNominalsOfContinuousStates(out.as_mut_ptr(), n)),
        };
        self.finite(status, "nominals", &out);
    }

    /// FMU states as handles: taken, overwritten, restored, freed; own ones, foreign ones, freed ones, rubbish.
    pub fn handles(&mut self, r: &mut Random, pool: &mut Pool) {
        let own = !self.states.is_empty() && !r.once_in(6);
        let at = r.below(self.states.len());
        let mut handle = match own {
            true => self.states[at].0,
            false if !pool.handles.is_empty() && r.once_in(2) => r.pick(&pool.handles),
            false => r.pick(&[null_mut(), self.c, 8usize as *mut c_void, usize::MAX as *mut c_void]),
        };
        let found = self.states.iter().position(|s| s.0 == handle);
        match r.below(6) {
            0 | 1 => {
                if self.store() == 0 {
                    pool.handles.push(self.states[self.states.len() - 1].0);
                }
            }
            2 => {
                // Over an older one; NULL makes a new one.
                self.wrong = found.is_none() && !handle.is_null();
                let status = match &self.fmu.library {
                    Library::Two(f) => ask!(self, f.fmi2GetFMUstate(&mut handle)),
                    Library::Three(f) => ask!(self, f.fmi3GetFMUState(&mut handle)),
                };
                if status == 0 {
                    let new = (handle, self.phase, self.t);
                    if let Some(i) = found { self.states[i] = new } else { self.states.push(new) }
                }
            }
            3 => {
                self.wrong = found.is_none();
                let status = match &self.fmu.library {
                    Library::Two(f) => ask!(self, f.fmi2SetFMUstate(handle)),
                    Library::Three(f) => ask!(self, f.fmi3SetFMUState(handle)),
                };
                if status == 0
                    && let Some(i) = found
                {
                    (_, self.phase, self.t) = self.states[i];
                }
            }
            _ => {
                self.wrong = found.is_none() && !handle.is_null();
                let status = match &self.fmu.library {
                    Library::Two(f) => ask!(self, f.fmi2FreeFMUstate(&mut handle)),
                    Library::Three(f) => ask!(self, f.fmi3FreeFMUState(&mut handle)),
                };
                if status == 0 && !handle.is_null() {
                    self.fail("the handle of a freed state is left");
                }
                if status == 0
                    && let Some(i) = found
                {
                    self.states.swap_remove(i);
                }
            }
        }
    }
    /// FMU states as bytes: written, into short buffers too; read whole, damaged, or of somebody else.
    pub fn bytes(&mut self, r: &mut Random, pool: &mut Pool) {
        if r.once_in(2) || pool.bytes.is_empty() {
            let Some((handle, phase, t)) = self.states.last().copied() else { return };
            let mut size = 0;
            let status = match &self.fmu.library {
                Library::Two(f) => ask!(self, f.fmi2SerializedFMUstateSize(handle, &mut size)),
                Library::Three(f) => ask!(self, f.fmi3SerializedFMUStateSize(handle, &mut size)),
            };
            if status != 0 {
                self.fail("a stored state has no size");
            }
            let short = if r.once_in(4) { r.below(size) } else { size };
            let mut bytes = vec![0u8; short];
            self.wrong = short < size;
            let p = bytes.as_mut_ptr();
            let status = match &self.fmu.library {
                Library::Two(f) => ask!(self, f.fmi2SerializeFMUstate(handle, p.cast::<c_char>(), short)),
                Library::Three(f) => ask!(self, f.fmi3SerializeFMUState(handle, p, short)),
            };
            if status == 0 {
                pool.bytes.push(Bytes { fmu: self.fmu, model_exchange: self.is_me(), phase, t, bytes });
            }
            return;
        }
        let from = &pool.bytes[r.below(pool.bytes.len())];
        let mut bytes = from.bytes.clone();
        let mut wrong = !core::ptr::eq(from.fmu, self.fmu) || from.model_exchange != self.is_me();
        match r.below(6) {
            0 => {
                let i = r.below(bytes.len());
                bytes[i] ^= 1 << r.below(8);
                wrong = true;
            }
            1 => {
                bytes.truncate(r.below(bytes.len()));
                wrong = true;
            }
            2 => {
                bytes.extend((0..=r.below(20)).map(|_| 0));
                wrong = true;
            }
            3 => {
                let i = r.below(bytes.len() - 4);
                bytes[i..i + 4].copy_from_slice(&(r.next() as u32).to_le_bytes());
                wrong |= bytes != from.bytes;
            }
            _ => {}
        }
        let (phase, t) = (from.phase, from.t);
        let p = maybe_null(bytes.as_ptr(), bytes.len(), r, &mut wrong);
        let mut handle = null_mut();
        self.wrong = wrong;
        let status = match &self.fmu.library {
            Library::Two(f) => {
                ask!(self, f.fmi2DeSerializeFMUstate(p.cast::<c_char>(), bytes.len(), &mut handle))
            }
            Library::Three(f) => ask!(self, f.fmi3DeserializeFMUState(p, bytes.len(), &mut handle)),
        };
        if status == 0 {
            self.states.push((handle, phase, t));
        }
    }

    /// Directional and adjoint derivatives of anything by anything.
    pub fn directional(&mut self, r: &mut Random) {
        let sane = !r.once_in(5);
        let unknown = |v: &Variable| {
            v.kind == Kind::Real
                && (!sane || v.causality == DescriptionCausality::Output || v.name.starts_with("der("))
        };
        let input =
            |v: &Variable| v.kind == Kind::Real && (!sane || v.causality == DescriptionCausality::Input);
        let (unknowns, u, w1) = self.choose(r, unknown);
        let (knowns, k, w2) = self.choose(r, input);
        let length = |vs: &[&Variable], all: usize| vs.iter().map(|v| v.len).sum::<usize>() + all - vs.len();
        let (nu, nk) = (length(&u, unknowns.len()), length(&k, knowns.len()));
        let adjoint = self.fmu.is_fmi3() && r.once_in(2);
        let (mut seeds, mut results) = if adjoint { (nu, nk) } else { (nk, nu) };
        let mut wrong = w1 || w2;
        if self.fmu.is_fmi3() && r.once_in(15) {
            let (a, b) = (r.below(9), r.below(9));
            wrong |= (a, b) != (seeds, results);
            (seeds, results) = (a, b);
        }
        let seed: Vec<f64> = (0..seeds).map(|_| r.number()).collect();
        let mut out = vec![f64::NAN; results];
        let (pu, nu) = (maybe_null(unknowns.as_ptr(), unknowns.len(), r, &mut wrong), unknowns.len());
        let (pk, nk) = (maybe_null(knowns.as_ptr(), knowns.len(), r, &mut wrong), knowns.len());
        let (s, o) = (maybe_null(seed.as_ptr(), seeds, r, &mut wrong), out.as_mut_ptr());
        self.wrong = wrong;
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetDirectionalDerivative(pu, nu, pk, nk, s, o)),
            Library::Three(f) if adjoint => {
                ask!(self, f.fmi3GetAdjointDerivative(pu, nu, pk, nk, s, seeds, o, results))
            }
            Library::Three(f) => {
                ask!(self, f.fmi3GetDirectionalDerivative(pu, nu, pk, nk, s, seeds, o, results))
            }
        };
        self.finite(status, "derivatives", &out);
    }
    /// Derivatives of inputs (FMI 2.0) and outputs in time.
    pub fn slopes(&mut self, r: &mut Random, of_inputs: bool) {
        let causality = if of_inputs { DescriptionCausality::Input } else { DescriptionCausality::Output };
        let (references, chosen, mut wrong) =
            self.choose(r, |v| v.kind == Kind::Real && v.causality == causality);
        let len = chosen.iter().map(|v| v.len).sum::<usize>() + references.len() - chosen.len();
        let orders: Vec<i32> =
            references.iter().map(|_| r.pick(&[1, 1, 1, 1, 1, 0, 2, -1, i32::MAX])).collect();
        let n = references.len();
        let p = maybe_null(references.as_ptr(), n, r, &mut wrong);
        let o = maybe_null(orders.as_ptr(), n, r, &mut wrong);
        let mut values: Vec<f64> = (0..len).map(|_| r.number()).collect();
        wrong |= self.is_me() || orders.iter().any(|o| *o != 1);
        match &self.fmu.library {
            Library::Two(f) if of_inputs => {
                self.wrong = wrong || values.iter().any(|v| !v.is_finite());
                ask!(self, f.fmi2SetRealInputDerivatives(p, n, o, values.as_ptr()));
            }
            Library::Two(f) => {
                self.wrong = wrong;
                let status = ask!(self, f.fmi2GetRealOutputDerivatives(p, n, o, values.as_mut_ptr()));
                self.finite(status, "output derivatives", &values);
            }
            Library::Three(f) if !of_inputs => {
                self.wrong = wrong;
                let status = ask!(self, f.fmi3GetOutputDerivatives(p, n, o, values.as_mut_ptr(), len));
                self.finite(status, "output derivatives", &values);
            }
            Library::Three(_) => {}
        }
    }
}
