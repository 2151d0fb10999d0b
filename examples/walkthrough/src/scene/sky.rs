//! Sky, light and fog, by day and at night.

use std::f32::consts::{FRAC_PI_2, TAU};

use bevy::asset::RenderAssetUsages;
use bevy::light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster};
use bevy::light::{EnvironmentMapLight, GlobalAmbientLight};
use bevy::mesh::{Indices, PrimitiveTopology, VertexAttributeValues};
use bevy::pbr::{DistanceFog, FogFalloff};
use bevy::prelude::*;

use crate::cameras::ViewOptions;
use crate::noise::{fbm, random, smoothstep};
use crate::quality::Quality;

/// Direction to the sun. When the camera walks up the avenue, the sun is behind it and to the left.
const TO_SUN: Vec3 = Vec3::new(-0.66, 0.46, 0.42);
const SUN_IN_LUX: f32 = 9_500.0;
/// Direction to the moon. When the camera walks up the avenue, the moon is ahead and to the right.
const TO_MOON: Vec3 = Vec3::new(0.50, 0.52, -0.62);
/// Illuminance of moonlight, much brighter than a real moon, which gives a fraction of a lux.
const MOON_IN_LUX: f32 = 1_500.0;

/// Linear RGB at the horizon by day, and the colour of distant haze.
const HORIZON: Vec3 = Vec3::new(0.50, 0.50, 0.50);
const ZENITH: Vec3 = Vec3::new(0.055, 0.15, 0.38);
const GLOW: Vec3 = Vec3::new(0.55, 0.42, 0.26);
const CLOUD: Vec3 = Vec3::new(0.80, 0.76, 0.72);

/// Linear RGB at the horizon by night.
const NIGHT_HORIZON: Vec3 = Vec3::new(0.040, 0.062, 0.115);
const NIGHT_ZENITH: Vec3 = Vec3::new(0.008, 0.017, 0.045);
const NIGHT_CLOUD: Vec3 = Vec3::new(0.065, 0.082, 0.125);
const MOONSHINE: Vec3 = Vec3::new(0.10, 0.12, 0.16);

const RADIUS_IN_M: f32 = 900.0;

/// The time of day at which an entity is shown.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TimeOfDay {
    Day,
    Night,
}

impl TimeOfDay {
    fn of(options: &ViewOptions) -> Self {
        if options.night {
            Self::Night
        } else {
            Self::Day
        }
    }

    /// Illuminance of sun or moon.
    fn light_in_lux(self) -> f32 {
        match self {
            Self::Day => SUN_IN_LUX,
            Self::Night => MOON_IN_LUX,
        }
    }

    /// The fog of distant objects.
    fn fog(self) -> DistanceFog {
        let (haze, toward_light) = match self {
            Self::Day => (HORIZON, Color::linear_rgba(1.0, 0.7, 0.4, 0.35)),
            Self::Night => (NIGHT_HORIZON, Color::linear_rgba(0.20, 0.26, 0.4, 0.25)),
        };
        DistanceFog {
            color: Color::linear_rgb(haze.x, haze.y, haze.z),
            directional_light_color: toward_light,
            directional_light_exponent: 12.0,
            falloff: FogFalloff::ExponentialSquared { density: 0.0024 },
        }
    }

    /// The light of the sky. The intensity is in candela per square metre; the colours are those above, around and
    /// below.
    fn skylight(self, images: &mut Assets<Image>) -> EnvironmentMapLight {
        let (intensity, colors) = match self {
            Self::Day => (
                650.0,
                [[0.55, 0.75, 1.1], [0.75, 0.70, 0.65], [0.34, 0.26, 0.18]],
            ),
            Self::Night => (
                150.0,
                [[0.45, 0.65, 1.2], [0.40, 0.50, 0.75], [0.20, 0.20, 0.22]],
            ),
        };
        let [above, around, below] = colors.map(|[r, g, b]| Color::linear_rgb(r, g, b));
        EnvironmentMapLight {
            intensity,
            ..EnvironmentMapLight::hemispherical_gradient(images, above, around, below)
        }
    }
}

/// The light of the sky, by day and by night.
#[derive(Resource)]
struct Skylights([EnvironmentMapLight; 2]);

/// Adds sun, moon and sky.
pub(crate) fn plugin(app: &mut App) {
    app.insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, (spawn_lights, spawn_skies))
        .add_systems(
            Update,
            (show_time_of_day, update_air).run_if(resource_changed::<ViewOptions>),
        );
}

/// Shows the entities of the current time of day and hides the others.
fn show_time_of_day(
    options: Res<ViewOptions>,
    mut objects: Query<(&TimeOfDay, &mut Visibility), Without<DirectionalLight>>,
    mut lights: Query<(&TimeOfDay, &mut DirectionalLight)>,
) {
    let now = TimeOfDay::of(&options);
    for (time, mut visibility) in &mut objects {
        visibility.set_if_neq(if *time == now {
            Visibility::Inherited
        } else {
            Visibility::Hidden
        });
    }
    // Lights are dimmed, not hidden: Bevy 0.19.1 draws no shadows of a light that was hidden and is shown again.
    for (time, mut light) in &mut lights {
        light.shadow_maps_enabled = *time == now;
        light.illuminance = if *time == now {
            time.light_in_lux()
        } else {
            0.0
        };
    }
}

/// Updates fog and sky light of the cameras.
fn update_air(
    mut commands: Commands,
    options: Res<ViewOptions>,
    skylights: Res<Skylights>,
    cameras: Query<Entity, With<Camera3d>>,
) {
    let time = TimeOfDay::of(&options);
    let Skylights([day, night]) = &*skylights;
    let skylight = if options.night { night } else { day };
    for camera in &cameras {
        let air = (time.fog(), skylight.clone());
        commands.entity(camera).insert(air);
    }
}

fn spawn_lights(mut commands: Commands, quality: Res<Quality>, mut images: ResMut<Assets<Image>>) {
    let sun = Color::linear_rgb(1.0, 0.84, 0.64);
    let moon = Color::linear_rgb(0.62, 0.76, 1.0);
    commands.spawn((TimeOfDay::Day, light(&quality, sun, TO_SUN)));
    commands.spawn((TimeOfDay::Night, light(&quality, moon, TO_MOON)));
    let skylights = [TimeOfDay::Day, TimeOfDay::Night].map(|time| time.skylight(&mut images));
    commands.insert_resource(Skylights(skylights));
    commands.insert_resource(DirectionalLightShadowMap {
        size: quality.shadow_map_in_texels,
    });
}

fn light(quality: &Quality, color: Color, toward: Vec3) -> impl Bundle {
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: quality.shadow_cascades,
        minimum_distance: 0.2,
        first_cascade_far_bound: 13.0,
        maximum_distance: quality.shadow_distance_in_m,
        overlap_proportion: 0.12,
    };
    let light = DirectionalLight { color, ..default() };
    let transform = Transform::default().looking_to(-toward, Vec3::Y);
    (light, cascades.build(), transform)
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
        (TimeOfDay::Day, dome(day_color)),
        (TimeOfDay::Night, dome(night_color)),
        (TimeOfDay::Night, stars_and_moon()),
    ];
    for (time, sky) in skies {
        commands.spawn((
            time,
            Mesh3d(meshes.add(sky)),
            MeshMaterial3d(material.clone()),
            NotShadowCaster,
        ));
    }
}

/// The sky as a large sphere around the scene, coloured at its vertices.
fn dome(color: fn(Vec3) -> Vec3) -> Mesh {
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
        .map(|&at| color(Vec3::from(at) / RADIUS_IN_M).extend(1.0).to_array())
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

/// A mesh of stars and moon. A star is a small triangle, the moon is a disc.
fn stars_and_moon() -> Mesh {
    const STARS: u32 = 1_400;
    const MOON_CORNERS: u32 = 48;
    let (mut positions, mut colors, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    let mut disc = |toward: Vec3, corners: u32, radius_in_rad: f32, color: Vec3| {
        let first = positions.len() as u32;
        let (right, up) = toward.any_orthonormal_pair();
        positions.extend((0..corners).map(|corner| {
            let aside = Vec2::from_angle(TAU * corner as f32 / corners as f32) * radius_in_rad;
            // Just inside the dome, which would hide them.
            (toward + right * aside.x + up * aside.y) * 0.98 * RADIUS_IN_M
        }));
        colors.extend((0..corners).map(|_| color.extend(1.0).to_array()));
        indices.extend((2..corners).flat_map(|corner| [first, first + corner - 1, first + corner]));
    };
    for star in 0..STARS {
        let draw = |k: u32| random(star * 4 + k, 651);
        // The stars are spread evenly over the upper half of the sphere.
        let (height, around) = (0.02 + 0.98 * draw(0), TAU * draw(1));
        let flat = (1.0 - height * height).sqrt();
        let toward = Vec3::new(flat * around.cos(), height, flat * around.sin());
        // Most stars are faint, a few are bright, and clouds hide them.
        let clear = (1.0 - 1.3 * cloud_cover(toward)).max(0.0);
        let bright = 0.1 + 0.9 * draw(2).powi(5);
        let tint = Vec3::new(0.85, 0.92, 1.0).lerp(Vec3::new(1.0, 0.86, 0.7), draw(3));
        disc(toward, 3, 0.0008 + 0.0007 * bright, tint * bright * clear);
    }
    let moon_color = Vec3::new(0.95, 0.93, 0.85);
    disc(TO_MOON.normalize(), MOON_CORNERS, 0.016, moon_color);
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::RENDER_WORLD,
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
    .with_inserted_indices(Indices::U32(indices))
}
