//! Best fits of the other models to a fabric of threads.
//!
//! ```text
//! minimise Σ over pairs and channels of ((ρ_M − ρ_D) / (ρ_D + 0.01 ρ̄))²
//! ```
//!
//! by Levenberg–Marquardt (the crate of that name, which follows MINPACK), on pairs of the error protocol, so that what is
//! minimised is the square of what is reported (see [`crate::metrics`]). Dark pairs count as much as bright ones: where a
//! model cannot follow a highlight, its fit is too dark there rather than too bright elsewhere. The same fabric gives the same fit.
//!
//! What is free, within the ranges of [`crate::fabric`]: colours, σ, α_x and α_y; of Irawan's model α, β, u_max, κ, and ψ of
//! staple or δ of filament yarns, from what [`irawan_of`] translates. Sizes and areas of yarns stay, and so does the η of
//! Torrance and Sparrow's, 1.5, which k_s all but replaces.

mod problem;

use std::ops::RangeInclusive;

use levenberg_marquardt::LevenbergMarquardt;

use crate::fabric::{Fabric, Lambert, Models, OrenNayar, TorranceSparrow, Yarn};
use crate::metrics::{PairErrors, Truth, VALIDATION_SEED, protocol_pairs};
use crate::model::{IrawanMarschner, ModelKind, Rule, Sadeghi, SpineError, irawan_of};
use crate::progress::{Cancelled, Progress};

/// Pairs to fit to.
const PAIRS: usize = 1024;
/// The seed that draws them: others than what error is measured on.
const SEED: u64 = 41;
/// Pairs that the error is measured on.
const ERROR_PAIRS: usize = 8192;
/// Relative change of the squares and of the parameters at which a fit is done.
const TOLERANCE: f64 = 1e-6;
/// Evaluations per parameter at which a fit is given up as good enough.
const PATIENCE: usize = 6;

/// The first step is at most this many times the parameters' length; translated yarns are far too bright to begin with.
const FIRST_STEP: f64 = 1.0;

/// Colours that are free.
const COLOR: RangeInclusive<f64> = 0.0..=100.0;
/// k_s before it is normalised, which makes it some hundred times as large.
const BARE_SPECULAR: RangeInclusive<f64> = 0.0..=1000.0;
const ALPHA: RangeInclusive<f64> = 0.0..=1.0;
const BETA: RangeInclusive<f64> = 0.0..=50.0;
const KAPPA: RangeInclusive<f64> = -0.95..=10.0;

/// Roughnesses to start from, with Lambert's fit and little of the specular part, so that no fit is worse than Lambert's; the
/// best counts.
const ROUGHNESSES: [f64; 3] = [0.15, 0.3, 0.6];
/// Roughness that is free: sharper lobes than any fabric's would only meet single pairs.
const ROUGHNESS: RangeInclusive<f64> = 0.02..=1.0;

/// A best fit and its error.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The one model's parameters.
    pub models: Models,
    /// How far it is from direct integration of the fabric.
    pub error: PairErrors,
}

/// Why there is no fit.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The translated yarns have no spine.
    #[error(transparent)]
    Spine(#[from] SpineError),
    /// The caller wants it no more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Fits a model to `fabric` and measures its error on other pairs.
///
/// # Errors
/// When `progress` says stop, or a yarn has no spine.
pub fn fit(fabric: &Fabric, kind: ModelKind, progress: Progress<'_>) -> Result<Fit, FitError> {
    // Without rims: a model of another form would trade what is seen for what hardly is.
    let reference = Sadeghi::<f64>::new(fabric, Rule::REFERENCE);
    let pairs = protocol_pairs(fabric, PAIRS, SEED);
    let data = Truth::of_model(&reference, pairs, progress.part(0.0, 0.1))?;
    let starts = match kind {
        ModelKind::Irawan => vec![Models {
            irawan: Some(irawan_of(fabric)),
            ..Models::default()
        }],
        ModelKind::TorranceSparrow => {
            let lambert = starts(ModelKind::Lambert);
            let fitted = fit_to(&data, ModelKind::Lambert, &lambert, progress.part(0.1, 0.2))?;
            let mut starts = starts(kind);
            for start in &mut starts {
                if let (Some(start), Some(Lambert { albedo })) =
                    (&mut start.torrance_sparrow, fitted.lambert)
                {
                    start.diffuse = albedo;
                }
            }
            starts
        }
        _ => starts(kind),
    };
    let models = fit_to(&data, kind, &starts, progress.part(0.2, 0.7))?;
    let truth = Truth::new(
        fabric,
        ERROR_PAIRS,
        VALIDATION_SEED,
        progress.part(0.7, 1.0),
    )?;
    let model = kind.prepare::<f64>(&models)?.expect("it was fitted");
    let values = truth.values_of(&*model, Progress::silent())?;
    Ok(Fit {
        models,
        error: truth.errors_of(&values),
    })
}

/// Where fits of a model begin that nothing is known of.
fn starts(kind: ModelKind) -> Vec<Models> {
    let albedo = [0.2; 3];
    let none = Models::default;
    match kind {
        ModelKind::Lambert => vec![Models {
            lambert: Some(Lambert { albedo }),
            ..none()
        }],
        ModelKind::OrenNayar => vec![Models {
            oren_nayar: Some(OrenNayar { albedo, sigma: 0.5 }),
            ..none()
        }],
        ModelKind::TorranceSparrow => ROUGHNESSES
            .map(|alpha| Models {
                torrance_sparrow: Some(TorranceSparrow {
                    diffuse: [0.1; 3],
                    specular: [1e-3; 3],
                    alpha_x: alpha,
                    alpha_y: alpha,
                    eta: 1.5,
                    distribution: Default::default(),
                    shadowing: Default::default(),
                    fresnel: Default::default(),
                }),
                ..none()
            })
            .to_vec(),
        ModelKind::Irawan => Vec::new(),
    }
}

/// The best of the fits to `data` that begin at `starts`, of which there is at least one.
///
/// # Errors
/// When `progress` says stop, or a yarn of a start has no spine.
pub fn fit_to(
    data: &Truth,
    kind: ModelKind,
    starts: &[Models],
    progress: Progress<'_>,
) -> Result<Models, FitError> {
    let mut best: Option<(f64, Models)> = None;
    let steps = progress.steps(starts.len());
    for start in starts {
        let mut start = start.clone();
        scale_specular(&mut start, |n| 1.0 / n)?;
        let problem = problem::Problem::new(data, kind, start, &steps);
        let (problem, report) = LevenbergMarquardt::new()
            .with_tol(TOLERANCE)
            .with_patience(PATIENCE)
            .with_stepbound(FIRST_STEP)
            .minimize(problem);
        steps.advance()?;
        let squares = report.objective_function;
        if best.as_ref().is_none_or(|(least, _)| squares < *least) {
            best = Some((squares, problem.into_models()));
        }
    }
    let (_, mut models) = best.expect("at least one start");
    scale_specular(&mut models, |n| n)?;
    Ok(models)
}

/// Multiplies the k_s of Irawan's model by a function of N. Fits are of the integrals without N, which would take long to know.
fn scale_specular(models: &mut Models, factor: impl Fn(f64) -> f64) -> Result<(), SpineError> {
    if let Some(parameters) = &mut models.irawan {
        let factor = factor(IrawanMarschner::<f64>::new(parameters)?.normalization());
        for yarn in &mut parameters.yarns {
            yarn.specular = yarn.specular.map(|k_s| k_s * factor);
        }
    }
    Ok(())
}

/// Shows every free parameter and its range.
fn each_parameter(models: &mut Models, mut show: impl FnMut(&mut f64, RangeInclusive<f64>)) {
    let Models {
        lambert,
        oren_nayar,
        torrance_sparrow,
        irawan,
    } = models;
    let mut color = |color: &mut [f64; 3], range: &RangeInclusive<f64>| {
        for channel in color {
            show(channel, range.clone());
        }
    };
    if let Some(model) = lambert {
        color(&mut model.albedo, &COLOR);
    }
    if let Some(model) = oren_nayar {
        color(&mut model.albedo, &COLOR);
    }
    if let Some(model) = torrance_sparrow {
        color(&mut model.diffuse, &COLOR);
        color(&mut model.specular, &COLOR);
    }
    if let Some(model) = irawan {
        color(&mut model.diffuse, &COLOR);
        for yarn in &mut model.yarns {
            color(&mut yarn.specular, &BARE_SPECULAR);
        }
    }
    if let Some(model) = oren_nayar {
        show(&mut model.sigma, OrenNayar::SIGMA);
    }
    if let Some(model) = torrance_sparrow {
        show(&mut model.alpha_x, ROUGHNESS);
        show(&mut model.alpha_y, ROUGHNESS);
    }
    for yarn in irawan.iter_mut().flat_map(|model| &mut model.yarns) {
        show(&mut yarn.alpha, ALPHA);
        show(&mut yarn.beta, BETA);
        // Not so steep that nothing is left of the spine.
        let steepest = (0.999 * yarn.length / yarn.width).min(1.0).asin();
        show(
            &mut yarn.u_max,
            *Yarn::U_MAX.start()..=steepest.min(*Yarn::U_MAX.end()),
        );
        show(&mut yarn.kappa, KAPPA);
        if yarn.psi > 0.0 {
            show(&mut yarn.psi, Yarn::PSI);
        } else if yarn.psi < 0.0 {
            show(&mut yarn.psi, -Yarn::PSI.end()..=-Yarn::PSI.start());
        } else {
            show(&mut yarn.delta, Yarn::DELTA);
        }
    }
}
