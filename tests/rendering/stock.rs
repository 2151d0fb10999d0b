//! Rendering features of Bevy work with levels of detail.

use bevy::anti_alias::taa::TemporalAntiAliasing;
use bevy::asset::uuid_handle;
use bevy::color::palettes::css;
use bevy::core_pipeline::prepass::{
    DeferredPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass,
};
use bevy::material::OpaqueRendererMethod;
use bevy::pbr::{ExtendedMaterial, MaterialExtension, MaterialPlugin};
use bevy::prelude::*;
use bevy::render::occlusion_culling::OcclusionCulling;
use bevy::render::render_resource::AsBindGroup;
use bevy::shader::ShaderRef;
use bevy_fieldlod::prelude::*;
use fieldlod_tests::apps::bevy_mesh;
use fieldlod_tests::stage::{Eye, Stage};
use image::RgbaImage;

use crate::picture::{count, count_beyond, difference};

/// A custom material: stripes by height.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, Default)]
struct Stripes {}

const STRIPES: Handle<Shader> = uuid_handle!("6d1d1e6e-3f0b-4a52-9f0e-0c9d7f3b8a11");

const STRIPES_WGSL: &str = "
@fragment
fn fragment(@location(0) world_position: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(0.5 + 0.5 * sign(sin(world_position.y * 9.0)), 0.4, 0.2, 1.0);
}";

impl Material for Stripes {
    fn fragment_shader() -> ShaderRef {
        STRIPES.into()
    }
}

/// An extension without any effect.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug, Default)]
struct Plain {}

impl MaterialExtension for Plain {}

type Extended = ExtendedMaterial<StandardMaterial, Plain>;

/// A stage with a row of props and a row of large rocks. Each column has another material. `third` is the method of the
/// material of column 3: Bevy panics if a camera has a prepass without deferred rendering and a material is deferred.
fn stage_with_rows(third: OpaqueRendererMethod) -> Option<Stage> {
    let mut stage = Stage::unfinished()?;
    stage.app.add_plugins((
        MaterialPlugin::<Stripes>::default(),
        MaterialPlugin::<Extended>::default(),
        FieldLodVisibleFluxPlugin,
    ));
    stage.finish();
    let mut shaders = stage.app.world_mut().resource_mut::<Assets<Shader>>();
    let shader = Shader::from_wgsl(STRIPES_WGSL, "stripes.wgsl");
    shaders.insert(STRIPES.id(), shader).unwrap();
    let stone = StandardMaterial::from(Color::srgb(0.6, 0.5, 0.4));
    let of_kind = |alpha_mode, opaque_render_method| StandardMaterial {
        alpha_mode,
        opaque_render_method,
        base_color: Color::srgba(0.4, 0.6, 0.5, 0.7),
        ..default()
    };
    let forward = OpaqueRendererMethod::Forward;
    let standard = [
        stone.clone(),
        of_kind(AlphaMode::Mask(0.5), forward),
        of_kind(AlphaMode::Blend, forward),
        of_kind(AlphaMode::Opaque, third),
    ];
    for (column, material) in standard.into_iter().enumerate() {
        let material = stage.add(material);
        add_column(&mut stage, column, MeshMaterial3d(material));
    }
    let stripes = stage.add(Stripes {});
    add_column(&mut stage, 4, MeshMaterial3d(stripes));
    let extended = stage.add(Extended {
        base: stone,
        extension: Plain {},
    });
    add_column(&mut stage, 5, MeshMaterial3d(extended));
    stage.spawn((
        DirectionalLight::default(),
        Transform::default().looking_to(Vec3::new(-0.5, -0.8, -0.6), Vec3::Y),
    ));
    Some(stage)
}

fn add_column(stage: &mut Stage, column: usize, material: impl Bundle + Clone) {
    for (row, subdivisions) in [(0u8, 4), (1, 5)] {
        let mesh = stage.add(bevy_mesh(&fieldlod_tests::rock(subdivisions, 7)));
        let across = column as f32 * 2.2 - 5.5;
        let place = Transform::from_xyz(across, f32::from(row) * 2.4 - 1.2, 0.0);
        let place = place.with_rotation(Quat::from_rotation_y(across));
        stage.spawn((Mesh3d(mesh), material.clone(), AutoLod::default(), place));
    }
}

fn add_eye(stage: &mut Stage, technique: impl Bundle) -> Eye {
    let pose = Transform::from_xyz(0.0, 0.0, 16.0).looking_at(Vec3::ZERO, Vec3::Y);
    let view = FieldLodCamera::with_error_px(0.65);
    let eye = stage.add_eye(pose, css::SKY_BLUE.into(), view);
    stage.insert(eye.entity, technique);
    eye
}

fn set_full_detail(stage: &mut Stage, eye: &Eye, full_detail: bool) {
    let world = stage.app.world_mut();
    let mut settings = world.get_mut::<FieldLodCamera>(eye.entity).unwrap();
    settings.forced_level = full_detail.then_some(0);
    stage.app.update();
}

/// The number of pixels that do not show the background.
fn covered(picture: &RgbaImage) -> usize {
    let background = *picture.get_pixel(0, 0);
    let pixels = picture.pixels();
    pixels
        .filter(|&&pixel| crate::picture::differs(pixel, background))
        .count()
}

/// At 0.65 px, shades differ a little. A missing or unlit rock is about a twelfth of the covered pixels.
fn assert_alike(full: &RgbaImage, levels: &RgbaImage) {
    let differ = count_beyond(full, levels, 64);
    assert!(
        differ * 50 < covered(full),
        "{differ} of {} pixels differ",
        covered(full)
    );
}

/// Checks that few pixels differ between full detail and levels, drawn by `technique`.
fn draws_alike(stage: &mut Stage, technique: impl Bundle) {
    let eye = add_eye(stage, technique);
    stage.run_until_ready();
    set_full_detail(stage, &eye, true);
    let [full] = stage.shoot([&eye]);
    assert!(covered(&full) > 9_000, "{} pixels covered", covered(&full));
    let stats = stage.stats(&eye);
    assert_eq!(stats.triangles_drawn, stats.triangles_full);
    set_full_detail(stage, &eye, false);
    let [levels] = stage.shoot([&eye]);
    let stats = stage.stats(&eye);
    assert!(
        stats.triangles_drawn * 3 < stats.triangles_full,
        "{stats:?}"
    );
    assert!(
        count(&difference(&full, &levels)) > 0,
        "the levels are the source"
    );
    assert_alike(&full, &levels);
    let each_way = covered(&full).abs_diff(covered(&levels));
    assert!(
        each_way * 100 < covered(&full),
        "{each_way} pixels appear or vanish"
    );
    stage.app.world_mut().despawn(eye.entity);
}

#[test]
fn forward_rendering_draws_levels_in_every_material() {
    let Some(mut stage) = stage_with_rows(OpaqueRendererMethod::Forward) else {
        return;
    };
    draws_alike(&mut stage, ());
    draws_alike(&mut stage, Msaa::Sample4);
    let prepass = (DepthPrepass, NormalPrepass, MotionVectorPrepass);
    draws_alike(&mut stage, prepass);
}

#[test]
fn deferred_rendering_draws_levels_in_every_material() {
    let Some(mut stage) = stage_with_rows(OpaqueRendererMethod::Deferred) else {
        return;
    };
    draws_alike(&mut stage, (DepthPrepass, DeferredPrepass));
}

/// The vertex shader of the example `vegetation` serves all passes. Bevy 0.20 has another shader language.
#[cfg(not(bevy_0_20))]
#[test]
fn wind_draws_levels_in_each_prepass() {
    use fieldlod_tests::scenes::{wind_material, wind_plugin};
    let Some(mut stage) = Stage::unfinished() else {
        return;
    };
    stage.app.add_plugins(wind_plugin);
    stage.finish();
    let world = stage.app.world_mut();
    // The wind stands still, so that pictures can be compared.
    world.resource_mut::<Time<Virtual>>().pause();
    let bark = wind_material(world, false);
    (0..6).for_each(|column| add_column(&mut stage, column, MeshMaterial3d(bark.clone())));
    draws_alike(&mut stage, ());
    draws_alike(
        &mut stage,
        (DepthPrepass, NormalPrepass, MotionVectorPrepass),
    );
}

/// Bevy's occlusion culling skips rocks behind a wall, and visible flux draws them coarser. The picture equals that
/// of visible flux alone.
#[test]
fn occlusion_culling_with_visible_flux_is_invisible() {
    let Some(mut stage) = stage_with_rows(OpaqueRendererMethod::Forward) else {
        return;
    };
    let wall = stage.add(bevy_mesh(&fieldlod_tests::rock(5, 3)));
    let stone = stage.add(StandardMaterial::from(Color::srgb(0.5, 0.5, 0.6)));
    let place = Transform::from_xyz(-2.5, 0.0, 5.0).with_scale(Vec3::new(2.4, 2.4, 0.5));
    stage.spawn((
        Mesh3d(wall),
        MeshMaterial3d(stone),
        AutoLod::default(),
        place,
    ));
    let [alone, beside] = [(); 2].map(|()| {
        let eye = add_eye(&mut stage, DepthPrepass);
        stage.insert(eye.entity, FieldLodVisibleFlux);
        eye
    });
    stage.insert(beside.entity, OcclusionCulling);
    stage.run_until_ready();
    let frames = [0u8, 1, 2, 3, 4, 5].map(|step| {
        for eye in [&alone, &beside] {
            let at = Vec3::new(f32::from(step) * 0.8 - 2.0, 0.3, 16.0);
            let pose = Transform::from_translation(at).looking_to(Vec3::NEG_Z, Vec3::Y);
            stage.insert(eye.entity, pose);
        }
        stage.app.update();
        let frames = stage.request(&[&alone, &beside]);
        stage.app.update();
        frames
    });
    for (step, frames) in frames.iter().enumerate() {
        let pictures: Vec<_> = frames.iter().map(|frame| stage.wait(frame)).collect();
        assert!(covered(&pictures[0]) > 9_000);
        let differing = count(&difference(&pictures[0], &pictures[1]));
        assert_eq!(differing, 0, "step {step}");
    }
}

/// Frames of a flight.
const FRAMES: u8 = 24;

/// The last picture, with temporal anti-aliasing, of rocks that move sideways and nearer, and the number of times that
/// the triangle count changed, plus one.
fn after_a_flight(stage: &mut Stage, eye: &Eye, full_detail: bool) -> (RgbaImage, usize) {
    set_full_detail(stage, eye, full_detail);
    let move_rocks = |stage: &mut Stage, frames: f32| {
        let world = stage.app.world_mut();
        let mut rocks = world.query_filtered::<&mut Transform, With<AutoLod>>();
        for mut rock in rocks.iter_mut(world) {
            rock.translation += Vec3::new(0.02, 0.0, 0.2) * frames;
        }
        stage.app.update();
    };
    let mut counts = Vec::new();
    for _ in 0..FRAMES {
        move_rocks(stage, 1.0);
        counts.push(stage.stats(eye).triangles_drawn);
    }
    let [picture] = stage.shoot([eye]);
    move_rocks(stage, -f32::from(FRAMES));
    counts.dedup();
    (picture, counts.len())
}

#[test]
fn taa_leaves_no_ghosts() {
    let Some(mut stage) = stage_with_rows(OpaqueRendererMethod::Forward) else {
        return;
    };
    let eye = add_eye(&mut stage, TemporalAntiAliasing::default());
    stage.run_until_ready();
    let [(full, _), (levels, changes)] =
        [true, false].map(|full_detail| after_a_flight(&mut stage, &eye, full_detail));
    assert!(changes > 8, "the levels hardly changed: {changes} counts");
    assert_alike(&full, &levels);
}
