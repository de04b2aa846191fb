//! Meshes of cloth: with the warp as their tangents.

use std::f32::consts::{PI, TAU};

use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;

/// A point of the cloth.
struct Place {
    position: Vec3,
    normal: Vec3,
    warp: Vec3,
}

/// A sphere whose warp is to the right where it faces +z, and is carried from there along great circles without turning: the one of
/// `sateen render sphere`.
pub(crate) fn sphere(radius: f32) -> Mesh {
    grid([192, 384], |u, v| {
        let (sin, cos) = (PI * u).sin_cos();
        let (up, right) = (TAU * v).sin_cos();
        let normal = Vec3::new(sin * right, sin * up, cos);
        let bent = 1.0 - cos;
        Place {
            position: radius * normal,
            normal,
            warp: Vec3::new(1.0 - bent * right * right, -bent * right * up, -sin * right),
        }
    })
}

/// A sheet that hangs in pleats, which open from the rail down, with its warp along them.
pub(crate) fn sheet(width: f32, height: f32) -> Mesh {
    const PLEATS: f32 = 4.0;
    grid([32, 256], |u, v| {
        let angular = TAU * PLEATS / width;
        let (sin, cos) = (TAU * PLEATS * v).sin_cos();
        let depth = width * (0.02 + 0.02 * u);
        let warp = Vec3::new(0.0, -height, 0.02 * width * cos).normalize();
        let weft = Vec3::new(1.0, 0.0, -depth * angular * sin);
        Place {
            position: Vec3::new(width * (v - 0.5), height * (0.5 - u), depth * cos),
            normal: warp.cross(weft).normalize(),
            warp,
        }
    })
}

/// The surface of (u, v) in the unit square, in that many cells; u, v and the normal are right-handed.
fn grid([rows, columns]: [u32; 2], at: impl Fn(f32, f32) -> Place) -> Mesh {
    let mut positions = Vec::new();
    let mut normals = Vec::new();
    let mut tangents = Vec::new();
    let mut indices = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let place = at(row as f32 / rows as f32, column as f32 / columns as f32);
            positions.push(place.position);
            normals.push(place.normal);
            tangents.push(place.warp.extend(1.0));
            if row < rows && column < columns {
                let corner = row * (columns + 1) + column;
                let below = corner + columns + 1;
                indices.extend([corner, below, corner + 1, corner + 1, below, below + 1]);
            }
        }
    }
    Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
    .with_inserted_attribute(Mesh::ATTRIBUTE_TANGENT, tangents)
    .with_inserted_indices(Indices::U32(indices))
}
