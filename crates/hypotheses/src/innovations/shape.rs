//! Shape of a law: what is not an amplitude.

/// Numbers that shape a law at a place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LawShape {
    /// Where it acts: `actuator`, `motor-friction`, `transmission`, `load`, `base`, `tip`, `sensor:<channel>`, or `sensor` with its
    /// channels.
    pub place: &'static str,
    /// Joints at which it acts, from 0; empty: the first one.
    pub joints: Vec<usize>,
    /// Channels that it concerns; empty: that of its place.
    pub channels: Vec<usize>,
    /// Which of the law's forms.
    pub form: &'static str,
    /// Numbers by name.
    pub values: Vec<(&'static str, f64)>,
    /// Begin and width of impulses, s.
    pub pulses: Vec<[f64; 2]>,
    /// Recording of each impulse; empty: all of them are in every recording.
    pub only: Vec<usize>,
    /// How often the prior of its sizes is widened: its heavy tail. 0: the usual one.
    pub widened: u8,
}

impl LawShape {
    /// A form with these numbers.
    pub fn new(place: &'static str, form: &'static str, values: &[(&'static str, f64)]) -> Self {
        Self { place, form, values: values.to_vec(), ..Self::default() }
    }
    /// The same at these joints.
    pub fn at(mut self, joints: &[usize]) -> Self {
        self.joints = joints.to_vec();
        self
    }
    /// The same of these channels.
    pub fn of(mut self, channels: &[usize]) -> Self {
        self.channels = channels.to_vec();
        self
    }
    /// Joints at which it acts.
    pub fn joints(&self) -> &[usize] {
        if self.joints.is_empty() { &[0] } else { &self.joints }
    }
    /// The first joint at which it acts.
    pub fn joint(&self) -> usize {
        self.joints()[0]
    }
    /// A number; 0 where there is none of that name.
    pub fn value(&self, name: &str) -> f64 {
        self.get(name).unwrap_or(0.0)
    }
    /// A number, where there is one of that name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values.iter().find(|v| v.0 == name).map(|v| v.1)
    }
    /// The same with another number.
    pub fn with(&self, name: &str, value: f64) -> Self {
        let mut shape = self.clone();
        shape.values.iter_mut().filter(|v| v.0 == name).for_each(|v| v.1 = value);
        shape
    }
}

/// Numbers from the first to the second in even ratios, as many as the third gives.
pub fn geometric((from, to, count): (f64, f64, usize)) -> impl Iterator<Item = f64> {
    let ratio = (to / from).ln() / (count - 1) as f64;
    (0..count).map(move |k| from * (ratio * k as f64).exp())
}
