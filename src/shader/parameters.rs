//! What shaders read besides the volume: `mod.rs` has the layout.

use crate::brdf::{PlacedNodes, Reweighting};
use crate::chart::{Chart, Coordinates};
use crate::table::{Segments, Table, ThreadTable};
use crate::volume::{GridVolume, Nodes, Volume};

const HEADER: usize = 2;
const THREAD: usize = 7;

/// The parameters of a table and its volume.
///
/// # Panics
/// When the volume is of another table.
pub fn parameters(table: &Table, volume: &Volume) -> Vec<[f32; 4]> {
    let [width, height, depth] = volume.size().map(|side| side as f32);
    let threads = table.threads();
    let both = table.reweighting() == Reweighting::Both;
    let mut array = vec![
        [table.gap, table.sigma_u, table.rho_scale, flag(both)],
        [width, height, depth, threads.len() as f32],
    ];
    array.resize(HEADER + THREAD * threads.len(), [0.0; 4]);
    let mut grids = volume.grids().iter();
    for (index, thread) in threads.iter().enumerate() {
        let start = HEADER + THREAD * index;
        let record = thread_record(thread, &mut grids, &mut array);
        array[start..start + THREAD].copy_from_slice(&record);
    }
    assert!(grids.next().is_none(), "the volume is of another table");
    array
}

/// Where in the array the grids are, in the order of the volume.
#[cfg(feature = "export")]
pub(crate) fn grid_places(array: &[[f32; 4]]) -> Vec<usize> {
    let threads = array[1][3] as usize;
    let records = array[HEADER..].chunks(THREAD).take(threads);
    let places = records.flat_map(|record| {
        let count = match record[0][3] {
            1.0 => 1,
            3.0 => 2,
            _ => 0,
        };
        record[THREAD - 1].into_iter().take(count)
    });
    places.map(|place| place as usize).collect()
}

fn flag(is: bool) -> f32 {
    f32::from(u8::from(is))
}

fn thread_record<'a>(
    thread: &ThreadTable,
    grids: &mut impl Iterator<Item = &'a GridVolume>,
    array: &mut Vec<[f32; 4]>,
) -> [[f32; 4]; THREAD] {
    let [cos, sin] = thread.frame.numbers();
    let [r, g, b] = thread.albedo;
    let optics = thread.optics.numbers();
    let mut grid = |array: &mut Vec<[f32; 4]>| {
        let grid = grids.next().expect("the volume is of another table");
        push_grid(grid, array)
    };
    let tangents = thread.tangents();
    let tilts = push(
        array,
        tangents
            .tilts()
            .iter()
            .map(|t| [t.cos, t.sin, t.weight, t.angle]),
    );
    let arcs = push_arcs(array, tangents.arcs());
    let (mut direct, mut places) = ([[0.0; 4]; 2], [0.0; 2]);
    let kind = match &thread.segments {
        Segments::None => 0.0,
        Segments::Grid(segments) => {
            places[0] = grid(array);
            if let Some(rim) = &segments.rim {
                direct = push_direct(rim, array);
            }
            1.0
        }
        Segments::Direct(nodes) => {
            direct = push_direct(nodes, array);
            2.0
        }
        Segments::Curve(_) => {
            places = [grid(array), grid(array)];
            3.0
        }
    };
    [
        [cos, sin, thread.coverage, kind],
        [r, g, b, 0.0],
        optics,
        [tilts[0], tilts[1], arcs[0], arcs[1]],
        direct[0],
        direct[1],
        [places[0], places[1], 0.0, 0.0],
    ]
}

/// Where they begin, and how many there are.
fn push(array: &mut Vec<[f32; 4]>, entries: impl Iterator<Item = [f32; 4]>) -> [f32; 2] {
    let start = array.len();
    array.extend(entries);
    [start as f32, (array.len() - start) as f32]
}

/// What evaluates segments directly: where they and the nodes begin and how many there are, and how.
fn push_direct(direct: &PlacedNodes<f32>, array: &mut Vec<[f32; 4]>) -> [[f32; 4]; 2] {
    let (half_reach, [is_stiff, surface, volume]) = direct.numbers();
    let [segment, segments] = push_arcs(array, direct.arcs());
    let nodes = direct.nodes().iter();
    let [node, count] = push(
        array,
        nodes.map(|[node, weight]| [*node, *weight, 0.0, 0.0]),
    );
    [
        [segment, segments, node, count],
        [half_reach, flag(is_stiff), flag(surface), flag(volume)],
    ]
}

fn push_arcs(array: &mut Vec<[f32; 4]>, arcs: impl Iterator<Item = [f32; 6]>) -> [f32; 2] {
    let entries = arcs.flat_map(|[cos_a, sin_a, cos_b, sin_b, half_tangent, density]| {
        let ends = [sin_a.atan2(cos_a), sin_b.atan2(cos_b)];
        [
            [cos_a, sin_a, cos_b, sin_b],
            [half_tangent, density, ends[0], ends[1]],
        ]
    });
    let [start, count] = push(array, entries);
    [start, 0.5 * count]
}

fn push_grid(grid: &GridVolume, array: &mut Vec<[f32; 4]>) -> f32 {
    let mut axes = grid.nodes().each_ref().map(|nodes| push_warp(nodes, array));
    axes[3][3] = 0.01 * f32::from(grid.coordinates().rim().hundredths());
    let (chart, ends, sides) = match grid.coordinates() {
        Coordinates::Thread {
            chart,
            ends_fold,
            sides_fold,
            ..
        } => {
            let chart = match chart {
                Chart::Thesis => 0.0,
                Chart::Highlight => 1.0,
            };
            (chart, ends_fold, sides_fold)
        }
        Coordinates::Isotropic => (2.0, false, false),
        Coordinates::View { isotropic } => (3.0, false, isotropic),
    };
    let [s, v] = grid.scale;
    let [_, _, n2, n3] = grid.nodes().each_ref().map(|nodes| nodes.count() as f32);
    let first = grid.first_slab as f32;
    let head = [[chart, flag(ends), flag(sides), first], [s, v, n2, n3]];
    push(array, head.into_iter().chain(axes))[0]
}

fn push_warp(nodes: &Nodes, array: &mut Vec<[f32; 4]>) -> [f32; 4] {
    let warp = nodes.warp();
    let pairs = warp.chunks(2).map(|two| {
        let [a, b] = [two[0], two[two.len() - 1]];
        [a[0], a[1], b[0], b[1]]
    });
    let [start, _] = push(array, pairs);
    [start, warp.len() as f32, (nodes.count() - 1) as f32, 0.0]
}
