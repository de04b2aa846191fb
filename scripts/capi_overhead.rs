//! The Rust side of capi_overhead.sh: TABLE PAIRS REPEATS, as examples/c/overhead.c.

use std::time::Instant;

fn fill(pairs: usize, mut state: u32) -> [Vec<f32>; 3] {
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    };
    // As large from the start as C's: what malloc hands out lies alike then, and so do the caches' conflicts.
    let mut w = [0, 1, 2].map(|_| Vec::with_capacity(pairs));
    for _ in 0..pairs {
        let z = 0.05 + 0.95 * next();
        let (r, phi) = ((1.0 - z * z).sqrt(), std::f32::consts::TAU * next());
        w[0].push(r * phi.cos());
        w[1].push(r * phi.sin());
        w[2].push(z);
    }
    w
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let table = sateen::table::Table::from_bytes(&std::fs::read(&arguments[1]).unwrap()).unwrap();
    let [pairs, repeats]: [usize; 2] = [2, 3].map(|k| arguments[k].parse().unwrap());
    let (wi, wr) = (fill(pairs, 1), fill(pairs, 2));
    let mut rho = [0, 1, 2].map(|_| vec![0.0; pairs]);
    let mut least = f64::INFINITY;
    for _ in 0..repeats {
        let start = Instant::now();
        table.eval_cos_batch(
            wi.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            rho.each_mut().map(Vec::as_mut_slice),
        );
        least = least.min(start.elapsed().as_nanos() as f64 / pairs as f64);
    }
    println!("{least:.3} {}", rho[0][pairs / 2]);
}
