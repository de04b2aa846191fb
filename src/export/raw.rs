//! Metadata as a file of their own, beside texels without any or in files that have no place for them.

use super::File;
use super::note::Note;

/// These files, and the JSON.
pub(super) fn with_json(mut files: Vec<File>, note: &Note<'_>) -> Vec<File> {
    files.push(File {
        extension: "json",
        bytes: (note.to_json() + "\n").into_bytes(),
    });
    files
}
