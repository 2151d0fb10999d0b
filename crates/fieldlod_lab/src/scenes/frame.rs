//! One frame of a world: what full detail shows, and how far cuts are from it.

use fieldlod_hierarchy::{Hierarchy, Sphere};
use fieldlod_select::{LodSettings, Offscreen, VisibleFlux};
use glam::DVec2;

use super::world::World;
use crate::eye::Eye;
use crate::measure::{ImageError, image_error};
use crate::object_view::ObjectView;
use crate::oracle::{Oracle, UnitsOfAll, first_ids};
use crate::render::{
    DrawnModel, Picture, PlacedUnits, RenderError, Renderer, SUPERSAMPLING, UnitMap,
};

/// Distance from the eye to the middle of where shadows are, and how far they reach from there.
const SHADOW_DISTANCE: f32 = 25.0;
const SHADOW_RADIUS: f32 = 45.0;

/// A world on the adapter.
pub(super) struct Stage<'a> {
    pub(super) renderer: &'a Renderer,
    pub(super) world: &'a World,
    models: Vec<DrawnModel>,
    with_shadows: bool,
}

/// What a method draws in one frame, and how far that is from full detail.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) triangles: u64,
    pub(super) error: ImageError,
}

/// A frame with its reference.
pub(super) struct Frame<'a> {
    stage: &'a Stage<'a>,
    pub(super) eye: &'a Eye,
    /// What the eye saw before.
    pub(super) approach: &'a [Eye],
    pub(super) views: Vec<ObjectView<'a>>,
    reference: Picture,
    limits: Option<Limits>,
}

/// What only the pictures of full detail and of all levels tell.
pub(super) struct Limits {
    /// The share of each group that the picture of full detail shows, by instance.
    pub(super) shares_in_picture: Vec<Vec<f32>>,
    pub(super) oracle: Oracle,
}

impl<'a> Stage<'a> {
    pub(super) fn new(renderer: &'a Renderer, world: &'a World, with_shadows: bool) -> Self {
        let objects = world.objects.iter();
        Self {
            renderer,
            world,
            models: objects.map(|it| renderer.upload(&it.hierarchy)).collect(),
            with_shadows,
        }
    }

    fn draw(
        &self,
        views: &[ObjectView],
        eye: &Eye,
        cuts: &UnitsOfAll,
    ) -> Result<(Picture, UnitMap), RenderError> {
        let first_ids = first_ids(views);
        // What is out of view may throw a shadow into it.
        let drawn: UnitsOfAll = if self.with_shadows {
            cuts.clone()
        } else {
            in_view(views, cuts)
        };
        let instances = self.world.instances.iter().zip(&drawn).zip(first_ids);
        let placed = instances.map(|(((object, instance), units), first_id)| PlacedUnits {
            model: &self.models[*object],
            world_from_local: instance.world_from_local,
            units,
            first_id,
        });
        let shadows = self.with_shadows.then(|| Sphere {
            center: eye.position() + eye.forward() * SHADOW_DISTANCE,
            radius: SHADOW_RADIUS,
        });
        let placed: Vec<PlacedUnits> = placed.collect();
        self.renderer.draw_scene(&placed, eye, shadows.as_ref())
    }
}

impl<'a> Frame<'a> {
    /// Draws full detail, and every level where limits are asked for.
    pub(super) fn new(
        stage: &'a Stage,
        eye: &'a Eye,
        approach: &'a [Eye],
        with_limits: bool,
    ) -> Result<Self, RenderError> {
        let views = stage.world.views(eye);
        let sources = views.iter().map(|view| view.object.source_units());
        let (reference, map) = stage.draw(&views, eye, &sources.collect())?;
        let draw = |cuts: &UnitsOfAll| stage.draw(&views, eye, cuts);
        let limits = || -> Result<Limits, RenderError> {
            Ok(Limits {
                oracle: Oracle::new(&reference, &views, draw)?,
                shares_in_picture: shares_in_picture(&views, &map),
            })
        };
        Ok(Self {
            limits: with_limits.then(limits).transpose()?,
            stage,
            eye,
            approach,
            views,
            reference,
        })
    }

    /// What methods are held against that know the pictures.
    ///
    /// # Panics
    /// If the frame was made without.
    pub(super) fn limits(&self) -> &Limits {
        self.limits.as_ref().expect("a frame with limits")
    }

    /// The settings of selection, as the plugin has them; with visible flux if hidden things count a share.
    pub(super) fn settings(&self, error_px: f32, least_share: Option<f32>) -> LodSettings {
        let with_shadows = self.stage.with_shadows;
        LodSettings {
            offscreen_margin: 0.1,
            offscreen: if with_shadows {
                Offscreen::OnAxis { bias: 0.3 }
            } else {
                Offscreen::Coarsest
            },
            visible_flux: least_share.map(|least_share| VisibleFlux {
                least_share,
                ..VisibleFlux::default()
            }),
            ..LodSettings::with_error_px(error_px)
        }
    }

    /// Draws cuts and compares them with full detail.
    pub(super) fn measure(
        &self,
        cuts: &UnitsOfAll,
        with_flip: bool,
    ) -> Result<Measured, RenderError> {
        let picture = self.draw(cuts)?;
        let drawn = in_view(&self.views, cuts);
        let counts = self.views.iter().zip(&drawn);
        Ok(Measured {
            triangles: counts
                .map(|(view, units)| view.object.triangle_count(units))
                .sum(),
            error: image_error(&self.reference, &picture, with_flip),
        })
    }

    pub(super) fn draw(&self, cuts: &UnitsOfAll) -> Result<Picture, RenderError> {
        Ok(self.stage.draw(&self.views, self.eye, cuts)?.0)
    }
}

fn in_view(views: &[ObjectView], cuts: &UnitsOfAll) -> UnitsOfAll {
    let pairs = views.iter().zip(cuts);
    pairs
        .map(|(view, units)| view.units_in_view(units))
        .collect()
}

/// Texels that show each group's surface over those that it would cover if nothing hid it.
fn shares_in_picture(views: &[ObjectView], map: &UnitMap) -> Vec<Vec<f32>> {
    let first_ids = first_ids(views);
    let count = views
        .iter()
        .map(|view| view.object.hierarchy.units.len())
        .sum();
    let mut shown = vec![0u32; count];
    for id in map.units.iter().flatten() {
        shown[*id as usize] += 1;
    }
    let of_view = |(view, first): (&ObjectView, u32)| {
        let hierarchy = &view.object.hierarchy;
        let covered = covered_by_sources(view, map);
        let of_unit = |unit: usize| [shown[first as usize + unit] as f32, covered[unit]];
        group_shares(hierarchy, of_unit)
    };
    views.iter().zip(first_ids).map(of_view).collect()
}

/// Texels that each source unit's front covers within the image.
fn covered_by_sources(view: &ObjectView, map: &UnitMap) -> Vec<f32> {
    let hierarchy = &view.object.hierarchy;
    let mut covered = vec![0.0; hierarchy.units.len()];
    let size = map.size_texels.as_dvec2();
    let scale = f64::from(SUPERSAMPLING);
    for unit in hierarchy.source_units() {
        if !view.touches_box(&hierarchy.units[unit].aabb) {
            continue;
        }
        for triangle in hierarchy.triangles_of(&hierarchy.units[unit]) {
            let project = |vertex: u32| {
                let at = view.in_camera(hierarchy.vertices.positions[vertex as usize]);
                view.eye.project_px(at.as_dvec3())
            };
            let [Some(a), Some(b), Some(c)] = triangle.map(project) else {
                continue;
            };
            let middle: DVec2 = (a + b + c) * (scale / 3.0);
            // Pixels count from the axis, which is in the middle of these images; y points down, so that
            // fronts wind clockwise.
            let area = (b - a).perp_dot(c - a) * -0.5 * scale * scale;
            if area > 0.0 && middle.abs().cmple(size * 0.5).all() {
                covered[unit] += area as f32;
            }
        }
    }
    covered
}

/// The shares of groups, of texels shown and covered by source units; a group stands for all that the
/// groups below it stand for.
fn group_shares(hierarchy: &Hierarchy, of_unit: impl Fn(usize) -> [f32; 2]) -> Vec<f32> {
    let mut sums: Vec<[f32; 2]> = Vec::with_capacity(hierarchy.groups.len());
    for group in &hierarchy.groups {
        let sources = group
            .units()
            .filter(|&unit| hierarchy.units[unit].producer().is_none());
        let finer = hierarchy
            .finer_groups(group)
            .iter()
            .map(|&finer| sums[finer as usize]);
        let all = sources.map(&of_unit).chain(finer);
        sums.push(all.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]));
    }
    let share = |[shown, covered]: [f32; 2]| {
        if shown > 0.0 {
            shown / covered.max(shown)
        } else {
            0.0
        }
    };
    sums.into_iter().map(share).collect()
}
