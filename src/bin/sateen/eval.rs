//! `sateen eval`

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use anyhow::{Context, Result, bail};
use csv::{ReaderBuilder, StringRecord, WriterBuilder};
use rayon::prelude::*;
use sateen::brdf::{Components, ThreadResponse};
use sateen::math::normalized;
use sateen::model::{Rule, Sadeghi};
use sateen::table::Table;

use crate::Outcome;
use crate::args::{EvalArgs, Evaluator};
use crate::output::{Output, Usage, print, say};
use crate::subject::{Subject, provenance};

const COLUMNS: [&str; 6] = ["wi_x", "wi_y", "wi_z", "wr_x", "wr_y", "wr_z"];
/// Directions further from unit length than this are worth a word.
const UNIT_TOLERANCE: f64 = 1e-3;

pub(crate) fn run(args: &EvalArgs) -> Result<Outcome> {
    let subject = Subject::load(&args.subject, args.variant.as_deref())?;
    let source = Source::new(subject, args)?;
    let output = args.output.as_deref().map(Output::prepare).transpose()?;
    let input = read_pairs(&args.pairs)?;
    if input.not_unit > 0 {
        say(&format!(
            "{} directions were not of unit length and have been normalized",
            input.not_unit
        ));
    }

    let mut writer = WriterBuilder::new().from_writer(Vec::new());
    let mut header = input.header.clone();
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
    let values: Vec<Vec<f64>> = input
        .rows
        .par_iter()
        .map(|row| source.values(row.wi, row.wr, args.components))
        .collect();
    for (row, values) in input.rows.iter().zip(values) {
        let mut record = row.record.clone();
        for value in values {
            // As short as it can be and still be read back exactly.
            record.push_field(&format!("{value:?}"));
        }
        writer.write_record(&record)?;
    }
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

/// A CSV file of pairs.
struct Pairs {
    header: StringRecord,
    rows: Vec<Row>,
    not_unit: usize,
}

struct Row {
    record: StringRecord,
    wi: [f64; 3],
    wr: [f64; 3],
}

fn read_pairs(path: &Path) -> Result<Pairs> {
    let cannot = || format!("cannot read the pairs {}", path.display());
    let input: Box<dyn Read> = if path == Path::new("-") {
        Box::new(io::stdin().lock())
    } else {
        Box::new(File::open(path).with_context(cannot)?)
    };
    let mut reader = ReaderBuilder::new().from_reader(input);
    let header = reader.headers().with_context(cannot)?.clone();
    let places_of = |name: &str| {
        let places = header
            .iter()
            .enumerate()
            .filter(|(_, column)| column.trim() == name);
        places.map(|(place, _)| place).collect::<Vec<usize>>()
    };
    let missing: Vec<&str> = COLUMNS
        .into_iter()
        .filter(|name| places_of(name).is_empty())
        .collect();
    if !missing.is_empty() {
        bail!(
            "{}: the columns {} are missing from its first line",
            path.display(),
            missing.join(", ")
        );
    }
    if let Some(twice) = COLUMNS.into_iter().find(|name| places_of(name).len() > 1) {
        bail!("{}: there are several columns {twice}", path.display());
    }
    let places = COLUMNS.map(|name| places_of(name)[0]);

    let (mut rows, mut not_unit) = (Vec::new(), 0);
    for record in reader.records() {
        let record = record.with_context(cannot)?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut numbers = [0.0; 6];
        for ((number, place), name) in numbers.iter_mut().zip(places).zip(COLUMNS) {
            let text = record.get(place).unwrap_or_default().trim();
            *number = match text.parse::<f64>() {
                Ok(number) if number.is_finite() => number,
                _ => bail!(
                    "{}:{line}: {name} is \"{text}\", but must be a finite number",
                    path.display()
                ),
            };
        }
        let mut unit = |name: &str, w: [f64; 3]| {
            let Some(direction) = normalized(w) else {
                bail!(
                    "{}:{line}: {name} is the zero vector, which has no direction",
                    path.display()
                );
            };
            let difference = (0..3)
                .map(|k| (direction[k] - w[k]).abs())
                .fold(0.0, f64::max);
            not_unit += usize::from(difference > UNIT_TOLERANCE);
            Ok(direction)
        };
        let [a, b, c, d, e, f] = numbers;
        let (wi, wr) = (unit("wi", [a, b, c])?, unit("wr", [d, e, f])?);
        rows.push(Row { record, wi, wr });
    }
    Ok(Pairs {
        header,
        rows,
        not_unit,
    })
}
