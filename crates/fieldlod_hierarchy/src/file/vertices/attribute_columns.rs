//! Vertex attributes as columns of numbers.

/// One list of numbers for each coordinate of each attribute, with a number for each vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    pub(crate) columns: Vec<Vec<u32>>,
}

impl Columns {
    /// `count` columns without vertices.
    pub(crate) fn new(count: usize) -> Self {
        let columns = vec![Vec::new(); count];
        Self { columns }
    }

    /// Appends a vertex of `other`, which has as many columns.
    pub(crate) fn push_from(&mut self, other: &Self, vertex: u32) {
        for (column, other) in self.columns.iter_mut().zip(&other.columns) {
            column.push(other[vertex as usize]);
        }
    }

    /// The numbers of a vertex.
    pub(crate) fn row(&self, vertex: u32) -> Vec<u32> {
        let columns = self.columns.iter();
        columns.map(|column| column[vertex as usize]).collect()
    }
}
