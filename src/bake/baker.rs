//! One fabric, and any number of its tables.

use super::choose::{Planned, Representation, choose_all};
use super::survey::Survey;
use super::{
    BakeError, Cost, FabricText, Goal, Provenance, Request, Scope, Settings, budget, encode,
    promise, sampling,
};
use crate::fabric::{Fabric, Thread};
use crate::metrics::Reference;
use crate::needs::Needs;
use crate::progress::Progress;
use crate::table::{Content, Energy, Grids, Sampling, Table, ThreadParameters, ThreadTable};

/// Bakes tables of one fabric. What they share is found once: how error falls with knots, and the truth that it is measured by.
pub struct Baker<'a> {
    fabric: &'a Fabric,
    text: FabricText,
    threads: Vec<Survey<'a>>,
    reference: Reference<'a>,
    /// What there is for sampling, once it is known: albedos alone, or histograms, too.
    sampling: [Option<Vec<Sampling>>; 2],
}

/// What a bake made, and what it found.
#[derive(Debug, Clone)]
pub struct Baked {
    /// The table, with `provenance` as its metadata.
    pub table: Table,
    /// What made it, and how much it errs.
    pub provenance: Provenance,
    /// Whether the goal is reached; if not, nothing that was tried comes nearer to it.
    pub within: bool,
    /// What the table costs.
    pub cost: Cost,
}

/// Bakes one table of `fabric` and measures its error. The same input gives the same table on any number of workers, unless there is
/// a budget of time.
///
/// Where `request` has a scope, the table is that of everything there, to the last bit, unless fixed albedos are in it; its error is
/// measured on pairs that it has.
///
/// # Errors
/// When `progress` says stop, the fabric is not what its TOML text says, or nothing is needed of it.
pub fn bake<'r>(
    fabric: &Fabric,
    request: impl Into<Request<'r>>,
    progress: Progress<'_>,
) -> Result<Baked, BakeError> {
    Baker::new(fabric)?.bake(request, progress)
}

impl<'a> Baker<'a> {
    /// Nothing is found yet.
    ///
    /// # Errors
    /// When the fabric is not what its TOML text says.
    pub fn new(fabric: &'a Fabric) -> Result<Self, BakeError> {
        let text = FabricText::of(fabric);
        if text.parse().as_ref() != Ok(fabric) {
            return Err(BakeError::TextDiffers(fabric.name.clone()));
        }
        Ok(Self {
            fabric,
            text,
            threads: Survey::of(fabric),
            reference: Reference::new(fabric),
            sampling: [None, None],
        })
    }

    /// As [`bake`].
    ///
    /// # Errors
    /// When `progress` says stop, or nothing is needed.
    pub fn bake<'r>(
        &mut self,
        request: impl Into<Request<'r>>,
        progress: Progress<'_>,
    ) -> Result<Baked, BakeError> {
        let Request {
            settings,
            goal,
            scope,
        } = request.into();
        if scope.needs.is_some_and(Needs::is_empty) {
            return Err(BakeError::NotNeeded(self.fabric.name.clone()));
        }
        match goal {
            Goal::AsSet => self.bake_as_set(&settings, &scope, progress),
            Goal::Promise => promise::bake(self, &settings, &scope, progress),
            Goal::Within(budget) => budget::bake(self, &settings, &budget, &scope, progress),
        }
    }

    pub(super) fn fabric(&self) -> &'a Fabric {
        self.fabric
    }

    /// By these settings and no others.
    pub(super) fn bake_as_set(
        &mut self,
        settings: &Settings,
        scope: &Scope<'_>,
        progress: Progress<'_>,
    ) -> Result<Baked, BakeError> {
        let sampling = progress.part(0.0, 0.85);
        let (plans, choices) = choose_all(&mut self.threads, settings, sampling.part(0.0, 0.3))?;
        let mut table = self.fill(plans, scope, sampling.part(0.3, 1.0))?;
        let (pairs, seed) = (settings.error_pairs, settings.error_seed);
        let measuring = progress.part(0.85, 1.0);
        let error = self
            .reference
            .measure_table(&table, pairs, seed, measuring)?;
        // Measured as it is: the truth has no albedos to divide by.
        self.add_sampling(&mut table, settings, scope, measuring)?;
        let provenance = Provenance {
            tool: crate::TOOL.to_owned(),
            settings: settings.clone(),
            adapted: None,
            scope: scope.note(),
            fabric: self.text.clone(),
            error,
            choices,
        };
        let mut baked = Baked {
            cost: Cost {
                error: provenance.error.all.mean,
                bytes: table.decoded_bytes(),
                ns: None,
            },
            table,
            provenance,
            within: true,
        };
        baked.record();
        Ok(baked)
    }

    /// Adds what path tracers need, if it is wanted. A table of some pairs draws none, since it may not have them.
    fn add_sampling(
        &mut self,
        table: &mut Table,
        settings: &Settings,
        scope: &Scope<'_>,
        progress: Progress<'_>,
    ) -> Result<(), BakeError> {
        let draws = settings.sampling && scope.needs.is_none();
        if !draws && settings.energy == Energy::AsIs {
            return Ok(());
        }
        let known = &mut self.sampling[usize::from(draws)];
        if known.is_none() {
            *known = Some(sampling::sampling_of(self.fabric, draws, progress)?);
        }
        let sampling = known.iter().flatten().cloned();
        for (thread, sampling) in table.threads.iter_mut().zip(sampling) {
            thread.sampling = Some(sampling);
        }
        table.energy = settings.energy;
        Ok(())
    }

    /// The table that is planned.
    fn fill(
        &self,
        plans: Vec<Option<Representation>>,
        scope: &Scope<'_>,
        progress: Progress<'_>,
    ) -> Result<Table, BakeError> {
        let to_fill: usize = plans.iter().flatten().map(Representation::grids).sum();
        let mut filled = 0;
        let mut fill = |thread: &Thread, planned: Planned, content: Content| {
            let share = |filled: usize| filled as f64 / to_fill as f64;
            let filling = progress.part(share(filled), share(filled + 1));
            filled += 1;
            encode::fill_grid(thread, planned, content, scope, filling)
        };
        let mut threads = Vec::new();
        for (Survey { thread, .. }, plan) in self.threads.iter().zip(plans) {
            let mut parameters = ThreadParameters {
                name: thread.name.clone(),
                direction: thread.direction(),
                coverage: thread.coverage,
                albedo: thread.albedo,
                optics: thread.optics,
                tilts: Vec::new(),
                segments: Vec::new(),
                nodes: Vec::new(),
            };
            if thread.is_straight() {
                let curve = thread.tangents::<f64>();
                let tilts = curve.tilts().iter();
                parameters.tilts = tilts.map(|tilt| (tilt.angle, tilt.weight)).collect();
                let segments = curve.segments().iter();
                parameters.segments = segments.map(|s| (s.from, s.to, s.weight)).collect();
            }
            let grids = match plan {
                None => Grids::None,
                Some(Representation::Direct(nodes)) => {
                    parameters.nodes = nodes;
                    Grids::None
                }
                Some(Representation::Grid { grid, nodes }) => {
                    parameters.nodes = nodes;
                    Grids::Segments(fill(thread, *grid, scope.content(thread))?)
                }
                Some(Representation::Curve {
                    response,
                    projection,
                }) => Grids::Curve {
                    response: fill(thread, *response, scope.content(thread))?,
                    projection: fill(thread, *projection, Content::Both)?,
                },
            };
            threads.push(ThreadTable::new(parameters, grids));
        }
        let fabric = self.fabric;
        Ok(Table::new(
            threads,
            fabric.gap() as f32,
            fabric.sigma_u as f32,
            fabric.rho_scale as f32,
            fabric.reweighting,
        ))
    }
}

impl Baked {
    /// Writes the provenance into the table.
    pub(super) fn record(&mut self) {
        self.table.metadata = self.provenance.to_text();
    }
}
