//! Levels of plants and other aggregates.

use std::sync::Arc;

use crate::common::{open_edges, weld};
use fieldlod_bake::{
    BakeConfig, SourceMesh, Surface, SurfaceAlpha, VerifySettings, bake_mesh, fixtures, verify,
};
use fieldlod_hierarchy::{Hierarchy, fixtures::Random};
use glam::{Vec2, Vec3, Vec4};

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(mesh, &BakeConfig::default()).unwrap()
}

/// Triangles of each level of the whole mesh, finest first.
fn levels(hierarchy: &Hierarchy) -> Vec<Vec<[u32; 3]>> {
    let level = |level: u32| {
        let units = hierarchy.units_at_level(level).into_iter();
        let triangles = units.flat_map(|unit| hierarchy.triangles_of(&hierarchy.units[unit]));
        triangles.collect()
    };
    (0..hierarchy.level_count()).map(level).collect()
}

/// Side length of a picture in pixels.
const SIDE: usize = 96;

/// View directions that the bake does not use, enough of them for levels of few triangles.
fn axes() -> [Vec3; 24] {
    let mut random = Random::new(77);
    std::array::from_fn(|_| random.vector().normalize())
}

/// Number of rays through a sphere of radius 1.2 that hit an opaque texel.
pub(crate) fn covered(
    hierarchy: &Hierarchy,
    triangles: &[[u32; 3]],
    is_opaque: impl Fn(Vec2) -> bool,
) -> f32 {
    let mut hit = 0;
    for axis in axes() {
        let right = axis.any_orthonormal_vector();
        let up = axis.cross(right);
        let mut picture = [[false; SIDE]; SIDE];
        for triangle in triangles {
            let corners = triangle.map(|vertex| {
                let p = hierarchy.vertices.positions[vertex as usize];
                [right, up].map(|along| (p.dot(along) / 1.2 + 1.0) * 0.5 * SIDE as f32)
            });
            let uvs = triangle.map(|v| hierarchy.vertices.uvs.get(v as usize).copied());
            draw(corners, &mut picture, |shares| {
                let parts = uvs.iter().zip(shares);
                is_opaque(
                    parts
                        .map(|(uv, share)| uv.unwrap_or_default() * share)
                        .sum(),
                )
            });
        }
        hit += picture.as_flattened().iter().filter(|hit| **hit).count();
    }
    hit as f32
}

/// Marks opaque pixels of a triangle. `is_opaque` gets the weights of the corners.
fn draw<const N: usize>(
    [a, b, c]: [[f32; 2]; 3],
    picture: &mut [[bool; N]; N],
    is_opaque: impl Fn([f32; 3]) -> bool,
) {
    let range = |axis: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]).max(0.0) as usize;
        let high = a[axis].max(b[axis]).max(c[axis]).max(0.0) as usize;
        low..(high + 1).min(N)
    };
    let side = |p: [f32; 2], q: [f32; 2], x: f32, y: f32| {
        (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
    };
    for row in range(1) {
        for column in range(0) {
            let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
            let sides = [side(b, c, x, y), side(c, a, x, y), side(a, b, x, y)];
            let area = sides.iter().sum::<f32>();
            let is_inside =
                sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0);
            picture[row][column] |= is_inside && is_opaque(sides.map(|side| side / area));
        }
    }
}

#[test]
fn levels_of_plants_keep_their_covered_area() {
    for (name, mesh) in [
        ("crown", fixtures::crown(3_000, 3)),
        // Without texture coordinates, leaves count as opaque.
        ("leaves", untextured(fixtures::cards(3_000, 3))),
    ] {
        let hierarchy = bake(&mesh);
        let levels = levels(&hierarchy);
        let source = covered(&hierarchy, &levels[0], |_| true);
        for triangles in levels.iter().filter(|triangles| triangles.len() > 100) {
            let share = covered(&hierarchy, triangles, |_| true) / source;
            assert!((0.95..1.05).contains(&share), "{name}: {share}");
        }
    }
}

/// Leaves that a texture cuts out of cards become triangles of an opaque texel, with the area of the leaf.
#[test]
fn far_leaves_are_opaque_triangles() {
    let is_leaf = |uv: Vec2| ((uv - 0.5) * Vec2::new(2.2, 4.0)).length_squared() < 1.0;
    let mut mesh = fixtures::cards(2_000, 3);
    mesh.surface = Some(Arc::new(fixtures::cut_out(is_leaf)));
    let hierarchy = bake(&mesh);
    verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap();
    let levels = levels(&hierarchy);
    let uv = |vertex: u32| hierarchy.vertices.uvs[vertex as usize];
    let source = covered(&hierarchy, &levels[0], is_leaf);
    for triangles in levels.iter().filter(|triangles| triangles.len() > 100) {
        let share = covered(&hierarchy, triangles, is_leaf) / source;
        assert!((0.95..1.05).contains(&share), "{share}");
    }
    let far = levels.iter().find(|triangles| triangles.len() < 1_000);
    for &[a, b, c] in far.unwrap() {
        assert!(
            uv(a) == uv(b) && uv(b) == uv(c) && is_leaf(uv(a)),
            "{:?}",
            uv(a)
        );
    }
}

/// The alpha of their vertices cuts out three quarters of the leaves.
#[test]
fn leaves_that_vertex_alpha_hides_do_not_count() {
    let mut mesh = fixtures::cards(2_000, 3);
    let alpha = |vertex: usize| f32::from(u8::from((vertex / 4).is_multiple_of(4)));
    let colors = (0..mesh.positions.len()).map(|vertex| Vec4::ONE.with_w(alpha(vertex)));
    mesh.colors = colors.collect();
    let surface = Surface::new(Vec4::ONE, SurfaceAlpha::Mask { cutoff: 0.5 });
    mesh.surface = Some(Arc::new(surface));
    let hierarchy = bake(&mesh);
    verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap();
    let colors = &hierarchy.vertices.colors;
    let visible = |mut triangles: Vec<[u32; 3]>| {
        triangles.retain(|triangle| triangle.iter().all(|v| colors[*v as usize].w >= 0.5));
        covered(&hierarchy, &triangles, |_| true)
    };
    let levels = levels(&hierarchy).into_iter();
    let areas: Vec<f32> = levels.filter(|own| own.len() > 100).map(visible).collect();
    assert!(areas.len() > 3, "{areas:?}");
    for area in &areas {
        assert!((0.85..1.15).contains(&(area / areas[0])), "{areas:?}");
    }
}

/// Renderers blend triangles in their order: the inner shell first.
#[test]
fn blended_levels_keep_the_order_of_triangles() {
    let mut mesh = fixtures::shells(4, 3);
    let surface = Surface::new(Vec4::new(1.0, 1.0, 1.0, 0.2), SurfaceAlpha::Blend);
    mesh.surface = Some(Arc::new(surface));
    let hierarchy = bake(&mesh);
    verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap();
    let levels = levels(&hierarchy);
    assert!(levels.len() > 3, "{}", levels.len());
    let sorted = |mut triangle: [u32; 3]| {
        triangle.sort_unstable();
        triangle
    };
    let source = mesh.indices.as_chunks().0.iter().copied();
    assert!(source.map(sorted).eq(levels[0].iter().copied().map(sorted)));
    // Coarser shells are too far from round to be told apart by their radius.
    for triangles in levels.iter().filter(|triangles| triangles.len() > 200) {
        let shell = |triangle: &[u32; 3]| {
            let radius = hierarchy.vertices.positions[triangle[0] as usize].length();
            (radius * 4.0).round() as u32
        };
        assert!(triangles.is_sorted_by_key(shell));
    }
}

fn untextured(mut mesh: SourceMesh) -> SourceMesh {
    mesh.uvs.clear();
    mesh
}

/// Textures with opaque shares of 0.52, 1 and 0.2.
const TEXTURES: [(&str, fn(Vec2) -> bool); 3] = [
    ("leaf", |uv| {
        ((uv - 0.5) * Vec2::new(3.0, 2.0)).length_squared() < 1.0
    }),
    ("opaque", |_| true),
    ("needles", |uv| (uv.x * 5.0).fract() < 0.2),
];

#[test]
fn levels_keep_the_opaque_area_of_textured_leaves() {
    for (name, is_opaque) in TEXTURES {
        for count in [300, 1_000] {
            let mesh = SourceMesh {
                surface: Some(Arc::new(fixtures::cut_out(is_opaque))),
                ..fixtures::cards(count, 3)
            };
            let hierarchy = bake(&mesh);
            let levels = levels(&hierarchy);
            let source = covered(&hierarchy, &levels[0], is_opaque);
            // Fewer triangles cannot cover a sparse crown within the bounding box of the source.
            for triangles in levels.iter().filter(|triangles| triangles.len() > 100) {
                let share = covered(&hierarchy, triangles, is_opaque) / source;
                let is_kept = (0.95..1.03).contains(&share);
                assert!(is_kept, "{count} of {name}: {share}");
            }
        }
    }
}

#[test]
fn surfaces_without_effect_change_nothing() {
    let cards = fixtures::cards(300, 3);
    let with = |mesh: &SourceMesh, surface: Surface| SourceMesh {
        surface: Some(Arc::new(surface)),
        ..mesh.clone()
    };
    let bare = untextured(cards.clone());
    let invisible = fixtures::cut_out(|_| false);
    let leaf = fixtures::cut_out(TEXTURES[0].1);
    let blank = Surface::new(Vec4::ONE, SurfaceAlpha::Opaque);
    let brown = Surface::new(Vec4::new(0.2, 0.1, 0.1, 1.0), SurfaceAlpha::Opaque);
    assert!(bake(&with(&cards, invisible)) == bake(&cards));
    assert!(bake(&with(&cards, blank)) == bake(&cards));
    assert!(bake(&with(&cards, brown.clone())) != bake(&cards));
    // Without texture coordinates everything is opaque, so the levels are the same.
    let mut naked = bare.clone();
    naked.normals.clear();
    for mesh in [&bare, &naked] {
        let (known, unknown) = (bake(&with(mesh, brown.clone())), bake(mesh));
        assert!(known.units == unknown.units && known.vertices == unknown.vertices);
    }
    assert!(bake(&with(&bare, leaf.clone())) == bake(&bare));
    assert!(bake(&with(&cards, leaf)) != bake(&cards));
}

/// Cards inside and outside of an opaque sphere.
#[test]
fn hidden_leaves_are_pruned_before_visible_ones() {
    let mut mesh = untextured(fixtures::cards(3_000, 3));
    let first = mesh.positions.len() as u32;
    let ball = fixtures::rock(3, 1);
    mesh.positions
        .extend(ball.positions.iter().map(|p| *p * 0.8));
    mesh.normals.extend(&ball.normals);
    mesh.indices
        .extend(ball.indices.iter().map(|index| first + index));
    let hierarchy = bake(&mesh);
    let vertices = &hierarchy.vertices;
    // Numbers of cards deep inside the sphere and outside of it.
    let count = |triangles: &[[u32; 3]]| {
        let mut found = [0.0f32; 2];
        for card in components(triangles, vertices.positions.len()) {
            let sum: Vec3 = card.iter().map(|&v| vertices.positions[v as usize]).sum();
            let radius = (sum / card.len() as f32).length();
            found[0] += f32::from(u8::from(card.len() < 7 && radius < 0.5));
            found[1] += f32::from(u8::from(card.len() < 7 && radius > 0.95));
        }
        found
    };
    let levels = levels(&hierarchy);
    let [hidden, seen] = count(&levels[0]);
    assert!(hidden > 200.0 && seen > 200.0, "{hidden}, {seen}");
    let [hidden_left, seen_left] = count(&levels[1]);
    println!("{hidden_left} of {hidden} are left, and {seen_left} of {seen}");
    assert!(hidden_left < 0.1 * hidden, "{hidden_left} of {hidden}");
    assert!(seen_left > 0.7 * seen, "{seen_left} of {seen}");
}

#[test]
fn levels_of_plants_keep_their_mean_colour() {
    let mut mesh = fixtures::cards(3_000, 5);
    let mut random = Random::new(2);
    for _ in 0..3_000 {
        let color = Vec4::new(random.unit(), random.unit(), 0.2, 1.0);
        mesh.colors.extend([color; 4]);
    }
    let hierarchy = bake(&mesh);
    let mean = |triangles: &[[u32; 3]]| {
        let (mut sum, mut whole) = (Vec4::ZERO, 0.0);
        for triangle in triangles {
            let [a, b, c] = triangle.map(|v| hierarchy.vertices.positions[v as usize]);
            let area = (b - a).cross(c - a).length();
            let colors = triangle.map(|v| hierarchy.vertices.colors[v as usize]);
            sum += colors.into_iter().sum::<Vec4>() * area;
            whole += area * 3.0;
        }
        sum / whole
    };
    let levels = levels(&hierarchy);
    let source = mean(&levels[0]);
    for triangles in levels.iter().filter(|triangles| triangles.len() > 300) {
        let share = mean(triangles).y / source.y;
        assert!((0.9..1.1).contains(&share), "{}: {share}", triangles.len());
    }
}

#[test]
fn plants_pass_verification() {
    for mesh in [
        fixtures::crown(1_500, 1),
        fixtures::cards(3_000, 2),
        fixtures::islands(2_000),
    ] {
        let verified = verify(&mesh, &bake(&mesh), &VerifySettings::default());
        assert!(verified.is_ok(), "{verified:?}");
    }
}

#[test]
fn closed_plants_stay_closed() {
    let hierarchy = bake(&fixtures::crown(2_000, 7));
    let weld = weld(&hierarchy.vertices.positions);
    for triangles in levels(&hierarchy) {
        assert!(open_edges(&triangles, &weld).is_empty());
    }
}

#[test]
fn vertices_of_elements_stay_finite() {
    let mut random = Random::new(9);
    let mut mesh = fixtures::cards(400, 4);
    // Some cards have no area, and some collapse to a point.
    for corner in mesh.positions.chunks_mut(4).step_by(3).flatten() {
        corner.y = 0.0;
        corner.x = if random.unit() < 0.5 { 0.0 } else { corner.x };
        corner.z = 0.0;
    }
    let hierarchy = bake(&mesh);
    assert_eq!(hierarchy.validate(), Ok(()));
    assert!(hierarchy.vertices.normals.iter().all(|n| n.is_finite()));
}

/// Bent blades of ten triangles on a meadow. Red is the wind weight of a vertex: zero at the foot and largest at the
/// tip. Green is the phase.
fn blades(count: u32) -> SourceMesh {
    const JOINTS: u32 = 5;
    let mut mesh = SourceMesh::default();
    let mut random = Random::new(11);
    for _ in 0..count {
        let first = mesh.positions.len() as u32;
        let foot = Vec3::new(random.unit(), 0.0, random.unit());
        let lean = random.vector().with_y(0.0) * 0.15;
        let across = Vec3::Y.cross(random.vector()).normalize_or(Vec3::X) * 0.01;
        let (sway, phase) = (0.3 + 0.6 * random.unit(), random.unit());
        for joint in 0..=JOINTS {
            let up = joint as f32 / JOINTS as f32;
            let middle = foot + Vec3::Y * 0.3 * up + lean * up * up;
            let half = across * (1.0 - 0.8 * up);
            mesh.positions.extend([middle - half, middle + half]);
            mesh.normals.extend([across.cross(Vec3::Y).normalize(); 2]);
            mesh.colors
                .extend([Vec4::new(sway * up * up, phase, 0.0, 1.0); 2]);
        }
        for joint in 0..JOINTS {
            let corner = first + 2 * joint;
            let corners = [0, 1, 2, 2, 1, 3];
            mesh.indices
                .extend(corners.map(|of_joint| corner + of_joint));
        }
    }
    mesh
}

#[test]
fn wind_weights_in_colours_stay_within_their_range() {
    let mesh = blades(400);
    let hierarchy = bake(&mesh);
    let vertices = &hierarchy.vertices;
    let most = |colors: &[Vec4]| colors.iter().copied().fold(Vec4::ZERO, Vec4::max);
    let (of_source, of_all) = (most(&mesh.colors), most(&vertices.colors));
    assert!(of_all.cmple(of_source).all(), "{of_all} > {of_source}");
    assert!(
        vertices
            .colors
            .iter()
            .all(|c| c.min_element() >= 0.0 && c.w == 1.0)
    );
    let levels = levels(&hierarchy);
    assert!(levels.len() > 5);
    for triangles in &levels {
        let blades = components(triangles, vertices.positions.len());
        let height = |vertex: &u32| vertices.positions[*vertex as usize].y;
        let sway = |vertex: &u32| vertices.colors[*vertex as usize].x;
        let (mut most_of_feet, mut tips) = (0.0f32, 0.0);
        for blade in &blades {
            let lowest = blade.iter().map(height).fold(f32::MAX, f32::min);
            let feet = blade.iter().filter(|v| height(v) <= lowest);
            most_of_feet = most_of_feet.max(feet.map(sway).fold(f32::MAX, f32::min));
            tips += blade.iter().map(sway).fold(0.0, f32::max);
        }
        let mean_of_tips = tips / blades.len() as f32;
        println!(
            "{} triangles: feet {most_of_feet}, tips {mean_of_tips}",
            triangles.len()
        );
        // The last levels have a few blades that replace all others.
        let most = if triangles.len() > 20 { 0.0 } else { 0.1 };
        assert!(most_of_feet <= most, "{}: {most_of_feet}", triangles.len());
        assert!(mean_of_tips > 0.3, "{}: {mean_of_tips}", triangles.len());
    }
}

/// Triangle corners of each connected component.
fn components(triangles: &[[u32; 3]], vertex_count: usize) -> Vec<Vec<u32>> {
    let mut leads_to: Vec<usize> = (0..vertex_count).collect();
    let root = |leads_to: &[usize], mut vertex: usize| {
        while leads_to[vertex] != vertex {
            vertex = leads_to[vertex];
        }
        vertex
    };
    for [a, b, c] in triangles {
        for other in [b, c] {
            let roots = [a, other].map(|v| root(&leads_to, *v as usize));
            leads_to[roots[0]] = roots[1];
        }
    }
    let mut found = std::collections::BTreeMap::<usize, Vec<u32>>::new();
    for &vertex in triangles.as_flattened() {
        let component = root(&leads_to, vertex as usize);
        found.entry(component).or_default().push(vertex);
    }
    found.into_values().collect()
}

/// Separate balls are simplified as surfaces. As flattened leaves, they would have an error of 0.3 of the radius.
#[test]
fn error_of_round_parts_is_small() {
    let parts = (0..40u32).map(|part| {
        let mut ball = fixtures::icosphere(2);
        let at = Vec3::new((part % 4) as f32, (part / 4 % 4) as f32, (part / 16) as f32);
        ball.positions.iter_mut().for_each(|p| *p += at * 3.0);
        ball
    });
    let hierarchy = bake(&fixtures::joined(&parts.collect::<Vec<_>>()));
    let errors = hierarchy.groups.iter().filter(|group| group.level == 0);
    let greatest = errors.map(|group| group.error_in_local).fold(0.0, f32::max);
    assert!(greatest > 0.0 && greatest < 0.1, "{greatest}");
}
