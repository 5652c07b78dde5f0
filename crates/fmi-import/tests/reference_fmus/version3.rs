//! Reference FMUs of FMI 3.0.

use super::*;
use fmi3::Fmi3Instance as Instance;

/// The Reference FMU's counter is an Int32.
trait GetInteger {
    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), ImportError>;
}
impl GetInteger for Instance {
    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), ImportError> {
        self.get_int32(references, values)
    }
}

fn sizes(instance: &mut Instance) -> (usize, usize) {
    (instance.number_of_states().unwrap(), instance.number_of_event_indicators().unwrap())
}

runs!(
    3,
    |fmu, options| Instance::model_exchange(fmu, options).unwrap(),
    |fmu, options| Instance::co_simulation(fmu, options, CoSimulationOptions::default()).unwrap(),
    get_float64,
    update_discrete_states,
    [
        ("BouncingBall", 1e-3, false),
        ("VanDerPol", 1e-2, false),
        ("Dahlquist", 0.1, false),
        ("Stair", 0.2, true)
    ]
);

fn started(fmu: &Arc<UnpackedFmu>, how: CoSimulationOptions) -> Instance {
    let mut instance = Instance::co_simulation(fmu, InstanceOptions::named("it"), how).unwrap();
    instance.enter_initialization_mode(ExperimentSetup::default()).unwrap();
    instance.exit_initialization_mode().unwrap();
    instance
}

#[test]
fn every_type_goes_through() {
    let fmu = open!(3, "Feedthrough");
    let mut it = started(&fmu, CoSimulationOptions::default());
    macro_rules! through {
        ($($set:ident $get:ident $input:literal $output:literal $value:expr;)*) => {$({
            let (input, output) = (value_reference(&fmu, $input), value_reference(&fmu, $output));
            let mut value = [Default::default()];
            it.$set(&[input], &[$value]).unwrap();
            it.$get(&[output], &mut value).unwrap();
            assert_eq!(value, [$value], $input);
        })*};
    }
    through! {
        set_float32 get_float32 "Float32_continuous_input" "Float32_continuous_output" -1.5e-30_f32;
        set_float64 get_float64 "Float64_continuous_input" "Float64_continuous_output" -1.25e-300;
        set_int8 get_int8 "Int8_input" "Int8_output" i8::MIN;
        set_uint8 get_uint8 "UInt8_input" "UInt8_output" u8::MAX;
        set_int16 get_int16 "Int16_input" "Int16_output" i16::MIN;
        set_uint16 get_uint16 "UInt16_input" "UInt16_output" u16::MAX;
        set_int32 get_int32 "Int32_input" "Int32_output" i32::MIN;
        set_uint32 get_uint32 "UInt32_input" "UInt32_output" u32::MAX;
        set_int64 get_int64 "Int64_input" "Int64_output" i64::MIN;
        set_uint64 get_uint64 "UInt64_input" "UInt64_output" u64::MAX;
        set_boolean get_boolean "Boolean_input" "Boolean_output" true;
        set_int64 get_int64 "Enumeration_input" "Enumeration_output" 2;
    }
    let v = |name: &str| [value_reference(&fmu, name)];
    it.set_string(&v("String_input"), &["Gruß %s"]).unwrap();
    assert_eq!(it.get_string(&v("String_output")).unwrap(), ["Gruß %s"]);
    it.set_binary(&v("Binary_input"), &[&[0, 255, 7]]).unwrap();
    assert_eq!(it.get_binary(&v("Binary_output")).unwrap(), [vec![0, 255, 7]]);
    assert!(matches!(it.set_string(&v("String_input"), &["a\0b"]), Err(ImportError::Text { .. })));
}

#[test]
fn arrays_are_checked_against_their_present_size() {
    let fmu = open!(3, "StateSpace");
    let v = |name: &str| [value_reference(&fmu, name)];
    let mut it =
        Instance::co_simulation(&fmu, InstanceOptions::default(), CoSimulationOptions::default()).unwrap();
    it.set_float64(&v("A"), &[4.0; 9]).unwrap();
    let error = it.set_float64(&v("A"), &[0.0; 4]).unwrap_err(); // its dimensions are those of a parameter
    assert!(matches!(error, ImportError::Length { expected: 9, got: 4, .. }), "{error}");
    let mut both = [0.0; 12];
    it.get_float64(&[v("A")[0], v("u")[0]], &mut both).unwrap();
    assert_eq!((&both[..9], &both[9..]), (&[4.0; 9][..], &[1.0, 2.0, 3.0][..]));
}

#[test]
fn events_end_a_step_early() {
    let fmu = open!(3, "BouncingBall");
    let how = || CoSimulationOptions {
        event_mode_used: true,
        early_return_allowed: true,
        ..CoSimulationOptions::default()
    };
    let mut it = started(&fmu, how());
    while it.update_discrete_states().unwrap().again {}
    it.enter_step_mode().unwrap();
    let step = it.do_step(0.0, 1.0, true).unwrap();
    let fall = (2.0_f64 / 9.81).sqrt();
    assert!(step.event && step.early && !step.terminate, "{step:?}");
    assert!((step.time - fall).abs() < 2e-3, "{} s, the ball falls {fall} s", step.time);
    it.enter_event_mode().unwrap();
    assert!(it.update_discrete_states().unwrap().states_changed);
    it.enter_step_mode().unwrap();
    let mut v = [0.0];
    it.get_float64(&[value_reference(&fmu, "v")], &mut v).unwrap();
    assert!(v[0] > 0.0);
}

#[test]
fn intermediate_updates_see_values_and_can_end_the_step() {
    let fmu = open!(3, "BouncingBall");
    let h = value_reference(&fmu, "h");
    let seen = Arc::new(Mutex::new(Vec::new()));
    let record = Arc::clone(&seen);
    let update = Box::new(move |now: &mut fmi3::Intermediate| {
        let mut value = [0.0];
        now.get_float64(&[h], &mut value).unwrap();
        assert!(now.get_float64(&[h], &mut [0.0; 2]).is_err());
        record.lock().unwrap().push((now.time, value[0]));
        if now.can_return_early && now.time > 0.1 {
            now.return_early(now.time);
        }
    });
    let how = CoSimulationOptions {
        early_return_allowed: true,
        intermediate_variables: vec![h],
        intermediate_update: Some(update),
        ..CoSimulationOptions::default()
    };
    let mut it = started(&fmu, how);
    it.do_step(0.0, 0.4, true).unwrap();
    let seen = seen.lock().unwrap();
    assert!(!seen.is_empty());
    // The FMU's solver is Euler's with 1 ms: h = 1 - g t (t - 1 ms) / 2.
    for (time, h) in seen.iter() {
        assert_close(1.0 - 9.81 * time * (time - 1e-3) / 2.0, *h, &format!("h at {time} s"));
    }
}

#[test]
fn a_panic_in_an_intermediate_update_is_an_error_of_the_step() {
    let fmu = open!(3, "BouncingBall");
    let how = CoSimulationOptions {
        intermediate_update: Some(Box::new(|_| panic!("as arranged"))),
        ..CoSimulationOptions::default()
    };
    let mut it = started(&fmu, how);
    let error = it.do_step(0.0, 0.1, true).unwrap_err();
    assert!(matches!(&error, ImportError::Panicked { message, .. } if message == "as arranged"), "{error}");
}

#[test]
fn derivatives_of_the_oscillator() {
    let fmu = open!(3, "VanDerPol");
    let mut it = Instance::model_exchange(&fmu, InstanceOptions::default()).unwrap();
    it.enter_initialization_mode(ExperimentSetup::default()).unwrap();
    it.exit_initialization_mode().unwrap();
    it.update_discrete_states().unwrap();
    it.enter_continuous_time_mode().unwrap();
    let (x0, x1) = (0.5, -1.5);
    it.set_continuous_states(&[x0, x1]).unwrap();
    let v = |name: &str| value_reference(&fmu, name);
    let of = DerivativeOf { unknowns: &[v("der(x1)")], knowns: &[v("x0"), v("x1")] };
    let gradient = [-2.0 * x0 * x1 - 1.0, 1.0 - x0 * x0];
    let (mut forward, mut adjoint) = ([0.0], [0.0; 2]);
    it.directional_derivative(of, &[2.0, 3.0], &mut forward).unwrap();
    it.adjoint_derivative(of, &[2.0], &mut adjoint).unwrap();
    assert_eq!(forward[0], 2.0 * gradient[0] + 3.0 * gradient[1]);
    assert_eq!(adjoint, gradient.map(|g| 2.0 * g));
    assert!(matches!(it.adjoint_derivative(of, &[2.0], &mut [0.0]), Err(ImportError::Length { .. })));
}

#[test]
fn states_are_saved_restored_and_carried_to_another_instance() {
    let fmu = open!(3, "VanDerPol");
    let x = [value_reference(&fmu, "x0"), value_reference(&fmu, "x1")];
    let run = |it: &mut Instance| {
        for i in 5..50 {
            it.do_step(f64::from(i) * 0.1, 0.1, false).unwrap();
        }
        let mut value = [0.0; 2];
        it.get_float64(&x, &mut value).unwrap();
        value
    };
    let mut it = started(&fmu, CoSimulationOptions::default());
    for i in 0..5 {
        it.do_step(f64::from(i) * 0.1, 0.1, false).unwrap();
    }
    let id = it.save().unwrap();
    let expected = run(&mut it);
    it.restore(&id).unwrap();
    assert_eq!(run(&mut it), expected);
    let bytes = it.serialize(&id).unwrap();
    let mut other = started(&fmu, CoSimulationOptions::default());
    let id = other.deserialize(&bytes).unwrap();
    other.restore(&id).unwrap();
    assert_eq!(run(&mut other), expected);
    it.reset().unwrap(); // two states are still stored: dropping the instances frees them
}

#[test]
fn resources_are_found() {
    let fmu = open!(3, "Resource");
    let mut it = started(&fmu, CoSimulationOptions::default());
    let mut y = [0];
    it.get_int32(&[value_reference(&fmu, "y")], &mut y).unwrap();
    assert_eq!(y, [97]); // the first character of the file
}

#[test]
fn an_error_carries_what_the_fmu_said() {
    let fmu = open!(3, "BouncingBall");
    let heard = Arc::new(Mutex::new(Vec::new()));
    let ear = Arc::clone(&heard);
    let options = InstanceOptions {
        name: "mine".into(),
        logging_on: true,
        listener: Some(Box::new(move |message| {
            ear.lock().unwrap().push(message.clone());
            panic!("a listener's panic stays on this side");
        })),
        ..InstanceOptions::default()
    };
    let mut it = Instance::co_simulation(&fmu, options, CoSimulationOptions::default()).unwrap();
    let error = it.do_step(0.0, 0.1, true).unwrap_err();
    assert_eq!(error.status(), Some(FmiStatus::Error));
    let said = error.to_string();
    assert!(said.starts_with("fmi3DoStep of instance \"mine\" returned Error"), "{said}");
    assert!(!heard.lock().unwrap().is_empty() && said.contains(&heard.lock().unwrap()[0].text), "{said}");
}
