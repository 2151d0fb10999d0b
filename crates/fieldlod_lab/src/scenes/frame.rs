//! One frame of a world: draws full detail, and compares cuts with it.

use fieldlod_select::{AdvancedSettings, LodSettings, Offscreen, Selector, VisibleFlux};

use super::world::World;
use crate::eye::Eye;
use crate::measure::{ImageError, image_error};
use crate::object_view::ObjectView;
use crate::render::{DrawnModel, Picture, PlacedUnits, RenderError, Renderer};

/// The drawn units of each instance, in the order of the world's instances.
type Cuts = Vec<Vec<u32>>;

/// An uploaded world.
pub(super) struct Stage<'a> {
    renderer: &'a Renderer,
    world: &'a World,
    models: Vec<DrawnModel>,
}

/// Triangles and image error of one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured {
    pub(super) triangles: u64,
    pub(super) error: ImageError,
}

/// A frame with its reference.
pub(super) struct Frame<'a> {
    stage: &'a Stage<'a>,
    eye: &'a Eye,
    views: Vec<ObjectView<'a>>,
    reference: Picture,
}

impl<'a> Stage<'a> {
    pub(super) fn new(renderer: &'a Renderer, world: &'a World) -> Self {
        let objects = world.objects.iter();
        Self {
            renderer,
            world,
            models: objects
                .map(|it| renderer.upload(&it.hierarchy, None))
                .collect(),
        }
    }

    fn draw(&self, eye: &Eye, cuts: &Cuts) -> Result<Picture, RenderError> {
        let instances = self.world.instances.iter().zip(cuts);
        let placed = instances.map(|((object, instance), units)| PlacedUnits {
            model: &self.models[*object],
            world_from_local: instance.world_from_local,
            units,
        });
        let placed: Vec<PlacedUnits> = placed.collect();
        self.renderer.draw_scene(&placed, eye)
    }
}

impl<'a> Frame<'a> {
    /// Draws full detail as the reference.
    pub(super) fn new(stage: &'a Stage, eye: &'a Eye) -> Result<Self, RenderError> {
        let views = stage.world.views(eye);
        // Full detail is culled by the same test as the cuts.
        let sources = views.iter().map(|view| view.object.source_units());
        let sources: Cuts = sources.collect();
        Ok(Self {
            reference: stage.draw(eye, &in_view(&views, &sources))?,
            stage,
            eye,
            views,
        })
    }

    /// Selects a cut, draws it and compares it with full detail.
    pub(super) fn measure(
        &self,
        error_px: f32,
        visible_flux: bool,
        with_flip: bool,
    ) -> Result<Measured, RenderError> {
        let cuts = in_view(&self.views, &self.select(error_px, visible_flux));
        let picture = self.stage.draw(self.eye, &cuts)?;
        let counts = self.views.iter().zip(&cuts);
        let triangles = counts.map(|(view, units)| view.object.triangle_count(units));
        Ok(Measured {
            triangles: triangles.sum(),
            error: image_error(&self.reference, &picture, with_flip),
        })
    }

    fn select(&self, error_px: f32, visible_flux: bool) -> Cuts {
        // These are the plugin's settings for a view without shadows.
        let settings = LodSettings {
            visible_flux: visible_flux.then(VisibleFlux::default),
            advanced: AdvancedSettings {
                offscreen_margin: 0.1,
                offscreen: Offscreen::Coarsest,
                ..AdvancedSettings::default()
            },
            ..LodSettings::with_error_px(error_px)
        };
        let world = self.stage.world;
        let mut selector = Selector::default();
        selector.select(&world.scene, &self.eye.view(), &settings);
        let units = |&id| selector.units(&world.scene, id).to_vec();
        world.ids.iter().map(units).collect()
    }
}

fn in_view(views: &[ObjectView], cuts: &Cuts) -> Cuts {
    let pairs = views.iter().zip(cuts);
    let seen = pairs.map(|(view, units)| view.units_in_view(units));
    seen.collect()
}
