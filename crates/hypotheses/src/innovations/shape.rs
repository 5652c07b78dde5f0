//! Shape of a law: what is not an amplitude.

/// Numbers that shape a law at a place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LawShape {
    /// Where it acts: `actuator`, `motor-friction`, `transmission`, `load`, `sensor:<channel>`.
    pub place: &'static str,
    /// Which of the law's forms.
    pub form: &'static str,
    /// Numbers by name.
    pub values: Vec<(&'static str, f64)>,
    /// Begin and width of impulses, s.
    pub pulses: Vec<[f64; 2]>,
}

impl LawShape {
    /// A form with these numbers.
    pub fn new(place: &'static str, form: &'static str, values: &[(&'static str, f64)]) -> Self {
        Self { place, form, values: values.to_vec(), pulses: Vec::new() }
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
