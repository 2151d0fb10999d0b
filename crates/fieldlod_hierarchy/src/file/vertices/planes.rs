//! Codes vertex rows as differences to predictions from earlier vertices.

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::numbers::{self, Kind};
use crate::file::vertices::predict::{Predict, residuals_of, restored};
use crate::file::vertices::rows::{Prediction, Rows};

/// Largest number of columns that are coded in one pass.
const MAX_COLUMNS: usize = 4;

/// Sets of columns that are coded in one pass, with the index of the first column.
fn column_sets(predictors: &[Predict]) -> impl Iterator<Item = (usize, &[Predict])> {
    let equal = predictors.chunk_by(|a, b| a == b);
    let sets = equal.flat_map(|equal| match equal[0] {
        Predict::FloatDirection | Predict::FloatNormal => equal.chunks(3),
        _ => equal.chunks(MAX_COLUMNS),
    });
    sets.scan(0, |next, columns| {
        let first = *next;
        *next += columns.len();
        Some((first, columns))
    })
}

/// The vertices of a section and their predictions.
pub(crate) struct Targets<'a> {
    pub(crate) predictors: &'a [Predict],
    pub(crate) predictions: &'a [Prediction],
    /// Computes the predicted normal of each target. The rows must have positions.
    pub(crate) normals: &'a dyn Fn(&Rows) -> Vec<[u32; 3]>,
}

impl Targets<'_> {
    fn normals_for(&self, predict: Predict, rows: &Rows) -> Vec<[u32; 3]> {
        match predict {
            Predict::FloatNormal | Predict::IntNormal => (self.normals)(rows),
            _ => Vec::new(),
        }
    }
}

/// Writes the targets.
pub(crate) fn write(bytes: &mut Vec<u8>, rows: &Rows, targets: &Targets<'_>) {
    let predictions = targets.predictions;
    for (first, columns) in column_sets(targets.predictors) {
        let (predict, count) = (columns[0], columns.len());
        // Positions come first, so the rows hold the decoded positions when normals are predicted.
        let normals = targets.normals_for(predict, rows);
        let mut residuals = vec![Vec::with_capacity(predictions.len()); count];
        for (index, p) in predictions.iter().enumerate() {
            let numbers = match normals.get(index) {
                Some(&[x, y, z]) => [[x, y, z, 0]; 3],
                None => [p.a, p.b, p.d].map(|row| rows.up_to(row, first, count)),
            };
            let target: [u32; MAX_COLUMNS] = rows.up_to(p.target, first, count);
            let found = residuals_of(predict, numbers, target);
            for (residuals, number) in residuals.iter_mut().zip(found) {
                residuals.push(number);
            }
        }
        for residuals in &residuals {
            numbers::write(bytes, residuals, Kind::Residuals);
        }
    }
}

/// Reads the targets into existing rows.
pub(crate) fn read(
    reader: &mut Reader<'_>,
    rows: &mut Rows,
    targets: &Targets<'_>,
) -> Result<(), FileError> {
    let count = targets.predictions.len();
    let mut residuals: [Vec<u32>; MAX_COLUMNS] = Default::default();
    for (first, columns) in column_sets(targets.predictors) {
        for residuals in &mut residuals[..columns.len()] {
            numbers::read_into(reader, count, "the vertices", residuals)?;
        }
        // One pass decodes several columns: while one waits for its last result, the CPU works on another.
        let filler = Filler {
            first,
            predict: columns[0],
            predictions: targets.predictions,
            normals: targets.normals_for(columns[0], rows),
        };
        let [x, y, z, w] = &residuals;
        match columns.len() {
            1 => filler.fill(rows, [x]),
            2 => filler.fill(rows, [x, y]),
            3 => filler.fill(rows, [x, y, z]),
            _ => filler.fill(rows, [x, y, z, w]),
        }
    }
    Ok(())
}

/// Restores the columns that start at `first`.
struct Filler<'a> {
    first: usize,
    predict: Predict,
    predictions: &'a [Prediction],
    normals: Vec<[u32; 3]>,
}

impl Filler<'_> {
    fn fill<const N: usize>(&self, rows: &mut Rows, residuals: [&Vec<u32>; N]) {
        use Predict::{FloatDirection, FloatMean, FloatParallelogram, IntMean, IntParallelogram};
        // Equal lengths let the compiler remove bounds checks.
        let residuals = residuals.map(|residuals| &residuals[..self.predictions.len()]);
        // A literal predictor in each arm keeps the choice out of the loops.
        match self.predict {
            FloatParallelogram => self.fill_with(rows, residuals, FloatParallelogram),
            FloatMean => self.fill_with(rows, residuals, FloatMean),
            FloatDirection => self.fill_with(rows, residuals, FloatDirection),
            IntParallelogram => self.fill_with(rows, residuals, IntParallelogram),
            IntMean => self.fill_with(rows, residuals, IntMean),
            Predict::FloatNormal => self.fill_normals(rows, residuals, FloatDirection),
            Predict::IntNormal => self.fill_normals(rows, residuals, IntMean),
        }
    }

    #[inline(always)]
    fn fill_with<const N: usize>(&self, rows: &mut Rows, residuals: [&[u32]; N], predict: Predict) {
        for (index, p) in self.predictions.iter().enumerate() {
            // Array `map` is not always inlined.
            let (a, b) = (rows.some(p.a, self.first), rows.some(p.b, self.first));
            let numbers = [a, b, rows.some(p.d, self.first)];
            let residuals = std::array::from_fn(|k| residuals[k][index]);
            let restored = restored(predict, numbers, residuals);
            rows.set::<N>(p.target, self.first, restored);
        }
    }

    fn fill_normals<const N: usize>(&self, rows: &mut Rows, residuals: [&[u32]; N], like: Predict) {
        for (index, (p, normal)) in self.predictions.iter().zip(&self.normals).enumerate() {
            let guess = std::array::from_fn(|k| normal[k]);
            let residuals = std::array::from_fn(|k| residuals[k][index]);
            rows.set::<N>(p.target, self.first, restored(like, [guess; 3], residuals));
        }
    }
}
