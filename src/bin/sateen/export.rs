//! `sateen export`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::value_parser;
use sateen::export::{About, Cost, Export, File, Format};
use sateen::metrics::PairErrors;
use sateen::progress::Progress;
use sateen::volume::{MAX_BYTES, Settings};
use serde_json::json;

use crate::Outcome;
use crate::args::{Draw, LEAST_SIZE, Print, Workers, parse_size_within};
use crate::output::{
    Bar, Output, Usage, bytes, counted, in_memory, print, print_json, use_workers,
};
use crate::subject::{load_table, provenance};

/// Write a table as a texture and parameters for shaders.
///
/// The texture's size, the bytes, and the error of the lookup in it against direct integration are printed. What it holds and how it is
/// read is in the file's metadata: the key `sateen` of KTX2, the attribute `sateen` of EXR, NAME.dds.json or NAME.bin.json beside others.
#[derive(clap::Args)]
pub(crate) struct ExportArgs {
    /// A table that `bake` wrote.
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    /// What to write.
    #[arg(long, value_enum)]
    format: Format,
    /// The file to write, which ends in .ktx2, .dds, .exr or .bin, as the format asks; DDS and raw texels get a NAME.dds.json or NAME.bin.json beside them.
    #[arg(short, long, value_name = "PATH")]
    output: PathBuf,
    /// The most bytes of the volume as RGBA16F, up to 64MiB; rgb9e5 takes half of it, bc6h an eighth.
    #[arg(long, value_name = "N", value_parser = parse_volume_size, default_value = "8MiB")]
    max_bytes: usize,
    /// Leave the texels of a KTX2 file as they are, for readers without zstd.
    #[arg(long)]
    no_supercompression: bool,
    /// How many pairs of directions the error is measured on.
    #[arg(long, value_name = "N", default_value_t = 16_384, value_parser = value_parser!(u32).range(1..=100_000_000))]
    pairs: u32,
    #[command(flatten)]
    draw: Draw,
    #[command(flatten)]
    workers: Workers,
    #[command(flatten)]
    print: Print,
}

fn parse_volume_size(text: &str) -> Result<usize, String> {
    parse_size_within(text, LEAST_SIZE..=MAX_BYTES)
}

pub(crate) fn run(args: &ExportArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    let format = args.format;
    let extension = format.extension();
    if args.output.extension().is_none_or(|end| end != extension) {
        let message = format!(
            "-o {}: files of this format end in .{extension}",
            args.output.display()
        );
        return Err(Usage(message).into());
    }
    if args.no_supercompression && extension != "ktx2" {
        let message = "--no-supercompression is for KTX2 files; others are not compressed by zstd";
        return Err(Usage(message.to_owned()).into());
    }
    let (table, _) = load_table(&args.table)?;
    let (provenance, fabric) = provenance(&table, &args.table)?;
    // Before the work, to find out.
    Output::prepare(&args.output)?.is_none_of([&*args.table])?;

    let mut bar = Bar::new(1);
    bar.begin("measuring", &fabric.name);
    let settings = Settings {
        max_bytes: args.max_bytes,
        ..Settings::default()
    };
    let cannot = || format!("cannot export {}", args.table.display());
    let export = Export::within(&table, &settings, format)
        .with_context(|| format!("--max-bytes {}", args.max_bytes))
        .with_context(cannot)?;
    let report = |share: f64| bar.report(share);
    let cost = export.measure(
        &fabric,
        args.pairs as usize,
        args.draw.seed,
        Progress::new(&report),
    )?;
    let about = About {
        fabric: &fabric.name,
        recorded: &provenance.error,
        measured: &cost,
    };
    let files = export
        .files(&about, !args.no_supercompression)
        .with_context(cannot)?;
    drop(bar);
    let paths = write(&args.output, &files)?;
    if args.print.json {
        let written = paths.iter().zip(&files);
        let json = json!({
            "format": format.name(),
            "pixels": format.pixels().name(),
            "size": export.size(),
            "texel_bytes": export.texels().len(),
            "files": written
                .map(|(path, file)| json!({ "path": path, "bytes": file.bytes.len() }))
                .collect::<Vec<_>>(),
            "error": cost,
        });
        print_json("export", json)?;
    } else {
        print(&text(&args.output, &export, format, &files, &cost))?;
    }
    Ok(Outcome::Done)
}

/// Metadata first: whoever sees the texels has them.
fn write(path: &Path, files: &[File]) -> Result<Vec<PathBuf>> {
    let paths: Vec<PathBuf> = files
        .iter()
        .map(|file| path.with_extension(file.extension))
        .collect();
    for (path, file) in paths.iter().zip(files).rev() {
        Output::prepare(path)?.write(&file.bytes)?;
    }
    Ok(paths)
}

fn text(path: &Path, export: &Export<'_>, format: Format, files: &[File], cost: &Cost) -> String {
    let [width, height, depth] = export.size();
    let file_bytes = files.iter().map(|file| file.bytes.len()).sum();
    let mut text = format!(
        "{}: {width} × {height} × {depth} texels of {}, {}, {} in {}, {}\n",
        path.display(),
        format.pixels().name(),
        in_memory(export.texels().len()),
        bytes(file_bytes),
        if files.len() == 1 {
            "the file"
        } else {
            "the files"
        },
        counted(export.parameters().len(), "parameter"),
    );
    text += "  relative error       mean        p99  grazing p99      rim p99\n";
    for (name, errors) in [("table", &cost.table), ("exported", &cost.exported)] {
        let PairErrors {
            all, grazing, rim, ..
        } = errors;
        let percent = |x: f64| format!("{:.3} %", 100.0 * x);
        text += &format!(
            "    {name:<12} {:>10} {:>10} {:>12} {:>12}\n",
            percent(all.mean),
            percent(all.p99),
            percent(grazing.p99),
            percent(rim.p99)
        );
    }
    text + &format!(
        "  against direct integration on {} pairs of directions, seed {}, with filters of 8 bits as hardware has them\n",
        cost.table.all.pairs, cost.seed
    )
}
