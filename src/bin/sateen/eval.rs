//! `sateen eval`

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use csv::{StringRecord, WriterBuilder};
use rayon::prelude::*;
use sateen::brdf::ThreadResponse;
use sateen::evaluator::{Cloth, Missing, Spec};
use sateen::metrics::PairsFile;
use sateen::model::Rule;
use sateen::progress::{Cancelled, Progress};

use crate::Outcome;
use crate::args::{Dye, Strict, Workers};
use crate::cloth::WayArgs;
use crate::output::{Bar, Output, Usage, counted, go_on, print, say, use_workers};
use crate::subject::{Subject, What};

/// Evaluate pairs of directions.
///
/// Reads CSV with the columns wi_x, wi_y, wi_z (to the light) and wr_x, wr_y, wr_z (to the viewer) in the surface frame: x
/// warp, y weft, z normal. Appends rho_r, rho_g, rho_b: BRDF × cosine, 1/sr, linear RGB. Other columns pass through.
#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    /// A table, a name from the library, or the TOML file of a fabric or a pattern.
    #[arg(value_name = "TABLE|FABRIC|PATTERN")]
    subject: String,
    /// The CSV file of pairs, or - for stdin. For a pattern it also has the columns u and v.
    #[arg(long, value_name = "CSV")]
    pairs: PathBuf,
    /// The CSV file to write [default: stdout].
    #[arg(short, long, value_name = "CSV")]
    output: Option<PathBuf>,
    #[command(flatten)]
    way: WayArgs,
    /// Also append S, V and P of every thread, and Q.
    #[arg(long)]
    components: bool,
    #[command(flatten)]
    strict: Strict,
    #[command(flatten)]
    dye: Dye,
}

pub(crate) fn run(args: &EvalArgs) -> Result<Outcome> {
    use_workers(&Workers { jobs: None })?;
    let subject = Subject::load(&args.subject, args.dye.variant.as_deref())?;
    let source = Source::new(&subject, args)?;
    let output = args
        .output
        .as_deref()
        .filter(|path| *path != Path::new("-"));
    let output = output.map(Output::prepare).transpose()?;
    if let Some(output) = &output {
        output.is_none_of([&*args.pairs, Path::new(&args.subject)])?;
    }
    let input = read_pairs(&args.pairs, source.place_columns())?;
    if input.not_unit() > 0 {
        say(&format!(
            "normalized {} not of unit length",
            counted(input.not_unit(), "direction")
        ));
    }

    if input.below() > 0 {
        say(&format!(
            "{} of {} pairs have a direction below the surface, where ρ is 0; wi points to the light, wr to the viewer, both from the surface",
            input.below(),
            input.directions().len()
        ));
    }

    let mut writer = WriterBuilder::new().from_writer(Vec::new());
    let mut header: StringRecord = input.header().collect();
    if let Some(threads) = &source.components {
        for name in &threads.columns {
            for quantity in ["S", "V", "P"] {
                header.push_field(&format!("{quantity}_{name}"));
            }
        }
        header.push_field("Q");
    }
    for channel in ["rho_r", "rho_g", "rho_b"] {
        header.push_field(channel);
    }
    let appended = || header.iter().skip(input.header().len());
    if let Some(name) = appended().find(|name| input.header().any(|old| old.trim() == *name)) {
        say(&format!(
            "{} has a column {name} already, as what eval wrote has; the last one of that name is new",
            args.pairs.display()
        ));
    }
    writer.write_record(&header)?;
    let mut bar = Bar::new(1);
    bar.begin("evaluating", &args.subject);
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
            Ok(source.values(place, *wi, *wr))
        })
        .collect::<Result<_, Cancelled>>()?;
    let misses = source.cloth.misses();
    if misses > 0 {
        let what = format!("{misses} of {} pairs were not baked", values.len());
        if args.strict.strict {
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

/// What is evaluated.
struct Source {
    cloth: Cloth<f64>,
    /// If components are written.
    components: Option<Threads>,
}

struct Threads {
    /// The visible threads' names, in order.
    names: Vec<String>,
    /// The threads that components are written of: warp and weft in any case.
    columns: Vec<String>,
}

impl Source {
    fn new(subject: &Subject, args: &EvalArgs) -> Result<Self> {
        let spec = args.way.spec(subject, Rule::REFERENCE)?;
        let cloth = args.way.cloth(subject, &spec, Missing::Nearest)?;
        let components = args
            .components
            .then(|| Threads::of(subject, &spec))
            .transpose()?;
        Ok(Self { cloth, components })
    }

    /// The columns that say where on the cloth a pair is.
    fn place_columns(&self) -> &'static [&'static str] {
        if self.cloth.is_pattern() {
            &["u", "v"]
        } else {
            &[]
        }
    }

    /// What to append for a pair, at a place with the numbers in [`Source::place_columns`].
    fn values(&self, place: &[f64], wi: [f64; 3], wr: [f64; 3]) -> Vec<f64> {
        let components = self.components.as_ref().and_then(|threads| {
            let evaluator = self.cloth.evaluators().first()?;
            Some((threads, evaluator.components(wi, wr)?))
        });
        let Some((threads, components)) = components else {
            let number = |column: usize| place.get(column).copied().unwrap_or(0.0);
            let place = [number(0), number(1)];
            return self.cloth.eval_cos(place, wi, wr).to_vec();
        };
        let mut values = Vec::new();
        for column in &threads.columns {
            let index = threads.names.iter().position(|name| name == column);
            let ThreadResponse {
                response,
                projection,
            } = index.map_or(ThreadResponse::zero(), |index| components.threads[index]);
            values.extend([response.surface, response.volume, projection]);
        }
        values.push(components.q);
        values.extend(components.rho);
        values
    }
}

impl Threads {
    fn of(subject: &Subject, spec: &Spec) -> Result<Self> {
        let names: Vec<String> = match (&subject.what, spec) {
            (What::Pattern(_), _) => {
                let message = "--components is for one fabric; a pattern's materials have threads of their own";
                return Err(Usage(message.to_owned()).into());
            }
            (_, Spec::Model(kind)) => {
                let name = kind.name();
                let message = format!("--components is for --model sadeghi, not {name}");
                return Err(Usage(message).into());
            }
            (What::Table(table), Spec::Table) => {
                let threads = table.threads().iter();
                threads.map(|thread| thread.name().to_owned()).collect()
            }
            _ => {
                let fabric = subject.fabric()?;
                let threads = fabric.visible_threads();
                threads.map(|thread| thread.name.clone()).collect()
            }
        };
        let mut columns = vec!["warp".to_owned(), "weft".to_owned()];
        let others = names.iter().filter(|name| !columns.contains(name));
        let others: Vec<String> = others.cloned().collect();
        columns.extend(others);
        Ok(Self { names, columns })
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
