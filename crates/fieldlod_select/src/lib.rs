//! Headless, deterministic level-of-detail selection: (hierarchy, view, settings) → cut.
//!
//! A game server, a test or an engine other than Bevy calls [`select`] once per instance and view
//! and draws the units of the [`Cut`]. Nothing here needs a GPU or a window.
//!
//! ```
//! use camera_field::Camera;
//! use fieldlod_hierarchy::fixtures;
//! use fieldlod_select::{Cut, LodSettings, View, select};
//! use glam::{Affine3A, Mat4, Vec2, Vec3};
//!
//! let hierarchy = fixtures::two_level_strip(); // four triangles, or two with an error of 0.1
//! let projection = Mat4::perspective_infinite_reverse_rh(1.0, 16.0 / 9.0, 0.1);
//! let camera = Camera::from_projection(&projection, Vec2::new(1920.0, 1080.0)).unwrap();
//! let settings = LodSettings { error_px: 1.0, ..LodSettings::default() };
//! let mut triangles_from = |distance: f32| {
//!     let world_from_view = Affine3A::from_translation(Vec3::new(1.0, 0.5, distance));
//!     let view = View::new(camera, &world_from_view);
//!     let mut cut = Cut::default();
//!     select(&hierarchy, &Affine3A::IDENTITY, &view, &settings, &mut cut);
//!     cut.triangle_count()
//! };
//! assert_eq!(triangles_from(5.0), 4);
//! assert_eq!(triangles_from(500.0), 2);
//! ```
//!
//! # Conventions
//! World and local space are right-handed; a view looks along its −Z with +Y up, as in Bevy and
//! OpenGL. Pixels are physical pixels of the view's target.
//!
//! # Determinism
//! Only IEEE-exact operations (+ − × ÷ √) are used, in scalar order: the same input gives the same
//! cut in debug and release, on every machine. A lint forbids the others.
//!
//! # Out of scope
//! Occlusion; morphing between levels; skinned meshes.

mod budget;
mod criterion;
mod cut;
mod decide;
mod hold;
mod kernel;
pub mod naive;
mod scene;
mod selector;
mod settings;
mod stretch;
mod table;
mod tree;
mod view;

pub use criterion::{promised_error_px, screen_displacement_px, screen_error_px};
pub use cut::{Cut, select, select_with};
pub use decide::refine;
pub use scene::{InstanceId, MeshId, Scene};
pub use selector::{Change, Selector, Statistics};
pub use settings::{LodSettings, Promise};
pub use table::GroupTable;
pub use view::{InstanceView, View};
