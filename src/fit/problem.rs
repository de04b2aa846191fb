//! A fit as the optimiser wants it: residuals and their derivatives by parameters that may take any value.

use std::ops::RangeInclusive;

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::{DMatrix, DVector, Dyn, storage::Owned};

use super::each_parameter;
use crate::fabric::Models;
use crate::metrics::Truth;
use crate::model::{IrawanMarschner, Model, ModelKind};
use crate::progress::{Progress, Steps};

/// A step of a parameter for its derivative: roundings and bends are small beside it.
const STEP: f64 = 1e-5;
/// Parameters start at least this share of their range from its ends, where their derivative is 0.
const MARGIN: f64 = 1e-4;

/// A model's parameters, as angles: the share of a parameter's range that it has passed is the square of the sine. Steps that
/// lead beyond an end come back, unlike those of functions that approach it.
pub(super) struct Problem<'a> {
    data: &'a Truth,
    kind: ModelKind,
    models: Models,
    parameters: DVector<f64>,
    steps: &'a Steps<'a>,
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        data: &'a Truth,
        kind: ModelKind,
        mut models: Models,
        steps: &'a Steps<'a>,
    ) -> Self {
        let mut parameters = Vec::new();
        each_parameter(&mut models, |value, range| {
            let share = (*value - range.start()) / (range.end() - range.start());
            let share = share.clamp(MARGIN, 1.0 - MARGIN);
            parameters.push(share.sqrt().asin());
        });
        Self {
            data,
            kind,
            models,
            parameters: parameters.into(),
            steps,
        }
    }

    /// The parameters as they are now.
    pub(super) fn into_models(self) -> Models {
        self.models_at(&self.parameters)
    }

    fn models_at(&self, parameters: &DVector<f64>) -> Models {
        let mut models = self.models.clone();
        let mut parameters = parameters.iter();
        let mut next = || parameters.next().copied().unwrap_or(0.0);
        each_parameter(&mut models, |value, range: RangeInclusive<f64>| {
            let share = next().sin().powi(2);
            let inside = range.start() + (range.end() - range.start()) * share;
            *value = inside.clamp(*range.start(), *range.end());
        });
        models
    }

    /// `None` when the caller wants no more, or there is no such model.
    fn residuals_at(&self, parameters: &DVector<f64>) -> Option<DVector<f64>> {
        self.steps.check().ok()?;
        let models = self.models_at(parameters);
        let model: Box<dyn Model<f64> + Send> = match &models.irawan {
            Some(irawan) => Box::new(IrawanMarschner::with_normalization(irawan, 1.0).ok()?),
            None => self.kind.prepare(&models).ok()??,
        };
        let values = self.data.values_of(&*model, Progress::silent()).ok()?;
        Some(self.data.relative_residuals(&values).into())
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        self.parameters.copy_from(parameters);
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.residuals_at(&self.parameters)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.residuals()?;
        let column = |index: usize| {
            let mut parameters = self.parameters.clone();
            parameters[index] += STEP;
            Some((self.residuals_at(&parameters)? - &here) / STEP)
        };
        let columns = (0..self.parameters.len()).map(column);
        Some(DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?))
    }
}
