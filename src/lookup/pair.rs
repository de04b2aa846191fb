//! One pair of directions: parts of all threads side by side, as many as a vector has lanes.

use super::Quantity;
use super::grid::{Places, settle_one, start};
use crate::brdf::{
    Optics, Response, ThreadFrame, ThreadPair, Weave, projection_of_arcs, projection_of_tilts,
    without_cosine,
};
use crate::chart::Several;
use crate::math::simd::{Kernel, Row, Vector};
use crate::math::{Vec3, each, splat};
use crate::table::{Energy, GridGroup, Group, PARTS, Parts, Place, SegmentGroup, Table, dye, load};

/// What is asked of a table: a value, and whether it was not baked.
pub(super) struct Pair<'a> {
    pub(super) table: &'a Table,
    pub(super) parts: &'a Parts,
    pub(super) albedos: &'a [[f32; 3]],
    pub(super) quantity: Quantity,
    pub(super) wi: [f32; 3],
    pub(super) wr: [f32; 3],
}

impl Kernel for Pair<'_> {
    type Output = ([f32; 3], bool);

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) -> ([f32; 3], bool) {
        let Self {
            table,
            parts,
            wi,
            wr,
            ..
        } = self;
        if !(wi[2] > 0.0 && wr[2] > 0.0) {
            return ([0.0; 3], false);
        }
        let pair = [each(wi, splat::<f32, R>), each(wr, splat::<f32, R>)];
        let mut sums = Sums::zero();
        for grids in &parts.grids {
            look_up(table, grids, pair, self.albedos, &mut sums);
        }
        for segments in &parts.segments {
            let weight = R::load(&segments.group.weight);
            let albedo = segments.group.albedo(self.albedos);
            sums.add(weight, albedo, direct(table, segments, pair));
        }
        for tilts in &parts.tilts {
            let [a, b, c, d, e, f, cos, sin] = tilts.numbers::<R>();
            let [wi, wr] = in_frame([a, b], pair);
            let pair = ThreadPair::new(wi, wr, splat(table.sigma_u));
            let response = pair.response(&Optics::of_numbers([c, d, e, f]), cos, sin);
            let weight = R::load(&tilts.weight);
            sums.add(weight, tilts.albedo(self.albedos), response);
        }
        for facings in &parts.facings {
            let [a, b, cos, sin] = facings.numbers::<R>();
            let [_, wr] = in_frame([a, b], pair);
            sums.project(facings, projection_of_tilts([cos, sin], wr));
        }
        for arcs in &parts.arcs {
            let [a, b, arc @ ..] = arcs.numbers::<R>();
            let [_, wr] = in_frame([a, b], pair);
            sums.project(arcs, projection_of_arcs(arc, wr));
        }
        let [r, g, b] = sums.colour;
        let dimming = match table.energy {
            Energy::AsIs => 1.0,
            Energy::PerView => table.dimming(self.albedos, self.wr),
        };
        let weave = Weave {
            q: table.gap * wr[2] + total(sums.q),
            scale: dimming * table.rho_scale,
            sum: [total(r), total(g), total(b)],
        };
        let value = match self.quantity {
            Quantity::Brdf => without_cosine(weave.rho(), wi[2]),
            Quantity::Rho => weave.rho(),
        };
        (value, sums.is_missing)
    }
}

/// Directions in the frames of threads.
#[inline(always)]
fn in_frame<V: Vector>(frame: [V; 2], [wi, wr]: [Vec3<V>; 2]) -> [Vec3<V>; 2] {
    let frame = ThreadFrame::of_numbers(frame);
    [frame.to_thread(wi), frame.to_thread(wr)]
}

/// S and V of segments.
#[inline(always)]
fn direct<V: Row>(table: &Table, segments: &SegmentGroup, pair: [Vec3<V>; 2]) -> Response<V> {
    let [a, b, c, d, e, f, arc @ ..] = segments.group.numbers::<V>();
    let [wi, wr] = in_frame([a, b], pair);
    let pair = ThreadPair::new(wi, wr, splat(table.sigma_u));
    let optics = Optics::of_numbers([c, d, e, f]);
    let SegmentGroup { rule, nodes, .. } = segments;
    rule.response_of(&pair, &optics, arc, nodes)
}

/// Adds what grids say, and what is near their threads' horizons.
#[inline(always)]
fn look_up<V: Row>(
    table: &Table,
    grids: &GridGroup,
    pair: [Vec3<V>; 2],
    albedos: &[[f32; 3]],
    sums: &mut Sums<V>,
) {
    let [a, b, c, d, e, f, g, h, s, v, units @ ..] = grids.group.numbers::<V>();
    let [wi, wr] = in_frame([a, b], pair);
    let coordinates = Several::of_numbers([c, d, e, f, g, h]);
    let (u, share) = coordinates.with_share(wi, wr);
    let mut places = find(grids, u, units);
    let mut missing = [false; PARTS];
    if grids.is_partial {
        let points;
        (points, missing) = settle(table, grids, u, &places);
        places = find(grids, points, units);
    }
    let strides = &grids.strides;
    let strides = [
        V::load_index(&strides[0]),
        V::load_index(&strides[1]),
        V::load_index(&strides[2]),
        V::load_index(&strides[3]),
    ];
    let mut all = Places::<PARTS>::new();
    all.put(0, start(&places, strides), &places);
    let first = firsts(&places);
    for (lane, thread) in grids.group.threads.iter().enumerate() {
        let Some(grid) = table.threads[*thread].grid() else {
            continue;
        };
        if let Some(rows) = &grid.rows {
            let first = [
                first[0][lane],
                first[1][lane],
                first[2][lane],
                first[3][lane],
            ];
            all.put_tile(rows, lane, first, grids.strides[0][lane]);
        }
        all.sum_one::<V>(grid, lane);
    }
    let weight = V::load(&grids.group.weight);
    let albedo = grids.group.albedo(albedos);
    if grids.is_partial {
        let share = share.to_array();
        let mut lanes = missing.iter().zip(share);
        sums.is_missing |= lanes.any(|(missing, share)| *missing && share > 0.0);
    }
    sums.add(weight * share, albedo, all.both(0, [s, v]));
    if grids.rims.is_empty() {
        return;
    }
    let beyond = (V::one() - share).to_array();
    let threads = grids.group.threads.len();
    if beyond[..threads].iter().all(|beyond| *beyond <= 0.0) {
        return;
    }
    for segments in &grids.rims {
        let group = &segments.group;
        let mut weight = group.weight;
        let (mut threads, mut albedo) = ([0; PARTS], group.albedo);
        for (lane, grid) in group.threads.iter().enumerate() {
            weight[lane] *= beyond[*grid];
            threads[lane] = grids.group.threads[*grid];
        }
        dye(&mut albedo, &threads[..group.threads.len()], albedos);
        let response = direct(table, segments, pair);
        sums.add(V::load(&weight), load(&albedo), response);
    }
}

/// Places in grids.
#[inline(always)]
fn find<V: Vector>(grids: &GridGroup, u: [V; 4], units: [V; 4]) -> [Place<V>; 4] {
    [
        place(grids, 0, u[0], units[0]),
        place(grids, 1, u[1], units[1]),
        place(grids, 2, u[2], units[2]),
        place(grids, 3, u[3], units[3]),
    ]
}

/// First coefficients, by axis and lane.
#[inline(always)]
fn firsts<V: Vector>(places: &[Place<V>; 4]) -> [[u32; PARTS]; 4] {
    let mut first = [[0; PARTS]; 4];
    for (to, place) in first.iter_mut().zip(places) {
        V::store_index(place.first, to);
    }
    first
}

/// Points of pairs that were not baked moved to the nearest that were, and which these are.
#[inline(always)]
fn settle<V: Vector>(
    table: &Table,
    grids: &GridGroup,
    u: [V; 4],
    places: &[Place<V>; 4],
) -> ([V; 4], [bool; PARTS]) {
    let first = firsts(places);
    let mut points = [[0.0; PARTS]; 4];
    for (to, u) in points.iter_mut().zip(u) {
        u.store(to);
    }
    let mut missing = [false; PARTS];
    for (lane, thread) in grids.group.threads.iter().enumerate() {
        let mut point = [
            points[0][lane],
            points[1][lane],
            points[2][lane],
            points[3][lane],
        ];
        let first = [
            first[0][lane],
            first[1][lane],
            first[2][lane],
            first[3][lane],
        ];
        if let Some(grid) = table.threads[*thread].grid() {
            missing[lane] = settle_one(grid, first, &mut point);
        }
        for (to, x) in points.iter_mut().zip(point) {
            to[lane] = x;
        }
    }
    (load(&points), missing)
}

/// Places on one of the axes of grids.
#[inline(always)]
fn place<V: Vector>(grids: &GridGroup, axis: usize, u: V, unit: V) -> Place<V> {
    let start = V::load_index(&grids.starts[axis]);
    Place::of_words_from(&grids.words, start, u, unit)
}

/// Sums over parts.
struct Sums<V> {
    colour: [V; 3],
    q: V,
    /// Whether some grid has not the pair.
    is_missing: bool,
}

impl<V: Vector> Sums<V> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            colour: [V::zero(); 3],
            q: V::zero(),
            is_missing: false,
        }
    }

    /// Adds what parts reflect.
    #[inline(always)]
    fn add(&mut self, weight: V, albedo: [V; 3], response: Response<V>) {
        let (surface, volume) = (weight * response.surface, weight * response.volume);
        for (sum, albedo) in self.colour.iter_mut().zip(albedo) {
            *sum += albedo.mul_add(volume, surface);
        }
    }

    #[inline(always)]
    fn project<const K: usize>(&mut self, group: &Group<K>, projection: V) {
        self.q += V::load(&group.weight) * projection;
    }
}

/// The sum of all lanes.
#[inline(always)]
fn total<V: Vector>(lanes: V) -> f32 {
    let lanes = lanes.to_array();
    let mut sum = 0.0;
    for lane in lanes.as_ref() {
        sum += lane;
    }
    sum
}
