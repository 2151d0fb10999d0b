//! Codes the triangles of a unit by shared edges.
//!
//! As in meshoptimizer's index codec (A. Kapoulkine), a triangle is coded as an edge of a recent
//! triangle and a third vertex. The third vertex is the next unused vertex, one of two neighbours along
//! the border (J. Rossignac: Edgebreaker, 1999), a recent vertex, or a distance. The symbols are
//! entropy-coded. Triangles keep their first corner, which costs least if it is the lowest vertex.

use crate::file::error::FileError;
use crate::file::sections::border::Border;
use crate::file::sections::numbers::{unzigzag, zigzag};

/// Number of remembered edges and vertices, as in meshoptimizer's index codec. More entries take longer to search and
/// need more bits per symbol; fewer entries find fewer shared edges.
const EDGES: usize = 16;
const RECENT: usize = 16;

/// The triangle shares no recent edge.
const MISS: u32 = EDGES as u32 * 3;
/// The next unused vertex.
const NEXT: u32 = 0;
/// The first of two symbols for vertices along the border.
const BORDER: u32 = 1;
/// The first of the symbols for recent vertices.
const FIRST_RECENT: u32 = 3;
/// The vertex is coded as the distance to the last vertex with this symbol.
const FAR: u32 = FIRST_RECENT + RECENT as u32;

/// Border neighbours of a triangle without a shared edge.
const NOTHING: [u16; 2] = [u16::MAX; 2];

const WHAT: &str = "the triangles";

/// The symbols of the triangles of a section.
#[derive(Debug, Default)]
pub(crate) struct Symbols {
    /// For each triangle: age of the edge × 3 + number of corners between the lowest vertex and the
    /// first corner.
    pub(crate) edges: Vec<u32>,
    /// A symbol for each vertex that is not on a shared edge.
    pub(crate) vertices: Vec<u32>,
    /// Distances of the vertices with the symbol [`FAR`].
    pub(crate) distances: Vec<u32>,
}

/// A coded triangle. Its corners are rotated so that the shared edge comes first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) corners: [u16; 3],
    /// The third corner of the triangle on the other side of the shared edge.
    pub(crate) opposite: Option<u16>,
}

struct History {
    border: Border,
    edges: [[u16; 3]; EDGES],
    edge_count: usize,
    recent: [u16; RECENT],
    recent_count: usize,
    next: u16,
    last_far: u16,
}

impl History {
    fn new(vertices: usize) -> Self {
        Self {
            border: Border::new(vertices),
            edges: [[0; 3]; EDGES],
            edge_count: 0,
            recent: [0; RECENT],
            recent_count: 0,
            next: 0,
            last_far: 0,
        }
    }

    fn push_edge(&mut self, edge: [u16; 3]) {
        self.edges[self.edge_count % EDGES] = edge;
        self.edge_count += 1;
    }

    /// The edge pushed `age` edges ago.
    fn edge(&self, age: usize) -> Option<[u16; 3]> {
        let place = self.edge_count.checked_sub(age + 1)?;
        Some(self.edges[place % EDGES])
    }

    fn recent(&self, age: usize) -> Option<u16> {
        let place = self.recent_count.checked_sub(age + 1)?;
        Some(self.recent[place % RECENT])
    }

    /// Adds a vertex to the recent vertices.
    fn push_vertex(&mut self, vertex: u16) {
        self.recent[self.recent_count % RECENT] = vertex;
        self.recent_count += 1;
        // Lists are in the order of first use, so the vertex after the highest one is the likely next one.
        if vertex >= self.next {
            self.next = vertex.wrapping_add(1);
        }
    }

    /// The vertex of a symbol below [`FAR`]. The next unused vertex becomes a recent vertex. Branchless,
    /// because the symbol is unpredictable.
    fn take(&mut self, symbol: u32, [after, before]: [u16; 2]) -> Option<u16> {
        let age = symbol.saturating_sub(FIRST_RECENT) as usize + 1;
        if symbol >= FIRST_RECENT && age > self.recent_count {
            return None;
        }
        let is_next = symbol == NEXT;
        let newest = self.recent_count % RECENT;
        let recent = self.recent[self.recent_count.wrapping_sub(age) % RECENT];
        let vertex = [self.next, after, before, recent][symbol.min(FIRST_RECENT) as usize];
        self.recent[newest] = if is_next { vertex } else { self.recent[newest] };
        self.recent_count += usize::from(is_next);
        self.next = self.next.wrapping_add(u16::from(is_next));
        Some(vertex)
    }

    /// Adds the edges of a triangle, in the direction in which neighbours use them.
    #[inline(always)]
    fn push_edges_of(&mut self, step: Step) {
        let [a, b, c] = step.corners;
        // A shared edge has both its triangles now, so no later triangle will look for it.
        if step.opposite.is_none() {
            self.push_edge([b, a, c]);
        }
        self.push_edge([c, b, a]);
        self.push_edge([a, c, b]);
        self.border.add(a, b);
        self.border.add(b, c);
        self.border.add(c, a);
    }

    fn find(&self, triangle: [u16; 3]) -> Option<(usize, usize)> {
        (0..EDGES).find_map(|age| {
            let [x, y, _] = self.edge(age)?;
            let begins = |&k: &usize| triangle[k] == x && triangle[(k + 1) % 3] == y;
            (0..3).find(begins).map(|k| (age, k))
        })
    }
}

impl Symbols {
    /// Appends the symbols of the triangles of a unit.
    pub(crate) fn write_unit(
        &mut self,
        indices: &[u16],
        vertex_count: u32,
        mut on_step: impl FnMut(Step),
    ) {
        let mut history = History::new(vertex_count as usize);
        let (triangles, _) = indices.as_chunks::<3>();
        for &triangle in triangles {
            let step = match history.find(triangle) {
                Some((age, turn)) => {
                    let corners = std::array::from_fn(|k| triangle[(turn + k) % 3]);
                    // Most triangles start at their lowest vertex. Coded from there, the first corner is mostly 0 and
                    // costs few bits.
                    let begin = (6 - turn - first_corner(corners)) % 3;
                    self.edges.push((age * 3 + begin) as u32);
                    let opposite = history.edge(age).map(|edge| edge[2]);
                    let beside = history.border.beside(corners[0], corners[1]);
                    self.write_vertex(&mut history, corners[2], beside);
                    Step { corners, opposite }
                }
                None => {
                    self.edges.push(MISS);
                    for vertex in triangle {
                        self.write_vertex(&mut history, vertex, NOTHING);
                    }
                    let (corners, opposite) = (triangle, None);
                    Step { corners, opposite }
                }
            };
            history.push_edges_of(step);
            on_step(step);
        }
    }

    fn write_vertex(&mut self, history: &mut History, vertex: u16, beside: [u16; 2]) {
        let recent = (0..RECENT).find(|&age| history.recent(age) == Some(vertex));
        let side = beside.iter().position(|&beside| beside == vertex);
        // A vertex may have several symbols. The smallest one costs the fewest bits.
        if vertex == history.next {
            self.vertices.push(NEXT);
        } else if let Some(side) = side {
            self.vertices.push(BORDER + side as u32);
            return;
        } else if let Some(age) = recent {
            self.vertices.push(FIRST_RECENT + age as u32);
            return;
        } else {
            self.vertices.push(FAR);
            let difference = u32::from(vertex).wrapping_sub(u32::from(history.last_far));
            self.distances.push(zigzag(difference));
            history.last_far = vertex;
        }
        history.push_vertex(vertex);
    }
}

/// The corner with the lowest vertex.
#[inline(always)]
fn first_corner([a, b, c]: [u16; 3]) -> usize {
    // Branchless, because the order is unpredictable.
    let [b_before_a, c_before_a, c_before_b] = [b < a, c < a, c < b].map(usize::from);
    (c_before_a & c_before_b) * 2 + (b_before_a & (1 - c_before_b))
}

/// Rotated corners, by the first corner: the corner with the lowest vertex plus the coded number of corners, which is up
/// to 4.
const ROTATED: [[usize; 3]; 5] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 1, 2], [1, 2, 0]];

/// Decodes symbols to triangles.
#[derive(Debug)]
pub(crate) struct SymbolReader<'a> {
    pub(crate) edges: std::slice::Iter<'a, u32>,
    pub(crate) vertices: std::slice::Iter<'a, u32>,
    pub(crate) distances: std::slice::Iter<'a, u32>,
}

impl SymbolReader<'_> {
    /// Appends the indices of the `triangle_count` triangles of a unit, all below `vertex_count`.
    pub(crate) fn read_unit(
        &mut self,
        triangle_count: u32,
        vertex_count: u32,
        indices: &mut Vec<u16>,
        mut on_step: impl FnMut(Step),
    ) -> Result<(), FileError> {
        let mut history = History::new(vertex_count as usize);
        for _ in 0..triangle_count {
            let (step, begin) = self.read_step(&mut history, vertex_count)?;
            history.push_edges_of(step);
            // Branchless, because the first corner is unpredictable.
            let [a, b, c] = ROTATED[begin];
            let corners = step.corners;
            indices.extend_from_slice(&[corners[a], corners[b], corners[c]]);
            on_step(step);
        }
        Ok(())
    }

    fn read_step(
        &mut self,
        history: &mut History,
        vertex_count: u32,
    ) -> Result<(Step, usize), FileError> {
        let symbol = next(&mut self.edges)?;
        if symbol >= MISS {
            let mut corners = [0; 3];
            for corner in &mut corners {
                *corner = self.read_vertex(history, vertex_count, NOTHING)?;
            }
            let opposite = None;
            return Ok((Step { corners, opposite }, 0));
        }
        let edge = history.edge((symbol / 3) as usize);
        let [x, y, opposite] = edge.ok_or(FileError::Corrupt { what: WHAT })?;
        let beside = history.border.beside(x, y);
        let corners = [x, y, self.read_vertex(history, vertex_count, beside)?];
        let opposite = Some(opposite);
        let begin = first_corner(corners) + symbol as usize % 3;
        Ok((Step { corners, opposite }, begin))
    }

    /// Fails if the vertex is not below `vertex_count`.
    fn read_vertex(
        &mut self,
        history: &mut History,
        vertex_count: u32,
        beside: [u16; 2],
    ) -> Result<u16, FileError> {
        let symbol = next(&mut self.vertices)?;
        let vertex = if symbol < FAR {
            history.take(symbol, beside)
        } else {
            self.read_far(history, symbol)
        };
        let inside = vertex.filter(|&vertex| u32::from(vertex) < vertex_count);
        inside.ok_or(FileError::Corrupt { what: WHAT })
    }

    fn read_far(&mut self, history: &mut History, symbol: u32) -> Option<u16> {
        let distance = self.distances.next().filter(|_| symbol == FAR)?;
        let vertex = u32::from(history.last_far).wrapping_add(unzigzag(*distance));
        let vertex = u16::try_from(vertex).ok()?;
        history.last_far = vertex;
        history.push_vertex(vertex);
        Some(vertex)
    }
}

fn next(symbols: &mut std::slice::Iter<'_, u32>) -> Result<u32, FileError> {
    symbols
        .next()
        .copied()
        .ok_or(FileError::Corrupt { what: WHAT })
}
