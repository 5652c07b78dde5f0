//! What the page of a diagnosis shows in addition to `diagnosis.json`.

use trueup_diagnosis::diagnose;
use trueup_diagnosis::locate::map::{Curve, ForceSurface};
use trueup_diagnosis::locate::{Bands, ResidualOrder};
use trueup_diagnosis::picture::Picture;

/// What the page shows in addition to `diagnosis.json`; whatever is empty is left out.
#[derive(Clone, Debug, Default)]
pub struct Evidence<'a> {
    /// What was measured, before and after, laid over each other; the part at fault is lit.
    pub scene: Option<trueup_scene::Scene>,
    /// Name of the case.
    pub case: &'a str,
    /// Compared channels over time, the held-out recordings first.
    pub traces: Vec<EvidenceTrace<'a>>,
    /// The twists of transmissions over time.
    pub twists: Vec<EvidenceTrace<'a>>,
    /// Options of `trueup simulate` that play the first recording with the augmented model, in the folder of the page.
    pub replay: Option<Vec<String>>,
    /// What is missing, as pictures.
    pub maps: Vec<EvidenceMap<'a>>,
    /// The noise floor of each channel: channel, its standard deviation with unit, where it comes from.
    pub floors: Vec<[String; 3]>,
    /// Inputs of the next experiment: name, unit, times in s, values.
    pub next: Vec<(&'a str, &'a str, &'a [f64], &'a [f64])>,
    /// What was read, and what was assumed of it.
    pub intake: IntakeEvidence,
    /// Files that are written next to the page.
    pub files: Vec<String>,
    /// How it was done: setting and value.
    pub settings: Vec<[String; 2]>,
    /// With what: program or library and version.
    pub versions: Vec<[String; 2]>,
}

/// A channel of a recording, measured and simulated.
#[derive(Clone, Copy, Debug, Default)]
pub struct EvidenceTrace<'a> {
    /// The recording.
    pub recording: &'a str,
    /// The channel.
    pub channel: &'a str,
    /// Its unit.
    pub unit: &'a str,
    /// Times in s.
    pub time: &'a [f64],
    /// What was measured.
    pub measured: &'a [f64],
    /// Simulated with nominal parameters.
    pub before: &'a [f64],
    /// With the model's own parameters refitted.
    pub tuned: &'a [f64],
    /// With the effects.
    pub after: &'a [f64],
    /// Standard deviation that noise alone leaves.
    pub floor: f64,
}

/// A picture of what is missing.
#[derive(Clone, Copy, Debug)]
pub enum EvidenceMap<'a> {
    /// A quantity along another, with the band of its mean.
    Curve {
        /// Title of the picture.
        title: &'a str,
        /// Quantity and unit along x.
        x: [&'a str; 2],
        /// Unit of the quantity.
        unit: &'a str,
        /// Before the effects were added.
        before: &'a Curve,
        /// With them.
        after: Option<&'a Curve>,
    },
    /// A quantity over two others.
    Surface {
        /// Title of the picture.
        title: &'a str,
        /// Quantity and unit along x.
        x: [&'a str; 2],
        /// Quantity and unit along y.
        y: [&'a str; 2],
        /// Unit of the quantity.
        unit: &'a str,
        /// The cells.
        surface: &'a ForceSurface,
    },
    /// Spectrum of a residual against that of noise.
    Spectrum {
        /// Title of the picture.
        title: &'a str,
        /// Unit of the residual.
        unit: &'a str,
        /// The spectra.
        bands: &'a Bands,
    },
    /// Amplitudes over the order of an angle.
    Orders {
        /// Title of the picture.
        title: &'a str,
        /// Unit of the amplitude.
        unit: &'a str,
        /// Periods per turn with their amplitudes.
        orders: &'a [ResidualOrder],
    },
    /// An unknown quantity over time.
    Course {
        /// Title of the picture.
        title: &'a str,
        /// The recording.
        recording: &'a str,
        /// Its unit.
        unit: &'a str,
        /// Times in s.
        time: &'a [f64],
        /// Its estimate.
        value: &'a [f64],
    },
}

/// Of the recordings so many are drawn.
pub(super) const RECORDINGS: usize = 4;

impl<'a> EvidenceMap<'a> {
    /// What a case shows before any effect is named: courses of some recordings, surfaces, curves, orders, spectra.
    pub fn of(picture: &'a Picture) -> Vec<Self> {
        fn pair(of: &[String; 2]) -> [&str; 2] {
            [&of[0], &of[1]]
        }
        let surfaces = picture.surfaces.iter().map(|s| {
            let (x, y) = (pair(&s.x), pair(&s.y));
            EvidenceMap::Surface { title: &s.title, x, y, unit: &s.unit, surface: &s.map }
        });
        let curves = picture.curves.iter().map(|c| {
            let (x, before, after) = (pair(&c.x), &c.map, None);
            EvidenceMap::Curve { title: &c.title, x, unit: &c.unit, before, after }
        });
        let orders = picture.orders.iter().map(|o| EvidenceMap::Orders {
            title: &o.title,
            unit: &o.unit,
            orders: &o.map,
        });
        let bands = picture.bands.iter().map(|b| EvidenceMap::Spectrum {
            title: &b.title,
            unit: &b.unit,
            bands: &b.map,
        });
        let courses = picture.courses.iter().take(RECORDINGS).map(|c| EvidenceMap::Course {
            title: &c.title,
            recording: &c.recording,
            unit: &c.unit,
            time: &c.time,
            value: &c.value,
        });
        courses.chain(surfaces).chain(curves).chain(orders).chain(bands).collect()
    }
}

impl<'a> EvidenceTrace<'a> {
    /// What the diagnosis compared, in this unit.
    pub fn of(t: &'a diagnose::ChannelTrace, unit: &'a str) -> Self {
        let diagnose::ChannelTrace { recording, channel, time, measured, before, tuned, after, floor } = t;
        Self { recording, channel, unit, time, measured, before, tuned, after, floor: *floor }
    }
}

/// What was read and what was assumed of it.
#[derive(Clone, Debug, Default)]
pub struct IntakeEvidence {
    /// Recordings in the order of the case.
    pub recordings: Vec<RecordingEvidence>,
    /// Channels: name, unit, role in the model, what is known of it.
    pub channels: Vec<[String; 4]>,
    /// What was assumed, a sentence each.
    pub assumptions: Vec<String>,
    /// The command line.
    pub command: String,
}

/// A recording.
#[derive(Clone, Debug, Default)]
pub struct RecordingEvidence {
    /// Its file in the case's folder.
    pub name: String,
    /// What the case uses it for.
    pub role: String,
    /// s.
    pub duration: String,
    /// Readings a second.
    pub rate: String,
    /// How many channels it has.
    pub channels: usize,
}
