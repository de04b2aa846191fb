//! Where the nodes go.
use rayon::prelude::*;
use super::{Settings, integrate::Integrand};
use crate::chart::Chart;
use crate::fabric::Fabric;
use crate::metrics::protocol_pairs;
use crate::table::{Axis, Interpolation};

const LINES: usize = 64;

struct Line {
    /// [point][channel] encoded
    values: Vec<[f64; 2]>,
    /// d(rel error)/d(value)
    weights: Vec<[f64; 2]>,
}

/// plan
pub fn plan(fabric: &Fabric, integrand: &Integrand<'_>, settings: &Settings) -> [Axis; 4] {
    let thread = integrand.thread;
    let frame = thread.frame::<f64>();
    let pairs = protocol_pairs(fabric, 4 * LINES, 1);
    let albedo = thread.albedo.iter().copied().fold(0.0, f64::max);
    // mean
    let points: Vec<([f64;4], f64)> = pairs.par_iter().map(|p| {
        let (mut wi, mut wr) = (frame.to_thread(p.wi), frame.to_thread(p.wr));
        if integrand.folded && wi[0] + wr[0] < 0.0 { wi[0] = -wi[0]; wr[0] = -wr[0]; }
        let s = integrand.at(wi, wr).response;
        (settings.chart.coordinates(wi, wr), s.surface + albedo * s.volume)
    }).collect();
    let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64;
    let ladders: Vec<Ladder> = (0..4).map(|k| {
        let low = if k == 0 && integrand.folded { 0.5 } else { 0.0 };
        let kink = Chart::KINKS[k].filter(|x| f64::from(*x) > low);
        let sharp = if k == 0 { ((1.0 - low) * std::f64::consts::PI / (thread.optics.gamma_s / 3.0)).ceil() as usize } else { 0 };
        let intervals = sharp.clamp(192, 4096).div_ceil(12) * 12;
        let at = |i: usize| low + (1.0 - low) * i as f64 / intervals as f64;
        let lines: Vec<Line> = points.par_iter().skip(k * LINES).take(LINES).map(|(u, _)| {
            let mut line = Line { values: vec![], weights: vec![] };
            for i in 0..=intervals {
                let mut u = *u; u[k] = at(i);
                let s = integrand.at_point(u);
                let r = s.ratio();
                let total = s.response.surface + albedo * s.response.volume + 0.01 * mean;
                let enc = r.map(|r| if r.is_finite() { settings.encoding.encode(r) } else { f64::NAN });
                let slope = |e: f64| match settings.encoding { crate::table::Encoding::SqrtF16 => 2.0 * e, _ => 1.0 };
                line.weights.push([s.factor.surface * slope(enc[0]) / total, albedo * s.factor.volume * slope(enc[1]) / total].map(|w| if w.is_finite() { w } else { 0.0 }));
                line.values.push(enc.map(|e| if e.is_finite() { e } else { 0.0 }));
            }
            line
        }).collect();
        Ladder::new(&lines, intervals, low, kink, settings.interpolation[k])
    }).collect();
    let mut n: Vec<usize> = vec![0; 4];
    loop {
        let total: f64 = (0..4).map(|k| ladders[k].errors[n[k]]).sum();
        if total < settings.target_error { break; }
        let mut best = None;
        let size: f64 = (0..4).map(|k| ladders[k].count(n[k]) as f64).product();
        for k in 0..4 {
            // look ahead for the best slope
            for step in 1..=4 {
                if n[k] + step >= ladders[k].errors.len() { break; }
                let growth = ladders[k].count(n[k] + step) as f64 / ladders[k].count(n[k]) as f64;
                if size * growth > settings.max_nodes as f64 { continue; }
                let gain = (ladders[k].errors[n[k]] - ladders[k].errors[n[k] + step]) / growth.ln();
                if best.is_none_or(|(g, _, _)| gain > g) { best = Some((gain, k, step)); }
            }
        }
        match best { Some((g, k, s)) if g > 0.0 => n[k] += s, _ => break }
    }
    if std::env::var("TRACE").is_ok() {
        for k in 0..4 { eprintln!("{} axis {k}: {} nodes err {:.5}", thread.name, ladders[k].count(n[k]), ladders[k].errors[n[k]]); }
    }
    [0, 1, 2, 3].map(|k| ladders[k].axis(n[k]))
}

/// greedy node insertion
struct Ladder { start: Vec<usize>, inserted: Vec<usize>, errors: Vec<f64>, low: f64, intervals: usize, kink: Option<f32>, interpolation: Interpolation }

impl Ladder {
    fn count(&self, n: usize) -> usize { self.start.len() + n }
    fn axis(&self, n: usize) -> Axis {
        let mut idx = self.start.clone(); idx.extend(&self.inserted[..n]); idx.sort_unstable();
        make_axis(&idx, self.low, self.intervals, self.kink, self.interpolation)
    }
    fn new(lines: &[Line], intervals: usize, low: f64, kink: Option<f32>, interpolation: Interpolation) -> Self {
        let sides = if kink.is_some() { 2 } else { 1 };
        let per = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let start: Vec<usize> = (0..=sides * per).map(|i| i * intervals / (sides * per)).collect();
        let mut nodes = start.clone();
        let (mut inserted, mut errors) = (vec![], vec![]);
        let f = |i: usize| (low + (1.0 - low) * i as f64 / intervals as f64) as f32;
        loop {
            let axis = make_axis(&nodes, low, intervals, kink, interpolation);
            // errors per cell
            let cells: Vec<f64> = nodes.par_windows(2).enumerate().map(|(_, w)| {
                let mut e = 0.0;
                for i in w[0] + 1..w[1] {
                    let st = axis.stencil(f(i));
                    for line in lines {
                        for c in 0..2 {
                            let mut v = 0.0;
                            for j in 0..axis.taps() { v += f64::from(st.weights[j]) * line.values[nodes[st.first + j]][c]; }
                            e += line.weights[i][c] * (v - line.values[i][c]).abs();
                        }
                    }
                }
                e
            }).collect();
            errors.push(cells.iter().sum::<f64>() / (lines.len() * intervals) as f64);
            if nodes.len() >= 129 { break; }
            let Some((cell, _)) = cells.iter().enumerate().filter(|(c, _)| nodes[c + 1] - nodes[*c] > 1).max_by(|a, b| a.1.total_cmp(b.1)) else { break };
            let mid = (nodes[cell] + nodes[cell + 1]) / 2;
            nodes.insert(cell + 1, mid);
            inserted.push(mid);
        }
        Self { start, inserted, errors, low, intervals, kink, interpolation }
    }
}
fn make_axis(idx: &[usize], low: f64, intervals: usize, kink: Option<f32>, interpolation: Interpolation) -> Axis {
    Axis::new(idx.iter().map(|i| (low + (1.0 - low) * *i as f64 / intervals as f64) as f32).collect(), interpolation, kink).expect("nodes ascend")
}
