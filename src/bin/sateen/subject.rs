//! FABRIC and TABLE arguments.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use sateen::bake::Provenance;
use sateen::fabric::{Fabric, nearest_name};
use sateen::table::Table;

/// No fabric takes more; keeps a mistyped path to a film from being read whole.
const MAX_TOML_BYTES: u64 = 1 << 20;

/// What an argument names.
pub(crate) enum Subject {
    Fabric(Fabric),
    Table(Box<Table>),
}

impl Subject {
    /// A library name, a TOML file or a table.
    pub(crate) fn load(argument: &str, variant: Option<&str>) -> Result<Self> {
        let is_table = Fabric::from_library(argument).is_none()
            && (argument.ends_with(".sateen")
                || fs::File::open(argument).is_ok_and(|mut file| {
                    let mut first = [0];
                    std::io::Read::read(&mut file, &mut first).is_ok_and(|count| count == 1)
                        && first == [0x89]
                }));
        if is_table {
            if variant.is_some() {
                bail!("--variant chooses among a TOML file's albedos, but {argument} is a table");
            }
            load_table(Path::new(argument)).map(|(table, _)| Self::Table(Box::new(table)))
        } else {
            load_fabric(argument, variant).map(Self::Fabric)
        }
    }
}

/// A library name or a TOML file.
pub(crate) fn load_fabric(argument: &str, variant: Option<&str>) -> Result<Fabric> {
    if let Some(fabric) = Fabric::from_library(argument) {
        if variant.is_some() {
            bail!(
                "--variant is for TOML files; the library's names end in theirs, as polka-dot-lining-pink"
            );
        }
        return Ok(fabric);
    }
    let path = Path::new(argument);
    let looks_like_path =
        argument.ends_with(".toml") || argument.contains(['/', '\\']) || path.exists();
    if !looks_like_path {
        match nearest_name(argument) {
            Some(name) => bail!(
                "no fabric is called \"{argument}\"; did you mean {name}? `sateen fabrics` lists them all"
            ),
            None => bail!(
                "no fabric is called \"{argument}\"; `sateen fabrics` lists them, and own ones are .toml files"
            ),
        }
    }
    let cannot = || format!("cannot read the fabric {argument}");
    let size = fs::metadata(path).with_context(cannot)?.len();
    if size > MAX_TOML_BYTES {
        bail!(
            "cannot read the fabric {argument}: {size} bytes are too many for a TOML file of parameters"
        );
    }
    let text = fs::read_to_string(path).with_context(cannot)?;
    Ok(Fabric::from_toml(&text, argument, variant)?)
}

/// A table and the length of its file.
pub(crate) fn load_table(path: &Path) -> Result<(Table, usize)> {
    let bytes =
        fs::read(path).with_context(|| format!("cannot read the table {}", path.display()))?;
    let table = Table::from_bytes(&bytes)
        .with_context(|| format!("cannot read the table {}", path.display()))?;
    Ok((table, bytes.len()))
}

/// What made a table, and its fabric.
pub(crate) fn provenance(table: &Table, name: &Path) -> Result<(Provenance, Fabric)> {
    let cannot = || format!("cannot understand the metadata of {}", name.display());
    let provenance = Provenance::of(table).with_context(cannot)?;
    let fabric = provenance.fabric.parse().with_context(cannot)?;
    Ok((provenance, fabric))
}
