//! Prepares one mesh in a background task: finds or bakes its hierarchy, and cuts it into the meshes of its
//! units.

use std::sync::{Arc, OnceLock};

use bevy::asset::{AssetId, AssetPath, AssetServer, RenderAssetUsages};
use bevy::camera::primitives::Aabb;
use bevy::image::Image;
use bevy::log::warn;
use bevy::mesh::{Mesh, MeshAccessError};
use fieldlod_hierarchy::{BakedFile, Hierarchy, Unit};
use fieldlod_select::GroupTable;

#[cfg(feature = "bake")]
use super::bake::BakeJob;
use super::sidecar::SidecarFiles;
use super::source_arrays::SourceArrays;
use super::stand_ins::{levels_of_triangles, stand_ins};
use crate::api::config::LodKind;
use crate::api::events::{LodError, LodOrigin};
use crate::cards::card_levels::{PreparedPicture, card_mesh};
use crate::pages::mesh_in_pages::MeshInPages;
use crate::scene::lod_mesh::LodPiece;
use crate::scene::unit_mesh::{simplified_mesh, unit_mesh};

/// What a background task is asked to do.
pub(super) struct PrepareJob {
    pub(super) mesh: Mesh,
    /// The name of the mesh in messages.
    pub(super) name: String,
    /// Which mesh of a glTF file it is, and which primitive of that, if it is one.
    pub(super) place: Option<[u32; 2]>,
    /// [`LodKind::WholeMesh`] or [`LodKind::Clusters`].
    pub(super) kind: LodKind,
    /// The level that rays and physics get.
    pub(super) simplified_level: Option<u32>,
    /// Whether its coarsest levels may be cards.
    pub(super) may_be_cards: bool,
    /// The texture of its material, by which it is baked.
    pub(super) texture: Option<AssetId<Image>>,
    /// A `.fieldlod` file, named for messages, that must hold the hierarchy.
    pub(super) file: Option<(String, Arc<BakedFile>)>,
    /// Where the mesh was loaded from, to look for a file there.
    pub(super) sidecar: Option<(AssetServer, AssetPath<'static>, Arc<SidecarFiles>)>,
    #[cfg(feature = "bake")]
    pub(super) bake: BakeJob,
}

/// A mesh with levels of detail that is not in the scene and in the assets yet.
pub(super) struct PreparedMesh {
    pub(super) kind: LodKind,
    pub(super) origin: LodOrigin,
    pub(super) table: GroupTable,
    /// What draws each unit, and what stands in for levels of cards.
    pub(super) pieces: Vec<PreparedPiece>,
    pub(super) triangles_full: u32,
    /// Whether deviations from the source were measured, on which guarantees rest.
    pub(super) is_measured: bool,
    pub(super) aabb: Option<Aabb>,
    pub(super) uv_per_area: f32,
    /// The mesh of the level that was asked for.
    pub(super) simplified: Option<Mesh>,
    /// Where what is not there yet comes from, if it is read in parts.
    pub(super) in_pages: Option<MeshInPages>,
    /// Of what its coarsest levels are, if they are cards.
    pub(super) picture: Option<PreparedPicture>,
}

/// What is drawn, with the mesh that it is to refer to.
type PreparedPiece = (LodPiece, Option<Mesh>);

/// Finds or bakes the hierarchy of a mesh and cuts it into the meshes to draw.
pub(super) async fn prepare(job: PrepareJob) -> Result<PreparedMesh, LodError> {
    let source = SourceArrays::of(&job.mesh)?;
    let uv_per_area = source.uv_per_area();
    let (mut baked, origin) = find_or_bake(&job, source).await?;
    if !job.may_be_cards {
        baked = baked.without_card_units().unwrap_or(baked);
        baked.cards = None;
    }
    let is_measured = baked.is_measured();
    let triangles_full = baked.source_triangle_count() as u32;
    // A level with more vertices than 16-bit indices reach cannot be drawn as a whole.
    let whole_meshes = match job.kind {
        LodKind::WholeMesh => baked.whole_mesh_levels(),
        _ => None,
    };
    let (kind, hierarchy, triangles) = match whole_meshes {
        Some(levels) => {
            let triangles = levels_of_triangles(baked, &levels);
            (LodKind::WholeMesh, levels, triangles)
        }
        // What is drawn in pieces has no cards.
        None => {
            let left = baked.without_card_units().unwrap_or(baked);
            (LodKind::Clusters, left, None)
        }
    };
    let aabbs = [Some(&hierarchy), triangles.as_ref()].into_iter().flatten();
    let aabbs = aabbs.filter_map(Hierarchy::aabb);
    let aabb = fieldlod_hierarchy::Aabb::around(aabbs.flat_map(|aabb| [aabb.min, aabb.max]));
    let cards = hierarchy.cards.as_ref().zip(first_of_cards(&hierarchy));
    // Rays and physics cannot go through what is transparent of cards.
    let last_of_triangles = cards.map_or(u32::MAX, |(_, first)| first.saturating_sub(1));
    let texture = match origin {
        LodOrigin::Baked | LodOrigin::Cache => Some(job.texture),
        _ => None,
    };
    let mut pieces = pieces_of(&job.mesh, &hierarchy, kind)?;
    let picture = match cards {
        Some((cards, first)) => {
            let stand_ins = add_stand_ins(&mut pieces, first, &job.mesh, triangles.as_ref())?;
            Some(PreparedPicture::of(cards, first, stand_ins, texture))
        }
        None => None,
    };
    Ok(PreparedMesh {
        kind,
        origin,
        table: GroupTable::new(&hierarchy),
        pieces,
        triangles_full,
        is_measured,
        aabb: aabb.map(|aabb| Aabb::from_min_max(aabb.min, aabb.max)),
        uv_per_area,
        simplified: job
            .simplified_level
            .map(|level| simplified_mesh(&hierarchy, level.min(last_of_triangles))),
        in_pages: None,
        picture,
    })
}

/// What of a mesh that is read in parts is there from the beginning. `coarsest` is what its coarsest cut draws.
pub(super) async fn prepare_pages(
    mesh: MeshInPages,
    coarsest: Mesh,
) -> Result<PreparedMesh, LodError> {
    let hierarchy = &mesh.paged().graph;
    let mut pieces: Vec<PreparedPiece> = (hierarchy.units.iter())
        .map(|unit| (piece_of(hierarchy, unit, OnceLock::new()), None))
        .collect();
    for unit in mesh.first_page()? {
        let (piece, mesh) = &mut pieces[unit.index as usize];
        piece.aabb = OnceLock::from(unit.aabb);
        *mesh = Some(unit.mesh);
    }
    Ok(PreparedMesh {
        kind: LodKind::Clusters,
        origin: LodOrigin::File,
        table: GroupTable::new(hierarchy),
        pieces,
        triangles_full: hierarchy.source_triangle_count() as u32,
        is_measured: hierarchy.is_measured(),
        aabb: mesh.aabb(),
        uv_per_area: SourceArrays::of(&coarsest)?.uv_per_area(),
        simplified: None,
        in_pages: Some(mesh),
        picture: None,
    })
}

/// What draws each unit.
fn pieces_of(
    source: &Mesh,
    hierarchy: &Hierarchy,
    kind: LodKind,
) -> Result<Vec<PreparedPiece>, MeshAccessError> {
    let usage = match kind {
        LodKind::WholeMesh => usage_of_whole_mesh(source),
        _ => RenderAssetUsages::RENDER_WORLD,
    };
    let cards = hierarchy.cards.as_ref().zip(first_of_cards(hierarchy));
    let cards_of = |unit: usize| {
        let (cards, first) = cards?;
        let level = unit.checked_sub(first as usize)?;
        Some((&cards.levels[level].cards, cards.picture.side_texels))
    };
    let piece = |(index, unit): (usize, &Unit)| {
        let is_drawable = source.asset_usage.contains(RenderAssetUsages::RENDER_WORLD);
        let is_source = kind == LodKind::WholeMesh && index == 0 && is_drawable;
        let mesh = (!is_source).then(|| match cards_of(index) {
            Some((cards, side_texels)) => Ok(card_mesh(cards, side_texels, usage)),
            None => unit_mesh(source, hierarchy, unit, usage),
        });
        let aabb = Aabb::from_min_max(unit.aabb.min, unit.aabb.max);
        let piece = piece_of(hierarchy, unit, OnceLock::from(aabb));
        Ok((piece, mesh.transpose()?))
    };
    hierarchy.units.iter().enumerate().map(piece).collect()
}

/// Rays are cast at the source of units, but at the level that a whole mesh is drawn at.
fn usage_of_whole_mesh(source: &Mesh) -> RenderAssetUsages {
    source.asset_usage | RenderAssetUsages::RENDER_WORLD
}

/// Adds what is drawn in place of the levels of cards from `first` on while cards cannot be: levels of `triangles`.
/// Returns the piece that stands in for each: where none of them errs as little, the last one above cards.
fn add_stand_ins(
    pieces: &mut Vec<PreparedPiece>,
    first: u32,
    source: &Mesh,
    triangles: Option<&Hierarchy>,
) -> Result<Vec<u32>, MeshAccessError> {
    let cards = first as usize..pieces.len();
    let above_cards = first.saturating_sub(1);
    let Some(triangles) = triangles else {
        return Ok(vec![above_cards; cards.len()]);
    };
    let (finest, _) = &pieces[above_cards as usize];
    let is_finer = |unit: &Unit| unit.triangle_count >= finest.triangles;
    let (_, units) = triangles
        .units
        .split_at(triangles.units.partition_point(is_finer));
    let new_piece = |unit: &Unit| {
        let aabb = Aabb::from_min_max(unit.aabb.min, unit.aabb.max);
        piece_of(triangles, unit, OnceLock::from(aabb))
    };
    let errors: Vec<f32> = units
        .iter()
        .map(|unit| new_piece(unit).error_in_local)
        .collect();
    let errors_of_cards = pieces[cards.clone()].iter();
    let errors_of_cards: Vec<f32> = errors_of_cards
        .map(|(piece, _)| piece.error_in_local)
        .collect();
    // Levels of cards may share one.
    let mut added = vec![None; units.len()];
    let mut chosen = Vec::new();
    for (level, unit) in cards.zip(stand_ins(&errors_of_cards, &errors)) {
        let Some(unit) = unit else {
            chosen.push(above_cards);
            continue;
        };
        if added[unit].is_none() {
            added[unit] = Some(pieces.len() as u32);
            let (replaced, _) = &pieces[level];
            let piece = LodPiece {
                level: replaced.level,
                produced_by: replaced.produced_by,
                ..new_piece(&units[unit])
            };
            let mesh = unit_mesh(source, triangles, &units[unit], usage_of_whole_mesh(source))?;
            pieces.push((piece, Some(mesh)));
        }
        chosen.extend(added[unit]);
    }
    Ok(chosen)
}

/// The first unit that is cards, if some are.
fn first_of_cards(hierarchy: &Hierarchy) -> Option<u32> {
    let units = hierarchy.card_units();
    (!units.is_empty()).then_some(units.start as u32)
}

fn piece_of(hierarchy: &Hierarchy, unit: &Unit, aabb: OnceLock<Aabb>) -> LodPiece {
    // The finest units are the source itself: no group has simplified them.
    let simplified_by = unit.producer();
    LodPiece {
        mesh: None,
        aabb,
        level: hierarchy.level_of(unit),
        triangles: unit.triangle_count,
        produced_by: simplified_by,
        error_in_local: simplified_by
            .map_or(0.0, |group| hierarchy.groups[group as usize].error_in_local),
    }
}

/// Takes the hierarchy from the file that was named, else from one beside the asset, else from the cache,
/// else bakes it.
async fn find_or_bake(
    job: &PrepareJob,
    source: SourceArrays,
) -> Result<(Hierarchy, LodOrigin), LodError> {
    // A file that was named must fit.
    if let Some((file, baked)) = &job.file {
        let found = source.find_hierarchy(baked, job.place, file)?;
        return Ok((found, LodOrigin::File));
    }
    // A file beside the asset may be out of date.
    if let Some((assets, path, sidecars)) = &job.sidecar
        && let Some((file, baked)) = sidecars.find(assets, path).await
    {
        let found = source.find_hierarchy(&baked, job.place, &file);
        #[cfg(feature = "bake")]
        let found = found.and_then(|found| job.bake.find_others(&baked, &file).map(|()| found));
        match found {
            Ok(found) => return Ok((found, LodOrigin::BesideAsset)),
            Err(error) => warn!("{}: {error}", job.name),
        }
    }
    // What was baked once is not baked again.
    #[cfg(feature = "bake")]
    return job.bake.run(source);
    #[cfg(not(feature = "bake"))]
    Err(LodError::BakeDisabled)
}
