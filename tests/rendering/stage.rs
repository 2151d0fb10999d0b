//! A Bevy app without a window that draws to images.

use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bevy::app::PluginsState;
use bevy::asset::RenderAssetUsages;
use bevy::camera::RenderTarget;
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::log::LogPlugin;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::Msaa;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_fieldlod::prelude::*;
use fieldlod_bake::SourceMesh;
use image::RgbaImage;

/// Width and height of pictures, in pixels, unless said otherwise.
pub(crate) const SIZE_PX: u32 = 256;

/// A camera and the image that it draws to.
pub(crate) struct Eye {
    pub(crate) entity: Entity,
    target: Handle<Image>,
}

/// An app with the plugin, and no adapter but a graphics one.
pub(crate) struct Stage {
    pub(crate) app: App,
}

impl Stage {
    /// An empty scene; `None`, said loudly, without an adapter.
    pub(crate) fn new() -> Option<Self> {
        let mut stage = Self::unfinished()?;
        stage.finish();
        Some(stage)
    }

    /// As [`Stage::new`], but more plugins may be added before [`Stage::finish`].
    pub(crate) fn unfinished() -> Option<Self> {
        if !has_adapter() {
            assert!(
                std::env::var_os("FIELDLOD_REQUIRE_ADAPTER").is_none(),
                "no Vulkan adapter: install mesa-vulkan-drivers"
            );
            // Not `eprintln!`, which the test harness keeps to itself when a test passes.
            let line =
                "SKIPPED: no Vulkan adapter; the Debian package mesa-vulkan-drivers has one\n";
            std::io::stderr().write_all(line.as_bytes()).unwrap();
            return None;
        }
        let mut app = App::new();
        let plugins = DefaultPlugins
            .build()
            .disable::<WinitPlugin>()
            .disable::<LogPlugin>()
            .disable::<PipelinedRenderingPlugin>()
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            })
            .set(RenderPlugin {
                synchronous_pipeline_compilation: true,
                ..default()
            });
        app.add_plugins((plugins, FieldLodPlugin));
        Some(Self { app })
    }

    /// Lets the plugins do what they do once all are there.
    pub(crate) fn finish(&mut self) {
        while self.app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        self.app.finish();
        self.app.cleanup();
    }

    /// Spawns into the world.
    pub(crate) fn spawn(&mut self, bundle: impl Bundle) -> Entity {
        self.app.world_mut().spawn(bundle).id()
    }

    /// Adds an asset.
    pub(crate) fn add<A: Asset>(&mut self, asset: A) -> Handle<A> {
        self.app.world_mut().resource_mut::<Assets<A>>().add(asset)
    }

    /// Adds a camera that draws a picture of its own on a background of `background`.
    pub(crate) fn add_eye(&mut self, pose: Transform, background: Color, view: LodView) -> Eye {
        self.add_eye_of_size(UVec2::splat(SIZE_PX), pose, background, view)
    }

    /// As [`Stage::add_eye`], for pictures of another size.
    pub(crate) fn add_eye_of_size(
        &mut self,
        size_px: UVec2,
        pose: Transform,
        background: Color,
        view: LodView,
    ) -> Eye {
        let format = TextureFormat::Rgba8UnormSrgb;
        let target = self.add(Image::new_target_texture(
            size_px.x, size_px.y, format, None,
        ));
        let entity = self.spawn((
            Camera3d::default(),
            Camera {
                clear_color: ClearColorConfig::Custom(background),
                ..default()
            },
            RenderTarget::Image(target.clone().into()),
            Tonemapping::None,
            DebandDither::Disabled,
            Msaa::Off,
            pose,
            view,
        ));
        Eye { entity, target }
    }

    /// Draws frames until no mesh waits for its hierarchy, and one more.
    pub(crate) fn settle(&mut self) {
        let deadline = Instant::now() + Duration::from_secs(120);
        self.app.update();
        self.app.update();
        while self.app.world().resource::<LodStatus>().waiting > 0 {
            assert!(Instant::now() < deadline, "hierarchies are not ready");
            self.app.update();
        }
        self.app.update();
    }

    /// Asks for pictures of the next frame. They arrive some frames later.
    pub(crate) fn request(&mut self, eyes: &[&Eye]) -> Vec<Pending> {
        eyes.iter()
            .map(|eye| {
                let pending = Pending::default();
                let slot = pending.0.clone();
                self.app
                    .world_mut()
                    .spawn(Screenshot::image(eye.target.clone()))
                    .observe(move |captured: On<ScreenshotCaptured>| {
                        let picture = captured.image.clone().try_into_dynamic();
                        *slot.lock().unwrap() = Some(picture.unwrap().into_rgba8());
                    });
                pending
            })
            .collect()
    }

    /// Draws frames until `pending` has arrived.
    pub(crate) fn wait(&mut self, pending: &Pending) -> RgbaImage {
        let deadline = Instant::now() + Duration::from_secs(60);
        loop {
            if let Some(picture) = pending.0.lock().unwrap().take() {
                return picture;
            }
            assert!(Instant::now() < deadline, "no picture arrives");
            self.app.update();
        }
    }

    /// Pictures of one and the same frame.
    pub(crate) fn shoot<const N: usize>(&mut self, eyes: [&Eye; N]) -> [RgbaImage; N] {
        let pending = self.request(&eyes);
        let pictures: Vec<RgbaImage> = pending.iter().map(|p| self.wait(p)).collect();
        pictures.try_into().unwrap()
    }

    /// The numbers of a camera's last frame.
    pub(crate) fn stats(&self, eye: &Eye) -> LodViewStats {
        *self.app.world().get::<LodViewStats>(eye.entity).unwrap()
    }
}

/// A picture that has not arrived yet.
#[derive(Default)]
pub(crate) struct Pending(Arc<Mutex<Option<RgbaImage>>>);

fn has_adapter() -> bool {
    use bevy::render::settings::{Backends, WgpuSettings};
    let backends = WgpuSettings::default().backends.unwrap_or(Backends::VULKAN);
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapters = bevy::tasks::block_on(instance.enumerate_adapters(backends));
    !adapters.is_empty()
}

/// A fixture as a Bevy mesh.
pub(crate) fn bevy_mesh(source: &SourceMesh) -> Mesh {
    let to_arrays =
        |values: &[glam::Vec3]| values.iter().map(glam::Vec3::to_array).collect::<Vec<_>>();
    let usage = RenderAssetUsages::default();
    Mesh::new(PrimitiveTopology::TriangleList, usage)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, to_arrays(&source.positions))
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, to_arrays(&source.normals))
        .with_inserted_indices(Indices::U32(source.indices.clone()))
}
