//! Changes of level of an animated character, measured on pictures of the lab.

use fieldlod_bake::import_gltf_bytes;
use fieldlod_lab::characters::{PictureOptions, measure};
use fieldlod_lab::render::{RenderError, Renderer};
use fieldlod_tests::stage::skip_without_adapter;

use crate::character::character;

/// While a character moves away and comes back, the image error around a change of level is at most 1.5 times that of
/// neighbouring frames, and no background shows through.
#[test]
fn level_changes_in_motion_do_not_stand_out() {
    let renderer = match Renderer::new() {
        Err(RenderError::NoAdapter) => return skip_without_adapter(),
        renderer => renderer.unwrap(),
    };
    let bytes = character(1.0).glb_bytes();
    let import = import_gltf_bytes(&bytes, &|_| unreachable!("one file")).unwrap();
    let options = PictureOptions {
        directions: 0,
        poses: 1,
        radii_px: Vec::new(),
    };
    let mut failed = Vec::new();
    let measured = measure("tube", import, Some((&renderer, &options)), &mut failed).unwrap();
    assert_eq!(failed, Vec::<String>::new());
    let motion = measured[0].motion.as_ref().unwrap();
    assert!(
        motion.frames.len() >= 200 && motion.changes() >= 4,
        "{}",
        motion.changes()
    );
    assert!(motion.largest_peak() <= 1.5, "{}", motion.largest_peak());
    let holes = motion.frames.iter().map(|frame| frame.holes.px);
    assert_eq!(holes.sum::<f64>(), 0.0);
}
