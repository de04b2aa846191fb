//! Sizes as people write them.

const UNITS: [(&str, u32); 2] = [("MiB", 20), ("KiB", 10)];
/// Units that are read, too.
const DECIMAL_UNITS: [(&str, f64); 2] = [("MB", 1e6), ("kB", 1e3)];

/// `64KiB`, `16MiB`; what is no whole number of either is `1000B`.
pub fn size_name(bytes: usize) -> String {
    let whole = |(_, bits): &&(&str, u32)| bytes.is_multiple_of(1 << bits);
    match UNITS.iter().find(whole) {
        Some((unit, bits)) => format!("{}{unit}", bytes >> bits),
        None => format!("{bytes}B"),
    }
}

/// Bytes of `64KiB`, `1.5MiB` or `8MB`, in small letters or capitals, rounded down; `None` of what is not written so, or is more than memory
/// has addresses for.
pub fn size_named(text: &str) -> Option<usize> {
    let text = text.to_ascii_lowercase();
    let binary = UNITS.map(|(unit, bits)| (unit, f64::from(1 << bits)));
    let mut units = binary.into_iter().chain(DECIMAL_UNITS);
    units.find_map(|(unit, bytes)| {
        let number = text.strip_suffix(&unit.to_ascii_lowercase())?;
        let number: f64 = number.trim_end().parse().ok()?;
        let size = number * bytes;
        let is_size = size >= 0.0 && size < usize::MAX as f64;
        is_size.then_some(size as usize)
    })
}
