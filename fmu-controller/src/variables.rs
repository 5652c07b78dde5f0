//! The variable tables of JointController and ManipulatorController.

use super::adaptation;
use super::builder::{ControllerNames, ControllerTableBuilder};
use trueup_fmi::table::{
    BoundaryType, Causality, Depends, Enumeration, ModelTable, Storage, TableExperiment, TableVariable,
    Terminal, Variability,
};
use trueup_models::controller::{input, output, parameter, state};

/// The input that an arm's controller has in addition.
const TORQUE_FEEDFORWARD: &str = "torqueFeedforward";

/// Table of JointController; the defaults fit joint 1 of ESA's DELIAN arm (n = 44340, J_m = 1.2e-7 kg.m2).
pub fn joint_controller() -> ModelTable {
    let n = 44340.0;
    let names = ControllerNames {
        load: "load",
        output: "motorCurrent",
        unit: "A",
        limit: "currentLimit",
        torque_constant: "N.m/A",
        torque_constant_text: "torque constant K_t of the motor",
        threshold: 5e-5,
    };
    let defaults = [[2.5], [7.2e-6 * n * n], [0.1], [n], [0.02], [0.25], [41.648], [1.0]];
    let mut table =
        ControllerTableBuilder { names, joints: None }.table(&defaults.each_ref().map(|d| d.as_slice()));
    table.name = "JointController".into();
    table.description = "P/PI and wave-based control of one flexible joint, with current limit".into();
    table
}

/// Table of ManipulatorController for `joints` joints; the defaults fit the CBK PAN air-bearing test-bed (joint
/// 1 flexible with a motor of 5.6 kg.m2; joints 2 and 3 rigid with 0.578 and 0.098 kg.m2 as they float freely),
/// the last joint's serving for all further ones.
pub fn manipulator_controller(joints: usize) -> ModelTable {
    let names = ControllerNames {
        load: "joint",
        output: "jointTorque",
        unit: "N.m",
        limit: "torqueLimit",
        torque_constant: "1",
        torque_constant_text: "drive constant K_t: motor torque delivered per torque commanded",
        threshold: 1e-4,
    };
    let test_bed = [
        [0.1, 0.5, 0.5],
        [56.0, 5.8, 1.0],
        [1.0; 3],
        [1.0; 3],
        [1.0; 3],
        [2.0, 1.0, 0.5],
        [1.494, 10.0, 10.0],
        [0.05, 0.1, 0.1],
    ];
    let defaults = test_bed.map(|d| (0..joints).map(|j| d[j.min(2)]).collect::<Vec<_>>());
    let mut table = ControllerTableBuilder { names, joints: Some(joints) }
        .table(&defaults.each_ref().map(|d| d.as_slice()));
    table.name = "ManipulatorController".into();
    table.description = "P/PI and wave-based control of the joints of an arm, with torque limits".into();
    table.experiment = TableExperiment { stop_time: 60.0, tolerance: 1e-6, step_size: 0.01 };
    table
}

impl ControllerTableBuilder {
    fn parameters(&self, defaults: &[&[f64]; parameter::COUNT]) -> Vec<TableVariable> {
        use parameter as p;
        let names = &self.names;
        let new = |name: &str, index: usize, variability, unit, text: &str| {
            let v =
                self.variable(name, Causality::Parameter, variability, Storage::Parameter, index, unit, text);
            let nominal = defaults[index][0];
            v.start(defaults[index]).nominal(nominal)
        };
        let (tunable, fixed) = (Variability::Tunable, Variability::Fixed);
        let scalars = p::COUNT * self.joints.unwrap_or(1);
        let limit =
            format!("limit of the magnitude of {}; the integral does not wind up at it", names.output);
        vec![
            new("positionGain", p::POSITION_GAIN, tunable, "1/s", "position gain K_p: velocity reference v = K_p (r - theta1) in P_PI; see strategy")
                .at_least(0.0),
            new("velocityGain", p::VELOCITY_GAIN, tunable, "N.m.s/rad", "velocity gain K_vp, load-referred: tau = K_vp (v - theta0') + K_vi integral of (v - theta0')")
                .at_least(0.0),
            new("velocityIntegralTime", p::VELOCITY_INTEGRAL_TIME, tunable, "s", "integral time T_i of the velocity loop, also the tracking time at the limit: K_vi = K_vp/T_i")
                .above(0.0),
            new("gearRatio", p::GEAR_RATIO, fixed, "1", "gear ratio n: theta0 = motorAngle/n, motor torque = tau/n").above(0.0),
            new("torqueConstant", p::TORQUE_CONSTANT, fixed, names.torque_constant, &format!("{}: {} = tau/(n K_t)", names.torque_constant_text, names.output))
                .above(0.0),
            new(names.limit, p::LIMIT, tunable, names.unit, &limit).above(0.0),
            new("waveFrequency", p::WAVE_FREQUENCY, tunable, "rad/s", "omega_n of the wave transfer function G = omega_n^2/(s^2 + omega_n s + omega_n^2), a setting of the damping")
                .above(0.0),
            new("washoutFrequency", p::WASHOUT_FREQUENCY, tunable, "rad/s", "omega_h of VWBC_WASHOUT: below it P_PI replaces the waves")
                .above(0.0),
            TableVariable::new("samplePeriod", Causality::Parameter, fixed, Storage::Parameter(scalars), "s", "sample period T_s of the controller, output held in between; 0: continuous")
                .start(&[0.0])
                .nominal(1e-3)
                .at_least(0.0),
            TableVariable::new("strategy", Causality::Parameter, fixed, Storage::Parameter(scalars + 1), "", "what makes the velocity reference v")
                .kind(BoundaryType::Enumeration(0))
                .start(&[1.0]),
        ]
    }

    fn inputs(&self) -> Vec<TableVariable> {
        let load = self.names.load;
        let n = self.joints.unwrap_or(1);
        let new = |name: &str, index, unit, text: &str| {
            self.variable(name, Causality::Input, Variability::Continuous, Storage::Input, index, unit, text)
                .start(&vec![0.0; n])
                .nominal(1.0)
        };
        vec![
            new(
                "positionReference",
                input::POSITION_REFERENCE,
                "rad",
                "reference r of the angle on the load side",
            ),
            new(
                "velocityFeedforward",
                input::VELOCITY_FEEDFORWARD,
                "rad/s",
                "added to the velocity reference v, load side",
            ),
            new("motorAngle", input::MOTOR_ANGLE, "rad", "angle of the motor, n theta0"),
            new("motorVelocity", input::MOTOR_VELOCITY, "rad/s", "velocity of the motor, n theta0'"),
            new(
                &format!("{load}Angle"),
                input::LOAD_ANGLE,
                "rad",
                "angle theta1 on the load side of the joint",
            ),
            new(
                &format!("{load}Velocity"),
                input::LOAD_VELOCITY,
                "rad/s",
                "velocity theta1' on the load side of the joint",
            ),
        ]
    }

    /// Of an arm: a torque that is added, behind all other inputs.
    fn torque_feedforward(&self) -> Option<TableVariable> {
        let n = self.joints?;
        let text =
            "added to the torque tau of each joint, load side: that of a planned motion, or of the weight";
        let v = self.variable(
            TORQUE_FEEDFORWARD,
            Causality::Input,
            Variability::Continuous,
            Storage::Input,
            input::COUNT,
            "N.m",
            text,
        );
        Some(v.start(&vec![0.0; n]).nominal(1.0))
    }

    /// The states of the law: place, name, unit, unit of the rate, description.
    fn law_states(&self) -> Vec<(usize, String, &'static str, &'static str, String)> {
        let waves = |first, quantity: &str, unit: [&'static str; 3], symbol: &str| {
            [
                (
                    first,
                    "ReturnWave",
                    unit[0],
                    format!("return wave b0 = G (theta1{symbol} - G a0) of the {quantity}"),
                ),
                (first + 1, "ReturnWaveRate", unit[1], format!("rate of the return wave of the {quantity}")),
                (
                    first + 2,
                    "DelayedLaunchWave",
                    unit[0],
                    format!("launch wave a0 = theta0{symbol} - b0 of the {quantity}, through G"),
                ),
                (
                    first + 3,
                    "DelayedLaunchWaveRate",
                    unit[1],
                    format!("rate of the delayed launch wave of the {quantity}"),
                ),
            ]
            .map(|(i, name, u, text)| {
                let of_rate = if u == unit[0] { unit[1] } else { unit[2] };
                (i, format!("{quantity}{name}"), u, of_rate, text)
            })
        };
        let mut all = Vec::new();
        all.extend(waves(state::POSITION_WAVES, "position", ["rad", "rad/s", "rad/s2"], ""));
        all.extend(waves(state::VELOCITY_WAVES, "velocity", ["rad/s", "rad/s2", "rad/s3"], "'"));
        let washout = "low-passed K_p e/2 - b0, omega_h/(s + omega_h)".to_owned();
        all.push((state::WASHOUT, "washout".into(), "rad/s", "rad/s2", washout));
        let integral = "integral part z of tau, load-referred: z' = (limited tau - z)/T_i".to_owned();
        all.push((state::INTEGRAL_TORQUE, "integralTorque".into(), "N.m", "N.m/s", integral));
        let held = format!("{} of the last sample, while samplePeriod > 0", self.names.output);
        let per_second = if self.names.unit == "A" { "A/s" } else { "N.m/s" };
        all.push((state::HELD_OUTPUT, "heldOutput".into(), self.names.unit, per_second, held));

        all
    }

    /// All inputs of a joint and these states.
    fn inputs_and(&self, states: &[(usize, String, &'static str, &'static str, String)]) -> Vec<String> {
        let states = states.iter().map(|s| format!("state.{}", s.1));
        let more = self.torque_feedforward();
        self.inputs().into_iter().chain(more).map(|v| v.name).chain(states).collect()
    }

    fn output(&self) -> TableVariable {
        let ControllerNames { output, unit, .. } = self.names;
        let text = format!("command to the motor, {output} = tau/(n K_t) within its limit");
        let mut v = self.variable(
            output,
            Causality::Output,
            Variability::Continuous,
            Storage::Output,
            output::COMMAND,
            unit,
            &text,
        );
        v.depends = Depends::On(self.inputs_and(&self.law_states()));
        v
    }

    /// States with their rates.
    fn states(&self) -> Vec<TableVariable> {
        let local = |name: &str, storage, index, unit, text: &str| {
            self.variable(name, Causality::Local, Variability::Continuous, storage, index, unit, text)
        };
        let mut all = self.law_states();
        all.extend(adaptation::states());
        let dependencies = self.inputs_and(&all);
        let pair = |(index, name, unit, rate_unit, text): (usize, String, _, _, String)| {
            let name = format!("state.{name}");
            let (rate, rate_text) =
                (format!("der({name})"), format!("rate of {name}; 0 while samplePeriod > 0"));
            let mut rate = local(&rate, Storage::Rate, index, rate_unit, &rate_text).derivative_of(&name);
            // A schedule may run over any joint's angle.
            let of_schedule = name == "state.waveFrequencyOffset" || name.contains("Wave");
            rate.depends = if self.joints.is_some() && of_schedule {
                Depends::All
            } else {
                Depends::On(dependencies.clone())
            };
            [local(&name, Storage::State, index, unit, &text).nominal(1.0), rate]
        };
        all.into_iter().flat_map(pair).collect()
    }

    fn table(&self, defaults: &[&[f64]; parameter::COUNT]) -> ModelTable {
        let time = TableVariable::new(
            "time",
            Causality::Independent,
            Variability::Continuous,
            Storage::Time,
            "s",
            "simulation time",
        );
        let mut variables = vec![time];
        variables.extend(self.inputs());
        variables.push(self.output());
        variables.extend(self.parameters(defaults));
        variables.extend(self.states());
        // Behind all that there was before: its value references stay.
        let omega = defaults[parameter::WAVE_FREQUENCY];
        variables.extend(self.adaptation_parameters(omega, self.names.threshold));
        variables.extend(self.adaptation_outputs(omega[0]));
        variables.extend(self.torque_feedforward());
        let of = |index: usize| defaults[index][0];
        let (ratio, limit) = (of(parameter::GEAR_RATIO), of(parameter::LIMIT));
        for v in &mut variables {
            v.nominal = match v.name.as_str() {
                "motorAngle" | "motorVelocity" => Some(ratio),
                "state.integralTorque" => Some(limit * ratio * of(parameter::TORQUE_CONSTANT)),
                "state.heldOutput" => Some(limit),
                "state.regressionCorrelation" => Some(omega[0] * omega[0]),
                name if name.starts_with("state.twistFilter") => Some(self.names.threshold),
                name if name == self.names.output => Some(limit),
                _ => v.nominal,
            };
        }
        let load = self.names.load;
        let members = [
            self.names.output.to_owned(),
            "motorAngle".into(),
            "motorVelocity".into(),
            format!("{load}Angle"),
            format!("{load}Velocity"),
        ];
        let mut table = ModelTable {
            name: String::new(),
            title: None,
            description: String::new(),
            variables,
            enumerations: vec![
                Enumeration {
                    name: "Strategy",
                    description: "Velocity reference v of a joint's controller, with e = r - theta1",
                    items: vec![
                        ("P_PI", "v = K_p e"),
                        (
                            "WBC",
                            "wave-based control, v = K_p (r/2 + b0 - theta0) with the waves of the angles",
                        ),
                        (
                            "VWBC",
                            "velocity wave-based control, v = K_p e/2 + b0 with the waves of the velocities",
                        ),
                        (
                            "VWBC_WASHOUT",
                            "v = K_p e (1 + LP)/2 + (1 - LP) b0, LP = omega_h/(s + omega_h): no static error under a load torque",
                        ),
                        ("WBC_ADAPTIVE", "WBC with a wave frequency that adapts, see adaptation"),
                        ("VWBC_ADAPTIVE", "VWBC with a wave frequency that adapts, see adaptation"),
                    ],
                },
                adaptation::enumeration(),
            ],
            terminals: vec![Terminal {
                name: "drive".into(),
                description:
                    "The drive: command to the motor and the sensors on both sides of the transmission".into(),
                members: members.map(|m| (m.clone(), m)).to_vec(),
            }],
            indicators: 3 * self.joints.unwrap_or(1),
            experiment: TableExperiment { stop_time: 10.0, tolerance: 1e-6, step_size: 1e-3 },
        };
        table.number();
        table
    }
}
