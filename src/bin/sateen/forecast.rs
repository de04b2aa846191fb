//! Which part of a table's box is needed, drawn.

use plotters::prelude::*;
use sateen::bake::{Forecast, Projection};

const PANEL: (u32, u32) = (460, 300);

/// Two projections for each thread that has a grid, as SVG: white is not needed, and the darker, the more of what is behind.
pub(crate) fn forecast_svg(title: &str, forecast: &Forecast) -> String {
    let grids: Vec<(&str, &[Projection; 2])> = forecast
        .threads
        .iter()
        .filter_map(|thread| Some((thread.thread.as_str(), &thread.grid.as_ref()?.projections)))
        .collect();
    let rows = grids.len().max(1) as u32;
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (2 * PANEL.0, rows * PANEL.1 + 30))
            .into_drawing_area();
        draw(&root, title, &grids).expect("drawing into memory succeeds");
    }
    svg
}

fn draw(
    root: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    title: &str,
    grids: &[(&str, &[Projection; 2])],
) -> Result<(), Box<dyn std::error::Error>> {
    root.fill(&WHITE)?;
    let root = root.titled(title, ("sans-serif", 18))?;
    if grids.is_empty() {
        return Ok(());
    }
    let panels = root.split_evenly((grids.len(), 2));
    for (row, (thread, projections)) in grids.iter().enumerate() {
        for (column, projection) in projections.iter().enumerate() {
            panel(&panels[2 * row + column], thread, projection)?;
        }
    }
    Ok(())
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    thread: &str,
    projection: &Projection,
) -> Result<(), Box<dyn std::error::Error>> {
    let ends = |axis: usize| {
        let knots = &projection.knots[axis];
        let (from, to) = (knots[0], knots[knots.len() - 1]);
        // An axis of one place is drawn as wide as any.
        if from < to {
            from..to
        } else {
            from..from + 1.0
        }
    };
    let [right, up] = projection.axes;
    let mut chart = ChartBuilder::on(area)
        .caption(thread, ("sans-serif", 14))
        .margin(8)
        .x_label_area_size(32)
        .y_label_area_size(44)
        .build_cartesian_2d(ends(0), ends(1))?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(right)
        .y_desc(up)
        .x_labels(5)
        .y_labels(5)
        .draw()?;
    let cell = |axis: usize, index: usize| {
        let knots = &projection.knots[axis];
        let from = knots[index];
        (from, knots.get(index + 1).copied().unwrap_or(from + 1.0))
    };
    let shares = projection
        .shares
        .iter()
        .enumerate()
        .flat_map(|(row, shares)| {
            let shares = shares.iter().enumerate();
            shares.map(move |(column, share)| (row, column, *share))
        });
    chart.draw_series(shares.filter(|(_, _, share)| *share > 0.0).map(
        |(row, column, share)| {
            let ((left, right), (low, high)) = (cell(0, column), cell(1, row));
            Rectangle::new(
                [(left, low), (right, high)],
                BLUE.mix(0.15 + 0.85 * share).filled(),
            )
        },
    ))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use sateen::bake::{GridForecast, ThreadForecast};
    use sateen::chart::Coordinates;
    use sateen::table::Content;

    use super::*;

    #[test]
    fn threads_with_a_grid_are_drawn_twice_and_others_not() {
        let projection = |knots: &[f64]| Projection {
            axes: ["theta_h", "phi_d"],
            knots: [knots.to_vec(), vec![0.0, 0.5, 1.0]],
            shares: vec![vec![0.0; knots.len().max(2) - 1], vec![1.0]],
        };
        let thread = |thread: &str, has_grid: bool| ThreadForecast {
            thread: thread.to_owned(),
            direct_nodes: None,
            grid: has_grid.then(|| GridForecast {
                coordinates: Coordinates::Isotropic,
                content: Content::Both,
                collapsed: Vec::new(),
                cells: [1, 4],
                bytes: [100, 400],
                sites: [1, 4],
                seconds: [0.1, 0.4],
                // The second along an axis of one place.
                projections: [projection(&[0.0, 0.25, 1.0]), projection(&[0.5])],
            }),
        };
        let forecast = Forecast {
            threads: vec![thread("warp", true), thread("weft", false)],
        };
        let svg = forecast_svg("a title", &forecast);
        assert_eq!(svg.matches("warp").count(), 2, "{svg}");
        assert_eq!(svg.matches("theta_h").count(), 2, "{svg}");
        assert!(svg.contains("a title") && !svg.contains("weft"), "{svg}");
        // Two that are needed, beside the ground.
        assert_eq!(svg.matches("<rect").count(), 1 + 2, "{svg}");
        let none = Forecast {
            threads: Vec::new(),
        };
        assert!(forecast_svg("nothing", &none).contains("nothing"));
    }
}
