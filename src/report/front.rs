//! The Pareto front.

/// The points than which no other is as good in one coordinate and better in the other, less being better: their indices
/// in ascending order of the first coordinate. Of equal points all. Less than a thousandth better in the second is as good.
pub fn pareto_front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| {
        let (a, b) = (points[*a], points[*b]);
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    const LEAST_GAIN: f64 = 0.999;
    let mut best = (f64::NAN, f64::INFINITY);
    order.retain(|index| {
        let point = points[*index];
        let is_on = point.1 < LEAST_GAIN * best.1 || point == best;
        if is_on {
            best = point;
        }
        is_on
    });
    order
}

#[cfg(test)]
mod tests {
    use super::pareto_front;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (5.0, 1.0),
            (1.0, 9.0),
            (2.0, 9.0), // slower than the one before and no better
            (2.0, 4.0),
            (3.0, 4.0),
            (2.0, 4.0), // the same again
            (4.0, 6.0),
            (9.0, 0.5),
            (9.0, 0.7),
            (10.0, 0.4999), // hardly better than (9, 0.5)
        ];
        assert_eq!(pareto_front(&points), [1, 3, 5, 0, 7]);
        assert!(pareto_front(&[]).is_empty());
        assert_eq!(pareto_front(&[(1.0, f64::NAN), (2.0, 3.0)]), [1]);
    }
}
