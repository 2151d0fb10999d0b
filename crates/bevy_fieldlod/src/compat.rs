//! What differs between the versions of Bevy that this plugin is built for. The package in `bevy-0.20` sets `bevy_0_20`.

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

    pub(crate) fn decompressed(
        _: &Mesh,
        _: MeshVertexAttributeId,
        values: VertexAttributeValues,
    ) -> VertexAttributeValues {
        values
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

    pub(crate) fn list_of_subview(
        list: &mut (Tick, RenderVisibleEntities),
    ) -> &mut RenderVisibleEntities {
        &mut list.1
    }

    /// Undoes `Mesh::compress_mesh` in an attribute.
    pub(crate) fn decompressed(
        mesh: &Mesh,
        id: MeshVertexAttributeId,
        values: VertexAttributeValues,
    ) -> VertexAttributeValues {
        use VertexAttributeValues::{Snorm16x2, Snorm16x4, Unorm16x2};
        let set = usize::from(id == Mesh::ATTRIBUTE_UV_1.id);
        let holds_uvs = set == 1 || id == Mesh::ATTRIBUTE_UV_0.id;
        match values {
            Snorm16x4(values) if let Some(bounds) = mesh.final_aabb => {
                let at = |[x, y, z, _]: [f32; 4]| {
                    (bounds.center() + Vec3A::new(x, y, z) * bounds.half_size()).to_array()
                };
                let values = values.into_iter().map(|value| at(value.map(of_snorm)));
                values.collect::<Vec<_>>().into()
            }
            Snorm16x2(values) if id == Mesh::ATTRIBUTE_NORMAL.id => {
                let normal = |value: Vec2| octahedral_decode_signed(value).to_array();
                let values = values
                    .into_iter()
                    .map(|value| normal(value.map(of_snorm).into()));
                values.collect::<Vec<_>>().into()
            }
            Snorm16x2(values) if id == Mesh::ATTRIBUTE_TANGENT.id => {
                let tangent = |value: Vec2| {
                    let (direction, sign) = octahedral_decode_tangent(value);
                    direction.extend(sign).to_array()
                };
                let values = values
                    .into_iter()
                    .map(|value| tangent(value.map(of_snorm).into()));
                values.collect::<Vec<_>>().into()
            }
            Unorm16x2(values) if holds_uvs && let Some(range) = mesh.final_uv_ranges[set] => {
                let uv = |value: Vec2| (range.min + value * (range.max - range.min)).to_array();
                let values = values
                    .into_iter()
                    .map(|value| uv(value.map(of_unorm).into()));
                values.collect::<Vec<_>>().into()
            }
            values => values,
        }
    }

    fn of_snorm(value: i16) -> f32 {
        (f32::from(value) / 32767.0).max(-1.0)
    }

    fn of_unorm(value: u16) -> f32 {
        f32::from(value) / 65535.0
    }
}

pub(crate) use version::*;
