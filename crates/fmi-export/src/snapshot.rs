//! FMU states: stored, restored, as bytes and back.

use crate::fault::{CallOutcome, error};
use crate::instance::ModelInstance;
use crate::memory::{InstanceMemory, StoredState};
use crate::model::FmuModel;
use crate::state_machine::{CallGroup, InstanceState, InstanceVersion, InterfaceType};

/// First bytes of a serialized state, with the format's version.
const HEAD: &[u8; 12] = b"TRUEUPSTATE\x01";

/// FNV-1a, 64 bits: finds damage, no protection against intent.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0000_0100_0000_01b3))
}

impl<M: FmuModel> ModelInstance<M> {
    /// Stores the state, over an older one where a handle is given; returns its handle.
    pub fn get_state(&mut self, handle: usize) -> CallOutcome<usize> {
        self.permit(CallGroup::Any)?;
        if handle == 0 {
            let new = Box::new(StoredState { memory: self.memory.clone() });
            let handle = handle_of(&new);
            self.snapshots.push(new);
            return Ok(handle);
        }
        let i = self.position(handle)?;
        self.snapshots[i].memory = self.memory.clone();
        Ok(handle)
    }
    /// Restores a stored state, mode of the instance included.
    pub fn set_state(&mut self, handle: usize) -> CallOutcome {
        self.permit(CallGroup::Any)?;
        let i = self.position(handle)?;
        self.memory.clone_from(&self.snapshots[i].memory);
        self.touch();
        Ok(())
    }
    /// Frees a stored state (0: nothing to do).
    pub fn free_state(&mut self, handle: usize) -> CallOutcome {
        self.permit(CallGroup::Any)?;
        if handle != 0 {
            let i = self.position(handle)?;
            self.snapshots.swap_remove(i);
        }
        Ok(())
    }
    fn position(&self, handle: usize) -> CallOutcome<usize> {
        match self.snapshots.iter().position(|s| handle_of(s) == handle) {
            Some(i) => Ok(i),
            None => error(
                "the FMU state was not made by this instance or is freed: \
                 get it from this instance, or bring it here by serialization",
            ),
        }
    }
    /// Number of bytes of a serialized state.
    pub fn serialized_size(&mut self, handle: usize) -> CallOutcome<usize> {
        Ok(self.bytes(handle)?.len())
    }
    /// Serializes a stored state into the beginning of `out`.
    pub fn serialize(&mut self, handle: usize, out: &mut [u8]) -> CallOutcome {
        let bytes = self.bytes(handle)?;
        let Some(out) = out.get_mut(..bytes.len()) else {
            return error(format!(
                "size = {}, but the state needs {} bytes: call fmiXSerializedFMUStateSize",
                out.len(),
                bytes.len()
            ));
        };
        out.copy_from_slice(&bytes);
        Ok(())
    }
    fn bytes(&self, handle: usize) -> CallOutcome<Vec<u8>> {
        self.permit(CallGroup::Any)?;
        let m = &self.snapshots[self.position(handle)?].memory;
        let mut w = HEAD.to_vec();
        let kind = [u8::from(self.settings.version == InstanceVersion::Fmi3), u8::from(self.integrates())];
        w.extend(kind);
        for n in [self.token.len(), m.x.len(), m.u.len(), m.p.len(), m.modes.len()] {
            w.extend((n as u32).to_le_bytes());
        }
        w.extend(self.token.as_bytes());
        w.extend([m.state as u8, u8::from(m.start_stale), u8::from(m.unchecked), u8::from(m.slopes_new)]);
        w.extend([u8::from(m.stop_time.is_some())]);
        w.extend(m.passes.to_le_bytes());
        let scalars = [m.t, m.start_time, m.stop_time.unwrap_or_default(), m.tolerance, m.last_successful];
        for values in [&scalars[..], &m.driver.to_array(), &m.x, &m.u, &m.slopes, &m.p] {
            values.iter().for_each(|v| w.extend(v.to_le_bytes()));
        }
        m.modes.iter().for_each(|v| w.extend(v.to_le_bytes()));
        w.extend(m.set.iter().map(|s| u8::from(*s)));
        let sum = checksum(&w);
        w.extend(sum.to_le_bytes());
        Ok(w)
    }
    /// Makes a stored state of bytes that [`ModelInstance::serialize`] wrote, in this process or another one.
    pub fn deserialize(&mut self, bytes: &[u8]) -> CallOutcome<usize> {
        self.permit(CallGroup::Any)?;
        let memory = match self.parse(bytes) {
            Ok(memory) => memory,
            Err(why) => return error(format!("these {} bytes are no state of this FMU: {why}", bytes.len())),
        };
        let new = Box::new(StoredState { memory });
        let handle = handle_of(&new);
        self.snapshots.push(new);
        Ok(handle)
    }
    fn parse(&self, bytes: &[u8]) -> Result<InstanceMemory, String> {
        let mut r = SnapshotReader { rest: bytes };
        if r.take(HEAD.len())? != HEAD {
            return Err("they do not begin as a state of this format".to_owned());
        }
        let body = bytes.len().saturating_sub(8);
        let sum = bytes.get(body..).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        let kind = r.take(2)?;
        let own = [u8::from(self.settings.version == InstanceVersion::Fmi3), u8::from(self.integrates())];
        if kind != own {
            return Err("they belong to the other FMI version or interface type".to_owned());
        }
        let mut counts = [0usize; 5];
        for n in &mut counts {
            *n = r.u32()? as usize;
        }
        let token = r.take(counts[0])?;
        if token != self.token.as_bytes() {
            return Err(format!(
                "they belong to the FMU {}, this one is {}",
                String::from_utf8_lossy(token),
                self.token
            ));
        }
        let n = self.layout.sizes;
        if counts[1..] != [n.states, n.inputs, n.parameters, n.modes] {
            return Err("the numbers of states, inputs, parameters or modes differ".to_owned());
        }
        let state = r.take(1)?[0];
        let state = InstanceState::from_number(state).ok_or_else(|| format!("unknown mode {state}"))?;
        let flags = [r.flag()?, r.flag()?, r.flag()?, r.flag()?];
        let passes = r.u32()?;
        let s: [f64; 5] = r.array()?;
        let memory = InstanceMemory {
            state,
            t: s[0],
            start_time: s[1],
            stop_time: flags[3].then_some(s[2]),
            tolerance: s[3],
            last_successful: s[4],
            driver: trueup_numerics::driver::DriverMemory::from_array(r.array()?),
            x: r.doubles(n.states)?,
            u: r.doubles(n.inputs)?,
            slopes: r.doubles(n.inputs)?,
            p: r.doubles(n.parameters)?,
            modes: (0..n.modes).map(|_| r.u32().map(|v| v as i32)).collect::<Result<_, _>>()?,
            set: (0..n.parameters).map(|_| r.flag()).collect::<Result<_, _>>()?,
            start_stale: flags[0],
            unchecked: flags[1],
            slopes_new: flags[2],
            passes,
        };
        if r.rest.len() != 8 {
            return Err(format!("they are {} bytes too long", r.rest.len().saturating_sub(8)));
        }
        if sum != Some(checksum(&bytes[..body])) {
            return Err("their checksum is wrong: they were damaged".to_owned());
        }
        let fits = match self.settings.interface {
            InterfaceType::ModelExchange => !matches!(state, InstanceState::Step | InstanceState::StepFailed),
            InterfaceType::CoSimulation => state != InstanceState::ContinuousTime,
        };
        if !fits
            || matches!(
                state,
                InstanceState::Stepping | InstanceState::IntermediateUpdate | InstanceState::Fatal
            )
        {
            return Err(format!("the mode {state:?} cannot be restored"));
        }
        Ok(memory)
    }
}

fn handle_of(s: &StoredState) -> usize {
    core::ptr::from_ref(s) as usize
}

struct SnapshotReader<'a> {
    rest: &'a [u8],
}

impl<'a> SnapshotReader<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (head, rest) = self.rest.split_at_checked(n).ok_or("they end too early")?;
        self.rest = rest;
        Ok(head)
    }
    fn u32(&mut self) -> Result<u32, String> {
        let b = self.take(4)?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    }
    fn flag(&mut self) -> Result<bool, String> {
        Ok(self.take(1)?[0] != 0)
    }
    fn array<const N: usize>(&mut self) -> Result<[f64; N], String> {
        self.doubles(N)?.try_into().map_err(|_| "they end too early".to_owned())
    }
    fn doubles(&mut self, n: usize) -> Result<Vec<f64>, String> {
        let bytes = self.take(n.saturating_mul(8))?;
        Ok(bytes
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
            .collect())
    }
}
