//! What `FORMAT.md` says of grids, computed from a file's numbers in the plainest way: lookups agree with it, and files that
//! are otherwise are refused.

use crate::common::hostile::{
    Axis, Chunk, box_of_runs, empty, file, grid_with, stored, thread, tile_bytes,
};
use crate::common::levels;
use sateen::lookup::Quantity;
use sateen::table::{Error, Table};

/// What a grid leaves out: S alone, V alone, S + A V; and that it has not all coefficients.
const CONTENTS: [u8; 4] = [0, 1 << 1, 2 << 1, 3 << 1];
const PARTIAL: u8 = 1;

/// Numbers that look random, the same ones every time.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn share(&mut self) -> f64 {
        self.bits() as f64 / (1u64 << 31) as f64
    }

    fn direction(&mut self) -> [f32; 3] {
        let (z, turn) = (0.02 + 0.98 * self.share(), self.share());
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [(r * cos) as f32, (r * sin) as f32, z as f32]
    }

    fn pairs(&mut self, count: usize) -> Vec<[[f32; 3]; 2]> {
        (0..count)
            .map(|_| [self.direction(), self.direction()])
            .collect()
    }
}

/// A grid as a file has it: all coefficients.
#[derive(Clone)]
struct Numbers {
    axes: [Axis; 4],
    leaves_out: u8,
    scale: [f32; 2],
    tiles: Vec<i16>,
}

impl Numbers {
    fn random(axes: [Axis; 4], leaves_out: u8) -> Self {
        let mut random = Random(1);
        let mut numbers = Self {
            axes,
            leaves_out,
            scale: [0.5, 0.25],
            tiles: Vec::new(),
        };
        let bytes = tile_bytes(
            numbers.channels() as u64,
            numbers.axes.each_ref().map(|axis| axis.len() as u64),
        );
        numbers.tiles = (0..bytes / 2)
            .map(|_| (random.bits() % 32_768) as i16)
            .collect();
        numbers
    }

    fn channels(&self) -> usize {
        if self.leaves_out >> 1 == 0 { 2 } else { 1 }
    }

    fn index(&self, [u0, u1, u2, u3]: [usize; 4], channel: usize) -> usize {
        let [n0, n1, n2, _] = self.axes.each_ref().map(Axis::len);
        let tile = (u3 * n2 + u2) * n1.div_ceil(2) + u1 / 2;
        2 * ((tile * n0 + u0) * self.channels() + channel) + u1 % 2
    }

    fn file(&self) -> Vec<u8> {
        self.file_of(&self.tiles, None)
    }

    fn file_of(&self, numbers: &[i16], runs: Option<&[[u16; 2]]>) -> Vec<u8> {
        let leaves_out = self.leaves_out | if runs.is_some() { PARTIAL } else { 0 };
        let grid = grid_with([1, 0], leaves_out, self.scale, &self.axes);
        let mut chunks = vec![empty(), chunk(numbers)];
        if let Some(runs) = runs {
            let runs = runs.as_flattened().iter();
            chunks.push(stored(runs.flat_map(|x| x.to_le_bytes()).collect()));
        }
        file(&[thread(1.0, &[], &[[-0.2, 0.3, 1.0]], &grid)], &chunks)
    }

    /// Those of the runs.
    fn part(&self, runs: &[[u16; 2]]) -> Vec<i16> {
        let run_numbers = 2 * self.channels();
        let tile_numbers = run_numbers * self.axes[0].len();
        let tiles = self.tiles.chunks_exact(tile_numbers).zip(runs);
        tiles
            .flat_map(|(tile, [first, count])| {
                let [first, count] = [*first, *count].map(usize::from);
                &tile[run_numbers * first..run_numbers * (first + count)]
            })
            .copied()
            .collect()
    }

    /// S and V at a point of the box.
    fn value(&self, u: [f64; 4]) -> [f64; 2] {
        let places = [0, 1, 2, 3].map(|axis| weights(&self.axes[axis], u[axis]));
        let mut sums = [0.0; 2];
        for (u3, w3) in &places[3] {
            for (u2, w2) in &places[2] {
                for (u1, w1) in &places[1] {
                    for (u0, w0) in &places[0] {
                        for (channel, sum) in sums.iter_mut().take(self.channels()).enumerate() {
                            let number = self.tiles[self.index([*u0, *u1, *u2, *u3], channel)];
                            *sum += w0 * w1 * w2 * w3 * f64::from(number) / 32_767.0;
                        }
                    }
                }
            }
        }
        let [s, v] = [0, 1].map(|channel| {
            let root = f64::from(self.scale[channel]) * sums[channel].max(0.0);
            root * root
        });
        match self.leaves_out >> 1 {
            0 => [s, v],
            2 => [0.0, s],
            _ => [s, 0.0],
        }
    }
}

fn chunk(numbers: &[i16]) -> Chunk {
    stored(numbers.iter().flat_map(|x| x.to_le_bytes()).collect())
}

/// Which coefficients make up a value at a coordinate, and their weights.
fn weights(axis: &Axis, u: f64) -> Vec<(usize, f64)> {
    if axis.knots.len() == 1 {
        return vec![(0, 1.0)];
    }
    let knots: Vec<f64> = axis
        .knots
        .iter()
        .map(|knot| f64::from(*knot) / f64::from(1u32 << axis.depth))
        .collect();
    let last = knots.len() - 2;
    let cell = (0..last).find(|k| u < knots[k + 1]).unwrap_or(last);
    let h = knots[cell + 1] - knots[cell];
    let ends_at = |k: usize| k == 0 || k == last + 1 || (axis.bends && knots[k] == 0.5);
    let before = if ends_at(cell) {
        0.0
    } else {
        knots[cell] - knots[cell - 1]
    };
    let after = if ends_at(cell + 1) {
        0.0
    } else {
        knots[cell + 2] - knots[cell + 1]
    };
    let t = (u - knots[cell]) / h;
    let falling = h / (before + h) * (1.0 - t) * (1.0 - t);
    let rising = h / (h + after) * t * t;
    let first = axis.firsts()[cell];
    vec![
        (first, falling),
        (first + 1, 1.0 - falling - rising),
        (first + 2, rising),
    ]
}

/// Uneven knots with a kink, and without.
fn uneven(bends: bool) -> Axis {
    Axis {
        depth: 6,
        knots: vec![0, 16, 24, 28, 30, 32, 48, 64],
        bends,
    }
}

fn sparse(knots: u16) -> Axis {
    Axis::halved(knots)
}

fn collapsed() -> Axis {
    Axis {
        depth: 1,
        knots: vec![1],
        bends: false,
    }
}

fn assert_is_the_splines(name: &str, numbers: &Numbers) {
    let table = Table::from_bytes(&numbers.file()).unwrap();
    let thread = &table.threads()[0];
    let (frame, coordinates) = (thread.frame(), thread.grid().unwrap().coordinates());
    // Of values up to a quarter: weights along u₁ have 15 bits, and coordinates are computed in single precision.
    let most = 1e-4;
    for [wi, wr] in Random(2).pairs(500) {
        let [a, b] = [wi, wr].map(|w| frame.to_thread(w.map(f64::from)));
        let expected = numbers.value(coordinates.of(a, b));
        let response = table.components(wi, wr).threads[0].response;
        for (value, expected) in [response.surface, response.volume].iter().zip(expected) {
            assert!(
                (f64::from(*value) - expected).abs() <= most,
                "{name}: {wi:?} {wr:?}: {value} for {expected}"
            );
        }
    }
}

#[test]
fn lookups_are_the_splines_that_the_format_describes() {
    for contents in CONTENTS {
        let axes = [uneven(true), uneven(false), uneven(true), sparse(4)];
        assert_is_the_splines(&format!("{contents}"), &Numbers::random(axes, contents));
    }
}

#[test]
fn odd_numbers_of_rows_end_in_half_a_tile_that_does_not_count() {
    for rows in 2..10 {
        for contents in CONTENTS {
            let axes = [uneven(true), sparse(rows), sparse(3), sparse(2)];
            let numbers = Numbers::random(axes, contents);
            let name = format!("{rows} knots, {contents}");
            assert_is_the_splines(&name, &numbers);
            let n1 = numbers.axes[1].len();
            if n1.is_multiple_of(2) {
                continue;
            }
            let mut others = numbers.clone();
            let [n0, _, n2, n3] = numbers.axes.each_ref().map(Axis::len);
            for place in 0..n0 * n2 * n3 {
                let place = [place % n0, n1, place / n0 % n2, place / n0 / n2];
                for channel in 0..numbers.channels() {
                    let index = numbers.index(place, channel);
                    others.tiles[index] = if index.is_multiple_of(3) {
                        i16::MIN
                    } else {
                        i16::MAX
                    };
                }
            }
            assert_same_bits(&name, &numbers.file(), &others.file());
        }
    }
    // A single row.
    let numbers = Numbers::random([uneven(true), collapsed(), sparse(3), sparse(2)], 0);
    let mut others = numbers.clone();
    for number in others.tiles.iter_mut().skip(1).step_by(2) {
        *number = i16::MIN;
    }
    assert_same_bits("one row", &numbers.file(), &others.file());
}

fn assert_same_bits(name: &str, a: &[u8], b: &[u8]) {
    let [a, b] = [a, b].map(|bytes| Table::from_bytes(bytes).unwrap());
    for [wi, wr] in Random(3).pairs(200) {
        let [a, b] = [&a, &b].map(|table| table.eval_cos(wi, wr).map(f32::to_bits));
        assert_eq!(a, b, "{name}: {wi:?} {wr:?}");
    }
}

#[test]
fn part_of_a_grid_is_a_run_of_each_tile() {
    for contents in CONTENTS {
        let axes = [uneven(true), sparse(6), uneven(true), sparse(4)];
        let numbers = Numbers::random(axes, contents);
        let full = Table::from_bytes(&numbers.file()).unwrap();
        let runs = box_of_runs(&numbers.axes, [[1, 4], [1, 4], [2, 5], [0, 1]]);
        let part = numbers.part(&runs);
        let table = Table::from_bytes(&numbers.file_of(&part, Some(&runs))).unwrap();
        assert!(table.is_partial() && part.len() < numbers.tiles.len());
        assert_eq!(
            table.to_mappable_bytes(),
            numbers.file_of(&part, Some(&runs))
        );
        let pairs = Random(4).pairs(4000);
        let mut baked = 0;
        for [wi, wr] in pairs.iter().copied() {
            let rho = table.eval_cos(wi, wr);
            assert!(rho.iter().all(|rho| rho.is_finite() && *rho >= 0.0));
            if table.is_baked(wi, wr) {
                baked += 1;
                let bits = |rho: [f32; 3]| rho.map(f32::to_bits);
                assert_eq!(bits(rho), bits(full.eval_cos(wi, wr)), "{wi:?} {wr:?}");
            }
        }
        assert!((100..3500).contains(&baked), "{baked}");
        assert_eq!(table.misses(), pairs.len() - baked);
        for level in levels() {
            table.reset_misses();
            let [of_part, of_full] = [&table, &full].map(|table| batch(table, level, &pairs));
            for (index, [wi, wr]) in pairs.iter().enumerate() {
                if table.is_baked(*wi, *wr) {
                    let [part, full] = [&of_part[index], &of_full[index]];
                    assert_eq!(part, full, "{level:?} {wi:?} {wr:?}");
                }
            }
            assert_eq!(table.misses(), pairs.len() - baked, "{level:?}");
        }
    }
}

#[test]
fn runs_that_do_not_fit_are_refused() {
    // Six rows along u₁ are three tiles; the last two have the coefficients of two cells of u₀.
    let axes = [sparse(5), sparse(5), collapsed(), collapsed()];
    let numbers = Numbers::random(axes, 0);
    let right = [[0, 0], [1, 4], [1, 4]];
    let refused = |runs: &[[u16; 2]]| {
        let count: usize = runs.iter().map(|[_, count]| usize::from(*count)).sum();
        let tiles = vec![1; 2 * numbers.channels() * count];
        Table::from_bytes(&numbers.file_of(&tiles, Some(runs))).err()
    };
    assert_eq!(refused(&right), None);
    let what_of = |error: Option<Error>| match error {
        Some(Error::Invalid { what, .. }) => what,
        other => panic!("{other:?}"),
    };
    let with = |tile: usize, run: [u16; 2]| {
        let mut runs = right;
        runs[tile] = run;
        what_of(refused(&runs))
    };
    let unfit = "runs of coefficients";
    assert_eq!(with(1, [0, 5]), unfit, "no cell needs the first");
    assert_eq!(with(1, [1, 2]), unfit, "no cell has all of its");
    assert_eq!(with(1, [1, 6]), unfit, "there are not as many");
    assert_eq!(with(1, [65_535, 65_535]), unfit, "there are not as many");
    assert_eq!(with(0, [1, 2]), unfit, "no cell has the first tile");
    assert_eq!(what_of(refused(&[[0, 0]; 3])), unfit, "there are none");
    // One for each tile, not for each row.
    let rows = [[0, 0], [0, 0], [1, 4], [1, 4], [1, 4], [1, 4]];
    assert_eq!(what_of(refused(&rows)), "size of runs");
    assert_eq!(what_of(refused(&right[..2])), "size of runs");
}

#[test]
fn knots_that_are_no_halves_of_halves_are_refused() {
    let read = |which: usize, axis: Axis| {
        let mut axes = [2, 3, 4, 5].map(sparse);
        axes[which] = axis;
        let numbers = Numbers::random(axes, 0);
        Table::from_bytes(&numbers.file()).map(|_| ())
    };
    const ONE: u16 = 1 << 14;
    const HALF: u16 = ONE / 2;
    // As uneven as may be: half, then a 128th of that; and up again.
    let steep = |narrowest: u16| {
        let mut knots = vec![0, HALF, HALF + narrowest];
        while knots[knots.len() - 1] < ONE {
            knots.push(HALF + 2 * (knots[knots.len() - 1] - HALF));
        }
        knots
    };
    for which in 0..4 {
        let invalid = |axis: Axis| match read(which, axis.clone()) {
            Err(Error::Invalid { what, .. }) => what,
            other => panic!("{axis:?}: {other:?}"),
        };
        for right in [
            vec![0, ONE],
            vec![HALF, ONE],
            vec![HALF, HALF + 4096, ONE],
            vec![0, 4096, 8192, ONE],
            steep(HALF / 128),
        ] {
            assert_eq!(read(which, Axis::of(right.clone())), Ok(()), "{right:?}");
        }
        for (knots, what) in [
            (vec![0, 3, ONE], "widths that are no powers of two"),
            (vec![0, 6144, ONE], "widths that are no powers of two"),
            (
                vec![0, 4096, 12_288, ONE],
                "a cell at no multiple of its width",
            ),
            (steep(HALF / 256), "too uneven"),
            (vec![0, HALF], "1 is not reached"),
            (vec![0, 4096, HALF], "1 is not reached"),
            (vec![0, HALF, ONE, 2 * ONE], "beyond 1"),
            (vec![4096, HALF, ONE], "neither from 0 nor from ½"),
            (vec![ONE - 1, ONE], "neither from 0 nor from ½"),
            (vec![0, HALF, HALF, ONE], "not ascending"),
            (vec![0, ONE, HALF], "not ascending"),
            (vec![1], "one knot that is no place to collapse to"),
        ] {
            assert_eq!(invalid(Axis::of(knots)), "knots of an axis", "{what}");
        }
        assert_eq!(
            invalid(Axis {
                depth: 15,
                ..Axis::of(vec![0, ONE])
            }),
            "knots of an axis"
        );
        // Across a kink nothing is shared, so that cells may be as uneven as they like; but there has to be one.
        let bends = |knots: Vec<u16>| Axis {
            bends: true,
            ..Axis::of(knots)
        };
        assert_eq!(read(which, bends(steep(HALF / 256))), Ok(()));
        for knots in [vec![0, ONE], vec![HALF, ONE], vec![0, 4096, 8192 + 8192]] {
            let what = invalid(bends(knots));
            assert!(
                ["kink of an axis", "knots of an axis"].contains(&what),
                "{what}"
            );
        }
    }
    // All axes but the first may collapse, to their lower end or their middle.
    for (depth, knot) in [(0, 0), (1, 1)] {
        let axis = Axis {
            depth,
            knots: vec![knot],
            bends: false,
        };
        for which in 0..4 {
            assert_eq!(read(which, axis.clone()).is_ok(), which > 0, "{which}");
        }
    }
}

/// Bits of ρ.
fn batch(
    table: &Table,
    level: sateen::math::simd::Level,
    pairs: &[[[f32; 3]; 2]],
) -> Vec<[u32; 3]> {
    let slice = |which: usize| {
        [0, 1, 2].map(|k| {
            pairs
                .iter()
                .map(|pair| pair[which][k])
                .collect::<Vec<f32>>()
        })
    };
    let (wi, wr) = (slice(0), slice(1));
    let mut rho = [(); 3].map(|()| vec![f32::NAN; pairs.len()]);
    table.eval_batch_at(
        level,
        &[],
        Quantity::Rho,
        wi.each_ref().map(Vec::as_slice),
        wr.each_ref().map(Vec::as_slice),
        rho.each_mut().map(Vec::as_mut_slice),
    );
    (0..pairs.len())
        .map(|k| rho.each_ref().map(|channel| channel[k].to_bits()))
        .collect()
}
