//! Cards: a plant as rectangles with pictures of it, where few of them look as good as many triangles.
//!
//! Triangles are laid flat on [planes](planes) near by, and each plane shows what lies on it as a
//! [picture](texels) of colours, opacity and normals (X. Décoret, F. Durand, F. Sillion and J. Dorsey: Billboard Clouds
//! for Extreme Model Simplification, SIGGRAPH 2003). All pictures [lie side by side](pack) in one.
//!
//! How good they look is [measured](crate::appearance) as of levels of triangles; they are drawn from the first of these
//! on that one of them beats.

mod frame;
mod pack;
mod planes;
mod texels;

use fieldlod_hierarchy::{Card, CardPicture, Hierarchy, Sphere, Vertices};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

use crate::picture::{Model, Picture, Viewpoint, shown};
use crate::surface::{Surface, uvs_of};
use frame::Frame;
use pack::pack;
use planes::{Facet, planes_of};
use texels::Texels;

/// How many cards each level has, and at which radius of the mesh, in pixels, a texel is as large as a pixel.
const LEVELS: [(usize, f32); 7] = [
    (1024, 80.0),
    (512, 56.0),
    (256, 40.0),
    (128, 28.0),
    (64, 20.0),
    (32, 14.0),
    (16, 10.0),
];
/// A card stands for so many triangles of the source at least.
const LEAST_TRIANGLES: usize = 4;
/// Texels along each side of the picture.
const SIDE_TEXELS: u32 = 512;
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

/// Levels of cards for a mesh that looks like `surface`, white if that is not known, finest first, and their picture;
/// `None` if the mesh has too few triangles or no size, or the cards do not fit the picture.
pub(crate) fn cards_of(
    hierarchy: &Hierarchy,
    surface: Option<&Surface>,
) -> Option<(Vec<Vec<Card>>, CardPicture)> {
    let source = Source::of(hierarchy, surface)?;
    let levels = source.levels();
    // Without the finest levels, if these leave too little to the others.
    let radius = source.sphere.radius / source.unit_in_local;
    let levels = (0..levels.len()).find_map(|first| fitted(&levels[first..], radius))?;
    let drawn = |place: &Place| Drawn {
        card: place
            .frame
            .card(source.unit_in_local, place.first, place.size),
        texels: Texels::of(&source, place.frame, place.size),
        first: place.first,
    };
    let levels = levels.par_iter();
    let levels: Vec<Vec<Drawn>> = levels
        .map(|places| places.par_iter().map(drawn).collect())
        .collect();
    // As much of each level is drawn as covers what the source covers.
    let mut picture = texels::empty_picture(SIDE_TEXELS, source.tint);
    let model = source.model();
    let wanted = covered(|view| model.draw(&source.triangles, view, SIDE_PX));
    let levels = levels.iter();
    let levels = levels.map(|level| draw_as_much(level, wanted, &model, &mut picture));
    Some((levels.collect(), picture))
}

/// Rectangles around all triangles, and at which radius of the mesh, in pixels, a texel is as large as a pixel.
struct Level {
    frames: Vec<Frame>,
    radius_px: f32,
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

/// Where the pictures of all rectangles of a mesh of this radius lie, each as large as is possible.
fn fitted(levels: &[Level], radius: f32) -> Option<Vec<Vec<Place<'_>>>> {
    let shares = std::iter::successors(Some(1.0), |share| Some(share * SHRINKING));
    let mut shares = shares.take_while(|share| *share > LEAST_SHARE);
    shares.find_map(|share| {
        let size = |frame: &Frame, level: &Level| {
            let texels = (frame.max - frame.min) * (level.radius_px / radius * share);
            texels.ceil().max(Vec2::splat(2.0)).as_uvec2()
        };
        let sizes = levels
            .iter()
            .flat_map(|level| level.frames.iter().map(|frame| size(frame, level)));
        let sizes: Vec<UVec2> = sizes.collect();
        let mut rectangles = pack(&sizes, SIDE_TEXELS)?.into_iter().zip(sizes);
        let levels = levels.iter().map(|level| {
            let frames = level.frames.iter().zip(rectangles.by_ref());
            let places = frames.map(|(frame, (first, size))| Place { frame, first, size });
            places.collect()
        });
        Some(levels.collect())
    })
}

/// Puts pictures of a level's cards into the one for all, so that they cover about `wanted` pixels; returns the cards.
fn draw_as_much(
    level: &[Drawn],
    wanted: f32,
    model: &Model<'_>,
    picture: &mut CardPicture,
) -> Vec<Card> {
    let cards: Vec<Card> = level.iter().map(|drawn| drawn.card).collect();
    let mut gain = 1.0f32;
    for attempt in 1..=ATTEMPTS {
        for drawn in level {
            drawn.texels.write(picture, drawn.first, gain);
        }
        if attempt < ATTEMPTS {
            let draw = |view: &_| model.draw_cards(&cards, picture, Vec3::ONE, view, SIDE_PX);
            gain = (gain * wanted / covered(draw).max(1.0)).clamp(1.0, MOST_GAIN);
        }
    }
    cards
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
    surface: Option<&'a Surface>,
    /// The same, by vertex.
    surfaces: Vec<Option<&'a Surface>>,
    uvs: &'a [Vec2],
    /// The brightest red, green and blue of vertices.
    tint: Vec3,
}

impl<'a> Source<'a> {
    fn of(hierarchy: &'a Hierarchy, surface: Option<&'a Surface>) -> Option<Self> {
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
        let mut source = Self {
            vertices,
            sphere,
            unit_in_local,
            facets: facets.collect(),
            triangles,
            surface,
            surfaces: vec![surface; count],
            uvs: uvs_of(surface, vertices),
            tint: Vec3::ZERO,
        };
        let colors = source.triangles.as_flattened().iter();
        let colors = colors.map(|&vertex| source.color(vertex));
        source.tint = colors.fold(Vec3::splat(DARKEST), Vec3::max);
        Some(source)
    }

    /// Rectangles for each level, as large as the source is flat there.
    fn levels(&self) -> Vec<Level> {
        let most = self.facets.len() / LEAST_TRIANGLES;
        let planned = LEVELS.par_iter().filter(|level| level.0 <= most);
        let level = |&(count, radius_px): &(usize, f32)| Level {
            frames: self.frames(count),
            radius_px,
        };
        let mut levels: Vec<Level> = planned.map(level).collect();
        // Some planes have nothing that lies on them.
        levels.dedup_by(|coarser, finer| coarser.frames.len() >= finer.frames.len());
        levels.retain(|level| !level.frames.is_empty());
        levels
    }

    /// So many rectangles around triangles that lie about flat, each facing where these do.
    fn frames(&self, count: usize) -> Vec<Frame> {
        let (planes, nearest) = planes_of(&self.facets, count);
        let mut facets_of = vec![Vec::new(); planes.len()];
        for (facet, plane) in nearest.into_iter().enumerate() {
            facets_of[plane].push(facet as u32);
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

    /// To be drawn for what it covers.
    fn model(&self) -> Model<'_> {
        Model {
            positions: &self.vertices.positions,
            normals: &[],
            colors: &[],
            surfaces: &self.surfaces,
            uvs: self.uvs,
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, LazyLock};

    use fieldlod_hierarchy::{CardLevel, Cards};
    use glam::Vec4;

    use super::*;
    use crate::{
        BakeConfig, SourceMesh, Surface, SurfaceAlpha, TextureMapping, bake_mesh, fixtures,
    };

    const VIEWS: usize = 6;
    const SIDE: usize = 192;

    fn with_surface(mesh: SourceMesh, surface: Surface) -> SourceMesh {
        SourceMesh {
            surface: Some(Arc::new(surface)),
            ..mesh
        }
    }

    fn with_cards(cards: bool) -> BakeConfig {
        BakeConfig {
            cards,
            ..BakeConfig::default()
        }
    }

    fn plants() -> [SourceMesh; 2] {
        let green = Vec4::new(0.5, 1.0, 0.4, 1.0);
        let opaque = Surface::new(green, SurfaceAlpha::Opaque);
        let leaf = fixtures::cut_out(|uv| (uv - 0.5).length() < 0.4);
        [
            with_surface(fixtures::crown(600, 3), opaque),
            with_surface(fixtures::cards(600, 3), leaf),
        ]
    }

    /// With cards and without.
    static BAKED: LazyLock<[[Hierarchy; 2]; 2]> = LazyLock::new(|| {
        plants()
            .map(|mesh| [true, false].map(|cards| bake_mesh(&mesh, &with_cards(cards)).unwrap()))
    });

    /// Few leaves, which are soon baked.
    fn twig() -> SourceMesh {
        let opaque = Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
        with_surface(fixtures::cards(200, 3), opaque)
    }

    /// Pictures of the source and of each level from each side.
    fn pictures(mesh: &SourceMesh, hierarchy: &Hierarchy) -> Vec<[Picture; VIEWS]> {
        let surface = mesh.surface.as_deref();
        let model = Model {
            positions: &mesh.positions,
            normals: &mesh.normals,
            colors: &mesh.colors,
            surfaces: &vec![surface; mesh.positions.len()],
            uvs: &mesh.uvs,
            sphere: Sphere::around(mesh.positions.iter().copied()),
            exposure: 1.0,
        };
        let (triangles, _) = mesh.indices.as_chunks();
        let view = |index| Viewpoint::around(index, VIEWS);
        let source = std::array::from_fn(|index| model.draw(triangles, &view(index), SIDE));
        let cards = hierarchy.cards.as_ref().unwrap();
        let color = surface.unwrap().base_color();
        let draw = |level: &CardLevel| {
            std::array::from_fn(|index| {
                model.draw_cards(&level.cards, &cards.picture, color, &view(index), SIDE)
            })
        };
        std::iter::once(source)
            .chain(cards.levels.iter().map(draw))
            .collect()
    }

    fn covered_and_color(pictures: &[Picture; VIEWS]) -> (f32, Vec3) {
        let pixels = pictures.iter().flat_map(|picture| &picture.pixels);
        let sum = pixels
            .filter(|pixel| pixel.w > 0.0)
            .fold(Vec4::ZERO, |sum, &pixel| sum + pixel);
        (sum.w, sum.truncate() / sum.w)
    }

    #[test]
    fn cards_cover_what_the_source_does_in_its_colours() {
        for (mesh, [hierarchy, _]) in plants().iter().zip(&*BAKED) {
            let pictures = pictures(mesh, hierarchy);
            assert!(pictures.len() > 4);
            let (area, color) = covered_and_color(&pictures[0]);
            for (index, level) in pictures[1..].iter().enumerate() {
                let (own_area, own_color) = covered_and_color(level);
                let share = own_area / area;
                println!("{index}: {share}, {own_color} of {color}");
                assert!((0.95..1.05).contains(&share), "{index}: {share}");
                let off = (own_color / color - 1.0).abs().max_element();
                assert!(off < 0.2, "{index}: {own_color}, not {color}");
            }
        }
    }

    #[test]
    fn levels_of_cards_are_better_than_those_of_triangles_that_they_replace() {
        for baked in &*BAKED {
            let [with, without] = baked
                .each_ref()
                .map(|baked| baked.whole_mesh_levels().unwrap());
            assert_eq!(with.validate(), Ok(()));
            let errors = |levels: &Hierarchy| -> Vec<(u32, f32)> {
                let groups = levels.groups.iter().map(|group| group.error_in_local);
                let errors = std::iter::once(0.0).chain(groups);
                levels
                    .units
                    .iter()
                    .map(|u| u.triangle_count)
                    .zip(errors)
                    .collect()
            };
            let (with, without) = (errors(&with), errors(&without));
            assert!(
                with.is_sorted_by(|a, b| a.0 > b.0 && a.1 <= b.1),
                "{with:?}"
            );
            // At every error below that of the last cards, as few triangles or fewer: no triangles come after these.
            let fewest = |levels: &[(u32, f32)], error: f32| {
                let good = levels.iter().filter(|level| level.1 <= error);
                good.map(|level| level.0).min().unwrap()
            };
            for &(_, error) in with.iter().chain(&without) {
                if error < with[with.len() - 1].1 {
                    assert!(
                        fewest(&with, error) <= fewest(&without, error),
                        "{error}: {with:?}, {without:?}"
                    );
                }
            }
            assert!(with != without);
        }
    }

    #[test]
    fn only_plants_of_a_known_material_have_cards() {
        let bake = |mesh: &SourceMesh, config: BakeConfig| bake_mesh(mesh, &config).unwrap().cards;
        let twig = twig();
        assert!(bake(&twig, with_cards(true)).is_some());
        assert!(bake(&twig, BakeConfig::default()).is_none());
        let unknown = SourceMesh {
            surface: None,
            ..twig.clone()
        };
        assert!(bake(&unknown, with_cards(true)).is_none());
        let unmeasured = BakeConfig {
            measure_appearance: false,
            ..with_cards(true)
        };
        assert!(bake(&twig, unmeasured).is_none());
        let surface = Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
        let rock = with_surface(fixtures::rock(4, 1), surface);
        assert!(bake(&rock, with_cards(true)).is_none());
    }

    fn cards_baked(mesh: &SourceMesh) -> Cards {
        let baked = bake_mesh(mesh, &with_cards(true)).unwrap();
        assert_eq!(baked.validate(), Ok(()));
        baked.cards.unwrap()
    }

    fn counts(cards: &Cards) -> Vec<usize> {
        cards.levels.iter().map(|level| level.cards.len()).collect()
    }

    #[test]
    fn cards_do_not_depend_on_the_unit_of_length() {
        let twig = twig();
        let cards = cards_baked(&twig);
        // From 1e-12 to 1e17.
        for power in [-40, 56] {
            let scale = 2.0f32.powi(power);
            let mut scaled = twig.clone();
            scaled.positions.iter_mut().for_each(|at| *at *= scale);
            let found = cards_baked(&scaled);
            assert_eq!(counts(&found), counts(&cards));
            assert!(found.picture == cards.picture);
            for (found, level) in found.levels.iter().zip(&cards.levels) {
                let ratio = found.error_in_local / scale / level.error_in_local;
                assert!((0.999..1.001).contains(&ratio), "{power}: {ratio}");
                for (found, card) in found.cards.iter().zip(&level.cards) {
                    for (found, corner) in found.corners().iter().zip(card.corners()) {
                        assert!((*found / scale).abs_diff_eq(corner, 1e-5));
                    }
                }
            }
        }
    }

    /// Means of many texels, and what the file decodes, are the texture's own colours.
    #[test]
    fn cards_have_the_colours_of_the_texture() {
        let cards = BAKED[1][0].cards.as_ref().unwrap();
        assert_eq!(cards.picture.tint, Vec3::ONE);
        let texels = cards.picture.colors.iter();
        let drawn = texels.filter(|color| color[3] >= CardPicture::DRAWN_FROM);
        for color in drawn {
            assert_eq!(color[..3], [60, 120, 30]);
        }
    }

    /// Colours may tell other things, such as how leaves sway.
    #[test]
    fn colours_below_black_count_as_black() {
        let mut black = twig();
        black.colors = vec![Vec4::new(0.0, 1.0, 0.5, 1.0); black.positions.len()];
        let mut below = black.clone();
        below.colors.iter_mut().for_each(|color| color.x = -0.5);
        let [black, below] = [black, below].map(|mesh| cards_baked(&mesh));
        assert!(below.levels[0].error_in_local > 0.0);
        assert!(below == black);
    }

    #[test]
    fn cards_go_by_the_texture_coordinates_of_the_material() {
        let [_, first] = plants();
        let mapping = TextureMapping {
            uses_uvs_1: true,
            ..TextureMapping::default()
        };
        // A dot in the middle, where the first of these coordinates are everywhere.
        let texel = |x: u32, y: u32| {
            let at = UVec2::new(x, y).as_vec2() + 0.5;
            [
                60,
                120,
                30,
                if at.distance(Vec2::splat(32.0)) < 25.6 {
                    255
                } else {
                    0
                },
            ]
        };
        let plain = Surface::new(Vec4::ONE, SurfaceAlpha::Mask { cutoff: 0.5 });
        let second = SourceMesh {
            uvs: vec![Vec2::splat(0.5); first.positions.len()],
            uvs_1: first.uvs.clone(),
            ..with_surface(
                first.clone(),
                plain.with_texture(UVec2::splat(64), mapping, texel),
            )
        };
        let (first, second) = (BAKED[1][0].cards.as_ref().unwrap(), cards_baked(&second));
        assert_eq!(counts(first), counts(&second));
        let drawn = |cards: &Cards| {
            let texels = cards.picture.colors.iter();
            texels.filter(|c| c[3] >= CardPicture::DRAWN_FROM).count() as f32
        };
        let ratio = drawn(&second) / drawn(first);
        assert!((0.99..1.01).contains(&ratio), "{ratio}");
    }

    /// Leaves on top of each other lie on no more planes than one of them: of levels of as many cards the first is kept.
    #[test]
    fn texels_of_a_level_are_as_large_as_planned() {
        let leaves = fixtures::cards(20, 1);
        let one_of_each = leaves.indices.as_chunks::<6>().0.iter();
        let corners = one_of_each.flat_map(|&[a, b, c, ..]| [a, b, c].repeat(64));
        let triangles: Vec<Vec3> = corners.map(|v| leaves.positions[v as usize]).collect();
        let mesh = SourceMesh {
            indices: (0..triangles.len() as u32).collect(),
            positions: triangles,
            ..SourceMesh::default()
        };
        let hierarchy = bake_mesh(&mesh, &BakeConfig::fast()).unwrap();
        let sphere = Sphere::around(mesh.positions.iter().copied());
        let (levels, _) = cards_of(&hierarchy, None).unwrap();
        let counts: Vec<usize> = levels.iter().map(Vec::len).collect();
        assert_eq!(counts, [20, 16]);
        for level in &levels[1..] {
            let planned = LEVELS.iter().rev().find(|plan| plan.0 >= level.len());
            let (_, radius_px) = *planned.unwrap();
            for card in level {
                let texels = card.across.length() / sphere.radius * radius_px;
                let most = texels.ceil().max(2.0) * 1.001;
                assert!(f32::from(card.size_texels[0]) <= most, "{counts:?}");
            }
        }
    }
}
