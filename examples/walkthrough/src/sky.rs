//! Sky and air, by day and by night.

use std::f32::consts::{PI, TAU};

use bevy::asset::RenderAssetUsages;
use bevy::light::{
    CascadeShadowConfig, CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster,
};
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;

use crate::hours::Hours;
use crate::noise::{fbm, random, smoothstep};

/// Towards the sun: over the left shoulder of one who walks up the avenue.
const TO_SUN: Vec3 = Vec3::new(-0.66, 0.46, 0.42);
const SUN_IN_LUX: f32 = 9_500.0;
/// Towards the moon: ahead and to the right of one who walks up the avenue.
const TO_MOON: Vec3 = Vec3::new(0.50, 0.52, -0.62);
/// Moonlight as films show it: a real moon gives a fraction of a lux.
const MOON_IN_LUX: f32 = 1_500.0;

/// Linear RGB at the horizon: also the colour of distant haze.
pub(crate) const HORIZON: Vec3 = Vec3::new(0.50, 0.50, 0.50);
const ZENITH: Vec3 = Vec3::new(0.055, 0.15, 0.38);
const GLOW: Vec3 = Vec3::new(0.55, 0.42, 0.26);
const CLOUD: Vec3 = Vec3::new(0.80, 0.76, 0.72);

/// The same by night.
pub(crate) const NIGHT_HORIZON: Vec3 = Vec3::new(0.040, 0.062, 0.115);
const NIGHT_ZENITH: Vec3 = Vec3::new(0.008, 0.017, 0.045);
const NIGHT_CLOUD: Vec3 = Vec3::new(0.065, 0.082, 0.125);
const MOONSHINE: Vec3 = Vec3::new(0.10, 0.12, 0.16);

const RADIUS_IN_M: f32 = 900.0;

/// Adds sun, moon and sky.
pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(DirectionalLightShadowMap { size: 2048 })
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, (spawn_lights, spawn_skies));
}

fn spawn_lights(mut commands: Commands) {
    let sun = Color::linear_rgb(1.0, 0.84, 0.64);
    let moon = Color::linear_rgb(0.62, 0.76, 1.0);
    commands.spawn((Hours::Day, light(sun, SUN_IN_LUX, TO_SUN)));
    commands.spawn((Hours::Night, light(moon, MOON_IN_LUX, TO_MOON)));
}

fn light(color: Color, illuminance: f32, toward: Vec3) -> impl Bundle {
    let light = DirectionalLight {
        color,
        illuminance,
        shadow_maps_enabled: true,
        ..default()
    };
    (
        light,
        cascades(),
        Transform::default().looking_to(-toward, Vec3::Y),
    )
}

fn cascades() -> CascadeShadowConfig {
    CascadeShadowConfigBuilder {
        num_cascades: 4,
        minimum_distance: 0.2,
        first_cascade_far_bound: 13.0,
        maximum_distance: 280.0,
        overlap_proportion: 0.12,
    }
    .build()
}

fn spawn_skies(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let material = materials.add(StandardMaterial {
        unlit: true,
        fog_enabled: false,
        cull_mode: None,
        ..default()
    });
    let skies = [
        (Hours::Day, dome(day_color)),
        (Hours::Night, dome(night_color)),
        (Hours::Night, stars_and_moon()),
    ];
    for (hours, sky) in skies {
        commands.spawn((
            hours,
            Mesh3d(meshes.add(sky)),
            MeshMaterial3d(material.clone()),
            NotShadowCaster,
        ));
    }
}

/// The sky as a large sphere around the scene, coloured at its vertices.
fn dome(color: fn(Vec3) -> Vec3) -> Mesh {
    const RINGS: u32 = 140;
    const SECTORS: u32 = 280;
    let direction = |ring: u32, sector: u32| {
        let (polar_sin, polar_cos) = (PI * ring as f32 / RINGS as f32).sin_cos();
        let (sin, cos) = (TAU * sector as f32 / SECTORS as f32).sin_cos();
        Vec3::new(polar_sin * cos, polar_cos, polar_sin * sin)
    };
    let vertices = (0..=RINGS).flat_map(|ring| (0..=SECTORS).map(move |s| direction(ring, s)));
    let corner = |ring: u32, sector: u32| ring * (SECTORS + 1) + sector;
    let squares = (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |s| (ring, s)));
    let indices = squares.flat_map(|(ring, sector)| {
        let [a, b] = [corner(ring, sector), corner(ring, sector + 1)];
        let [c, d] = [corner(ring + 1, sector), corner(ring + 1, sector + 1)];
        [a, b, c, b, d, c]
    });
    let painted = vertices.map(|direction| (direction * RADIUS_IN_M, color(direction)));
    mesh(painted.collect(), indices.collect())
}

fn mesh(vertices: Vec<(Vec3, Vec3)>, indices: Vec<u32>) -> Mesh {
    let (positions, colors): (Vec<_>, Vec<_>) = vertices.into_iter().unzip();
    let colors: Vec<_> = colors
        .into_iter()
        .map(|color| color.extend(1.0).to_array())
        .collect();
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::RENDER_WORLD,
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
    .with_inserted_indices(Indices::U32(indices))
}

/// 0 in the clear, 1 in a cloud.
fn cloud_cover(direction: Vec3) -> f32 {
    let above = direction.y.max(0.0);
    let overhead = Vec3::new(direction.x, 0.0, direction.z) / (above + 0.16);
    let cover = smoothstep(0.02, 0.75, fbm(overhead * Vec3::new(0.9, 1.0, 1.5), 5, 601));
    0.75 * cover * smoothstep(0.03, 0.22, direction.y)
}

fn day_color(direction: Vec3) -> Vec3 {
    let above = direction.y.max(0.0);
    let sky = HORIZON.lerp(ZENITH, 1.0 - (1.0 - above).powi(5));
    let toward_sun = direction.dot(TO_SUN.normalize()).max(0.0);
    let glow = 0.35 * toward_sun.powi(5) + 0.6 * toward_sun.powi(60);
    (sky + GLOW * glow).lerp(CLOUD + GLOW * glow * 0.5, cloud_cover(direction))
}

fn night_color(direction: Vec3) -> Vec3 {
    let above = direction.y.max(0.0);
    let sky = NIGHT_HORIZON.lerp(NIGHT_ZENITH, 1.0 - (1.0 - above).powi(4));
    let toward_moon = direction.dot(TO_MOON.normalize()).max(0.0);
    let glow = 0.4 * toward_moon.powi(8) + toward_moon.powi(90);
    (sky + MOONSHINE * glow).lerp(NIGHT_CLOUD + MOONSHINE * glow, 0.6 * cloud_cover(direction))
}

/// Small triangles strewn over the sky, and a disc.
fn stars_and_moon() -> Mesh {
    const STARS: u32 = 1_400;
    const MOON_CORNERS: u32 = 48;
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    let mut disc = |toward: Vec3, corners: u32, radius_in_rad: f32, color: Vec3| {
        let first = vertices.len() as u32;
        let (right, up) = toward.any_orthonormal_pair();
        vertices.extend((0..corners).map(|corner| {
            let aside = Vec2::from_angle(TAU * corner as f32 / corners as f32) * radius_in_rad;
            let place = toward + right * aside.x + up * aside.y;
            (place * 0.98 * RADIUS_IN_M, color)
        }));
        indices.extend((2..corners).flat_map(|corner| [first, first + corner - 1, first + corner]));
    };
    for star in 0..STARS {
        let draw = |k: u32| random(star * 4 + k, 651);
        let (height, around) = (0.02 + 0.98 * draw(0), TAU * draw(1));
        let flat = (1.0 - height * height).sqrt();
        let toward = Vec3::new(flat * around.cos(), height, flat * around.sin());
        let clear = (1.0 - 1.3 * cloud_cover(toward)).max(0.0);
        let bright = 0.1 + 0.9 * draw(2).powi(5);
        let tint = Vec3::new(0.85, 0.92, 1.0).lerp(Vec3::new(1.0, 0.86, 0.7), draw(3));
        disc(toward, 3, 0.0008 + 0.0007 * bright, tint * bright * clear);
    }
    disc(
        TO_MOON.normalize(),
        MOON_CORNERS,
        0.016,
        Vec3::new(0.95, 0.93, 0.85),
    );
    mesh(vertices, indices)
}
