//! Compares stated deviations with independent, denser samples.

use std::f32::consts::{PI, TAU};

use fieldlod_bake::{
    BakeConfig, MeshError, SourceMesh, VerifyError, VerifySettings, bake_mesh, fixtures, verify,
};
use fieldlod_hierarchy::Hierarchy;
use glam::{Quat, Vec3};

fn meshes() -> Vec<(&'static str, SourceMesh)> {
    vec![
        ("icosphere", fixtures::icosphere(4)),
        ("rock", fixtures::rock(4, 1)),
        ("shells", fixtures::shells(3, 3)),
        ("torus knot", fixtures::torus_knot(150, 24)),
        ("plane", fixtures::plane(32)),
        ("height field", fixtures::height_field(100)),
        // The bake samples meshes of more than 32,768 triangles less densely.
        ("large height field", fixtures::height_field(140)),
        ("islands", fixtures::islands(1_000)),
        ("open room", open_room(72)),
        (
            "flat-shaded rock",
            fixtures::rock(3, 2).without_shared_vertices(),
        ),
    ]
}

/// A scan of a room from inside: a floor and four walls with clutter, without a ceiling, and with holes.
fn open_room(cells: u32) -> SourceMesh {
    let waves = |p: Vec3| (p.x * 15.1).sin() * (p.y * 17.3 + 1.0).sin() * (p.z * 16.1).cos();
    let turns = [Quat::from_rotation_x, Quat::from_rotation_z]
        .map(|turn| [turn(PI / 2.0), turn(-PI / 2.0)]);
    let sides = [&[Quat::IDENTITY], turns.as_flattened()].concat();
    let side = |turn: &Quat| {
        let mut side = fixtures::plane(cells);
        side.uvs.clear();
        for position in &mut side.positions {
            let place = *turn * (*position - 0.5) + 0.5;
            let clutter = if waves(place) > 0.3 {
                0.08
            } else {
                0.004 * waves(place * 7.0)
            };
            *position = place + *turn * Vec3::Y * clutter;
        }
        let triangles = side.indices.as_chunks::<3>().0.iter();
        let is_seen = |t: &&[u32; 3]| waves(side.positions[t[0] as usize] * 0.7) < 0.4;
        side.indices = triangles.filter(is_seen).flatten().copied().collect();
        fixtures::with_smooth_normals(side)
    };
    fixtures::joined(&sides.iter().map(side).collect::<Vec<_>>())
}

#[test]
fn levels_do_not_depend_on_deviations() {
    let pieces = fixtures::loose_pieces(1).into_iter().step_by(7);
    let pieces = pieces.map(|pieces| ("loose pieces", pieces.mesh));
    let others = [
        ("machine", fixtures::machine(2)),
        ("kit", fixtures::kit(2)),
        ("crown", fixtures::crown(300, 1)),
        ("layers", fixtures::joined(&fixtures::platform())),
    ];
    let unmeasured = BakeConfig {
        measure_deviation: false,
        ..BakeConfig::default()
    };
    for (name, mesh) in meshes().into_iter().chain(others).chain(pieces) {
        let mut measured = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
        let unmeasured = bake_mesh(&mesh, &unmeasured).unwrap();
        assert!(measured.is_measured() && !unmeasured.is_measured());
        for group in &mut measured.groups {
            group.deviation_in_local = f32::INFINITY;
        }
        assert!(measured == unmeasured, "{name}");
    }
}

#[test]
fn deviations_hold_at_denser_samples() {
    let small = BakeConfig {
        cluster_triangles: 64,
        group_clusters: 8,
        ..BakeConfig::default()
    };
    for (name, mesh) in meshes() {
        for config in [BakeConfig::default(), small.clone()] {
            let hierarchy = bake_mesh(&mesh, &config).unwrap();
            let verified = verify(&mesh, &hierarchy, &VerifySettings::default());
            assert!(verified.is_ok(), "{name}: {verified:?}");
        }
    }
}

/// A ball with round dimples, whose walls are so steep that simplified triangles cross them.
fn dimpled_ball(cells: u32) -> SourceMesh {
    let on_ball = |y: f32, angle: f32| {
        let radius = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(radius * angle.cos(), y, radius * angle.sin())
    };
    let dimples: Vec<Vec3> = (0..336u16)
        .map(|k| on_ball(1.0 - (f32::from(k) + 0.5) / 168.0, f32::from(k) * 2.399_963))
        .collect();
    let mut ball = fixtures::plane(cells);
    ball.uvs.clear();
    for position in &mut ball.positions {
        // The last column repeats the first bit for bit, which closes the surface.
        let angle = (position.x % 1.0) * TAU;
        let place = on_ball((position.z * PI).cos(), angle);
        let beside = dimples.iter().map(|dimple| dimple.distance(place));
        let from_centre = beside.fold(f32::MAX, f32::min) / 0.098;
        *position = place * (1.0 - 0.08 * (1.0 - from_centre.powi(16)).max(0.0));
    }
    fixtures::with_smooth_normals(ball)
}

#[test]
fn dimpled_ball_deviations_hold_at_denser_samples() {
    let settings = VerifySettings {
        samples_per_triangle: 50,
        most_samples: 20_000_000,
        cuts: 1,
        ..VerifySettings::default()
    };
    for cells in [130, 200] {
        let ball = dimpled_ball(cells);
        let hierarchy = bake_mesh(&ball, &BakeConfig::default()).unwrap();
        let verified = verify(&ball, &hierarchy, &settings);
        assert!(verified.is_ok(), "{cells} cells: {verified:?}");
    }
}

fn scaled(mut mesh: SourceMesh, factor: f32) -> SourceMesh {
    for position in &mut mesh.positions {
        *position *= factor;
    }
    mesh
}

/// A unit sphere and a second one that intersects it.
fn interpenetrating() -> SourceMesh {
    let mut mesh = fixtures::icosphere(4);
    let second = fixtures::icosphere(4);
    let first = mesh.positions.len() as u32;
    let moved = second.positions.iter().map(|p| *p + glam::Vec3::X * 0.7);
    mesh.positions.extend(moved);
    mesh.normals.extend(&second.normals);
    mesh.indices
        .extend(second.indices.iter().map(|v| v + first));
    mesh
}

/// A ball with triangles that have a corner twice, in all orders.
fn with_corners_twice() -> SourceMesh {
    let mut mesh = fixtures::icosphere(3);
    let triangles = mesh.indices.as_chunks::<3>().0.to_vec();
    let orders = [
        [0, 0, 1],
        [0, 1, 0],
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 1],
        [1, 0, 1],
    ];
    for (triangle, order) in triangles.iter().step_by(3).zip(orders.iter().cycle()) {
        mesh.indices.extend(order.map(|corner| triangle[corner]));
    }
    mesh
}

#[test]
fn degenerate_meshes_pass_verification() {
    let settings = VerifySettings {
        cuts: 40,
        most_samples: 200_000,
        ..VerifySettings::default()
    };
    for (name, mesh) in [
        ("one triangle", fixtures::one_triangle()),
        ("coincident points", fixtures::coincident_points(2_000)),
        ("fan", fixtures::non_manifold_fan(2_000)),
        ("plane", fixtures::plane(30)),
        ("interpenetrating", interpenetrating()),
        ("tiny", scaled(fixtures::rock(4, 1), 1e-6)),
        ("huge", scaled(fixtures::rock(4, 1), 1e6)),
        ("islands", fixtures::islands(10_000)),
        ("doubled", fixtures::doubled(fixtures::rock(4, 4))),
        ("corners twice", with_corners_twice()),
    ] {
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
        let verified = verify(&mesh, &hierarchy, &settings);
        assert!(verified.is_ok(), "{name}: {verified:?}");
    }
}

#[test]
fn verify_rejects_an_empty_mesh() {
    let fault = verify(
        &SourceMesh::default(),
        &Hierarchy::default(),
        &VerifySettings::default(),
    );
    assert_eq!(fault, Err(VerifyError::Mesh(MeshError::NoTriangles)));
}

#[test]
fn verify_rejects_deviations_that_are_too_small() {
    let mesh = fixtures::rock(5, 1);
    let mut hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    for group in &mut hierarchy.groups {
        group.deviation_in_local *= 0.9;
    }
    let fault = verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap_err();
    assert!(
        matches!(
            fault,
            VerifyError::SimplifiedTooFar { .. } | VerifyError::SourceTooFar { .. }
        ),
        "{fault}"
    );
}

#[test]
fn verify_rejects_holes() {
    let mesh = fixtures::rock(4, 1);
    let mut hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    let made = hierarchy
        .units
        .iter()
        .position(|unit| unit.producer().is_some());
    let first = hierarchy.units[made.unwrap()].first_triangle as usize * 3;
    hierarchy.indices[first + 1] = hierarchy.indices[first];
    // Without this tolerance, samples would find the fault first.
    let settings = VerifySettings {
        tolerance: f32::INFINITY,
        ..VerifySettings::default()
    };
    let fault = verify(&mesh, &hierarchy, &settings).unwrap_err();
    assert!(matches!(fault, VerifyError::Hole { .. }), "{fault}");
}

#[test]
fn verify_rejects_invalid_hierarchies() {
    let mesh = fixtures::rock(3, 1);
    let mut hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    hierarchy.units[0].consumed_by = u32::MAX;
    let fault = verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap_err();
    assert!(matches!(fault, VerifyError::Invalid(_)), "{fault}");
}

#[test]
fn verify_rejects_another_source() {
    let hierarchy = bake_mesh(&fixtures::rock(3, 1), &BakeConfig::default()).unwrap();
    let other = fixtures::rock(3, 2);
    let fault = verify(&other, &hierarchy, &VerifySettings::default());
    assert_eq!(fault, Err(VerifyError::OtherSource));
}

#[test]
fn verify_rejects_finest_cuts_that_differ_from_source() {
    let mesh = fixtures::rock(4, 1);
    let mut hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    let source = hierarchy.units.iter().position(|u| u.producer().is_none());
    let first = hierarchy.units[source.unwrap()].first_triangle as usize * 3;
    hierarchy.indices.swap(first, first + 1);
    let fault = verify(&mesh, &hierarchy, &VerifySettings::default());
    // One triangle is inverted, so one is missing and one is new.
    assert_eq!(fault, Err(VerifyError::FinestCut { found: 2 }));
}

/// Each level is a single group, so inverting it opens no edge.
#[test]
fn verify_rejects_inverted_surfaces() {
    let mesh = fixtures::rock(2, 1);
    let mut hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
    assert!(
        hierarchy
            .groups
            .iter()
            .enumerate()
            .all(|(i, g)| g.level as usize == i)
    );
    for unit in hierarchy.units.iter().filter(|u| u.producer().is_some()) {
        let first = unit.first_triangle as usize * 3;
        let end = first + unit.triangle_count as usize * 3;
        for triangle in hierarchy.indices[first..end].as_chunks_mut::<3>().0 {
            triangle.swap(0, 1);
        }
    }
    let fault = verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap_err();
    assert!(matches!(fault, VerifyError::Flipped { .. }), "{fault}");
}

/// A square plate with a round hole. Triangles connect its corners to the rim.
fn plate_with_hole(sides: u32) -> SourceMesh {
    let mut mesh = SourceMesh::default();
    let angle = |side: u32| side as f32 * std::f32::consts::TAU / sides as f32;
    let rim = (0..sides).map(|side| Vec3::new(angle(side).cos(), 0.0, angle(side).sin()) * 0.71);
    mesh.positions = rim.collect();
    let corners = [[3.0, 3.0], [-3.0, 3.0], [-3.0, -3.0], [3.0, -3.0]];
    mesh.positions
        .extend(corners.map(|[x, z]| Vec3::new(x, 0.0, z)));
    let nearest = |side: u32| sides + (side % sides) * 4 / sides;
    for side in 0..sides {
        let (next, corner) = ((side + 1) % sides, nearest(side));
        mesh.indices.extend([side, next, corner]);
        if nearest(side + 1) != corner {
            mesh.indices.extend([next, nearest(side + 1), corner]);
        }
    }
    mesh.normals = vec![Vec3::Y; mesh.positions.len()];
    mesh
}

#[test]
fn deviation_includes_overhang_of_planar_borders() {
    for mesh in [plate_with_hole(32), plate_with_hole(64)] {
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
        verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap();
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let coarsest = hierarchy.groups.last().unwrap();
        assert!(hierarchy.triangle_count_of(coarsest) < triangles.len() as u64 / 2);
        // An edge across two sides of the rim reaches this far into the hole.
        let deviations = hierarchy
            .groups
            .iter()
            .map(|group| group.deviation_in_local);
        let largest = deviations.filter(|d| d.is_finite()).fold(0.0, f32::max);
        let sides = (mesh.positions.len() - 4) as f32;
        let least = 0.71 * (1.0 - (std::f32::consts::TAU / sides).cos());
        assert!(largest > least * 0.9, "{largest} of {least}");
    }
}

/// Map coordinates in metres. At 4,500,000, an `f32` has steps of half a metre.
#[test]
fn deviations_have_no_floor_far_from_origin() {
    let corner = Vec3::new(500_000.0, 100.0, 4_500_000.0);
    let mut far = scaled(fixtures::height_field(64), 1000.0);
    far.positions.iter_mut().for_each(|p| {
        p.y *= 0.01;
        *p += corner;
    });
    let mut near = far.clone();
    near.positions.iter_mut().for_each(|p| *p -= corner);
    let [far, near] = [far, near].map(|mesh| {
        let hierarchy = bake_mesh(&mesh, &BakeConfig::default()).unwrap();
        verify(&mesh, &hierarchy, &VerifySettings::default()).unwrap();
        let groups = hierarchy.groups.iter();
        groups.fold(f32::MAX, |least, group| least.min(group.deviation_in_local))
    });
    assert!(far < near * 1.1, "{far} {near}");
}
