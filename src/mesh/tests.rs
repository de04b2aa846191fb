//! What files of meshes may be, and what is said of those that are wrong.

use std::fs;
use std::path::Path;

use glam::{Vec2, Vec3, Vec3A};
use serde_json::{Value, json};

use super::{Mesh, MeshError, MeshFile, load_mesh};

/// A unit square as glTF with its buffer beside it, changed by `change`.
fn square(folder: &Path, change: impl Fn(&mut Value)) -> Result<MeshFile, MeshError> {
    let floats: [f32; 20] = [
        0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0., // positions
        0., 0., 1., 0., 1., 1., 0., 1., // texture coordinates
    ];
    let mut bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    // Of two triangles, of a strip, of a fan.
    for index in [0u16, 1, 2, 0, 2, 3, 0, 1, 3, 2, 0, 1, 2, 3] {
        bytes.extend(index.to_le_bytes());
    }
    // The positions in 16 bits, 8 bytes apart.
    for [x, y] in [[0i16, 0], [i16::MAX, 0], [i16::MAX; 2], [0, i16::MAX]] {
        bytes.extend([x, y, 0, 0].iter().flat_map(|x| x.to_le_bytes()));
    }
    fs::write(folder.join("a b.bin"), &bytes).unwrap();
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let mut file = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "name": "denim" }, { "name": "button" }],
        "buffers": [{ "uri": "a%20b.bin", "byteLength": bytes.len() }],
        "bufferViews": [view(0, 48), view(48, 32), view(80, 28), view(108, 32)],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" },
            { "bufferView": 2, "byteOffset": 12, "componentType": 5123, "count": 4, "type": "SCALAR" },
            { "bufferView": 2, "byteOffset": 20, "componentType": 5123, "count": 4, "type": "SCALAR" },
            { "bufferView": 3, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC3" },
        ],
    });
    file["bufferViews"][3]["byteStride"] = json!(8);
    change(&mut file);
    let path = folder.join("square.gltf");
    fs::write(&path, file.to_string()).unwrap();
    MeshFile::read(&path)
}

/// Twice the area of all triangles that face +z, less that of others.
fn area(mesh: &Mesh) -> f32 {
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|k| mesh.positions[k as usize]);
        (b - a).cross(c - a).z
    };
    mesh.triangles.iter().map(area).sum()
}

fn areas(file: MeshFile) -> Vec<f32> {
    let parts = file.into_parts().into_iter();
    parts.map(|part| area(&part.into_mesh().unwrap())).collect()
}

#[test]
fn triangles_may_be_lists_strips_and_fans_of_floats_or_integers() {
    let folder = tempfile::tempdir().unwrap();
    for (mode, indices) in [(4, 2), (5, 3), (6, 4)] {
        for positions in [0, 5] {
            let file = square(folder.path(), |file| {
                let primitive = &mut file["meshes"][0]["primitives"][0];
                primitive["mode"] = json!(mode);
                primitive["indices"] = json!(indices);
                primitive["attributes"]["POSITION"] = json!(positions);
                file["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
            });
            assert_eq!(areas(file.unwrap()), [2.0], "mode {mode}");
        }
    }
}

#[test]
fn instances_are_where_as_many_nodes_would_be() {
    let folder = tempfile::tempdir().unwrap();
    let half = 0.5f32.sqrt();
    let [places, turns, scales] = [
        vec![-2., 0., 0., 0., 3., 1.],
        vec![0., 0., 0., 1., 0., 0., half, half],
        vec![1., 1., 1., 2., -1., 1.],
    ];
    let moved = |mesh: Mesh| (mesh.positions, mesh.mirrored, mesh.triangles);
    let read = |change: &dyn Fn(&mut Value)| {
        let file = square(folder.path(), |file| {
            file["nodes"] = json!([{ "scale": [1, 2, 1], "children": [1] }, { "mesh": 0 }]);
            change(file);
        });
        moved(
            file.unwrap()
                .into_parts()
                .pop()
                .unwrap()
                .into_mesh()
                .unwrap(),
        )
    };
    let instances = read(&|file| {
        add_floats(file, folder.path(), &places, "VEC3");
        add_floats(file, folder.path(), &turns, "VEC4");
        add_floats(file, folder.path(), &scales, "VEC3");
        let attributes = json!({ "TRANSLATION": 6, "ROTATION": 7, "SCALE": 8 });
        file["nodes"][1]["extensions"] =
            json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        file["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    });
    let nodes = read(&|file| {
        // Those that come last are visited first.
        file["nodes"][0]["children"] = json!([2, 1]);
        let node = |k: usize| {
            json!({
                "mesh": 0,
                "translation": places[3 * k..3 * k + 3],
                "rotation": turns[4 * k..4 * k + 4],
                "scale": scales[3 * k..3 * k + 3],
            })
        };
        file["nodes"][1] = node(0);
        file["nodes"].as_array_mut().unwrap().push(node(1));
    });
    assert_eq!(instances, nodes);
    assert_eq!(instances.2.len(), 4);
}

#[test]
fn the_weft_turns_where_texture_coordinates_are_mirrored() {
    let folder = tempfile::tempdir().unwrap();
    let mirrored = |change: &dyn Fn(&mut Value)| {
        let file = square(folder.path(), change).unwrap();
        let part = file.into_parts().pop().unwrap().into_mesh().unwrap();
        assert!(part.mirrored.windows(2).all(|pair| pair[0] == pair[1]));
        part.mirrored[0]
    };
    // In glTF v grows down an image: these coordinates show it upside down, which is a mirror.
    assert!(mirrored(&|_| ()));
    assert!(!mirrored(&|file| {
        let pairs = [0., 1., 1., 1., 1., 0., 0., 0.];
        add_floats(file, folder.path(), &pairs, "VEC2");
        file["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(6);
    }));
    // A file's own tangents say it themselves, as seen in their place.
    for (w, scale, expected) in [(1.0, 1, false), (-1.0, 1, true), (1.0, -1, true)] {
        let tangents = [1., 0., 0., w].repeat(4);
        assert_eq!(
            mirrored(&|file| {
                add_floats(file, folder.path(), &tangents, "VEC4");
                file["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(6);
                file["nodes"][0]["scale"] = json!([scale, 1, 1]);
            }),
            expected
        );
    }
}

/// Another accessor, the seventh, of four vectors in a buffer of their own.
fn add_floats(file: &mut Value, folder: &Path, floats: &[f32], shape: &str) {
    let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
    let mut push = |list: &str, entry: Value| {
        let list = file[list].as_array_mut().unwrap();
        list.push(entry);
        list.len() - 1
    };
    let uri = format!("{shape}-{:?}.bin", floats.first());
    fs::write(folder.join(&uri), &bytes).unwrap();
    let length = bytes.len();
    let buffer = push("buffers", json!({ "uri": uri, "byteLength": length }));
    let view = push(
        "bufferViews",
        json!({ "buffer": buffer, "byteOffset": 0, "byteLength": length }),
    );
    let components: usize = shape[3..].parse().unwrap();
    let count = floats.len() / components;
    push(
        "accessors",
        json!({ "bufferView": view, "componentType": 5126, "count": count, "type": shape }),
    );
}

#[test]
fn sparse_values_take_the_place_of_others() {
    let folder = tempfile::tempdir().unwrap();
    // The second position takes the place of the first: half the square is left, folded.
    let file = square(folder.path(), |file| {
        file["accessors"][0]["sparse"] = json!({
            "count": 1,
            "indices": { "bufferView": 2, "componentType": 5123 },
            "values": { "bufferView": 0, "byteOffset": 12 },
        });
    });
    assert_eq!(areas(file.unwrap()), [1.0]);
}

#[test]
fn only_what_is_cloth_needs_texture_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let mut parts = square(folder.path(), |file| {
        let primitives = &mut file["meshes"][0]["primitives"];
        let button = json!({ "attributes": { "POSITION": 0 }, "indices": 2, "material": 1 });
        primitives.as_array_mut().unwrap().push(button);
    })
    .unwrap()
    .into_parts();
    let denim = parts.pop().unwrap();
    assert_eq!(denim.material.as_deref(), Some("denim"));
    assert_eq!(area(&denim.into_mesh().unwrap()), 2.0);
    let error = parts.pop().unwrap().into_mesh().unwrap_err().to_string();
    assert!(error.contains("without texture coordinates"), "{error}");
    assert!(error.contains("\"button\""), "{error}");
}

#[test]
fn what_is_scaled_to_a_plane_keeps_its_normals() {
    let folder = tempfile::tempdir().unwrap();
    let file = square(folder.path(), |file| {
        add_floats(file, folder.path(), &[0., 0., 1.].repeat(4), "VEC3");
        file["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(6);
        file["nodes"][0]["scale"] = json!([1, 1, 0]);
    });
    let mesh = file
        .unwrap()
        .into_parts()
        .pop()
        .unwrap()
        .into_mesh()
        .unwrap();
    assert!(mesh.normals.iter().all(|normal| *normal == glam::Vec3::Z));
}

#[test]
fn what_a_file_hides_is_not_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let file = square(folder.path(), |file| {
        let hidden = json!({ "KHR_node_visibility": { "visible": false } });
        file["scenes"][0]["nodes"] = json!([0, 1]);
        file["nodes"] =
            json!([{ "mesh": 0 }, { "children": [2], "extensions": hidden }, { "mesh": 0 }]);
        file["extensionsRequired"] = json!(["KHR_node_visibility"]);
    });
    assert_eq!(areas(file.unwrap()), [2.0]);
}

#[test]
fn what_is_wrong_with_a_gltf_file_is_said() {
    let folder = tempfile::tempdir().unwrap();
    type Change = fn(&mut Value);
    let cases: [(Change, &str); 27] = [
        (
            |file| {
                file["nodes"][0]["skin"] = json!(0);
                file["skins"] = json!([{ "joints": [0] }]);
            },
            "nodes[0] has a skin",
        ),
        (
            |file| {
                file["nodes"][0]["extensions"] =
                    json!({ "EXT_mesh_gpu_instancing": { "attributes": {} } });
            },
            "nodes[0] has no attributes of its instances",
        ),
        (
            |file| {
                let attributes = json!({ "TRANSLATION": 0, "_ID": 2 });
                file["nodes"][0]["extensions"] =
                    json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
            },
            "or not as many of each",
        ),
        (
            |file| {
                file["accessors"][5]["count"] = json!(u64::MAX);
                let attributes = json!({ "_ID": 5 });
                file["nodes"][0]["extensions"] =
                    json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
            },
            "counting every node and instance",
        ),
        (
            |file| {
                file.as_object_mut().unwrap().remove("scenes");
            },
            "it has no scene",
        ),
        (
            |file| file["nodes"][0]["children"] = json!([0]),
            "node 0 is its own ancestor",
        ),
        (
            |file| {
                file["scenes"][0]["nodes"] = json!([1, 2]);
                file["nodes"] = json!([{ "mesh": 0 }, { "children": [0] }, { "children": [0] }]);
            },
            "node 0 has two parents",
        ),
        (
            |file| file["scenes"][0]["nodes"] = json!([7]),
            "the scene names node 7, of which there are 1",
        ),
        (
            |file| file["accessors"] = json!([]),
            "meshes[0].primitives[0] names accessor 0, of which there are 0",
        ),
        (
            |file| file["accessors"][2]["componentType"] = json!(5126),
            "indices cannot have component type 5126",
        ),
        (
            |file| file["accessors"][1]["type"] = json!("VEC3"),
            "accessors[1]: its type is VEC3, and must be VEC2",
        ),
        (
            |file| file["bufferViews"][0]["byteStride"] = json!(4),
            "accessors[0]: its elements of 12 bytes do not fit bufferViews[0]'s byteStride of 4",
        ),
        (
            |file| file["accessors"][0]["count"] = json!(u64::MAX),
            "accessors[0]: its 18446744073709551615 elements go beyond bufferViews[0]",
        ),
        (
            |file| file["bufferViews"][0]["byteOffset"] = json!(u64::MAX),
            "bufferViews[0] goes beyond its buffer",
        ),
        (
            |file| file["accessors"][1]["count"] = json!(3),
            "3 elements of TEXCOORD_0 for 4 positions",
        ),
        (
            |file| file["accessors"][2]["byteOffset"] = json!(32),
            "accessors[2]: its 6 elements go beyond bufferViews[2]",
        ),
        (
            |file| {
                for accessor in [0, 1] {
                    file["accessors"][accessor]["count"] = json!(3);
                }
            },
            "names vertex 3, of which there are 3",
        ),
        (
            |file| file["buffers"][0]["uri"] = json!("nowhere.bin"),
            "cannot read nowhere.bin, looked for in",
        ),
        (
            |file| file["buffers"][0]["uri"] = json!("caf%E9.bin"),
            "caf%E9.bin is not UTF-8",
        ),
        (
            |file| file["buffers"][0]["uri"] = json!("https://a.example/b.bin"),
            "only data: and files beside",
        ),
        (
            |file| file["buffers"][0]["uri"] = json!("a/../../secret.bin"),
            "only data: and files beside",
        ),
        (
            |file| file["buffers"][0]["uri"] = json!("%2Fetc%2Fpasswd"),
            "%2Fetc%2Fpasswd: only data: and files beside",
        ),
        (
            |file| file["buffers"][0]["uri"] = json!("x".repeat(1000)),
            "xxx…, looked for in",
        ),
        (
            |file| file["nodes"][0]["translation"] = json!([1e38, 3e38, 1e39]),
            "a vertex that is no number (nodes[0], vertex 0 of meshes[0].primitives[0])",
        ),
        (
            |file| file["buffers"][0]["byteLength"] = json!(1000),
            "less than its byteLength of 1000",
        ),
        (
            |file| file["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            "it is compressed with KHR_draco_mesh_compression",
        ),
        (
            |file| {
                file["meshes"][0]["weights"] = json!([1.0]);
                file["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": 0 }]);
            },
            "morph targets",
        ),
    ];
    for (change, message) in cases {
        let error = square(folder.path(), change).err().expect(message);
        assert!(error.to_string().contains(message), "{error}");
        assert!(error.to_string().contains("square.gltf"), "{error}");
    }
}

#[test]
fn a_small_file_may_not_repeat_its_triangles_forever() {
    let folder = tempfile::tempdir().unwrap();
    // Twice 3 corners each.
    let repeated = |times: usize| {
        square(folder.path(), |file| {
            let nodes = vec![json!({ "mesh": 0 }); times];
            file["scenes"][0]["nodes"] = (0..times).collect();
            file["nodes"] = nodes.into();
        })
    };
    // What is quite the same is one.
    assert_eq!(areas(repeated(1000).unwrap()), [2.0]);
    let error = repeated((1 << 19) + 1).err().unwrap().to_string();
    assert!(
        error.contains("more than 1048576 triangles, counting every node and instance"),
        "{error}"
    );
}

#[test]
fn a_small_file_may_not_have_its_numbers_read_forever() {
    let folder = tempfile::tempdir().unwrap();
    let file = square(folder.path(), |file| {
        // Zeros without bytes, of which no triangle has any.
        file["accessors"][0] = json!({
            "componentType": 5126,
            "count": 1 << 23,
            "type": "VEC3",
            "sparse": {
                "count": 1,
                "indices": { "bufferView": 2, "componentType": 5123 },
                "values": { "bufferView": 0 },
            },
        });
        let primitive = json!({ "attributes": { "POSITION": 0 }, "indices": 2 });
        file["accessors"][2]["count"] = json!(0);
        file["meshes"][0]["primitives"] = vec![primitive; 1000].into();
    });
    let error = file.err().unwrap().to_string();
    assert!(error.contains("the same numbers too often"), "{error}");
}

#[test]
fn coincident_triangles_are_met_as_one() {
    use super::trace::Solid;
    let sheet = Mesh::sheet(1, 1, Vec2::ONE, |u, v| [u, v, 0.0]);
    let mut mesh = Mesh::default();
    for _ in 0..40_000 {
        mesh.join(sheet.clone());
    }
    let hit = |mesh: &Mesh| {
        let solid = Solid::new(mesh);
        let met = solid.hit(Vec3A::new(0.3, 0.2, 1.0), Vec3A::NEG_Z).unwrap();
        assert!(solid.hit(Vec3A::new(1.3, 0.2, 1.0), Vec3A::NEG_Z).is_none());
        solid.weights(mesh, &met).0
    };
    assert_eq!(hit(&mesh), hit(&sheet));
    // Others in the same box, which each have a corner of their own.
    for k in 0..mesh.positions.len() / 4 {
        let share = (k as f32 * 0.618_034).fract();
        mesh.positions[4 * k + 1] = Vec3::new(share, 1.0, 0.0);
    }
    Solid::new(&mesh);
}

#[test]
fn a_glb_file_that_is_cut_short_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let whole = b"glTF\x02\0\0\0\x1c\0\0\0\x08\0\0\0JSON{}      ";
    for length in 0..whole.len() {
        fs::write(&path, &whole[..length]).unwrap();
        let error = MeshFile::read(&path).err().unwrap();
        assert!(matches!(error, MeshError::Gltf(..)), "{error}");
    }
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

#[test]
fn an_obj_file_may_have_what_is_no_face() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let face = "f 1/1 2/2 3/3 4/4";
    for text in [
        format!("{OBJ}{face}\n"),
        format!("\u{feff}{OBJ}{face}"),
        format!("{OBJ}{face} # front\r\n"),
        format!("{OBJ}{face}\n").replace('\n', "\r"),
        format!("{OBJ}f 1/1 2/2 \\\n3/3 4/4\n"),
        format!("{OBJ}f -4/-4 -3/-3 -2/-2 -1/-1\n"),
        format!("{OBJ}usemtl\no\ng\n{face}\n"),
        format!("{OBJ}{face}\nl 1 2 3\np 1\nv 2 0 0\nl 5/1 2/2\n"),
    ] {
        fs::write(&path, &text).unwrap();
        assert_eq!(area(&load_mesh(&path).unwrap()), 2.0, "{text}");
    }
}

/// An OBJ file of one face along these points, each of which is its own texture coordinate.
fn polygon(path: &Path, points: &[[f32; 2]]) -> Mesh {
    let mut text = String::new();
    for [x, y] in points {
        text += &format!("v {x} {y} 0\nvt {x} {y}\n");
    }
    text += "f";
    for k in 1..=points.len() {
        text += &format!(" {k}/{k}");
    }
    fs::write(path, text).unwrap();
    load_mesh(path).unwrap()
}

#[test]
fn faces_that_bend_inwards_are_filled_within_their_edges() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let all_face_up = |mesh: &Mesh| {
        let facing = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|k| mesh.positions[k as usize]);
            (b - a).cross(c - a).z > -1e-6
        };
        mesh.triangles.iter().all(facing)
    };
    // An L whose inner corner the first does not see, a comb, and a star of many points; then the same from each corner on and backwards.
    let l = vec![[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]];
    let mut comb = vec![[9., -1.], [9., 3.]];
    comb.extend((0..9).map(|k| [8.5 - k as f32, if k % 2 == 0 { 0. } else { 3. }]));
    comb.push([0., -1.]);
    let star: Vec<[f32; 2]> = (0..200)
        .map(|k| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / 200.).sin_cos();
            let radius = (1 + k % 2) as f32;
            [radius * cos, radius * sin]
        })
        .collect();
    for points in [l, comb, star] {
        let shoelace = |points: &[[f32; 2]]| -> f32 {
            let next = points.iter().cycle().skip(1);
            points
                .iter()
                .zip(next)
                .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
                .sum()
        };
        let expected = shoelace(&points);
        assert!(expected > 0.0);
        for first in 0..points.len().min(12) {
            let mut points = points.clone();
            points.rotate_left(first);
            let mesh = polygon(&path, &points);
            assert!((area(&mesh) / expected - 1.0).abs() < 1e-4, "{first}");
            assert!(
                all_face_up(&mesh),
                "{first}: some triangle is beyond the edges"
            );
            points.reverse();
            let mesh = polygon(&path, &points);
            assert!((area(&mesh) / expected + 1.0).abs() < 1e-4, "{first}");
        }
    }
    // What crosses itself is filled somehow.
    polygon(&path, &[[0., 0.], [1., 1.], [1., 0.], [0., 1.]]);
    polygon(&path, &[[0., 0.], [1., 0.], [0., 0.], [1., 0.]]);
}

#[test]
fn what_is_wrong_with_an_obj_file_is_said_with_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    for (face, message) in [
        ("f 1 2 3", "without texture coordinates (line 9)"),
        ("f 1/1 2/2", "line 9: a face has three corners or more"),
        (
            "f 1/1 2/2 5/3",
            "line 9: it names v 5, of which there are 4",
        ),
        ("f 1/1 2/2 0/3", "line 9: it names v 0"),
        ("f 1/1 2/2 -5/3", "line 9: it names v -5"),
        ("f 1/1 2/2 a/3", "line 9: \"a\" is no index"),
        ("v 1 b 2", "line 9: \"b\" is no number"),
        ("v 1 2 inf", "a vertex that is no number (line 9)"),
        ("v 1 2", "line 9: it needs 3 numbers, and has 2"),
    ] {
        fs::write(&path, format!("{OBJ}{face}\n")).unwrap();
        let error = load_mesh(&path).err().unwrap().to_string();
        assert!(error.contains(message), "{error}");
        assert!(error.contains("a.obj"), "{error}");
    }
}
