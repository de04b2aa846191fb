//! FABRIC and TABLE arguments, and the folders of reports on them.

use std::borrow::Cow;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use sateen::bake::Provenance;
use sateen::fabric::{Fabric, MAX_TOML_BYTES, nearest_name};
use sateen::pattern::{MAX_IMAGE_BYTES, Pattern};
use sateen::table::{MAX_DECODED_BYTES, Table};
use sateen::text::{Kind, cut, read_capped, read_ordinary};

use crate::guidance::{self, Looks, PLACES};
use crate::output::{Output, Usage, say};

/// No table takes more: its samples, and as much again for the case that they do not compress. A mistyped path to a film is not
/// read whole.
pub(crate) const MAX_TABLE_BYTES: u64 = 2 * MAX_DECODED_BYTES;

/// What an argument names.
pub(crate) struct Subject {
    argument: String,
    pub(crate) what: What,
}

pub(crate) enum What {
    Fabric(Fabric),
    Table(Box<Table>),
    Pattern(Arc<Pattern>),
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.argument)
    }
}

impl Subject {
    /// A library name, the TOML file of a fabric or a pattern, or a table.
    pub(crate) fn load(argument: &str, variant: Option<&str>) -> Result<Self> {
        Ok(Self {
            argument: argument.to_owned(),
            what: What::load(argument, variant)?,
        })
    }

    /// The fabric itself, or the one that a table was baked from.
    pub(crate) fn fabric(&self) -> Result<Cow<'_, Fabric>> {
        match &self.what {
            What::Fabric(fabric) => Ok(Cow::Borrowed(fabric)),
            What::Table(table) => {
                let (_, fabric) = provenance(table, Path::new(&self.argument))?;
                Ok(Cow::Owned(fabric))
            }
            What::Pattern(_) => bail!("{self} is a pattern, not a fabric"),
        }
    }
}

impl What {
    fn load(argument: &str, variant: Option<&str>) -> Result<Self> {
        let others = [Looks::Mesh, Looks::Picture, Looks::Pairs];
        guidance::refuse(Path::new(argument), &others, "a fabric or a table")?;
        if Fabric::from_library(argument).is_some() || !Path::new(argument).exists() {
            if argument.ends_with(".sateen") {
                read(Path::new(argument), MAX_TABLE_BYTES)?;
            }
            return load_fabric(argument, variant).map(Self::Fabric);
        }
        let bytes = read(Path::new(argument), MAX_TABLE_BYTES)?;
        if bytes.first() == Some(&0x89) || argument.ends_with(".sateen") {
            if variant.is_some() {
                let message = format!(
                    "--variant chooses among a TOML file's albedos, but {argument} is a table"
                );
                return Err(Usage(message).into());
            }
            let table = Table::from_bytes(&bytes)
                .with_context(|| format!("cannot read the table {argument}"))?;
            Ok(Self::Table(Box::new(table)))
        } else {
            match Kind::of(&bytes) {
                Kind::Fabric => parse_fabric(&bytes, argument, variant).map(Self::Fabric),
                Kind::Pattern => {
                    let pattern = parse_pattern(&bytes, argument, variant)?;
                    Ok(Self::Pattern(Arc::new(pattern)))
                }
                Kind::Scene => {
                    let message = format!(
                        "{argument} is a scene: `sateen bake --scene {argument}` bakes what it needs, `sateen render scene {argument}` takes \
                         its picture"
                    );
                    Err(Usage(message).into())
                }
            }
        }
    }
}

/// Fabrics and images that the pattern names are looked for beside it.
fn parse_pattern(bytes: &[u8], argument: &str, variant: Option<&str>) -> Result<Pattern> {
    if variant.is_some() {
        let message = "--variant is for a fabric; a pattern's materials have a variant each";
        return Err(Usage(message.to_owned()).into());
    }
    let folder = Path::new(argument).parent().unwrap_or(Path::new(""));
    let files = |name: &str| read_ordinary(&folder.join(name), MAX_IMAGE_BYTES as u64);
    let text = std::str::from_utf8(bytes).context("a pattern is text")?;
    Ok(Pattern::from_toml(text, argument, &files)?)
}

/// The fabrics that an argument of `bake` stands for: a library name, a TOML file, or what a pattern needs tables of.
/// Whether it is a pattern is said, too.
pub(crate) fn load_fabrics(argument: &str, variant: Option<&str>) -> Result<(Vec<Fabric>, bool)> {
    match What::load(argument, variant)? {
        What::Fabric(fabric) => Ok((vec![fabric], false)),
        What::Pattern(pattern) => Ok((pattern.bakes().cloned().collect(), true)),
        What::Table(_) => {
            let message = format!("{argument} is a table already; name a fabric or a pattern");
            Err(Usage(message).into())
        }
    }
}

/// A library name or a TOML file.
pub(crate) fn load_fabric(argument: &str, variant: Option<&str>) -> Result<Fabric> {
    if let Some(fabric) = Fabric::from_library(argument) {
        if variant.is_some() {
            let message = "--variant is for TOML files; the library's names end in theirs, as polka-dot-lining-pink";
            return Err(Usage(message.to_owned()).into());
        }
        return Ok(fabric);
    }
    let path = Path::new(argument);
    let looks_like_path =
        argument.ends_with(".toml") || argument.contains(['/', '\\']) || path.exists();
    if !looks_like_path {
        if PLACES.contains(&argument) {
            let message = format!(
                "{argument} is what cloth lies on, not a fabric: `sateen render {argument} {}FABRIC -o FILE`",
                if argument == "mesh" { "MESH " } else { "" }
            );
            return Err(Usage(message).into());
        }
        match nearest_name(argument) {
            Some(name) => bail!(
                "no fabric is called \"{}\"; did you mean {name}? `sateen fabrics` lists them all",
                cut(argument)
            ),
            None => bail!(
                "no fabric is called \"{}\"; `sateen fabrics` lists them, and own ones are .toml files",
                cut(argument)
            ),
        }
    }
    parse_fabric(
        &read(Path::new(argument), MAX_TOML_BYTES as u64)?,
        argument,
        variant,
    )
}

fn parse_fabric(bytes: &[u8], argument: &str, variant: Option<&str>) -> Result<Fabric> {
    if bytes.len() > MAX_TOML_BYTES {
        bail!(
            "cannot read the fabric {argument}: {} bytes are more than any fabric has",
            bytes.len()
        );
    }
    let text = std::str::from_utf8(bytes)
        .with_context(|| format!("cannot read the fabric {argument}: it is not text"))?;
    let fabric = Fabric::from_toml(text, argument, variant)?;
    if let (None, Some(chosen)) = (variant, &fabric.variant) {
        say(&format!(
            "{argument} names several albedos; this is {chosen} (--variant chooses)"
        ));
    }
    Ok(fabric)
}

/// A file's bytes, at most `limit`.
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    read_capped(path, limit).with_context(|| format!("cannot read {}", path.display()))
}

/// A table and the length of its file.
pub(crate) fn load_table(path: &Path) -> Result<(Table, usize)> {
    let others = [
        Looks::Fabric,
        Looks::Mesh,
        Looks::Picture,
        Looks::Pairs,
        Looks::Toml,
    ];
    guidance::refuse(path, &others, "a table")?;
    let bytes = read(path, MAX_TABLE_BYTES)?;
    let table = Table::from_bytes(&bytes)
        .with_context(|| format!("cannot read the table {}", path.display()))?;
    Ok((table, bytes.len()))
}

/// What made a table, and its fabric.
pub(crate) fn provenance(table: &Table, name: &Path) -> Result<(Provenance, Fabric)> {
    let cannot = || format!("cannot understand the metadata of {}", name.display());
    let provenance = Provenance::of(table).with_context(cannot)?;
    let fabric = provenance.fabric.parse().with_context(cannot)?;
    let named = fabric.visible_threads().map(|thread| thread.name.as_str());
    if !named.eq(table.threads().iter().map(|thread| thread.name())) {
        bail!(
            "the metadata and the grids of {} list different threads; bake the table again",
            name.display()
        );
    }
    Ok((provenance, fabric))
}

/// The folder of a report on these fabrics, in which `file` can be written.
pub(crate) fn report_folder<'a>(
    fabrics: &[Fabric],
    folder: &'a Path,
    file: &str,
) -> Result<&'a Path> {
    for (index, fabric) in fabrics.iter().enumerate() {
        if fabrics[..index]
            .iter()
            .any(|other| other.name == fabric.name)
        {
            let message = format!(
                "two fabrics are called {}, and their results would be the same files",
                fabric.name
            );
            return Err(Usage(message).into());
        }
    }
    if folder.is_file() {
        let message = format!(
            "-o {}: a report needs a folder, but this is a file",
            folder.display()
        );
        return Err(Usage(message).into());
    }
    // Before the work, to find out.
    if Output::prepare(&folder.join(file))?.replaces() {
        say(&format!("the report in {} is replaced", folder.display()));
    }
    Ok(folder)
}

/// Writes the files of a report.
pub(crate) fn write_files(folder: &Path, files: Vec<(String, String)>) -> Result<()> {
    for (name, text) in files {
        Output::prepare(&folder.join(name))?.write_silently(text.as_bytes())?;
    }
    Ok(())
}
