//! Cards: a plant as rectangles with pictures of it, where few of them look as good as many triangles.
//!
//! Triangles are laid flat on [planes](planes) near by, and each plane shows what lies on it as a
//! [picture](texels) of colours, opacity and normals (X. Décoret, F. Durand, F. Sillion and J. Dorsey: Billboard Clouds
//! for Extreme Model Simplification, SIGGRAPH 2003). All pictures [lie side by side](pack) in one.
//!
//! How good they look is [measured](crate::plants::appearance) as of levels of triangles; they are drawn from the first of these
//! on that one of them beats.

mod frame;
mod pack;
mod planes;
#[cfg(test)]
mod tests;
mod texels;

use fieldlod_hierarchy::{Card, CardPicture, Hierarchy, Sphere, Vertices};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::mesh::surfaces::{Looks, Surfaces};
use crate::plants::picture::{Model, Picture, ShownCards, Viewpoint, shown};
use frame::Frame;
use pack::pack;
use planes::{Facet, planes_of};
use texels::Texels;

/// How many cards each level has of all parts, and at which radius of the mesh, in pixels, a texel is as large as a pixel.
const LEVELS: [(usize, f32); 8] = [
    (1024, 80.0),
    (512, 56.0),
    (256, 40.0),
    (128, 28.0),
    (64, 20.0),
    (32, 14.0),
    (22, 12.0),
    (16, 10.0),
];
/// The cards of all parts stand for so many triangles of the source each at least.
const LEAST_TRIANGLES: usize = 4;
/// Texels along each side of a picture: the least of these that there is room in.
const SIDES_TEXELS: [u32; 4] = [64, 128, 256, 512];
/// From how many sides a level is looked at for what it covers, in pictures of so many pixels, how often, and how much
/// more is drawn of it at most: what is laid flat covers less from aside.
const DIRECTIONS: usize = 6;
const SIDE_PX: usize = 128;
const ATTEMPTS: usize = 4;
const MOST_GAIN: f32 = 2.0;
/// The least part of a colour that the brightest vertex counts as.
const DARKEST: f32 = 1e-3;
/// By how much pictures shrink until all fit.
const SHRINKING: f32 = 0.95;
/// The least share of the texels that are wished for along a length.
const LEAST_SHARE: f32 = 0.55;

/// The cards of one of the parts of a mesh.
pub(crate) struct PartCards {
    /// Finest first: which of the levels of all parts it is, and its cards from that one on.
    pub(crate) levels: Vec<(usize, Vec<Card>)>,
    pub(crate) picture: CardPicture,
}

impl PartCards {
    /// Takes away levels that are no better than one with fewer cards, by the errors of all levels, and what they
    /// show.
    pub(crate) fn drop_useless(&mut self, error_in_local: impl Fn(usize) -> f32) {
        let own: Vec<f32> = self.levels.iter().map(|l| error_in_local(l.0)).collect();
        let mut coarser = own.iter().skip(1);
        self.levels.retain(|(number, cards)| {
            let is_better = coarser.next().is_none_or(|&e| error_in_local(*number) < e);
            if !is_better {
                cards
                    .iter()
                    .for_each(|card| texels::clear(&mut self.picture, card));
            }
            is_better
        });
    }

    /// The cards in a level of all parts.
    pub(crate) fn at(&self, level: usize) -> &[Card] {
        let after = self.levels.partition_point(|(own, _)| *own <= level);
        after
            .checked_sub(1)
            .map_or(&[], |index| &self.levels[index].1)
    }
}

/// What is drawn of all parts in one of their levels, with their base colours.
pub(crate) fn shown_at(
    parts: &[PartCards],
    level: usize,
    base_color: impl Fn(usize) -> Vec3,
) -> Vec<ShownCards<'_>> {
    let parts = parts.iter().enumerate();
    let shown = parts.map(|(index, part)| ShownCards {
        cards: part.at(level),
        picture: &part.picture,
        base_color: base_color(index),
    });
    shown.collect()
}

/// Levels of cards for each part of a mesh, white if its surface is not known, and their pictures; none if the mesh has too
/// few triangles or no size, or the cards do not fit the pictures.
pub(crate) fn cards_of(hierarchy: &Hierarchy, surfaces: &Surfaces) -> Vec<PartCards> {
    Source::of(hierarchy, surfaces).map_or(Vec::new(), |source| source.cards())
}

/// Rectangles around all triangles of a part, and at which radius of the mesh, in pixels, a texel is as large as a pixel.
struct Level {
    /// Which of the levels of all parts it is.
    number: usize,
    frames: Vec<Frame>,
    radius_px: f32,
}

/// The levels of a part, and where the picture of each rectangle lies in one for all.
struct Fitted<'a> {
    levels: Vec<(usize, Vec<Place<'a>>)>,
    side_texels: u32,
}

/// Where the picture of a rectangle lies.
struct Place<'a> {
    frame: &'a Frame,
    first: UVec2,
    size: UVec2,
}

/// A card with what is on it.
struct Drawn {
    card: Card,
    texels: Texels,
    first: UVec2,
}

impl<'a> Fitted<'a> {
    /// Levels of a part of a mesh of this radius in the smallest picture that has room, or else each as large as is
    /// possible.
    fn of(levels: &[&'a Level], radius: f32) -> Option<Self> {
        let with_all = SIDES_TEXELS.map(|side| (side, 1.0));
        let shares = std::iter::successors(Some(SHRINKING), |share| Some(share * SHRINKING));
        let shares = shares.take_while(|share| *share > LEAST_SHARE);
        let largest = SIDES_TEXELS[SIDES_TEXELS.len() - 1];
        let mut tried = with_all
            .into_iter()
            .chain(shares.map(|share| (largest, share)));
        tried.find_map(|(side, share)| Self::with(levels, radius, side, share))
    }

    /// In a picture of so many texels a side, with a share of the texels that are wished for along a length.
    fn with(levels: &[&'a Level], radius: f32, side_texels: u32, share: f32) -> Option<Self> {
        let size = |frame: &Frame, level: &Level| {
            let texels = (frame.max - frame.min) * (level.radius_px / radius * share);
            texels.ceil().max(Vec2::splat(2.0)).as_uvec2()
        };
        let sizes = levels
            .iter()
            .flat_map(|level| level.frames.iter().map(|frame| size(frame, level)));
        let sizes: Vec<UVec2> = sizes.collect();
        let mut rectangles = pack(&sizes, side_texels)?.into_iter().zip(sizes);
        let levels = levels.iter().map(|level| {
            let frames = level.frames.iter().zip(rectangles.by_ref());
            let places = frames.map(|(frame, (first, size))| Place { frame, first, size });
            (level.number, places.collect())
        });
        Some(Self {
            levels: levels.collect(),
            side_texels,
        })
    }
}

/// Adds a level to the parts that have cards of their own in it, with pictures of these in which all parts cover about
/// `wanted` pixels together.
fn draw_as_much(
    number: usize,
    drawn: &[Vec<Drawn>],
    wanted: f32,
    model: &Model<'_>,
    parts: &mut [PartCards],
) {
    for (part, drawn) in parts.iter_mut().zip(drawn) {
        if !drawn.is_empty() {
            let cards = drawn.iter().map(|drawn| drawn.card);
            part.levels.push((number, cards.collect()));
        }
    }
    let mut gain = 1.0f32;
    for attempt in 1..=ATTEMPTS {
        for (part, drawn) in parts.iter_mut().zip(drawn) {
            for drawn in drawn {
                drawn.texels.write(&mut part.picture, drawn.first, gain);
            }
        }
        if attempt < ATTEMPTS {
            let shown = shown_at(parts, number, |_| Vec3::ONE);
            let draw = |view: &_| model.draw_cards(&shown, view, SIDE_PX);
            gain = (gain * wanted / covered(draw).max(1.0)).clamp(1.0, MOST_GAIN);
        }
    }
}

/// Pixels covered in pictures from several sides.
fn covered(draw: impl Fn(&Viewpoint) -> Picture + Sync) -> f32 {
    let views = (0..DIRECTIONS).into_par_iter();
    let covered = views.map(|index| {
        let picture = draw(&Viewpoint::around(index, DIRECTIONS));
        picture.pixels.iter().map(|pixel| pixel.w).sum::<f32>()
    });
    covered.collect::<Vec<f32>>().iter().sum()
}

/// What is laid flat.
struct Source<'a> {
    vertices: &'a Vertices,
    /// What is drawn.
    sphere: Sphere,
    triangles: Vec<[u32; 3]>,
    /// The unit of lengths in which triangles are laid flat: a power of two, by which nothing is rounded, and 1 to 2 of it
    /// are the radius, so that at any scale squares of squares are numbers.
    unit_in_local: f32,
    /// The triangles in that unit.
    facets: Vec<Facet>,
    /// Those of each part, by their indices.
    parts: Vec<Vec<u32>>,
    looks: Looks<'a>,
    surfaces: &'a Surfaces,
    /// Whether backs of each part are lit as its fronts turned over.
    turns_over: Vec<bool>,
    /// The brightest red, green and blue of vertices.
    tint: Vec3,
}

impl<'a> Source<'a> {
    fn of(hierarchy: &'a Hierarchy, surfaces: &'a Surfaces) -> Option<Self> {
        let vertices = &hierarchy.vertices;
        let units = hierarchy.source_units();
        let triangles: Vec<[u32; 3]> = units
            .flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]))
            .collect();
        let count = hierarchy.source_vertex_count as usize;
        let sphere = Sphere::around(vertices.positions.iter().copied().take(count));
        if !sphere.radius.is_normal() {
            return None;
        }
        let unit_in_local = f32::from_bits(sphere.radius.to_bits() & f32::INFINITY.to_bits());
        let place = |vertex: u32| vertices.positions[vertex as usize] / unit_in_local;
        let facets = triangles.iter().map(|t| Facet::of(t.map(place)));
        let mut parts = vec![Vec::new(); surfaces.part_count()];
        for (facet, [vertex, ..]) in triangles.iter().enumerate() {
            parts[surfaces.part_of(*vertex)].push(facet as u32);
        }
        let mut source = Self {
            vertices,
            sphere,
            unit_in_local,
            facets: facets.collect(),
            triangles,
            parts,
            looks: surfaces.looks_of(hierarchy),
            surfaces,
            turns_over: Vec::new(),
            tint: Vec3::ZERO,
        };
        let parts = source.parts.iter().enumerate();
        source.turns_over = parts
            .map(|(part, facets)| surfaces.is_double_sided(part) || source.has_own_normals(facets))
            .collect();
        let colors = source.triangles.as_flattened().iter();
        let colors = colors.map(|&vertex| source.color(vertex));
        source.tint = colors.fold(Vec3::splat(DARKEST), Vec3::max);
        Some(source)
    }

    /// Whether triangles have normals of their own, not those of a crown or of the ground: along those of the triangles, in
    /// the mean by area, by half or more.
    fn has_own_normals(&self, facets: &[u32]) -> bool {
        let (mut along, mut area) = (0.0, 0.0);
        for &facet in facets {
            let own = &self.facets[facet as usize];
            let [a, b, c] =
                self.triangles[facet as usize].map(|v| self.normal(v).unwrap_or(own.normal));
            along += own.area * own.normal.dot((a + b + c).normalize_or_zero());
            area += own.area;
        }
        along >= 0.5 * area
    }

    fn cards(&self) -> Vec<PartCards> {
        let levels: Vec<Vec<Level>> = self.parts.iter().map(|part| self.levels(part)).collect();
        // Without the finest levels, if these leave too little to the others.
        let fitted = (0..LEVELS.len()).find_map(|first| {
            let parts = levels.iter().map(|part| self.fitted(part, first));
            parts.collect::<Option<Vec<Fitted<'_>>>>()
        });
        let fitted = fitted.unwrap_or_default();
        let parts = fitted.iter().zip(&self.turns_over);
        let mut parts: Vec<PartCards> = parts
            .map(|(part, &turns_over)| PartCards {
                levels: Vec::new(),
                picture: texels::empty_picture(part.side_texels, turns_over, self.tint),
            })
            .collect();
        // As much of each level is drawn as covers what the source covers.
        let model = self.model();
        let wanted = covered(|view| model.draw(&self.triangles, view, SIDE_PX));
        for number in 0..LEVELS.len() {
            let drawn = fitted.iter().map(|part| self.drawn(part, number));
            let drawn: Vec<Vec<Drawn>> = drawn.collect();
            if drawn.iter().any(|part| !part.is_empty()) {
                draw_as_much(number, &drawn, wanted, &model, &mut parts);
            }
        }
        parts
    }

    /// Rectangles for each level of a part, as large as it is flat there.
    fn levels(&self, part: &[u32]) -> Vec<Level> {
        let most = self.facets.len() / LEAST_TRIANGLES;
        let area = |facets: &[Facet]| facets.iter().map(|facet| facet.area).sum::<f32>();
        let facets: Vec<Facet> = part.iter().map(|&f| self.facets[f as usize]).collect();
        let share = area(&facets) / area(&self.facets);
        let planned = LEVELS.par_iter().enumerate();
        let planned = planned.filter(|(_, level)| level.0 <= most);
        let level = |(number, &(count, radius_px)): (usize, &(usize, f32))| {
            let own = (count as f32 * share).round().max(1.0) as usize;
            Level {
                number,
                frames: self.frames(part, &facets, own),
                radius_px,
            }
        };
        planned.map(level).collect()
    }

    /// Where the pictures of a part's cards lie, from a level of all on.
    fn fitted<'b>(&self, levels: &'b [Level], first: usize) -> Option<Fitted<'b>> {
        let mut levels: Vec<&Level> = levels.iter().filter(|l| l.number >= first).collect();
        // Some planes have nothing that lies on them.
        levels.dedup_by(|coarser, finer| coarser.frames.len() >= finer.frames.len());
        levels.retain(|level| !level.frames.is_empty());
        Fitted::of(&levels, self.sphere.radius / self.unit_in_local)
    }

    /// So many rectangles around triangles of a part that lie about flat, each facing where these do.
    fn frames(&self, part: &[u32], facets: &[Facet], count: usize) -> Vec<Frame> {
        let (planes, nearest) = planes_of(facets, count);
        let mut facets_of = vec![Vec::new(); planes.len()];
        for (facet, plane) in part.iter().zip(nearest) {
            facets_of[plane].push(*facet);
        }
        let planes = planes.into_iter().zip(facets_of);
        let frames = planes.filter_map(|(mut plane, facets)| {
            let vertices = facets.iter().flat_map(|&f| self.triangles[f as usize]);
            let normals = vertices.filter_map(|vertex| self.normal(vertex));
            let facing: f32 = normals.map(|normal| normal.dot(plane.normal)).sum();
            if facing < 0.0 {
                plane.normal = -plane.normal;
            }
            Frame::around(&plane, facets, &self.facets)
        });
        frames.collect()
    }

    /// The cards of a part's level with what is on them; none if it has no such level.
    fn drawn(&self, part: &Fitted<'_>, number: usize) -> Vec<Drawn> {
        let places = part.levels.iter().filter(|(own, _)| *own == number);
        let places: Vec<&Place<'_>> = places.flat_map(|(_, places)| places).collect();
        let drawn = |place: &&Place<'_>| Drawn {
            card: place
                .frame
                .card(self.unit_in_local, place.first, place.size),
            texels: Texels::of(self, place.frame, place.size),
            first: place.first,
        };
        places.par_iter().map(drawn).collect()
    }

    /// To be drawn for what it covers.
    fn model(&self) -> Model<'_> {
        Model {
            positions: &self.vertices.positions,
            normals: &[],
            colors: &[],
            surfaces: &self.looks.surfaces,
            uvs: &self.looks.uvs,
            sphere: self.sphere,
            exposure: 1.0,
        }
    }

    fn normal(&self, vertex: u32) -> Option<Vec3> {
        self.vertices.normals.get(vertex as usize).copied()
    }

    fn color(&self, vertex: u32) -> Vec3 {
        shown(self.vertices.colors.get(vertex as usize))
    }
}
