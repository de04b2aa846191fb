//! The Sadeghi microcylinder model by direct integration over the tangents.
//!
//! S_j and V_j are means over the tangents of thread j of the closed forms in [`crate::brdf`], which also has their sum
//! over threads ([`Weave`]). Published parameters make the model neither reciprocal nor energy conserving.

use std::collections::BTreeMap;

use super::pairs::{PairFunction, at_pair, map_pairs};
use super::{AdaptiveMean, Model, gauss_legendre};
use crate::brdf::{
    Components, Optics, PlacedNodes, Response, Reweighting, TangentCurve, ThreadFrame, ThreadPair,
    ThreadResponse, Weave,
};
use crate::fabric::{self, Fabric, Sweep};
use crate::math::simd::{Colours, Directions, Level, Row, Vector};
use crate::math::{Lanes, Real, Vec3, each, splat};

/// How the means over a thread's tangents are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// That many midpoints of equal length along the tangent curve, for Q too; the thesis takes 50.
    Midpoint(u32),
    /// That many tilts per segment, placed for each pair, and Q in closed form; of what sweeps over directions, that many fixed
    /// tangents per 45°, for Q too.
    Quadrature(u32),
    /// Adaptive Gauss–Legendre in f64 to a relative tolerance, and Q in closed form.
    Adaptive(f64),
}

impl Rule {
    /// What error is measured against.
    pub const REFERENCE: Self = Self::Adaptive(1e-7);
    /// The rule of the thesis, what time is measured against.
    pub const THESIS: Self = Self::Midpoint(50);
}

/// Of what sweeps over directions, parts of at most this angle have nodes of their own, radians.
const SWEEP_PART: f64 = std::f64::consts::FRAC_PI_4;

/// The model with a fabric's parameters and a rule of integration.
#[derive(Debug, Clone)]
pub struct Sadeghi<R> {
    threads: Vec<Thread<R>>,
    gap: R,
    rho_scale: R,
    sigma_u: R,
    reweighting: Reweighting,
}

#[derive(Debug, Clone)]
struct Thread<R> {
    coverage: R,
    albedo: [R; 3],
    optics: Optics<R>,
    tangents: Tangents<R>,
}

#[derive(Debug, Clone)]
enum Tangents<R> {
    /// The same steps for every pair.
    Fixed(Vec<Part<R>>),
    Adaptive(AdaptiveMean),
}

/// Tangents of one direction.
#[derive(Debug, Clone)]
struct Part<R> {
    frame: ThreadFrame<R>,
    /// Of the thread's length.
    share: R,
    tilts: Tilts<R>,
}

#[derive(Debug, Clone)]
enum Tilts<R> {
    /// (cos δ, sin δ) of equally weighted tilts.
    Midpoints(Vec<[R; 2]>),
    Placed {
        nodes: PlacedNodes<R>,
        curve: TangentCurve<R>,
    },
}

impl<R: Real> Sadeghi<R> {
    /// Prepares the evaluation of `fabric`.
    pub fn new(fabric: &Fabric, rule: Rule) -> Self {
        let threads = fabric.visible_threads().map(|thread| Thread {
            coverage: R::of(thread.coverage),
            albedo: thread.albedo.map(R::of),
            optics: thread.optics.cast(),
            tangents: match rule {
                Rule::Midpoint(samples) => Tangents::Fixed(midpoints(thread, samples.max(1))),
                Rule::Quadrature(nodes) => {
                    Tangents::Fixed(placed(thread, &gauss_legendre(nodes as usize)))
                }
                Rule::Adaptive(tolerance) => {
                    let strands = thread.strands(0.0);
                    let mean = AdaptiveMean::new(fabric, thread, &strands, tolerance);
                    Tangents::Adaptive(mean)
                }
            },
        });
        Self {
            threads: threads.collect(),
            gap: R::of(fabric.gap()),
            rho_scale: R::of(fabric.rho_scale),
            sigma_u: R::of(fabric.sigma_u),
            reweighting: fabric.reweighting,
        }
    }

    /// ρ with other `albedos`, linear RGB, one per visible thread in the fabric's order; where they end, the fabric's own go on.
    pub fn eval_cos_with(&self, albedos: &[[R; 3]], wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        self.weave(albedos, wi, wr, |_| {}, Thread::response).rho()
    }

    /// S, V and the projection of every visible thread, Q, and ρ; all zero when either direction is not above the
    /// surface.
    pub fn components(&self, wi: Vec3<R>, wr: Vec3<R>) -> Components<R> {
        let mut threads = Vec::with_capacity(self.threads.len());
        let weave = self.weave(&[], wi, wr, |thread| threads.push(thread), Thread::response);
        Components {
            threads,
            q: weave.q,
            rho: weave.rho(),
        }
    }

    #[inline(always)]
    fn weave<L: Lanes>(
        &self,
        albedos: &[[R; 3]],
        wi: Vec3<L>,
        wr: Vec3<L>,
        mut each_thread: impl FnMut(ThreadResponse<L>),
        response: impl Fn(&Thread<R>, &Self, Vec3<L>, Vec3<L>) -> ThreadResponse<L>,
    ) -> Weave<L> {
        let above = L::both(L::zero().lt(wi[2]), L::zero().lt(wr[2]));
        let mut weave = Weave::new(
            splat(self.gap),
            L::select(above, wr[2], L::zero()),
            splat(self.rho_scale),
        );
        for (index, thread) in self.threads.iter().enumerate() {
            let albedo = albedos.get(index).unwrap_or(&thread.albedo);
            let all = response(thread, self, wi, wr);
            let response = ThreadResponse {
                response: Response {
                    surface: L::select(above, all.response.surface, L::zero()),
                    volume: L::select(above, all.response.volume, L::zero()),
                },
                projection: L::select(above, all.projection, L::zero()),
            };
            weave.add(splat(thread.coverage), each(*albedo, splat), &response);
            each_thread(response);
        }
        weave
    }
}

/// That many midpoints along the curve, sorted by their direction.
fn midpoints<R: Real>(thread: &fabric::Thread, count: u32) -> Vec<Part<R>> {
    let mut sorted: Vec<(f64, Vec<[R; 2]>)> = Vec::new();
    let mut places = BTreeMap::new();
    for [tilt, direction] in thread.midpoints(count) {
        let place = *places.entry(direction.to_bits()).or_insert(sorted.len());
        if place == sorted.len() {
            sorted.push((direction, Vec::new()));
        }
        sorted[place].1.push([R::of(tilt.cos()), R::of(tilt.sin())]);
    }
    let part = |(direction, tilts): (f64, Vec<[R; 2]>)| Part {
        frame: ThreadFrame::new(direction),
        share: R::of(tilts.len() as f64 / f64::from(count)),
        tilts: Tilts::Midpoints(tilts),
    };
    sorted.into_iter().map(part).collect()
}

/// How many parts of a sweep have nodes of their own.
pub fn sweep_parts(sweep: &Sweep) -> usize {
    (sweep.width() / SWEEP_PART).ceil().max(1.0) as usize
}

/// Nodes that are placed for each pair on the straight strands of a thread, and fixed ones on what sweeps.
fn placed<R: Real>(thread: &fabric::Thread, nodes: &[[f64; 2]]) -> Vec<Part<R>> {
    let strands = thread.strands(0.0);
    let mut parts = Vec::new();
    for strand in &strands.straight {
        parts.push(Part {
            frame: ThreadFrame::new(strand.direction),
            share: R::of(strand.share),
            tilts: Tilts::Placed {
                nodes: PlacedNodes::new(&strand.tangents(), &thread.optics, nodes),
                curve: strand.tangents(),
            },
        });
    }
    for sweep in &strands.sweeps {
        for part in sweep.parts(sweep_parts(sweep)) {
            for [node, weight] in nodes {
                let [tilt, direction] = part.at(0.5 + 0.5 * node);
                parts.push(Part {
                    frame: ThreadFrame::new(direction),
                    share: R::of(0.5 * weight * part.share),
                    tilts: Tilts::Midpoints(vec![[R::of(tilt.cos()), R::of(tilt.sin())]]),
                });
            }
        }
    }
    parts
}

impl<R: Real> Thread<R> {
    /// The thread's part for a pair, by any rule.
    fn response(&self, model: &Sadeghi<R>, wi: Vec3<R>, wr: Vec3<R>) -> ThreadResponse<R> {
        match &self.tangents {
            Tangents::Fixed(_) => self.response_in_lanes(model, wi, wr),
            Tangents::Adaptive(mean) => mean
                .at(wi.map(R::to_double), wr.map(R::to_double))
                .map(R::of),
        }
    }

    /// The same by the rules that take the same steps for every pair; nothing by the others.
    #[inline(always)]
    fn response_in_lanes<L: Lanes>(
        &self,
        model: &Sadeghi<R>,
        wi: Vec3<L>,
        wr: Vec3<L>,
    ) -> ThreadResponse<L> {
        let optics = self.optics.cast::<L>();
        let mut sum = ThreadResponse::zero();
        if let Tangents::Fixed(parts) = &self.tangents {
            for part in parts {
                sum = sum.plus(splat(part.share), part.response(model, &optics, wi, wr));
            }
        }
        sum
    }
}

impl<R: Real> Part<R> {
    /// The mean over its tilts.
    #[inline(always)]
    fn response<L: Lanes>(
        &self,
        model: &Sadeghi<R>,
        optics: &Optics<L>,
        wi: Vec3<L>,
        wr: Vec3<L>,
    ) -> ThreadResponse<L> {
        let frame = self.frame.cast::<L>();
        let (wi, wr) = (frame.to_thread(wi), frame.to_thread(wr));
        let pair = ThreadPair::new(wi, wr, splat(model.sigma_u));
        match &self.tilts {
            Tilts::Midpoints(tilts) => {
                let weight = L::of(1.0 / tilts.len() as f64);
                let mut sum = ThreadResponse::zero();
                for [cos, sin] in tilts {
                    let (cos, sin) = (splat::<R, L>(*cos), splat::<R, L>(*sin));
                    sum.response = sum.response.plus(weight, pair.response(optics, cos, sin));
                    sum.projection += weight
                        * match model.reweighting {
                            Reweighting::View => pair.projection(cos, sin),
                            Reweighting::Both => pair.visibility(cos, sin),
                        };
                }
                sum
            }
            Tilts::Placed { nodes, curve } => ThreadResponse {
                response: nodes
                    .mean_response(&pair, optics)
                    .plus(L::one(), curve.response_of_tilts(&pair, optics)),
                projection: match model.reweighting {
                    Reweighting::View => curve.projection(wr),
                    Reweighting::Both => curve.joint_projection(&pair),
                },
            },
        }
    }
}

impl<R: Real> Model<R> for Sadeghi<R> {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        self.eval_cos_with(&[], wi, wr)
    }
}

impl Sadeghi<f32> {
    /// ρ of every pair \[1/sr\], with the widest vector instructions of the machine; see [`Model::eval_cos`].
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_cos_batch(&self, wi: Directions<'_>, wr: Directions<'_>, rho: Colours<'_>) {
        self.eval_cos_batch_at(Level::detect(), wi, wr, rho);
    }

    /// With a chosen instruction set; one that the machine does not have counts as [`Level::Portable`].
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_cos_batch_at(
        &self,
        level: Level,
        wi: Directions<'_>,
        wr: Directions<'_>,
        rho: Colours<'_>,
    ) {
        if self.is_in_lanes() {
            map_pairs(level, &InLanes(self), wi, wr, rho);
        } else {
            let [r, g, b] = rho;
            for pair in 0..wi[0].len() {
                let [wi, wr] = [wi, wr].map(|w| w.map(|slice| slice[pair]));
                [r[pair], g[pair], b[pair]] = self.eval_cos(wi, wr);
            }
        }
    }

    /// ρ of one pair by the approximations and instructions of [`Sadeghi::eval_cos_batch`].
    pub fn eval_cos_fast(&self, wi: Vec3<f32>, wr: Vec3<f32>) -> Vec3<f32> {
        if self.is_in_lanes() {
            at_pair(&InLanes(self), wi, wr)
        } else {
            self.eval_cos(wi, wr)
        }
    }

    /// a S/Q and a V/Q of one thread, and Q, of every pair: what of ρ is the thread's, by a rule that takes the same steps for every pair.
    pub(crate) fn shares_batch(
        &self,
        thread: usize,
        wi: Directions<'_>,
        wr: Directions<'_>,
        shares: Colours<'_>,
    ) {
        let of = Shares {
            model: self,
            thread,
        };
        map_pairs(Level::detect(), &of, wi, wr, shares);
    }

    /// Whether the rule takes the same steps for every pair.
    fn is_in_lanes(&self) -> bool {
        let adaptive = |thread: &Thread<f32>| matches!(thread.tangents, Tangents::Adaptive(_));
        !self.threads.iter().any(adaptive)
    }
}

/// A model by a rule that takes the same steps for every pair.
struct InLanes<'a>(&'a Sadeghi<f32>);

impl PairFunction for InLanes<'_> {
    #[inline(always)]
    fn at<V: Vector, R: Row>(&self, wi: Vec3<V>, wr: Vec3<V>) -> Vec3<V> {
        self.0
            .weave(
                &[],
                wi,
                wr,
                |_| {},
                #[inline(always)]
                |thread, model, wi, wr| thread.response_in_lanes(model, wi, wr),
            )
            .rho()
    }
}

/// What of a model's ρ is a thread's.
struct Shares<'a> {
    model: &'a Sadeghi<f32>,
    thread: usize,
}

impl PairFunction for Shares<'_> {
    #[inline(always)]
    fn at<V: Vector, R: Row>(&self, wi: Vec3<V>, wr: Vec3<V>) -> Vec3<V> {
        let mut seen = 0;
        let mut share = [V::zero(); 2];
        let weave = self.model.weave(
            &[],
            wi,
            wr,
            #[inline(always)]
            |thread| {
                if seen == self.thread {
                    share = [thread.response.surface, thread.response.volume];
                }
                seen += 1;
            },
            #[inline(always)]
            |thread, model, wi, wr| thread.response_in_lanes(model, wi, wr),
        );
        let coverage = splat::<f32, V>(self.model.threads[self.thread].coverage);
        let of = Weave {
            q: weave.q,
            scale: V::one(),
            sum: [coverage * share[0], coverage * share[1], V::zero()],
        };
        let [surface, volume, _] = of.rho();
        [surface, volume, weave.q]
    }
}
