//! Pictures of the path at equal error, with detail chosen by what is not hidden and without.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use bevy::math::{Vec2, Vec4};
use bevy_fieldlod::prelude::*;
use fieldlod_bake::{SourceMesh, Surface, SurfaceAlpha};
use fieldlod_lab::eye::Eye;
use fieldlod_lab::render::Renderer;
use fieldlod_lab::scenes::{Options, World, measure, table};

use crate::args::Args;
use crate::layout;
use crate::path::{CameraPath, DURATION_IN_S};
use crate::quality::Quality;
use crate::scene::lod_kind;
use crate::shapes::{self, Shape};

const FRAMES_PER_SECOND: f32 = 60.0;

/// Measures the frames of the path, writes figures into a folder and prints them.
pub(crate) fn run(args: &Args, quality: &Quality, folder: &Path) -> Result<(), String> {
    // The scene as the lab knows it.
    let mut world = World::new("walkthrough");
    world.config.cards = args.cards;
    let config = FieldLodConfig::default();
    let mut meshes = HashMap::new();
    for (id, shape) in shapes::generate_all(quality.ground_squares) {
        let kind = config.kind_for(lod_kind(id), shape.triangle_count() as usize);
        let mesh = world.add_mesh(&source_mesh(shape), kind == LodKind::WholeMesh);
        meshes.insert(id, mesh.map_err(|fault| format!("{id:?}: {fault}"))?);
    }
    for placed in layout::place_all(quality.vegetation) {
        let place = placed.transform.compute_affine();
        world.place(meshes[&placed.shape], place);
    }
    // Its frames.
    let path = CameraPath::new();
    let size_px: Vec2 = quality.size_in_px.as_vec2();
    for (_, round) in args.frames(quality.frames)? {
        let eye_at = |round: f32| {
            let pose = path.pose(round.rem_euclid(1.0));
            let eye = Eye::perspective(pose.fov_in_rad.to_degrees(), size_px, 0.1);
            eye.looking_at(pose.eye, pose.target)
        };
        let before = |frames: u32| frames as f32 / (FRAMES_PER_SECOND * DURATION_IN_S);
        let approach = (1..=args.approach)
            .rev()
            .map(|frames| eye_at(round - before(frames)));
        world.look_after(approach.collect(), eye_at(round));
    }
    // Pictures and figures.
    let renderer = Renderer::new().map_err(|fault| fault.to_string())?;
    // Limits would take every level of six thousand things in every frame.
    let options = Options {
        shadows: false,
        limits: false,
    };
    let result = measure(&renderer, &world, options, folder);
    println!("{}", table(&result.map_err(|fault| fault.to_string())?));
    Ok(())
}

fn source_mesh(shape: Shape) -> SourceMesh {
    SourceMesh {
        positions: shape.positions,
        normals: shape.normals,
        uvs: shape.uvs,
        colors: shape.colors.iter().map(|color| color.extend(1.0)).collect(),
        indices: shape.indices,
        // As the scene has it, but for the colour, which is that of vertices here.
        surface: Some(Arc::new(Surface::new(Vec4::ONE, SurfaceAlpha::Opaque))),
        ..SourceMesh::default()
    }
}
