//! Metadata as a file of their own, beside texels without any or in files that have no place for them.

use super::File;
use super::note::Note;

/// These files, and the JSON. Its name keeps the whole of theirs, so that exports of one table lie side by side.
pub(super) fn with_json(
    mut files: Vec<File>,
    extension: &'static str,
    note: &Note<'_>,
) -> Vec<File> {
    files.push(File {
        extension,
        bytes: (note.to_json() + "\n").into_bytes(),
    });
    files
}
