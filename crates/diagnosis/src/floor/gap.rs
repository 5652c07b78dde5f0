//! The gap as a figure: before, tuned, after, floor, and how much of it is closed.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueup_signals::process::overall;

/// A compared channel of a held-out recording, sample by sample, with three simulations of it.
#[derive(Clone, Copy, Debug)]
pub struct ReplayedChannel<'a> {
    /// The recording's name.
    pub recording: &'a str,
    /// The channel's name.
    pub channel: &'a str,
    /// What was measured.
    pub measured: &'a [f64],
    /// By the nominal parameters.
    pub before: &'a [f64],
    /// By the model's own parameters refitted.
    pub tuned: &'a [f64],
    /// With the effects.
    pub after: &'a [f64],
    /// Standard deviation that noise alone would leave, carried input noise included.
    pub floor: f64,
}

impl ReplayedChannel<'_> {
    fn samples(&self) -> usize {
        self.measured.len().min(self.before.len()).min(self.tuned.len()).min(self.after.len())
    }
}

/// Gaps, RMS(simulated - measured) / RMS(measured - its mean).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GapShares {
    /// With nominal parameters.
    pub before: f64,
    /// With refitted parameters.
    pub tuned: f64,
    /// With the effects.
    pub after: f64,
    /// What noise alone would leave.
    pub floor: f64,
    /// (before - after) / (before - floor); `None` when before <= floor.
    pub closed: Option<f64>,
    /// Bootstrap interval of `closed`.
    pub ci95: Option<[f64; 2]>,
}

/// Gaps of all channels.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaps {
    /// Root mean square over the channels; `None` if none varies.
    pub overall: Option<GapShares>,
    /// Of each channel, in the order of appearance.
    pub channels: Vec<(String, GapShares)>,
    /// Channels without variation.
    pub left_out: Vec<String>,
}

/// Blocks that a recording is cut into where there are too few recordings to draw from.
const BLOCKS: usize = 20;
/// From so many recordings on whole recordings are drawn.
const ENOUGH: usize = 6;
const DRAWS: usize = 1000;

/// Sums of squares of a channel in a block: errors before, tuned, after, of the floor, variation.
type GapSums = [f64; 5];

/// Recordings by channel and block.
pub struct Pooled<'a> {
    /// Channels in the order of appearance, and the recordings.
    names: Vec<&'a str>,
    recordings: Vec<&'a str>,
    /// By recording, block and channel.
    blocks: Vec<Vec<Vec<GapSums>>>,
    /// Of each that was pooled: its channel and how many samples it has.
    samples: Vec<(usize, usize)>,
}

impl<'a> Pooled<'a> {
    /// Sums them up.
    pub fn new(replayed: &[ReplayedChannel<'a>]) -> Self {
        let (mut names, mut recordings): (Vec<&str>, Vec<&str>) = Default::default();
        for r in replayed {
            if !names.contains(&r.channel) {
                names.push(r.channel);
            }
            if !recordings.contains(&r.recording) {
                recordings.push(r.recording);
            }
        }
        let mut blocks = vec![vec![vec![GapSums::default(); names.len()]; BLOCKS]; recordings.len()];
        let mut samples = Vec::new();
        for r in replayed {
            let place = |list: &[&str], name: &str| list.iter().position(|n| *n == name).unwrap_or(0);
            let (run, channel) = (place(&recordings, r.recording), place(&names, r.channel));
            for (block, sums) in blocks[run].iter_mut().enumerate() {
                add(&mut sums[channel], r, block);
            }
            samples.push((channel, r.samples()));
        }
        Self { names, recordings, blocks, samples }
    }
    /// Channels that vary, in the order of appearance.
    pub fn channels(&self) -> impl Iterator<Item = &'a str> {
        self.varying(&self.whole()).into_iter().map(|c| self.names[c])
    }
    /// Gap of each of them, without intervals.
    pub fn each(&self) -> Vec<GapShares> {
        let whole = self.whole();
        self.varying(&whole).into_iter().filter_map(|c| together(&whole, &[c])).collect()
    }
    /// What would be the floors of the same channels with these deviations, one for each that was pooled.
    pub fn floors(&self, deviations: &[f64]) -> Vec<f64> {
        let whole = self.whole();
        let mut squares = vec![0.0; self.names.len()];
        for ((channel, samples), deviation) in self.samples.iter().zip(deviations) {
            squares[*channel] += *samples as f64 * deviation.powi(2);
        }
        self.varying(&whole).into_iter().map(|c| (squares[c] / whole[c][4]).sqrt()).collect()
    }
    fn varying(&self, whole: &[GapSums]) -> Vec<usize> {
        (0..self.names.len()).filter(|c| whole[*c][4] > 0.0).collect()
    }
    fn whole(&self) -> Vec<GapSums> {
        pool(self.blocks.iter().flatten(), self.names.len())
    }
}

/// Gap of channels together.
fn together(sums: &[GapSums], which: &[usize]) -> Option<GapShares> {
    let figure =
        |k: usize| overall(&which.iter().map(|c| (sums[*c][k] / sums[*c][4]).sqrt()).collect::<Vec<_>>());
    let (before, tuned, after, floor) = (figure(0)?, figure(1)?, figure(2)?, figure(3)?);
    let closed = (before > floor).then(|| (before - after) / (before - floor));
    Some(GapShares { before, tuned, after, floor, closed, ci95: None })
}

/// Gaps over the held-out recordings, pooled by sample, with intervals from a bootstrap: over recordings where there are
/// at least 6, else over twentieths of each.
pub fn gaps(replayed: &[ReplayedChannel<'_>], seed: u64) -> Gaps {
    let pooled = Pooled::new(replayed);
    let Pooled { names, recordings, blocks, .. } = &pooled;
    let whole = pooled.whole();
    let varies = pooled.varying(&whole);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let draws: Vec<Vec<GapSums>> = (0..DRAWS)
        .map(|_| {
            let runs = recordings.len();
            if runs >= ENOUGH {
                let drawn: Vec<usize> = (0..runs).map(|_| rng.random_range(0..runs)).collect();
                return pool(drawn.iter().flat_map(|r| &blocks[*r]), names.len());
            }
            let drawn: Vec<(usize, usize)> =
                (0..runs * BLOCKS).map(|i| (i / BLOCKS, rng.random_range(0..BLOCKS))).collect();
            pool(drawn.iter().map(|(r, b)| &blocks[*r][*b]), names.len())
        })
        .collect();
    let with_interval = |which: &[usize]| -> Option<GapShares> {
        let mut gap = together(&whole, which)?;
        let mut closed: Vec<f64> =
            draws.iter().filter_map(|d| together(d, which)?.closed).filter(|c| c.is_finite()).collect();
        closed.sort_unstable_by(f64::total_cmp);
        // Where noise alone could be the gap, an interval would be of a ratio of nothings.
        if gap.closed.is_some() && closed.len() * 20 >= DRAWS * 19 {
            let at = |q: f64| closed[((closed.len() - 1) as f64 * q).round() as usize];
            gap.ci95 = Some([at(0.025), at(0.975)]);
        }
        Some(gap)
    };
    Gaps {
        overall: with_interval(&varies),
        channels: varies.iter().filter_map(|c| Some((names[*c].to_owned(), with_interval(&[*c])?))).collect(),
        left_out: (0..names.len()).filter(|c| !varies.contains(c)).map(|c| names[c].to_owned()).collect(),
    }
}

fn pool<'a>(blocks: impl Iterator<Item = &'a Vec<GapSums>>, channels: usize) -> Vec<GapSums> {
    let mut all = vec![GapSums::default(); channels];
    for block in blocks {
        for (all, sums) in all.iter_mut().zip(block) {
            all.iter_mut().zip(sums).for_each(|(a, s)| *a += s);
        }
    }
    all
}

fn add(sums: &mut GapSums, r: &ReplayedChannel<'_>, block: usize) {
    let n = r.samples();
    let measured = &r.measured[..n];
    let mean = measured.iter().sum::<f64>() / n.max(1) as f64;
    // A constant's mean is not always the constant.
    let varies = measured.windows(2).any(|w| w[0] != w[1]);
    for i in block * n / BLOCKS..(block + 1) * n / BLOCKS {
        let m = measured[i];
        for (k, simulated) in [r.before[i], r.tuned[i], r.after[i]].into_iter().enumerate() {
            sums[k] += (simulated - m).powi(2);
        }
        sums[3] += r.floor * r.floor;
        sums[4] += if varies { (m - mean).powi(2) } else { 0.0 };
    }
}
