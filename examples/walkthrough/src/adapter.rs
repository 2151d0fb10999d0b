//! The graphics adapter.

use bevy::render::RenderPlugin;
use bevy::render::settings::{PowerPreference, WgpuSettings};
use bevy::tasks::block_on;

/// The log line if there is no adapter.
pub(crate) const NOT_FOUND: &str = "could not find a graphics adapter; selecting levels without rendering (on Debian \
     and Ubuntu, the package mesa-vulkan-drivers provides a software adapter)";

/// The kind of adapter that renders the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Adapter {
    /// There is no adapter.
    None,
    /// A software adapter, such as Mesa's llvmpipe.
    Software,
    /// A GPU.
    Gpu,
}

/// Returns `true` if a window can be opened.
pub(crate) fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux") || ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set)
}

/// Requests an adapter as Bevy does. Bevy itself panics if there is none.
pub(crate) fn find() -> Adapter {
    let descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    let instance = wgpu::Instance::new(descriptor);
    let adapter = block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
        power_preference: PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    }));
    match adapter {
        Err(_) => Adapter::None,
        Ok(found) if found.get_info().device_type == wgpu::DeviceType::Cpu => Adapter::Software,
        Ok(_) => Adapter::Gpu,
    }
}

/// Bevy's render plugin. If `draws` is false, it creates no device.
pub(crate) fn render_plugin(draws: bool) -> RenderPlugin {
    let default = WgpuSettings::default();
    let settings = WgpuSettings {
        backends: default.backends.filter(|_| draws),
        ..default
    };
    RenderPlugin {
        render_creation: settings.into(),
        ..RenderPlugin::default()
    }
}
