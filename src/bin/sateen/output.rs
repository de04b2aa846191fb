//! What all verbs do with files, stdout, stderr and interrupts.

use std::fs::{self, File, TryLockError};
use std::io::{self, IsTerminal, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sateen::bake::{Adapted, Choice};
use sateen::metrics::{ErrorReport, Quantiles};
use sateen::progress::Cancelled;
use sateen::table::Table;

use crate::args::{MAX_JOBS, Workers};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static QUIET: AtomicBool = AtomicBool::new(false);
/// The temporary file that is being written, if any.
static TEMPORARY: Mutex<Option<PathBuf>> = Mutex::new(None);

/// How long after an interrupt work may take to end by itself and say what was not written. Together with what follows well
/// below a second, which is what the tool promises.
const GRACE: Duration = Duration::from_millis(500);
/// And how long saying that it did not may take.
const LAST_WORDS: Duration = Duration::from_millis(100);

/// Temporary files are called this, with something random between.
const TEMPORARY_NAME: (&str, &str) = (".sateen-", ".tmp");

/// Whether to keep from [`say`]ing anything and from showing bars.
pub(crate) fn be_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

/// Says something that is no error, unless told to be quiet.
pub(crate) fn say(text: &str) {
    if !QUIET.load(Ordering::Relaxed) {
        talk(text);
    }
}

/// From now on Ctrl-C, SIGTERM and SIGHUP make work that reports to a [`Bar`] end early with an error. What does not end in
/// time, as compression, a slow disk, a pipe that nobody reads or fills, is ended by force.
pub(crate) fn stop_on_interrupt() {
    let handler = || {
        INTERRUPTED.store(true, Ordering::Relaxed);
        std::thread::sleep(GRACE);
        // Whoever holds the lock is about to create the file; then it stays for a later run to remove.
        if let Ok(Some(path)) = TEMPORARY.try_lock().as_deref() {
            let _ = fs::remove_file(path);
        }
        // On its own, since stderr may be what work waits for.
        std::thread::spawn(|| talk("error: interrupted"));
        std::thread::sleep(LAST_WORDS);
        std::process::exit(1);
    };
    // Without a handler the process just dies, which leaves nothing half written either.
    let _ = ctrlc::set_handler(handler);
}

/// Whether to go on.
///
/// # Errors
/// After an interrupt.
pub(crate) fn go_on() -> Result<(), Cancelled> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        Err(Cancelled)
    } else {
        Ok(())
    }
}

/// A fault of the command line that only shows once its files are read: exit status 2.
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl std::fmt::Display for Usage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Says something to the person at the terminal, if one is there.
pub(crate) fn talk(text: &str) {
    let _ = writeln!(io::stderr(), "sateen: {}", escaped(text));
}

/// Control characters as escapes: what a file says must not steer a terminal.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_control() && letter != '\n' {
            escaped.extend(letter.escape_default());
        } else {
            escaped.push(letter);
        }
    }
    escaped
}

static STDOUT_IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Runs before the runtime, which opens /dev/null in the place of a stdout that is closed: text would vanish without an error.
#[cfg(target_os = "linux")]
#[expect(
    unsafe_code,
    reason = "only what this section names runs before the runtime"
)]
#[used]
// SAFETY: the C library calls what the section holds, functions that it may give arguments to, which this one does not look at.
#[unsafe(link_section = ".init_array")]
static LOOK_AT_STDOUT: extern "C" fn() = {
    extern "C" fn look() {
        let open = Path::new("/proc/self/fd");
        // A link to what is open, which for pipes leads nowhere.
        let is_closed = open.exists() && open.join("1").symlink_metadata().is_err();
        STDOUT_IS_CLOSED.store(is_closed, Ordering::Relaxed);
    }
    look
};

/// Writes text to stdout. A reader that has seen enough is no error: work and exit status go on.
pub(crate) fn print(text: &str) -> Result<()> {
    if STDOUT_IS_CLOSED.load(Ordering::Relaxed) {
        anyhow::bail!("cannot write to stdout: it is closed");
    }
    let mut stdout = io::stdout().lock();
    match stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
    {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to stdout")
        }
        _ => Ok(()),
    }
}

/// Prints an object as JSON, with the name and version of what its keys mean: docs/json.md.
pub(crate) fn print_json(what: &str, mut value: serde_json::Value) -> Result<()> {
    value["schema"] = sateen::report::schema(what).into();
    print(&format!("{value:#}\n"))
}

/// A file that appears under its name when it is complete, and not before.
pub(crate) struct Output {
    path: PathBuf,
    /// Where the bytes go: `path`, or what it links to.
    target: PathBuf,
    /// Devices and pipes are written to, not replaced.
    is_special: bool,
    /// Whether there was a file.
    replaces: bool,
}

impl Output {
    /// Makes sure, before any work, that `path` can be written: missing folders are made.
    pub(crate) fn prepare(path: &Path) -> Result<Self> {
        let output = Self::in_folder(path)?;
        if !output.is_special {
            let folder = output.folder();
            fs::create_dir_all(folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
            remove_leftovers(folder);
            // Dropped and so removed at once: it was only to find out.
            output.temporary()?;
        }
        Ok(output)
    }

    /// The same in a folder that another output was prepared in: it is not looked through for each of thousands.
    pub(crate) fn in_folder(path: &Path) -> Result<Self> {
        if path == Path::new("-") {
            return Err(Usage("-o - is not supported; name a file".to_owned()).into());
        }
        let is_link = fs::symlink_metadata(path).is_ok_and(|found| found.is_symlink());
        let target = match fs::canonicalize(path) {
            Ok(target) => target,
            // /dev/stdout leads to a pipe, which has no path of its own.
            Err(_) if fs::metadata(path).is_ok() => path.to_owned(),
            Err(error) if is_link => {
                return Err(error).with_context(|| {
                    format!("cannot write {}: the link leads nowhere", path.display())
                });
            }
            Err(_) => path.to_owned(),
        };
        let found = fs::metadata(&target);
        let is_special = found
            .as_ref()
            .is_ok_and(|found| !found.is_file() && !found.is_dir());
        let output = Self {
            path: path.to_owned(),
            target,
            is_special,
            replaces: found.as_ref().is_ok_and(fs::Metadata::is_file),
        };
        if found.is_ok_and(|found| found.is_dir()) {
            anyhow::bail!(
                "cannot write {}: it is a folder; name a file with -o",
                path.display()
            );
        }
        Ok(output)
    }

    /// Refuses an output that is read, too.
    ///
    /// # Errors
    /// When it is one of `inputs`.
    pub(crate) fn is_none_of<'a>(&self, inputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
        let is_it = |input: &&Path| {
            !self.is_special && fs::canonicalize(input).is_ok_and(|input| input == self.target)
        };
        match inputs.into_iter().find(is_it) {
            None => Ok(()),
            Some(input) => {
                let message = format!("-o {} is what is read; name another file", input.display());
                Err(Usage(message).into())
            }
        }
    }

    /// Whether there was a file.
    pub(crate) fn replaces(&self) -> bool {
        self.replaces
    }

    /// Writes the whole file, and says so if it replaced another.
    pub(crate) fn write(&self, bytes: &[u8]) -> Result<()> {
        self.write_silently(bytes)?;
        if self.replaces {
            say(&format!(
                "{} was there, and is replaced",
                self.path.display()
            ));
        }
        Ok(())
    }

    /// Writes the whole file.
    pub(crate) fn write_silently(&self, bytes: &[u8]) -> Result<()> {
        let cannot = || format!("cannot write {}", self.path.display());
        if self.is_special {
            return File::options()
                .write(true)
                .open(&self.target)
                .and_then(|mut file| file.write_all(bytes))
                .with_context(cannot);
        }
        let mut file = self.temporary()?;
        file.write_all(bytes)
            .and_then(|()| file.as_file().sync_all())
            .with_context(cannot)?;
        file.persist(&self.target)
            .map_err(|error| error.error)
            .with_context(cannot)?;
        Ok(())
    }

    fn folder(&self) -> &Path {
        match self.target.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        }
    }

    /// A file beside the target, removed when dropped, and until then locked: see [`remove_leftovers`].
    fn temporary(&self) -> Result<tempfile::NamedTempFile> {
        let mut builder = tempfile::Builder::new();
        let (prefix, suffix) = TEMPORARY_NAME;
        builder.prefix(prefix).suffix(suffix);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // As any new file, less the umask.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut current = TEMPORARY
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        loop {
            let file = builder
                .tempfile_in(self.folder())
                .with_context(|| format!("cannot write {}", self.path.display()))?;
            // Where there are no locks, nobody takes it for a leftover either.
            let locked = !matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
            // Before it was locked, another run may have taken it for a leftover.
            if locked && file.path().exists() {
                *current = Some(file.path().to_owned());
                return Ok(file);
            }
        }
    }
}

/// Removes the temporary files in `folder` of runs that were killed. Those of runs that live are locked.
fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    let (prefix, suffix) = TEMPORARY_NAME;
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        // Opening a pipe would wait for its other end.
        let is_file = || entry.file_type().is_ok_and(|kind| kind.is_file());
        if name.starts_with(prefix)
            && name.ends_with(suffix)
            && is_file()
            && let Ok(file) = File::options().write(true).open(entry.path())
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A bar over `count` pieces of work, shown on a terminal only.
pub(crate) struct Bar {
    bar: ProgressBar,
    piece: usize,
}

const STEPS_PER_PIECE: u64 = 1000;

impl Bar {
    pub(crate) fn new(count: usize) -> Self {
        let bar = ProgressBar::new(count as u64 * STEPS_PER_PIECE);
        if QUIET.load(Ordering::Relaxed) || !io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        } else {
            bar.enable_steady_tick(Duration::from_millis(250));
        }
        let style = ProgressStyle::with_template(
            "{msg:40!} {wide_bar} {percent:>3} %  {elapsed} gone, {eta} left",
        );
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self { bar, piece: 0 }
    }

    /// Begins the next piece: what is done, and to what.
    pub(crate) fn begin(&mut self, what: &str, of: &str) {
        self.bar.set_message(format!("{what} {of}"));
        self.bar.set_position(self.piece as u64 * STEPS_PER_PIECE);
        self.piece += 1;
    }

    /// Shows how far the piece is; says stop after an interrupt.
    pub(crate) fn report(&self, share: f64) -> ControlFlow<()> {
        let before = (self.piece.max(1) - 1) as u64 * STEPS_PER_PIECE;
        let position = before + (share * STEPS_PER_PIECE as f64) as u64;
        if position > self.bar.position() {
            self.bar.set_position(position);
        }
        match go_on() {
            Err(Cancelled) => ControlFlow::Break(()),
            Ok(()) => ControlFlow::Continue(()),
        }
    }

    /// Takes the bar away while something else is written.
    pub(crate) fn suspend<T>(&self, write: impl FnOnce() -> T) -> T {
        self.bar.suspend(write)
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Starts the workers for all parallel work: as many as -j says, or else RAYON_NUM_THREADS, or one for each core.
pub(crate) fn use_workers(Workers { jobs }: &Workers) -> Result<()> {
    let Some(asked) = jobs.map(usize::from).or(asked_by_environment()) else {
        return Ok(());
    };
    // More workers only wait, and keep an interrupt waiting, too.
    const PER_CORE: usize = 4;
    let most = PER_CORE * std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = most.min(asked);
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs)
        .build_global()
        .with_context(|| format!("cannot start {jobs} workers; lower -j"))
}

/// What rayon takes from the environment.
const WORKERS_VARIABLE: &str = "RAYON_NUM_THREADS";

fn asked_by_environment() -> Option<usize> {
    let text = std::env::var(WORKERS_VARIABLE).ok()?;
    text.trim().parse().ok().filter(|asked| *asked > 0)
}

/// Holds what the environment asks for to what -j allows.
///
/// # Errors
/// When it is more.
pub(crate) fn check_environment() -> Result<()> {
    match asked_by_environment() {
        Some(asked) if asked > usize::from(MAX_JOBS) => {
            let message =
                format!("{WORKERS_VARIABLE}={asked}: it is 1 to {MAX_JOBS}; unset it, or use -j");
            Err(Usage(message).into())
        }
        _ => Ok(()),
    }
}

/// `4.12 MB`.
pub(crate) fn bytes(count: usize) -> String {
    match count {
        0..1000 => format!("{count} B"),
        1000..1_000_000 => format!("{:.1} kB", count as f64 / 1e3),
        _ => format!("{:.2} MB", count as f64 / 1e6),
    }
}

/// What a table takes in memory, for people.
pub(crate) fn in_memory(decoded: usize) -> String {
    match decoded {
        0 => "no samples".to_owned(),
        _ => format!("{} in memory", bytes(decoded)),
    }
}

/// What a table takes, for people.
pub(crate) fn sizes(decoded: usize, file: usize) -> String {
    format!("{}, {} in the file", in_memory(decoded), bytes(file))
}

/// `1 light`, `2 lights`.
pub(crate) fn counted(count: usize, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        _ if what.ends_with("ch") => format!("{count} {what}es"),
        _ => format!("{count} {what}s"),
    }
}

/// `a`, `a and b`, `a, b and c`.
fn listed(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [word] => (*word).to_owned(),
        [before @ .., last] => format!("{} and {last}", before.join(", ")),
    }
}

/// How a table evaluates its threads, for people: `warp and weft by grids`.
pub(crate) fn ways(table: &Table) -> String {
    let mut ways: Vec<(String, Vec<&str>)> = Vec::new();
    for thread in table.threads() {
        let way = match (thread.grid(), thread.direct_nodes()) {
            (Some(_), _) => "by grid".to_owned(),
            (None, Some(tilts)) => {
                format!("by {} per segment", counted(tilts, "placed tilt"))
            }
            (None, None) => "in closed form".to_owned(),
        };
        match ways.iter_mut().find(|(other, _)| *other == way) {
            Some((_, threads)) => threads.push(thread.name()),
            None => ways.push((way, vec![thread.name()])),
        }
    }
    let ways = ways.iter();
    let ways: Vec<String> = ways
        .map(|(way, threads)| format!("{} {way}", listed(threads)))
        .collect();
    ways.join(", ")
}

/// What a table needed to keep its preset's promise, for people.
pub(crate) fn adapted_line(adapted: Option<Adapted>) -> &'static str {
    match adapted {
        None => "",
        Some(Adapted::Direct) => {
            "  its lobes are too narrow for the preset's grids: all threads are evaluated directly\n"
        }
        Some(Adapted::Larger) => {
            "  its lobes are too narrow for the preset's grids: these have four times the bytes\n"
        }
    }
}

/// How a table evaluates its threads, and why, for people.
pub(crate) fn choice_lines(choices: &[Choice]) -> String {
    let line = |choice: &Choice| {
        let percent = |x: f64| format!("{:.2} %", 100.0 * x);
        let grid_error = choice.grid_error.map_or(String::new(), |error| {
            format!(" ({} expected)", percent(error))
        });
        let direct = format!(
            "{} per segment ({} expected) at {:.1} times a grid's time",
            counted(choice.direct_nodes, "placed tilt"),
            percent(choice.direct_error),
            choice.direct_cost
        );
        if choice.grid {
            let rim = choice.rim.map_or(String::new(), |rim| {
                format!(
                    " up to {:.0}° from the horizon, beyond {} tilts per segment",
                    rim.from.to_degrees(),
                    rim.nodes
                )
            });
            format!(
                "  {:<14} grid{grid_error}{rim}, rather than {direct}\n",
                choice.thread
            )
        } else {
            format!(
                "  {:<14} {direct}, rather than a grid{grid_error}\n",
                choice.thread
            )
        }
    };
    choices.iter().map(line).collect()
}

/// The error of a table, for people.
pub(crate) fn error_lines(error: &ErrorReport) -> String {
    let percent = |x: f64| format!("{:.3} %", 100.0 * x);
    let mut lines = format!(
        "  relative error {:>10} {:>10} {:>10} {:>10} {:>10} {:>10} {:>8}\n",
        "mean", "p50", "p95", "p99", "p99.9", "max", "pairs"
    );
    for (
        name,
        Quantiles {
            pairs,
            mean,
            p50,
            p95,
            p99,
            p999,
            max,
        },
    ) in error.sets()
    {
        if *pairs == 0 {
            continue;
        }
        let values = [mean, p50, p95, p99, p999, max]
            .map(|x| format!("{:>10}", percent(*x)))
            .join(" ");
        lines += &format!("    {name:<12} {values} {pairs:>8}\n");
    }
    lines += &format!("  RMSE / mean      {:>8}\n", percent(error.rmse_over_mean));
    if error.bias.is_empty() {
        return lines;
    }
    lines += "  directional reflectance (bias)";
    for bias in &error.bias {
        let sign = if bias.bias < 0.0 { '−' } else { '+' };
        lines += &format!(
            "   {}°: {:.3} ({sign}{})",
            bias.view_deg,
            bias.reflectance,
            percent(bias.bias.abs())
        );
    }
    lines + "\n"
}
