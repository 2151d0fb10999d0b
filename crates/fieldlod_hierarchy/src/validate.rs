//! Checks the invariants of a hierarchy, one small function each.

mod bounds;
mod links;
mod measures;
mod ranges;

use thiserror::Error;

use crate::hierarchy::Hierarchy;

/// A broken invariant of a hierarchy.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant names its fields")]
pub enum InvalidHierarchy {
    /// The length of an attribute array is neither 0 nor the number of vertices.
    #[error("{count} {attribute} for {vertices} vertices")]
    AttributeCount {
        attribute: &'static str,
        count: usize,
        vertices: usize,
    },
    /// There are more source vertices than vertices.
    #[error("{count} source vertices, but only {vertices} vertices")]
    SourceVertexCount { count: usize, vertices: usize },
    /// `moved_from` is neither empty nor complete.
    #[error("{count} entries of moved_from for {moved} moved vertices")]
    MovedFromCount { count: usize, moved: usize },
    /// A position is NaN or infinite.
    #[error("vertex {vertex} has a position that is not finite")]
    PositionNotFinite { vertex: usize },
    /// Ranges have gaps, overlap, or do not cover the array.
    #[error(
        "the {what} of the first {index} {owner}s do not end where the next ones begin, or where the list ends"
    )]
    BrokenRange {
        what: &'static str,
        owner: &'static str,
        index: usize,
    },
    /// An index is out of range.
    #[error("{owner} {index} refers to {what} {target}, which does not exist")]
    DanglingReference {
        owner: &'static str,
        index: usize,
        what: &'static str,
        target: usize,
    },
    /// A finer group does not precede its coarser group.
    #[error("group {group} has the finer group {finer}, which does not come before it")]
    FinerNotBefore { group: usize, finer: usize },
    /// The finer groups differ from the producers of the consumed units.
    #[error("the finer groups of group {group} are not the producers of its units")]
    FinerMismatch { group: usize },
    /// A group has no units.
    #[error("group {group} consumes no unit")]
    EmptyGroup { group: usize },
    /// A unit has no triangles.
    #[error("unit {unit} has no triangle")]
    EmptyUnit { unit: usize },
    /// A unit is in the range of one group but names another group as its consumer.
    #[error("unit {unit} is in the range of group {group} but names group {named}")]
    WrongConsumer {
        unit: usize,
        group: usize,
        named: usize,
    },
    /// A terminal group has no simplification, but produces a unit.
    #[error("unit {unit} is produced by group {group}, which is terminal")]
    ProducedByTerminal { unit: usize, group: usize },
    /// A group that is not terminal produces no unit, so its surface would disappear.
    #[error("group {group} is not terminal but produces no unit")]
    ProducesNothing { group: usize },
    /// The level is not one above the coarsest finer group.
    #[error("group {group} has level {level}, but its finer groups imply {expected}")]
    BadLevel {
        group: usize,
        level: u32,
        expected: u32,
    },
    /// An error is negative or NaN, or is smaller than that of a finer group.
    #[error("group {group} has error {error}, which is negative, NaN or below a finer group's")]
    BadError { group: usize, error: f32 },
    /// A deviation is negative or NaN, or is smaller than that of a finer group, or only one of deviation and error
    /// is infinite. In an unmeasured hierarchy, all deviations are infinite.
    #[error(
        "group {group} has deviation {deviation}, which is negative, NaN, below a finer group's, or \
         not infinite for the same groups as the error"
    )]
    BadDeviation { group: usize, deviation: f32 },
    /// A whole-mesh error is negative or not finite, or is smaller than that of a finer group.
    #[error(
        "group {group} has whole-mesh error {error}, which is negative, not finite or below a finer \
         group's"
    )]
    BadWholeMeshError { group: usize, error: f32 },
    /// A bounding sphere is not finite, or has a negative radius.
    #[error("the bounds of group {group} are not finite or have a negative radius")]
    BadBounds { group: usize },
    /// Bounds do not contain their triangles.
    #[error("the bounds of {owner} {index} do not contain its triangles")]
    TrianglesOutsideBounds { owner: &'static str, index: usize },
    /// A mean normal is NaN or longer than 1.
    #[error("group {group} has a mean normal that is NaN or longer than 1")]
    BadMeanNormal { group: usize },
}

use InvalidHierarchy as E;

impl Hierarchy {
    /// Checks every invariant.
    ///
    /// # Errors
    /// The first broken invariant.
    pub fn validate(&self) -> Result<(), InvalidHierarchy> {
        if let Some(vertex) = self.vertices.positions.iter().position(|p| !p.is_finite()) {
            return Err(E::PositionNotFinite { vertex });
        }
        self.check_vertices()?;
        // These come first: later checks index with these ranges and references, and could panic.
        self.check_group_ranges()?;
        self.check_unit_ranges()?;
        self.check_group_references()?;
        self.check_vertex_references()?;
        self.check_links()?;
        self.check_errors()?;
        self.check_bounds()
    }

    /// Checks groups, units and links of a hierarchy without geometry.
    pub(crate) fn validate_graph(&self) -> Result<(), InvalidHierarchy> {
        self.check_group_ranges()?;
        self.check_group_references()?;
        self.check_links()?;
        self.check_errors()?;
        self.check_spheres()
    }

    fn check_vertices(&self) -> Result<(), E> {
        let vertices = self.vertices.positions.len();
        if let Some((attribute, count)) = self.vertices.incomplete_attribute() {
            return Err(E::AttributeCount {
                attribute,
                count,
                vertices,
            });
        }
        self.check_moved_vertices()
    }

    fn check_moved_vertices(&self) -> Result<(), E> {
        let vertices = self.vertices.positions.len();
        let count = self.source_vertex_count as usize;
        let Some(moved) = vertices.checked_sub(count) else {
            return Err(E::SourceVertexCount { count, vertices });
        };
        match self.moved_from.len() {
            0 => Ok(()),
            count if count == moved => Ok(()),
            count => Err(E::MovedFromCount { count, moved }),
        }
    }
}
