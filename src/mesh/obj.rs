//! Wavefront OBJ: the faces of a file, each cut into triangles that fan out from its first corner.
//!
//! Lines, points, groups and materials are of no concern.

use glam::{Vec2, Vec3};

use super::MeshError;
use super::load::{Corner, MAX_CORNERS};
use crate::text::cut;

/// The most corners of a face.
const MAX_FACE: usize = 1 << 12;

/// What a line of a file says.
enum Fault {
    /// It cannot be read.
    Unreadable(String),
    /// A face without texture coordinates.
    NoUvs,
    /// A number is not finite.
    Broken,
}

#[derive(Default)]
struct Vertices {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
}

/// Corners of all triangles.
pub(super) fn read(path: &std::path::Path, bytes: &[u8]) -> Result<Vec<Corner>, MeshError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut vertices = Vertices::default();
    let mut corners = Vec::new();
    // A statement that ends in a backslash goes on.
    let mut statement = String::new();
    let mut begun = None;
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        // Names and comments may be in any encoding.
        let line = String::from_utf8_lossy(line);
        let line = line.split('#').next().unwrap_or_default().trim_end();
        let number = *begun.get_or_insert(index + 1);
        if let Some(line) = line.strip_suffix('\\') {
            statement += line;
            statement.push(' ');
            continue;
        }
        statement += line;
        read_statement(&statement, &mut vertices, &mut corners).map_err(|fault| {
            let at = format!("line {number}");
            match fault {
                Fault::Unreadable(why) => MeshError::Obj(path.to_owned(), format!("{at}: {why}")),
                Fault::NoUvs => MeshError::NoUvs(path.to_owned(), at),
                Fault::Broken => MeshError::Broken(path.to_owned(), at),
            }
        })?;
        statement.clear();
        begun = None;
    }
    Ok(corners)
}

fn read_statement(
    text: &str,
    vertices: &mut Vertices,
    corners: &mut Vec<Corner>,
) -> Result<(), Fault> {
    let mut words = text.split_whitespace();
    match words.next() {
        Some("v") => vertices.positions.push(Vec3::from(numbers(words, 3)?)),
        Some("vn") => vertices.normals.push(Vec3::from(numbers(words, 3)?)),
        Some("vt") => {
            let [u, v, _] = numbers(words, 1)?;
            vertices.uvs.push(Vec2::new(u, v));
        }
        Some("f") => {
            let face: Vec<Corner> = words
                .take(MAX_FACE + 1)
                .map(|word| corner(word, vertices))
                .collect::<Result<_, _>>()?;
            if !(3..=MAX_FACE).contains(&face.len()) {
                let message = format!(
                    "a face has three corners or more, up to {MAX_FACE}, this one {}",
                    face.len()
                );
                return Err(Fault::Unreadable(message));
            }
            if face.iter().any(|corner| corner.uv.is_none()) {
                return Err(Fault::NoUvs);
            }
            if corners.len() + 3 * (face.len() - 2) > MAX_CORNERS {
                let message = format!(
                    "it has more than {} triangles; thin it out",
                    MAX_CORNERS / 3
                );
                return Err(Fault::Unreadable(message));
            }
            for pair in face[1..].windows(2) {
                corners.extend([face[0], pair[0], pair[1]]);
            }
        }
        _ => {}
    }
    Ok(())
}

/// Up to three numbers, `needed` at least; the others are 0.
fn numbers<'a>(words: impl Iterator<Item = &'a str>, needed: usize) -> Result<[f32; 3], Fault> {
    let mut numbers = [0.0f32; 3];
    let mut count = 0;
    for (number, word) in numbers.iter_mut().zip(words) {
        *number = word
            .parse()
            .map_err(|_| Fault::Unreadable(format!("\"{}\" is no number", cut(word))))?;
        count += 1;
    }
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err(Fault::Broken);
    }
    if count < needed {
        let message = format!("it needs {needed} numbers, and has {count}");
        return Err(Fault::Unreadable(message));
    }
    Ok(numbers)
}

/// The corner that a word like 1, 1/2, 1//3 or 1/2/3 names.
fn corner(word: &str, vertices: &Vertices) -> Result<Corner, Fault> {
    let mut parts = word.split('/');
    let mut part = || parts.next().filter(|part| !part.is_empty());
    let (position, uv, normal) = (part(), part(), part());
    let missing = || Fault::Unreadable(format!("\"{}\" is no corner of a face", cut(word)));
    Ok(Corner {
        position: at(&vertices.positions, position.ok_or_else(missing)?, "v")?,
        uv: uv.map(|uv| at(&vertices.uvs, uv, "vt")).transpose()?,
        normal: normal
            .map(|normal| at(&vertices.normals, normal, "vn"))
            .transpose()?,
        warp: None,
        mirrored: false,
        v_down: false,
        material: None,
    })
}

/// The vector of an index that counts from 1, or backwards from −1.
fn at<T: Copy>(vectors: &[T], index: &str, kind: &str) -> Result<T, Fault> {
    let number: i64 = index
        .parse()
        .map_err(|_| Fault::Unreadable(format!("\"{}\" is no index", cut(index))))?;
    let place = match number {
        1.. => usize::try_from(number - 1).ok(),
        _ => usize::try_from(vectors.len() as i64 + number).ok(),
    };
    let found = place.filter(|_| number != 0);
    found
        .and_then(|place| vectors.get(place).copied())
        .ok_or_else(|| {
            let count = vectors.len();
            Fault::Unreadable(format!(
                "it names {kind} {number}, of which there are {count}"
            ))
        })
}
