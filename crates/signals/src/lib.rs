//! Time series with units: recordings, cases, files, filters, metrics.

pub mod spline;
