//! What `eval` and `render` evaluate: a table, a fabric or a pattern, and in which way.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Result, bail};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use sateen::evaluator::{Cloth, Evaluator, Missing, Spec};
use sateen::fabric::Fabric;
use sateen::math::Real;
use sateen::model::{ModelKind, Rule};
use sateen::table::Table;

use crate::output::Usage;
use crate::subject::{Subject, What, load_table, provenance};

/// In which way a fabric is evaluated.
#[derive(clap::Args)]
pub(crate) struct WayArgs {
    /// table, midpoint:N (the thesis takes 50), quadrature:N (N placed tilts per segment) or reference [default: table for a
    /// table and with --tables; else `eval` takes reference, and `render` quadrature:8].
    #[arg(long, value_parser = parse_evaluator)]
    pub(crate) evaluator: Option<Spec>,
    /// Which model of the fabric. Models other than sadeghi have a section of their name in the fabric's TOML file, which `sateen
    /// fit` writes; without a section, irawan is translated from the threads.
    #[arg(long, default_value = SADEGHI, value_parser = evaluated_model())]
    pub(crate) model: ::std::option::Option<ModelKind>,
    /// The folder of the tables that a pattern is evaluated with: what `bake PATTERN -o DIR` wrote.
    #[arg(long, value_name = "DIR")]
    pub(crate) tables: Option<PathBuf>,
}

/// The model of which tables are made.
const SADEGHI: &str = "sadeghi";

/// A model to evaluate: none is Sadeghi's.
fn evaluated_model() -> impl TypedValueParser<Value = Option<ModelKind>> {
    let others = ModelKind::ALL.map(ModelKind::name);
    PossibleValuesParser::new([SADEGHI].into_iter().chain(others))
        .map(|name| ModelKind::named(&name))
}

fn parse_evaluator(text: &str) -> Result<Spec, String> {
    match text.parse() {
        Ok(Spec::Model(kind)) => Err(format!("it is a model: --model {}", kind.name())),
        Ok(spec) => Ok(spec),
        Err(error) => Err(error.to_string()),
    }
}

impl WayArgs {
    /// What the flags say of `subject`, with the rule that fabrics have unless told otherwise.
    pub(crate) fn spec(&self, subject: &Subject, rule: Rule) -> Result<Spec> {
        self.check_tables(subject)?;
        if let Some(kind) = self.model {
            if self.evaluator.is_some() {
                let message = format!("--evaluator is for --model sadeghi, not {}", kind.name());
                return Err(Usage(message).into());
            }
            return Ok(Spec::Model(kind));
        }
        let is_table = matches!(subject.what, What::Table(_)) || self.tables.is_some();
        let spec = match &self.evaluator {
            Some(spec) => spec.clone(),
            None if is_table => Spec::Table,
            None => Spec::Rule(rule),
        };
        if self.tables.is_some() && spec != Spec::Table {
            let message = "--tables is for --evaluator table";
            return Err(Usage(message.to_owned()).into());
        }
        Ok(spec)
    }

    /// Complains of `--tables` if `subject` is no pattern.
    pub(crate) fn check_tables(&self, subject: &Subject) -> Result<()> {
        if self.tables.is_some() && !matches!(subject.what, What::Pattern(_)) {
            let message = format!("--tables is for patterns, but {subject} is not one");
            return Err(Usage(message).into());
        }
        Ok(())
    }

    /// The cloth that `subject` names, which `spec` evaluates.
    pub(crate) fn cloth<R: Real>(
        &self,
        subject: &Subject,
        spec: &Spec,
        missing: Missing,
    ) -> Result<Cloth<R>> {
        match (&subject.what, spec) {
            (What::Pattern(pattern), _) => {
                let evaluator = |fabric: &Fabric| match (spec, &self.tables) {
                    (Spec::Rule(rule), _) => Ok(Evaluator::rule(fabric, *rule)),
                    (Spec::Table, Some(folder)) => {
                        table_in(folder, fabric, missing, "bake the pattern again")
                    }
                    (Spec::Table, None) => {
                        let message = format!(
                            "the evaluator table of a pattern needs --tables DIR, where `sateen bake {subject} -o DIR` wrote"
                        );
                        Err(Usage(message).into())
                    }
                    _ => Err(not_for_patterns(subject)),
                };
                let evaluators = pattern.bakes().map(evaluator).collect::<Result<_>>()?;
                Ok(Cloth::pattern(Arc::clone(pattern), evaluators))
            }
            (What::Table(table), Spec::Table) => {
                let table = Table::clone(table);
                Ok(Evaluator::table(table, Vec::new(), missing).into())
            }
            (_, Spec::Rule(rule)) => Ok(Evaluator::rule(&*subject.fabric()?, *rule).into()),
            (_, Spec::Model(kind)) => {
                let model = Evaluator::model(&*subject.fabric()?, *kind)?;
                let Some(model) = model else {
                    let name = kind.name();
                    bail!(
                        "{subject} has no section [{}]; `sateen fit {name} {subject} -o FILE` writes a file that has it",
                        name.replace('-', "_")
                    );
                };
                Ok(model.into())
            }
            (_, Spec::Table | Spec::NamedTable(_) | Spec::Fit(_)) => {
                let message = format!(
                    "the evaluator {spec} needs a table, but {subject} is a fabric; bake it first"
                );
                Err(Usage(message).into())
            }
        }
    }
}

/// What is asked of a pattern that only one fabric can do.
pub(crate) fn not_for_patterns(subject: &Subject) -> anyhow::Error {
    let message = format!(
        "{subject} is a pattern, which has no other models and no table of its own; it has table (with --tables), midpoint:N, \
         quadrature:N and reference"
    );
    Usage(message).into()
}

/// The table of `fabric` in a folder.
pub(crate) fn table_in<R: Real>(
    folder: &Path,
    fabric: &Fabric,
    missing: Missing,
    remedy: &str,
) -> Result<Evaluator<R>> {
    let path = folder.join(format!("{}.sateen", fabric.name));
    dyed_table(&path, fabric, missing, remedy)
}

/// A table of `fabric`, however that was dyed for the bake, with the albedos that it has now.
pub(crate) fn dyed_table<R: Real>(
    path: &Path,
    fabric: &Fabric,
    missing: Missing,
    remedy: &str,
) -> Result<Evaluator<R>> {
    let (table, _) = load_table(path)?;
    let (_, baked) = provenance(&table, path)?;
    if !baked.is_dyed_like(fabric) {
        bail!(
            "{} is a table of {}, which is not the {} that is asked for; {remedy}",
            path.display(),
            baked.name,
            fabric.name
        );
    }
    let single = |albedo: [f64; 3]| albedo.map(|channel| channel as f32);
    let threads = fabric.visible_threads();
    let albedos = threads.map(|thread| single(thread.albedo)).collect();
    Ok(Evaluator::table(table, albedos, missing))
}
