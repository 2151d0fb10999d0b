//! Sun, sky and air.

use std::f32::consts::{PI, TAU};

use bevy::asset::RenderAssetUsages;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster};
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;

use crate::noise::{fbm, smoothstep};

/// Towards the sun: over the left shoulder of one who walks up the avenue.
const TO_SUN: Vec3 = Vec3::new(-0.66, 0.46, 0.42);
const SUN_IN_LUX: f32 = 9_500.0;

/// Linear RGB at the horizon: also the colour of distant haze.
pub(crate) const HORIZON: Vec3 = Vec3::new(0.50, 0.50, 0.50);
const ZENITH: Vec3 = Vec3::new(0.055, 0.15, 0.38);
const GLOW: Vec3 = Vec3::new(0.55, 0.42, 0.26);
const CLOUD: Vec3 = Vec3::new(0.80, 0.76, 0.72);

/// Adds the light of the scene.
pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(DirectionalLightShadowMap { size: 2048 })
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, spawn);
}

fn spawn(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: 3,
        minimum_distance: 0.2,
        first_cascade_far_bound: 14.0,
        maximum_distance: 150.0,
        overlap_proportion: 0.15,
    };
    commands.spawn((
        DirectionalLight {
            color: Color::linear_rgb(1.0, 0.84, 0.64),
            illuminance: SUN_IN_LUX,
            shadow_maps_enabled: true,
            ..default()
        },
        cascades.build(),
        Transform::default().looking_to(-TO_SUN, Vec3::Y),
    ));
    commands.spawn((
        Mesh3d(meshes.add(dome())),
        MeshMaterial3d(materials.add(StandardMaterial {
            unlit: true,
            fog_enabled: false,
            cull_mode: None,
            ..default()
        })),
        NotShadowCaster,
    ));
}

/// The sky as a large sphere around the scene, coloured at its vertices.
fn dome() -> Mesh {
    const RADIUS_IN_M: f32 = 900.0;
    const RINGS: u32 = 140;
    const SECTORS: u32 = 280;
    let direction = |ring: u32, sector: u32| {
        let (polar_sin, polar_cos) = (PI * ring as f32 / RINGS as f32).sin_cos();
        let (sin, cos) = (TAU * sector as f32 / SECTORS as f32).sin_cos();
        Vec3::new(polar_sin * cos, polar_cos, polar_sin * sin)
    };
    let vertices = (0..=RINGS).flat_map(|ring| (0..=SECTORS).map(move |s| direction(ring, s)));
    let directions: Vec<Vec3> = vertices.collect();
    let positions: Vec<Vec3> = directions.iter().map(|d| *d * RADIUS_IN_M).collect();
    let colors: Vec<_> = directions
        .iter()
        .map(|d| color(*d).extend(1.0).to_array())
        .collect();
    let corner = |ring: u32, sector: u32| ring * (SECTORS + 1) + sector;
    let squares = (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |s| (ring, s)));
    let indices = squares.flat_map(|(ring, sector)| {
        let [a, b] = [corner(ring, sector), corner(ring, sector + 1)];
        let [c, d] = [corner(ring + 1, sector), corner(ring + 1, sector + 1)];
        [a, b, c, b, d, c]
    });
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::RENDER_WORLD,
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
    .with_inserted_indices(Indices::U32(indices.collect()))
}

fn color(direction: Vec3) -> Vec3 {
    let above = direction.y.max(0.0);
    let sky = HORIZON.lerp(ZENITH, 1.0 - (1.0 - above).powi(5));
    let toward_sun = direction.dot(TO_SUN.normalize()).max(0.0);
    let glow = 0.35 * toward_sun.powi(5) + 0.6 * toward_sun.powi(60);
    let overhead = Vec3::new(direction.x, 0.0, direction.z) / (above + 0.16);
    let cover = smoothstep(0.02, 0.75, fbm(overhead * Vec3::new(0.9, 1.0, 1.5), 5, 601));
    let clouds = 0.75 * cover * smoothstep(0.03, 0.22, direction.y);
    (sky + GLOW * glow).lerp(CLOUD + GLOW * glow * 0.5, clouds)
}
