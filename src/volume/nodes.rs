//! Where along a coordinate texels are.

/// Nodes of a coordinate: multiples of 2 to the power of minus the depth, at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Nodes {
    depth: u32,
    /// Ascending.
    places: Vec<u16>,
}

impl Nodes {
    /// Of `places`, ascending, in units of 2^−`depth`; the depth becomes as small as it can be.
    pub(super) fn new(mut depth: u32, mut places: Vec<u16>) -> Self {
        if places.len() == 1 {
            depth = 0;
            places[0] = 0;
        }
        while depth > 0 && places.iter().all(|place| place % 2 == 0) {
            depth -= 1;
            places.iter_mut().for_each(|place| *place /= 2);
        }
        Self { depth, places }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// They are multiples of 2 to the power of minus this.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// Where they are, ascending within \[0, 1\].
    pub fn places(&self) -> impl ExactSizeIterator<Item = f32> + '_ {
        let unit = (1u32 << self.depth) as f32;
        self.places
            .iter()
            .map(move |place| f32::from(*place) / unit)
    }

    /// The nodes, and the middles between them: 2 n − 1 places.
    pub(super) fn halves(&self) -> Vec<f32> {
        let places: Vec<f32> = self.places().collect();
        let mut halves = vec![places[0]];
        for ends in places.windows(2) {
            halves.extend([0.5 * (ends[0] + ends[1]), ends[1]]);
        }
        halves
    }

    /// What turns u into the number of a node, t = a + b u: \[a, b\] of each of the 2^depth pieces of equal width. Before the first node
    /// t is 0, after the last n − 1.
    pub fn warp(&self) -> Vec<[f32; 2]> {
        let unit = f64::from(1u32 << self.depth);
        let mut warp = Vec::with_capacity(1 << self.depth);
        let mut node = 0;
        for piece in 0..1u32 << self.depth {
            while node + 1 < self.places.len() && u32::from(self.places[node + 1]) <= piece {
                node += 1;
            }
            let start = f64::from(self.places[node]);
            let outside = piece < u32::from(self.places[0]) || node + 1 == self.places.len();
            warp.push(if outside {
                [node as f32, 0.0]
            } else {
                let width = f64::from(self.places[node + 1]) - start;
                [(node as f64 - start / width) as f32, (unit / width) as f32]
            });
        }
        warp
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_are_whole_numbers_of_the_warp_and_straight_lines_lie_between() {
        let nodes = Nodes::new(6, vec![8, 16, 20, 32, 60]);
        assert_eq!((nodes.depth(), nodes.count()), (4, 5));
        let warp = nodes.warp();
        let at = |u: f32| {
            let [a, b] = warp[((u * warp.len() as f32) as usize).min(warp.len() - 1)];
            (a + b * u).clamp(0.0, 4.0)
        };
        for (k, place) in nodes.places().enumerate() {
            assert!((at(place) - k as f32).abs() < 1e-5, "{k}");
        }
        assert!((at(18.0 / 64.0) - 1.5).abs() < 1e-5);
        assert_eq!((at(0.0), at(1.0)), (0.0, 4.0));
    }

    #[test]
    fn one_node_stands_for_all() {
        assert_eq!(Nodes::new(7, vec![13]).warp(), [[0.0, 0.0]]);
    }
}
