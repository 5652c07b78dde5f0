//! The joint's angle that the model gives for the measured motion (S0, section 4).

use std::sync::Arc;

use trueup_models::arm::{PlanarManipulator, input, parameter};
use trueup_models::plants;
use trueup_numerics::Dual;
use trueup_numerics::driver::{
    DriveError, Driver, DriverMemory, DriverOptions, DriverState, Flow, StepInputs,
};
use trueup_plant::Plant;
use trueup_signals::spline::Spline;

use crate::tangent::TangentModel;

/// How the flexible joint's motor is moved.
#[derive(Clone, Debug)]
pub enum MotorDrive {
    /// By its torque in N.m at the samples, linear between them.
    Torque(Vec<f64>),
    /// Along its measured angle.
    Motion(Spline),
}

/// One run of the test-bed. Lengths of all series: that of `time`.
#[derive(Clone, Debug)]
pub struct TestBedRun {
    /// Samples in s, increasing.
    pub time: Vec<f64>,
    /// Angle of the flexible joint in rad, as seen.
    pub angle: Vec<f64>,
    /// The motor of the flexible joint.
    pub motor: MotorDrive,
    /// Measured angles of the other joints in rad, in their order.
    pub others: Vec<Spline>,
}

/// A run that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RunError {
    /// Series that do not fit the manipulator.
    #[error("{0}")]
    Shape(String),
    /// The simulation broke down.
    #[error("the replay with I_m = {inertia}, k = {stiffness}, b = {damping}, lambda = {offset}: {source}")]
    Drive {
        /// kg.m2.
        inertia: f64,
        /// N.m/rad.
        stiffness: f64,
        /// N.m.s/rad.
        damping: f64,
        /// rad.
        offset: f64,
        /// Why.
        source: DriveError,
    },
}

/// A run with its model: from the four unknowns to the joint's angle at the samples.
#[derive(Clone, Debug)]
pub struct FlexibleJoint {
    /// The arm, some of its motors prescribed.
    replay: Arc<dyn Plant>,
    links: usize,
    p: Vec<f64>,
    joint: usize,
    run: TestBedRun,
    /// Inputs at the samples.
    inputs: Vec<Vec<f64>>,
    motor_angle: f64,
}

impl FlexibleJoint {
    /// `p`: parameters of the manipulator, of which motorInertia, jointStiffness, jointDamping and the initial angle of
    /// joint `joint` (from 0) are the unknowns; its other initial values hold, motors begin as in `run`.
    /// `motor_angle`: q_m(0) in rad where the motor is driven by torque.
    ///
    /// # Errors
    /// [`RunError::Shape`].
    pub fn new(
        arm: &PlanarManipulator,
        p: &[f64],
        joint: usize,
        motor_angle: f64,
        run: TestBedRun,
    ) -> Result<Self, RunError> {
        let n = arm.links();
        let shape = |why: String| Err(RunError::Shape(why));
        if joint >= n || !arm.flexible()[joint] {
            return shape(format!("joint {} is not flexible in this manipulator of {n} links", joint + 1));
        }
        if run.angle.len() != run.time.len() || run.time.len() < 5 {
            return shape(format!(
                "{} angles at {} times; at least 5 samples are needed",
                run.angle.len(),
                run.time.len()
            ));
        }
        if run.others.len() != n - 1 {
            return shape(format!(
                "{} other joints are measured, the manipulator has {}",
                run.others.len(),
                n - 1
            ));
        }
        if arm.flexible().iter().filter(|f| **f).count() != 1 {
            return shape("more than one joint is flexible; this identification has one".into());
        }
        let mut led: Vec<(usize, &Spline)> = (0..n).filter(|j| *j != joint).zip(&run.others).collect();
        if let MotorDrive::Motion(spline) = &run.motor {
            led.push((joint, spline));
        }
        let joints: Vec<usize> = led.iter().map(|(j, _)| *j).collect();
        let Some(replay) = plants::led(arm.clone(), &joints) else {
            return shape("a manipulator with friction cannot be replayed".into());
        };
        let first_led = input::count(n);
        let mut p = p.to_vec();
        let first = run.time[0];
        for (j, spline) in &led {
            let [angle, rate, _] = spline.at(first);
            let flexible = usize::from(arm.flexible()[*j]);
            p[[parameter::initial_joint_angle(n), parameter::initial_motor_angle(n)][flexible] + j] = angle;
            p[[parameter::initial_joint_velocity(n), parameter::initial_motor_velocity(n)][flexible] + j] =
                rate;
            if flexible == 1 {
                p[parameter::initial_joint_velocity(n) + j] = rate;
            }
        }
        let motor_angle = match &run.motor {
            MotorDrive::Motion(spline) => spline.at(first)[0],
            MotorDrive::Torque(torque) if torque.len() != run.time.len() => {
                return shape(format!("{} torques at {} times", torque.len(), run.time.len()));
            }
            MotorDrive::Torque(_) => motor_angle,
        };
        p[parameter::initial_motor_angle(n) + joint] = motor_angle;
        let inputs = (0..run.time.len())
            .map(|i| {
                let mut u = vec![0.0; replay.sizes().inputs];
                if let MotorDrive::Torque(torque) = &run.motor {
                    u[input::joint_torque(n) + joint] = torque[i];
                }
                for (at, (_, spline)) in led.iter().enumerate() {
                    u[first_led + at] = spline.at(run.time[i])[2];
                }
                u
            })
            .collect();
        Ok(Self { replay, links: n, p, joint, run, inputs, motor_angle })
    }

    /// The run.
    pub fn run(&self) -> &TestBedRun {
        &self.run
    }

    /// The spring's offset in rad that the first samples show: a start for lambda.
    pub fn first_offset(&self) -> f64 {
        let first = &self.run.angle[..3];
        first.iter().sum::<f64>() / 3.0 - self.motor_angle
    }

    /// Angle of the joint in rad at the samples, each with its derivatives to I_m, k, b and lambda.
    ///
    /// # Errors
    /// [`RunError::Drive`].
    pub fn angle(&self, [inertia, stiffness, damping, offset]: [f64; 4]) -> Result<Vec<Dual<4>>, RunError> {
        let (n, j) = (self.links, self.joint);
        let unknowns = [
            parameter::motor_inertia(n) + j,
            parameter::joint_stiffness(n) + j,
            parameter::joint_damping(n) + j,
            parameter::initial_joint_angle(n) + j,
        ];
        let mut p = self.p.clone();
        for (at, value) in unknowns.iter().zip([inertia, stiffness, damping, self.motor_angle + offset]) {
            p[*at] = value;
        }
        let failed = |source| RunError::Drive { inertia, stiffness, damping, offset, source };
        let model = TangentModel::<4>::new(&*self.replay, &p, &unknowns);
        let options = DriverOptions { tolerance: 1e-7, ..DriverOptions::default() };
        let sizes = model.counts();
        let mut driver = Driver::new(sizes, &vec![0.01; sizes.states], options);
        let (mut t, mut memory) = (self.run.time[0], DriverMemory::default());
        let (mut x, mut u) = (vec![0.0; sizes.states], self.inputs[0].clone());
        let mut s =
            DriverState { t: &mut t, x: &mut x, u: &mut u, p: &p, modes: &mut [], memory: &mut memory };
        driver.initialise(&model, &mut s).map_err(failed)?;
        let mut angles = vec![TangentModel::<4>::state(s.x, 3 + j)];
        for i in 1..self.run.time.len() {
            let h = self.run.time[i] - self.run.time[i - 1];
            s.u.copy_from_slice(&self.inputs[i - 1]);
            let slopes: Vec<f64> =
                self.inputs[i].iter().zip(&self.inputs[i - 1]).map(|(b, a)| (b - a) / h).collect();
            driver
                .advance_to(&model, &mut s, self.run.time[i], StepInputs::Ramp(&slopes), &mut |_| {
                    Flow::Continue
                })
                .map_err(failed)?;
            angles.push(TangentModel::<4>::state(s.x, 3 + j));
        }
        Ok(angles)
    }
}
