//! Whether anything can draw here at all.

use bevy::tasks::block_on;

/// Asks for a graphics adapter the way that Bevy will, which panics without one.
pub(crate) fn is_available() -> bool {
    let instance =
        wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).is_ok()
}
