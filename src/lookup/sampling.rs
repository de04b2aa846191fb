//! Directions drawn for a view, and how likely they are.
//!
//! With H = wi + wr in a thread's frame (x along, y sideways, z normal), h = √(H_x² + H_z²), ψ = atan2(H_x, H_z), q = tan(ψ/2), and φ the
//! azimuth of wi about the thread tilted by δ = −ψ, wi ↔ (q, φ) is one-to-one for a view, and
//!
//! ```text
//! dwi = (h + H_z) dq dφ
//! ```
//!
//! The surface's highlight of a tilt δ lies at ψ = −δ for every view: a histogram over q ([`Sampling`](crate::table)) holds still while the view
//! moves, and may be interpolated. φ is drawn in closed form: its sine evenly where wi is above the surface and in front of the
//! thread, or, seldom, the tangent of its half, wherever wi is above the surface. And some directions are drawn by the cosine alone, so that
//! what reflects light is drawn for certain. So
//!
//! ```text
//! pdf = ε z_i/π + (1−ε) Σ_j d_j(q_j)/(h_j + H_z) f(φ_j) / Σ_j E_j
//! f   = (1−e) [z' > 0] z'/(2 c sin m) + e [|y_i| < τ (c + z')] c/(2 τ (c + z'))
//! ```
//!
//! with d the histogram's density, E its integral over the q that the view can see, z' the height of wi above the tilted thread,
//! c = √(y_i² + z'²), and m and τ the ends of φ.

use super::Quantity;
use crate::brdf::ThreadFrame;
use crate::math::simd::{Colours, Directions, Kernel, Level, Row, Vector};
use crate::math::{Lanes, Vec3, each, norm2, splat};
use crate::table::{Energy, Histogram, Mix, SAMPLED, Table, ViewPlace};

/// The share ε of directions that are drawn by the cosine.
const BY_COSINE: f64 = 0.05;
/// The share e of azimuths that are drawn as far as there is surface; so much more for views at the horizon, and up to this height.
const WIDE: f64 = 0.1;
const WIDER: f64 = 0.15;
const LOW: f64 = 0.16;
/// tan(φ/2) where these end.
const WIDEST: f64 = 2.0;
/// Directions that are drawn rise at least so much.
const LEAST: f32 = 1e-7;
/// What is divided by is at least this.
const TINY: f64 = 1e-30;

/// A direction to the light, drawn for a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The direction, above the surface.
    pub wi: [f32; 3],
    /// ρ = BRDF × cosine \[1/sr\], linear RGB. `rho / pdf` is what the light from there counts.
    pub rho: [f32; 3],
    /// The probability density of `wi` \[1/sr\], above 0: what [`View::pdf`] says of it.
    pub pdf: f32,
}

/// A table at one view, prepared for many lights: [`Table::at_view`].
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    table: &'a Table,
    albedos: &'a [[f32; 3]],
    wr: [f32; 3],
    /// Whether wr is a direction above the surface.
    is_above: bool,
    threads: [Option<Thread<'a>>; SAMPLED],
    /// Σ E.
    light: f32,
}

/// A thread at a view.
#[derive(Debug, Clone, Copy)]
struct Thread<'a> {
    frame: ThreadFrame<f32>,
    histogram: &'a Histogram,
    mix: Mix,
    wr: [f32; 3],
    /// The q that can be seen.
    range: [f32; 2],
    /// The light up to its beginning, and in it.
    from: f32,
    light: f32,
}

/// Drawing of directions, for path tracers. All of it is for a viewer and a light that is sought. The model is not reciprocal: to seek a
/// viewer for a light wi, draw from `at_view(albedos, wi)`, take the sample's `wi` as wr and its `pdf`, and evaluate
/// the pair anew: its `rho` is of the swapped pair.
///
/// A table without what is needed ([`Table::has_sampling`]) is sampled by the cosine.
impl Table {
    /// A direction to the light for the view `wr`, by two numbers `u` in \[0, 1), with the fabric's own albedo. `None` where `wr` is
    /// not above the surface, or `u` is out of range.
    pub fn sample_cos(&self, wr: [f32; 3], u: [f32; 2]) -> Option<Sample> {
        self.at_view(&[], wr).sample_cos(u)
    }

    /// The probability density \[1/sr\] of [`Table::sample_cos`] to draw `wi` for `wr`; 0 where either is not above the surface.
    pub fn pdf(&self, wi: [f32; 3], wr: [f32; 3]) -> f32 {
        let (mut sum, mut light) = (0.0, 0.0);
        if !(wi[2] > 0.0 && is_view(wr)) {
            return 0.0;
        }
        for thread in (0..SAMPLED).filter_map(|index| self.thread_at(index, &[], wr)) {
            sum += thread.density(wi);
            light += thread.light;
        }
        finite(mixed(wi[2], sum, light))
    }

    /// The directional albedo ∫ ρ dwi, linear RGB: what the cloth reflects to the view `wr` of white light from everywhere. 0 below the
    /// surface; `None` if the table does not have it.
    pub fn albedo(&self, wr: [f32; 3]) -> Option<[f32; 3]> {
        self.albedo_with(&[], wr)
    }

    /// The table at one view, with `albedos` as [`Table::eval_cos_with`] takes them.
    pub fn at_view<'a>(&'a self, albedos: &'a [[f32; 3]], wr: [f32; 3]) -> View<'a> {
        let is_above = is_view(wr);
        let mut view = View {
            table: self,
            albedos,
            wr,
            is_above,
            threads: [None; SAMPLED],
            light: 0.0,
        };
        if is_above {
            for (index, to) in view.threads.iter_mut().enumerate() {
                *to = self.thread_at(index, albedos, wr);
                view.light += to.as_ref().map_or(0.0, |thread| thread.light);
            }
        }
        view
    }

    #[inline(always)]
    fn thread_at(&self, index: usize, albedos: &[[f32; 3]], wr: [f32; 3]) -> Option<Thread<'_>> {
        let thread = self.threads.get(index)?;
        let histogram = thread.sampling.as_ref()?.histogram.as_deref()?;
        let wr = thread.frame.to_thread(wr);
        let albedo = albedos.get(index).unwrap_or(&thread.albedo);
        let mix = histogram.at(ViewPlace::of(wr), luminance(*albedo));
        let range = seen(wr);
        let (from, light) = histogram.light(&mix, range);
        Some(Thread {
            frame: thread.frame,
            histogram,
            mix,
            wr,
            range,
            from,
            light,
        })
    }

    /// [`Table::pdf`] of every pair, with other albedos.
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn pdf_batch(
        &self,
        albedos: &[[f32; 3]],
        wi: Directions<'_>,
        wr: Directions<'_>,
        pdf: &mut [f32],
    ) {
        self.pdf_batch_at(Level::detect(), albedos, wi, wr, pdf);
    }

    /// The same with a chosen instruction set.
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn pdf_batch_at(
        &self,
        level: Level,
        albedos: &[[f32; 3]],
        wi: Directions<'_>,
        wr: Directions<'_>,
        pdf: &mut [f32],
    ) {
        let inputs = wi.iter().chain(&wr).all(|slice| slice.len() == pdf.len());
        assert!(
            inputs,
            "slices of directions and densities must be of one length"
        );
        level.run(Densities {
            table: self,
            albedos,
            wi,
            wr,
            pdf,
        });
    }

    /// [`Table::sample_cos`] for every view, with other albedos. What has no sample gets zeros.
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn sample_cos_batch(
        &self,
        albedos: &[[f32; 3]],
        wr: Directions<'_>,
        u: [&[f32]; 2],
        mut wi: Colours<'_>,
        rho: Colours<'_>,
        pdf: &mut [f32],
    ) {
        let inputs = wr.iter().chain(&u).all(|slice| slice.len() == pdf.len());
        let outputs = wi.iter().chain(&rho).all(|slice| slice.len() == pdf.len());
        assert!(
            inputs && outputs,
            "slices of directions, numbers and values must be of one length"
        );
        for pair in 0..pdf.len() {
            let view = self.at_view(albedos, wr.map(|w| w[pair]));
            let drawn = view.draw(u.map(|u| u[pair])).unwrap_or([0.0; 3]);
            for (to, x) in wi.iter_mut().zip(drawn) {
                to[pair] = x;
            }
        }
        let wi = wi.each_ref().map(|wi| &**wi);
        self.pdf_batch(albedos, wi, wr, pdf);
        self.eval_batch_at(Level::detect(), albedos, Quantity::Rho, wi, wr, rho);
    }
}

impl View<'_> {
    /// As [`Table::sample_cos`].
    pub fn sample_cos(&self, u: [f32; 2]) -> Option<Sample> {
        let wi = self.draw(u)?;
        let pdf = self.pdf(wi);
        (pdf > 0.0).then(|| Sample {
            wi,
            rho: self.eval_cos(wi),
            pdf,
        })
    }

    /// As [`Table::eval_cos_with`].
    pub fn eval_cos(&self, wi: [f32; 3]) -> [f32; 3] {
        self.table.eval_cos_with(self.albedos, wi, self.wr)
    }

    /// As [`Table::albedo`].
    pub fn albedo(&self) -> Option<[f32; 3]> {
        self.table.albedo_with(self.albedos, self.wr)
    }

    /// As [`Table::pdf`].
    pub fn pdf(&self, wi: [f32; 3]) -> f32 {
        if !(self.is_above && wi[2] > 0.0) {
            return 0.0;
        }
        let mut sum = 0.0;
        for thread in self.threads.iter().flatten() {
            sum += thread.density(wi);
        }
        finite(mixed(wi[2], sum, self.light))
    }

    /// A direction; `None` where there is none.
    fn draw(&self, [u, v]: [f32; 2]) -> Option<[f32; 3]> {
        let is_number = |u: f32| (0.0..1.0).contains(&u);
        if !(self.is_above && is_number(u) && is_number(v)) {
            return None;
        }
        // Without any light all is drawn by the cosine.
        let by_cosine = if self.light > 0.0 {
            BY_COSINE as f32
        } else {
            1.0
        };
        if u < by_cosine {
            return Some(by_the_cosine([u / by_cosine, v]));
        }
        let mut light = self.light * ((u - by_cosine) / (1.0 - by_cosine));
        let mut last = None;
        for thread in self.threads.iter().flatten() {
            if thread.light > 0.0 {
                last = Some((thread, light.min(thread.light)));
                if light < thread.light {
                    break;
                }
                light -= thread.light;
            }
        }
        let (thread, light) = last?;
        let wi = thread.frame.to_surface(thread.draw(light, v));
        let wi = [wi[0], wi[1], wi[2].max(LEAST)];
        wi.iter().all(|x| x.is_finite()).then_some(wi)
    }
}

impl Thread<'_> {
    /// Its part of the light that wi has, per solid angle.
    #[inline(always)]
    fn density(&self, wi: [f32; 3]) -> f32 {
        let (q, per_q) = spread(self.frame.to_thread(wi), self.wr);
        self.histogram.density(&self.mix, q) * per_q
    }

    /// The direction where so much of the light is before it, with its azimuth by `v`.
    fn draw(&self, light: f32, v: f32) -> Vec3<f32> {
        let Self {
            histogram,
            mix,
            wr,
            range: [least, most],
            from,
            ..
        } = self;
        let bins = [histogram.bin(*least), histogram.bin(*most)];
        let q = histogram.place_of(mix, from + light, bins);
        let Tilted {
            cos,
            sin,
            x,
            c,
            sin_m,
            tau,
        } = Tilted::new(q.max(*least).min(*most), *wr);
        let wide = wide_share(wr[2]);
        let [sin_phi, cos_phi] = if v < wide {
            let t = tau * (2.0 * (v / wide) - 1.0);
            let over = 1.0 / (1.0 + t * t);
            [2.0 * t * over, (1.0 - t * t) * over]
        } else {
            let sin = sin_m * (2.0 * ((v - wide) / (1.0 - wide)) - 1.0);
            [sin, ((1.0 - sin) * (1.0 + sin)).max(0.0).sqrt()]
        };
        let (x, z) = (-x, c * cos_phi);
        [x * cos + z * sin, c * sin_phi, z * cos - x * sin]
    }
}

/// The plane of a thread and the normal at an angle of the highlight, and the azimuths of wi there.
struct Tilted<L> {
    /// Of ψ.
    cos: L,
    sin: L,
    /// x of wr in the tilted frame; wi has −x.
    x: L,
    /// √(1 − x²).
    c: L,
    /// The sine of the largest azimuth of what is above the surface and in front of the thread.
    sin_m: L,
    /// tan(φ/2) of the largest azimuth of what is above the surface.
    tau: L,
}

impl<L: Lanes> Tilted<L> {
    #[inline(always)]
    fn new(q: L, wr: Vec3<L>) -> Self {
        let one = L::one();
        let over = one / (one + q * q);
        Self::of((one - q * q) * over, (q + q) * over, wr)
    }

    #[inline(always)]
    fn of(cos: L, sin: L, wr: Vec3<L>) -> Self {
        let (one, tiny) = (L::one(), L::of(TINY));
        let x = wr[0] * cos - wr[2] * sin;
        let c = ((one - x) * (one + x)).max(L::zero()).sqrt();
        let sx = sin * x;
        let most = ((cos - x) * (cos + x)).max(L::zero()).sqrt() / (c * cos).max(tiny);
        let sin_m = L::select(sx.lt(L::zero()), most.min(one).max(L::of(1e-12)), one);
        let [above, below] = [c * cos + sx, c * cos - sx];
        let tau = (above.max(tiny) / below.max(tiny)).sqrt();
        Self {
            cos,
            sin,
            x,
            c,
            sin_m,
            tau: tau.min(L::of(WIDEST)),
        }
    }
}

/// q of a pair in a thread's frame, and the density of wi for a density 1 of q.
#[inline(always)]
fn spread<L: Lanes>(wi: Vec3<L>, wr: Vec3<L>) -> (L, L) {
    let (zero, tiny) = (L::zero(), L::of(TINY));
    let [x, z] = [wi[0] + wr[0], wi[2] + wr[2]];
    let h = norm2(x, z).max(tiny);
    let over = L::one() / h;
    let (sin, cos) = (x * over, z * over);
    let Tilted { sin_m, tau, .. } = Tilted::of(cos, sin, wr);
    let up = wi[0] * sin + wi[2] * cos;
    let c = norm2(wi[1], up);
    let narrow = up.max(zero) / (L::of(2.0) * c * sin_m).max(tiny);
    let ahead = c + up;
    let reach = tau * ahead;
    let wide = L::select(
        wi[1].abs().lt(reach),
        c / (L::of(2.0) * reach).max(tiny),
        zero,
    );
    let e = wide_share(wr[2]);
    let azimuth = (L::one() - e) * narrow + e * wide;
    (x / (h + z), azimuth / (h + z))
}

/// e of a view of this height.
#[inline(always)]
fn wide_share<L: Lanes>(z: L) -> L {
    let low = (L::one() - z * L::of(1.0 / LOW)).max(L::zero());
    L::of(WIDER).mul_add(low, L::of(WIDE))
}

/// The q that wi of all the hemisphere have with a view in a thread's frame.
#[inline(always)]
fn seen<L: Lanes>([x, _, z]: Vec3<L>) -> [L; 2] {
    let end = |x: L| x / (norm2(x, z) + z).max(L::of(TINY));
    [end(x - L::one()), end(x + L::one())]
}

/// The density of a direction with cosine `cos_i`, from Σ d f/(h + H_z) and Σ E.
#[inline(always)]
fn mixed<L: Lanes>(cos_i: L, sum: L, light: L) -> L {
    let by_cosine = cos_i * L::of(core::f64::consts::FRAC_1_PI);
    let share = L::of(BY_COSINE);
    let by_light = sum / light.max(L::of(TINY));
    L::select(
        L::zero().lt(light),
        share * by_cosine + (L::one() - share) * by_light,
        by_cosine,
    )
}

/// What is a number; others are 0.
#[inline(always)]
fn finite(x: f32) -> f32 {
    if x.is_finite() { x } else { 0.0 }
}

/// A direction with a density in proportion to its cosine.
fn by_the_cosine([u, v]: [f32; 2]) -> [f32; 3] {
    let radius = Lanes::sqrt(u);
    let (sin, cos) = num_traits::Float::sin_cos(core::f32::consts::TAU * v);
    let z = Lanes::sqrt((1.0 - u).max(0.0));
    [radius * cos, radius * sin, z.max(LEAST)]
}

/// Whether it is a direction above the surface.
#[inline(always)]
fn is_view(wr: [f32; 3]) -> bool {
    wr[2] > 0.0 && wr.iter().all(|x| x.is_finite())
}

/// By what a colour counts when threads are weighed.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

impl Table {
    /// The albedo at a view, with other albedos of threads.
    fn albedo_with(&self, albedos: &[[f32; 3]], wr: [f32; 3]) -> Option<[f32; 3]> {
        let albedo = self.undimmed(albedos, wr)?;
        let dimming = match self.energy() {
            Energy::AsIs => 1.0,
            Energy::PerView => dimming_of(albedo),
        };
        Some(albedo.map(|albedo| dimming * albedo))
    }

    /// What ρ is multiplied by for a view that more would be reflected to than arrives.
    #[inline(always)]
    pub(super) fn dimming(&self, albedos: &[[f32; 3]], wr: [f32; 3]) -> f32 {
        self.undimmed(albedos, wr).map_or(1.0, dimming_of)
    }

    #[inline(always)]
    fn undimmed(&self, albedos: &[[f32; 3]], wr: [f32; 3]) -> Option<[f32; 3]> {
        let mut sum = [0.0; 3];
        for (index, thread) in self.threads.iter().enumerate() {
            let shares = &thread.sampling.as_ref()?.albedo;
            let [s, v] = shares.at(ViewPlace::of(thread.frame.to_thread(wr)));
            let albedo = albedos.get(index).unwrap_or(&thread.albedo);
            for (sum, albedo) in sum.iter_mut().zip(albedo) {
                *sum += s + v * albedo;
            }
        }
        let scale = if is_view(wr) { self.rho_scale } else { 0.0 };
        Some(sum.map(|sum| finite(scale * sum)))
    }
}

#[inline(always)]
fn dimming_of([r, g, b]: [f32; 3]) -> f32 {
    1.0 / Lanes::max(Lanes::max(r, g), b).max(1.0)
}

/// The densities of many pairs.
struct Densities<'a> {
    table: &'a Table,
    albedos: &'a [[f32; 3]],
    wi: Directions<'a>,
    wr: Directions<'a>,
    pdf: &'a mut [f32],
}

impl Kernel for Densities<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) {
        let Self {
            table,
            albedos,
            wi,
            wr,
            pdf,
        } = self;
        let pairs = pdf.len();
        let mut from = 0;
        while from < pairs {
            let count = V::LANES.min(pairs - from);
            let (wi, wr) = (load::<V>(wi, from, count), load::<V>(wr, from, count));
            let (mut sum, mut light) = (V::zero(), V::zero());
            for (index, thread) in table.threads.iter().enumerate().take(SAMPLED) {
                let sampling = thread.sampling.as_ref();
                let Some(histogram) = sampling.and_then(|s| s.histogram.as_deref()) else {
                    continue;
                };
                let albedo = luminance(*albedos.get(index).unwrap_or(&thread.albedo));
                let frame = thread.frame.cast::<V>();
                let (wi, wr) = (frame.to_thread(wi), frame.to_thread(wr));
                let (q, per_q) = spread(wi, wr);
                let ViewPlace {
                    q: view_q,
                    l: view_l,
                } = ViewPlace::of(wr);
                let (view_q, view_l) = (view_q.to_array(), view_l.to_array());
                let [low, high] = seen(wr);
                let (q, ends) = (q.to_array(), [low.to_array(), high.to_array()]);
                let (mut densities, mut lights) = (V::Array::default(), V::Array::default());
                for lane in 0..count {
                    let at = |lanes: &V::Array| lanes.as_ref()[lane];
                    let place = ViewPlace {
                        q: at(&view_q),
                        l: at(&view_l),
                    };
                    let mix = histogram.at(place, albedo);
                    let (_, light) = histogram.light(&mix, [at(&ends[0]), at(&ends[1])]);
                    lights.as_mut()[lane] = light;
                    densities.as_mut()[lane] = histogram.density(&mix, at(&q));
                }
                sum += V::from_array(densities) * per_q;
                light += V::from_array(lights);
            }
            let above = V::both(V::zero().lt(wi[2]), V::zero().lt(wr[2]));
            let density = V::select(above, mixed(wi[2], sum, light), V::zero());
            for (to, x) in pdf[from..]
                .iter_mut()
                .zip(&density.to_array().as_ref()[..count])
            {
                *to = finite(*x);
            }
            from += V::LANES;
        }
    }
}

/// Some directions; lanes behind them are like the last.
#[inline(always)]
fn load<V: Vector>(from: Directions<'_>, at: usize, count: usize) -> Vec3<V> {
    each(
        from,
        #[inline(always)]
        |from| {
            let from = &from[at..at + count];
            let mut lanes = splat::<f32, V>(from[count - 1]).to_array();
            lanes.as_mut()[..count].copy_from_slice(from);
            V::from_array(lanes)
        },
    )
}
