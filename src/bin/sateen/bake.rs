//! `sateen bake`

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::ValueEnum;
use sateen::bake::{
    Baked, Budget, Direct, For, Goal, Preset, Promise, Provenance, Request, Scope, Settings, bake,
};
use sateen::chart::Chart;
use sateen::fabric::{Fabric, LIBRARY, Thread};
use sateen::metrics::conserving;
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::scene::Albedo;
use sateen::table::Table;
use sateen::text::read_ordinary;
use serde_json::{Value, json};

use crate::Outcome;
use crate::args::{Dye, Print, Workers, parse_error, parse_size};
use crate::info::scope_text;
use crate::manifest::{self, Head, Manifest, Row};
use crate::output::{
    Bar, Output, Usage, adapted_line, bytes, choice_lines, counted, error_lines, go_on, in_memory,
    print, print_json, say, sizes, use_workers, ways,
};
use crate::record::load_needs;
use crate::scene::load_scene;
use crate::shard::{List, Shard, parse_shard, sha256, sha256_of};
use crate::subject::{MAX_TABLE_BYTES, load_fabrics, load_table, provenance, read};

/// Bake fabrics into tables and print the size and the error of each.
#[derive(clap::Args)]
pub(crate) struct BakeArgs {
    /// Names from the library, or TOML files of fabrics; or of patterns, which are baked as the fabrics that they need.
    #[arg(value_name = "FABRIC|PATTERN", required_unless_present_any = ["all", "scene", "list"])]
    fabrics: Vec<String>,
    /// Bake the whole library.
    #[arg(long, conflicts_with = "fabrics")]
    all: bool,
    /// Bake what a scene needs: its fabrics, and of these the pairs of directions that its cameras and lights can ask for. A
    /// TOML, glTF or GLB file; `sateen scene` tells what it needs.
    #[arg(long, value_name = "SCENE", conflicts_with_all = ["fabrics", "all", "needs", "albedo", "variant"])]
    scene: Option<PathBuf>,
    /// Bake what a file lists: library names and TOML files of fabrics and patterns, one a line, `-` for stdin. Paths begin at the
    /// list's folder. The tables get a manifest beside them: docs/cluster.md.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fabrics", "all", "scene", "variant", "max_error", "max_bytes", "max_ns"])]
    list: Option<PathBuf>,
    /// Bake only one of N shards of the list, the first is 1/N. A fabric's parameters decide which it is in, not its place.
    #[arg(long, value_name = "I/N", value_parser = parse_shard)]
    shard: Option<Shard>,
    /// Bake only the pairs that were recorded; several recordings are joined.
    #[arg(long, value_name = "FILE")]
    needs: Vec<PathBuf>,
    /// Whether albedos change at run time; fixed grey albedos need only half the bytes.
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Albedo::Varies)]
    albedo: Albedo,
    /// The file to write, or the folder for several [default: NAME.sateen in the current folder].
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Write files that are not compressed and twice as large: programs map them into memory and look values up in place.
    #[arg(long, conflicts_with = "resume")]
    stored: bool,
    /// Keep tables that are there already, if they are whole and made from the same fabric with the same settings by the same
    /// version; bake only the others.
    #[arg(long, conflicts_with_all = ["max_error", "max_bytes", "max_ns"])]
    resume: bool,
    /// How large and how accurate.
    #[arg(long, value_enum, default_value_t = Preset::Standard)]
    preset: Preset,
    /// The most mean relative error (0.01 or 1%). The cheapest table that keeps this and the other limits is baked; if there is
    /// none, nothing is written and the exit status is 3.
    #[arg(long, value_name = "E", value_parser = parse_error, conflicts_with = "preset")]
    max_error: Option<f64>,
    /// The most bytes in memory, such as 64KiB or 4MiB.
    #[arg(long, value_name = "N", value_parser = parse_size, conflicts_with = "preset")]
    max_bytes: Option<usize>,
    /// The most time per pair in nanoseconds, measured in batches on one core of this machine.
    #[arg(long, value_name = "T", value_parser = parse_nanoseconds, conflicts_with = "preset")]
    max_ns: Option<f64>,
    /// The four coordinates of the table [default: for each thread those with less error].
    #[arg(long, value_enum)]
    chart: Option<Chart>,
    /// Whether ρ is scaled where the fabric would reflect more than arrives, as several published fits do.
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Energy::AsIs)]
    energy: Energy,
    /// Leave out what path tracers draw directions by, some 15 kB a thread. A table of some pairs never has it.
    #[arg(long)]
    no_sampling: bool,
    /// When threads are evaluated directly instead of from a grid [default: worthwhile; with limits, where it is cheaper]. Direct
    /// threads are fast in batches; single pairs are faster from grids.
    #[arg(long, value_enum, value_name = "WHEN", conflicts_with_all = ["max_error", "max_ns"])]
    direct: Option<Direct>,
    /// What the table is made for: one pair at a time, what is evaluated directly is dear beside a grid.
    #[arg(long = "for", value_enum, value_name = "USE", default_value_t = For::Batch)]
    made_for: For,
    /// Print why each thread is evaluated as it is, and all that is known of the error.
    #[arg(short, long, conflicts_with = "json")]
    verbose: bool,
    #[command(flatten)]
    dye: Dye,
    #[command(flatten)]
    workers: Workers,
    #[command(flatten)]
    print: Print,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Energy {
    /// Off: the published values are baked.
    AsIs,
    /// On: by one factor, where it is needed; the table records it.
    Clamp,
    /// On: for each view that more would be reflected to than arrives, when it is looked up; the table records it, and other views stay as
    /// bright as they are.
    PerView,
}

fn parse_nanoseconds(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(ns) if ns > 0.0 && ns.is_finite() => Ok(ns),
        _ => Err("it is a number of nanoseconds above 0".to_owned()),
    }
}

pub(crate) fn run(args: &BakeArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    if let Some(list) = &args.list {
        return run_list(args, list);
    }
    // clap forgets what is required where that conflicts with something else.
    if args.shard.is_some() {
        let message = "--shard is a part of a list: name the list with --list FILE";
        return Err(Usage(message.to_owned()).into());
    }
    let mut jobs = match &args.scene {
        Some(path) => jobs_of_scene(path)?,
        None => jobs_of_fabrics(args)?,
    };
    if args.energy == Energy::Clamp {
        for job in &mut jobs {
            go_on()?;
            job.fabric = conserving(&job.fabric)?;
        }
    }
    for job in &jobs {
        doubt(&job.fabric);
    }
    let paths = output_paths(&jobs, args)?;
    let settings = settings(args);
    // Outputs are tried before any work begins.
    let targets: Vec<Target> = jobs
        .iter()
        .zip(&paths)
        .map(|(job, path)| Target::of(job, path, &settings, args.resume))
        .collect::<Result<_>>()?;

    let mut run = Run::new(args, settings, jobs.len());
    for ((job, path), target) in jobs.iter().zip(&paths).zip(&targets) {
        run.bar.begin("baking", &job.fabric.name);
        match target {
            Target::Open(output) => {
                run.bake(job, path, output)?;
            }
            Target::Kept(kept) => {
                let kept_because = "it is whole, of the same fabric and settings";
                run.bar
                    .suspend(|| say(&format!("{} is kept: {kept_because}", path.display())));
                run.results.push(kept.json(&job.fabric, path));
            }
        }
    }
    run.end()
}

/// One table after the other, each with its line in the manifest.
fn run_list(args: &BakeArgs, path: &Path) -> Result<Outcome> {
    let list = List::read(path)?;
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let needs = needs(args)?;
    let mut jobs = Vec::new();
    let census = list.fabrics(|listed| {
        if listed.is_in(shard) {
            jobs.push((
                Job::new(listed.fabric, needs.clone(), args),
                listed.parameters,
            ));
        }
    })?;
    let (Place::Folder(folder) | Place::File(folder)) = place(args, false)?;
    let settings = settings(args);
    let scope = Scope {
        needs: needs.as_deref(),
        fixed_albedo: args.albedo == Albedo::Fixed,
    };
    let is_clamped = args.energy == Energy::Clamp;
    // All that a table depends on, but for the fabric and the tool.
    let how = sha256_of(&(&settings, scope.note(), is_clamped, args.stored));
    let names: HashSet<&str> = jobs
        .iter()
        .map(|(job, _)| job.fabric.name.as_str())
        .collect();
    let head = Head::new(shard, &census.list, census.fabrics);
    let wanted = |name: &str| args.resume && names.contains(name);
    let (mut manifest, known) = Manifest::begin(folder, shard, &head, args.resume, wanted)?;

    let (count, mut kept, mut beyond) = (jobs.len(), 0, 0);
    let mut run = Run::new(args, settings, count);
    for (mut job, parameters) in jobs {
        go_on()?;
        let name = job.fabric.name.clone();
        let path = folder.join(file_name(&job.fabric));
        run.bar.begin("baking", &name);
        let is_of_this = |row: &&Row| {
            row.tool == sateen::TOOL && row.parameters == parameters && row.settings == how
        };
        let known: Vec<&Row> = known.of(&name).iter().filter(is_of_this).collect();
        let found = if known.is_empty() {
            None
        } else {
            read_ordinary(&path, MAX_TABLE_BYTES)
                .ok()
                .map(|file| sha256(&file))
        };
        let is_known = found.is_some() && known.iter().any(|row| row.sha256 == found);
        // With --json it is read as well, to tell of it.
        if is_known && !args.print.json {
            kept += 1;
            continue;
        }
        if known.iter().any(|row| row.sha256.is_none()) {
            say(&format!(
                "{name} is not baked again: no table keeps the promise of {}",
                args.preset.name()
            ));
            beyond += 1;
            continue;
        }
        if is_clamped {
            job.fabric = conserving(&job.fabric)?;
        }
        let row = |provenance: &Provenance, file: Option<&[u8]>, seconds| Row {
            name: name.clone(),
            sha256: file.map(sha256),
            bytes: file.map(<[u8]>::len),
            preset: args.preset,
            error: manifest::Error::of(&provenance.error),
            seconds,
            tool: sateen::TOOL.to_owned(),
            parameters: parameters.clone(),
            settings: how.clone(),
        };
        let found = if args.resume {
            Kept::find(&job, &path, &run.settings)
        } else {
            None
        };
        if let Some(found) = found {
            // It was written, and its line in the manifest was not.
            if !is_known {
                let file = read(&path, MAX_TABLE_BYTES)?;
                manifest.append(&row(&found.provenance, Some(&file), None))?;
            }
            run.results.push(found.json(&job.fabric, &path));
            kept += 1;
            continue;
        }
        doubt(&job.fabric);
        let output = Output::in_folder(&path)?;
        let what_to_do = "tables that are done stay; run again with --resume for the others";
        let made = run.bake(&job, &path, &output).context(what_to_do)?;
        beyond += usize::from(made.file.is_none());
        let line = row(&made.provenance, made.file.as_deref(), Some(made.seconds));
        manifest.append(&line).context(what_to_do)?;
    }
    if beyond > 0 {
        run.outcome = Outcome::OutOfTolerance;
    }
    let outcome = run.end()?;
    say(&format!(
        "{}: shard {shard} has {count} of {}: {} baked, {kept} kept, {beyond} without a table that keeps the promise",
        list.name,
        counted(census.fabrics, "fabric"),
        count - kept - beyond
    ));
    census.check(&list)?;
    Ok(outcome)
}

/// Bakes one table after the other, and tells of each.
struct Run<'a> {
    args: &'a BakeArgs,
    settings: Settings,
    bar: Bar,
    /// As JSON.
    results: Vec<Value>,
    outcome: Outcome,
}

/// What a bake made.
struct Made {
    provenance: Provenance,
    /// What was written, if it is within the limits.
    file: Option<Vec<u8>>,
    seconds: f64,
}

impl<'a> Run<'a> {
    fn new(args: &'a BakeArgs, settings: Settings, count: usize) -> Self {
        Self {
            args,
            settings,
            bar: Bar::new(count),
            results: Vec::new(),
            outcome: Outcome::Done,
        }
    }

    fn bake(&mut self, job: &Job, path: &Path, output: &Output) -> Result<Made> {
        let (args, fabric) = (self.args, &job.fabric);
        let budget = Budget {
            max_error: args.max_error.or(job.max_error),
            max_bytes: args.max_bytes,
            max_ns: args.max_ns,
        };
        let is_limited = budget != Budget::default();
        let start = Instant::now();
        let report = |share: f64| self.bar.report(share);
        let interrupted = || format!("{} was not written", path.display());
        let progress = Progress::new(&report);
        let request = Request {
            settings: self.settings.clone(),
            goal: if is_limited {
                Goal::Within(budget)
            } else {
                Goal::Promise
            },
            scope: job.scope(),
        };
        let Baked {
            table,
            provenance,
            within,
            cost,
        } = bake(fabric, request, progress).with_context(interrupted)?;
        let mut written = None;
        if within {
            let file = if args.stored {
                table.to_mappable_bytes()
            } else {
                table.to_bytes().with_context(interrupted)?
            };
            // Its own reader has the last word: nothing is written that cannot be loaded.
            Table::from_bytes(&file).with_context(interrupted)?;
            self.bar.suspend(|| {
                output.write(&file)?;
                doubt_energy(fabric, &provenance);
                Ok::<(), anyhow::Error>(())
            })?;
            written = Some(file);
        } else {
            self.outcome = Outcome::OutOfTolerance;
        }
        let file_bytes = written.as_ref().map(Vec::len);
        let seconds = start.elapsed().as_secs_f64();
        if args.print.json {
            self.results.push(json!({
                "fabric": fabric.name,
                "path": file_bytes.map(|_| path),
                "kept": false,
                "within": within,
                "adapted": provenance.adapted,
                "rho_scale": fabric.rho_scale,
                "scope": provenance.scope,
                "decoded_bytes": table.decoded_bytes(),
                "file_bytes": file_bytes,
                "ns": cost.ns,
                "seconds": seconds,
                "error": provenance.error,
                "choices": provenance.choices,
            }));
        } else {
            let sizes = match file_bytes {
                Some(file_bytes) => sizes(table.decoded_bytes(), file_bytes),
                None => format!(
                    "not written, nothing {}; the nearest: {}",
                    if is_limited {
                        "keeps the limits".to_owned()
                    } else {
                        not_promised(&self.settings)
                    },
                    in_memory(table.decoded_bytes())
                ),
            };
            let ns = cost
                .ns
                .map_or(String::new(), |ns| format!(", {ns:.0} ns per pair"));
            let all = &provenance.error.all;
            let mut text = format!(
                "{}: {sizes}, error {:.3} % on average and {:.2} % at the 99th percentile, {}{ns}, {seconds:.1} s\n{}{}",
                path.display(),
                100.0 * all.mean,
                100.0 * all.p99,
                ways(&table),
                scale_line(fabric),
                adapted_line(provenance.adapted),
            );
            if args.verbose {
                text += &scope_text(provenance.scope.as_ref());
                text += &choice_lines(&provenance.choices);
                text += &error_lines(&provenance.error);
            }
            self.bar.suspend(|| print(&text))?;
        }
        Ok(Made {
            provenance,
            file: written,
            seconds,
        })
    }

    fn end(self) -> Result<Outcome> {
        if self.args.print.json {
            print_json("bake", json!({ "tables": self.results }))?;
        }
        Ok(self.outcome)
    }
}

/// A table to bake.
struct Job {
    fabric: Fabric,
    /// The pairs that are needed, if not all.
    needs: Option<Arc<Needs>>,
    fixed_albedo: bool,
    /// Whether a pattern needs it.
    is_of_pattern: bool,
    /// What a scene allows.
    max_error: Option<f64>,
}

impl Job {
    /// One that no scene asks for.
    fn new(fabric: Fabric, needs: Option<Arc<Needs>>, args: &BakeArgs) -> Self {
        Self {
            fabric,
            needs,
            fixed_albedo: args.albedo == Albedo::Fixed,
            is_of_pattern: false,
            max_error: None,
        }
    }

    fn scope(&self) -> Scope<'_> {
        Scope {
            needs: self.needs.as_deref(),
            fixed_albedo: self.fixed_albedo,
        }
    }
}

fn jobs_of_fabrics(args: &BakeArgs) -> Result<Vec<Job>> {
    let mut fabrics: Vec<(Fabric, bool)> = Vec::new();
    if args.all {
        fabrics.extend(LIBRARY.iter().map(|entry| (entry.load(), false)));
    }
    for name in &args.fabrics {
        let (loaded, is_pattern) = load_fabrics(name, args.dye.variant.as_deref())?;
        fabrics.extend(loaded.into_iter().map(|fabric| (fabric, is_pattern)));
    }
    let needs = needs(args)?;
    let job = |(fabric, is_of_pattern)| Job {
        is_of_pattern,
        ..Job::new(fabric, needs.clone(), args)
    };
    Ok(fabrics.into_iter().map(job).collect())
}

/// What recordings ask for, if there are any.
fn needs(args: &BakeArgs) -> Result<Option<Arc<Needs>>> {
    let mut needs: Option<Needs> = None;
    for path in &args.needs {
        needs
            .get_or_insert_with(Needs::none)
            .join(&load_needs(path)?);
    }
    Ok(needs.map(Arc::new))
}

/// Fabrics that are on no mesh, or never seen and lit, are left out.
fn jobs_of_scene(path: &Path) -> Result<Vec<Job>> {
    let scene = load_scene(path)?;
    let mut bar = Bar::new(1);
    bar.begin("analysing", &scene.name);
    let report = |share: f64| bar.report(share);
    let mut needs = scene.needs(Progress::new(&report))?;
    drop(bar);
    let mut jobs = Vec::new();
    for (name, used) in scene.fabrics() {
        let needs = needs.remove(&name).unwrap_or_else(Needs::none);
        if needs.is_empty() {
            say(&format!(
                "{name} is left out: no light and camera ever see it"
            ));
            continue;
        }
        jobs.push(Job {
            fabric: used.fabric,
            needs: Some(Arc::new(needs)),
            fixed_albedo: used.albedo == Albedo::Fixed,
            is_of_pattern: false,
            max_error: used.max_error,
        });
    }
    Ok(jobs)
}

/// Says what of a fabric's parameters is allowed, but seldom meant.
fn doubt(fabric: &Fabric) {
    for thread in &fabric.threads {
        let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
        if brightest > 1.0 {
            say(&format!(
                "{}: the albedo of {} is up to {brightest}; above 1 more comes out of a thread than went in; is it of 255 or of 100?",
                fabric.name, thread.name
            ));
        }
    }
    // π/4 and its multiples, as people round them.
    for thread in &fabric.threads {
        let degrees = thread.direction().to_degrees();
        let eighths = degrees / std::f64::consts::FRAC_PI_4;
        let is_one = (1.0..=8.0).contains(&eighths.abs().round());
        if is_one && (eighths - eighths.round()).abs() < 3e-3 {
            say(&format!(
                "{}: the direction of {} is {degrees:.4}°; direction_deg is degrees, not radians",
                fabric.name, thread.name
            ));
        }
    }
    // What is in radians is less than 1.6.
    let widths = |thread: &Thread| [thread.optics.gamma_s, thread.optics.gamma_v];
    let widest = fabric.threads.iter().flat_map(widths).fold(0.0, f64::max);
    if widest < 1f64.to_radians() {
        say(&format!(
            "{}: no lobe is wider than {:.3}°; gamma_s_deg and gamma_v_deg are degrees, not radians",
            fabric.name,
            widest.to_degrees()
        ));
    }
}

/// Says that more is reflected than arrives, if so.
fn doubt_energy(fabric: &Fabric, provenance: &Provenance) {
    let brightest = provenance
        .error
        .bias
        .iter()
        .max_by(|a, b| a.reflectance.total_cmp(&b.reflectance));
    if let Some(view) = brightest.filter(|view| view.reflectance > 1.0) {
        say(&format!(
            "{} reflects {:.2} times what arrives, seen at {}°; --energy clamp scales it",
            fabric.name, view.reflectance, view.view_deg
        ));
    }
}

/// Says that ρ is scaled, if it is.
fn scale_line(fabric: &Fabric) -> String {
    if fabric.rho_scale < 1.0 {
        format!("  scaled by {} (rho_scale)\n", fabric.rho_scale)
    } else {
        String::new()
    }
}

/// What a table that is not written misses, and what to do.
fn not_promised(settings: &Settings) -> String {
    let Promise { mean, p99 } = settings.preset.promise();
    format!(
        "keeps the preset's {} % of mean error and {} % of the 99th percentile, though grids of {} and direct evaluation were \
         tried (--max-error takes what can be reached)",
        100.0 * mean,
        100.0 * p99,
        bytes(4 * settings.max_bytes)
    )
}

/// What a fabric becomes.
enum Target {
    /// A table, to be written here.
    Open(Output),
    /// What is there already.
    Kept(Box<Kept>),
}

impl Target {
    fn of(job: &Job, path: &Path, settings: &Settings, resume: bool) -> Result<Self> {
        let kept = if resume {
            Kept::find(job, path, settings)
        } else {
            None
        };
        kept.map_or_else(
            || Output::prepare(path).map(Self::Open),
            |kept| Ok(Self::Kept(Box::new(kept))),
        )
    }
}

/// A whole table that an earlier run made of the same.
struct Kept {
    decoded_bytes: usize,
    file_bytes: usize,
    provenance: Provenance,
}

impl Kept {
    /// Whatever else is at `path`, or nothing, is no reason to stop: it is baked again.
    fn find(job: &Job, path: &Path, settings: &Settings) -> Option<Self> {
        // What is in a pipe can be read only once, and is not for a bake.
        if !path.is_file() {
            return None;
        }
        let (table, file_bytes) = load_table(path).ok()?;
        let (provenance, _) = provenance(&table, path).ok()?;
        let is_it = provenance.is_of(&job.fabric, settings, &job.scope());
        is_it.then(|| Self {
            decoded_bytes: table.decoded_bytes(),
            file_bytes,
            provenance,
        })
    }

    fn json(&self, fabric: &Fabric, path: &Path) -> Value {
        json!({
            "fabric": fabric.name,
            "path": path,
            "kept": true,
            "within": true,
            "adapted": self.provenance.adapted,
            "rho_scale": fabric.rho_scale,
            "decoded_bytes": self.decoded_bytes,
            "file_bytes": self.file_bytes,
            "ns": null,
            "seconds": null,
            "error": self.provenance.error,
            "choices": self.provenance.choices,
        })
    }
}

fn settings(args: &BakeArgs) -> Settings {
    let mut settings = args.preset.settings();
    settings.chart = args.chart;
    settings.direct = args.direct.unwrap_or(settings.direct);
    settings.made_for = args.made_for;
    settings.sampling = !args.no_sampling;
    settings.energy = match args.energy {
        Energy::AsIs | Energy::Clamp => sateen::table::Energy::AsIs,
        Energy::PerView => sateen::table::Energy::PerView,
    };
    settings
}

fn file_name(fabric: &Fabric) -> String {
    format!("{}.sateen", fabric.name)
}

/// One file per fabric: `output` itself for one, files in the folder `output` for several, and for those of scenes and patterns,
/// however many these need.
fn output_paths(jobs: &[Job], args: &BakeArgs) -> Result<Vec<PathBuf>> {
    let is_one = jobs.len() == 1 && args.scene.is_none() && !jobs[0].is_of_pattern;
    let folder = match place(args, is_one)? {
        Place::File(path) => return Ok(vec![path.to_owned()]),
        Place::Folder(folder) => folder,
    };
    let mut names: HashSet<&str> = HashSet::new();
    let mut paths: Vec<PathBuf> = Vec::new();
    for Job { fabric, .. } in jobs {
        let path = folder.join(file_name(fabric));
        if !names.insert(&fabric.name) {
            let message = format!(
                "two fabrics are called {}, and both would be {}",
                fabric.name,
                path.display()
            );
            return Err(Usage(message).into());
        }
        paths.push(path);
    }
    Ok(paths)
}

/// Where tables go.
enum Place<'a> {
    File(&'a Path),
    Folder(&'a Path),
}

/// What `--output` names.
fn place(args: &BakeArgs, is_one: bool) -> Result<Place<'_>> {
    let Some(path) = args.output.as_deref() else {
        return Ok(Place::Folder(Path::new("")));
    };
    // Looked at once: another bake may be making the folder.
    let found = path.metadata().ok();
    let is_folder = found.as_ref().is_some_and(|found| found.is_dir());
    if is_folder || path.as_os_str().to_string_lossy().ends_with('/') {
        return Ok(Place::Folder(path));
    }
    let end = path.extension();
    if is_one {
        let is_device = found.is_some_and(|found| !found.is_file());
        if end.is_some_and(|end| end != "sateen") && !is_device {
            let message = format!(
                "-o {}: the name of a table ends in .sateen, that of a folder in /",
                path.display()
            );
            return Err(Usage(message).into());
        }
        return Ok(Place::File(path));
    }
    if found.is_some() || end.is_some_and(|end| end == "sateen") {
        let message = format!(
            "-o {}: tables of several fabrics, of a list, of a scene or of a pattern need a folder, and this names a file",
            path.display()
        );
        return Err(Usage(message).into());
    }
    Ok(Place::Folder(path))
}
