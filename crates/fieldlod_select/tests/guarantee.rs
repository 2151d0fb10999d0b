//! The guarantee, measured: how far surfaces move on screen at the cuts that are selected.
//!
//! Points are strewn over the units of a cut. The nearest point of the source surface, in the
//! whole instance, is where each belongs; the distance of the two on screen is the displacement.
//! `FIELDLOD_MODELS` names a folder of GLB files to measure too.

mod common;

use camera_field::Camera;
use common::{look, perspective};
use fieldlod_bake::{BakeConfig, SourceMesh, bake_mesh, fixtures, import_gltf};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_hierarchy::fixtures::Random;
use fieldlod_select::{Cut, InstanceView, LodSettings, View, select, select_with};
use glam::{Affine3A, Vec2, Vec3};

/// The triangles of the source, in a grid of cells for finding the nearest.
struct Source {
    triangles: Vec<[Vec3; 3]>,
    cells: std::collections::HashMap<[i32; 3], Vec<u32>>,
    cell: f32,
}

impl Source {
    fn new(hierarchy: &Hierarchy, cell: f32) -> Self {
        let positions = &hierarchy.vertices.positions;
        let source = hierarchy.source_units().map(|unit| &hierarchy.units[unit]);
        let triangles: Vec<[Vec3; 3]> = source
            .flat_map(|unit| hierarchy.triangles_of(unit))
            .map(|triangle| triangle.map(|v| positions[v as usize]))
            .collect();
        let mut cells = std::collections::HashMap::<[i32; 3], Vec<u32>>::new();
        for (index, triangle) in triangles.iter().enumerate() {
            let min = key(triangle[0].min(triangle[1]).min(triangle[2]), cell);
            let max = key(triangle[0].max(triangle[1]).max(triangle[2]), cell);
            for x in min[0]..=max[0] {
                for y in min[1]..=max[1] {
                    for z in min[2]..=max[2] {
                        cells.entry([x, y, z]).or_default().push(index as u32);
                    }
                }
            }
        }
        Self {
            triangles,
            cells,
            cell,
        }
    }

    fn nearest(&self, point: Vec3) -> Vec3 {
        let at = key(point, self.cell);
        let mut best = Vec3::INFINITY;
        for ring in 0i32..64 {
            for x in -ring..=ring {
                for y in -ring..=ring {
                    for z in -ring..=ring {
                        if x.abs().max(y.abs()).max(z.abs()) == ring {
                            for &t in self
                                .cells
                                .get(&[at[0] + x, at[1] + y, at[2] + z])
                                .into_iter()
                                .flatten()
                            {
                                let candidate = nearest_on(&self.triangles[t as usize], point);
                                if candidate.distance(point) < best.distance(point) {
                                    best = candidate;
                                }
                            }
                        }
                    }
                }
            }
            if best.distance(point) <= ring as f32 * self.cell {
                break;
            }
        }
        best
    }
}

fn key(point: Vec3, cell: f32) -> [i32; 3] {
    (point / cell).floor().as_ivec3().to_array()
}

/// Ericson, "Real-Time Collision Detection" (2005), §5.1.5.
fn nearest_on([a, b, c]: &[Vec3; 3], p: Vec3) -> Vec3 {
    let on_edge = |from: Vec3, to: Vec3| {
        let along = to - from;
        let t = (p - from).dot(along) / along.length_squared().max(f32::MIN_POSITIVE);
        from + along * t.clamp(0.0, 1.0)
    };
    let normal = (b - a).cross(c - a);
    let inside = |from: Vec3, to: Vec3| (to - from).cross(p - from).dot(normal) >= 0.0;
    if normal != Vec3::ZERO && inside(*a, *b) && inside(*b, *c) && inside(*c, *a) {
        return p - normal * ((p - a).dot(normal) / normal.length_squared());
    }
    [on_edge(*a, *b), on_edge(*b, *c), on_edge(*c, *a)]
        .into_iter()
        .min_by(|x, y| x.distance_squared(p).total_cmp(&y.distance_squared(p)))
        .unwrap_or(*a)
}

/// Displacements on screen, in pixels, at random points of a cut that are in view.
fn displacements(
    hierarchy: &Hierarchy,
    source: &Source,
    cut: &Cut,
    view: &View,
    random: &mut Random,
) -> Vec<f32> {
    let Camera::Perspective(camera) = view.camera() else {
        return Vec::new();
    };
    let instance = InstanceView::new(view, &Affine3A::IDENTITY);
    let in_camera = |center: Vec3| {
        instance
            .sphere_in_camera(&fieldlod_hierarchy::Sphere {
                center,
                radius: 0.0,
            })
            .center
    };
    let mut all = Vec::new();
    for _ in 0..60 {
        let unit = cut.units()[random.index(cut.units().len())];
        let unit = &hierarchy.units[unit as usize];
        if unit.producer().is_none() {
            continue;
        }
        let triangles: Vec<[u32; 3]> = hierarchy.triangles_of(unit).collect();
        let triangle = triangles[random.index(triangles.len())];
        let [a, b, c] = triangle.map(|v| hierarchy.vertices.positions[v as usize]);
        let (s, t) = (random.unit(), random.unit());
        let (s, t) = if s + t > 1.0 {
            (1.0 - s, 1.0 - t)
        } else {
            (s, t)
        };
        let point = a + (b - a) * s + (c - a) * t;
        let (here, there) = (in_camera(point), in_camera(source.nearest(point)));
        if camera.contains(here) && camera.contains(there) {
            let to_px = |p: Vec3| Vec2::new(p.x, p.y) / p.z * camera.focal_px;
            all.push(to_px(here).distance(to_px(there)));
        }
    }
    all
}

/// clusterlod's test with the same error: `e f / (ρ − r) > τ`.
fn clusterlod(hierarchy: &Hierarchy, view: &View, cut: &mut Cut) {
    let Camera::Perspective(camera) = view.camera() else {
        return;
    };
    let instance = InstanceView::new(view, &Affine3A::IDENTITY);
    select_with(hierarchy, &LodSettings::default(), cut, |group| {
        let group = &hierarchy.groups[group];
        let sphere = instance.sphere_in_camera(&group.bounds);
        let gap = sphere.center.length() - sphere.radius;
        group.error_in_local * camera.focal_px.x / gap.max(1e-3)
    });
}

struct Measured {
    max_px: f32,
    max_clusterlod_px: f32,
    samples: usize,
    over: usize,
}

fn measure(hierarchy: &Hierarchy, cameras: usize, seed: u64) -> Measured {
    let box_of_all = hierarchy.aabb().unwrap();
    let size = (box_of_all.max - box_of_all.min).length();
    let center = (box_of_all.min + box_of_all.max) * 0.5;
    let source = Source::new(hierarchy, size / 64.0);
    let mut random = Random::new(seed);
    let mut measured = Measured {
        max_px: 0.0,
        max_clusterlod_px: 0.0,
        samples: 0,
        over: 0,
    };
    for _ in 0..cameras {
        let fov_y = (30.0 + 90.0 * random.unit()).to_radians();
        let eye =
            center + random.vector().normalize_or(Vec3::X) * size * (0.3 + 3.0 * random.unit());
        let target = center + random.vector() * size * 1.5;
        let view = look(perspective(fov_y), eye, target);
        let [mut ours, mut theirs] = [Cut::default(), Cut::default()];
        select(
            hierarchy,
            &Affine3A::IDENTITY,
            &view,
            &LodSettings::guaranteed(1.0),
            &mut ours,
        );
        clusterlod(hierarchy, &view, &mut theirs);
        let px = displacements(hierarchy, &source, &ours, &view, &mut random);
        measured.samples += px.len();
        measured.over += px.iter().filter(|&&px| px > 1.0).count();
        measured.max_px = px.iter().copied().fold(measured.max_px, f32::max);
        let px = displacements(hierarchy, &source, &theirs, &view, &mut random);
        measured.max_clusterlod_px = px.into_iter().fold(measured.max_clusterlod_px, f32::max);
    }
    measured
}

fn bake(mesh: &SourceMesh) -> Hierarchy {
    bake_mesh(
        mesh,
        &BakeConfig {
            cluster_triangles: 64,
            group_clusters: 6,
            ..BakeConfig::default()
        },
    )
    .unwrap()
}

fn assert_kept(name: &str, hierarchy: &Hierarchy, cameras: usize) {
    let Measured {
        max_px,
        max_clusterlod_px,
        samples,
        over,
    } = measure(hierarchy, cameras, 1);
    println!(
        "{name}: {cameras} cameras, {samples} samples: largest {max_px:.3} px, {over} over 1 px; clusterlod {max_clusterlod_px:.3} px"
    );
    assert!(samples > cameras, "{name}: too few samples");
    assert_eq!(over, 0, "{name}: {max_px} px");
}

#[test]
fn no_displacement_exceeds_the_threshold() {
    assert_kept("rock", &bake(&fixtures::rock(5, 1)), 200);
    assert_kept("torus knot", &bake(&fixtures::torus_knot(200, 24)), 200);
    assert_kept("shells", &bake(&fixtures::shells(3, 4)), 150);
    assert_kept("height field", &bake(&fixtures::height_field(64)), 150);
}

#[test]
fn no_displacement_of_models_exceeds_the_threshold() {
    let Ok(folder) = std::env::var("FIELDLOD_MODELS") else {
        return;
    };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    for file in files
        .iter()
        .filter(|file| file.extension().is_some_and(|e| e == "glb"))
    {
        for primitive in import_gltf(file).unwrap().primitives {
            let hierarchy = bake_mesh(&primitive.mesh, &BakeConfig::default()).unwrap();
            if hierarchy.level_count() < 3 {
                println!("{}: too small to have levels", file.display());
                continue;
            }
            assert_kept(&file.display().to_string(), &hierarchy, 500);
        }
    }
}
