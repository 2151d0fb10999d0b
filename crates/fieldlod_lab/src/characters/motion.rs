//! Changes of level while an animated character moves away and comes back.

use fieldlod_bake::{Character, Clip, Import, pose_at};
use fieldlod_hierarchy::Hierarchy;
use fieldlod_select::{Cut, LodSettings, select};
use glam::{Affine3A, DVec2, Vec3};
use serde::Serialize;

use super::pictures::{common_surface, posed};
use crate::eye::Eye;
use crate::holes::unpaired_edges;
use crate::measure::{greatest, image_error};
use crate::props::{ERROR_PX, direction, eye};
use crate::render::{Picture, RenderError, Renderer, SUPERSAMPLING};

/// Frames of the way back and forth: 8 seconds, with steps of 1.5 % of the distance. Longer steps themselves change the image
/// error between frames; shorter ones take longer.
const FRAMES: usize = 480;
const SECONDS_PER_FRAME: f32 = 1.0 / 60.0;
/// Radii on screen in pixels at both ends. A smaller range would have fewer changes of level.
const RADII_PX: [f32; 2] = [200.0, 6.0];
/// Frames on each side of a change that are its neighbours: a sixth of a second. In a longer time the poses differ more, in
/// a shorter time a single frame decides.
const NEIGHBOURS: usize = 10;
/// The outline of a level may move inwards by this many pixels. Background farther inside is a hole. A smaller number counts
/// coarser outlines as holes, a larger one misses holes near the outline.
const OUTLINE_PX: u32 = 2;

/// The frames of an animated character on its way.
#[derive(Clone, Debug, Serialize)]
pub struct Motion {
    /// The frames, 60 per second.
    pub frames: Vec<MotionFrame>,
}

/// One frame, compared with full detail.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MotionFrame {
    /// The level that the selection chooses at 1 px of error.
    pub level: u32,
    /// The RMSE of this level.
    pub rmse: f64,
    /// The RMSE that the previous frame's level has in this frame, if the level changed.
    pub rmse_without_change: Option<f64>,
    /// Holes of this level.
    pub holes: Holes,
    /// Holes of the coarsest level of the baseline with at least as many triangles. Its finest level is the source.
    pub plain_holes: Holes,
}

/// Background pixels of a level, more than 2 px inside the outline of full detail.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Holes {
    /// All of these pixels. Gaps between pieces whose outlines moved are included.
    pub px: f64,
    /// Those at most 2 px from an edge that the level opens: an edge of one triangle that is no open edge of the source.
    /// Simplified borders have opened edges too.
    pub cracks_px: f64,
}

impl Motion {
    /// Moves a character away and back. `levels` has the triangles of all levels of `baked`, the source first; `plain` is
    /// the baseline without the source.
    pub(super) fn of(
        renderer: &Renderer,
        character: &Character<'_>,
        (import, clip): (&Import, &Clip),
        baked: &Hierarchy,
        [levels, plain]: [&[Vec<[u32; 3]>]; 2],
    ) -> Result<Self, RenderError> {
        let settings = LodSettings::with_error_px(ERROR_PX);
        let mut cut = Cut::default();
        let mut last = None;
        let surface = common_surface(character);
        let mut frames = Vec::new();
        for (radius_px, time) in way(clip) {
            // The pose may be degenerate at this time.
            let Some(pose) = pose_at(character, import, clip, time) else {
                continue;
            };
            let eye = eye(&baked.groups[0].bounds, direction(3, 8), radius_px);
            select(baked, &Affine3A::IDENTITY, &eye.view(), &settings, &mut cut);
            let level = cut.units().first().map_or(0, |&unit| unit as usize);
            let before = last.replace(level).filter(|last| *last != level);
            let plain = std::iter::once(&levels[0]).chain(plain);
            let plain = plain.filter(|plain| plain.len() >= levels[level].len());
            let drawn = [&levels[level], &levels[before.unwrap_or(level)]];
            let plain = plain.min_by_key(|plain| plain.len());
            let posed = posed(character, &pose, drawn.into_iter().chain(plain));
            let model = renderer.upload(&posed, surface);
            let full = renderer.draw(&model, &eye, &[0])?;
            let picture = renderer.draw(&model, &eye, &[1])?;
            let rmse = |picture: &Picture| image_error(&full, picture, false).rmse;
            let of_before = before.map(|_| renderer.draw(&model, &eye, &[2]));
            let of_plain = renderer.draw(&model, &eye, &[3])?;
            // Units of `posed`: 0 is the source, 1 the level, 2 the level of the last frame, 3 the baseline.
            frames.push(MotionFrame {
                level: level as u32,
                rmse: rmse(&picture),
                rmse_without_change: of_before.transpose()?.as_ref().map(rmse),
                holes: Holes::of(&full, &picture, &eye, (&posed, 1)),
                plain_holes: Holes::of(&full, &of_plain, &eye, (&posed, 3)),
            });
        }
        Ok(Self { frames })
    }

    /// The number of changes of level.
    #[must_use]
    pub fn changes(&self) -> usize {
        let changes = self
            .frames
            .iter()
            .filter_map(|frame| frame.rmse_without_change);
        changes.count()
    }

    /// The greatest RMSE in the frames before and after a change, relative to the greatest in the ten frames before and
    /// after these: the largest over all changes. It is above 1 if an error stands out where a level changes.
    #[must_use]
    pub fn largest_peak(&self) -> f64 {
        let most = |frames: &[MotionFrame]| greatest(frames.iter().map(|it| it.rmse));
        let peaks = self.windows().map(|window| {
            let (before, rest) = window.split_at(NEIGHBOURS);
            let (change, after) = rest.split_at(2);
            most(change) / most(before).max(most(after)).max(f64::MIN_POSITIVE)
        });
        greatest(peaks)
    }

    /// The largest ratio of the RMSE of two levels in the frame of their change. Changes from and to full detail are left
    /// out, because its RMSE is 0.
    #[must_use]
    pub fn largest_step(&self) -> f64 {
        let changes = self.frames.iter();
        let steps = changes.filter_map(|frame| {
            let (with, without) = (frame.rmse, frame.rmse_without_change?);
            (with.min(without) > 0.0).then(|| with.max(without) / with.min(without))
        });
        steps.fold(1.0, f64::max)
    }

    /// For each change with enough neighbours, its two frames and these neighbours.
    fn windows(&self) -> impl Iterator<Item = &[MotionFrame]> {
        let windows = self.frames.windows(2 * NEIGHBOURS + 2);
        windows.filter(|window| window[NEIGHBOURS + 1].rmse_without_change.is_some())
    }
}

/// For each frame, the radius in pixels and the time of the clip. The clip runs forward and backward in turn.
fn way(clip: &Clip) -> impl Iterator<Item = (f32, f32)> {
    let times = || clip.channels.iter().flat_map(|channel| &channel.times);
    let start = times().copied().fold(f32::INFINITY, f32::min);
    let span = times().copied().fold(start, f32::max) - start;
    let [near, far] = RADII_PX;
    (0..FRAMES).map(move |frame| {
        let away = 1.0 - (2.0 * frame as f32 / FRAMES as f32 - 1.0).abs();
        let played =
            (frame as f32 * SECONDS_PER_FRAME).rem_euclid((2.0 * span).max(f32::MIN_POSITIVE));
        (
            near * (far / near).powf(away),
            start + played.min(2.0 * span - played),
        )
    })
}

impl Holes {
    /// The holes of `picture`, which shows a unit of a posed character.
    fn of(full: &Picture, picture: &Picture, eye: &Eye, (posed, unit): (&Hierarchy, u32)) -> Self {
        let texels = hole_texels(full, picture);
        if texels.is_empty() {
            return Self::default();
        }
        let (camera_from_world, eye_in_world) =
            (eye.camera_from_world(), eye.position().as_dvec3());
        // The principal point is the middle of the picture.
        let middle = full.size_px.as_dvec2() * 0.5;
        let to_px = |end: [u32; 3]| {
            let position = Vec3::from_array(end.map(f32::from_bits)).as_dvec3();
            let in_camera = camera_from_world * (position - eye_in_world);
            Some(eye.project_px(in_camera)? + middle)
        };
        let edges = opened_edges(posed, unit).map(|[a, b]| Some([to_px(a)?, to_px(b)?]));
        let edges: Vec<[DVec2; 2]> = edges.flatten().collect();
        let is_crack = |(x, y): &&(usize, usize)| {
            let place = (DVec2::new(*x as f64, *y as f64) + 0.5) / f64::from(SUPERSAMPLING);
            let mut distances = edges.iter().map(|edge| distance(place, *edge));
            distances.any(|distance| distance <= f64::from(OUTLINE_PX))
        };
        let px = |texels: usize| texels as f64 / f64::from(SUPERSAMPLING * SUPERSAMPLING);
        Self {
            px: px(texels.len()),
            cracks_px: px(texels.iter().filter(is_crack).count()),
        }
    }
}

/// Edges without a neighbour in `unit` that have one in the source or are not in it. The source is unit 0. An edge is given
/// by the bits of its ends.
fn opened_edges(posed: &Hierarchy, unit: u32) -> impl Iterator<Item = [[u32; 3]; 2]> {
    let of_source = unpaired_edges(posed, &[0]);
    let edges = unpaired_edges(posed, &[unit]).into_keys();
    edges.filter(move |edge| !of_source.contains_key(edge))
}

/// The distance of a place from an edge.
fn distance(place: DVec2, [from, to]: [DVec2; 2]) -> f64 {
    let along = to - from;
    let share = (place - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
    place.distance(from + along * share.clamp(0.0, 1.0))
}

/// Texels of background in a picture, where `full` covers everything within [`OUTLINE_PX`].
fn hole_texels(full: &Picture, picture: &Picture) -> Vec<(usize, usize)> {
    let margin = (OUTLINE_PX * SUPERSAMPLING) as usize;
    let [width, height] = (full.size_px * SUPERSAMPLING)
        .to_array()
        .map(|x| x as usize);
    let is_inside = |x: usize, y: usize| {
        let mut rows = y - margin..=y + margin;
        rows.all(|y| {
            full.covered[y * width + x - margin..=y * width + x + margin]
                .iter()
                .all(|it| *it)
        })
    };
    let inner = |size: usize| margin..size.saturating_sub(margin);
    let texels = inner(height).flat_map(|y| inner(width).map(move |x| (x, y)));
    let holes = texels.filter(|&(x, y)| !picture.covered[y * width + x] && is_inside(x, y));
    holes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::flat;
    use fieldlod_hierarchy::{Group, Vertices};
    use glam::{UVec2, Vec2};

    #[test]
    fn holes_are_farther_inside_than_the_outline() {
        let size = UVec2::new(16, 16);
        let full = flat(size, 0.0, 8);
        assert_eq!(hole_texels(&full, &flat(size, 0.0, 6)), []);
        // Of the picture's height, 2 px above and below are too near to its edge.
        let holes = hole_texels(&full, &flat(size, 0.0, 5));
        assert_eq!(holes.len() as u32, 12 * SUPERSAMPLING * SUPERSAMPLING);
    }

    /// A rectangle that faces the eye: left, right, lower and upper side, in pixels from the middle of the picture.
    type Sheet = [f32; 4];

    /// A hierarchy with one unit for each list of sheets.
    fn units(units: [&[Sheet]; 2]) -> Hierarchy {
        let corners = |&[left, right, low, high]: &Sheet| {
            [[left, low], [right, low], [right, high], [left, high]]
        };
        let all = units.iter().copied().flatten().flat_map(corners);
        let mut hierarchy = Hierarchy {
            vertices: Vertices {
                positions: all.map(|[x, y]| Vec3::new(x, y, 0.0)).collect(),
                ..Vertices::default()
            },
            ..Hierarchy::default()
        };
        let mut corners = (0..).step_by(4);
        for sheets in units {
            let corners = corners.by_ref().take(sheets.len());
            let triangles = corners.flat_map(|a: u32| [[a, a + 1, a + 2], [a, a + 2, a + 3]]);
            let triangles: Vec<[u32; 3]> = triangles.collect();
            hierarchy
                .push_whole_mesh(&triangles, Group::default())
                .unwrap();
        }
        hierarchy
    }

    fn drawn(size: UVec2, sheets: &[Sheet]) -> Picture {
        let mut picture = flat(size, 0.0, 0);
        let width = size.x * SUPERSAMPLING;
        for (texel, covered) in (0..).zip(&mut picture.covered) {
            let texel = UVec2::new(texel % width, texel / width).as_vec2() + 0.5;
            let from_middle = texel / SUPERSAMPLING as f32 - size.as_vec2() * 0.5;
            let at = from_middle * Vec2::new(1.0, -1.0);
            let contains = |&[left, right, low, high]: &Sheet| {
                (left..right).contains(&at.x) && (low..high).contains(&at.y)
            };
            *covered = sheets.iter().any(contains);
        }
        picture
    }

    #[test]
    fn cracks_are_holes_at_opened_edges() {
        let size = UVec2::splat(32);
        // At this distance, a unit of length covers a pixel.
        let eye = Eye::perspective(90.0, size.as_vec2(), 0.1);
        let eye = eye.looking_at(Vec3::Z * 16.0, Vec3::ZERO);
        let closed: &[Sheet] = &[[-12.0, 0.0, -12.0, 12.0], [0.0, 12.0, -12.0, 12.0]];
        let overlapping: &[Sheet] = &[[-12.0, 4.0, -12.0, 12.0], [-4.0, 12.0, -12.0, 12.0]];
        // Holes end 2 px inside the outline, so a slit is 20 px long.
        type Case<'a> = (&'a str, &'a [Sheet], &'a [Sheet], [f64; 2]);
        let cases: [Case<'_>; 6] = [
            ("same mesh", closed, closed, [0.0, 0.0]),
            ("same open borders", overlapping, overlapping, [0.0, 0.0]),
            (
                "upright slit of 10 px",
                closed,
                &[[-12.0, -2.0, -12.0, 12.0], [8.0, 12.0, -12.0, 12.0]],
                [200.0, 80.0],
            ),
            (
                "level slit of 6 px",
                closed,
                &[[-12.0, 12.0, -12.0, -6.0], [-12.0, 12.0, 0.0, 12.0]],
                [120.0, 80.0],
            ),
            (
                "missing piece beside an open border of the source",
                overlapping,
                &overlapping[..1],
                [120.0, 0.0],
            ),
            (
                "moved border",
                overlapping,
                &[overlapping[0], [6.0, 12.0, -12.0, 12.0]],
                [40.0, 40.0],
            ),
        ];
        for (name, source, level, expected) in cases {
            let (full, picture) = (drawn(size, source), drawn(size, level));
            let holes = Holes::of(&full, &picture, &eye, (&units([source, level]), 1));
            assert_eq!([holes.px, holes.cracks_px], expected, "{name}");
        }
    }
}
