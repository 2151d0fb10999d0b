//! What a camera takes to hide other things, over the picture.

use bevy::asset::RenderAssetUsages;
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use fieldlod_select::OcclusionBuffer;

use crate::api::debug_options::FieldLodDebug;
use crate::scene::view_cut::ViewCut;

/// The node of [`FieldLodDebug::depth_image`].
#[derive(Component)]
pub(super) struct DepthImage;

/// Shows the depth image of the first camera that has one, keeps it up to date, or removes it.
pub(super) fn update_depth_image(
    mut commands: Commands,
    debug: Res<FieldLodDebug>,
    shown: Query<(Entity, &ImageNode), With<DepthImage>>,
    cuts: Query<&ViewCut>,
    mut images: ResMut<Assets<Image>>,
) {
    let mut buffers = cuts.iter().filter_map(|cut| cut.selector.occlusion());
    let buffer = buffers.next().filter(|_| debug.depth_image);
    match (buffer, shown.single()) {
        (None, Ok((node, _))) => commands.entity(node).despawn(),
        (Some(buffer), Ok((_, node))) => {
            if let Some(mut image) = images.get_mut(&node.image) {
                *image = picture(buffer);
            }
        }
        (Some(buffer), Err(_)) => {
            let node = Node {
                position_type: PositionType::Absolute,
                left: px(8.0),
                bottom: px(8.0),
                ..default()
            };
            let image = ImageNode::new(images.add(picture(buffer)));
            commands.spawn((DepthImage, image, node));
        }
        (None, Err(_)) => {}
    }
}

/// Nearness as gray, by its root, which tells far things apart, too.
fn picture(buffer: &OcclusionBuffer) -> Image {
    let [width, height] = buffer.size().map(|side| side as u32);
    let finite = buffer.nearness().iter().filter(|it| it.is_finite());
    let nearest = finite.fold(f32::MIN_POSITIVE, |a, &b| a.max(b));
    let gray = |nearness: &f32| ((nearness.max(0.0) / nearest).sqrt() * 255.0) as u8;
    let texels = buffer.nearness().iter().map(gray);
    Image::new(
        Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        TextureDimension::D2,
        texels.flat_map(|gray| [gray, gray, gray, 255]).collect(),
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::default(),
    )
}
