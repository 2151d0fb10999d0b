//! The camera-sampling field: how densely a camera samples every point of space, and from
//! which direction.
//!
//! Ping-Hsien Lin and Tong-Yee Lee, "Camera-Sampling Field and Its Applications",
//! IEEE Transactions on Visualization and Computer Graphics, 2004. Equation and section numbers
//! throughout this crate are theirs.
//!
//! The samples of a pinhole camera are spaced evenly on its image. In the scene they are sparser at
//! larger distances and denser towards the edges of the view. The field measures both. Its length
//! is samples per unit area, and its direction points to the camera. Its product with the normal of
//! a surface is samples per unit area of that surface.
//!
//! ```
//! use camera_field::{Camera, Intrinsics, mip_level};
//! use glam::{Vec2, Vec3};
//!
//! let camera = Intrinsics::centered(935.0, Vec2::new(1920.0, 1080.0));
//! let (center, normal) = (Vec3::new(4.0, 1.0, 20.0), Vec3::NEG_Z);
//! let mip = mip_level(camera.projection_factor(center, normal), 128.0 * 128.0, 0.0);
//! // The coarsest level with an error of at most a pixel on the visible part of a sphere.
//! let px_per_unit = Camera::Perspective(camera).pixel_scale_over_sphere(center, 1.5);
//! let errors = [0.0, 0.004, 0.016, 0.064];
//! let level = errors.iter().rposition(|error| error * px_per_unit <= 1.0);
//!
//! assert_eq!(mip.round(), 1.0);
//! assert_eq!(level, Some(2));
//! ```
//!
//! # Conventions
//! - Camera space is right-handed: x right, y down, z = depth along the optical axis, positive in
//!   front. [`CAMERA_FROM_VIEW`] converts from a view space with y up that looks down −z.
//!   [`Camera::from_projection`] reads a camera from a projection matrix.
//! - Lengths are in scene units, focal lengths in physical pixels. One sample is one pixel.
//! - `ρ = |P|`; `φ` is the angle off the axis, `θ` the angle around it; `C = f_x f_y`.
//! - The field points to the camera and is zero outside the field of view.
//! - Everything is `f32` on glam's scalar types; [`double`] has all of it in `f64`.
//!
//! # The paper's quantities in this crate
//! | Paper | Here |
//! |---|---|
//! | §2.1 planar field (1–4) | [`PlanarCamera`] |
//! | §2.2 field (5, 6), §3 spherical (7) | [`Intrinsics`], [`Spherical`], in the world [`PosedCamera`] |
//! | §3.1 flux (8), §3.2 Property 1 | [`Intrinsics::flux_through_triangle`], [`Intrinsics::flux_through_patch`], [`Intrinsics::flux_through_disk`] |
//! | §3.2 divergence (9–11), curl (12) | [`Intrinsics::divergence`], [`Intrinsics::curl`] |
//! | §3.3 level surface (13), gradient (14) | [`Intrinsics::level_radius`], [`Intrinsics::gradient`] |
//! | §3.4 aspect ratio | [`Intrinsics::aspect_ratio`], [`Intrinsics::pattern_aspect_ratio`] |
//! | §3.5 addition | [`compound_field`], [`compound_density`] |
//! | §4.1.1 splats (15), Fig. 13 | [`splat_area_px2`], [`SplatKernel`] |
//! | §4.1.2 texture filter | [`FilterKernel`] |
//! | §4.1.3 projection factor (16) | [`Intrinsics::projection_factor`] |
//! | §4.1.4 mip level | [`filter_dimension`], [`mip_level`] |
//! | §4.1.5, §4.2.2 level of detail | strength, aspect ratio and change over a sphere: [`FieldOfView`]. `fieldlod_select` picks levels with the strength; thresholds of the other two save no triangles at equal image error |
//! | §4.2.1 mean and deviation (17, 18) | [`SurfaceSamples`], [`best_placement`] |
//! | §4.2.3 layered depth images (19–21, App. iv, v) | [`FieldLine`], [`equivalent_camera`], [`convergent_point`] |
//!
//! Our extensions of the paper are:
//! - oblong pixels, off-centre frusta and orthographic cameras ([`OrthographicIntrinsics`]);
//! - the closed forms of flux and of (17, 18), and the bounds over spheres;
//! - the keystone of splats, and the convergent point of cameras that are not parallel.
//!
//! # Errata of the paper
//! Each has a test, named in brackets, in `tests/paper/errata.rs` unless another file is named. All
//! other equations hold as printed. The remaining tests compare each with central differences or
//! counted samples, up to 85° off axis.
//!
//! 1. Appendix iii: the normals of E₁ and E₂ are (z, 0, −x) and (0, z, −y); both signs are printed
//!    wrong. The sine that follows is right. (`appendix_iii_normals_have_the_wrong_sign`)
//! 2. (15) gives the *area* of a splat, not its diameter, which is proportional to the square root.
//!    (`equation_15_is_an_area_not_a_diameter`)
//! 3. §4.1.1 expects the curl to give the asymmetry of a splat. The curl gives only the part of a
//!    disk perpendicular to the sight ray. The tilt of the disk gives another part, even on the axis,
//!    where the curl is zero. (`curl_alone_does_not_explain_the_asymmetry`)
//! 4. §4.1.1 proposes to shear the content of the kernel. A linear shear keeps the kernel symmetric;
//!    asymmetry needs a second-order term. (`an_affine_shear_is_symmetric`)
//! 5. §3.2: on the image plane it is `|c · n|` that is 1, not `|c · da|`.
//!    (`density_on_the_image_plane_is_one`, in `field.rs`)
//! 6. (17, 18) are the mean and deviation of flux density, not of flux.
//!    (`mean_and_deviation_match_numerical_integration`, in `applications.rs`)
//!
//! # Unstated assumptions of the paper
//! 1. Square pixels and an image centred on the axis. Densities hold without both; the aspect ratio
//!    needs square pixels. (`pattern_aspect_ratio_holds_for_oblong_pixels`, in `field.rs`)
//! 2. §3.5: all cameras are in front of the surface. Cameras on both sides cancel in the
//!    sum. (`compound_field_assumes_cameras_on_one_side`)
//! 3. §3.2: the curl measures variation across the sight rays, not along them.
//!    (`curl_ignores_the_fall_with_distance`)
//! 4. §3.3: equal strength makes equal projected sizes only for equally inclined surfaces.
//!    (`equal_strength_does_not_make_equal_projected_size`)
//! 5. Fig. 13 keeps the area of an infinitely small surfel; a large one covers more.
//!    (`kept_area_falls_short_for_large_surfels`)
//! 6. Fig. 13: the orientation of the normal is measured in the plane perpendicular to the sight ray.
//!    In the image, the radial stretch would count twice.
//!    (`kernel_orientation_is_measured_across_the_sight_ray`)
//! 7. §4.1.4: the filter counts as round. At grazing angles, the level is then sharper than the
//!    longer axis of the filter needs. (`mip_level_is_mean_of_filter_axes`)
//! 8. (17, 18) divide by the *visible* area, which favours a camera that sees little.
//!    (`whole_surface_statistics_count_unseen_surface`, in `applications.rs`)
//! 9. Fig. 18 does not give the focal length of the camera at the average position. On a plane
//!    perpendicular to the axes, only the focal length and the depth matter, because every pinhole
//!    camera samples this plane evenly. (`perpendicular_plane_is_sampled_evenly_from_anywhere`)
//!
//! # Measured
//! The examples `figure_09`, `figure_10`, `figure_11`, `figure_14`, `figure_15` and `figure_18` draw the paper's
//! figures and print their numbers. Their tests check these results:
//!
//! - The paper reports no apparent difference between its splat kernel and the exact one (Fig. 14). For
//!   a disk perpendicular to the sight ray, 60° off axis, with a radius of 0.15 of its distance, 33 %
//!   of the area differs. With [`SplatKernel::map_sheared`], 7 % of the area differs.
//!   [`SplatKernel::map_exact`] is exact and costs one division.
//! - For parallel cameras, the convergent point merges fewer samples than the average position
//!   (Fig. 18). With the same focal length, this holds in at least nine of ten pairs. With the same
//!   density, it holds in at least eight of ten.
//! - For cameras that are not parallel, [`convergent_point`] merges fewer samples in at least six of
//!   ten pairs.
//!
//! # Guarantees
//! - No formula allocates. Formulas take and return plain `Copy` values, and the crate's `clippy.toml`
//!   forbids the allocating types.
//! - Functions of level-of-detail selection (fields, criteria, bounds) use only `+ − × ÷ √` and
//!   comparisons. They give the same bits on every IEEE 754 machine. The crate's
//!   `clippy.toml` forbids other operations, except in functions that take angles or return mip levels.
//! - Bounds over spheres are never NaN or negative; see [`FieldOverSphere::bound`].
//!
//! # Out of scope
//! Visibility: flux and statistics count the triangles that the caller passes as visible. Lens
//! distortion, depth of field and shutters.

#[cfg(feature = "glam_0_33")]
extern crate glam_0_33 as glam;

mod scalar {
    pub(super) type Real = f32;
    pub(super) use glam::{Mat3, Mat4, Vec2, Vec3};
}

pub mod double;
mod formulas;

pub use formulas::*;
