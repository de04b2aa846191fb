//! `sateen eval`

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use anyhow::{Context, Result, bail};
use csv::{StringRecord, WriterBuilder};
use rayon::prelude::*;
use sateen::brdf::{Components, ThreadResponse};
use sateen::fabric::Fabric;
use sateen::metrics::PairsFile;
use sateen::model::{Model, ModelKind, Rule, Sadeghi, irawan_of};
use sateen::pattern::Pattern;
use sateen::progress::{Cancelled, Progress};
use sateen::table::Table;

use crate::Outcome;
use crate::args::{EvalArgs, Evaluator};
use crate::output::{Bar, Output, Usage, go_on, print, say};
use crate::subject::{Subject, load_table, provenance};

pub(crate) fn run(args: &EvalArgs) -> Result<Outcome> {
    let subject = Subject::load(&args.subject, args.variant.as_deref())?;
    let source = Source::new(subject, args)?;
    let output = args.output.as_deref().map(Output::prepare).transpose()?;
    let input = read_pairs(&args.pairs, source.place_columns())?;
    if input.not_unit() > 0 {
        say(&format!(
            "{} directions were not of unit length and have been normalized",
            input.not_unit()
        ));
    }

    let mut writer = WriterBuilder::new().from_writer(Vec::new());
    let mut header: StringRecord = input.header().collect();
    if args.components {
        for name in &source.columns {
            for quantity in ["S", "V", "P"] {
                header.push_field(&format!("{quantity}_{name}"));
            }
        }
        header.push_field("Q");
    }
    for channel in ["rho_r", "rho_g", "rho_b"] {
        header.push_field(channel);
    }
    writer.write_record(&header)?;
    let mut bar = Bar::new(1);
    bar.begin(&args.subject);
    let report = |share: f64| bar.report(share);
    let progress = Progress::new(&report);
    let evaluated = progress.part(0.0, 0.9).steps(input.directions().len());
    let values: Vec<Vec<f64>> = input
        .directions()
        .par_iter()
        .enumerate()
        .map(|(row, [wi, wr])| {
            evaluated.advance()?;
            let columns = source.place_columns().len();
            let place = &input.numbers()[columns * row..columns * (row + 1)];
            Ok(source.values(place, *wi, *wr, args.components))
        })
        .collect::<Result<_, Cancelled>>()?;
    let misses = source.misses();
    if misses > 0 {
        let what = format!("{misses} of {} pairs were not baked", values.len());
        if args.strict {
            bail!("{what}; bake the table for them, or without --scene and --needs");
        }
        say(&format!("{what}, and have the nearest value"));
    }
    let written = progress.part(0.9, 1.0).steps(values.len());
    for (row, values) in values.into_iter().enumerate() {
        written.advance()?;
        let mut record: StringRecord = input.cells(row).collect();
        for value in values {
            // As short as it can be and still be read back exactly.
            record.push_field(&format!("{value:?}"));
        }
        writer.write_record(&record)?;
    }
    drop(bar);
    let text = writer.into_inner().map_err(|error| error.into_error())?;
    match output {
        Some(output) => output.write(&text)?,
        None => print(std::str::from_utf8(&text).context("CSV is UTF-8")?)?,
    }
    Ok(Outcome::Done)
}

/// What is evaluated, and how.
struct Source {
    evaluation: Evaluation,
    /// The visible threads' names, in order.
    threads: Vec<String>,
    /// The threads that components are written of: warp and weft in any case.
    columns: Vec<String>,
}

enum Evaluation {
    Cloth(Cloth),
    /// With a cloth for each of [`Pattern::bakes`].
    Pattern(Box<Pattern>, Vec<Cloth>),
    /// Another model than Sadeghi's.
    Other(Box<dyn Model<f64> + Send>),
}

/// One fabric by Sadeghi's model.
enum Cloth {
    Table(Box<Table>),
    Direct(Sadeghi<f64>),
}

impl Cloth {
    fn components(&self, wi: [f64; 3], wr: [f64; 3]) -> Components<f64> {
        match self {
            Self::Table(table) => table.components(single(wi), single(wr)).cast(),
            Self::Direct(model) => model.components(wi, wr),
        }
    }

    fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: [f64; 3], wr: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Table(table) => {
                let rho = table.eval_cos_with(albedos, single(wi), single(wr));
                rho.map(f64::from)
            }
            Self::Direct(model) => {
                let albedos: Vec<[f64; 3]> = albedos.iter().map(|a| a.map(f64::from)).collect();
                model.eval_cos_with(&albedos, wi, wr)
            }
        }
    }
}

fn single(w: [f64; 3]) -> [f32; 3] {
    w.map(|x| x as f32)
}

/// A table or model for every fabric that a pattern needs.
fn cloths_of(pattern: &Pattern, args: &EvalArgs) -> Result<Vec<Cloth>> {
    if let Some(kind) = args.model {
        let message = format!("--model {} is for one fabric, not a pattern", kind.name());
        return Err(Usage(message).into());
    }
    if args.components {
        let message =
            "--components is for one fabric; a pattern's materials have threads of their own";
        return Err(Usage(message.to_owned()).into());
    }
    let rule = match (args.evaluator, &args.tables) {
        (Some(Evaluator::Table) | None, Some(folder)) => {
            let load = |fabric: &Fabric| {
                let path = folder.join(format!("{}.sateen", fabric.name));
                let (table, _) = load_table(&path)?;
                let (_, baked) = provenance(&table, &path)?;
                if !baked.is_dyed_like(fabric) {
                    bail!(
                        "{} is not of the {} that {} names; bake the pattern again",
                        path.display(),
                        fabric.name,
                        args.subject
                    );
                }
                Ok(Cloth::Table(Box::new(table)))
            };
            return pattern.bakes().map(load).collect();
        }
        (Some(Evaluator::Table), None) => {
            let message = format!(
                "--evaluator table of a pattern needs --tables DIR, where `sateen bake {} -o DIR` wrote",
                args.subject
            );
            return Err(Usage(message).into());
        }
        (Some(Evaluator::Direct(_)), Some(_)) => {
            let message = "--tables are for --evaluator table";
            return Err(Usage(message.to_owned()).into());
        }
        (Some(Evaluator::Direct(rule)), None) => rule,
        (None, None) => Rule::REFERENCE,
    };
    let model = |fabric: &Fabric| Cloth::Direct(Sadeghi::new(fabric, rule));
    Ok(pattern.bakes().map(model).collect())
}

impl Source {
    fn new(subject: Subject, args: &EvalArgs) -> Result<Self> {
        if let Subject::Pattern(pattern) = subject {
            let cloths = cloths_of(&pattern, args)?;
            return Ok(Self {
                evaluation: Evaluation::Pattern(pattern, cloths),
                threads: Vec::new(),
                columns: Vec::new(),
            });
        }
        if args.tables.is_some() {
            let message = format!("--tables is for patterns, but {} is none", args.subject);
            return Err(Usage(message).into());
        }
        if let Some(kind) = args.model {
            return Self::other(subject, kind, args);
        }
        let (cloth, threads) = match (subject, args.evaluator) {
            (Subject::Table(table), None | Some(Evaluator::Table)) => {
                let threads = table
                    .threads()
                    .iter()
                    .map(|thread| thread.name().to_owned())
                    .collect();
                (Cloth::Table(table), threads)
            }
            (Subject::Fabric(_), Some(Evaluator::Table)) => {
                let message = format!(
                    "--evaluator table needs a table, but {} is a fabric; bake it first",
                    args.subject
                );
                return Err(Usage(message).into());
            }
            (subject, evaluator) => {
                let fabric = fabric_of(subject, args)?;
                let rule = match evaluator {
                    Some(Evaluator::Direct(rule)) => rule,
                    _ => Rule::REFERENCE,
                };
                let threads: Vec<String> = fabric
                    .visible_threads()
                    .map(|thread| thread.name.clone())
                    .collect();
                (Cloth::Direct(Sadeghi::new(&fabric, rule)), threads)
            }
        };
        let mut columns = vec!["warp".to_owned(), "weft".to_owned()];
        columns.extend(
            threads
                .iter()
                .filter(|name| *name != "warp" && *name != "weft")
                .cloned(),
        );
        Ok(Self {
            evaluation: Evaluation::Cloth(cloth),
            threads,
            columns,
        })
    }

    /// Another model than the one that components and rules of integration are of.
    fn other(subject: Subject, kind: ModelKind, args: &EvalArgs) -> Result<Self> {
        let name = kind.name();
        let flags = [
            ("--components", args.components),
            ("--evaluator", args.evaluator.is_some()),
        ];
        if let Some((flag, _)) = flags.iter().find(|(_, is_there)| *is_there) {
            let message = format!("{flag} is for --model sadeghi, not {name}");
            return Err(Usage(message).into());
        }
        let mut fabric = fabric_of(subject, args)?;
        if kind == ModelKind::Irawan && fabric.models.irawan.is_none() {
            fabric.models.irawan = Some(irawan_of(&fabric));
        }
        let Some(model) = kind.prepare(&fabric.models)? else {
            let section = name.replace('-', "_");
            bail!(
                "{subject} has no section [{section}]; `sateen fit {name} {subject} -o FILE` writes it into one",
                subject = args.subject
            );
        };
        Ok(Self {
            evaluation: Evaluation::Other(model),
            threads: Vec::new(),
            columns: Vec::new(),
        })
    }

    /// The columns that say where on the cloth a pair is.
    fn place_columns(&self) -> &'static [&'static str] {
        match self.evaluation {
            Evaluation::Pattern(..) => &["u", "v"],
            _ => &[],
        }
    }

    /// Pairs that tables were asked for and not baked for.
    fn misses(&self) -> usize {
        let of = |cloth: &Cloth| match cloth {
            Cloth::Table(table) => table.misses(),
            Cloth::Direct(_) => 0,
        };
        match &self.evaluation {
            Evaluation::Cloth(cloth) => of(cloth),
            Evaluation::Pattern(_, cloths) => cloths.iter().map(of).sum(),
            Evaluation::Other(_) => 0,
        }
    }

    /// What to append for a pair, at a place with the numbers in [`Source::place_columns`].
    fn values(&self, place: &[f64], wi: [f64; 3], wr: [f64; 3], components: bool) -> Vec<f64> {
        let cloth = match &self.evaluation {
            Evaluation::Cloth(cloth) => cloth,
            Evaluation::Pattern(pattern, cloths) => {
                let number = |column: usize| place.get(column).copied().unwrap_or(0.0);
                let place = pattern.at(number(0), number(1));
                let cloth = &cloths[place.material.bake];
                return cloth.eval_cos_with(&place.albedos, wi, wr).to_vec();
            }
            Evaluation::Other(model) => return model.eval_cos(wi, wr).to_vec(),
        };
        let Components { threads, q, rho } = cloth.components(wi, wr);
        let mut values = Vec::new();
        if components {
            for column in &self.columns {
                let index = self.threads.iter().position(|name| name == column);
                let ThreadResponse {
                    response,
                    projection,
                } = index.map_or(ThreadResponse::zero(), |index| threads[index]);
                values.extend([response.surface, response.volume, projection]);
            }
            values.push(q);
        }
        values.extend(rho);
        values
    }
}

/// The fabric itself, or the one that a table was baked from.
fn fabric_of(subject: Subject, args: &EvalArgs) -> Result<Fabric> {
    match subject {
        Subject::Fabric(fabric) => Ok(fabric),
        Subject::Table(table) => Ok(provenance(&table, Path::new(&args.subject))?.1),
        Subject::Pattern(pattern) => bail!("{} is a pattern, not a fabric", pattern.name),
    }
}

pub(crate) fn read_pairs(path: &Path, columns: &[&'static str]) -> Result<PairsFile> {
    let name = path.display().to_string();
    if path == Path::new("-") {
        let stdin = UntilInterrupted(io::stdin().lock());
        return Ok(PairsFile::read_with(stdin, &name, columns)?);
    }
    let file = File::open(path).with_context(|| format!("cannot read the pairs {name}"))?;
    Ok(PairsFile::read_with(
        UntilInterrupted(file),
        &name,
        columns,
    )?)
}

/// A long file that is read until the work is interrupted.
struct UntilInterrupted<R>(R);

impl<R: Read> Read for UntilInterrupted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        go_on().map_err(io::Error::other)?;
        self.0.read(buffer)
    }
}
