//! The materials of cards.

use bevy::asset::Handle;
use bevy::image::Image;
use bevy::material::AlphaMode;
use bevy::math::Affine2;
use bevy::mesh::UvChannel;
use bevy::pbr::StandardMaterial;
use bevy::prelude::{Alpha, Color, LinearRgba};
use bevy::reflect::structs::Struct;

use crate::cards::card_levels::CardLevels;

/// How opaque a texel is at least that is drawn.
const CUTOFF: f32 = 0.5;
/// Textures that the pictures of cards stand for.
const PICTURED: [&str; 2] = ["base_color_texture", "normal_map_texture"];

/// Whether cards stand for a mesh with a material: it has the texture that they show.
pub(crate) fn stand_for(cards: &CardLevels, material: &StandardMaterial) -> bool {
    let texture = material.base_color_texture.as_ref().map(Handle::id);
    may_be_cards(material) && *cards.texture.get_or_init(|| texture) == texture
}

/// Whether pictures of colours, opacity and normals can stand for a material: it has no other texture, and what is
/// drawn of it is opaque.
pub(crate) fn may_be_cards(material: &StandardMaterial) -> bool {
    let is_opaque = match material.alpha_mode {
        AlphaMode::Opaque => true,
        AlphaMode::Mask(cutoff) => material.base_color.alpha() >= cutoff,
        _ => false,
    };
    // By their type, as features add some.
    let has_other_texture = (0..material.field_len()).any(|index| {
        let texture = material
            .field_at(index)
            .and_then(|field| field.try_downcast_ref::<Option<Handle<Image>>>());
        let name = material.name_at(index).unwrap_or_default();
        texture.is_some_and(Option::is_some) && !PICTURED.contains(&name)
    });
    is_opaque && !has_other_texture
}

/// The material of cards that stand for a mesh with the material `source`; `None` if they do not.
pub(super) fn card_material(
    source: &StandardMaterial,
    cards: &CardLevels,
) -> Option<StandardMaterial> {
    if !stand_for(cards, source) {
        return None;
    }
    let LinearRgba {
        red, green, blue, ..
    } = source.base_color.to_linear();
    let tint = cards.tint;
    Some(StandardMaterial {
        base_color: Color::linear_rgb(red * tint.x, green * tint.y, blue * tint.z),
        base_color_channel: UvChannel::Uv0,
        base_color_texture: Some(cards.colors.clone()),
        normal_map_channel: UvChannel::Uv0,
        normal_map_texture: Some(cards.normals.clone()),
        flip_normal_map_y: false,
        uv_transform: Affine2::IDENTITY,
        alpha_mode: AlphaMode::Mask(CUTOFF),
        double_sided: cards.turns_over,
        cull_mode: None,
        ..source.clone()
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bevy::asset::Assets;
    use bevy::math::Vec3;
    use fieldlod_hierarchy::{CardPicture, Cards};

    use super::*;
    use crate::cards::card_levels::PreparedPicture;

    #[test]
    fn backs_of_cards_are_lit_as_their_picture_says() {
        for turns_over in [false, true] {
            let picture = CardPicture {
                side_texels: 1,
                colors: vec![[255; 4]],
                normals: vec![[128, 128, 255]],
                turns_over,
                tint: Vec3::ONE,
            };
            let cards = Cards {
                picture: Arc::new(picture),
                ..Cards::default()
            };
            let prepared = PreparedPicture::of(&cards, 1, vec![0], None);
            let cards = prepared.add_to(&mut Assets::default());
            let material = card_material(&StandardMaterial::default(), &cards).unwrap();
            assert_eq!(
                (material.double_sided, material.cull_mode),
                (turns_over, None)
            );
        }
    }

    #[test]
    fn pictures_stand_for_colours_and_normals_alone() {
        let image = Some(Handle::<Image>::default());
        let plain = StandardMaterial {
            base_color_texture: image.clone(),
            normal_map_texture: image.clone(),
            alpha_mode: AlphaMode::Mask(0.3),
            ..StandardMaterial::default()
        };
        assert!(may_be_cards(&plain));
        let glowing = StandardMaterial {
            emissive_texture: image.clone(),
            ..plain.clone()
        };
        let rough = StandardMaterial {
            metallic_roughness_texture: image,
            ..plain.clone()
        };
        let clear = StandardMaterial {
            alpha_mode: AlphaMode::Blend,
            ..plain
        };
        for material in [glowing, rough, clear] {
            assert!(!may_be_cards(&material));
        }
    }
}
