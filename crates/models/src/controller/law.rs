//! The control law of one joint; equations in the module above.

use super::{input, parameter, state, waves};
use trueup_numerics::Scalar;
use trueup_plant::Lanes;

/// What the position loop and the wave split make of the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// Cascade of P on the load's angle and PI on the motor's velocity.
    PPi = 1,
    /// Wave-based control: waves of the angle, fed back from motorAngle/gearRatio.
    Wbc = 2,
    /// Velocity wave-based control: waves of the velocity.
    Vwbc = 3,
    /// As before, with the static part of the waves washed out.
    VwbcWashout = 4,
    /// As [`Strategy::Wbc`], with a wave frequency that adapts.
    WbcAdaptive = 5,
    /// As [`Strategy::Vwbc`], with a wave frequency that adapts.
    VwbcAdaptive = 6,
}

impl Strategy {
    /// All of them, by their numbers from 1.
    pub const ALL: [Self; 6] =
        [Self::PPi, Self::Wbc, Self::Vwbc, Self::VwbcWashout, Self::WbcAdaptive, Self::VwbcAdaptive];

    /// The strategy with that number (1 to 6).
    pub fn from_number(number: f64) -> Option<Self> {
        Self::ALL.into_iter().find(|s| f64::from(*s as u8) == number)
    }

    /// Whether the wave frequency adapts.
    pub fn adapts(self) -> bool {
        matches!(self, Self::WbcAdaptive | Self::VwbcAdaptive)
    }
}

/// One joint at one instant; arrays in the order of [`parameter`], [`input`] and [`state`].
#[derive(Clone, Copy, Debug)]
pub struct ControlledJoint<T> {
    /// Strategy.
    pub strategy: Strategy,
    /// Parameters of the joint.
    pub p: [T; parameter::COUNT],
    /// Inputs of the joint.
    pub u: [T; input::COUNT],
    /// States of the joint.
    pub x: [T; state::COUNT],
    /// ω_n that the waves use, in rad/s.
    pub omega: T,
    /// Added to the torque, load-referred, in N.m.
    pub feedforward: T,
}

/// What the law commands.
#[derive(Clone, Copy, Debug)]
pub struct LawCommand<T> {
    /// Load-referred torque before the limit, in N.m.
    pub torque: T,
    /// Load-referred torque at the limit of the output, in N.m; > 0.
    pub limit: T,
    /// Load-referred torque per output: n K_t.
    pub per_output: T,
    /// What enters the washout's low pass, in rad/s.
    washout: T,
    /// Of that torque what was added, in N.m.
    feedforward: T,
}

impl<T: Scalar> LawCommand<T> {
    /// The torque within its limits.
    pub fn limited(&self) -> T {
        // Constants where limited: the derivative is that of the limit.
        if self.torque > self.limit {
            self.limit
        } else if self.torque < -self.limit {
            -self.limit
        } else {
            self.torque
        }
    }
    /// The torque with the limit reached on the side `saturation` (-1, 0, +1).
    pub fn saturated(&self, saturation: i32) -> T {
        match saturation {
            0 => self.torque,
            s => self.limit * f64::from(s.signum()),
        }
    }
    /// What the integral part goes to while that torque is given: the part of the feedback in it.
    fn integral(&self, given: T) -> T {
        given - self.feedforward
    }
    /// Distances to the upper and to the lower limit as a share of it; at the limit or beyond <= 0.
    pub fn margins(&self) -> [T; 2] {
        let share = self.torque / self.limit;
        [-share + 1.0, share + 1.0]
    }
}

impl<T: Scalar> ControlledJoint<T> {
    /// The states with the waves as at rest at the present angle and velocity of the motor; the others 0.
    pub fn initial_states(&self) -> [T; state::COUNT] {
        let mut x = [T::zero(); state::COUNT];
        let (angle, velocity) = self.motor();
        x[state::POSITION_WAVES..][..4].copy_from_slice(&waves::at_rest(angle));
        x[state::VELOCITY_WAVES..][..4].copy_from_slice(&waves::at_rest(velocity));
        x
    }

    /// θ0 in rad and θ0' in rad/s.
    pub fn motor(&self) -> (T, T) {
        let n = self.p[parameter::GEAR_RATIO];
        (self.u[input::MOTOR_ANGLE] / n, self.u[input::MOTOR_VELOCITY] / n)
    }

    /// The torque that the law commands at the present states and inputs.
    pub fn command(&self) -> LawCommand<T> {
        let Self { p, u, x, .. } = self;
        let (angle, velocity) = self.motor();
        let reference = u[input::POSITION_REFERENCE];
        let half = p[parameter::POSITION_GAIN] * (reference - u[input::LOAD_ANGLE]) * 0.5;
        let (position_wave, velocity_wave) = (x[state::POSITION_WAVES], x[state::VELOCITY_WAVES]);
        let v = match self.strategy {
            Strategy::PPi => half * 2.0, // (CTL-1)
            // (CTL-4)
            Strategy::Wbc | Strategy::WbcAdaptive => {
                p[parameter::POSITION_GAIN] * (reference * 0.5 + position_wave - angle)
            }
            Strategy::Vwbc | Strategy::VwbcAdaptive => half + velocity_wave, // (CTL-5)
            // (CTL-6) with one low pass for both.
            Strategy::VwbcWashout => half + velocity_wave + x[state::WASHOUT],
        };
        let error = v + u[input::VELOCITY_FEEDFORWARD] - velocity;
        let per_output = p[parameter::GEAR_RATIO] * p[parameter::TORQUE_CONSTANT];
        LawCommand {
            torque: p[parameter::VELOCITY_GAIN] * error + x[state::INTEGRAL_TORQUE] + self.feedforward, // (CTL-7)
            limit: p[parameter::LIMIT] * per_output, // (CTL-8)
            per_output,
            washout: half - velocity_wave,
            feedforward: self.feedforward,
        }
    }

    /// The index of the strategy's split among the states, and the two motions that it splits.
    fn split(&self) -> Option<(usize, T, T)> {
        let (angle, velocity) = self.motor();
        match self.strategy {
            Strategy::PPi => None,
            Strategy::Wbc | Strategy::WbcAdaptive => {
                Some((state::POSITION_WAVES, angle, self.u[input::LOAD_ANGLE]))
            }
            Strategy::Vwbc | Strategy::VwbcWashout | Strategy::VwbcAdaptive => {
                Some((state::VELOCITY_WAVES, velocity, self.u[input::LOAD_VELOCITY]))
            }
        }
    }

    fn waves(&self, at: usize) -> waves::WaveSplit<T> {
        core::array::from_fn(|i| self.x[at + i])
    }

    /// Rates of the states of the continuous law with the limit reached on the side `saturation`; `growth` is ω'/ω in
    /// 1/s where ω adapts.
    pub fn rates(&self, saturation: i32, growth: Option<T>) -> [T; state::COUNT] {
        let mut dx = [T::zero(); state::COUNT];
        let (p, command) = (&self.p, self.command());
        if let Some((at, theta0, theta1)) = self.split() {
            let rates = waves::rates(&self.waves(at), theta0, theta1, self.omega);
            dx[at..at + 4].copy_from_slice(&rates);
            let more = growth.map(|growth| waves::growth_rates(&self.waves(at), growth));
            more.iter().flatten().zip(&mut dx[at..]).for_each(|(more, dx)| *dx += *more);
        }
        if self.strategy == Strategy::VwbcWashout {
            dx[state::WASHOUT] = p[parameter::WASHOUT_FREQUENCY] * (command.washout - self.x[state::WASHOUT]);
        }
        let integral = command.integral(command.saturated(saturation));
        dx[state::INTEGRAL_TORQUE] =
            (integral - self.x[state::INTEGRAL_TORQUE]) / p[parameter::VELOCITY_INTEGRAL_TIME];
        dx
    }

    /// The states after a sample: output held, filters advanced by one period `h` in s with held inputs; where ω
    /// adapts it is `next` afterwards.
    pub fn sample(&self, h: T, next: Option<T>) -> [T; state::COUNT] {
        let (p, command) = (&self.p, self.command());
        let mut x = self.x;
        if let Some((at, theta0, theta1)) = self.split() {
            let split = waves::step(&self.waves(at), theta0, theta1, self.omega, h);
            let split = next.map_or(split, |next| waves::changed(&split, self.omega, next, h));
            x[at..at + 4].copy_from_slice(&split);
        }
        let lag = |y: T, u: T, exponent: T| u + (y - u) * (-exponent).exp();
        if self.strategy == Strategy::VwbcWashout {
            let exponent = h * p[parameter::WASHOUT_FREQUENCY];
            x[state::WASHOUT] = lag(x[state::WASHOUT], command.washout, exponent);
        }
        let torque = command.limited();
        let exponent = h / p[parameter::VELOCITY_INTEGRAL_TIME];
        x[state::INTEGRAL_TORQUE] = lag(x[state::INTEGRAL_TORQUE], command.integral(torque), exponent);
        x[state::HELD_OUTPUT] = torque / command.per_output;
        x
    }
}

impl ControlledJoint<Lanes> {
    /// [`sample`](Self::sample) after `h` s of a law whose frequency does not adapt, with its derivatives: compiled here alone.
    #[inline(never)]
    pub fn sample_lanes(&self, h: f64) -> [Lanes; state::COUNT] {
        self.sample(Lanes::constant(h), None)
    }
}
