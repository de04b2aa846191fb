//! Meshes from OBJ and glTF files.
//!
//! A mesh needs texture coordinates, by which cloth lies on it: the warp runs along u. Where a file has no normals they are those
//! of the triangles; where it has no tangents they are derived as by Mikkelsen's reference, which engines and modellers share.

use std::collections::{BTreeMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec2, Vec3};

use super::gltf::{self, Camera, Contents, Light};
use super::{Mesh, obj};
use crate::text::{cut, read_capped};

/// The most bytes of a file.
pub const MAX_MESH_BYTES: u64 = 1 << 30;

/// More corners than fit into some gigabytes: a small file may name the same triangles many times.
pub(super) const MAX_CORNERS: usize = 3 << 23;

/// As many as a file may have that does not have as many bytes: its nodes name the same triangles again and again.
pub(super) const MAX_REPEATED: usize = 3 << 20;

/// The largest coordinate.
const MAX_COORDINATE: f32 = 1e30;

/// Why a file is no mesh that cloth can lie on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// It cannot be read, or is too large.
    #[error("cannot read {0}")]
    Read(PathBuf, #[source] io::Error),
    /// Its name ends in nothing that is known.
    #[error("{0} is neither .obj nor .gltf nor .glb")]
    Unknown(PathBuf),
    /// It is no OBJ file.
    #[error("{0} is no OBJ file that can be read: {1}")]
    Obj(PathBuf, String),
    /// It is no glTF file.
    #[error("{0} is no glTF file that can be read: {1}")]
    Gltf(PathBuf, String),
    /// There are no triangles.
    #[error("{0} has no triangles")]
    Empty(PathBuf),
    /// There are no texture coordinates; where.
    #[error(
        "{0} has triangles without texture coordinates ({1}); cloth lies along them: unwrap the mesh and export it with UVs"
    )]
    NoUvs(PathBuf, String),
    /// A number is not finite; where.
    #[error("{0} has a vertex that is no number ({1})")]
    Broken(PathBuf, String),
    /// A coordinate is beyond what can be added up.
    #[error("{0} is too large: its coordinates go beyond 1e30")]
    TooWide(PathBuf),
}

/// What an OBJ, glTF or GLB file has, its triangles in the places that the file's nodes put them.
pub struct MeshFile {
    path: PathBuf,
    contents: Contents,
}

/// What a file has of one material.
pub struct Part {
    /// What the file calls the material, where it names one; OBJ files' are not read.
    pub material: Option<String>,
    path: PathBuf,
    corners: Vec<Corner>,
}

/// Reads all triangles of a file.
///
/// # Errors
/// [`MeshError`] says what is wrong.
pub fn load_mesh(path: &Path) -> Result<Mesh, MeshError> {
    let MeshFile { path, contents } = MeshFile::read(path)?;
    let materials = &contents.materials;
    let of = |corner: &Corner| {
        corner
            .material
            .and_then(|index| materials[index].as_deref())
    };
    if let Some(bare) = contents.corners.iter().find(|corner| corner.uv.is_none()) {
        return Err(without_uvs(&path, of(bare)));
    }
    Ok(to_mesh(Corners(contents.corners)))
}

fn without_uvs(path: &Path, material: Option<&str>) -> MeshError {
    let place = material.map_or("without a material".to_owned(), |name| {
        format!("of the material \"{}\"", cut(name))
    });
    MeshError::NoUvs(path.to_owned(), place)
}

impl MeshFile {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`MeshError`] says what is wrong.
    pub fn read(path: &Path) -> Result<Self, MeshError> {
        Self::from_bytes(path, || read_capped(path, MAX_MESH_BYTES))
    }

    /// The same, with what is read of `path` itself.
    #[doc(hidden)]
    pub fn from_bytes(
        path: &Path,
        read: impl Fn() -> io::Result<Vec<u8>>,
    ) -> Result<Self, MeshError> {
        let of = || path.to_owned();
        let bytes = || read().map_err(|error| MeshError::Read(of(), error));
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        let contents = match extension.to_str() {
            Some("obj") => Contents {
                corners: obj::read(path, &bytes()?)?,
                materials: Vec::new(),
                cameras: Vec::new(),
                lights: Vec::new(),
                motion: None,
            },
            Some("gltf" | "glb") => gltf::read(path, &bytes()?).map_err(|fault| match fault {
                gltf::Fault::Unreadable(why) => MeshError::Gltf(of(), why),
                gltf::Fault::Broken(place) => MeshError::Broken(of(), place),
            })?,
            _ => return Err(MeshError::Unknown(of())),
        };
        let corners = &contents.corners;
        if corners.is_empty() {
            return Err(MeshError::Empty(of()));
        }
        let widest = |corner: &Corner| corner.position.abs().max_element();
        if corners.iter().any(|corner| widest(corner) > MAX_COORDINATE) {
            return Err(MeshError::TooWide(of()));
        }
        let path = of();
        Ok(Self { path, contents })
    }

    /// Cameras of a glTF file.
    pub fn cameras(&self) -> &[Camera] {
        &self.contents.cameras
    }

    /// Lights of a glTF file.
    pub fn lights(&self) -> &[Light] {
        &self.contents.lights
    }

    /// What moves in a glTF file and is read as it stands: the first animation, or a skin.
    pub fn motion(&self) -> Option<&str> {
        self.contents.motion.as_deref()
    }

    /// Its triangles by material, in alphabetical order.
    pub fn into_parts(self) -> Vec<Part> {
        let Contents {
            corners, materials, ..
        } = self.contents;
        let mut parts: BTreeMap<Option<String>, Vec<Corner>> = BTreeMap::new();
        for triangle in corners.as_chunks::<3>().0 {
            let material = triangle[0].material.and_then(|index| materials.get(index));
            let part = parts.entry(material.cloned().flatten()).or_default();
            part.extend_from_slice(triangle);
        }
        let part = |(material, corners)| Part {
            material,
            path: self.path.clone(),
            corners,
        };
        parts.into_iter().map(part).collect()
    }
}

impl Part {
    /// Its triangles.
    ///
    /// # Errors
    /// [`MeshError::NoUvs`] if cloth cannot lie on them.
    pub fn into_mesh(self) -> Result<Mesh, MeshError> {
        if self.corners.iter().any(|corner| corner.uv.is_none()) {
            return Err(without_uvs(&self.path, self.material.as_deref()));
        }
        Ok(to_mesh(Corners(self.corners)))
    }
}

/// A corner of a triangle; three in a row are one.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub(super) position: Vec3,
    pub(super) normal: Option<Vec3>,
    pub(super) uv: Option<Vec2>,
    pub(super) warp: Option<Vec3>,
    /// Whether the weft runs against normal × warp, where the warp is known.
    pub(super) mirrored: bool,
    /// Whether v grows down an image, as in glTF, where texture coordinates that are not mirrored make a left-handed frame then.
    pub(super) v_down: bool,
    /// Index of its material, of files that name them.
    pub(super) material: Option<usize>,
}

impl Corner {
    /// What tells it from others.
    fn bits(&self) -> [u32; 8] {
        let [x, y, z] = self.position.to_array();
        let [u, v] = self.uv.unwrap_or_default().to_array();
        let [a, b, c] = self.normal.unwrap_or_default().to_array();
        [x, y, z, u, v, a, b, c].map(f32::to_bits)
    }

    pub(super) fn is_finite(&self) -> bool {
        let optional = |vector: Option<Vec3>| vector.is_none_or(Vec3::is_finite);
        self.position.is_finite()
            && self.uv.is_none_or(Vec2::is_finite)
            && optional(self.normal)
            && optional(self.warp)
    }
}

/// Corners, every one a vertex of its own.
struct Corners(Vec<Corner>);

fn to_mesh(mut corners: Corners) -> Mesh {
    for triangle in corners.0.as_chunks_mut::<3>().0 {
        let [a, b, c] = triangle.each_ref().map(|corner| corner.position.as_dvec3());
        let flat = (b - a).cross(c - a).normalize_or(DVec3::Z).as_vec3();
        for corner in triangle {
            let normal = corner.normal.unwrap_or(flat);
            corner.normal = Some(normal.normalize_or(flat));
        }
    }
    if corners.0.iter().any(|corner| corner.warp.is_none()) {
        // Time grows by the square of the triangles at an edge.
        let mut seen = HashSet::new();
        let triangles = corners.0.as_chunks::<3>().0.iter();
        let once = triangles.filter(|triangle| seen.insert(triangle.each_ref().map(Corner::bits)));
        corners.0 = once.flatten().copied().collect();
        // What is left without is degenerate, and any direction is as good.
        let _ = generate_tangents(&mut corners);
    }
    let mut mesh = Mesh::default();
    for corner in &corners.0 {
        let normal = corner.normal.unwrap_or(Vec3::Z);
        mesh.positions.push(corner.position);
        mesh.normals.push(normal);
        mesh.warps
            .push(corner.warp.unwrap_or(normal.any_orthogonal_vector()));
        mesh.mirrored.push(corner.mirrored);
        mesh.uvs.push(corner.uv.unwrap_or_default());
    }
    let count = corners.0.len() as u32 / 3;
    mesh.triangles = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    mesh
}

impl Geometry for Corners {
    fn num_faces(&self) -> usize {
        self.0.len() / 3
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vertex: usize) -> [f32; 3] {
        self.0[3 * face + vertex].position.to_array()
    }

    fn normal(&self, face: usize, vertex: usize) -> [f32; 3] {
        self.0[3 * face + vertex]
            .normal
            .unwrap_or(Vec3::Z)
            .to_array()
    }

    fn tex_coord(&self, face: usize, vertex: usize) -> [f32; 2] {
        let corner = &self.0[3 * face + vertex];
        let [u, v] = corner.uv.unwrap_or_default().to_array();
        [u, if corner.v_down { 1.0 - v } else { v }]
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, vertex: usize) {
        let corner = &mut self.0[3 * face + vertex];
        // The file's own are kept.
        if let (None, Some(tangent)) = (corner.warp, tangent) {
            corner.warp = Some(Vec3::from(tangent.tangent()));
            corner.mirrored = !tangent.is_orientation_preserving();
        }
    }
}
