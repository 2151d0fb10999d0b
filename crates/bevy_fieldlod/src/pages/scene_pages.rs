//! Scenes whose large meshes are in a `.fieldpages` file beside them, as `fieldlod bake --scene` writes them.

use bevy::gltf::GltfExtras;
use bevy::prelude::*;

use crate::api::systems::FieldLodSystems;
use crate::assets::standalone::LodMesh3d;

/// Draws large meshes of such scenes from the file that their `extras` name.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(
        PostUpdate,
        name_files
            .run_if(any_match_filter::<NewPrimitives>)
            .before(FieldLodSystems::Track)
            .before(crate::assets::standalone::await_files),
    );
}

type NewPrimitives = (Added<GltfExtras>, With<Mesh3d>, Without<LodMesh3d>);

fn name_files(
    mut commands: Commands,
    primitives: Query<(Entity, &GltfExtras, &Mesh3d), NewPrimitives>,
    assets: Res<AssetServer>,
) {
    for (entity, extras, mesh) in &primitives {
        // Where it lies beside is known of meshes that come from a file.
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

/// File, mesh and primitive that `extras` name.
fn place_of(extras: &str) -> Option<(String, u32, u32)> {
    // Games have extras of their own.
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
    fn extras_of_games_name_no_file() {
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
