//! The recorded outputs of a run, at the times that a scene shows.

use crate::scene::ScenePose;

/// Times of a scene at most: between them a page interpolates.
const MOST_TIMES: usize = 400;

/// The series of a recording by the names of their elements (`jointAngle[1]`).
pub(crate) type ColumnsByName<'a> = dyn Fn(&str) -> Option<&'a [f64]> + 'a;

/// Recorded outputs of a plant.
pub struct MotionRecord<'a> {
    columns: &'a ColumnsByName<'a>,
    /// Which samples are shown.
    rows: Vec<usize>,
    times: Vec<f64>,
}

/// An output that a scene needs is not recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingColumn(pub String);

impl std::fmt::Display for MissingColumn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the motion is not drawn: `{}` is not recorded", self.0)
    }
}
impl std::error::Error for MissingColumn {}

impl<'a> MotionRecord<'a> {
    /// Samples at these times, s, increasing or the same; of one time the last sample is shown.
    pub fn new(time: &[f64], columns: &'a ColumnsByName<'a>) -> Self {
        let (first, last) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
        let mut rows: Vec<usize> = Vec::new();
        for k in 0..MOST_TIMES {
            let wanted = first + (last - first) * k as f64 / (MOST_TIMES - 1) as f64;
            let row = time.partition_point(|t| *t <= wanted).saturating_sub(1);
            if rows.last().is_none_or(|before| time[row] > time[*before]) && row < time.len() {
                rows.push(row);
            }
        }
        let times = rows.iter().map(|row| time[*row]).collect();
        Self { columns, rows, times }
    }

    /// Times that are shown, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Whether there is such a column.
    pub fn has(&self, name: &str) -> bool {
        (self.columns)(name).is_some()
    }

    /// The values of a column at those times; what is missing there is the value before it, or the first one.
    ///
    /// # Errors
    /// There is no such column, or no number in it.
    pub fn series(&self, name: &str) -> Result<Vec<f64>, MissingColumn> {
        let missing = || MissingColumn(name.to_owned());
        let column = (self.columns)(name).ok_or_else(missing)?;
        let first = column.iter().copied().find(|v| v.is_finite()).ok_or_else(missing)?;
        let at = |row: &usize| {
            let known = &column[..(row + 1).min(column.len())];
            known.iter().rev().copied().find(|v| v.is_finite()).unwrap_or(first)
        };
        Ok(self.rows.iter().map(at).collect())
    }

    /// The elements of a vector or matrix, flattened as rows, at each time.
    ///
    /// # Errors
    /// One of them is missing.
    pub fn elements(&self, names: &[String]) -> Result<Vec<Vec<f64>>, MissingColumn> {
        let columns = names.iter().map(|name| self.series(name)).collect::<Result<Vec<_>, _>>()?;
        Ok((0..self.times.len()).map(|k| columns.iter().map(|c| c[k]).collect()).collect())
    }

    /// As [`Self::elements`], of a vector of `N`.
    pub(crate) fn vector<const N: usize>(&self, name: &str) -> Result<Vec<[f64; N]>, MissingColumn> {
        let columns: Vec<Vec<f64>> =
            (1..=N).map(|i| self.series(&format!("{name}[{i}]"))).collect::<Result<_, _>>()?;
        Ok((0..self.times.len()).map(|k| std::array::from_fn(|i| columns[i][k])).collect())
    }

    /// Poses in the plane: by a vector of two and an angle.
    pub(crate) fn planar_poses(&self, place: &str, angle: &str) -> Result<Vec<ScenePose>, MissingColumn> {
        let (places, angles) = (self.vector::<2>(place)?, self.series(angle)?);
        Ok(places.into_iter().zip(angles).map(|(place, angle)| ScenePose::planar(place, angle)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_thinned_and_gaps_are_filled() {
        let time: Vec<f64> = (0..5000).map(f64::from).collect();
        let mut values = time.clone();
        values[0] = f64::NAN;
        values[4999] = f64::NAN;
        let columns = |name: &str| (name == "a").then_some(&values[..]);
        let record = MotionRecord::new(&time, &columns);
        assert_eq!(record.times().len(), MOST_TIMES);
        assert_eq!((record.times()[0], record.times()[MOST_TIMES - 1]), (0.0, 4999.0));
        let shown = record.series("a").unwrap();
        assert_eq!((shown[0], shown[MOST_TIMES - 1]), (1.0, 4998.0));
        assert_eq!(record.series("b"), Err(MissingColumn("b".into())));
    }

    /// Two rows at one time are a jump, a single row is a still picture.
    #[test]
    fn times_increase() {
        let time = [0.0, 1.0, 1.0, 2.0];
        let values = [0.0, 1.0, 5.0, 6.0];
        let columns = |_: &str| Some(&values[..]);
        let record = MotionRecord::new(&time, &columns);
        assert_eq!(
            (record.times(), record.series("a").unwrap()),
            (&[0.0, 1.0, 2.0][..], vec![0.0, 5.0, 6.0])
        );
        let none: [f64; 0] = [];
        assert!(MotionRecord::new(&none, &columns).times().is_empty());
        assert_eq!(MotionRecord::new(&time[..1], &columns).times(), &[0.0]);
    }
}
