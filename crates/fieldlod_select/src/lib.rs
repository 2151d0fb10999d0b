//! Headless, deterministic level-of-detail selection: (hierarchy, view, settings) → cut.
//!
//! A [hierarchy](fieldlod_hierarchy::Hierarchy) comes from a `.fieldlod` file or from `fieldlod_bake`. Its *groups* of
//! triangles are simplified step by step. The triangles that one group produces and another simplifies are a *unit*,
//! which is drawn as a whole.
//!
//! A game server, a test or an engine other than Bevy calls [`select`] once per instance and view,
//! and draws the units of the [`Cut`]. A [`Scene`] and one [`Selector`] per view give the same cuts
//! at a fraction of the cost. Selection needs no GPU and no window.
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
//! let settings = LodSettings::with_error_px(1.0);
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
//! # Two thresholds
//! [`LodSettings::error_px`] gives the best picture for its triangles: it is like a root mean square,
//! and single points may be off by more. [`LodSettings::displacement_px`] bounds every displacement on
//! screen; the tests of `fieldlod_lab` measure it. Set either or both.
//!
//! # Weights
//! [`Selector::select_weighed`] multiplies the screen-space errors of each instance in a view by a weight. The crate
//! `fieldlod_flux` weighs instances by how much of each is visible.
//!
//! # Speed
//! If the scene, the view, the settings or weights have changed, a [`Selector`] tests all instances, eight at a time:
//! 1. One pass over the spheres of all instances skips instances that certainly keep their cuts. They are outside the
//!    view, or within the limits of their level. A [`Scene`] orders instances along a Morton curve, so that one test of
//!    a sphere around 64 neighbours often skips all of them. `benches/props` measures up to a million instances.
//! 2. The other instances are near. A mesh that is drawn as a whole
//!    ([`Hierarchy::whole_mesh_levels`](fieldlod_hierarchy::Hierarchy::whole_mesh_levels)) gets its level from bounds
//!    over its sphere. If the bounds are not decisive, the criterion decides, eight levels at once. It also
//!    decides the groups of other meshes, except groups in bounds of 64 or eight that are below the threshold.
//!
//! In a first frame, [`Selector::changes`] lists every drawn instance. `benches/selection` compares the test of groups
//! with the sphere test of clusterlod.
//!
//! # Determinism
//! Only IEEE-exact operations (+ − × ÷ √) are used, and eight lanes compute the same as one scalar, in the same order.
//! The same input gives the same cut in debug and release, on every machine. A lint forbids other operations, and
//! `tests/determinism.rs` compares the hash of a walk.
//!
//! # Features
//! - `bevy_reflect`, `bevy_reflect_0_20`: reflection of the settings, for Bevy 0.19 and 0.20.
//! - `glam_0_33`: the vectors of Bevy 0.20.
//! - `test-support`: specifications and single steps, for tests and benches.
//!
//! # Out of scope
//! Morphing between levels; skinned meshes; culling.

#[cfg(feature = "bevy_reflect_0_20")]
extern crate bevy_reflect_0_20 as bevy_reflect;
#[cfg(feature = "glam_0_33")]
extern crate glam_0_33 as glam;

mod criterion;
mod cut;
#[doc(hidden)]
pub mod lanes;
#[cfg(any(test, feature = "test-support"))]
pub mod naive;
mod scene;
mod select;
mod selector;
mod settings;
mod view;

pub use criterion::group_error_px;
#[cfg(any(test, feature = "test-support"))]
pub use criterion::weighed_error_px;
pub use cut::{Cut, select, select_with};
pub use scene::table::GroupTable;
pub use scene::{InstanceId, MeshId, PlacedInstance, Scene};
pub use select::changes::Change;
pub use select::cuts::Statistics;
#[cfg(any(test, feature = "test-support"))]
pub use select::decision::refine;
pub use select::demand::GroupDemand;
pub use select::weights::Weights;
pub use selector::Selector;
pub use settings::{AdvancedSettings, LodSettings, Offscreen};
pub use view::shadow_lights::ShadowLight;
pub use view::{InstanceView, View};
