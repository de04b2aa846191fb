//! What a path tracer needs of a fabric: albedos by view, and histograms of the highlight's angle.
//!
//! Both are sums over the same pairs: for every node of a view, over every bin, Gauss–Legendre along q and midpoints along φ. Edges
//! of bins are the same for all views, so that what lies at an angle may be interpolated between them: quantiles of a mixture of all
//! angles alike and of where the thread's highlights lie, as wide as its lobes.

use std::f64::consts::{FRAC_PI_2, PI};

use rayon::prelude::*;

use crate::brdf::{Reweighting, ThreadFrame};
use crate::fabric::{Fabric, Thread};
use crate::model::{Rule, Sadeghi, gauss_legendre};
use crate::progress::{Cancelled, Progress};
use crate::table::{
    ALBEDO_NODES, Albedo, BINS, EDGE_UNIT, HISTOGRAM_NODES, Histogram, SAMPLED, Sampling,
    albedo_place, histogram_place,
};

/// Exact enough: a table errs more.
const RULE: Rule = Rule::Quadrature(8);
/// Places along q in a bin, and along φ: of albedos, which have many nodes, and of histograms.
const FEW: [usize; 2] = [2, 16];
const MANY: [usize; 2] = [4, 24];
/// Views are nodes up to this cosine, of 89.8°.
const LOWEST: f64 = 0.004;
/// Of the mixture, what all angles alike have, and the highlights of S and V.
const EVENLY: f64 = 0.35;
const HIGHLIGHTS: [f64; 2] = [0.4, 0.25];
/// A bin has at least so much of the largest density: light may be there that its places do not see.
const FLOOR: f64 = 3e-3;
/// What a bin that a view does not see has of the nearest that it does: others between nodes do.
const UNSEEN: f64 = 0.3;

/// Of every visible thread.
pub(super) fn sampling_of(
    fabric: &Fabric,
    has_histogram: bool,
    progress: Progress<'_>,
) -> Result<Vec<Sampling>, Cancelled> {
    let model = Sadeghi::<f32>::new(fabric, RULE);
    let threads: Vec<&Thread> = fabric.visible_threads().collect();
    let steps = progress.steps(threads.len());
    let mut all = Vec::new();
    for (index, thread) in threads.into_iter().enumerate() {
        let viewed = Viewed {
            model: &model,
            reweighting: fabric.reweighting,
            index,
            frame: thread.frame(),
            edges: edges_of(thread),
        };
        let nodes = viewed.nodes(ALBEDO_NODES, albedo_place, FEW);
        let share = |node: &Node| node.total.map(|x| x as f32);
        let albedo = Albedo {
            shares: nodes.iter().map(share).collect(),
        };
        let histogram = (has_histogram && index < SAMPLED).then(|| {
            let [count_q, count_l] = HISTOGRAM_NODES;
            let nodes = viewed.nodes([count_q, 2 * count_l - 1], histogram_place, MANY);
            Box::new(histogram(&viewed.edges, &nodes))
        });
        all.push(Sampling { albedo, histogram });
        steps.advance()?;
    }
    Ok(all)
}

/// A thread of a model, to be seen from everywhere.
struct Viewed<'a> {
    model: &'a Sadeghi<f32>,
    reweighting: Reweighting,
    index: usize,
    frame: ThreadFrame<f64>,
    edges: [i16; BINS + 1],
}

impl Viewed<'_> {
    /// What `counts` nodes have, q fastest, that are evenly spaced in `place` from −1 to 1.
    fn nodes(
        &self,
        counts: [usize; 2],
        place: impl Fn(f64) -> f64 + Sync,
        places: [usize; 2],
    ) -> Vec<Node> {
        let x = |k: usize, count: usize| {
            let t = 2.0 * k as f64 / (count - 1) as f64 - 1.0;
            let [low, high] = reaching([-1.0, 1.0], &place, t);
            0.5 * (low + high)
        };
        let nodes = (0..counts[0] * counts[1]).into_par_iter().map(|node| {
            let wr = view(
                x(node % counts[0], counts[0]),
                x(node / counts[0], counts[1]),
            );
            self.node(wr, places)
        });
        nodes.collect()
    }
}

/// The two numbers next to where `ascending` reaches `value`, within a range.
fn reaching([mut low, mut high]: [f64; 2], ascending: impl Fn(f64) -> f64, value: f64) -> [f64; 2] {
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if ascending(middle) < value {
            low = middle;
        } else {
            high = middle;
        }
    }
    [low, high]
}

/// wr of a node, in the thread's frame.
fn view(q: f64, l: f64) -> [f64; 3] {
    let r = (1.0 - l * l) / (1.0 + l * l);
    let [x, y, z] = [
        r * 2.0 * q / (1.0 + q * q),
        2.0 * l / (1.0 + l * l),
        r * (1.0 - q * q) / (1.0 + q * q),
    ];
    if z >= LOWEST {
        return [x, y, z];
    }
    let flat = (1.0 - LOWEST * LOWEST).sqrt() / x.hypot(y);
    [x * flat, y * flat, LOWEST]
}

/// Where bins end, in units of 1/[`EDGE_UNIT`] of q.
fn edges_of(thread: &Thread) -> [i16; BINS + 1] {
    // Where the direction changes, highlights are anywhere.
    let mut parts = Vec::new();
    if thread.is_straight() {
        let curve = thread.tangents::<f64>();
        parts.extend(
            curve
                .tilts()
                .iter()
                .map(|tilt| (-tilt.angle, -tilt.angle, tilt.weight)),
        );
        parts.extend(curve.segments().iter().map(|s| (-s.to, -s.from, s.weight)));
    }
    let gammas = [thread.optics.gamma_s, thread.optics.gamma_v];
    let below = |psi: f64| {
        let mut sum = EVENLY / PI * (psi + FRAC_PI_2);
        for (gamma, share) in gammas.into_iter().zip(HIGHLIGHTS) {
            let scale = gamma * 3f64.sqrt() / PI;
            for (from, to, weight) in &parts {
                let of = |psi| share * weight * blurred(psi, *from, *to, scale);
                sum += of(psi) - of(-FRAC_PI_2);
            }
        }
        sum
    };
    let all = below(FRAC_PI_2);
    let mut edges = [0; BINS + 1];
    for (k, edge) in edges.iter_mut().enumerate() {
        let [low, _] = reaching([-FRAC_PI_2, FRAC_PI_2], below, all * k as f64 / BINS as f64);
        *edge = (f64::from(EDGE_UNIT) * (0.5 * low).tan()).round() as i16;
    }
    // All different, however narrow the lobe.
    let unit = EDGE_UNIT as i16;
    edges[0] = -unit;
    for k in 1..BINS {
        edges[k] = edges[k].max(edges[k - 1] + 1);
    }
    edges[BINS] = unit;
    for k in (1..BINS).rev() {
        edges[k] = edges[k].min(edges[k + 1] - 1);
    }
    edges
}

/// The part below `x` of a box from `from` to `to` that is blurred by a logistic distribution of `scale`.
fn blurred(x: f64, from: f64, to: f64, scale: f64) -> f64 {
    if to - from < 1e-6 * scale {
        return 1.0 / (1.0 + ((from - x) / scale).exp());
    }
    // ln(1 + eᵗ)
    let soft = |t: f64| t.max(0.0) + (-t.abs()).exp().ln_1p();
    (soft((x - from) / scale) - soft((x - to) / scale)) * scale / (to - from)
}

/// What a view has of a thread.
struct Node {
    /// By bin: of S and of V, and the width along q that is seen.
    bins: [([f64; 2], f64); BINS],
    /// Of all bins, over Q.
    total: [f64; 2],
}

impl Viewed<'_> {
    /// What a view in the thread's frame has, by so many places along q in a bin and along φ.
    fn node(&self, wr: [f64; 3], [along_q, along_phi]: [usize; 2]) -> Node {
        let Self {
            model,
            reweighting,
            index,
            frame,
            edges,
        } = self;
        let rule = gauss_legendre(along_q);
        let [x_r, y_r, z_r] = wr;
        let end = |x: f64| x / (x.hypot(z_r) + z_r);
        let seen = [end(x_r - 1.0), end(x_r + 1.0)];
        let q_of = |k: usize| f64::from(edges[k]) / f64::from(EDGE_UNIT);
        let mut lights: [Vec<f32>; 3] = [const { Vec::new() }; 3];
        let mut weights = Vec::new();
        let mut widths = [0.0; BINS];
        for (bin, width) in widths.iter_mut().enumerate() {
            let [from, to] = [q_of(bin).max(seen[0]), q_of(bin + 1).min(seen[1])];
            if to <= from {
                continue;
            }
            *width = to - from;
            for [node, weight] in &rule {
                let q = 0.5 * (from + to) + 0.5 * (to - from) * node;
                let [cos, sin] = [(1.0 - q * q) / (1.0 + q * q), 2.0 * q / (1.0 + q * q)];
                // In the frame where H has no x.
                let (x, up_r) = (x_r * cos - z_r * sin, x_r * sin + z_r * cos);
                let c = ((1.0 - x) * (1.0 + x)).max(0.0).sqrt();
                let last = (-sin * x / (c * cos).max(1e-300)).clamp(-1.0, 1.0).acos();
                let step = 2.0 * last / along_phi as f64;
                for k in 0..along_phi {
                    let (sin_phi, cos_phi) = (step * (k as f64 + 0.5) - last).sin_cos();
                    let up = c * cos_phi;
                    let wi = [up * sin - x * cos, c * sin_phi, up * cos + x * sin];
                    let h = up + up_r;
                    let above = h.max(0.0) * (1.0 + cos);
                    weights.push((bin, 0.5 * weight * (to - from) * step * above));
                    for (to, x) in lights.iter_mut().zip(frame.to_surface(wi)) {
                        to.push(x as f32);
                    }
                }
            }
        }
        let wr = frame
            .to_surface([x_r, y_r, z_r])
            .map(|x| vec![x as f32; weights.len()]);
        let mut values = [(); 3].map(|()| vec![0.0; weights.len()]);
        model.shares_batch(
            *index,
            lights.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            values.each_mut().map(Vec::as_mut_slice),
        );
        let mut bins = widths.map(|width| ([0.0; 2], width));
        let mut total = [0.0; 2];
        for (place, (bin, weight)) in weights.into_iter().enumerate() {
            for part in 0..2 {
                let light = weight * f64::from(values[part][place]);
                total[part] += light;
                // Of a view's Q all drawn have the same.
                bins[bin].0[part] += match reweighting {
                    Reweighting::View => light * f64::from(values[2][place]),
                    Reweighting::Both => light,
                };
            }
        }
        Node { bins, total }
    }
}

/// The histogram of nodes from one side to the other; of what looks different from both, the mean.
fn histogram(edges: &[i16; BINS + 1], nodes: &[Node]) -> Histogram {
    let [count_q, count_l] = HISTOGRAM_NODES;
    let mut totals = [[0.0; 2]; HISTOGRAM_NODES[0] * HISTOGRAM_NODES[1]];
    let mut sums = [[[0; 2]; BINS + 1]; HISTOGRAM_NODES[0] * HISTOGRAM_NODES[1]];
    for view in 0..totals.len() {
        let [q, l] = [view % count_q, view / count_q];
        let row = |l: usize| &nodes[l * count_q + q];
        let sides = [row(count_l - 1 + l), row(count_l - 1 - l)];
        for part in 0..2 {
            let density = |side: &Node, bin: usize| {
                let (light, width) = side.bins[bin];
                (width > 0.0).then(|| light[part] / width)
            };
            let mean = |bin: usize| {
                let both = sides.map(|side| density(side, bin));
                let known = both.into_iter().flatten();
                let count = known.clone().count();
                (count > 0).then(|| known.sum::<f64>() / count as f64)
            };
            let known: Vec<Option<f64>> = (0..BINS).map(mean).collect();
            let most = known.iter().flatten().copied().fold(0.0, f64::max);
            let nearest = |bin: usize| {
                let distance = |other: &usize| other.abs_diff(bin);
                let seen = (0..BINS).filter(|other| known[*other].is_some());
                seen.min_by_key(distance).and_then(|other| known[other])
            };
            let mut sum = [0.0; BINS + 1];
            for bin in 0..BINS {
                let density = known[bin].or_else(|| nearest(bin).map(|light| UNSEEN * light));
                let width = f64::from(edges[bin + 1]) - f64::from(edges[bin]);
                let density = density.unwrap_or(0.0) + FLOOR * most;
                sum[bin + 1] = sum[bin] + density * width / f64::from(EDGE_UNIT);
            }
            let total = sum[BINS];
            if !(total > 0.0 && total.is_finite()) {
                continue;
            }
            totals[view][part] = total as f32;
            // No bin is of nothing.
            let unit = f64::from(u16::MAX) / total;
            let mut last = 0;
            for bin in 1..BINS {
                let at = (sum[bin] * unit).round() as u16;
                last = at.max(last + 1).min(u16::MAX - (BINS - bin) as u16);
                sums[view][bin][part] = last;
            }
            sums[view][BINS][part] = u16::MAX;
        }
    }
    Histogram {
        edges: *edges,
        totals,
        sums,
    }
}
