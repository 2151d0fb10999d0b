//! Cards of baked plants, as pictures of them show.

use std::sync::{Arc, LazyLock};

use fieldlod_hierarchy::{CardLevel, Cards};
use glam::{U16Vec2, UVec3, Vec4};

use super::*;
use crate::{
    BakeConfig, SourceMesh, Surface, SurfaceAlpha, TextureMapping, bake_mesh, bake_together,
    fixtures,
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
    plants().map(|mesh| [true, false].map(|cards| bake_mesh(&mesh, &with_cards(cards)).unwrap()))
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
    let base_color = surface.unwrap().base_color();
    let draw = |level: &CardLevel| {
        std::array::from_fn(|index| {
            let shown = ShownCards {
                cards: &level.cards,
                picture: &cards.picture,
                base_color,
            };
            model.draw_cards(&[shown], &view(index), SIDE)
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

/// Ten bricks have hardly more triangles than the cards that stand for them.
#[test]
fn cards_that_save_little_are_not_kept() {
    let mut bricks = SourceMesh::default();
    let faces: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    for brick in 0..10u32 {
        let at = UVec3::new(3 * brick, 2 * (brick * brick % 5), 2 * (brick * 3 % 7));
        let corners = (0..8).map(|corner| UVec3::new(corner, corner >> 1, corner >> 2) & 1);
        for corner in corners {
            bricks.positions.push((at + corner).as_vec3());
            bricks.normals.push((corner.as_vec3() - 0.5).normalize());
        }
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
        bricks
            .indices
            .extend(triangles.map(|corner| 8 * brick + corner));
    }
    let surface = Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
    let baked = bake_mesh(&with_surface(bricks, surface), &with_cards(true)).unwrap();
    assert!(baked.cards.is_none());
}

/// Grass is often lit as the ground that it stands on is, and leaves as their crown.
#[test]
fn leaves_with_normals_of_something_else_have_cards() {
    let mut lit_from_above = twig();
    lit_from_above.normals.fill(Vec3::Y);
    let [of_leaves, of_ground] = [twig(), lit_from_above].map(|mesh| cards_baked(&mesh));
    let mut compared = 0;
    for ground in &of_ground.levels {
        let same = |leaves: &&CardLevel| leaves.cards.len() == ground.cards.len();
        if let Some(leaves) = of_leaves.levels.iter().find(same) {
            let errors = [ground, leaves].map(|level| level.error_in_local);
            assert!(errors[0] < 1.1 * errors[1], "{errors:?}");
            compared += 1;
        }
    }
    assert!(compared >= 3);
    // All point up in the pictures, too.
    let picture = &of_ground.picture;
    for card in of_ground.levels.iter().flat_map(|level| &level.cards) {
        let [tangent, bitangent, normal] = card.axes();
        let [first, size] =
            [card.first_texel, card.size_texels].map(|two| U16Vec2::from(two).as_uvec2());
        for at in texels_of(first, size, picture.side_texels) {
            let Vec3 { x, y, z } = CardPicture::normal_of(picture.normals[at]);
            let is_drawn = picture.colors[at][3] >= CardPicture::DRAWN_FROM;
            assert!(!is_drawn || (tangent * x + bitangent * y + normal * z).y > 0.98);
        }
    }
}

/// Leaves whose backs are lit as their fronts turned over have pictures of what is seen, and others of the source's normals.
#[test]
fn backs_are_lit_as_those_of_the_source() {
    let opaque = || Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
    // Whether they turn over, and which share of what is drawn has normals that turn away.
    let backs = |own_normals: bool, surface: Surface| {
        let mut twig = with_surface(twig(), surface);
        for triangle in twig.indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|corner| twig.positions[corner as usize]);
            let own = (b - a).cross(c - a).normalize();
            // One way and the other, whichever way they face.
            let normal = match (own_normals, triangle[0] / 4 % 2) {
                (true, _) => own,
                (false, 0) => Vec3::X,
                (false, _) => Vec3::NEG_X,
            };
            for corner in triangle {
                twig.normals[*corner as usize] = normal;
            }
        }
        let picture = cards_baked(&twig).picture;
        let drawn = picture.colors.iter().zip(&picture.normals);
        let drawn = drawn.filter(|(color, _)| color[3] >= CardPicture::DRAWN_FROM);
        let all = drawn.clone().count() as f32;
        let away = drawn.filter(|(_, normal)| normal[2] < 120).count() as f32;
        (picture.turns_over, away / all)
    };
    assert_eq!(backs(true, opaque()), (true, 0.0));
    assert_eq!(backs(true, opaque().double_sided(true)), (true, 0.0));
    for is_double_sided in [false, true] {
        let (turns_over, away) = backs(false, opaque().double_sided(is_double_sided));
        assert_eq!(turns_over, is_double_sided);
        assert!(away > 0.2, "{is_double_sided}: {away}");
    }
}

/// A plant of twelve fronds, which are no loose leaves.
#[test]
fn cards_of_a_palm_save_most_of_its_triangles() {
    let surface = Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
    let palm = with_surface(fixtures::palm(12, 1), surface);
    let [with, without] = [true, false].map(|cards| {
        let baked = bake_mesh(&palm, &with_cards(cards)).unwrap();
        baked.whole_mesh_levels().unwrap()
    });
    let fewest = |levels: &Hierarchy, error: f32| {
        let groups = levels.groups.iter().map(|group| group.error_in_local);
        let levels = std::iter::once(0.0).chain(groups).zip(&levels.units);
        let good = levels.filter(|level| level.0 <= error);
        good.map(|level| level.1.triangle_count).min().unwrap()
    };
    let mut saving = 0;
    for group in &with.groups[..with.groups.len() - 1] {
        let [cards, triangles] = [&with, &without].map(|l| fewest(l, group.error_in_local));
        println!("{}: {cards} of {triangles}", group.error_in_local);
        saving += usize::from(2 * cards < triangles);
    }
    assert!(saving >= 4);
}

/// The indices of texels in a rectangle of a picture.
fn texels_of(first: UVec2, size: UVec2, side: u32) -> impl Iterator<Item = usize> {
    let rows = (first.y..first.y + size.y).map(move |row| row * side + first.x);
    rows.flat_map(move |start| start as usize..(start + size.x) as usize)
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

/// Of bark and leaves each has its own, in its own colours.
#[test]
fn cards_of_parts_cover_together_what_their_sources_do() {
    let colors = [Vec4::new(0.8, 0.9, 1.0, 1.0), Vec4::new(0.5, 1.0, 0.4, 1.0)];
    let mut parts = fixtures::tree_in_parts(600, 1);
    for (mesh, color) in parts.iter_mut().zip(colors) {
        let surface = Surface::new(color, SurfaceAlpha::Opaque);
        mesh.surface = Some(Arc::new(surface));
    }
    let baked = bake_together(&parts.each_ref(), &with_cards(true));
    let baked: Vec<Hierarchy> = baked.into_iter().map(|baked| baked.unwrap().0).collect();
    let joined = fixtures::joined(&parts);
    let looks = parts.iter();
    let looks = looks.flat_map(|m| vec![m.surface.as_deref(); m.positions.len()]);
    let model = Model {
        positions: &joined.positions,
        normals: &joined.normals,
        colors: &joined.colors,
        surfaces: &looks.collect::<Vec<_>>(),
        uvs: &[],
        sphere: Sphere::around(joined.positions.iter().copied()),
        exposure: 1.0,
    };
    let (triangles, _) = joined.indices.as_chunks();
    let view = |index| Viewpoint::around(index, VIEWS);
    let source = std::array::from_fn(|index| model.draw(triangles, &view(index), SIDE));
    let (area, color) = covered_and_color(&source);
    let cards: Vec<&Cards> = baked.iter().filter_map(|b| b.cards.as_ref()).collect();
    let [bark, leaves] = cards[..] else {
        panic!("{}", cards.len())
    };
    for level in &bark.levels {
        // Both change where one of them does.
        let mut same = leaves.levels.iter();
        let other = same.find(|other| other.error_in_local == level.error_in_local);
        let shown = [(bark, level), (leaves, other.unwrap())];
        let shown = [0, 1].map(|part| ShownCards {
            cards: &shown[part].1.cards,
            picture: &shown[part].0.picture,
            base_color: colors[part].truncate(),
        });
        let drawn = std::array::from_fn(|index| model.draw_cards(&shown, &view(index), SIDE));
        let (own_area, own_color) = covered_and_color(&drawn);
        let share = own_area / area;
        let off = (own_color / color - 1.0).abs().max_element();
        println!("{}: {share}, {own_color} of {color}", level.cards.len());
        assert!((0.95..1.05).contains(&share), "{share}");
        assert!(off < 0.2, "{own_color}, not {color}");
    }
    assert!(bark.levels.len() > 3);
    // No level is as bad as one with fewer cards, and nothing is left of those that were.
    for cards in [bark, leaves] {
        let levels = &cards.levels;
        assert!(levels.is_sorted_by(|a, b| a.error_in_local < b.error_in_local));
        let texels = levels.iter().flat_map(|level| &level.cards);
        let area = |card: &Card| u32::from(card.size_texels[0]) * u32::from(card.size_texels[1]);
        let most: u32 = texels.map(area).sum();
        let used = cards.picture.colors.iter().filter(|c| c[3] > 0).count();
        assert!(used as u32 <= most, "{used} of {most}");
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
    let parts = cards_of(&hierarchy, &Surfaces::of([&mesh]));
    let levels = parts[0].levels.iter().map(|(_, cards)| cards);
    let counts: Vec<usize> = levels.clone().map(Vec::len).collect();
    assert_eq!(counts, [20, 18, 16]);
    for level in levels.skip(1) {
        let planned = LEVELS.iter().rev().find(|plan| plan.0 >= level.len());
        let (_, radius_px) = *planned.unwrap();
        for card in level {
            let texels = card.across.length() / sphere.radius * radius_px;
            let most = texels.ceil().max(2.0) * 1.001;
            assert!(f32::from(card.size_texels[0]) <= most, "{counts:?}");
        }
    }
}
