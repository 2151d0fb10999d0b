//! Headless, deterministic level-of-detail selection: (hierarchy, view, settings) → cut.
//!
//! A game server, a test or an engine other than Bevy calls [`select`] once per instance and view
//! and draws the units of the [`Cut`]; or it keeps a [`Scene`] and one [`Selector`] per view, which
//! give the same cuts at a fraction of the cost. Nothing here needs a GPU or a window.
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
//! screen; `tests/guarantee.rs` measures it, beside clusterlod's test. Either may be given, or both.
//!
//! # What hides what
//! [`LodSettings::visible_flux`] counts errors by the share of each instance, and of each piece of a large
//! one, that nothing hides. An [`OcclusionBuffer`] knows it, which a [`Selector`] draws when the view or the
//! scene has changed. What comes out of hiding is refined in the same frame, what goes into it is
//! coarsened some frames later. A displacement is left out only where something is hidden for certain:
//! `tests/certain_hiding.rs` shows that no pixel changes by that.
//!
//! # Speed
//! A [`Selector`] asks the full criterion only where nothing cheaper knows its answer. Each of these
//! steps answers only where it is certain that the criterion would answer the same:
//! 1. A tree over the instances: a frame visits only those nodes whose answer the camera's moves
//!    since the last visit could have changed.
//! 2. Nodes and instances that are wholly outside the view, or far enough, are answered at once.
//! 3. Within a mesh, 64 groups are decided by one sphere around them; what is left, eight groups by a
//!    bound that knows depth and facing; then single groups by the same bound, and by an interval
//!    of the criterion that can tell both "refine" and "do not". The few that remain go to the
//!    criterion. What each of these is worth is in `benches/RECORD.md`.
//! 4. The same interval, taken over all places and turns that the camera can reach within a distance,
//!    tells for how long the decisions on 64 groups stay valid: a walking camera decides few of them
//!    anew.
//! 5. Of a mesh that is drawn as a whole ([`Hierarchy::whole_mesh_levels`](fieldlod_hierarchy::Hierarchy::whole_mesh_levels)) an instance keeps its level and for how far the
//!    camera may move and turn with it, sought so that it is about as far as it can be. `benches/props.rs` walks
//!    through a million of them.
//!
//! A first frame lists every instance, since whoever draws them has to hear of each: its time is
//! linear in their number, at 3 to 4 ns for each that is outside the view or far away. Later frames
//! depend on what is near and on what changes alone.
//!
//! `benches/selection` compares all this with the sphere test of clusterlod, in one run.
//!
//! # Determinism
//! Only IEEE-exact operations (+ − × ÷ √) are used, and eight lanes compute what one scalar would, in
//! the same order: the same input gives the same cut in debug and release, on every machine. A lint forbids other operations, and `tests/determinism.rs` holds the hash of a walk.
//!
//! # Out of scope
//! Morphing between levels; skinned meshes; culling, but of what is smaller than
//! [`LodSettings::cull_below_px`].

mod bits;
mod boxes;
mod budget;
mod criterion;
mod cut;
mod decide;
mod error_bounds;
mod error_scale;
mod lane;
pub mod naive;
mod object_test;
mod occlusion;
mod scene;
mod selector;
mod settings;
mod shadow_lights;
mod shares;
mod sides;
mod size_test;
mod stretch;
#[cfg(test)]
#[path = "../tests/common/synthetic.rs"]
mod synthetic;
mod table;
mod tree;
mod validity;
mod view;
mod view_parts;
mod zoom;

pub use criterion::{group_error_px, screen_displacement_px, screen_error_px, visible_error_px};
pub use cut::{Cut, select, select_with};
pub use decide::refine;
pub use occlusion::OcclusionBuffer;
pub use scene::{InstanceId, MeshId, Scene};
pub use selector::{Change, GroupDemand, Selector, Statistics};
pub use settings::{LodSettings, Offscreen, VisibleFlux};
pub use shadow_lights::ShadowLight;
pub use table::GroupTable;
pub use tree::Tally;
pub use view::{InstanceView, View};
