//! A bouncing ball and a sensor that follows its height and starts again at every impact, against the exact solution.

use super::*;

const G: f64 = 9.81;

fn system(run: &str) -> String {
    format!(
        r#"
connections = ["ball.h -> sensor.u", "ball.bounces -> sensor.bounces"]
record = ["ball.h", "ball.v", "ball.bounces", "sensor.y", "sensor.crossings"]
[run]
stop = 2
step = 0.05
{run}
[components.sensor]
fmu = "sensor.fmu"
[components.ball]
fmu = "ball.fmu"
"#
    )
}

/// Height of the ball, value of the sensor and number of impacts at times in s: parabolas, and a first-order lag that
/// follows them.
fn exact(times: &[f64]) -> Vec<[f64; 3]> {
    let lag = 0.1;
    let at = |t: f64| {
        // Start of the flight: time, height, velocity, sensor.
        let (mut t0, mut h0, mut v0, mut y0, mut impacts) = (0.0, 1.0, 0.0, 0.0, 0.0);
        loop {
            let y = |s: f64| {
                let c = -0.5 * G;
                let b = v0 - 2.0 * c * lag;
                let a = h0 - b * lag;
                a + b * s + c * s * s + (y0 - a) * f64::exp(-s / lag)
            };
            let flight = (v0 + f64::sqrt(v0 * v0 + 2.0 * G * h0)) / G;
            let s = t - t0;
            if s < flight {
                return [h0 + v0 * s - 0.5 * G * s * s, y(s), impacts];
            }
            (t0, v0) = (t0 + flight, 0.7 * (G * flight - v0));
            (h0, y0) = (0.0, 0.0); // the sensor takes the height, which is 0
            impacts += 1.0;
        }
    };
    times.iter().map(|t| at(*t)).collect()
}

/// Errors of height and sensor at the communication points; the counts must be right.
fn errors(memory: &SeriesMemory) -> Vec<[f64; 2]> {
    let column = |name| memory.column(name).unwrap();
    let (h, y) = (column("ball.h"), column("sensor.y"));
    let is_point = |t: f64| t == (t / 0.05).round() / 20.0;
    let points = (0..memory.time().len()).filter(|i| is_point(memory.time()[*i]));
    let points: Vec<usize> = points.collect();
    let times: Vec<f64> = points.iter().map(|i| memory.time()[*i]).collect();
    let expected = exact(&times);
    for (i, e) in points.iter().zip(&expected) {
        assert_eq!(column("ball.bounces")[*i], e[2], "impacts at {} s", memory.time()[*i]);
        let crossings = f64::from(u8::from(memory.time()[*i] >= (1.0 / G).sqrt()));
        assert_eq!(column("sensor.crossings")[*i], crossings, "crossings at {} s", memory.time()[*i]);
    }
    points.iter().zip(&expected).map(|(i, e)| [h[*i] - e[0], y[*i] - e[1]]).collect()
}

#[test]
fn states_start_anew_where_another_fmu_has_its_event() {
    let Some(desk) = made() else { return };
    let (result, memory) = run(desk.path(), &system(""));
    let log = result.unwrap();
    let errors = errors(&memory);
    assert!(errors.len() == 41);
    let (h, y) = (quantiles(errors.iter().map(|e| e[0])), quantiles(errors.iter().map(|e| e[1])));
    eprintln!("median, 95 %, largest error: h {h:?} m, sensor {y:?} m; {:?}", log.notes);
    assert!(h[2] < 1e-10 && y[2] < 1e-7, "{h:?} {y:?}");
    assert_eq!(log.events, 5, "4 impacts, 1 crossing of 0.5 m");
}

#[test]
fn rows_before_and_after_an_event_show_the_jump() {
    let Some(desk) = made() else { return };
    let (_, memory) = run(desk.path(), &system(""));
    let (t, v) = (memory.time(), memory.column("ball.v").unwrap());
    let pairs: Vec<usize> = (1..t.len()).filter(|i| t[*i] == t[*i - 1] && v[*i] != v[*i - 1]).collect();
    let mut impact = (2.0 / G).sqrt();
    let mut speed = G * impact;
    for i in &pairs {
        assert!((t[*i] - impact).abs() < 1e-9, "impact at {} s, exactly {impact} s", t[*i]);
        assert!((v[*i - 1] + speed).abs() < 1e-8 && (v[*i] - 0.7 * speed).abs() < 1e-8, "{} s", t[*i]);
        speed *= 0.7;
        impact += 2.0 * speed / G;
    }
    assert_eq!(pairs.len(), 4);
}

#[test]
fn repeated_steps_come_to_the_same() {
    let Some(desk) = made() else { return };
    let (once, _) = run(desk.path(), &system(""));
    let (repeated, memory) = run(desk.path(), &system("algorithm = \"iterative\""));
    let (once, repeated) = (once.unwrap(), repeated.unwrap());
    let errors = errors(&memory);
    assert!(quantiles(errors.iter().map(|e| e[1]))[2] < 1e-7);
    assert_eq!(once.steps >= 40, repeated.steps >= 40);
}
