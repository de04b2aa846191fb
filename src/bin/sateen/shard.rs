//! Lists of fabrics, and the shards that they are baked in.

use std::collections::HashMap;
use std::fmt;
use std::fmt::Write as _;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sateen::bake::FabricText;
use sateen::fabric::Fabric;
use sha2::{Digest, Sha256};

use crate::output::{go_on, say, talk};
use crate::subject::{load_fabrics, read};

/// A million long paths.
const MAX_LIST_BYTES: u64 = 256 << 20;

/// SHA-256, as hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    let mut digits = String::with_capacity(64);
    for byte in Sha256::digest(bytes) {
        write!(digits, "{byte:02x}").expect("writing to a string");
    }
    digits
}

/// SHA-256 of something as JSON, whose keys have a fixed order.
pub(crate) fn sha256_of(value: &impl serde::Serialize) -> String {
    sha256(&serde_json::to_vec(value).expect("numbers, strings and arrays are JSON"))
}

/// One of the parts of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shard {
    /// From 1 to `count`.
    index: u32,
    count: u32,
}

impl Shard {
    /// The list in one part.
    pub(crate) const WHOLE: Self = Self { index: 1, count: 1 };
    const MOST: u32 = 1_000_000;

    /// Whether a fabric is in it, by the SHA-256 of its parameters: another fabric in the list moves none.
    fn has(self, parameters: &str) -> bool {
        let (first, _) = parameters.split_at(15);
        let place = u64::from_str_radix(first, 16).expect("they are hexadecimal digits");
        place % u64::from(self.count) == u64::from(self.index - 1)
    }

    /// What it is called in the name of a file.
    pub(crate) fn file_name(self) -> String {
        format!("{}-of-{}", self.index, self.count)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

pub(crate) fn parse_shard(text: &str) -> Result<Shard, String> {
    let numbers = text.split_once('/').and_then(|(index, count)| {
        let number = |text: &str| text.trim().parse::<u32>().ok();
        Some((number(index)?, number(count)?))
    });
    match numbers {
        Some((index, count @ 1..=Shard::MOST)) if (1..=count).contains(&index) => {
            Ok(Shard { index, count })
        }
        Some((index, count @ 1..=Shard::MOST)) => Err(format!(
            "there is no shard {index} of {count}: they are 1/{count} to {count}/{count}"
        )),
        _ => Err(format!(
            "it is the number of a shard, from 1, and how many there are, up to {}: 1/4",
            Shard::MOST
        )),
    }
}

/// A list of fabrics: a library name or the path of a fabric's or a pattern's TOML file on each line.
pub(crate) struct List {
    /// What messages call it.
    pub(crate) name: String,
    /// Where paths begin.
    folder: PathBuf,
    bytes: Vec<u8>,
}

/// A fabric of a list.
pub(crate) struct Listed {
    pub(crate) line: usize,
    pub(crate) fabric: Fabric,
    /// SHA-256 of all that the fabric's file says.
    pub(crate) parameters: String,
}

/// What a whole list has.
pub(crate) struct Census {
    /// SHA-256 of its fabrics' parameters, in whatever order.
    pub(crate) list: String,
    pub(crate) fabrics: usize,
    /// Lines that name no fabric.
    pub(crate) broken: Vec<usize>,
}

impl List {
    /// `-` is stdin.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let is_stdin = path == Path::new("-");
        let mut bytes = Vec::new();
        if is_stdin {
            let stdin = io::stdin().lock();
            stdin
                .take(MAX_LIST_BYTES + 1)
                .read_to_end(&mut bytes)
                .context("cannot read the list from stdin")?;
            if bytes.len() as u64 > MAX_LIST_BYTES {
                bail!("the list on stdin has more than {MAX_LIST_BYTES} bytes; split it");
            }
        } else {
            bytes = read(path, MAX_LIST_BYTES)?;
        }
        // What comes through a pipe is beside nothing.
        let folder = path.parent().filter(|_| !is_stdin && path.is_file());
        let list = Self {
            name: if is_stdin {
                "stdin".to_owned()
            } else {
                path.display().to_string()
            },
            folder: folder.unwrap_or(Path::new("")).to_owned(),
            bytes,
        };
        // Half of UTF-16 is zeros, and most other files have some.
        if list.bytes.contains(&0) {
            bail!(
                "{}: it is not a list of lines in UTF-8; save it as UTF-8",
                list.name
            );
        }
        if !list.lines().any(|(_, line)| is_entry(line)) {
            bail!(
                "{}: it names no fabric; write a library name or the path of a TOML file on each line",
                list.name
            );
        }
        Ok(list)
    }

    /// Lines by number, without the mark that some editors put before the first.
    fn lines(&self) -> impl Iterator<Item = (usize, &[u8])> {
        let bytes = self.bytes.strip_prefix(b"\xef\xbb\xbf");
        let lines = bytes.unwrap_or(&self.bytes).split(|byte| *byte == b'\n');
        (1..).zip(lines.map(<[u8]>::trim_ascii))
    }

    /// Gives every fabric once, in order. A line that is wrong is told, and the others go on.
    pub(crate) fn fabrics(&self, mut take: impl FnMut(Listed)) -> Result<Census> {
        let mut seen: HashMap<String, (usize, String)> = HashMap::new();
        let mut broken = Vec::new();
        for (line, text) in self.lines().filter(|(_, line)| is_entry(line)) {
            go_on()?;
            let (fabrics, is_pattern) = match self.load(text) {
                Ok(loaded) => loaded,
                Err(error) => {
                    talk(&format!("{}:{line}: {error:#}", self.name));
                    broken.push(line);
                    continue;
                }
            };
            for fabric in fabrics {
                let parameters = sha256_of(&FabricText {
                    name: fabric.name.clone(),
                    variant: fabric.variant.clone(),
                    toml: fabric.toml.clone(),
                });
                let name = &fabric.name;
                match seen.get(name) {
                    None => {
                        seen.insert(name.clone(), (line, parameters.clone()));
                        take(Listed {
                            line,
                            fabric,
                            parameters,
                        });
                    }
                    // Patterns share fabrics.
                    Some((_, known)) if *known == parameters && is_pattern => {}
                    Some((first, known)) if *known == parameters => say(&format!(
                        "{}:{line}: {name} is on line {first}, too; it is baked once",
                        self.name
                    )),
                    Some((first, _)) => {
                        talk(&format!(
                            "{}:{line}: {name} is left out: the fabric of line {first} has the same name and other parameters; rename one",
                            self.name
                        ));
                        broken.push(line);
                    }
                }
            }
        }
        broken.dedup();
        let mut all: Vec<&str> = seen.values().map(|(_, known)| known.as_str()).collect();
        all.sort_unstable();
        Ok(Census {
            list: sha256(all.concat().as_bytes()),
            fabrics: all.len(),
            broken,
        })
    }

    /// The fabrics of a line, and whether they are a pattern's.
    fn load(&self, line: &[u8]) -> Result<(Vec<Fabric>, bool)> {
        let entry = std::str::from_utf8(line).context("the line is not UTF-8 text")?;
        let beside = self.folder.join(entry);
        let is_name = Fabric::from_library(entry).is_some()
            || !entry.ends_with(".toml") && !entry.contains(['/', '\\']) && !beside.exists();
        let argument = if is_name {
            entry
        } else {
            beside.to_str().context("the list's folder is not UTF-8")?
        };
        load_fabrics(argument, None)
    }
}

impl Census {
    /// # Errors
    /// When lines are broken, of which it says which.
    pub(crate) fn check(&self, list: &List) -> Result<()> {
        const SHOWN: usize = 12;
        let lines: Vec<String> = self
            .broken
            .iter()
            .take(SHOWN)
            .map(usize::to_string)
            .collect();
        let more = match self.broken.len() {
            0 => return Ok(()),
            1..=SHOWN => String::new(),
            count => format!(" and {} more", count - SHOWN),
        };
        bail!(
            "{}: nothing is done for {} {}{more}, for the reasons above; all else is done. Mend the list and run again",
            list.name,
            if self.broken.len() == 1 {
                "line"
            } else {
                "lines"
            },
            lines.join(", ")
        )
    }
}

/// Whether a line is neither empty nor a comment.
fn is_entry(line: &[u8]) -> bool {
    !line.is_empty() && !line.starts_with(b"#")
}

impl Listed {
    pub(crate) fn is_in(&self, shard: Shard) -> bool {
        shard.has(&self.parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fabric_is_in_one_shard_and_stays_there() {
        let keys: Vec<String> = (0..1000).map(|k: u32| sha256(&k.to_le_bytes())).collect();
        let mut counts = [0; 7];
        for key in &keys {
            let shards: Vec<usize> = (1..=7)
                .filter(|index| parse_shard(&format!("{index}/7")).unwrap().has(key))
                .collect();
            assert_eq!(shards.len(), 1);
            counts[shards[0] - 1] += 1;
            assert!(Shard::WHOLE.has(key));
        }
        assert!(
            counts.iter().all(|count| (100..190).contains(count)),
            "{counts:?}"
        );
    }

    #[test]
    fn shards_are_counted_from_one() {
        assert_eq!(parse_shard("2/3"), Ok(Shard { index: 2, count: 3 }));
        for bad in ["0/2", "3/2"] {
            assert!(
                parse_shard(bad).unwrap_err().contains("1/2 to 2/2"),
                "{bad}"
            );
        }
        for bad in [
            "",
            "1",
            "/",
            "1/0",
            "0/0",
            "-1/2",
            "1/2/3",
            "a/b",
            "1/1000001",
            "1/99999999999",
        ] {
            assert!(parse_shard(bad).unwrap_err().contains("1/4"), "{bad}");
        }
    }

    #[test]
    fn what_a_hash_is_of_is_written_the_same_way_everywhere() {
        assert_eq!(
            sha256(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
        let text = FabricText {
            name: "a".to_owned(),
            variant: None,
            toml: "b".to_owned(),
        };
        assert_eq!(sha256_of(&text), sha256(br#"{"name":"a","toml":"b"}"#));
    }
}
