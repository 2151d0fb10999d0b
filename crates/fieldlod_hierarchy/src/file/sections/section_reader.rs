//! Decodes a section. `section_writer` documents the layout.

use crate::file::error::FileError;
use crate::file::reader::Reader;
use crate::file::sections::coded::{Coded, Ends, GROUP_BYTES, MAX_PER_BYTE, TRIANGLE_BYTES};
use crate::file::sections::numbers::{self, unzigzag};
use crate::file::sections::records;
use crate::file::sections::references::References;
use crate::file::sections::triangles;
use crate::file::vertices::planes::{self, Plane};
use crate::hierarchy::{Group, NO_GROUP, Unit};

/// Reads a section and appends it to `coded`. The section ends with `unused_vertices` vertices that no unit uses, and
/// with `origins` entries of `moved_from`.
pub(crate) fn read(
    bytes: &[u8],
    coded: &mut Coded,
    planes: &[Plane],
    unused_vertices: usize,
    origins: usize,
) -> Result<(), FileError> {
    let mut section = SectionReader {
        from: coded.ends(),
        reader: Reader { rest: bytes },
        budget: Budget::of(bytes),
        coded,
    };
    section.read_graph()?;
    let counts = section.claim_geometry()?;
    let used = section.read_references(counts.references)?;
    let added = section.claim_vertices(used as u64 + unused_vertices as u64)?;
    section.read_triangles(counts.triangles)?;
    section.read_vertex_order(added)?;
    planes::read(
        &mut section.reader,
        &mut section.coded.columns,
        added,
        planes,
    )?;
    let origins = section.budget.claim(origins as u64, 4)?;
    let moved_from = numbers::read(&mut section.reader, origins, "the origins")?;
    section.coded.moved_from.extend(moved_from);
    section.reader.end("the end of a section")
}

struct SectionReader<'a> {
    reader: Reader<'a>,
    budget: Budget,
    coded: &'a mut Coded,
    from: Ends,
}

/// Sums of the counts of all units of a section.
struct UnitCounts {
    /// Entries of vertex lists.
    references: usize,
    triangles: usize,
}

/// Reads a graph without geometry and appends it to `coded`.
pub(crate) fn read_graph(reader: &mut Reader<'_>, coded: &mut Coded) -> Result<(), FileError> {
    let mut section = SectionReader {
        from: coded.ends(),
        budget: Budget::of(reader.rest),
        reader: Reader { rest: reader.rest },
        coded,
    };
    section.read_graph()?;
    let read = reader.rest.len() - section.reader.rest.len();
    reader.rest = &reader.rest[read..];
    Ok(())
}

impl SectionReader<'_> {
    /// Reads groups, units and their links.
    fn read_graph(&mut self) -> Result<(), FileError> {
        self.read_groups()?;
        self.read_units()
    }

    fn read_groups(&mut self) -> Result<(), FileError> {
        const WHAT: &str = "the groups";
        let count: u32 = self.reader.value(WHAT)?;
        let count = self.budget.claim(u64::from(count), GROUP_BYTES)?;
        read_indices(&mut self.reader, count, WHAT, &mut self.coded.group_indices)?;
        let groups: Vec<Group> = records::read(&mut self.reader, count, WHAT)?;
        let finer = groups.iter().map(|group| group.finer_count);
        let finer = self.budget.claim_all(finer, 4)?;
        self.coded.groups.extend(groups);
        self.read_finer(finer)
    }

    fn read_finer(&mut self, count: usize) -> Result<(), FileError> {
        // Links are coded as distances to their group.
        let differences = numbers::read(&mut self.reader, count, "the finer groups")?;
        // Malformed differences wrap to wrong indices. Validation rejects wrong links.
        let mut left = differences.into_iter();
        let mut finer = Vec::with_capacity(count);
        for (group, index) in self.coded.groups_since(self.from.groups) {
            let links = left.by_ref().take(group.finer_count as usize);
            finer.extend(links.map(|difference| index.wrapping_sub(difference)));
        }
        self.coded.finer.extend(finer);
        Ok(())
    }

    fn read_units(&mut self) -> Result<(), FileError> {
        let groups = &self.coded.groups[self.from.groups..];
        let count = groups.iter().map(|group| group.unit_count);
        let count = self.budget.claim_all(count, size_of::<Unit>())?;
        let units: Vec<Unit> = records::read(&mut self.reader, count, "the units")?;
        self.coded.units.extend(units);
        self.restore_units()
    }

    /// Claims memory for the vertex lists and triangles of the units.
    fn claim_geometry(&mut self) -> Result<UnitCounts, FileError> {
        let units = &self.coded.units[self.from.units..];
        let mut claim =
            |count: fn(&Unit) -> u32, bytes| self.budget.claim_all(units.iter().map(count), bytes);
        Ok(UnitCounts {
            references: claim(|unit| unit.vertex_count, 4)?,
            triangles: claim(|unit| unit.triangle_count, TRIANGLE_BYTES)?,
        })
    }

    /// Restores the consumer and the producer of each unit.
    fn restore_units(&mut self) -> Result<(), FileError> {
        const CORRUPT: FileError = FileError::Corrupt { what: "the units" };
        let coded = &mut *self.coded;
        let mut units_left = coded.units[self.from.units..].iter_mut();
        let groups = coded.groups[self.from.groups..].iter();
        for (group, &index) in groups.zip(&coded.group_indices[self.from.groups..]) {
            for _ in 0..group.unit_count {
                let unit = units_left.next().ok_or(CORRUPT)?;
                unit.produced_by = match unit.produced_by {
                    0 => NO_GROUP,
                    // A wrapped index could equal `NO_GROUP`.
                    difference => index.checked_sub(difference).ok_or(CORRUPT)?,
                };
                unit.consumed_by = index;
            }
        }
        Ok(())
    }

    /// Reads vertex lists and returns the number of new vertices.
    fn read_references(&mut self, count: usize) -> Result<usize, FileError> {
        const WHAT: &str = "the vertex lists";
        let mut references = References::new(self.from.vertices);
        self.coded.unit_vertices.reserve(count);
        for number in numbers::read(&mut self.reader, count, WHAT)? {
            let vertex = references
                .vertex(number)
                .ok_or(FileError::Corrupt { what: WHAT });
            self.coded.unit_vertices.push(vertex?);
        }
        Ok(references.next as usize - self.from.vertices)
    }

    /// Claims memory for `count` new vertices.
    fn claim_vertices(&mut self, count: u64) -> Result<usize, FileError> {
        let bytes = (self.coded.columns.columns.len() + 1) * 4;
        self.budget.claim(count, bytes)
    }

    /// Reads the indices of `count` new vertices in the hierarchy.
    fn read_vertex_order(&mut self, count: usize) -> Result<(), FileError> {
        let indices = &mut self.coded.vertex_indices;
        if self.coded.is_page {
            let first = indices.len() as u32;
            indices.extend(first..first + count as u32);
        } else {
            let read = numbers::read(&mut self.reader, count, "the vertex order")?;
            indices.extend(read);
        }
        Ok(())
    }

    fn read_triangles(&mut self, count: usize) -> Result<(), FileError> {
        let mut corner = || numbers::read(&mut self.reader, count, "the triangles");
        let numbers: triangles::Numbers = [corner()?, corner()?, corner()?];
        self.coded.indices.reserve(count * 3);
        let mut first = 0;
        for unit in &self.coded.units[self.from.units..] {
            let end = first + unit.triangle_count as usize;
            let of_unit = numbers.each_ref().map(|numbers| &numbers[first..end]);
            triangles::read_unit(of_unit, unit.vertex_count, &mut self.coded.indices)?;
            first = end;
        }
        Ok(())
    }
}

/// Reads `count` indices that are mostly consecutive.
fn read_indices(
    reader: &mut Reader<'_>,
    count: usize,
    what: &'static str,
    indices: &mut Vec<u32>,
) -> Result<(), FileError> {
    let mut before = u32::MAX;
    let differences = numbers::read(reader, count, what)?;
    indices.extend(differences.into_iter().map(|difference| {
        before = before.wrapping_add(unzigzag(difference)).wrapping_add(1);
        before
    }));
    Ok(())
}

/// Memory that the rest of a section may claim.
struct Budget {
    bytes: u64,
}

impl Budget {
    fn of(section: &[u8]) -> Self {
        let bytes = (section.len() as u64).saturating_mul(MAX_PER_BYTE);
        Self { bytes }
    }

    /// Claims memory for `count` elements.
    fn claim(&mut self, count: u64, element_bytes: usize) -> Result<usize, FileError> {
        let what = "the number of elements";
        let claimed = count.saturating_mul(element_bytes as u64);
        let left = self.bytes.checked_sub(claimed);
        self.bytes = left.ok_or(FileError::Corrupt { what })?;
        Ok(count as usize)
    }

    fn claim_all(
        &mut self,
        counts: impl Iterator<Item = u32>,
        element_bytes: usize,
    ) -> Result<usize, FileError> {
        self.claim(counts.map(u64::from).sum(), element_bytes)
    }
}
