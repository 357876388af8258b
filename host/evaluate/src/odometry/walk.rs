//! Walks in a shoe with the position of its IMU.

use std::fs;
use std::path::Path;

use estimator_core::{ContactEstimate, Params};
use recordings::replay::replay;
use samples::space::Vector;

use crate::error::Error;
use crate::labelled::Labelled;
use crate::sets::{FileLayout, SHOE_WALKS, Set};

/// Folder of the positions, next to that of the recordings.
pub const POSITIONS: &str = "pyshoe-positions";

/// Walk with its truth and the estimates of the default preset.
#[derive(Clone, Debug)]
pub struct Walk {
    /// True positions at the samples, m; z up.
    pub positions: Vec<Vector>,
    /// True speed at the samples, m/s.
    pub speeds: Vec<f64>,
    /// Estimates, one per sample.
    pub estimates: Vec<ContactEstimate>,
    /// Recording with its labels; gravity is included.
    pub labelled: Labelled,
}

impl Walk {
    /// The twelve walks; files are in the folder of datasets.
    ///
    /// # Errors
    /// A file is missing or invalid.
    pub fn all(datasets: &Path) -> Result<Vec<Self>, Error> {
        let labelled = Labelled::of_sets([Set::Shoe], datasets)?;
        SHOE_WALKS
            .into_iter()
            .zip(labelled)
            .map(|(path, labelled)| Self::read(datasets, path, labelled))
            .collect()
    }

    fn read(datasets: &Path, path: &str, labelled: Labelled) -> Result<Self, Error> {
        let file = path.replace("pyshoe/", &format!("{POSITIONS}/"));
        let rows = labelled.readings.len();
        let [x, y, z] = columns(&datasets.join(file), ["x", "y", "z"], rows)?;
        let [speeds] = columns(&datasets.join(path), ["speed"], rows)?;
        // The optical frame is left-handed with z up; PyShoe compares it with tracks whose z it has
        // inverted.
        let positions = x.iter().zip(&y).zip(&z);
        let positions = positions.map(|((x, y), z)| Vector::new(*x, -y, *z));
        Ok(Self {
            positions: positions.collect(),
            speeds,
            estimates: replay(&labelled.recording, &Params::DEFAULT)?,
            labelled,
        })
    }
}

/// Reads columns of a table with a header and this number of rows.
fn columns<const N: usize>(
    path: &Path,
    names: [&str; N],
    rows: usize,
) -> Result<[Vec<f64>; N], Error> {
    let file = path.display().to_string();
    let no_dataset = |_| Error::NoDataset {
        file: file.clone(),
        origin: FileLayout::Walk.origin(),
    };
    let text = fs::read_to_string(path).map_err(no_dataset)?;
    parsed(&text, names, rows).ok_or(Error::Truth { file })
}

fn parsed<const N: usize>(text: &str, names: [&str; N], rows: usize) -> Option<[Vec<f64>; N]> {
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next()?.split(',').collect();
    let mut columns = names.map(|_| Vec::with_capacity(rows));
    let places = names.map(|name| header.iter().position(|title| *title == name));
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        for (column, place) in columns.iter_mut().zip(places) {
            column.push(cells.get(place?)?.trim().parse().ok()?);
        }
    }
    columns
        .iter()
        .all(|column| column.len() == rows)
        .then_some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let text = "t,x,y\n0.0,1.5,2\n0.1,-3,4\n";
        let expected = Some([vec![2.0, 4.0], vec![1.5, -3.0]]);
        assert_eq!(parsed(text, ["y", "x"], 2), expected);
    }

    #[test]
    fn missing_column_cell_or_row_is_an_error() {
        let complete = "t,x\n0,1\n1,2\n";
        assert!(parsed(complete, ["x"], 2).is_some());
        assert_eq!(parsed(complete, ["z"], 2), None);
        assert_eq!(parsed(complete, ["x"], 3), None);
        assert_eq!(parsed("t,x\n0,1\n1,\n", ["x"], 2), None);
        assert_eq!(parsed("t,x\n0,1\n1\n", ["x"], 2), None);
    }
}
