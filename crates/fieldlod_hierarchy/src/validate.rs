//! Every invariant of a hierarchy, one small check each. The loader, the baker's tests and the
//! selection's tests call them all through [`Hierarchy::validate`].

mod bounds;
mod links;
mod measures;
mod ranges;

use thiserror::Error;

use crate::hierarchy::Hierarchy;

/// The first broken invariant that was found.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
#[expect(
    missing_docs,
    reason = "the fields are named by each variant's message"
)]
pub enum InvalidHierarchy {
    /// An attribute array does not have one entry per vertex.
    #[error("{count} {attribute} for {vertices} vertices")]
    AttributeCount {
        attribute: &'static str,
        count: usize,
        vertices: usize,
    },
    /// The source's vertices are some of all.
    #[error("{count} vertices of the source among {vertices}")]
    SourceVertexCount { count: usize, vertices: usize },
    /// Every moved vertex names the source vertex that it came from, or none does.
    #[error("{count} origins for {moved} moved vertices")]
    MovedFromCount { count: usize, moved: usize },
    /// It was read from a file that leaves the source's vertices out.
    #[error("it is without the vertices of its source")]
    LacksSourceVertices,
    /// The source's vertices are others than those that are missing.
    #[error("the source has {vertices} vertices, but should have {expected}")]
    OtherSource { vertices: usize, expected: usize },
    /// The vertices of the source and the moved ones have the same attributes.
    #[error("only the source vertices or only the moved vertices have {attribute}")]
    OtherAttributes { attribute: &'static str },
    /// A position is NaN or infinite.
    #[error("vertex {vertex} has a position that is not finite")]
    PositionNotFinite { vertex: usize },
    /// Sub-ranges must follow each other without gap or overlap and end with the array.
    #[error("the {what} of {owner} {index} do not follow the previous ones, or end out of range")]
    BrokenRange {
        what: &'static str,
        owner: &'static str,
        index: usize,
    },
    /// A reference to something that does not exist.
    #[error("{owner} {index} refers to {what} {target}, which does not exist")]
    DanglingReference {
        owner: &'static str,
        index: usize,
        what: &'static str,
        target: usize,
    },
    /// A finer group must come before the coarser ones.
    #[error("group {group} has the finer group {finer}, which does not come before it")]
    FinerNotBefore { group: usize, finer: usize },
    /// The finer groups are exactly the producers of the units consumed.
    #[error("the finer groups of group {group} are not the producers of its units")]
    FinerMismatch { group: usize },
    /// A group without units.
    #[error("group {group} consumes no unit")]
    EmptyGroup { group: usize },
    /// A unit without triangles.
    #[error("unit {unit} has no triangle")]
    EmptyUnit { unit: usize },
    /// A unit in the range of one group that names another as consumer.
    #[error("unit {unit} is in the range of group {group} but names group {named}")]
    WrongConsumer {
        unit: usize,
        group: usize,
        named: usize,
    },
    /// A terminal group has no simplification, so nothing can be produced by it.
    #[error("unit {unit} is produced by group {group}, which is terminal")]
    ProducedByTerminal { unit: usize, group: usize },
    /// A group that is not terminal must produce something, or its surface would vanish.
    #[error("group {group} is not terminal but produces no unit")]
    ProducesNothing { group: usize },
    /// Levels count simplifications.
    #[error("group {group} has level {level}, but its finer groups imply {expected}")]
    BadLevel {
        group: usize,
        level: u32,
        expected: u32,
    },
    /// Errors are lengths and never shrink from finer to coarser.
    #[error("group {group} has error {error}, which is negative, NaN or below a finer group's")]
    BadError { group: usize, error: f32 },
    /// Deviations are lengths, never shrink from finer to coarser, and are infinite exactly where
    /// the error is; or everywhere, if they were not measured.
    #[error(
        "group {group} has deviation {deviation}, which is negative, NaN, below a finer group's, or \
         infinite where the error is not or the other way round"
    )]
    BadDeviation { group: usize, deviation: f32 },
    /// Errors of the whole mesh are lengths and never shrink from finer to coarser.
    #[error(
        "group {group} has whole-mesh error {error}, which is negative, not finite or below a finer \
         group's"
    )]
    BadWholeMeshError { group: usize, error: f32 },
    /// Bounds are finite and not negative.
    #[error("the bounds of {owner} {index} are not finite or negative")]
    BadBounds { owner: &'static str, index: usize },
    /// Bounds contain what they are around.
    #[error("the bounds of {owner} {index} do not contain its triangles")]
    TrianglesOutsideBounds { owner: &'static str, index: usize },
    /// The mean of unit vectors is no longer than 1.
    #[error("group {group} has a mean normal that is NaN or longer than 1")]
    BadMeanNormal { group: usize },
}

use InvalidHierarchy as E;

impl Hierarchy {
    /// Checks every invariant.
    ///
    /// # Errors
    /// The first invariant found broken.
    pub fn validate(&self) -> Result<(), InvalidHierarchy> {
        if self.lacks_source_vertices() {
            return Err(E::LacksSourceVertices);
        }
        if let Some(vertex) = self.vertices.positions.iter().position(|p| !p.is_finite()) {
            return Err(E::PositionNotFinite { vertex });
        }
        self.validate_apart_from_places()?;
        self.check_bounds()
    }

    /// Checks all that does not depend on where vertices are.
    pub(crate) fn validate_apart_from_places(&self) -> Result<(), InvalidHierarchy> {
        self.check_vertices()?;
        // What follows relies on these, and would read out of bounds without.
        self.check_group_ranges()?;
        self.check_unit_ranges()?;
        self.check_group_references()?;
        self.check_vertex_references()?;
        self.check_links()?;
        self.check_errors()
    }

    /// Checks groups, units and their links, where there is no geometry.
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
