//! `sateen eval`

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use anyhow::{Context, Result};
use csv::{StringRecord, WriterBuilder};
use rayon::prelude::*;
use sateen::brdf::{Components, ThreadResponse};
use sateen::metrics::PairsFile;
use sateen::model::{Rule, Sadeghi};
use sateen::progress::{Cancelled, Progress};
use sateen::table::Table;

use crate::Outcome;
use crate::args::{EvalArgs, Evaluator};
use crate::output::{Bar, Output, Usage, go_on, print, say};
use crate::subject::{Subject, provenance};

pub(crate) fn run(args: &EvalArgs) -> Result<Outcome> {
    let subject = Subject::load(&args.subject, args.variant.as_deref())?;
    let source = Source::new(subject, args)?;
    let output = args.output.as_deref().map(Output::prepare).transpose()?;
    let input = read_pairs(&args.pairs)?;
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
        .map(|[wi, wr]| {
            evaluated.advance()?;
            Ok(source.values(*wi, *wr, args.components))
        })
        .collect::<Result<_, Cancelled>>()?;
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
    Table(Box<Table>),
    Direct(Sadeghi<f64>),
}

impl Source {
    fn new(subject: Subject, args: &EvalArgs) -> Result<Self> {
        let (evaluation, threads) = match (subject, args.evaluator) {
            (Subject::Table(table), None | Some(Evaluator::Table)) => {
                let threads = table
                    .threads()
                    .iter()
                    .map(|thread| thread.name().to_owned())
                    .collect();
                (Evaluation::Table(table), threads)
            }
            (Subject::Fabric(_), Some(Evaluator::Table)) => {
                let message = format!(
                    "--evaluator table needs a table, but {} is a fabric; bake it first",
                    args.subject
                );
                return Err(Usage(message).into());
            }
            (subject, evaluator) => {
                let fabric = match subject {
                    Subject::Fabric(fabric) => fabric,
                    Subject::Table(table) => provenance(&table, Path::new(&args.subject))?.1,
                };
                let rule = match evaluator {
                    Some(Evaluator::Direct(rule)) => rule,
                    _ => Rule::REFERENCE,
                };
                let threads: Vec<String> = fabric
                    .visible_threads()
                    .map(|thread| thread.name.clone())
                    .collect();
                (Evaluation::Direct(Sadeghi::new(&fabric, rule)), threads)
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
            evaluation,
            threads,
            columns,
        })
    }

    /// The columns to append.
    fn values(&self, wi: [f64; 3], wr: [f64; 3], components: bool) -> Vec<f64> {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let Components { threads, q, rho } = match &self.evaluation {
            Evaluation::Direct(model) => model.components(wi, wr),
            Evaluation::Table(table) => table.components(single(wi), single(wr)).cast(),
        };
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

fn read_pairs(path: &Path) -> Result<PairsFile> {
    let name = path.display().to_string();
    if path == Path::new("-") {
        return Ok(PairsFile::read(
            UntilInterrupted(io::stdin().lock()),
            &name,
        )?);
    }
    let file = File::open(path).with_context(|| format!("cannot read the pairs {name}"))?;
    Ok(PairsFile::read(UntilInterrupted(file), &name)?)
}

/// A long file that is read until the work is interrupted.
struct UntilInterrupted<R>(R);

impl<R: Read> Read for UntilInterrupted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        go_on().map_err(io::Error::other)?;
        self.0.read(buffer)
    }
}
