//! The numbers of every vertex, each predicted from those of the vertices that came before.

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::numbers::{self, Kind};
use crate::file::vertices::predict::{Predict, remainders_of, restored};
use crate::file::vertices::rows::{Prediction, Rows};

/// Columns that are coded together at most.
const TOGETHER: usize = 4;

/// Columns that are coded together, and the first of them.
fn columns_together(predictors: &[Predict]) -> impl Iterator<Item = (usize, &[Predict])> {
    let alike = predictors.chunk_by(|a, b| a == b);
    let together = alike.flat_map(|alike| match alike[0] {
        Predict::FloatDirection | Predict::FloatNormal => alike.chunks(3),
        _ => alike.chunks(TOGETHER),
    });
    together.scan(0, |next, columns| {
        let first = *next;
        *next += columns.len();
        Some((first, columns))
    })
}

/// What is known of the vertices of a section besides their numbers.
pub(in crate::file) struct Targets<'a> {
    pub(in crate::file) predictors: &'a [Predict],
    pub(in crate::file) predictions: &'a [Prediction],
    /// Which of the targets have numbers of their own.
    pub(in crate::file) are_stored: &'a [bool],
    /// The normal of each as its triangles lie, from rows that have positions.
    pub(in crate::file) normals: &'a dyn Fn(&Rows) -> Vec<[u32; 3]>,
}

impl Targets<'_> {
    fn normals_for(&self, predict: Predict, rows: &Rows) -> Vec<[u32; 3]> {
        match predict {
            Predict::FloatNormal | Predict::IntNormal => (self.normals)(rows),
            _ => Vec::new(),
        }
    }
}

/// Codes the targets. Those that are not stored get the numbers that the reader will take for
/// theirs.
pub(in crate::file) fn write(bytes: &mut Vec<u8>, rows: &mut Rows, targets: &Targets<'_>) {
    let predictions = targets.predictions;
    for (first, columns) in columns_together(targets.predictors) {
        let (predict, count) = (columns[0], columns.len());
        let normals = targets.normals_for(predict, rows);
        let mut remainders = vec![Vec::with_capacity(predictions.len()); count];
        for (index, (p, &is_stored)) in predictions.iter().zip(targets.are_stored).enumerate() {
            let numbers = match normals.get(index) {
                Some(&[x, y, z]) => [[x, y, z, 0]; 3],
                None => [p.a, p.b, p.d].map(|place| rows.up_to(place, first, count)),
            };
            if is_stored {
                let target: [u32; TOGETHER] = rows.up_to(p.target, first, count);
                let found = remainders_of(predict, numbers, target);
                for (remainders, number) in remainders.iter_mut().zip(found) {
                    remainders.push(number);
                }
            } else {
                let numbers = restored(predict, numbers, [0; TOGETHER]);
                rows.replace(p.target, first, &numbers[..count]);
            }
        }
        for remainders in &remainders {
            numbers::write(bytes, remainders, Kind::Remainders);
        }
    }
}

/// Reads the targets into rows that have room for them. Those that are not stored are as predicted.
pub(in crate::file) fn read(
    reader: &mut Reader<'_>,
    rows: &mut Rows,
    targets: &Targets<'_>,
) -> Result<(), FileError> {
    let are_stored = targets.are_stored;
    let stored = are_stored.iter().filter(|&&is_stored| is_stored).count();
    let mut remainders: [Vec<u32>; TOGETHER] = Default::default();
    for (first, columns) in columns_together(targets.predictors) {
        // The remainders of these columns.
        for remainders in &mut remainders[..columns.len()] {
            numbers::read_into(reader, stored, "the vertices", remainders)?;
            spread(remainders, are_stored);
        }
        // Together: each column waits for its own numbers only.
        let filler = Filler {
            first,
            predict: columns[0],
            predictions: targets.predictions,
            normals: targets.normals_for(columns[0], rows),
        };
        let [x, y, z, w] = &remainders;
        match columns.len() {
            1 => filler.fill(rows, [x]),
            2 => filler.fill(rows, [x, y]),
            3 => filler.fill(rows, [x, y, z]),
            _ => filler.fill(rows, [x, y, z, w]),
        }
    }
    Ok(())
}

/// Puts zeros between numbers, for those that are not stored.
fn spread(numbers: &mut Vec<u32>, are_stored: &[bool]) {
    let mut left = numbers.len();
    numbers.resize(are_stored.len(), 0);
    // From the end, and no farther than where nothing is missing.
    for place in (0..are_stored.len()).rev() {
        if left == place + 1 {
            break;
        }
        numbers[place] = if are_stored[place] {
            left -= 1;
            numbers[left]
        } else {
            0
        };
    }
}

/// Restores the columns from `first` on.
struct Filler<'a> {
    first: usize,
    predict: Predict,
    predictions: &'a [Prediction],
    normals: Vec<[u32; 3]>,
}

impl Filler<'_> {
    fn fill<const N: usize>(&self, rows: &mut Rows, remainders: [&Vec<u32>; N]) {
        use Predict::{FloatDirection, FloatMean, FloatParallelogram, IntMean, IntParallelogram};
        // As long as the predictions, which spares a check for each.
        let remainders = remainders.map(|remainders| &remainders[..self.predictions.len()]);
        // A loop for each kind, so that nothing is decided within.
        match self.predict {
            FloatParallelogram => self.fill_with(rows, remainders, |numbers, remainders| {
                restored(FloatParallelogram, numbers, remainders)
            }),
            FloatMean => self.fill_with(rows, remainders, |numbers, remainders| {
                restored(FloatMean, numbers, remainders)
            }),
            FloatDirection => self.fill_with(rows, remainders, |numbers, remainders| {
                restored(FloatDirection, numbers, remainders)
            }),
            IntParallelogram => self.fill_with(rows, remainders, |numbers, remainders| {
                restored(IntParallelogram, numbers, remainders)
            }),
            IntMean => self.fill_with(rows, remainders, |numbers, remainders| {
                restored(IntMean, numbers, remainders)
            }),
            Predict::FloatNormal => self.fill_normals(rows, remainders, FloatDirection),
            Predict::IntNormal => self.fill_normals(rows, remainders, IntMean),
        }
    }

    #[inline(always)]
    fn fill_with<const N: usize>(
        &self,
        rows: &mut Rows,
        remainders: [&[u32]; N],
        restored: impl Fn([[u32; N]; 3], [u32; N]) -> [u32; N],
    ) {
        for (index, p) in self.predictions.iter().enumerate() {
            // Not `map` on the array: it may stay a call.
            let (a, b) = (rows.some(p.a, self.first), rows.some(p.b, self.first));
            let numbers = [a, b, rows.some(p.d, self.first)];
            let remainders = std::array::from_fn(|k| remainders[k][index]);
            rows.set::<N>(p.target, self.first, restored(numbers, remainders));
        }
    }

    fn fill_normals<const N: usize>(
        &self,
        rows: &mut Rows,
        remainders: [&[u32]; N],
        like: Predict,
    ) {
        for (index, (p, normal)) in self.predictions.iter().zip(&self.normals).enumerate() {
            let guess = std::array::from_fn(|k| normal[k]);
            let remainders = std::array::from_fn(|k| remainders[k][index]);
            rows.set::<N>(p.target, self.first, restored(like, [guess; 3], remainders));
        }
    }
}
