//! Any bytes as OBJ, glTF or GLB: they are no mesh, or one whose frames are numbers.
#![no_main]

use std::path::Path;

use sateen::mesh::MeshFile;

/// More are right, but tangents of them take too long again and again.
const MOST_BYTES: usize = 1 << 16;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((kind, bytes)) = bytes.split_first() else {
        return;
    };
    if bytes.len() > MOST_BYTES {
        return;
    }
    // There is nothing beside it.
    let path = ["none/mesh.obj", "none/mesh.gltf", "none/mesh.glb"][usize::from(kind % 3)];
    let Ok(file) = MeshFile::from_bytes(Path::new(path), || Ok(bytes.to_vec())) else {
        return;
    };
    for part in file.into_parts() {
        let Ok(mesh) = part.into_mesh() else { continue };
        assert!(!mesh.triangles.is_empty());
        let count = mesh.positions.len();
        assert!(
            [
                mesh.normals.len(),
                mesh.warps.len(),
                mesh.mirrored.len(),
                mesh.uvs.len()
            ] == [count; 4]
        );
        assert!(
            mesh.triangles
                .as_flattened()
                .iter()
                .all(|index| (*index as usize) < count)
        );
        assert!(
            mesh.normals
                .iter()
                .all(|normal| (normal.length() - 1.0).abs() < 1e-3)
        );
    }
});
