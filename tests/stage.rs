//! A Bevy app without a window that draws to images.

use std::io::Write;
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex};
use std::time::{Duration, Instant};

use bevy::app::{PluginGroupBuilder, PluginsState};
use bevy::camera::RenderTarget;
use bevy::core_pipeline::tonemapping::{DebandDither, Tonemapping};
use bevy::light::{DirectionalLightShadowMap, PointLightShadowMap};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::Msaa;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy_fieldlod::prelude::*;
use image::RgbaImage;

use crate::apps::{finish, shared_cache, windowless};

/// Default width and height of pictures, in pixels.
pub const SIZE_PX: u32 = 256;

/// A camera and the image that it draws to.
#[derive(Debug)]
pub struct Eye {
    /// The camera.
    pub entity: Entity,
    target: Handle<Image>,
}

/// An app that draws with a graphics adapter.
#[derive(Debug)]
pub struct Stage {
    /// The app.
    pub app: App,
}

/// Bevy's plugins without a window. Pipelines are compiled before they are first used.
#[must_use]
pub fn plugins() -> PluginGroupBuilder {
    windowless()
        .disable::<PipelinedRenderingPlugin>()
        .set(RenderPlugin {
            synchronous_pipeline_compilation: true,
            ..default()
        })
}

impl Stage {
    /// An empty scene. Without an adapter, prints a line and returns `None`.
    pub fn new() -> Option<Self> {
        let mut stage = Self::unfinished()?;
        stage.finish();
        Some(stage)
    }

    /// A stage where the GPU culls and one where the CPU culls; none without an adapter.
    pub fn with_each_culling() -> impl Iterator<Item = Self> {
        [true, false].into_iter().filter_map(|gpu_culling| {
            let mut stage = Self::new()?;
            stage.config().advanced.gpu_culling = gpu_culling;
            Some(stage)
        })
    }

    /// [`Stage::new`], to which plugins can be added before [`Stage::finish`].
    pub fn unfinished() -> Option<Self> {
        Self::unfinished_with(plugins())
    }

    /// [`Stage::unfinished`] with the assets of a folder.
    pub fn unfinished_in(folder: &Path) -> Option<Self> {
        Self::unfinished_with(plugins().set(AssetPlugin {
            file_path: folder.display().to_string(),
            ..default()
        }))
    }

    /// Adds the plugin. Stages of all tests share their bakes.
    fn unfinished_with(plugins: PluginGroupBuilder) -> Option<Self> {
        let mut stage = Self::stock_with(plugins)?;
        stage.app.add_plugins(FieldLodPlugin);
        stage.config().cache_folder = Some(shared_cache());
        Some(stage)
    }

    /// [`Stage::unfinished`] without the plugin.
    pub fn stock() -> Option<Self> {
        Self::stock_with(plugins())
    }

    /// [`Stage::stock`] with other plugins of Bevy.
    pub fn stock_with(plugins: PluginGroupBuilder) -> Option<Self> {
        if !has_adapter() {
            skip_without_adapter();
            return None;
        }
        let mut app = App::new();
        app.add_plugins(plugins);
        Some(Self { app })
    }

    /// Finishes the plugins.
    pub fn finish(&mut self) {
        while self.app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        finish(&mut self.app);
    }

    /// The settings of the plugin.
    pub fn config(&mut self) -> Mut<'_, FieldLodAppConfig> {
        self.app.world_mut().resource_mut()
    }

    /// Activates or deactivates a camera.
    pub fn set_active(&mut self, eye: &Eye, is_active: bool) {
        let mut camera = self.app.world_mut().get_mut::<Camera>(eye.entity).unwrap();
        camera.is_active = is_active;
    }

    /// Shrinks shadow maps: drawing Bevy's large maps takes a software adapter most of a frame.
    pub fn shrink_shadow_maps(&mut self) {
        self.app
            .insert_resource(DirectionalLightShadowMap { size: 512 })
            .insert_resource(PointLightShadowMap { size: 128 });
    }

    /// Spawns into the world.
    pub fn spawn(&mut self, bundle: impl Bundle) -> Entity {
        self.app.world_mut().spawn(bundle).id()
    }

    /// Inserts into an entity.
    pub fn insert(&mut self, entity: Entity, bundle: impl Bundle) {
        self.app.world_mut().entity_mut(entity).insert(bundle);
    }

    /// Adds an asset.
    pub fn add<A: Asset>(&mut self, asset: A) -> Handle<A> {
        self.app.world_mut().resource_mut::<Assets<A>>().add(asset)
    }

    /// Adds a camera that draws to its own picture, with this background.
    pub fn add_eye(&mut self, pose: Transform, background: Color, view: FieldLodCamera) -> Eye {
        self.add_eye_of_size(UVec2::splat(SIZE_PX), pose, background, view)
    }

    /// [`Stage::add_eye`] with another size.
    pub fn add_eye_of_size(
        &mut self,
        size_px: UVec2,
        pose: Transform,
        background: Color,
        view: FieldLodCamera,
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

    /// Draws frames until no entity waits for its levels, and one more.
    pub fn run_until_ready(&mut self) {
        self.app.update();
        self.app.update();
        self.run_until("levels are ready", |stage| stage.progress().waiting == 0);
        self.app.update();
    }

    /// Draws frames until `is_done`.
    ///
    /// # Panics
    /// After two minutes.
    pub fn run_until(&mut self, what: &str, mut is_done: impl FnMut(&mut Self) -> bool) {
        let deadline = Instant::now() + Duration::from_secs(120);
        while !is_done(self) {
            assert!(Instant::now() < deadline, "timed out: {what}");
            self.app.update();
        }
    }

    /// The number of entities in each state.
    pub fn progress(&self) -> FieldLodProgress {
        *self.app.world().resource()
    }

    /// Requests pictures of the next frame. They arrive some frames later.
    pub fn request(&mut self, eyes: &[&Eye]) -> Vec<Pending> {
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

    /// Draws a frame and requests its picture.
    pub fn draw(&mut self, eye: &Eye) -> Pending {
        let pending = self.request(&[eye]).remove(0);
        self.app.update();
        pending
    }

    /// Draws frames until `pending` has arrived.
    pub fn wait(&mut self, pending: &Pending) -> RgbaImage {
        let mut picture = None;
        self.run_until("a picture arrives", |_| {
            picture = pending.take();
            picture.is_some()
        });
        picture.expect("the loop ends with a picture")
    }

    /// Pictures of the same frame.
    pub fn shoot<const N: usize>(&mut self, eyes: [&Eye; N]) -> [RgbaImage; N] {
        let pending = self.request(&eyes);
        let pictures: Vec<RgbaImage> = pending.iter().map(|p| self.wait(p)).collect();
        pictures.try_into().unwrap()
    }

    /// The statistics of a camera's last frame.
    pub fn stats(&self, eye: &Eye) -> FieldLodViewStats {
        *self
            .app
            .world()
            .get::<FieldLodViewStats>(eye.entity)
            .unwrap()
    }
}

/// A picture that has not arrived yet.
#[derive(Debug, Default)]
pub struct Pending(Arc<Mutex<Option<RgbaImage>>>);

impl Pending {
    /// Takes the picture; `None` if it has not arrived or was taken.
    pub fn take(&self) -> Option<RgbaImage> {
        self.0.lock().unwrap().take()
    }
}

/// Prints that a test is skipped. With the environment variable `FIELDLOD_REQUIRE_ADAPTER`, the test fails instead.
pub fn skip_without_adapter() {
    assert!(
        std::env::var_os("FIELDLOD_REQUIRE_ADAPTER").is_none(),
        "no Vulkan adapter: install mesa-vulkan-drivers"
    );
    // The test harness hides the output of `eprintln!` when a test passes.
    let line = "SKIPPED: no Vulkan adapter; the Debian package mesa-vulkan-drivers has one\n";
    std::io::stderr().write_all(line.as_bytes()).unwrap();
}

fn has_adapter() -> bool {
    use bevy::render::settings::{Backends, WgpuSettings};
    /// Never dropped: when the last instance is dropped, the Vulkan loader is unloaded. NVIDIA's driver keeps addresses
    /// of the loader, and the next instance crashes.
    static INSTANCE: LazyLock<(wgpu::Instance, Backends)> = LazyLock::new(|| {
        let backends = WgpuSettings::default().backends.unwrap_or(Backends::VULKAN);
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        (instance, backends)
    });
    let (instance, backends) = &*INSTANCE;
    let adapters = bevy::tasks::block_on(instance.enumerate_adapters(*backends));
    !adapters.is_empty()
}
