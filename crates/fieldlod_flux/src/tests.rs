//! The depth image against a naive one.

use std::sync::{Arc, OnceLock};

use camera_field::{Camera, Intrinsics};
use fieldlod_bake::{BakeConfig, bake_mesh, fixtures};
use fieldlod_hierarchy::{Hierarchy, Sphere};
use fieldlod_select::lanes::{Eight, LANES};
use fieldlod_select::{MeshId, Scene, View};
use glam::{Affine3A, DVec3, EulerRot, Quat, Vec2, Vec3};
use proptest::prelude::*;

use crate::choice::{Candidate, DrawnBy, POINTS_PER_TRIANGLE};
use crate::clip::{Corner, clipped_parts};
use crate::depth_image::{DepthImage, STRETCH};
use crate::image_plane::ImagePlane;
use crate::occluder::{Occluder, Occluders};
use crate::screen_triangle::ScreenTriangle;
use crate::texels::{NOBODY, Texels};

/// An image: the nearness and the owner of each texel.
type Image = (Vec<f32>, Vec<u32>);

/// Draws every texel of every triangle and point, one by one, within `triangles` triangles. If `skips_covered`, an
/// instance behind nearer surfaces is left out.
fn naive_image(
    (scene, occluders): (&Scene, &Occluders),
    drawn: &DepthImage,
    triangles: u32,
    skips_covered: bool,
) -> Image {
    let texels = drawn.plane.width * drawn.plane.height;
    let mut image = (vec![f32::NEG_INFINITY; texels], vec![NOBODY; texels]);
    let mut drawn_points = 0;
    for candidate in &drawn.candidates {
        let sphere = &candidate.placed.sphere;
        if !(skips_covered && is_covered(drawn, &image.0, sphere)) {
            let rest = triangles.saturating_sub(drawn_points / POINTS_PER_TRIANGLE);
            drawn_points += draw_naively((scene, occluders), drawn, candidate, rest, &mut image);
        }
    }
    assert!(drawn_points / POINTS_PER_TRIANGLE <= triangles);
    image
}

/// Whether all texels around a sphere are nearer than the sphere.
fn is_covered(drawn: &DepthImage, nearness: &[f32], sphere: &Sphere) -> bool {
    let center = drawn.view.in_camera(sphere.center);
    let place = drawn.plane.rectangle(center, sphere.radius);
    place.is_some_and(|place| {
        let mut rows = place.rows.clone();
        rows.all(|row| {
            let mut columns = place.columns.clone();
            columns.all(|column| nearness[row * drawn.plane.width + column] > place.nearest)
        })
    })
}

/// Draws one instance. Returns its cost in points.
fn draw_naively(
    (scene, occluders): (&Scene, &Occluders),
    drawn: &DepthImage,
    candidate: &Candidate,
    rest: u32,
    (image, owners): &mut Image,
) -> u32 {
    let (plane, texels) = (&drawn.plane, image.len());
    let placed = &candidate.placed;
    let placement = scene.placement(placed.id).unwrap();
    let owner = placed.id.index() as u32;
    let mut keep = |texel: usize, nearness: f32| {
        let is_nearer = image[texel] < nearness;
        if is_nearer {
            (image[texel], owners[texel]) = (nearness, owner);
        }
        is_nearer
    };
    let (linear, origin) = drawn.view.camera_from_local(&placement);
    let occluder = occluders.of_mesh(placed.mesh).unwrap();
    match candidate.drawn_by(occluder, plane, &linear, origin, rest) {
        // Parts outside the image are drawn as well.
        Some(DrawnBy::Level(parts, triangle_count)) => {
            let mut corners = Vec::new();
            for part in parts {
                for corners in part.placed_triangles(plane, &linear, origin, &mut corners) {
                    let is_mirrored = linear.determinant() < 0.0;
                    clipped_parts(plane, corners, is_mirrored, |part| {
                        let Some(triangle) = ScreenTriangle::new(part) else {
                            return;
                        };
                        for texel in 0..texels {
                            let x = (texel % plane.width) as f32 + 0.5;
                            let y = (texel / plane.width) as f32 + 0.5;
                            if triangle.covers(x, y) {
                                keep(texel, triangle.nearness(x, y));
                            }
                        }
                    });
                }
            }
            triangle_count * POINTS_PER_TRIANGLE
        }
        Some(DrawnBy::Points(points)) => {
            let points: Vec<Vec3> = points_of(points).collect();
            let mut drawn = 0;
            for stretch in points.chunks(STRETCH * LANES) {
                let mut is_in_front = false;
                for point in stretch {
                    let point = linear * *point + origin;
                    let at = plane.project(point);
                    if plane.has_place(at, point.z) {
                        let texel = at.y as usize * plane.width + at.x as usize;
                        is_in_front |= keep(texel, at.z);
                    }
                }
                drawn += stretch.len() as u32;
                if !is_in_front {
                    break;
                }
            }
            drawn
        }
        None => 0,
    }
}

fn points_of(elements: &[Eight<3>]) -> impl Iterator<Item = Vec3> + '_ {
    let of_element = |eight| (0..LANES).map(move |lane| Vec3::from(Eight::at(eight, lane)));
    elements.iter().flat_map(of_element)
}

/// A triangle around the centre of a texel, in `f64`: whether it covers all of a square of a tenth of a texel, whether it
/// may touch the square, and the least and the greatest nearness of its plane there.
fn around_texel(plane: &ImagePlane, corners: [Vec3; 3], x: f64, y: f64) -> (bool, bool, [f64; 2]) {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let (normal, edges) = ((b - a).cross(c - a), [a.cross(b), b.cross(c), c.cross(a)]);
    let height = normal.dot(a);
    let rays = [(-0.05, -0.05), (0.05, -0.05), (-0.05, 0.05), (0.05, 0.05)];
    let rays = rays.map(|(right, down)| plane.ray(x + right, y + down));
    let inside = |edge: DVec3| rays.map(|ray| edge.dot(ray) * height.signum() >= 0.0);
    let nearness = rays.map(|ray| normal.dot(ray) / height);
    (
        edges
            .iter()
            .all(|&edge| inside(edge).into_iter().all(|is_in| is_in)),
        edges.iter().all(|&edge| inside(edge).contains(&true)),
        [
            nearness.into_iter().fold(f64::INFINITY, f64::min),
            nearness.into_iter().fold(f64::NEG_INFINITY, f64::max),
        ],
    )
}

fn camera() -> Camera {
    Camera::Perspective(Intrinsics::centered(200.0, Vec2::new(320.0, 180.0)))
}

fn view(eye: Vec3, turn: Quat) -> View {
    View::new(camera(), &Affine3A::from_rotation_translation(turn, eye))
}

/// A rock in pieces, a rock as a whole, and a rock with positions of NaN and triangles without area.
fn meshes(scene: &mut Scene, occluders: &mut Occluders) -> [MeshId; 3] {
    std::array::from_fn(|index| {
        let mesh = scene.add_mesh(&baked()[index]);
        occluders.set_mesh(mesh, Some(Arc::new(Occluder::new(&baked()[index]))));
        mesh
    })
}

fn baked() -> &'static [Hierarchy; 3] {
    static BAKED: OnceLock<[Hierarchy; 3]> = OnceLock::new();
    BAKED.get_or_init(bake_meshes)
}

fn bake_meshes() -> [Hierarchy; 3] {
    let bake = |mesh| bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    let ball = bake(fixtures::rock(5, 1));
    let mut broken = bake(fixtures::rock(4, 1));
    for (index, position) in broken.vertices.positions.iter_mut().enumerate() {
        match index % 5 {
            0 => *position = Vec3::NAN,
            1 => *position = Vec3::ZERO,
            2 => *position *= f32::INFINITY,
            _ => {}
        }
    }
    let whole = ball.whole_mesh_levels().unwrap();
    [ball, whole, broken]
}

fn place(at: Vec3, scale: Vec3) -> Affine3A {
    Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_y(0.3), at)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn image_equals_naive_image(
        placed in prop::collection::vec((0usize..3, prop::array::uniform3(-1.0f32..1.0), prop::array::uniform3(-1.5f32..1.5)), 1..16),
        turn in -0.5f32..0.5,
        budget in prop_oneof![2 => 0u32..6000, 1 => Just(u32::MAX)],
    ) {
        let mut scene = Scene::default();
        let mut occluders = Occluders::default();
        let meshes = meshes(&mut scene, &mut occluders);
        // In front of the eye, behind it and around it; mirrored and flat. The first one hides many others.
        scene.add_instance(meshes[0], place(Vec3::Z * -5.0, Vec3::splat(2.0)), 1.0);
        for (mesh, at, scale) in placed {
            let at = Vec3::from(at) * Vec3::new(8.0, 4.0, 12.0) - Vec3::Z * 7.0;
            scene.add_instance(meshes[mesh], place(at, Vec3::from(scale)), 1.0);
        }
        scene.update();
        let view = view(Vec3::ZERO, Quat::from_rotation_z(turn));
        let drawn = DepthImage::new(&scene, &view, &occluders, budget);
        let image = naive_image((&scene, &occluders), &drawn, budget, true);
        let bits = |image: &[f32]| image.iter().map(|texel| texel.to_bits()).collect::<Vec<u32>>();
        prop_assert_eq!(bits(&drawn.texels.nearness), bits(&image.0));
        prop_assert_eq!(&drawn.texels.owners, &image.1);
        if budget == u32::MAX {
            let all = naive_image((&scene, &occluders), &drawn, budget, false);
            prop_assert_eq!(&drawn.texels.nearness, &all.0);
        }
    }

    #[test]
    fn depths_of_large_triangles_equal_those_of_rays(
        corners in prop::array::uniform3(prop::array::uniform3(-1.0f32..1.0)),
        size in prop_oneof![1.0f32..10.0, 10.0f32..100.0, 100.0f32..10_000.0],
        height in prop_oneof![0.01f32..0.1, 0.1f32..10.0],
        turn in prop::array::uniform3(-3.0f32..3.0),
    ) {
        // A ground below the camera, which looks anywhere.
        let size = Vec3::new(1.0, 1e-3, 1.0) * size;
        let [x, y, z] = turn;
        let pose = Quat::from_euler(EulerRot::XYZ, x, y, z);
        let below = Vec3::Y * height;
        let corners = corners.map(|at| pose * (Vec3::from(at) * size + below));
        let plane = ImagePlane::new(&camera());
        let [a, b, c] = corners;
        let mut texels = Texels::default();
        texels.clear(plane.width, plane.height);
        for corners in [[a, b, c], [a, c, b]].map(|side| side.map(|at| Corner::new(&plane, at))) {
            clipped_parts(&plane, corners, false, |part| texels.draw(part, 0));
        }
        for (index, &nearness) in texels.nearness.iter().enumerate() {
            let (x, y) = ((index % plane.width) as f64 + 0.5, (index / plane.width) as f64 + 0.5);
            let (is_full, is_met, [least, most]) = around_texel(&plane, corners, x, y);
            if nearness == f32::NEG_INFINITY {
                // The near plane may cut a surface.
                prop_assert!(!is_full || most > 990.0, "{} {}: hole", x, y);
            } else {
                prop_assert!(is_met, "{} {}: beyond", x, y);
                let nearness = f64::from(nearness);
                prop_assert!((least * 0.999..=most * 1.001).contains(&nearness), "{} {}: {} of {}..{}", x, y, nearness, least, most);
            }
        }
    }

    #[test]
    fn two_triangles_at_an_edge_leave_no_gap(
        corner in prop::array::uniform2(0.0f32..30.0),
        sides in prop::array::uniform4(-30.0f32..30.0),
        is_on_centres in any::<bool>(),
    ) {
        // A parallelogram, whose diagonal may run through the centres of texels.
        let placed = |at: Vec2| if is_on_centres { at.floor() + 0.5 } else { at };
        let corner = placed(corner.into());
        let [u, v] = [0, 2].map(|first| placed(Vec2::new(sides[first], sides[first + 1])) - 0.5);
        let (u, v) = if u.perp_dot(v) < 0.0 { (u, v) } else { (v, u) };
        let at = |offset: Vec2| (corner + offset).extend(1.0);
        let corners = [at(Vec2::ZERO), at(u), at(u + v), at(v)];
        let triangles = [[0, 1, 2], [0, 2, 3]].map(|three| ScreenTriangle::new(three.map(|index: usize| corners[index])));
        prop_assume!(u.perp_dot(v) < -0.1);
        let [first, second] = triangles.map(Option::unwrap);
        let (u, v, area) = (u.as_dvec2(), v.as_dvec2(), f64::from(u.perp_dot(v)));
        for texel in 0..64 * 64 {
            let (x, y) = ((texel % 64) as f32 + 0.5, (texel / 64) as f32 + 0.5);
            let from_corner = Vec2::new(x, y).as_dvec2() - corner.as_dvec2();
            let along = [from_corner.perp_dot(v) / area, u.perp_dot(from_corner) / area];
            let is_inside = along.iter().all(|along| (0.01..=0.99).contains(along));
            prop_assert!(!is_inside || first.covers(x, y) || second.covers(x, y));
        }
    }
}
