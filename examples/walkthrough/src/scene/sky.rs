//! Sky, sunlight and fog.

use std::f32::consts::FRAC_PI_2;

use bevy::light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster};
use bevy::light::{EnvironmentMapLight, GlobalAmbientLight};
use bevy::mesh::VertexAttributeValues;
use bevy::pbr::{DistanceFog, FogFalloff};
use bevy::prelude::*;

use crate::noise::{fbm, smoothstep};
use crate::quality::Quality;

/// Direction to the sun. When the camera walks up the avenue, the sun is behind it and to the left.
const TO_SUN: Vec3 = Vec3::new(-0.66, 0.46, 0.42);
const SUN_IN_LUX: f32 = 9_500.0;

/// Linear RGB at the horizon, and the colour of distant haze.
const HORIZON: Vec3 = Vec3::new(0.50, 0.50, 0.50);
const ZENITH: Vec3 = Vec3::new(0.055, 0.15, 0.38);
const GLOW: Vec3 = Vec3::new(0.55, 0.42, 0.26);
const CLOUD: Vec3 = Vec3::new(0.80, 0.76, 0.72);

const RADIUS_IN_M: f32 = 900.0;

/// Adds sun, sky and fog.
pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, (spawn_sun, spawn_dome, add_air));
}

/// Adds fog and the light of the sky to the cameras.
fn add_air(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    cameras: Query<Entity, With<Camera3d>>,
) {
    let [above, around, below] = [[0.55, 0.75, 1.1], [0.75, 0.70, 0.65], [0.34, 0.26, 0.18]]
        .map(|[r, g, b]| Color::linear_rgb(r, g, b));
    let skylight = EnvironmentMapLight {
        // Candela per square metre.
        intensity: 650.0,
        ..EnvironmentMapLight::hemispherical_gradient(&mut images, above, around, below)
    };
    let fog = DistanceFog {
        color: Color::linear_rgb(HORIZON.x, HORIZON.y, HORIZON.z),
        directional_light_color: Color::linear_rgba(1.0, 0.7, 0.4, 0.35),
        directional_light_exponent: 12.0,
        falloff: FogFalloff::ExponentialSquared { density: 0.0024 },
    };
    for camera in &cameras {
        commands
            .entity(camera)
            .insert((fog.clone(), skylight.clone()));
    }
}

fn spawn_sun(mut commands: Commands, quality: Res<Quality>) {
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: quality.shadow_cascades,
        minimum_distance: 0.2,
        first_cascade_far_bound: 13.0,
        maximum_distance: quality.shadow_distance_in_m,
        overlap_proportion: 0.12,
    };
    let sun = DirectionalLight {
        color: Color::linear_rgb(1.0, 0.84, 0.64),
        illuminance: SUN_IN_LUX,
        shadow_maps_enabled: true,
        ..default()
    };
    let transform = Transform::default().looking_to(-TO_SUN, Vec3::Y);
    commands.spawn((sun, cascades.build(), transform));
    commands.insert_resource(DirectionalLightShadowMap {
        size: quality.shadow_map_in_texels,
    });
}

fn spawn_dome(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let material = StandardMaterial {
        unlit: true,
        fog_enabled: false,
        cull_mode: None,
        ..default()
    };
    commands.spawn((
        Mesh3d(meshes.add(dome())),
        MeshMaterial3d(materials.add(material)),
        NotShadowCaster,
    ));
}

/// The sky as a large sphere around the scene, coloured at its vertices.
fn dome() -> Mesh {
    // Bevy's spheres have their poles on the Z axis.
    let upright = Quat::from_rotation_x(-FRAC_PI_2);
    let mut mesh = Sphere::new(RADIUS_IN_M)
        .mesh()
        .uv(280, 140)
        .rotated_by(upright);
    let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION);
    let positions = positions.and_then(VertexAttributeValues::as_float3);
    let directions = positions.unwrap_or_default().iter();
    let colors: Vec<_> = directions
        .map(|&at| {
            sky_color(Vec3::from(at) / RADIUS_IN_M)
                .extend(1.0)
                .to_array()
        })
        .collect();
    mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, colors);
    mesh
}

/// Cloud cover of the sky in a direction, from 0 (clear) to 1.
fn cloud_cover(direction: Vec3) -> f32 {
    let above = direction.y.max(0.0);
    let overhead = Vec3::new(direction.x, 0.0, direction.z) / (above + 0.16);
    let cover = smoothstep(0.02, 0.75, fbm(overhead * Vec3::new(0.9, 1.0, 1.5), 5, 601));
    0.75 * cover * smoothstep(0.03, 0.22, direction.y)
}

fn sky_color(direction: Vec3) -> Vec3 {
    let above = direction.y.max(0.0);
    let sky = HORIZON.lerp(ZENITH, 1.0 - (1.0 - above).powi(5));
    let toward_sun = direction.dot(TO_SUN.normalize()).max(0.0);
    let glow = 0.35 * toward_sun.powi(5) + 0.6 * toward_sun.powi(60);
    (sky + GLOW * glow).lerp(CLOUD + GLOW * glow * 0.5, cloud_cover(direction))
}
