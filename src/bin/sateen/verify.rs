//! `sateen validate DIR --list FILE`: a folder of tables against the list that it was baked from.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, Result};
use sateen::metrics::measure_table;
use sateen::progress::Progress;
use sateen::text::read_ordinary;
use serde::Serialize;
use serde_json::json;

use crate::Outcome;
use crate::manifest::{Error, Manifests, Row};
use crate::output::{Bar, counted, go_on, print, print_json, say};
use crate::shard::{List, sha256};
use crate::subject::{MAX_TABLE_BYTES, load_table, provenance};
use crate::validate::ValidateArgs;

#[derive(Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    /// There is no table.
    Missing,
    /// It is of something else than the list says, or no manifest tells of what.
    Stale,
    /// It is not what was written.
    Damaged,
    /// It errs more than its preset promises, or than --max-error.
    Inaccurate,
}

/// What is wrong with a fabric's table.
#[derive(Serialize)]
struct Finding {
    fabric: String,
    line: usize,
    verdict: Verdict,
    why: String,
}

/// A fabric of the list.
struct Entry {
    line: usize,
    name: String,
    parameters: String,
}

type Judged<T> = Result<T, (Verdict, String)>;

pub(crate) fn run(args: &ValidateArgs, folder: &Path, list: &Path) -> Result<Outcome> {
    let list = List::read(list)?;
    let manifests = Manifests::read(folder, |_| true)?;
    if manifests.is_empty() {
        anyhow::bail!(
            "{}: there is no manifest of a bake; `sateen bake --list {} --resume -o {}` makes it",
            folder.display(),
            list.name,
            folder.display()
        );
    }
    let mut entries = Vec::new();
    let census = list.fabrics(|listed| {
        entries.push(Entry {
            line: listed.line,
            name: listed.fabric.name,
            parameters: listed.parameters,
        });
    })?;

    let mut bar = Bar::new(entries.len());
    let mut found: Vec<(&Entry, Judged<(&Row, Error)>)> = Vec::new();
    for entry in &entries {
        go_on()?;
        bar.begin("checking", &entry.name);
        let mut judged =
            judge(folder, entry, manifests.of(&entry.name)).map(|row| (row, row.error));
        if let Ok((row, error)) = &mut judged {
            if args.measure {
                *error = measure(args, folder, &entry.name, &bar)?;
            }
            if let Some(why) = excess(row, *error, args.max_error) {
                judged = Err((Verdict::Inaccurate, why));
            }
        }
        found.push((entry, judged));
    }
    drop(bar);

    // A library is of one kind: tables of a run with other flags are found, not trusted.
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for (row, _) in found.iter().filter_map(|(_, judged)| judged.as_ref().ok()) {
        *counts.entry(&row.settings).or_default() += 1;
    }
    let most = counts
        .iter()
        .max_by_key(|(settings, count)| (**count, **settings));
    let most = most.map(|(settings, _)| *settings);
    let mut findings = Vec::new();
    let mut whole = Vec::new();
    for (entry, judged) in &found {
        let (verdict, why) = match judged {
            Ok((row, error)) if Some(row.settings.as_str()) == most => {
                whole.push((entry, row, error));
                continue;
            }
            Ok(_) => (
                Verdict::Stale,
                "it was baked with other settings than most".to_owned(),
            ),
            Err((verdict, why)) => (*verdict, why.clone()),
        };
        findings.push(Finding {
            fabric: entry.name.clone(),
            line: entry.line,
            verdict,
            why,
        });
    }
    let extra = extra_tables(folder, &entries)?;
    let bytes: usize = whole.iter().filter_map(|(_, row, _)| row.bytes).sum();
    let worst = whole.iter().max_by(|a, b| a.2.mean.total_cmp(&b.2.mean));
    if args.print.json {
        let value = json!({
            "fabrics": census.fabrics,
            "whole": whole.len(),
            "bytes": bytes,
            "findings": findings,
            "broken_lines": census.broken,
            "extra": extra,
            "measured": args.measure,
            "errors": whole.iter().map(|(entry, _, error)| json!({ "fabric": entry.name, "error": error })).collect::<Vec<_>>(),
        });
        print_json("validate-list", value)?;
    } else {
        print(&text(&list, &findings, census.fabrics, whole.len(), bytes))?;
        if let Some((entry, _, error)) = worst {
            print(&format!(
                "the largest mean error is {:.3} %, of {}, {}\n",
                100.0 * error.mean,
                entry.name,
                if args.measure {
                    "measured now"
                } else {
                    "as its bake measured it"
                }
            ))?;
        }
    }
    if let [first, ..] = &*extra {
        say(&format!(
            "{} of no fabric in the list, such as {first}",
            counted(extra.len(), "table")
        ));
    }
    if findings
        .iter()
        .any(|finding| finding.verdict != Verdict::Inaccurate)
    {
        say(&format!(
            "`sateen bake --list {} --resume -o {}` bakes what is missing, stale or damaged, with the flags of the first bake",
            list.name,
            folder.display()
        ));
    }
    census.check(&list)?;
    Ok(if findings.is_empty() {
        Outcome::Done
    } else {
        Outcome::OutOfTolerance
    })
}

/// The line of a manifest that a table is by.
fn judge<'a>(folder: &Path, entry: &Entry, rows: &'a [Row]) -> Judged<&'a Row> {
    let is_current = |row: &Row| row.tool == sateen::TOOL && row.parameters == entry.parameters;
    let path = folder.join(format!("{}.sateen", entry.name));
    let file = match read_ordinary(&path, MAX_TABLE_BYTES) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let is_beyond = |row: &Row| row.sha256.is_none() && is_current(row);
            let why = if rows.iter().any(is_beyond) {
                "no table keeps the promise of its preset"
            } else {
                "it is not baked yet"
            };
            return Err((Verdict::Missing, why.to_owned()));
        }
        Err(error) => return Err((Verdict::Damaged, format!("it cannot be read: {error}"))),
    };
    let sum = sha256(&file);
    let of_file: Vec<&Row> = rows
        .iter()
        .filter(|row| row.sha256.as_ref() == Some(&sum))
        .collect();
    // The last is the newest.
    match of_file
        .iter()
        .rev()
        .find(|row| is_current(row))
        .or(of_file.last())
    {
        Some(row) if row.parameters != entry.parameters => Err((
            Verdict::Stale,
            "the fabric has changed since its bake".to_owned(),
        )),
        Some(row) if row.tool != sateen::TOOL => Err((
            Verdict::Stale,
            format!("{} baked it, and this is {}", row.tool, sateen::TOOL),
        )),
        Some(row) => Ok(row),
        None if rows.is_empty() => Err((
            Verdict::Stale,
            "there is a table, but no manifest tells of it".to_owned(),
        )),
        None => Err((
            Verdict::Damaged,
            "its SHA-256 is not that of the manifest".to_owned(),
        )),
    }
}

fn measure(args: &ValidateArgs, folder: &Path, name: &str, bar: &Bar) -> Result<Error> {
    let path = folder.join(format!("{name}.sateen"));
    let (table, _) = load_table(&path)?;
    let (_, fabric) = provenance(&table, &path)?;
    let report = |share: f64| bar.report(share);
    let progress = Progress::new(&report);
    let error = measure_table(
        &fabric,
        &table,
        args.pairs as usize,
        args.draw.seed,
        progress,
    )?;
    Ok(Error::of(&error))
}

/// What is more than was promised, or than the limit.
fn excess(row: &Row, error: Error, limit: Option<f64>) -> Option<String> {
    let promise = row.preset.promise();
    let percent = |share: f64| format!("{:.3} %", 100.0 * share);
    if !error.keeps(promise) {
        return Some(format!(
            "mean error {} and 99th percentile {}, where {} promises {} and {}",
            percent(error.mean),
            percent(error.p99),
            row.preset.name(),
            percent(promise.mean),
            percent(promise.p99)
        ));
    }
    let limit = limit.filter(|limit| !(error.mean <= *limit))?;
    Some(format!(
        "mean error {} exceeds {}",
        percent(error.mean),
        percent(limit)
    ))
}

/// Names of tables that no fabric has.
fn extra_tables(folder: &Path, entries: &[Entry]) -> Result<Vec<String>> {
    let names: HashSet<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    let mut extra = Vec::new();
    for entry in fs::read_dir(folder)
        .with_context(|| format!("cannot read the folder {}", folder.display()))?
    {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name
            .strip_suffix(".sateen")
            .is_some_and(|name| !names.contains(name))
        {
            extra.push(name);
        }
    }
    extra.sort();
    Ok(extra)
}

fn text(list: &List, findings: &[Finding], fabrics: usize, whole: usize, bytes: usize) -> String {
    let mut text = String::new();
    let name = |verdict: Verdict| match verdict {
        Verdict::Missing => "missing",
        Verdict::Stale => "stale",
        Verdict::Damaged => "damaged",
        Verdict::Inaccurate => "inaccurate",
    };
    for Finding {
        fabric,
        line,
        verdict,
        why,
    } in findings
    {
        text += &format!(
            "{:<10} {fabric} ({}:{line}): {why}\n",
            name(*verdict),
            list.name
        );
    }
    text += &format!(
        "{}: {whole} whole, {}",
        counted(fabrics, "fabric"),
        crate::output::bytes(bytes)
    );
    for verdict in [
        Verdict::Missing,
        Verdict::Stale,
        Verdict::Damaged,
        Verdict::Inaccurate,
    ] {
        let count = findings
            .iter()
            .filter(|finding| finding.verdict == verdict)
            .count();
        text += &format!(", {count} {}", name(verdict));
    }
    text + "\n"
}
