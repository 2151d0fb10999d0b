//! Would a cross-fade flicker less? Walks towards a model and draws each frame as the mean of the last
//! few cuts from where the eye is now: a fade of just so many frames of every unit that changes, without
//! the noise that dithering would add.
//!
//! `cargo run --release -p fieldlod_lab --example crossfade`

use std::collections::VecDeque;
use std::error::Error;

use fieldlod_bake::{SourceMesh, bake_mesh};
use fieldlod_lab::chart::Generated;
use fieldlod_lab::chooser::Chooser;
use fieldlod_lab::eye::{Eye, Instance};
use fieldlod_lab::measure::temporal_error;
use fieldlod_lab::method::Method;
use fieldlod_lab::object::{ErrorSource, LodObject};
use fieldlod_lab::object_view::ObjectView;
use fieldlod_lab::render::{DrawnModel, Picture, RenderError, Renderer};
use glam::{Vec2, Vec3};

/// Two fifths of a second.
const FRAMES: usize = 24;
const SIZE_PX: f32 = 256.0;
/// How many cuts a frame is the mean of.
const FADES: [usize; 4] = [1, 2, 4, LONGEST];
const LONGEST: usize = 8;
const THRESHOLDS_PX: [f32; 3] = [1.0, 2.0, 4.0];
/// That of the chart, and one at which a change of level stands out more.
const PACES: [f32; 2] = [1.0, 0.125];

fn main() -> Result<(), Box<dyn Error>> {
    let renderer = Renderer::new()?;
    println!("model; pace; px; frames of fade: mean and worst temporal error, of 255");
    for Generated { name, mesh } in Generated::TEST {
        let object = LodObject::new(bake(&mesh())?, ErrorSource::Reported);
        let model = renderer.upload(&object.hierarchy);
        for (pace, threshold_px) in PACES.iter().flat_map(|&p| THRESHOLDS_PX.map(|t| (p, t))) {
            let lines = walk(&renderer, &model, &object, pace, threshold_px)?;
            println!("{name}; {pace}; {threshold_px}; {}", lines.join("; "));
        }
    }
    Ok(())
}

fn bake(mesh: &SourceMesh) -> Result<fieldlod_hierarchy::Hierarchy, fieldlod_bake::MeshError> {
    bake_mesh(mesh, &Default::default())
}

/// The path of the chart: forwards, a little to the side, with head-bob.
fn eye(object: &LodObject, pace: f32, frame: usize) -> Eye {
    let share = pace * frame as f32 / FRAMES as f32;
    let angle = 0.3 + 0.15 * share;
    let height = 0.5 + 0.01 * (share * 12.0).sin();
    let direction = Vec3::new(angle.sin(), height, angle.cos()).normalize();
    let distance = object.radius * (2.6 - 0.5 * share);
    let eye = Eye::perspective(60.0, Vec2::splat(SIZE_PX), object.radius * 1e-3);
    eye.looking_at(object.center + direction * distance, object.center)
}

fn walk(
    renderer: &Renderer,
    model: &DrawnModel,
    object: &LodObject,
    pace: f32,
    threshold_px: f32,
) -> Result<Vec<String>, RenderError> {
    let units = object.hierarchy.units.iter().zip(0..);
    let source = units.filter(|(unit, _)| unit.producer().is_none());
    let source: Vec<u32> = source.map(|(_, index)| index).collect();
    let mut chooser = Chooser::new(Method::Quality, threshold_px);
    let mut cuts: VecDeque<Vec<u32>> = VecDeque::new();
    let mut last: Option<(Picture, Vec<Picture>)> = None;
    let mut errors = vec![Vec::new(); FADES.len()];
    let instance = Instance::default();
    for frame in 0..FRAMES {
        let eye = eye(object, pace, frame);
        cuts.push_front(
            chooser
                .choose(&ObjectView::new(object, &instance, &eye))
                .units,
        );
        cuts.truncate(LONGEST);
        let reference = renderer.draw(model, &eye, &source)?;
        let drawn = draw_all(renderer, model, &eye, &cuts)?;
        let faded: Vec<Picture> = FADES.iter().map(|&fade| mean(&drawn, fade)).collect();
        // Until the longest fade has all its cuts, nothing is compared.
        if let Some((last_reference, last_faded)) = &last
            && frame >= LONGEST
        {
            for ((errors, now), before) in errors.iter_mut().zip(&faded).zip(last_faded) {
                errors.push(temporal_error([last_reference, &reference], [before, now]));
            }
        }
        last = Some((reference, faded));
    }
    Ok(errors
        .iter()
        .zip(FADES)
        .map(|(e, fade)| line(e, fade))
        .collect())
}

fn line(errors: &[f64], fade: usize) -> String {
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let worst = errors.iter().copied().fold(0.0, f64::max);
    format!("{fade}: {mean:.3} {worst:.3}")
}

/// Each cut from where the eye is now; equal ones are drawn once.
fn draw_all(
    renderer: &Renderer,
    model: &DrawnModel,
    eye: &Eye,
    cuts: &VecDeque<Vec<u32>>,
) -> Result<Vec<Picture>, RenderError> {
    let mut drawn: Vec<Picture> = Vec::new();
    for (index, cut) in cuts.iter().enumerate() {
        let newer = index.checked_sub(1).filter(|&newer| &cuts[newer] == cut);
        drawn.push(match newer {
            Some(newer) => drawn[newer].clone(),
            None => renderer.draw(model, eye, cut)?,
        });
    }
    Ok(drawn)
}

/// The mean of the first few pictures; of all, if there are fewer.
fn mean(pictures: &[Picture], count: usize) -> Picture {
    let pictures = &pictures[..count.min(pictures.len())];
    let mut sum = pictures[0].clone();
    for (pixel, color) in sum.colors.iter_mut().enumerate() {
        for (channel, level) in color.iter_mut().enumerate() {
            let levels = pictures.iter().map(|p| p.colors[pixel][channel]);
            *level = levels.sum::<f32>() / pictures.len() as f32;
        }
    }
    sum
}
