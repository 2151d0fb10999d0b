//! The reference renderer: any cut of a hierarchy as a picture, on whatever adapter there is.
//!
//! [`Renderer`] draws without a window, with two texels to a pixel along each axis, averaged in linear
//! light. The same picture comes out each time on the same adapter, software or not. [`Renderer::draw`]
//! gives colours and coverage, [`Renderer::draw_units`] the unit of every texel, too.
//!
//! # Shading
//! A light fixed in the world and one at the eye, Lambert with a highlight, smooth normals; a pattern
//! of waves on the texture coordinates in place of a texture, so that a texture that slides shows,
//! times the colours of vertices.
//! Both sides of a triangle are drawn. [`Renderer::draw_scene`] draws many models with shadows of the
//! light that is fixed; the others draw one model at the origin, without shadows.
//!
//! Units that are [cards](fieldlod_hierarchy::Cards) show their picture, in the sizes that
//! [`CardPicture::mips`](fieldlod_hierarchy::CardPicture::mips) makes of it, mixed as games do it (trilinear): where it
//! is half opaque or more, its colours, as plain as a mesh without texture coordinates is, and its normals. Shadows are
//! cut out likewise.
//!
//! # Out of scope
//! Materials, so that cards of a textured mesh are not like the mesh here; transparency; orthographic views.

mod camera;
mod cards;
mod gpu;
mod model;
mod picture;
mod pipelines;
mod target;

use thiserror::Error;

pub use gpu::Renderer;
pub use model::{DrawnModel, PlacedUnits};
pub use picture::{Picture, UnitMap};

/// Texels to a pixel along each axis.
pub const SUPERSAMPLING: u32 = 2;

/// Why nothing can be drawn.
#[derive(Debug, Error)]
pub enum RenderError {
    /// There is no graphics adapter at all.
    #[error(
        "no graphics adapter: on Debian or Ubuntu, the package mesa-vulkan-drivers has one in software"
    )]
    NoAdapter,
    /// The adapter gives no device.
    #[error("the graphics adapter {adapter} refuses: {source}")]
    NoDevice {
        /// Its name.
        adapter: String,
        /// The adapter's reason.
        source: wgpu::RequestDeviceError,
    },
    /// The adapter stopped while it drew.
    #[error("the graphics adapter stopped: {0}")]
    Lost(String),
    /// Only perspective views can be drawn.
    #[error("orthographic views cannot be drawn")]
    Orthographic,
}
