//! How far a simulation is from a measurement.

/// Root mean square; `NaN` without values.
pub fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

/// RMS(simulated - measured) / RMS(measured - its mean); `None` for a channel without variation.
pub fn nrmse(simulated: &[f64], measured: &[f64]) -> Option<f64> {
    let mut misfit = Misfit::default();
    misfit.add(simulated, measured);
    misfit.nrmse()
}

/// A channel's misfit over several recordings, pooled by sample: each sample counts the same, each recording's variation
/// is about its own mean (where a run began is no variation that a simulation could explain).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Misfit {
    /// Number of samples.
    pub samples: usize,
    /// Sum of (simulated - measured)^2.
    pub error: f64,
    /// Sum of (measured - its mean)^2.
    pub variation: f64,
}

impl Misfit {
    /// Adds a recording; samples without a partner do not count.
    pub fn add(&mut self, simulated: &[f64], measured: &[f64]) {
        let n = simulated.len().min(measured.len());
        let (simulated, measured) = (&simulated[..n], &measured[..n]);
        let mean = measured.iter().sum::<f64>() / n as f64;
        self.samples += n;
        self.error += simulated.iter().zip(measured).map(|(s, m)| (s - m).powi(2)).sum::<f64>();
        // A constant's mean is not always the constant.
        if measured.windows(2).any(|w| w[0] != w[1]) {
            self.variation += measured.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
        }
    }

    /// RMS of the error in the channel's unit; `NaN` without samples.
    pub fn rms(&self) -> f64 {
        (self.error / self.samples as f64).sqrt()
    }

    /// The gap; `None` without variation.
    pub fn nrmse(&self) -> Option<f64> {
        (self.variation > 0.0).then(|| (self.error / self.variation).sqrt())
    }
}

/// The overall gap: the root mean square over the channels; `None` without any.
pub fn overall(gaps: &[f64]) -> Option<f64> {
    (!gaps.is_empty()).then(|| rms(gaps))
}
