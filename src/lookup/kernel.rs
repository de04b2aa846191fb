//! From pairs of directions to reflectance.

use super::interpolate;
use crate::brdf::{PlacedNodes, Response, Reweighting, ThreadPair, ThreadResponse, Weave};
use crate::math::simd::{Row, Vector};
use crate::math::{Vec3, each, splat};
use crate::table::{SegmentGrid, Segments, Table, ThreadTable};

/// What a table says of pairs.
pub(super) struct Woven<V> {
    pub(super) weave: Weave<V>,
    /// Above 0 where the table was not baked for the pair, or for these albedos.
    pub(super) missing: V,
}

/// The weave's sum for pairs in the surface frame, of which `see` sees every thread's part.
#[inline(always)]
pub(super) fn weave<V: Vector, R: Row>(
    table: &Table,
    albedos: &[[f32; 3]],
    wi: Vec3<V>,
    wr: Vec3<V>,
    mut see: impl FnMut(ThreadResponse<V>),
) -> Woven<V> {
    let above = V::both(V::zero().lt(wi[2]), V::zero().lt(wr[2]));
    let mut weave = Weave::new(
        splat(table.gap),
        V::select(above, wr[2], V::zero()),
        splat(table.rho_scale),
    );
    let mut missing = V::zero();
    for (index, thread) in table.threads.iter().enumerate() {
        let albedo = albedos.get(index).unwrap_or(&thread.albedo);
        if !thread.takes_albedo() && *albedo != thread.albedo {
            missing = V::one();
        }
        let ThreadResponse {
            response,
            projection,
        } = thread_response::<V, R>(table, thread, wi, wr, &mut missing);
        let response = ThreadResponse {
            response: Response {
                surface: V::select(above, response.surface, V::zero()),
                volume: V::select(above, response.volume, V::zero()),
            },
            projection: V::select(above, projection, V::zero()),
        };
        weave.add(splat(thread.coverage), each(*albedo, splat), &response);
        see(response);
    }
    Woven {
        weave,
        missing: V::select(above, missing, V::zero()),
    }
}

#[inline(always)]
fn thread_response<V: Vector, R: Row>(
    table: &Table,
    thread: &ThreadTable,
    wi: Vec3<V>,
    wr: Vec3<V>,
    missing: &mut V,
) -> ThreadResponse<V> {
    let frame = thread.frame.cast::<V>();
    let (wi, wr) = (frame.to_thread(wi), frame.to_thread(wr));
    let tangents = &thread.tangents;
    let grids = match &thread.segments {
        Segments::None | Segments::Direct(_) => [None, None],
        Segments::Grid(segments) => [Some(&segments.grid), None],
        Segments::Curve(curve) => [Some(&curve.response), Some(&curve.projection)],
    };
    let already_missing = *missing;
    // One place that looks up, since it is most of the code.
    let mut values = [Response::zero(); 2];
    for (value, grid) in values.iter_mut().zip(grids) {
        let Some(grid) = grid else { break };
        let found = interpolate::value::<V, R>(grid, table.is_partial, wi, wr);
        *missing += found.missing;
        *value = found.response;
    }
    let [mut response, of_projection] = values;
    let (direct, share) = direct_part(&thread.segments, wi, wr);
    *missing = V::select(V::zero().lt(share), *missing, already_missing);
    if let Segments::Curve(_) = thread.segments {
        return ThreadResponse {
            response,
            projection: of_projection.surface,
        };
    }
    let has_tilts = !tangents.tilts().is_empty();
    let both = table.reweighting == Reweighting::Both;
    let mut projection = V::zero();
    if both || has_tilts || direct.is_some() {
        let pair = ThreadPair::new(wi, wr, splat(table.sigma_u));
        let optics = thread.optics.cast::<V>();
        if let Some(nodes) = direct {
            let of_grid = response;
            response = Response::zero()
                .plus(V::one() - share, nodes.mean_response(&pair, &optics))
                .plus(share, of_grid);
        }
        if has_tilts {
            response = response.plus(V::one(), tangents.response_of_tilts(&pair, &optics));
        }
        if both {
            projection = tangents.joint_projection(&pair);
        }
    }
    if !both {
        projection = tangents.projection(wr);
    }
    ThreadResponse {
        response,
        projection,
    }
}

/// What evaluates a thread's segments directly, if any of the pairs takes it, and the share of the grid in each.
#[inline(always)]
fn direct_part<V: Vector>(
    segments: &Segments,
    wi: Vec3<V>,
    wr: Vec3<V>,
) -> (Option<&PlacedNodes<f32>>, V) {
    match segments {
        Segments::Direct(nodes) => (Some(nodes), V::zero()),
        Segments::Grid(segments) => {
            let SegmentGrid { grid, rim } = &**segments;
            let Some(nodes) = rim else {
                return (None, V::one());
            };
            let share = grid.coordinates.share_of_box(wi, wr);
            let array = share.to_array();
            let is_any = array.as_ref().iter().any(|share| *share < 1.0);
            (is_any.then_some(nodes), share)
        }
        Segments::None | Segments::Curve(_) => (None, V::one()),
    }
}
