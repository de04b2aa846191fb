//! What a bake of a list did, as lines of JSON beside its tables: docs/json.md.
//!
//! Lines are appended, each in one piece once its table is under its name, so that whatever ends a run, every whole line is true. A last
//! line without an end is what a run was writing as it was killed, and counts for nothing.

use std::collections::HashMap;
use std::fs::{self, File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sateen::bake::{Preset, Promise};
use sateen::metrics::ErrorReport;
use serde::{Deserialize, Serialize};

use crate::output::{Output, say};
use crate::shard::Shard;
use crate::subject::read;

/// Two million lines.
const MAX_MANIFEST_BYTES: u64 = 1 << 30;
const NAME: (&str, &str) = ("manifest-", ".jsonl");

fn schema() -> String {
    sateen::report::schema("manifest")
}

/// How a run begins.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Head {
    schema: String,
    tool: String,
    shard: String,
    /// SHA-256 of the parameters of the list's fabrics.
    list: String,
    /// How many these are, of all shards.
    fabrics: usize,
}

/// What became of a fabric.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) name: String,
    /// Of the table; none if none keeps the promise.
    pub(crate) sha256: Option<String>,
    /// Of the table's file.
    pub(crate) bytes: Option<usize>,
    pub(crate) preset: Preset,
    pub(crate) error: Error,
    /// None for a table that was found whole.
    pub(crate) seconds: Option<f64>,
    pub(crate) tool: String,
    /// SHA-256 of the fabric's name, variant and text …
    pub(crate) parameters: String,
    /// … and of all else that the table depends on.
    pub(crate) settings: String,
}

/// The relative error over all pairs.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Error {
    pub(crate) mean: f64,
    pub(crate) p99: f64,
}

impl Error {
    pub(crate) fn of(error: &ErrorReport) -> Self {
        Self {
            mean: error.all.mean,
            p99: error.all.p99,
        }
    }

    /// Whether it keeps what a preset promises.
    pub(crate) fn keeps(self, Promise { mean, p99 }: Promise) -> bool {
        self.mean <= mean && self.p99 <= p99
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Line {
    Head(Head),
    Row(Row),
}

impl Head {
    pub(crate) fn new(shard: Shard, list: &str, fabrics: usize) -> Self {
        Self {
            schema: schema(),
            tool: sateen::TOOL.to_owned(),
            shard: shard.to_string(),
            list: list.to_owned(),
            fabrics,
        }
    }
}

/// The manifests of a folder.
pub(crate) struct Manifests {
    /// By name of the fabric: one for each time that it was baked.
    rows: HashMap<String, Vec<Row>>,
    /// The files, and the hash of the list that each was made from last.
    lists: Vec<(PathBuf, Option<String>)>,
}

impl Manifests {
    /// What the manifests in `folder` say of the fabrics that are `wanted`. What is damaged of them is said and left out: tables are
    /// judged by what remains.
    ///
    /// # Errors
    /// When one cannot be read, or is of another version.
    pub(crate) fn read(folder: &Path, wanted: impl Fn(&str) -> bool) -> Result<Self> {
        let mut manifests = Self {
            rows: HashMap::new(),
            lists: Vec::new(),
        };
        let cannot = || format!("cannot read the folder {}", folder.display());
        let mut paths = Vec::new();
        for entry in fs::read_dir(folder).with_context(cannot)? {
            let name = entry.with_context(cannot)?.file_name();
            let text = name.to_string_lossy();
            if text.starts_with(NAME.0) && text.ends_with(NAME.1) {
                paths.push(folder.join(name));
            }
        }
        paths.sort();
        for path in paths {
            let list = manifests.add(&path, &wanted)?;
            manifests.lists.push((path, list));
        }
        Ok(manifests)
    }

    /// Adds one file. Returns the hash of its list.
    fn add(&mut self, path: &Path, wanted: &impl Fn(&str) -> bool) -> Result<Option<String>> {
        let bytes = read(path, MAX_MANIFEST_BYTES)?;
        let mut list = None;
        for (number, text) in (1..).zip(bytes.split_inclusive(|byte| *byte == b'\n')) {
            let place = || format!("{}:{number}", path.display());
            if !text.ends_with(b"\n") {
                say(&format!(
                    "{}: the last line is not whole: a run was killed as it wrote it",
                    place()
                ));
                continue;
            }
            check_version(text).with_context(place)?;
            match serde_json::from_slice(text) {
                Ok(Line::Head(head)) => list = Some(head.list),
                Ok(Line::Row(row)) if wanted(&row.name) => {
                    self.rows.entry(row.name.clone()).or_default().push(row);
                }
                Ok(Line::Row(_)) => {}
                Err(_) => say(&format!(
                    "{}: the line is damaged, and is left out",
                    place()
                )),
            }
        }
        Ok(list)
    }

    /// All that is said of a fabric.
    pub(crate) fn of(&self, name: &str) -> &[Row] {
        self.rows.get(name).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.lists.is_empty()
    }

    /// A file beside this one that was made from another list, if there is one.
    fn of_another(&self, list: &str, this: &Path) -> Option<&Path> {
        let mut others = self.lists.iter().filter(|(path, _)| path != this);
        let found = others.find(|(_, other)| other.as_ref().is_some_and(|other| other != list));
        found.map(|(path, _)| path.as_path())
    }
}

/// # Errors
/// When a line says that it is of another version.
fn check_version(text: &[u8]) -> Result<()> {
    #[derive(Deserialize)]
    struct Versioned {
        schema: String,
    }
    match serde_json::from_slice::<Versioned>(text) {
        Ok(found) if found.schema != schema() => bail!(
            "this is {}, and this tool reads {}; use the tool that wrote it, or name another folder",
            found.schema,
            schema()
        ),
        _ => Ok(()),
    }
}

/// The manifest that a run writes.
pub(crate) struct Manifest {
    path: PathBuf,
    file: File,
}

impl Manifest {
    /// Begins that of a shard in `folder`, which is made, and reads what is known there of the fabrics that are `wanted`: with `resume`
    /// what earlier runs wrote is kept.
    ///
    /// # Errors
    /// When it cannot be written, another run of the same shard is writing it, or, without `resume`, there are tables of another list.
    pub(crate) fn begin(
        folder: &Path,
        shard: Shard,
        head: &Head,
        resume: bool,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<(Self, Manifests)> {
        let (before, after) = NAME;
        let path = folder.join(format!("{before}{}{after}", shard.file_name()));
        Output::prepare(&path)?;
        let known = Manifests::read(folder, wanted)?;
        if let Some(another) = known.of_another(&head.list, &path) {
            if resume {
                say(&format!(
                    "{} is of another list, or of this one as it was; its tables stay. `sateen validate {} --list FILE` tells what is \
                     missing in the end",
                    another.display(),
                    folder.display()
                ));
            } else {
                bail!(
                    "{} is of another list; --resume adds to its tables, -o names another folder",
                    another.display()
                );
            }
        }
        let cannot = || format!("cannot write {}", path.display());
        let file = File::options()
            .read(true)
            .append(true)
            .create(true)
            .open(&path)
            .with_context(cannot)?;
        // Until this process ends, however it does. Where there are no locks, two runs of one shard only do the same work twice.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            bail!(
                "{}: another run is baking shard {shard} into this folder; wait until it ends, or end it",
                path.display()
            );
        }
        // A line that is not whole would spoil the next.
        let whole = if resume { whole_lines(&path)? } else { 0 };
        file.set_len(whole).with_context(cannot)?;
        let mut manifest = Self { path, file };
        manifest.append(head)?;
        Ok((manifest, known))
    }

    pub(crate) fn append(&mut self, line: &impl Serialize) -> Result<()> {
        let mut text = serde_json::to_vec(line)?;
        text.push(b'\n');
        self.file
            .write_all(&text)
            .and_then(|()| self.file.sync_data())
            .with_context(|| format!("cannot write {}", self.path.display()))
    }
}

/// How many bytes of a file are whole lines.
fn whole_lines(path: &Path) -> Result<u64> {
    let bytes = read(path, MAX_MANIFEST_BYTES)?;
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    Ok(end.map_or(0, |end| end as u64 + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shard::parse_shard;

    fn row(name: &str) -> Row {
        Row {
            name: name.to_owned(),
            sha256: Some("0".repeat(64)),
            bytes: Some(9),
            preset: Preset::Draft,
            error: Error {
                mean: 0.001,
                p99: 0.01,
            },
            seconds: Some(1.5),
            tool: sateen::TOOL.to_owned(),
            parameters: "1".repeat(64),
            settings: "2".repeat(64),
        }
    }

    fn begin(
        folder: &Path,
        shard: &str,
        list: &str,
        resume: bool,
    ) -> Result<(Manifest, Manifests)> {
        let shard = parse_shard(shard).unwrap();
        Manifest::begin(folder, shard, &Head::new(shard, list, 3), resume, |_| true)
    }

    #[test]
    fn wherever_a_manifest_ends_its_whole_lines_are_read_and_it_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let (mut manifest, _) = begin(folder.path(), "1/1", "x", false).unwrap();
        manifest.append(&row("a")).unwrap();
        manifest.append(&row("b")).unwrap();
        let path = manifest.path.clone();
        drop(manifest);
        let whole = fs::read(&path).unwrap();
        for end in 0..=whole.len() {
            fs::write(&path, &whole[..end]).unwrap();
            let lines = whole[..end].iter().filter(|byte| **byte == b'\n').count();
            let (mut manifest, known) = begin(folder.path(), "1/1", "x", true).unwrap();
            assert_eq!(known.of("a").len(), usize::from(lines > 1));
            assert_eq!(known.of("b").len(), usize::from(lines > 2));
            manifest.append(&row("c")).unwrap();
            drop(manifest);
            let known = Manifests::read(folder.path(), |_| true).unwrap();
            assert_eq!(known.of("a").len(), usize::from(lines > 1));
            assert_eq!(known.of("c").len(), 1);
        }
        // Damage in the middle costs its own line only.
        let mut damaged = whole.clone();
        damaged[whole.len() / 2] = 0xff;
        fs::write(&path, damaged).unwrap();
        let known = Manifests::read(folder.path(), |_| true).unwrap();
        assert_eq!(known.of("a").len() + known.of("b").len(), 1);
    }

    #[test]
    fn one_run_writes_a_shard_and_one_list_fills_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let error = |shard, list, resume| {
            begin(folder.path(), shard, list, resume)
                .err()
                .map(|error| format!("{error:#}"))
        };
        let (first, _) = begin(folder.path(), "1/2", "x", false).unwrap();
        assert!(
            error("1/2", "x", true)
                .unwrap()
                .contains("another run is baking shard 1/2")
        );
        assert_eq!(error("2/2", "x", false), None);
        drop(first);
        assert_eq!(error("1/2", "x", false), None);
        assert!(
            error("1/2", "y", false)
                .unwrap()
                .contains("manifest-2-of-2.jsonl is of another list")
        );
        assert_eq!(error("1/2", "y", true), None);

        let path = folder.path().join("manifest-2-of-2.jsonl");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("manifest/1", "manifest/2")).unwrap();
        let told = error("1/2", "x", true).unwrap();
        assert!(
            told.contains("manifest-2-of-2.jsonl:1: this is sateen-manifest/2"),
            "{told}"
        );
    }
}
