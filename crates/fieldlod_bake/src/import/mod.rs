//! Reads the triangle meshes of a glTF 2.0 file, and the skins, morph targets and animations that move them.
//!
//! In: the bytes of a file, and a function that reads the files beside it. Out: an [`Import`].
//!
//! Positions and triangles equal the result of Bevy's own loader, bit for bit and in the same order. A hierarchy that
//! is baked from a file therefore fits the mesh that Bevy draws:
//!
//! - a triangle list without normals gets three vertices and a flat normal for each triangle;
//! - a primitive without indices gets the indices 0, 1, 2, …;
//! - attributes in formats that Bevy drops are dropped.
//!
//! Unlike in Bevy, vertices that no triangle uses are left out, because primitives may share one large vertex buffer.
//! The plugin compares used vertices only.
//!
//! Bevy 0.19 does not read quantized positions (`KHR_mesh_quantization`). They become floating-point numbers in the
//! quantized units of the mesh, which the transform of the node undoes. Bevy does not read buffer views compressed by
//! `EXT_meshopt_compression` or `KHR_meshopt_compression` either. They are decoded. Draco compression is an error.
//!
//! Base colours and alpha of materials become the [`Surface`](crate::Surface) of a mesh, with textures in PNG or JPEG.
//!
//! Strips and fans become lists, wound as the glTF specification defines. Every range is checked before it is read, and
//! no file causes a panic.

mod accessor;
mod buffers;
mod document;
mod error;
mod format;
mod images;
mod material;
mod meshopt_views;
mod primitive;
pub(crate) mod rig;
mod rig_fault;
mod unpack;

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

pub use error::{
    AccessorFault, BufferFault, ImportError, PrimitiveFault, PrimitivePlace, SkipReason,
};
pub use images::{ImageFault, UnreadImage};
pub use meshopt_views::PackedViewFault;
pub use rig::{Channel, Clip, Interpolation, Node, Property, Rig, Skin};
pub use rig_fault::{ClipFault, RigFault};
pub use unpack::{UnpackedGltf, unpack_gltf};

use gltf::Document;

use crate::mesh::SourceMesh;
use buffers::Buffers;
use material::Materials;

/// Reads a file beside a glTF file, by its name. Names may contain `..` or be absolute paths.
pub(crate) type ReadBeside<'a> = dyn Fn(&str) -> std::io::Result<Vec<u8>> + Sync + 'a;

/// The contents of a file that a bake uses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The primitives that can have levels of detail, in the order of the file. Skinned and morphed primitives have a
    /// rig.
    pub primitives: Vec<ImportedPrimitive>,
    /// The primitives that cannot have levels of detail, and why.
    pub skipped: Vec<Skipped>,
    /// Images that could not be read. Primitives with them have no surface.
    pub unread_images: Vec<UnreadImage>,
    /// The skins. A faulty skin has no joints.
    pub skins: Vec<Skin>,
    /// All nodes.
    pub nodes: Vec<Node>,
    /// The animations. Faulty animations are left out.
    pub clips: Vec<Clip>,
    /// For each mesh of the file, a number that meshes with the same global transform share.
    pub(crate) space_of_mesh: Vec<u32>,
}

impl Import {
    /// The first fault of a skipped primitive.
    #[must_use]
    pub fn first_fault(&self) -> Option<ImportError> {
        let mut skipped = self.skipped.iter();
        skipped.find_map(|skipped| match &skipped.reason {
            SkipReason::Faulty(fault) => Some(ImportError::Primitive {
                place: skipped.place.clone(),
                fault: fault.clone(),
            }),
            _ => None,
        })
    }

    /// A number that meshes of the file with the same global transform share. Meshes that are placed several times share
    /// none.
    #[must_use]
    pub fn space_of_mesh(&self, mesh: u32) -> u32 {
        self.space_of_mesh[mesh as usize]
    }

    /// Adds the clips of another file. They move the nodes of this file with the same names; animations of other nodes
    /// are ignored.
    ///
    /// # Errors
    /// If a name is ambiguous, or if no clip moves a node of this file. Nothing is added then.
    pub fn add_clips(&mut self, file: Self) -> Result<(), ClipFault> {
        let (own, others) = (nodes_by_name(&self.nodes), nodes_by_name(&file.nodes));
        let own_channel = |channel: &Channel| {
            let name = &*file.nodes[channel.node as usize].name;
            let found = own.get(name).filter(|_| !name.is_empty())?;
            let is_ambiguous = found.len() > 1 || others[name].len() > 1;
            Some(if is_ambiguous {
                Err(ClipFault::AmbiguousNode(name.to_owned()))
            } else {
                let node = found[0];
                let channel = channel.clone();
                Ok(Channel { node, ..channel })
            })
        };
        let mut clips = Vec::new();
        for Clip { name, channels } in &file.clips {
            let channels = channels.iter().filter_map(own_channel);
            let channels: Vec<Channel> = channels.collect::<Result<_, _>>()?;
            let name = name.clone();
            clips.push(Clip { name, channels });
        }
        // A clip that moves only other nodes would add nothing but the bind pose.
        clips.retain(|clip| !clip.channels.is_empty());
        if clips.is_empty() {
            return Err(ClipFault::NoNode);
        }
        self.clips.extend(clips);
        Ok(())
    }
}

fn nodes_by_name(nodes: &[Node]) -> HashMap<&str, Vec<u32>> {
    let mut by_name: HashMap<&str, Vec<u32>> = HashMap::new();
    for (index, node) in (0..).zip(nodes) {
        by_name.entry(&node.name).or_default().push(index);
    }
    by_name
}

/// One primitive of a glTF mesh, in its local space.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedPrimitive {
    /// Its place in the file.
    pub place: PrimitivePlace,
    /// The triangles of the primitive and the vertices that they use, in the order of the file. The mesh is valid.
    pub mesh: SourceMesh,
    /// The skin and morph targets, with one value per vertex of `mesh`.
    pub rig: Option<Rig>,
}

/// A primitive that is drawn, but without levels of detail.
#[derive(Clone, Debug, PartialEq)]
pub struct Skipped {
    /// Its place in the file.
    pub place: PrimitivePlace,
    /// Why it has no levels of detail.
    pub reason: SkipReason,
}

/// Reads the triangle meshes of a `.gltf` or `.glb` file, with the surfaces of their materials. Only images of base
/// colours are read. [`Import::unread_images`] lists images that could not be read. A faulty primitive is skipped.
///
/// # Errors
/// An [`ImportError`]. No bytes cause a panic.
pub fn import_gltf(path: &Path) -> Result<Import, ImportError> {
    let bytes = std::fs::read(path).map_err(ImportError::Read)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    import_gltf_bytes(&bytes, &|name| std::fs::read(folder.join(name)))
}

/// [`import_gltf`] for the bytes of a file. `beside` reads external buffers and images by name.
///
/// # Errors
/// The errors of [`import_gltf`].
pub fn import_gltf_bytes(bytes: &[u8], beside: &ReadBeside<'_>) -> Result<Import, ImportError> {
    let read = document::read(bytes)?;
    let document = &read.document;
    let buffers = &Buffers::load(document, read.blob, beside)?;
    let skins = rig::read_skins(document, buffers);
    let nodes = rig::nodes_of(document);
    let mut import = Import {
        space_of_mesh: document::spaces_of_meshes(&nodes, document.meshes().len()),
        clips: rig::clips::read_clips(&read.animations, document, buffers),
        nodes,
        ..Import::default()
    };
    let materials = read_primitives(&mut import, document, buffers, &skins);
    // Images of unused materials are never decoded.
    let used: BTreeSet<usize> = materials.iter().copied().flatten().collect();
    let of_file = Materials {
        document,
        buffers,
        beside,
    };
    let (surfaces, unread_images) = of_file.surfaces(&used);
    // A primitive without a material has no surface, because a game may give it any material.
    for (primitive, material) in import.primitives.iter_mut().zip(materials) {
        primitive.mesh.surface = material.and_then(|material| surfaces.get(&material).cloned());
    }
    import.unread_images = unread_images;
    import.skins = skins.into_iter().map(Result::unwrap_or_default).collect();
    Ok(import)
}

/// Adds all primitives to an import. Returns the materials of primitives that are not skipped.
fn read_primitives(
    import: &mut Import,
    document: &Document,
    buffers: &Buffers,
    skins: &[Result<Skin, PrimitiveFault>],
) -> Vec<Option<usize>> {
    let skins_of_meshes = rig::skins_of_meshes(document);
    let mut materials = Vec::new();
    for mesh in document.meshes() {
        for primitive in mesh.primitives() {
            let place = PrimitivePlace {
                mesh_index: mesh.index() as u32,
                primitive_index: primitive.index() as u32,
                name: mesh.name().unwrap_or_default().to_owned(),
            };
            let read = || {
                if let Some(reason) = primitive::skip_reason(&primitive) {
                    return Err(reason);
                }
                let skins = skins_of(&skins_of_meshes[mesh.index()], skins);
                let read = skins.and_then(|skins| primitive::read(&primitive, buffers, &skins));
                match read {
                    Ok((mesh, _)) if mesh.indices.is_empty() => Err(SkipReason::NoTriangles),
                    read => read.map_err(SkipReason::Faulty),
                }
            };
            match read() {
                Ok((mesh, rig)) => {
                    let imported = ImportedPrimitive { place, mesh, rig };
                    import.primitives.push(imported);
                    materials.push(primitive.material().index());
                }
                Err(reason) => import.skipped.push(Skipped { place, reason }),
            }
        }
    }
    materials
}

/// The usable skins of a mesh with their indices. Fails if there are only faulty skins.
fn skins_of<'a>(
    of_mesh: &BTreeSet<Option<u32>>,
    skins: &'a [Result<Skin, PrimitiveFault>],
) -> Result<Vec<(u32, &'a Skin)>, PrimitiveFault> {
    let indices: Vec<u32> = of_mesh.iter().copied().flatten().collect();
    if (1..of_mesh.len()).contains(&indices.len()) {
        return Err(RigFault::PartlySkinned.into());
    }
    let read = |&index: &u32| Some((index, skins[index as usize].as_ref().ok()?));
    let usable: Vec<_> = indices.iter().filter_map(read).collect();
    let mut faults = indices
        .iter()
        .filter_map(|&i| skins[i as usize].as_ref().err());
    match faults.next() {
        Some(fault) if usable.is_empty() => Err(fault.clone()),
        _ => Ok(usable),
    }
}
