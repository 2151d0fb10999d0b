//! The graphics adapter that will draw.

use bevy::render::RenderPlugin;
use bevy::render::settings::{PowerPreference, WgpuSettings};
use bevy::tasks::block_on;

/// What to say where there is no adapter.
pub(crate) const NOT_FOUND: &str = "no Vulkan adapter found, so this run only selects; on Debian and Ubuntu the package \
     mesa-vulkan-drivers provides a software one";

/// What draws the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Adapter {
    /// Nothing.
    None,
    /// The processor, by a software adapter like Mesa's llvmpipe.
    Software,
    /// A GPU.
    Gpu,
}

/// Whether a window can be opened.
pub(crate) fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux") || ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set)
}

/// Starts the program anew with a folder for the sockets of Wayland displays, if none is named:
/// Mesa's libraries look there even where there is no display, and would print that it is missing.
pub(crate) fn provide_runtime_folder() {
    #[cfg(target_os = "linux")]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none()
        && let Ok(program) = std::env::current_exe()
    {
        use std::os::unix::process::CommandExt;
        let mut anew = std::process::Command::new(program);
        anew.args(std::env::args_os().skip(1));
        anew.env("XDG_RUNTIME_DIR", std::env::temp_dir());
        // It comes back only if it fails, and then this process goes on.
        let _fault = anew.exec();
    }
}

/// Asks for an adapter as Bevy will, which panics without one.
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

/// Bevy's renderer, or one that draws nothing.
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
