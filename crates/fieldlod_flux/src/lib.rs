//! Visible flux: weighs the errors of instances by how much of each is visible.
//!
//! The flux of the camera-sampling field is over the *visible* surface (P.-H. Lin and T.-Y. Lee, eq. 8). [`VisibleFlux`]
//! draws instances into a small [depth image](DepthImage) on the CPU, and tests points of each instance against it. The
//! screen-space error of an instance with the visible share `o` counts `√o` times. In the walkthrough, at equal pictures
//! and with exact shares, a weight of `√o` drew 0.44 of the triangles, and a weight of `o` drew 0.48.
//!
//! An instance that appears is refined in the same frame; an instance that disappears is coarsened some frames later.
//! Nothing is culled. Displacements are not weighed, since a share is an estimate. An instance that is drawn in units and
//! has half of the image's width, for example the ground below the camera, has no share: it counts in full. Points
//! outside the image count as hidden, also within [`offscreen_margin`](fieldlod_select::AdvancedSettings::offscreen_margin);
//! [`least_share`](FluxSettings::least_share) bounds the effect on casters of shadows.
//!
//! Hasselgren, Andersson and Akenine-Möller, "Masked Software Occlusion Culling" (2016), draw a similar image to cull.
//!
//! ```
//! # use std::sync::Arc;
//! # use camera_field::Camera;
//! # use fieldlod_hierarchy::fixtures;
//! # use fieldlod_select::{LodSettings, Scene, Selector, View};
//! # use glam::{Affine3A, Mat4, Vec2, Vec3};
//! use fieldlod_flux::{Occluder, Occluders, VisibleFlux};
//!
//! let strip = fixtures::two_level_strip();
//! let mut scene = Scene::default();
//! let mesh = scene.add_mesh(&strip);
//! let instance = scene.add_instance(mesh, Affine3A::from_translation(Vec3::Z * -5.0), 1.0);
//! scene.update();
//! let mut occluders = Occluders::default();
//! occluders.set_mesh(mesh, Some(Arc::new(Occluder::new(&strip))));
//!
//! # let projection = Mat4::perspective_infinite_reverse_rh(1.0, 16.0 / 9.0, 0.1);
//! # let camera = Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap();
//! # let view = View::new(camera, &Affine3A::IDENTITY);
//! // One of each for each view.
//! let (mut flux, mut selector) = (VisibleFlux::default(), Selector::default());
//! let mut weights = flux.look(&scene, &view, &occluders);
//! selector.select_weighed(&scene, &view, &LodSettings::default(), &mut weights);
//! ```
//!
//! # Determinism
//! As in `fieldlod_select`, only IEEE-exact operations are used, and eight texels at once have the same bits as one at a
//! time.

#[cfg(feature = "glam_0_33")]
extern crate glam_0_33 as glam;

mod choice;
mod clip;
mod depth_image;
mod held_share;
mod image_plane;
mod occluder;
mod screen_triangle;
mod shares;
mod surface_samples;
#[cfg(test)]
mod tests;
mod texels;
mod visible_flux;

pub use depth_image::DepthImage;
pub use occluder::{Occluder, Occluders};
pub use visible_flux::{FluxSettings, FluxWeights, VisibleFlux};
