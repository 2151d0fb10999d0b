//! Places skinned meshes by the pose of one of their joints, as Bevy ignores the transform of their entities.

use bevy::ecs::system::SystemParam;
use bevy::math::Affine3A;
use bevy::mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes};
use bevy::prelude::*;

use crate::scene::lod_mesh::LodObject;

/// The poses of skinned objects.
#[derive(SystemParam)]
pub(crate) struct SkinPoses<'w, 's> {
    skinned: Query<'w, 's, (Entity, &'static LodObject, Ref<'static, SkinnedMesh>)>,
    transforms: Query<'w, 's, Ref<'static, GlobalTransform>>,
    inverse_binds: Option<Res<'w, Assets<SkinnedMeshInverseBindposes>>>,
}

impl SkinPoses<'_, '_> {
    /// The skinned objects whose joint or skin has changed since the system last ran.
    pub(crate) fn moved(&self) -> impl Iterator<Item = Entity> {
        let moved = self.skinned.iter().filter(|(entity, object, skin)| {
            // A skin without a carrier joint is placed by its entity.
            let carrier = carrier_of(object, skin).map_or(*entity, |(_, joint)| joint);
            skin.is_changed() || self.transforms.get(carrier).is_ok_and(|at| at.is_changed())
        });
        moved.map(|(entity, ..)| entity)
    }

    /// The transform of a skinned object from local space to the world, by its carrier joint; `None` without a skin.
    pub(crate) fn world_from_local(&self, entity: Entity) -> Option<Affine3A> {
        let (_, object, skin) = self.skinned.get(entity).ok()?;
        let (index, joint) = carrier_of(object, &skin)?;
        let inverse_binds = self.inverse_binds.as_ref()?.get(&skin.inverse_bindposes)?;
        let world_from_joint = self.transforms.get(joint).ok()?.affine();
        // Bevy skins a vertex by its joints alone: world from joint, joint from mesh.
        Some(world_from_joint * Affine3A::from_mat4(*inverse_binds.get(index)?))
    }
}

/// The joint that carries a skinned object, and its index in the skin.
fn carrier_of(object: &LodObject, skin: &SkinnedMesh) -> Option<(usize, Entity)> {
    let index = usize::from(object.mesh.rig?.carrier_joint?);
    Some((index, *skin.joints.get(index)?))
}
