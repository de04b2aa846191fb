//! Meshes from OBJ and glTF files.
//!
//! A mesh needs texture coordinates, by which cloth lies on it: the warp runs along u. Where a file has no normals they are those
//! of the triangles; where it has no tangents they are derived as by Mikkelsen's reference, which engines and modellers share.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Mat4, Vec2, Vec3};

use super::mesh::Mesh;

/// The most bytes of a file.
pub const MAX_MESH_BYTES: u64 = 1 << 30;

/// The largest coordinate.
const MAX_COORDINATE: f32 = 1e30;

/// Why a file is no mesh that cloth can lie on.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// It cannot be read.
    #[error("cannot read {0}")]
    Read(PathBuf, #[source] std::io::Error),
    /// It is too large.
    #[error("{0} is larger than 1 GiB")]
    TooLarge(PathBuf),
    /// Its name ends in nothing that is known.
    #[error("{0} is neither .obj nor .gltf nor .glb")]
    Unknown(PathBuf),
    /// It is no OBJ file.
    #[error("{0} is no OBJ file that can be read")]
    Obj(PathBuf, #[source] tobj::LoadError),
    /// It is no glTF file.
    #[error("{0} is no glTF file that can be read")]
    Gltf(PathBuf, #[source] Box<gltf::Error>),
    /// There are no triangles.
    #[error("{0} has no triangles")]
    Empty(PathBuf),
    /// There are no texture coordinates.
    #[error(
        "{0} has triangles without texture coordinates; cloth lies along them: unwrap the mesh and export it with UVs"
    )]
    NoUvs(PathBuf),
    /// A number is not finite, or an index beyond the vertices.
    #[error("{0} has a vertex that is no number, or an index beyond its vertices")]
    Broken(PathBuf),
    /// A coordinate is beyond what can be added up.
    #[error("{0} is too large: its coordinates go beyond 1e30")]
    TooWide(PathBuf),
}

/// What a file has of one material.
#[derive(Debug, Clone)]
pub struct Part {
    /// What the file calls the material, where it names one; OBJ files' are not read.
    pub material: Option<String>,
    /// Its triangles.
    pub mesh: Mesh,
}

/// Reads all triangles of an OBJ, glTF or GLB file, in the places that the file's nodes put them.
///
/// # Errors
/// [`MeshError`] says what is wrong.
pub fn load_mesh(path: &Path) -> Result<Mesh, MeshError> {
    Ok(to_mesh(load_corners(path)?.0))
}

/// The same, by material, in alphabetical order.
///
/// # Errors
/// [`MeshError`] says what is wrong.
pub fn load_parts(path: &Path) -> Result<Vec<Part>, MeshError> {
    let (corners, materials) = load_corners(path)?;
    let mut parts: BTreeMap<Option<String>, Vec<Corner>> = BTreeMap::new();
    for triangle in corners.0.as_chunks::<3>().0 {
        let material = triangle[0].material.and_then(|index| materials.get(index));
        let part = parts.entry(material.cloned().flatten()).or_default();
        part.extend_from_slice(triangle);
    }
    let part = |(material, corners)| Part {
        material,
        mesh: to_mesh(Corners(corners)),
    };
    Ok(parts.into_iter().map(part).collect())
}

/// Corners of all triangles, and the names of materials that they refer to.
fn load_corners(path: &Path) -> Result<(Corners, Vec<Option<String>>), MeshError> {
    let of = || path.to_owned();
    let size = fs::metadata(path)
        .map_err(|error| MeshError::Read(of(), error))?
        .len();
    if size > MAX_MESH_BYTES {
        return Err(MeshError::TooLarge(of()));
    }
    let bytes = || fs::read(path).map_err(|error| MeshError::Read(of(), error));
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let (corners, materials) = match extension.to_str() {
        Some("obj") => (from_obj(path, &bytes()?)?, Vec::new()),
        Some("gltf" | "glb") => from_gltf(path, &bytes()?)?,
        _ => return Err(MeshError::Unknown(of())),
    };
    if corners.is_empty() {
        return Err(MeshError::Empty(of()));
    }
    if !corners.iter().all(Corner::is_finite) {
        return Err(MeshError::Broken(of()));
    }
    let widest = |corner: &Corner| corner.position.abs().max_element();
    if corners.iter().any(|corner| widest(corner) > MAX_COORDINATE) {
        return Err(MeshError::TooWide(of()));
    }
    Ok((Corners(corners), materials))
}

/// A corner of a triangle; three in a row are one.
#[derive(Clone, Copy)]
struct Corner {
    position: Vec3,
    normal: Option<Vec3>,
    uv: Vec2,
    warp: Option<Vec3>,
    /// Index of its material, of files that name them.
    material: Option<usize>,
}

impl Corner {
    fn is_finite(&self) -> bool {
        let optional = |vector: Option<Vec3>| vector.is_none_or(Vec3::is_finite);
        self.position.is_finite()
            && self.uv.is_finite()
            && optional(self.normal)
            && optional(self.warp)
    }
}

fn from_obj(path: &Path, bytes: &[u8]) -> Result<Vec<Corner>, MeshError> {
    // Materials are of no concern.
    let no_materials = |_: &Path| tobj::MTLLoadResult::Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(
        &mut Cursor::new(bytes),
        &tobj::GPU_LOAD_OPTIONS,
        no_materials,
    )
    .map_err(|error| MeshError::Obj(path.to_owned(), error))?;
    let mut corners = Vec::new();
    for tobj::Model { mesh, .. } in models {
        if mesh.texcoords.is_empty() && !mesh.indices.is_empty() {
            return Err(MeshError::NoUvs(path.to_owned()));
        }
        for index in mesh.indices {
            let index = index as usize;
            let three =
                |numbers: &[f32]| numbers.get(3 * index..3 * index + 3).map(Vec3::from_slice);
            let position = three(&mesh.positions);
            let uv = mesh
                .texcoords
                .get(2 * index..2 * index + 2)
                .map(Vec2::from_slice);
            let (Some(position), Some(uv)) = (position, uv) else {
                return Err(MeshError::Broken(path.to_owned()));
            };
            corners.push(Corner {
                position,
                normal: three(&mesh.normals),
                uv,
                warp: None,
                material: None,
            });
        }
    }
    Ok(corners)
}

/// Corners of a file, and the names of its materials.
fn from_gltf(path: &Path, bytes: &[u8]) -> Result<(Vec<Corner>, Vec<Option<String>>), MeshError> {
    let wrong = |error: gltf::Error| MeshError::Gltf(path.to_owned(), Box::new(error));
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(bytes).map_err(wrong)?;
    let buffers = gltf::import_buffers(&document, path.parent(), blob).map_err(wrong)?;
    let mut corners = Vec::new();
    let mut open: Vec<(gltf::Node<'_>, Mat4)> = Vec::new();
    let scene = document
        .default_scene()
        .or_else(|| document.scenes().next());
    open.extend(
        scene
            .iter()
            .flat_map(|scene| scene.nodes())
            .map(|node| (node, Mat4::IDENTITY)),
    );
    while let Some((node, parent)) = open.pop() {
        let place = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        open.extend(node.children().map(|child| (child, place)));
        let primitives = node
            .mesh()
            .into_iter()
            .flat_map(|mesh| mesh.primitives().collect::<Vec<_>>());
        for primitive in
            primitives.filter(|primitive| primitive.mode() == gltf::mesh::Mode::Triangles)
        {
            let reader =
                primitive.reader(|buffer| buffers.get(buffer.index()).map(|data| &data.0[..]));
            let positions: Vec<_> = reader.read_positions().into_iter().flatten().collect();
            let normals: Vec<_> = reader.read_normals().into_iter().flatten().collect();
            let tangents: Vec<_> = reader.read_tangents().into_iter().flatten().collect();
            let uvs: Vec<_> = match reader.read_tex_coords(0) {
                Some(uvs) => uvs.into_f32().collect(),
                None => return Err(MeshError::NoUvs(path.to_owned())),
            };
            let indices: Vec<u32> = match reader.read_indices() {
                Some(indices) => indices.into_u32().collect(),
                None => (0..positions.len() as u32).collect(),
            };
            let whole = indices.len() / 3 * 3;
            let of_normals = place.inverse().transpose();
            for index in &indices[..whole] {
                let index = *index as usize;
                let (Some(position), Some(uv)) = (positions.get(index), uvs.get(index)) else {
                    return Err(MeshError::Broken(path.to_owned()));
                };
                corners.push(Corner {
                    position: place.transform_point3(Vec3::from(*position)),
                    normal: normals
                        .get(index)
                        .map(|normal| of_normals.transform_vector3(Vec3::from(*normal))),
                    uv: Vec2::from(*uv),
                    warp: tangents
                        .get(index)
                        .map(|[x, y, z, _]| place.transform_vector3(Vec3::new(*x, *y, *z))),
                    material: primitive.material().index(),
                });
            }
        }
    }
    let name = |material: gltf::Material<'_>| material.name().map(str::to_owned);
    Ok((corners, document.materials().map(name).collect()))
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
        mesh.uvs.push(corner.uv);
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
        self.0[3 * face + vertex].uv.to_array()
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, vertex: usize) {
        let warp = &mut self.0[3 * face + vertex].warp;
        // The file's own are kept.
        *warp = warp.or(tangent.map(|tangent| Vec3::from(tangent.tangent())));
    }
}
