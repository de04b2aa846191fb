//! What a bake for a scope leaves out, before it is done.

use std::time::Instant;

use super::choose::{Representation, choose_all};
use super::scope::Extent;
use super::survey::Survey;
use super::{BakeError, Scope, Settings};
use crate::chart::Coordinates;
use crate::fabric::{Fabric, Thread};
use crate::progress::Progress;
use crate::table::{Axis, COEFFICIENT_BYTES, Content, Rows, coefficients_of};

/// What is left out of a fabric's table.
#[derive(Debug, Clone)]
pub struct Forecast {
    /// Of every visible thread.
    pub threads: Vec<ThreadForecast>,
}

/// What is left out of a thread.
#[derive(Debug, Clone)]
pub struct ThreadForecast {
    /// The thread's name.
    pub thread: String,
    /// None for a thread that is evaluated directly, or in closed form, and has nothing that could be left out.
    pub grid: Option<GridForecast>,
    /// Placed tilts per segment of one that is evaluated directly.
    pub direct_nodes: Option<usize>,
}

/// What is left out of the grid of S and V of a thread.
#[derive(Debug, Clone)]
pub struct GridForecast {
    /// What it is a function of.
    pub coordinates: Coordinates,
    /// Channels that are left.
    pub content: Content,
    /// Axes that are collapsed to one place.
    pub collapsed: Vec<usize>,
    /// Cells of the box, those that are needed, and how many there are.
    pub cells: [usize; 2],
    /// Bytes in memory, of what is needed, and of everything.
    pub bytes: [usize; 2],
    /// Sites that are integrated, for what is needed, and for everything.
    pub sites: [usize; 2],
    /// Seconds on one core that these sites take, about.
    pub seconds: [f64; 2],
    /// The needed cells, projected onto u₀ and u₁, and onto u₂ and u₃.
    pub projections: [Projection; 2],
}

/// Which part of the cells behind it is needed.
#[derive(Debug, Clone)]
pub struct Projection {
    /// Names of the axes to the right and upwards.
    pub axes: [&'static str; 2],
    /// Ends of the cells on both.
    pub knots: [Vec<f64>; 2],
    /// `[upwards][right]`, 0 to 1.
    pub shares: Vec<Vec<f64>>,
}

/// Plans as a bake does, and counts.
///
/// # Errors
/// When `progress` says stop, or nothing is needed.
pub fn forecast(
    fabric: &Fabric,
    settings: &Settings,
    scope: &Scope<'_>,
    progress: Progress<'_>,
) -> Result<Forecast, BakeError> {
    if scope.needs.is_some_and(crate::needs::Needs::is_empty) {
        return Err(BakeError::NotNeeded(fabric.name.clone()));
    }
    let mut surveys = Survey::of(fabric);
    let (plans, _) = choose_all(&mut surveys, settings, progress)?;
    let threads = surveys
        .iter()
        .zip(plans)
        .map(|(Survey { thread, .. }, plan)| {
            let direct_nodes = match &plan {
                Some(Representation::Direct(nodes)) => Some(nodes.len()),
                _ => None,
            };
            let planned = match plan {
                Some(Representation::Grid { grid, .. }) => Some(grid),
                Some(Representation::Curve { response, .. }) => Some(response),
                Some(Representation::Direct(_)) | None => None,
            };
            ThreadForecast {
                thread: thread.name.clone(),
                direct_nodes,
                grid: planned.map(|planned| {
                    let coordinates = planned.integrand.coordinates();
                    let axes = planned.plan.axes;
                    let seconds = seconds_per_site(&|u| {
                        planned.integrand.at_point(u);
                    });
                    of_grid(thread, scope, coordinates, axes, seconds)
                }),
            }
        });
    Ok(Forecast {
        threads: threads.collect(),
    })
}

/// Measured at points spread over the box.
fn seconds_per_site(at: &dyn Fn([f64; 4])) -> f64 {
    const POINTS: u32 = 256;
    let start = Instant::now();
    for k in 0..POINTS {
        // The additive recurrence on the four-dimensional golden ratio.
        at([0.856_675, 0.733_892, 0.628_707, 0.538_597]
            .map(|step| (0.5 + f64::from(k) * step).fract()));
    }
    start.elapsed().as_secs_f64() / f64::from(POINTS)
}

fn of_grid(
    thread: &Thread,
    scope: &Scope<'_>,
    coordinates: Coordinates,
    all_axes: [Axis; 4],
    seconds_per_site: f64,
) -> GridForecast {
    let content = scope.content(thread);
    let all: usize = all_axes.iter().map(Axis::len).product();
    let channels = content.channels();
    let channel_bytes = channels * COEFFICIENT_BYTES;
    let direction = thread.direction();
    let extent = Extent::new(scope, coordinates, direction, &all_axes, channels);
    let (axes, rows) = (&extent.axes, &extent.rows);
    let collapsed = (0..coordinates.rank())
        .filter(|axis| axes[*axis].is_flat())
        .collect();
    let cells = match rows {
        Some(rows) => rows.baked_cells(axes),
        None => [axes.iter().map(|axis| axis.firsts().count()).product(); 2],
    };
    let bytes = extent.coefficients() * channel_bytes + rows.as_ref().map_or(0, Rows::bytes);
    let sites = extent.sites();
    let is_baked = |first| rows.as_ref().is_none_or(|rows| rows.has(axes, first));
    let names = coordinates.names();
    let project = |right: usize, up: usize| {
        let firsts = axes
            .each_ref()
            .map(|axis| axis.firsts().collect::<Vec<usize>>());
        let others: Vec<usize> = (0..4)
            .filter(|axis| *axis != right && *axis != up)
            .collect();
        let behind = |right_first: usize, up_first: usize| {
            let mut needed = 0;
            for a in &firsts[others[0]] {
                for b in &firsts[others[1]] {
                    let mut first = [0; 4];
                    (first[right], first[up]) = (right_first, up_first);
                    (first[others[0]], first[others[1]]) = (*a, *b);
                    needed += usize::from(is_baked(first));
                }
            }
            needed as f64 / (firsts[others[0]].len() * firsts[others[1]].len()) as f64
        };
        let row = |up_first: &usize| {
            firsts[right]
                .iter()
                .map(|first| behind(*first, *up_first))
                .collect()
        };
        Projection {
            axes: [right, up].map(|axis| names.get(axis).copied().unwrap_or("")),
            knots: [right, up].map(|axis| axes[axis].knots().collect()),
            shares: firsts[up].iter().map(row).collect(),
        }
    };
    GridForecast {
        coordinates,
        content,
        collapsed,
        cells,
        bytes: [
            bytes,
            coefficients_of(&all_axes) * Content::Both.channels() * COEFFICIENT_BYTES,
        ],
        sites: [sites, all],
        seconds: [sites, all].map(|sites| sites as f64 * seconds_per_site),
        projections: [project(0, 1), project(2, 3)],
    }
}
