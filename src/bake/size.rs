//! Sizes as people write them.

const UNITS: [(&str, u32); 2] = [("MiB", 20), ("KiB", 10)];

/// `64KiB`, `16MiB`; what is no whole number of either is `1000B`.
pub fn size_name(bytes: usize) -> String {
    let whole = |(_, bits): &&(&str, u32)| bytes.is_multiple_of(1 << bits);
    match UNITS.iter().find(whole) {
        Some((unit, bits)) => format!("{}{unit}", bytes >> bits),
        None => format!("{bytes}B"),
    }
}

/// Bytes of `64KiB` or `16MiB`; `None` of what is not written so, or is more than memory has addresses for.
pub fn size_named(text: &str) -> Option<usize> {
    UNITS.iter().find_map(|(unit, bits)| {
        let number: usize = text.strip_suffix(unit)?.parse().ok()?;
        number.checked_mul(1 << bits)
    })
}
