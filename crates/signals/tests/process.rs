//! What exact solutions say of the signal processing; SciPy's word is in tests/python/test_signals.py.

#![allow(clippy::unwrap_used)]

use trueup_signals::process::{
    Butterworth, ChannelGrid, Misfit, gradient, nrmse, overall, savitzky_golay, welch,
};
use trueup_signals::{Channel, Recording};

#[test]
fn polynomials_up_to_the_degree_pass_a_savitzky_golay_filter() {
    let h = 0.01;
    let x: Vec<f64> = (0..60).map(|i| i as f64 * h).map(|t| 1.0 - 2.0 * t + 3.0 * t.powi(3)).collect();
    let d = savitzky_golay(&x, 15, 3, 2, h).unwrap();
    for (i, d) in d.iter().enumerate() {
        let exact = 18.0 * i as f64 * h;
        assert!((d - exact).abs() < 1e-9, "at {i}: {d} instead of {exact}");
    }
}

#[test]
fn a_zero_phase_filter_keeps_a_line_away_from_the_ends_and_halves_the_cutoff() {
    let filter = Butterworth::low_pass(4, 5.0, 100.0).unwrap();
    let line: Vec<f64> = (0..800).map(|i| 2.0 - 0.3 * f64::from(i)).collect();
    let y = filter.filtfilt(&line).unwrap();
    assert!((300..500).all(|i| (line[i] - y[i]).abs() < 1e-9));
    let swing: Vec<f64> =
        (0..4000).map(|i| (std::f64::consts::TAU * 5.0 * f64::from(i) / 100.0).sin()).collect();
    let y = filter.filtfilt(&swing).unwrap();
    let middle = 1000..3000;
    let gain =
        middle.clone().map(|i| y[i] * swing[i]).sum::<f64>() / middle.map(|i| swing[i].powi(2)).sum::<f64>();
    assert!((gain - 0.5).abs() < 1e-9, "{gain}");
}

#[test]
fn a_spectrum_adds_up_to_the_variance() {
    let x: Vec<f64> = (0..4096).map(|i| (i as f64 * 0.91).sin() * 3.0 + (i as f64 * 2.3).cos()).collect();
    let s = welch(&x, 50.0, 512).unwrap();
    let power: f64 = s.value.iter().sum::<f64>() * s.frequency[1];
    assert!((power / 5.0 - 1.0).abs() < 2e-3, "{power}");
}

#[test]
fn differences_of_a_parabola_are_exact_inside() {
    let t = [0.0, 0.1, 0.4, 0.5, 1.1];
    let d = gradient(&t, &t.map(|t| t * t)).unwrap();
    for i in 1..4 {
        assert!((d[i] - 2.0 * t[i]).abs() < 1e-14);
    }
}

#[test]
fn channels_come_to_one_grid_with_their_delays_out() {
    let t: Vec<f64> = (0..=100).map(|i| 0.01 * f64::from(i)).collect();
    let prompt = Channel::new("a", "", t.clone(), t.iter().map(|t| 2.0 * t).collect());
    let mut late = Channel::new("b", "", t.clone(), t.iter().map(|t| 2.0 * (t - 0.03)).collect());
    late.sensor.delay = 0.03;
    let run = Recording { channels: vec![prompt, late], ..Recording::default() };
    let grid = ChannelGrid::of(&run, &["a", "b"], 0.005).unwrap();
    assert_eq!((grid.start, grid.columns[0].len()), (0.0, 195)); // up to 1 - 0.03
    assert!(grid.columns[0].iter().zip(&grid.columns[1]).all(|(a, b)| (a - b).abs() < 1e-12));
    assert!(
        ChannelGrid::of(&run, &["a", "c"], 0.005).is_none() && ChannelGrid::of(&run, &["a"], -1.0).is_none()
    );
}

#[test]
fn gaps_are_pooled_by_sample_and_squared_over_channels() {
    let mut pooled = Misfit::default();
    pooled.add(&[1.0, 2.0], &[1.0, 3.0]); // error 1, variation 2
    pooled.add(&[0.0, 0.0, 0.0, 0.0], &[1.0, -1.0, 1.0, -1.0]); // error 4, variation 4
    assert_eq!((pooled.nrmse(), pooled.samples), (Some((5.0_f64 / 6.0).sqrt()), 6));
    assert_eq!(nrmse(&[1.0, 2.0], &[0.1, 0.1]), None);
    assert_eq!((overall(&[3.0, 4.0]), overall(&[])), (Some(12.5_f64.sqrt()), None));
}

#[test]
fn what_cannot_be_done_is_none() {
    let x = [1.0, 2.0, 4.0, 8.0];
    assert!(Butterworth::low_pass(0, 1.0, 10.0).is_none() && Butterworth::low_pass(2, 5.0, 10.0).is_none());
    assert!(Butterworth::low_pass(2, f64::NAN, 10.0).is_none());
    assert!(Butterworth::low_pass(2, 1.0, 10.0).unwrap().filtfilt(&x).is_none());
    assert!(savitzky_golay(&x, 4, 2, 0, 1.0).is_none() && savitzky_golay(&x, 3, 3, 0, 1.0).is_none());
    assert!(savitzky_golay(&x, 3, 1, 0, f64::NAN).is_none());
    assert!(welch(&x, 1.0, 5).is_none() && welch(&x, 0.0, 2).is_none());
}
