//! The reference renderer: any cut of a hierarchy as a picture, on any adapter.
//!
//! [`Renderer`] draws without a window, with two texels per pixel along each axis, averaged in linear light. It
//! returns colours and coverage. The same adapter, software or not, always returns the same picture.
//!
//! # Shading
//! One light is fixed in the world and one is at the eye. Surfaces have smooth normals, Lambert shading and a highlight.
//! The albedo is the base colour times its texture and the vertex colour. Without a texture, a pattern of waves
//! is drawn, so that sliding texture coordinates are visible. Both sides of a triangle are drawn.
//!
//! # Out of scope
//! Materials, shadows, transparency, orthographic views.

mod camera;
mod gpu;
mod model;
mod picture;
mod target;
mod texture;

use thiserror::Error;

pub use gpu::Renderer;
pub use model::DrawnModel;
pub use picture::Picture;

/// Texels per pixel along each axis. More texels give smoother edges, but the time grows with their square.
pub const SUPERSAMPLING: u32 = 2;

/// The reason why a picture could not be drawn.
#[derive(Debug, Error)]
pub enum RenderError {
    /// There is no graphics adapter.
    #[error(
        "no graphics adapter found: on Debian or Ubuntu, install a software adapter with \
         `apt install mesa-vulkan-drivers`"
    )]
    NoAdapter,
    /// The adapter returned no device.
    #[error("could not open graphics adapter {adapter}: {source}")]
    NoDevice {
        /// The name of the adapter.
        adapter: String,
        /// The adapter's error.
        source: wgpu::RequestDeviceError,
    },
    /// The device was lost while drawing.
    #[error("graphics device lost: {0}")]
    Lost(String),
    /// Orthographic views are not supported.
    #[error("orthographic views are not supported")]
    Orthographic,
}
