//! The bytes of a glTF file: its JSON, and buffers that are in it or beside it.

use std::io;
use std::path::{Component, Path};

use super::json::Root;
use crate::text::{cut, read_ordinary};

/// The most bytes of a file with all its buffers.
const MAX_BYTES: usize = super::super::MAX_MESH_BYTES as usize;

/// JSON, and the binary chunk of a GLB file.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    }
    let word = |at: usize| {
        let word = bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*word) as usize)
    };
    match word(4) {
        Some(2) => {}
        version => return Err(format!("its version is {version:?}, and must be 2")),
    }
    let mut at = 12;
    let mut chunk = |kind: &[u8; 4]| {
        let length = word(at)?;
        let bytes = bytes.get(at + 4..)?.strip_prefix(kind)?.get(..length)?;
        at += 8 + length;
        Some(bytes)
    };
    let json = chunk(b"JSON").ok_or("its first chunk must be JSON, and be whole")?;
    let binary = chunk(b"BIN\0");
    if binary.is_none() && bytes.get(at + 4..at + 8) == Some(b"BIN\0") {
        return Err("its binary chunk is cut off; copy the file again".to_owned());
    }
    Ok((json, binary))
}

/// Bytes of all buffers, at least as many as each says.
pub(super) fn load(
    root: &Root,
    folder: &Path,
    binary: Option<&[u8]>,
) -> Result<Vec<Vec<u8>>, String> {
    let mut left = MAX_BYTES;
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let wrong = |why: String| format!("buffers[{index}]: {why}");
        let bytes = match &buffer.uri {
            Some(uri) => resolve(uri, folder, left).map_err(wrong)?,
            None => binary
                .filter(|_| index == 0)
                .ok_or_else(|| wrong("it has no uri, and the file no binary chunk".to_owned()))?
                .to_vec(),
        };
        if bytes.len() < buffer.byte_length {
            let (found, said) = (bytes.len(), buffer.byte_length);
            return Err(wrong(format!(
                "it has {found} bytes, less than its byteLength of {said}"
            )));
        }
        left = (left.checked_sub(bytes.len()))
            .ok_or_else(|| wrong("all buffers together are larger than 1 GiB".to_owned()))?;
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The bytes behind a URI: those in it, or those of a file beside the glTF file.
fn resolve(uri: &str, folder: &Path, most: usize) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let data = data.split_once(";base64,").map_or(data, |(_, data)| data);
        return from_base64(data).ok_or_else(|| "its data: is no base64".to_owned());
    }
    let shown = cut(uri);
    let name = String::from_utf8(unescape(uri))
        .map_err(|_| format!("its uri {shown} is not UTF-8 when decoded; rename the file"))?;
    // A file from elsewhere has no business outside of its folder.
    let is_below = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if uri.contains(':') || !Path::new(&name).components().all(is_below) {
        return Err(format!(
            "{shown}: only data: and files beside the glTF file, or in folders below, can be read"
        ));
    }
    let bytes = read_ordinary(&folder.join(&name), most as u64).map_err(|error| {
        let folder = match folder.as_os_str().is_empty() {
            true => ".".into(),
            false => folder.display().to_string(),
        };
        let all = match error.kind() {
            io::ErrorKind::FileTooLarge => "; all buffers together are larger than 1 GiB",
            _ => "",
        };
        let name = cut(&name);
        format!("cannot read {name}, looked for in {folder}: {error}{all}")
    })?;
    Ok(bytes)
}

/// With every %xx as the byte that it stands for.
fn unescape(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        let digit = |byte: u8| char::from(byte).to_digit(16);
        let escaped = match (first, after) {
            (b'%', [high, low, ..]) => digit(*high).zip(digit(*low)),
            _ => None,
        };
        match escaped {
            Some((high, low)) => {
                bytes.push((16 * high + low) as u8);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    bytes
}

/// RFC 4648, section 4; padding may be left out.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits: u32 = 0;
        for byte in group {
            let digit = match byte {
                b'A'..=b'Z' => byte - b'A',
                b'a'..=b'z' => byte - b'a' + 26,
                b'0'..=b'9' => byte - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(digit);
        }
        let whole = bits << (6 * (4 - group.len()));
        let [_, decoded @ ..] = whole.to_be_bytes();
        bytes.extend_from_slice(match group.len() {
            4 => &decoded,
            3 => &decoded[..2],
            2 => &decoded[..1],
            _ => return None,
        });
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_as_in_the_rfc() {
        for (text, bytes) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg", "foob"),
            ("Zm9vYmFy", "foobar"),
        ] {
            assert_eq!(from_base64(text).unwrap(), bytes.as_bytes());
        }
        assert!(from_base64("Z").is_none() && from_base64("Zm9 v").is_none());
    }

    #[test]
    fn escapes_are_bytes() {
        assert_eq!(unescape("a%20b%C3%a9%"), "a bé%".as_bytes());
    }
}
