//! Wavefront OBJ: the faces of a file, each cut into triangles: in a fan from its first corner, or where it bends inwards ear by ear.
//!
//! Lines, points, groups and materials are of no concern.

use glam::{DVec2, Vec2, Vec3};

use super::MeshError;
use super::load::{Corner, MAX_CORNERS};
use crate::text::cut;

/// The most corners of a face.
const MAX_FACE: usize = 1 << 12;

/// How many corners may be looked at, in all faces of a file that bend inwards: some seconds.
const MAX_LOOKS: usize = 1 << 29;

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
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        let message = "it is UTF-16; save it as UTF-8".to_owned();
        return Err(MeshError::Obj(path.to_owned(), message));
    }
    let mut looks = MAX_LOOKS;
    let mut vertices = Vertices::default();
    let mut corners = Vec::new();
    // A statement that ends in a backslash goes on.
    let mut statement = String::new();
    let mut begun = None;
    for (index, line) in lines(bytes).enumerate() {
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
        read_statement(&statement, &mut vertices, &mut corners, &mut looks).map_err(|fault| {
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

/// Lines that end as Unix, Windows or old Macs end them.
fn lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    bytes.split(move |byte| *byte == end)
}

fn read_statement(
    text: &str,
    vertices: &mut Vertices,
    corners: &mut Vec<Corner>,
    looks: &mut usize,
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
                let message = match face.len() {
                    0..3 => format!("a face has three corners or more, this one {}", face.len()),
                    _ => format!("a face has at most {MAX_FACE} corners; triangulate the mesh"),
                };
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
            corners.extend(cut_up(&face, looks)?.into_iter().map(|k| face[k]));
        }
        _ => {}
    }
    Ok(())
}

/// Triangles within a face, as indices of its corners.
fn cut_up(face: &[Corner], looks: &mut usize) -> Result<Vec<usize>, Fault> {
    let count = face.len();
    if count == 3 {
        return Ok(vec![0, 1, 2]);
    }
    let positions = face.iter().map(|corner| corner.position.as_dvec3());
    let positions: Vec<_> = positions.collect();
    let from_first = |k: usize| positions[k] - positions[0];
    // Twice the area, by Newell: the mean normal of a face that is not quite flat.
    let normal: glam::DVec3 = (1..count - 1)
        .map(|k| from_first(k).cross(from_first(k + 1)))
        .sum();
    let fan = || (1..count - 1).flat_map(|k| [0, k, k + 1]).collect();
    // Along the longest part of the normal, with the face on the left of its edges.
    let [x, y, z] = normal.abs().to_array();
    let flat: Vec<DVec2> = positions
        .iter()
        .map(|at| match (x > y && x > z, y > z) {
            (true, _) => DVec2::new(at.y, at.z) * DVec2::new(1.0, normal.x.signum()),
            (false, true) => DVec2::new(at.z, at.x) * DVec2::new(1.0, normal.y.signum()),
            (false, false) => DVec2::new(at.x, at.y) * DVec2::new(1.0, normal.z.signum()),
        })
        .collect();
    let side = |a: usize, b: usize, c: usize| (flat[b] - flat[a]).perp_dot(flat[c] - flat[a]);
    let bends_in = |k: usize| side((k + count - 1) % count, k, (k + 1) % count) < 0.0;
    if normal.length_squared() == 0.0 || !(0..count).any(bends_in) {
        return Ok(fan());
    }
    let mut left: Vec<usize> = (0..count).collect();
    let mut triangles = Vec::with_capacity(3 * (count - 2));
    let (mut at, mut in_vain) = (0, 0);
    while left.len() > 3 {
        let here = at % left.len();
        let before = (here + left.len() - 1) % left.len();
        let [a, b, c] = [before, here, (here + 1) % left.len()].map(|k| left[k]);
        *looks = looks.checked_sub(left.len()).ok_or_else(|| {
            let message = "its faces that bend inwards have too many corners; triangulate the mesh";
            Fault::Unreadable(message.to_owned())
        })?;
        let is_within = |k: &usize| {
            ![a, b, c].iter().any(|corner| flat[*corner] == flat[*k])
                && side(a, b, *k) >= 0.0
                && side(b, c, *k) >= 0.0
                && side(c, a, *k) >= 0.0
        };
        let is_ear = side(a, b, c) >= 0.0 && !left.iter().any(is_within);
        // A face that crosses itself may have none.
        if is_ear || in_vain > left.len() {
            triangles.extend([a, b, c]);
            left.remove(here);
            in_vain = 0;
        } else {
            at = here;
            in_vain += 1;
        }
        at += usize::from(!is_ear);
    }
    triangles.extend(left);
    Ok(triangles)
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
