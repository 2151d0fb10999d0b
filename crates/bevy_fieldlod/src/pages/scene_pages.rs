//! Streams the large meshes of glTF scenes that `fieldlod bake --scene` wrote.

use bevy::gltf::GltfExtras;
use bevy::prelude::*;

use crate::assets::standalone::{LodMesh3d, StandaloneSteps};

/// Inserts a [`LodMesh3d`] on primitives with a `.fieldpages` file in their glTF `extras`.
pub(super) fn plugin(app: &mut App) {
    app.add_systems(
        PostUpdate,
        stream_primitives
            .run_if(any_match_filter::<NewPrimitives>)
            // The file is awaited, and perhaps drawn, in the same frame.
            .before(StandaloneSteps::Await),
    );
}

type NewPrimitives = (Added<GltfExtras>, With<Mesh3d>, Without<LodMesh3d>);

fn stream_primitives(
    mut commands: Commands,
    primitives: Query<(Entity, &GltfExtras, &Mesh3d), NewPrimitives>,
    assets: Res<AssetServer>,
) {
    for (entity, extras, mesh) in &primitives {
        let Some((file, mesh_index, primitive_index)) = place_of(&extras.value) else {
            continue;
        };
        let scene = assets.get_path(mesh.id());
        if let Some(Ok(path)) = scene.map(|scene| scene.resolve_embed_str(&file)) {
            let mesh = LodMesh3d::new(assets.load(path), mesh_index, primitive_index);
            commands.entity(entity).try_insert(mesh);
        }
    }
}

/// The file, mesh and primitive in `extras`.
fn place_of(extras: &str) -> Option<(String, u32, u32)> {
    // Most extras belong to games; this check avoids parsing them.
    if !extras.contains("fieldlod") {
        return None;
    }
    let extras: serde_json::Value = serde_json::from_str(extras).ok()?;
    let place = &extras["fieldlod"];
    let number = |name: &str| u32::try_from(place[name].as_u64()?).ok();
    let file = place["pages"].as_str()?.to_owned();
    Some((file, number("mesh")?, number("primitive")?))
}

#[cfg(test)]
mod tests {
    use super::place_of;

    #[test]
    fn other_extras_are_ignored() {
        let named = r#"{"of":"a game","fieldlod":{"pages":"a.fieldpages","mesh":3,"primitive":1}}"#;
        assert_eq!(place_of(named), Some(("a.fieldpages".into(), 3, 1)));
        for other in [
            "",
            "7",
            r#"{"fieldlod":{"pages":"a.fieldpages","mesh":-3,"primitive":1}}"#,
            r#"{"fieldlod":7}"#,
            r#"{"fieldlod":{"mesh":3,"primitive":1}}"#,
        ] {
            assert_eq!(place_of(other), None, "{other}");
        }
    }
}
