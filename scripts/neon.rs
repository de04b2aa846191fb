//! ρ of tables by every instruction set of the machine, to be compared with that of another machine:
//!
//!     neon write TABLES…            prints it
//!     neon compare FILE TABLES…     says how far it is from what another machine has printed; fails beyond the bounds

use std::collections::BTreeMap;
use std::fmt::Write as _;

use sateen::lookup::Quantity;
use sateen::math::simd::Level;
use sateen::table::Table;

const PAIRS: usize = 2000;

/// Of a difference relative to the value and a thousandth of the mean: at most, and on average (`tests/table/parity.rs`).
const BOUNDS: [f64; 2] = [1e-4, 5e-7];

/// The same directions everywhere, by operations that are correctly rounded: even over the hemisphere.
struct Directions(u64);

impl Directions {
    fn number(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / 8_388_608.0 - 1.0
    }

    fn next(&mut self) -> [f32; 3] {
        loop {
            let [x, y, z] = [self.number(), self.number(), self.number()];
            let length = (x * x + y * y + z * z).sqrt();
            if length > 0.1 && length <= 1.0 && z != 0.0 {
                return [x / length, y / length, z.abs() / length];
            }
        }
    }
}

/// ρ by each way to look a table up, red, green and blue of each pair.
fn values(table: &Table) -> BTreeMap<&'static str, Vec<f32>> {
    let mut directions = Directions(0x9E37_79B9_7F4A_7C15);
    let pairs: Vec<[[f32; 3]; 2]> = (0..PAIRS)
        .map(|_| [directions.next(), directions.next()])
        .collect();
    let slices = |which: usize| -> [Vec<f32>; 3] {
        [0, 1, 2].map(|k| pairs.iter().map(|pair| pair[which][k]).collect())
    };
    let (wi, wr) = (slices(0), slices(1));
    let mut all = BTreeMap::new();
    for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
        let mut rho = [0, 1, 2].map(|_| vec![f32::NAN; PAIRS]);
        table.eval_batch_at(
            level,
            &[],
            Quantity::Rho,
            wi.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            rho.each_mut().map(Vec::as_mut_slice),
        );
        let of_pair = |k: usize| rho.each_ref().map(|channel| channel[k]);
        all.insert(level.name(), (0..PAIRS).flat_map(of_pair).collect());
    }
    let single = pairs.iter().flat_map(|[wi, wr]| table.eval_cos(*wi, *wr));
    all.insert("single", single.collect());
    all
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (other, tables) = match arguments.first().map(String::as_str) {
        Some("write") => (None, &arguments[1..]),
        Some("compare") => {
            let text = std::fs::read_to_string(&arguments[1]).expect("what a machine has printed");
            (Some(text), &arguments[2..])
        }
        _ => panic!("neon write TABLES… or neon compare FILE TABLES…"),
    };
    let mut is_within = true;
    for path in tables {
        let table = Table::from_bytes(&std::fs::read(path).expect("a table")).expect("a table");
        for (name, values) in values(&table) {
            let Some(other) = &other else {
                let mut line = format!("{path} {name}");
                for value in &values {
                    write!(line, " {value:e}").expect("memory");
                }
                println!("{line}");
                continue;
            };
            for line in other.lines() {
                let mut words = line.split(' ');
                if words.next() != Some(path) {
                    continue;
                }
                let other_name = words.next().expect("a level");
                let expected: Vec<f32> = words.map(|x| x.parse().expect("a number")).collect();
                is_within &= compare(path, [name, other_name], &values, &expected);
            }
        }
    }
    if !is_within {
        std::process::exit(1);
    }
}

/// Whether values are as near as they should be, and says how near.
fn compare(path: &str, [name, other]: [&str; 2], values: &[f32], expected: &[f32]) -> bool {
    assert_eq!(values.len(), expected.len());
    let count = values.len() as f64;
    let mean = expected.iter().map(|x| f64::from(*x)).sum::<f64>() / count;
    let (mut most, mut sum, mut bits) = (0.0f64, 0.0, 0);
    for (value, expected) in values.iter().zip(expected) {
        bits += usize::from(value.to_bits() != expected.to_bits());
        let (value, expected) = (f64::from(*value), f64::from(*expected));
        let difference = (value - expected).abs() / (expected + 1e-3 * mean);
        most = most.max(difference);
        sum += difference;
    }
    let file = path.rsplit('/').next().unwrap_or(path);
    println!(
        "{file}: {name} here, {other} there: {bits} of {} numbers differ, by {most:.1e} at most, {:.1e} on average",
        values.len(),
        sum / count
    );
    // What `src/math/simd/mod.rs` says to be equal.
    let is_exact = match name {
        "portable" => other == "portable",
        "neon" => other == "avx2",
        _ => false,
    };
    most <= BOUNDS[0] && sum / count <= BOUNDS[1] && !(is_exact && bits > 0)
}
