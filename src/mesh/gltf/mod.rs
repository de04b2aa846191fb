//! glTF 2.0: triangles, cameras and lights where a file's nodes put them.
//!
//! Everything that a file names by index, every offset and every count is checked before it is followed, and an error says which
//! entry is wrong. A node is visited once.

mod accessors;
mod buffers;
mod json;

use std::path::Path;

use glam::{DMat4, Mat4, Vec2, Vec3};

use self::accessors::Data;
use self::json::{Instancing, LightKind, Node, Primitive, Root};
use super::load::Corner;
use crate::text::cut;

/// Why a file cannot be used.
pub(super) enum Fault {
    Unreadable(String),
    /// Where a number is not finite.
    Broken(String),
}

impl From<String> for Fault {
    fn from(why: String) -> Self {
        Self::Unreadable(why)
    }
}

/// What a file has in its scene.
pub(super) struct Contents {
    pub(super) corners: Vec<Corner>,
    /// Names of materials.
    pub(super) materials: Vec<Option<String>>,
    pub(super) cameras: Vec<Camera>,
    pub(super) lights: Vec<Light>,
    /// What moves, which a picture of a moment leaves out.
    pub(super) motion: Option<String>,
}

/// A camera of a glTF file.
#[derive(Debug, Clone)]
pub struct Camera {
    /// Its own name, or that of its node.
    pub name: Option<String>,
    /// Its index and that of its node in the file.
    pub index: [usize; 2],
    /// From its own coordinates, in which it looks along −z with y up, to the file's.
    pub place: DMat4,
    /// How it projects.
    pub projection: Projection,
}

/// How a camera projects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Vertical field of view, radians.
    Perspective(f32),
    /// Half the height of what is seen.
    Orthographic(f32),
}

/// A light of a glTF file (KHR_lights_punctual).
#[derive(Debug, Clone)]
pub struct Light {
    /// Its own name, or that of its node.
    pub name: Option<String>,
    /// The index of its node in the file.
    pub node: usize,
    /// From its own coordinates, in which it shines along −z, to the file's.
    pub place: DMat4,
    /// Linear RGB.
    pub color: [f32; 3],
    /// lx of a directional one, cd of others.
    pub intensity: f32,
    /// What it is.
    pub kind: Punctual,
}

/// Which light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Punctual {
    /// From far away.
    Directional,
    /// In all directions from a point.
    Point,
    /// A cone from a point: half the angles at which it begins to fade and ends, radians.
    Spot([f32; 2]),
}

/// A node, and from its coordinates to the file's.
struct Placed<'a> {
    index: usize,
    node: &'a Node,
    place: Mat4,
    precise: DMat4,
}

/// Reads a file's text and what it names.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Contents, Fault> {
    let (json, binary) = buffers::split(bytes)?;
    let root: Root = serde_json::from_slice(json).map_err(|error| error.to_string())?;
    let version = root.asset.min_version.as_ref();
    let version = version.unwrap_or(&root.asset.version);
    if !version.starts_with("2.") {
        return Err(format!("its version is {}, and must be 2.0", cut(version)).into());
    }
    check_extensions(&root)?;
    check_primitives(&root)?;
    let nodes = placed(&root)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let buffers = buffers::load(&root, folder, binary)?;
    let data = Data::new(&root, &buffers);
    let mut corners = Vec::new();
    for placed in &nodes {
        add_mesh(&data, placed, &mut corners)?;
    }
    let (cameras, lights) = cameras_and_lights(&root, &nodes)?;
    let motion = motion(&root)?;
    let materials = root.materials.into_iter();
    Ok(Contents {
        corners,
        materials: materials.map(|material| material.name).collect(),
        cameras,
        lights,
        motion,
    })
}

/// The entry of a list that something names.
fn entry<'a, T>(list: &'a [T], index: usize, kind: &str, by: &str) -> Result<&'a T, String> {
    list.get(index).ok_or_else(|| {
        format!(
            "{by} names {kind} {index}, of which there are {}",
            list.len()
        )
    })
}

/// That no extension is needed that changes triangles or where they are. Materials and their images are of no concern.
fn check_extensions(root: &Root) -> Result<(), String> {
    const KNOWN: [&str; 4] = [
        "EXT_mesh_gpu_instancing",
        "KHR_lights_punctual",
        "KHR_mesh_quantization",
        "KHR_node_visibility",
    ];
    const LOOKS: [&str; 4] = [
        "KHR_materials_",
        "KHR_texture_",
        "EXT_texture_",
        "MSFT_texture_",
    ];
    for name in &root.extensions_required {
        let is_look = LOOKS.iter().any(|look| name.starts_with(look));
        if is_look || KNOWN.contains(&name.as_str()) {
            continue;
        }
        return Err(if name.ends_with("_compression") {
            format!(
                "it is compressed with {name}, which is not supported; export it without compression (`gltf-transform copy` undoes it)"
            )
        } else {
            format!("it requires {name}, which is not supported; export it without")
        });
    }
    Ok(())
}

/// That there is what meshes name, whether a node has them or not.
fn check_primitives(root: &Root) -> Result<(), String> {
    for (index, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let by = format!("meshes[{index}].primitives[{k}]");
            let attributes = &primitive.attributes;
            let accessors = [
                attributes.position,
                attributes.normal,
                attributes.tangent,
                attributes.texcoord_0,
                primitive.indices,
            ];
            for accessor in accessors.into_iter().flatten() {
                entry(&root.accessors, accessor, "accessor", &by)?;
            }
            if let Some(material) = primitive.material {
                entry(&root.materials, material, "material", &by)?;
            }
        }
    }
    Ok(())
}

/// All nodes of the scene.
fn placed(root: &Root) -> Result<Vec<Placed<'_>>, String> {
    let scene = match root.scene {
        Some(index) => Some(entry(&root.scenes, index, "scene", "the file")?),
        None => root.scenes.first(),
    };
    let scene = scene.ok_or("it has no scene that says which nodes are there; export one")?;
    let roots = scene.nodes.iter();
    // Whose children are looked for, and the parent of each.
    let mut open: Vec<(usize, Option<usize>)> = roots.map(|node| (*node, None)).collect();
    let mut found: Vec<Placed<'_>> = Vec::new();
    // By node: where in `found` it is, and where its parent.
    let mut visited: Vec<Option<(usize, Option<usize>)>> = vec![None; root.nodes.len()];
    while let Some((index, parent)) = open.pop() {
        let by = match parent {
            Some(parent) => format!("nodes[{}]", found[parent].index),
            None => "the scene".to_owned(),
        };
        let node = entry(&root.nodes, index, "node", &by)?;
        if !node.extensions.visibility.visible {
            // Nor is what is below it.
            continue;
        }
        if visited[index].is_some() {
            let mut above = parent;
            while let Some(at) = above {
                if found[at].index == index {
                    return Err(format!("node {index} is its own ancestor"));
                }
                above = visited[found[at].index].and_then(|(_, parent)| parent);
            }
            return Err(format!(
                "node {index} has two parents, of which {by} is one"
            ));
        }
        let own = matrix(node);
        let (place, precise) = match parent {
            Some(parent) => (found[parent].place, found[parent].precise),
            None => (Mat4::IDENTITY, DMat4::IDENTITY),
        };
        visited[index] = Some((found.len(), parent));
        open.extend(
            node.children
                .iter()
                .map(|child| (*child, Some(found.len()))),
        );
        found.push(Placed {
            index,
            node,
            place: place * own,
            precise: precise * own.as_dmat4(),
        });
    }
    Ok(found)
}

/// From a node's coordinates to its parent's.
fn matrix(node: &Node) -> Mat4 {
    match &node.matrix {
        Some(matrix) => Mat4::from_cols_array(matrix),
        None => placement(node.translation, node.rotation, node.scale),
    }
}

/// Scaled, then turned by a quaternion, then moved.
fn placement(translation: [f32; 3], rotation: [f32; 4], scale: [f32; 3]) -> Mat4 {
    let [x, y, z, w] = rotation;
    let [x2, y2, z2] = [x + x, y + y, z + z];
    let (xx, xy, xz) = (x2 * x, x2 * y, x2 * z);
    let (yy, yz, zz) = (y2 * y, y2 * z, z2 * z);
    let (wx, wy, wz) = (x2 * w, y2 * w, z2 * w);
    let turned = [
        Vec3::new(1.0 - yy - zz, xy + wz, xz - wy),
        Vec3::new(xy - wz, 1.0 - xx - zz, yz + wx),
        Vec3::new(xz + wy, yz - wx, 1.0 - xx - yy),
    ];
    let [a, b, c] = [0, 1, 2].map(|k| (turned[k] * scale[k]).extend(0.0));
    Mat4::from_cols(a, b, c, Vec3::from(translation).extend(1.0))
}

/// Where EXT_mesh_gpu_instancing puts a node's mesh, in the node's coordinates.
#[derive(Default)]
struct Instances {
    count: usize,
    translations: Option<Vec<[f32; 3]>>,
    rotations: Option<Vec<[f32; 4]>>,
    scales: Option<Vec<[f32; 3]>>,
}

impl Instances {
    /// One, where the node is.
    fn one() -> Self {
        Self {
            count: 1,
            ..Self::default()
        }
    }

    fn read(data: &Data<'_>, said: &Instancing, by: &str) -> Result<Self, String> {
        let mut counts = Vec::new();
        for accessor in said.attributes.values() {
            counts.push(entry(&data.root.accessors, *accessor, "accessor", by)?.count);
        }
        if counts.is_empty() || counts.iter().any(|count| *count != counts[0]) {
            return Err(format!(
                "{by} has no attributes of its instances, or not as many of each"
            ));
        }
        let vectors = |name| said.attributes.get(name);
        let threes = |name| vectors(name).map(|index| data.vectors::<3>(*index, by));
        let rotations = vectors("ROTATION").map(|index| data.vectors::<4>(*index, by));
        Ok(Self {
            count: counts[0],
            translations: threes("TRANSLATION").transpose()?,
            rotations: rotations.transpose()?,
            scales: threes("SCALE").transpose()?,
        })
    }

    fn place(&self, k: usize) -> Mat4 {
        let of = |vectors: &Option<Vec<[f32; 3]>>, none| vectors.as_ref().map_or(none, |of| of[k]);
        let rotation = self.rotations.as_ref();
        placement(
            of(&self.translations, [0.0; 3]),
            rotation.map_or([0.0, 0.0, 0.0, 1.0], |of| of[k]),
            of(&self.scales, [1.0; 3]),
        )
    }
}

/// Adds the triangles of a node's mesh.
fn add_mesh(data: &Data<'_>, placed: &Placed<'_>, corners: &mut Vec<Corner>) -> Result<(), Fault> {
    let Some(index) = placed.node.mesh else {
        return Ok(());
    };
    let by = format!("nodes[{}]", placed.index);
    let mesh = entry(&data.root.meshes, index, "mesh", &by)?;
    if placed.node.skin.is_some() {
        return Err(format!(
            "{by} has a skin, which is not supported; apply it in one pose before you export it"
        )
        .into());
    }
    let instances = match &placed.node.extensions.instancing {
        Some(said) => Instances::read(data, said, &by)?,
        None => Instances::one(),
    };
    let weights = placed.node.weights.as_ref().unwrap_or(&mesh.weights);
    let is_morphed = weights.iter().any(|weight| *weight != 0.0);
    for (k, primitive) in mesh.primitives.iter().enumerate() {
        let by = format!("meshes[{index}].primitives[{k}]");
        if is_morphed && !primitive.targets.is_empty() {
            return Err(format!(
                "{by} has morph targets with weights other than 0, which are not supported; apply them before you export it"
            )
            .into());
        }
        add_primitive(data, primitive, &by, (placed, &instances), corners)?;
    }
    Ok(())
}

fn add_primitive(
    data: &Data<'_>,
    primitive: &Primitive,
    by: &str,
    (placed, instances): (&Placed<'_>, &Instances),
    corners: &mut Vec<Corner>,
) -> Result<(), Fault> {
    // Points and lines are no cloth.
    if primitive.mode < 4 {
        return Ok(());
    }
    let attributes = &primitive.attributes;
    let positions = attributes
        .position
        .ok_or_else(|| format!("{by} has no POSITION"))?;
    let positions = data.vectors::<3>(positions, by)?;
    let normals = attributes.normal.map(|index| data.vectors::<3>(index, by));
    let tangents = attributes.tangent.map(|index| data.vectors::<4>(index, by));
    let uvs = attributes
        .texcoord_0
        .map(|index| data.vectors::<2>(index, by));
    let (normals, tangents) = (normals.transpose()?, tangents.transpose()?);
    let uvs = uvs.transpose()?;
    for (name, count) in [
        ("NORMAL", normals.as_ref().map(Vec::len)),
        ("TANGENT", tangents.as_ref().map(Vec::len)),
        ("TEXCOORD_0", uvs.as_ref().map(Vec::len)),
    ] {
        if count.is_some_and(|count| count != positions.len()) {
            let (count, expected) = (count.unwrap_or(0), positions.len());
            return Err(
                format!("{by} has {count} elements of {name} for {expected} positions").into(),
            );
        }
    }
    let indices: Vec<u32> = match primitive.indices {
        Some(indices) => data.indices(indices, by)?,
        None => (0..positions.len() as u32).collect(),
    };
    let indices = triangles(indices, primitive.mode)
        .ok_or_else(|| format!("{by} has mode {}, which there is not", primitive.mode))?;
    let most = indices.len().saturating_mul(instances.count);
    if corners.len().saturating_add(most) > data.limit {
        return Err(format!(
            "it has more than {} triangles, counting every node and instance that has them; thin it out, or place instances in a scene",
            data.limit / 3
        )
        .into());
    }
    if indices.is_empty() {
        return Ok(());
    }
    for place in (0..instances.count).map(|k| placed.place * instances.place(k)) {
        let inverse = place.inverse();
        let of_normals = if inverse.is_finite() {
            inverse.transpose()
        } else {
            // What is scaled to nothing keeps the normals of its plane: cofactors are the inverse, transposed, but for a factor.
            let [a, b, c] = [place.x_axis, place.y_axis, place.z_axis].map(|axis| axis.truncate());
            let cofactors = [b.cross(c), c.cross(a), a.cross(b)].map(|axis| axis.extend(0.0));
            Mat4::from_cols(cofactors[0], cofactors[1], cofactors[2], glam::Vec4::W)
        };
        for index in &indices {
            let index = *index as usize;
            let position = *entry(&positions, index, "vertex", by)?;
            let of =
                |vectors: &Option<Vec<[f32; 3]>>| vectors.as_ref().map(|of| Vec3::from(of[index]));
            let corner = Corner {
                position: place.transform_point3(Vec3::from(position)),
                normal: of(&normals).map(|normal| of_normals.transform_vector3(normal)),
                uv: uvs.as_ref().map(|uvs| Vec2::from(uvs[index])),
                mirrored: tangents.as_ref().is_some_and(|tangents| {
                    let [.., w] = tangents[index];
                    // In a mirrored place normal × tangent turns round, and what lies along v does not.
                    (w < 0.0) != (place.determinant() < 0.0)
                }),
                v_down: true,
                warp: tangents.as_ref().map(|tangents| {
                    let [x, y, z, _] = tangents[index];
                    place.transform_vector3(Vec3::new(x, y, z))
                }),
                material: primitive.material,
            };
            if !corner.is_finite() {
                return Err(Fault::Broken(format!(
                    "nodes[{}], vertex {index} of {by}",
                    placed.index
                )));
            }
            corners.push(corner);
        }
    }
    Ok(())
}

/// Corners of triangles, three by three, of a list (mode 4), a strip (5) or a fan (6); what is over is left out.
fn triangles(indices: Vec<u32>, mode: u32) -> Option<Vec<u32>> {
    let count = indices.len().saturating_sub(2);
    Some(match mode {
        4 => {
            let mut indices = indices;
            indices.truncate(indices.len() / 3 * 3);
            indices
        }
        5 => (0..count)
            .flat_map(|k| [k, k + 1 + k % 2, k + 2 - k % 2])
            .map(|k| indices[k])
            .collect(),
        6 => (0..count)
            .flat_map(|k| [k + 1, k + 2, 0])
            .map(|k| indices[k])
            .collect(),
        _ => return None,
    })
}

fn cameras_and_lights(
    root: &Root,
    nodes: &[Placed<'_>],
) -> Result<(Vec<Camera>, Vec<Light>), String> {
    let (mut cameras, mut lights) = (Vec::new(), Vec::new());
    for placed in nodes {
        let node = placed.node;
        let by = format!("nodes[{}]", placed.index);
        if let Some(index) = node.camera {
            let camera = entry(&root.cameras, index, "camera", &by)?;
            cameras.push(Camera {
                name: camera.name.as_ref().or(node.name.as_ref()).cloned(),
                index: [index, placed.index],
                place: placed.precise,
                projection: match (&camera.perspective, &camera.orthographic) {
                    (Some(lens), _) => Projection::Perspective(lens.yfov),
                    (None, Some(lens)) => Projection::Orthographic(lens.ymag),
                    (None, None) => {
                        return Err(format!(
                            "cameras[{index}] is neither perspective nor orthographic"
                        ));
                    }
                },
            });
        }
        if let Some(json::LightIndex { light: index }) = node.extensions.lights {
            let all = root.extensions.lights.as_ref();
            let all = all.map_or(&[][..], |lights| &lights.lights);
            let light = entry(all, index, "light", &by)?;
            lights.push(Light {
                name: light.name.as_ref().or(node.name.as_ref()).cloned(),
                node: placed.index,
                place: placed.precise,
                color: light.color,
                intensity: light.intensity,
                kind: match light.kind {
                    LightKind::Directional => Punctual::Directional,
                    LightKind::Point => Punctual::Point,
                    LightKind::Spot => {
                        Punctual::Spot([light.spot.inner_cone_angle, light.spot.outer_cone_angle])
                    }
                },
            });
        }
    }
    Ok((cameras, lights))
}

/// The first thing in the file that moves.
fn motion(root: &Root) -> Result<Option<String>, String> {
    for (index, animation) in root.animations.iter().enumerate() {
        if let Some(channel) = animation.channels.first() {
            let target = &channel.target;
            let what = match target.path.as_str() {
                "translation" => "moves",
                "rotation" => "turns",
                "scale" => "scales",
                "weights" => "morphs",
                _ => "changes",
            };
            let Some(node) = target.node else {
                return Ok(Some(format!("animation {index} {what} something")));
            };
            let by = format!("animations[{index}]");
            let name = &entry(&root.nodes, node, "node", &by)?.name;
            let name = name.as_deref().unwrap_or_default();
            return Ok(Some(format!(
                "an animation {what} node {node} \"{}\"",
                cut(name)
            )));
        }
    }
    let has_skin = !root.skins.is_empty();
    Ok(has_skin.then(|| "it has a skin".to_owned()))
}
