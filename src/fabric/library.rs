//! The fabrics that come with the tool, embedded from `tables/fabrics/`.

use super::Fabric;

/// A fabric of the library.
#[derive(Debug, Clone, Copy)]
pub struct LibraryEntry {
    /// The name to call it by.
    pub name: &'static str,
    file: &'static str,
    variant: Option<&'static str>,
    toml: &'static str,
}

impl LibraryEntry {
    /// Reads the fabric.
    pub fn load(&self) -> Fabric {
        Fabric::from_toml(self.toml, self.file, self.variant)
            .expect("the library's own files are tested to be valid")
    }
}

macro_rules! entry {
    ($name:literal) => {
        entry!($name, $name, None)
    };
    ($name:literal, $file:literal, $variant:expr) => {
        LibraryEntry {
            name: $name,
            file: concat!("tables/fabrics/", $file, ".toml"),
            variant: $variant,
            toml: include_str!(concat!("../../tables/fabrics/", $file, ".toml")),
        }
    };
}

/// The library, in the order of its sources: table II of \[SBDJ13\], then appendix A of \[Fecho13\], then what its 6.1.2 and 6.3
/// propose.
pub const LIBRARY: &[LibraryEntry] = &[
    entry!("linen-plain"),
    entry!("silk-crepe-de-chine"),
    entry!("polyester-satin-charmeuse-front"),
    entry!("polyester-satin-charmeuse-back"),
    entry!("silk-shot"),
    entry!("velvet"),
    entry!("denim"),
    entry!("polyester-lining"),
    entry!("polka-dot-lining-white", "polka-dot-lining", Some("white")),
    entry!("polka-dot-lining-pink", "polka-dot-lining", Some("pink")),
    entry!("swimwear-front"),
    entry!("swimwear-back"),
    entry!("tshirt-white"),
    entry!("tshirt-black-front"),
    entry!("tshirt-black-back"),
    entry!("faux-suede"),
    entry!("corduroy"),
    entry!("weft-knit"),
    entry!("weft-knit-curve"),
    entry!("warp-knit"),
    entry!("felt"),
    entry!("velvet-spread"),
];

/// The library name most like a misspelt one, if any is at all like it.
pub fn nearest_name(name: &str) -> Option<&'static str> {
    let name = name.to_lowercase();
    LIBRARY
        .iter()
        .map(|entry| (entry.name, strsim::jaro_winkler(entry.name, &name)))
        .filter(|(_, likeness)| *likeness > 0.6)
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(name, _)| name)
}
