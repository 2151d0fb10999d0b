//! What differs between the versions of Bevy that this plugin is built for. The package `bevy-0.20` sets `bevy_0_20`.

use std::borrow::Cow;

use bevy::mesh::{MeshVertexAttributeId, VertexAttributeValues};
#[cfg(feature = "debug")]
use bevy::prelude::Shader;
use bevy::prelude::{Add, Mesh, On, Remove};
use bevy::render::sync_world::MainEntity;
use bevy::render::view::{RenderVisibleEntities, RetainedViewEntity};

#[cfg(not(bevy_0_20))]
mod version {
    use super::*;
    use bevy::ecs::lifecycle::Discard;
    use bevy::prelude::Entity;

    pub(crate) type OnAdd<'w, 't, C> = On<'w, 't, Add, C>;
    pub(crate) type OnRemove<'w, 't, C> = On<'w, 't, Remove, C>;
    pub(crate) type OnDiscard<'w, 't, C> = On<'w, 't, Discard, C>;

    #[cfg(feature = "debug")]
    pub(crate) use bevy::math::bounding::Aabb3d;

    #[cfg(feature = "debug")]
    pub(crate) fn translated_shader(source: &'static str, path: &str) -> Shader {
        Shader::from_wgsl(source, path)
    }

    pub(crate) fn camera_of_cascade(view: &RetainedViewEntity) -> Option<MainEntity> {
        let camera = view.auxiliary_entity;
        (camera.id() != Entity::PLACEHOLDER).then_some(camera)
    }

    pub(crate) fn list_of_subview(list: &mut RenderVisibleEntities) -> &mut RenderVisibleEntities {
        list
    }

    #[cfg(feature = "bake")]
    pub(crate) fn is_compressed(_: &Mesh) -> bool {
        false
    }

    pub(crate) fn decompressed<'a>(
        _: &Mesh,
        _: MeshVertexAttributeId,
        values: &'a VertexAttributeValues,
    ) -> Cow<'a, VertexAttributeValues> {
        Cow::Borrowed(values)
    }
}

#[cfg(bevy_0_20)]
mod version {
    use super::*;
    use bevy::ecs::change_detection::Tick;
    use bevy::ecs::lifecycle::Discard;
    use bevy::math::{Vec2, Vec3A};
    use bevy::mesh::{octahedral_decode_signed, octahedral_decode_tangent};
    use bevy::shape::BoundingVolume;

    pub(crate) type OnAdd<'w, 't, C> = On<'w, 't, Add<C>>;
    pub(crate) type OnRemove<'w, 't, C> = On<'w, 't, Remove<C>>;
    pub(crate) type OnDiscard<'w, 't, C> = On<'w, 't, Discard<C>>;

    #[cfg(feature = "debug")]
    pub(crate) use bevy::shape::Aabb3d;

    /// Translates a shader of Bevy 0.19 into WESL.
    #[cfg(feature = "debug")]
    pub(crate) fn translated_shader(source: &str, path: &str) -> Shader {
        let source = source.replace("#import bevy_pbr::{", "import bevy_pbr::render::{");
        let source = source.replace("::view}", "::view};");
        let source = source.replace("#{MATERIAL_BIND_GROUP}", "constants::MATERIAL_BIND_GROUP");
        Shader::from_wesl(source, path)
    }

    /// The camera of a shadow view, if it is one of the cascades of a camera.
    pub(crate) fn camera_of_cascade(view: &RetainedViewEntity) -> Option<MainEntity> {
        view.auxiliary_entity
    }

    /// The list of a shadow view.
    pub(crate) fn list_of_subview(
        list: &mut (Tick, RenderVisibleEntities),
    ) -> &mut RenderVisibleEntities {
        &mut list.1
    }

    /// Whether Bevy has compressed the mesh (`Mesh::compress_mesh`).
    #[cfg(feature = "bake")]
    pub(crate) fn is_compressed(mesh: &Mesh) -> bool {
        let positions = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION);
        matches!(positions, Ok(VertexAttributeValues::Snorm16x4(_)))
    }

    /// Undoes `Mesh::compress_mesh` in an attribute.
    pub(crate) fn decompressed<'a>(
        mesh: &Mesh,
        id: MeshVertexAttributeId,
        values: &'a VertexAttributeValues,
    ) -> Cow<'a, VertexAttributeValues> {
        use VertexAttributeValues::{Snorm16x2, Snorm16x4, Unorm8x4, Unorm16x2};
        let set = usize::from(id == Mesh::ATTRIBUTE_UV_1.id);
        let holds_uvs = set == 1 || id == Mesh::ATTRIBUTE_UV_0.id;
        let holds_positions = id == Mesh::ATTRIBUTE_POSITION.id;
        Cow::Owned(match values {
            Snorm16x4(values) if holds_positions && let Some(bounds) = mesh.final_aabb => {
                let (center, half_size) = (bounds.center(), bounds.half_size());
                map(values, |value| {
                    let [x, y, z, _] = value.map(of_snorm);
                    (center + Vec3A::new(x, y, z) * half_size).to_array()
                })
            }
            Snorm16x2(values) if id == Mesh::ATTRIBUTE_NORMAL.id => map(values, |value| {
                octahedral_decode_signed(value.map(of_snorm).into()).to_array()
            }),
            Snorm16x2(values) if id == Mesh::ATTRIBUTE_TANGENT.id => map(values, |value| {
                let (direction, sign) = octahedral_decode_tangent(value.map(of_snorm).into());
                direction.extend(sign).to_array()
            }),
            Unorm16x2(values) if holds_uvs && let Some(range) = mesh.final_uv_ranges[set] => {
                map(values, |value| {
                    let share = Vec2::from(value.map(|value| f32::from(value) / 65535.0));
                    (range.min + share * (range.max - range.min)).to_array()
                })
            }
            Unorm8x4(values) if id == Mesh::ATTRIBUTE_COLOR.id => {
                map(values, |value| value.map(|value| f32::from(value) / 255.0))
            }
            _ => return Cow::Borrowed(values),
        })
    }

    fn map<T: Copy, U>(values: &[T], decode: impl Fn(T) -> U) -> VertexAttributeValues
    where
        Vec<U>: Into<VertexAttributeValues>,
    {
        let values: Vec<U> = values.iter().copied().map(decode).collect();
        values.into()
    }

    fn of_snorm(value: i16) -> f32 {
        (f32::from(value) / 32767.0).max(-1.0)
    }
}

pub(crate) use version::*;
