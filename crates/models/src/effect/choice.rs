//! Which effect, in which place: the meaning of an id.

use super::{ALL, EffectKind, EffectPlace, ParameterSpec, PlantKind, Scope, Spec};

/// An effect and the place in which it acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EffectChoice {
    /// Which effect.
    pub kind: EffectKind,
    /// Which of its specification's places; 0 where it has none.
    pub place: usize,
    /// The plant.
    pub plant: PlantKind,
}

impl EffectChoice {
    /// From `id` or `id:place`; an effect with places acts in the first one that the plant has if none is named.
    ///
    /// # Errors
    /// No effect has that id, or it has not that place, or it does not act in that plant.
    pub fn parse(id: &str, plant: PlantKind) -> Result<Self, EffectError> {
        let (effect, wanted) = id.split_once(':').map_or((id, None), |(effect, place)| (effect, Some(place)));
        let kind = *ALL
            .iter()
            .find(|k| k.spec().id == effect)
            .ok_or_else(|| EffectError::Unknown(effect.to_owned()))?;
        let spec = kind.spec();
        if !spec.plants.contains(&plant) {
            return Err(EffectError::NotHere(spec.id, plant));
        }
        if spec.places.is_empty() && wanted.is_none() {
            return Ok(Self { kind, place: 0, plant });
        }
        spec.places
            .iter()
            .position(|p| p.plants.contains(&plant) && wanted.is_none_or(|name| p.name == name))
            .map(|place| Self { kind, place, plant })
            .ok_or_else(|| EffectError::NoPlace(spec.id, id.to_owned(), plant))
    }
    /// All effects of a plant, each in each of its places, in the order in which they act.
    pub fn all(plant: PlantKind) -> impl Iterator<Item = Self> {
        ALL.iter().filter(move |k| k.spec().plants.contains(&plant)).flat_map(move |kind| {
            let places = kind.spec().places;
            let here = move |i: &usize| places.get(*i).is_none_or(|p| p.plants.contains(&plant));
            (0..places.len().max(1)).filter(here).map(move |place| Self { kind: *kind, place, plant })
        })
    }
    /// `id` or `id:place`.
    pub fn id(&self) -> String {
        match self.place() {
            Some(place) => format!("{}:{}", self.spec().id, place.name),
            None => self.spec().id.to_owned(),
        }
    }
    /// The specification.
    pub fn spec(&self) -> &'static Spec {
        self.kind.spec()
    }
    /// Its place, where it has several.
    pub fn place(&self) -> Option<&'static EffectPlace> {
        self.spec().places.get(self.place)
    }
    /// Where it acts.
    pub fn component(&self) -> &'static str {
        self.place().map_or(self.spec().component, |p| p.component)
    }
    /// How often it occurs there.
    pub fn scope(&self) -> Scope {
        self.place().map_or(self.spec().scope, |p| p.scope)
    }
    /// Its own parameters there.
    pub fn parameters(&self) -> &'static [ParameterSpec] {
        match self.place() {
            Some(place) if !place.parameters.is_empty() => place.parameters,
            _ if self.plant == PlantKind::Space && !self.spec().space_parameters.is_empty() => {
                self.spec().space_parameters
            }
            _ => self.spec().parameters,
        }
    }
    /// The FMU variable of one of its parameters or states of that name.
    pub fn variable(&self, name: &str) -> String {
        let prefix = self.place().map_or("", |p| p.prefix);
        let mut letters = name.chars();
        match letters.next() {
            Some(first) if !prefix.is_empty() => {
                format!("{prefix}{}{}", first.to_uppercase(), letters.as_str())
            }
            _ => name.to_owned(),
        }
    }
    /// The unit of one of its parameters or states.
    pub fn unit(&self, unit: &'static str) -> &'static str {
        let Some(behind) = unit.strip_prefix('*') else { return unit };
        let channel = self.place().map_or("", |p| p.unit);
        match (channel, behind) {
            (own, "") => own,
            ("rad", "/s") => "rad/s",
            ("rad/s", "/s") => "rad/s2",
            ("rad/s2", "/s") => "rad/s3",
            ("m", "/s") => "m/s",
            ("m/s", "/s") => "m/s2",
            ("N.m", "/s") => "N.m/s",
            _ => "1",
        }
    }
}

/// A requested effect that is not possible.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EffectError {
    /// No effect has that id.
    Unknown(String),
    /// It does not act in that plant.
    NotHere(&'static str, PlantKind),
    /// It has places, and that is none of them.
    NoPlace(&'static str, String, PlantKind),
    /// It requires a base that is fixed, and this one floats.
    Floats(&'static str),
    /// It acts on something that this structure does not have: what, and the remedy.
    Nothing(&'static str, &'static str),
    /// Named twice.
    Twice(String),
}

impl std::fmt::Display for EffectError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown(id) => {
                let known: Vec<_> = ALL.iter().map(|k| k.spec().id).collect();
                write!(f, "there is no effect {id:?}; choose from {}", known.join(", "))
            }
            Self::NotHere(id, PlantKind::Space) => {
                let why = ALL.iter().map(|k| k.spec()).find(|s| s.id == *id).map_or("", |s| s.not_in_space);
                write!(f, "the effect {id:?} does not act on a robot in space: {why}")
            }
            Self::NotHere(id, plant) => {
                let (here, other) = if *plant == PlantKind::Joint {
                    ("TwoMassJoint", "PlanarManipulator")
                } else {
                    ("PlanarManipulator", "TwoMassJoint")
                };
                write!(f, "the effect {id:?} does not act in {here}; pack it with {other}")
            }
            Self::NoPlace(id, asked, plant) => {
                let ids: Vec<_> =
                    EffectChoice::all(*plant).filter(|c| c.spec().id == *id).map(|c| c.id()).collect();
                write!(f, "there is no effect {asked:?}; choose from {}", ids.join(", "))
            }
            Self::Nothing(id, what) => write!(f, "the effect {id:?} has nothing to act on: {what}"),
            Self::Floats(id) => write!(
                f,
                "the effect {id:?} requires a fixed base, and this one floats and would fall; choose base = fixed (fmu pack: --structure base=fixed; a case: base = \"fixed\" in [parameters])"
            ),
            Self::Twice(id) => write!(f, "the effect {id:?} is named twice; name it once"),
        }
    }
}
impl std::error::Error for EffectError {}
