//! The variables of the adaptive strategies: parameters, outputs and states behind those of the law.

use super::builder::ControllerTableBuilder;
use trueup_fmi::table::{BoundaryType, Causality, Depends, Enumeration, Storage, TableVariable, Variability};
use trueup_models::controller::{
    self,
    adaptation::{KNOTS, parameter as a, state},
    output,
};

/// State: place, name, unit, unit of the rate, description.
type AdaptationState = (usize, String, &'static str, &'static str, String);

/// The type of the parameter `adaptation`.
pub(super) fn enumeration() -> Enumeration {
    Enumeration {
        name: "Adaptation",
        description: "Where the wave frequency of an adaptive strategy comes from",
        items: vec![
            ("schedule", "omega_n from a table over an angle: scheduleAngle, scheduleFrequency"),
            (
                "estimate",
                "omega_n = waveFrequencyRatio times the mode that recursive least squares find in motor and load angle",
            ),
        ],
    }
}

pub(super) fn states() -> Vec<AdaptationState> {
    let mut all: Vec<AdaptationState> = vec![(
        state::OFFSET,
        "waveFrequencyOffset".into(),
        "rad/s",
        "rad/s2",
        "omega_n used less waveFrequency".into(),
    )];
    for (first, name, of) in [(state::LOAD, "loadFilter", "theta1"), (state::TWIST, "twistFilter", "twist")] {
        for i in 0..3 {
            let corner = if i == 0 { "lower" } else { "upper" };
            let text = format!("lag {} of the band pass of the {of}, at its {corner} corner", i + 1);
            all.push((first + i, format!("{name}{}", i + 1), "rad", "rad/s", text));
        }
    }
    let mean = |what: &str| format!("{what} of the filtered twist over excitationThreshold");
    all.extend([
        (state::EXCITATION, "excitation".into(), "1", "1/s", mean("mean square")),
        (
            state::CORRELATION,
            "regressionCorrelation".into(),
            "1/s2",
            "1/s3",
            mean("mean product, with forgetting, of the filtered acceleration of the load and"),
        ),
        (state::POWER, "regressionPower".into(), "1", "1/s", mean("mean square, with forgetting,")),
    ]);
    let behind = controller::state::COUNT;
    all.into_iter().map(|(i, name, unit, rate, text)| (behind + i, name, unit, rate, text)).collect()
}

impl ControllerTableBuilder {
    /// Start values from `waveFrequency`: a schedule that is constant, bounds a factor of 5 away.
    pub(super) fn adaptation_parameters(&self, wave_frequency: &[f64], threshold: f64) -> Vec<TableVariable> {
        let n = self.joints.unwrap_or(1);
        let new = |name: &str, storage: usize, variability, unit, text: &str| {
            let storage = Storage::Parameter(storage);
            let v = TableVariable::new(name, Causality::Parameter, variability, storage, unit, text);
            if self.joints.is_some() { v.array(&[n]) } else { v }
        };
        let (tunable, fixed) = (Variability::Tunable, Variability::Fixed);
        let own = |i: usize| a::first(n) + i * n;
        let times = |factor: f64| wave_frequency.iter().map(|w| factor * w).collect::<Vec<_>>();
        let table = |name: &str, storage: usize, variability, unit, text: &str| {
            let v = new(name, storage, variability, unit, text);
            if self.joints.is_some() { v.array(&[n, KNOTS]) } else { v.array(&[KNOTS]) }
        };
        let load = self.names.load;
        let over = if n > 1 { format!("{load}Angle of joint scheduleJoint") } else { format!("{load}Angle") };
        let knots: Vec<f64> = (0..n * KNOTS).map(|i| (i % KNOTS) as f64 - 4.0).collect();
        let constant: Vec<f64> = (0..n * KNOTS).map(|i| wave_frequency[i / KNOTS]).collect();
        let nominal = wave_frequency[0];
        let mut all = vec![
            new("adaptation", own(a::ADAPTATION), fixed, "", "where omega_n of WBC_ADAPTIVE and VWBC_ADAPTIVE comes from")
                .kind(BoundaryType::Enumeration(1))
                .start(&vec![2.0; n]),
            new("adaptationRate", own(a::RATE), fixed, "1/s", "lambda: how fast omega_n used goes from waveFrequency to what it should be, and how fast the estimate forgets; 0: waveFrequency throughout")
                .start(&vec![1.0; n])
                .nominal(1.0)
                .at_least(0.0),
            new("waveFrequencyMin", own(a::MIN), fixed, "rad/s", "smallest omega_n used; over waveFrequencyRatio the lower corner of the estimate's band pass")
                .start(&times(0.2))
                .nominal(nominal)
                .above(0.0),
            new("waveFrequencyMax", own(a::MAX), fixed, "rad/s", "largest omega_n used; over waveFrequencyRatio the upper corner of the estimate's band pass")
                .start(&times(5.0))
                .nominal(nominal)
                .above(0.0),
            new("waveFrequencyRatio", own(a::RATIO), fixed, "1", "omega_n over the estimated mode sqrt(K/J) of the joint with its motor held")
                .start(&vec![1.0; n])
                .nominal(1.0)
                .above(0.0),
            new("excitationThreshold", own(a::THRESHOLD), tunable, "rad", "root mean square of the filtered twist motorAngle/gearRatio - theta1 below which the estimate is held: above what the steps of the sensors make")
                .start(&vec![threshold; n])
                .nominal(threshold)
                .above(0.0),
            table("scheduleAngle", a::schedule_angle(n), tunable, "rad", &format!("knots of the schedule, ascending: {over}"))
                .start(&knots)
                .nominal(1.0),
            table("scheduleFrequency", a::schedule_frequency(n), tunable, "rad/s", "omega_n at the knots, linear in between, held beyond the first and the last one")
                .start(&constant)
                .nominal(nominal)
                .above(0.0),
        ];
        if n > 1 {
            let itself: Vec<f64> = (1..=n).map(|j| j as f64).collect();
            let text = "number of the joint over whose angle the schedule runs";
            let mut joint = new("scheduleJoint", a::schedule_joint(n), fixed, "", text)
                .kind(BoundaryType::Integer)
                .start(&itself)
                .at_least(1.0);
            joint.max = Some(n as f64);
            all.push(joint);
        }
        all
    }

    pub(super) fn adaptation_outputs(&self, wave_frequency: f64) -> Vec<TableVariable> {
        let new = |name: &str, variability, index, unit, text: &str| {
            self.variable(name, Causality::Output, variability, Storage::Output, index, unit, text)
        };
        let mut used = new(
            "waveFrequencyUsed",
            Variability::Continuous,
            output::WAVE_FREQUENCY_USED,
            "rad/s",
            "omega_n that the waves use; waveFrequency where the strategy does not adapt",
        )
        .nominal(wave_frequency);
        let mut active = new(
            "adaptationActive",
            Variability::Discrete,
            output::ADAPTATION_ACTIVE,
            "",
            "omega_n moves: a schedule, or an estimate with enough excitation",
        )
        .kind(BoundaryType::Boolean);
        // A schedule may run over any joint's angle.
        used.depends = Depends::All;
        active.depends = Depends::All;
        vec![used, active]
    }
}
