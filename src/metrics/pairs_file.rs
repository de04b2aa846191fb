//! Pairs of directions from a CSV file.
//!
//! The first line names the columns: `wi_x wi_y wi_z wr_x wr_y wr_z`, in any order and among any others, which are kept.
//!
//! A file may come from anywhere, so what it can make the reader ask for is bounded: it has at most [`MAX_CSV_BYTES`],
//! and a line at most [`MAX_CSV_LINE_BYTES`]. A row takes 96 bytes for its directions, its own text, and 4 bytes per cell,
//! at most eleven times as much as its line; while a list grows, its old and its new place are both in memory.

use std::io::{self, Read};

use csv::{ReaderBuilder, StringRecord};

use crate::math::normalized;

/// The most bytes of a file of pairs: some ten million pairs with all their digits.
pub const MAX_CSV_BYTES: u64 = 1 << 30;
/// The most bytes of one line, its quoted line breaks included. (It may be a buffer longer, since files are read ahead.)
pub const MAX_CSV_LINE_BYTES: u64 = 1 << 20;

const COLUMNS: [&str; 6] = ["wi_x", "wi_y", "wi_z", "wr_x", "wr_y", "wr_z"];
/// The most letters of a file that an error quotes.
const MAX_QUOTED: usize = 80;
/// Directions further from unit length than this are counted.
const UNIT_TOLERANCE: f64 = 1e-3;

/// What is wrong with a file of pairs, and where.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PairsFileError {
    /// The file cannot be read, or is not CSV.
    #[error("cannot read the pairs {file}")]
    Unreadable {
        /// The file, or the name it was given.
        file: String,
        /// What the CSV reader says.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file has more than [`MAX_CSV_BYTES`].
    #[error("cannot read the pairs {file}: it has more than {MAX_CSV_BYTES} bytes; split it")]
    TooLarge {
        /// The file, or the name it was given.
        file: String,
    },
    /// A line has more than [`MAX_CSV_LINE_BYTES`].
    #[error("{file}:{line}: the line has more than {MAX_CSV_LINE_BYTES} bytes")]
    LineTooLong {
        /// The file, or the name it was given.
        file: String,
        /// Line, from 1.
        line: u64,
    },
    /// The first line lacks columns.
    #[error("{file}: the columns {} are missing from its first line, {first_line:?}; {remedy}", missing.join(", "))]
    MissingColumns {
        /// The file, or the name it was given.
        file: String,
        /// Which.
        missing: Vec<&'static str>,
        /// How the first line begins.
        first_line: String,
        /// What the line seems to be, and what to do.
        remedy: &'static str,
    },
    /// The first line names a column twice.
    #[error("{file}: there are several columns {column}")]
    RepeatedColumn {
        /// The file, or the name it was given.
        file: String,
        /// Which.
        column: &'static str,
    },
    /// A line has more cells than the first, or fewer.
    #[error(
        "{file}:{line}: it has {found} cells, and the first line {expected}; write decimals with a point, and no comments"
    )]
    Ragged {
        /// The file, or the name it was given.
        file: String,
        /// Line, from 1.
        line: u64,
        /// Its cells.
        found: u64,
        /// Those of the first line.
        expected: u64,
    },
    /// The file is no text, or in another encoding.
    #[error("cannot read the pairs {file}: it is not UTF-8 text; save it as CSV in UTF-8")]
    NotText {
        /// The file, or the name it was given.
        file: String,
    },
    /// A cell is no number.
    #[error("{file}:{line}: {column} is {text:?}, but must be a finite number")]
    NotANumber {
        /// The file, or the name it was given.
        file: String,
        /// Line, from 1.
        line: u64,
        /// The cell's column.
        column: &'static str,
        /// What the cell says.
        text: String,
    },
    /// All components of a direction are zero.
    #[error("{file}:{line}: {direction} is the zero vector, which has no direction")]
    NoDirection {
        /// The file, or the name it was given.
        file: String,
        /// Line, from 1.
        line: u64,
        /// `wi` or `wr`.
        direction: &'static str,
    },
}

/// A CSV file of pairs, with the columns that it has besides.
#[derive(Debug, Clone, PartialEq)]
pub struct PairsFile {
    header: Cells,
    rows: Cells,
    directions: Vec<[[f64; 3]; 2]>,
    /// What other columns were asked for, row by row.
    numbers: Vec<f64>,
    not_unit: usize,
}

impl PairsFile {
    /// Reads a file; `file` names it in errors.
    ///
    /// # Errors
    /// What is wrong, with the column and the line. The first mistake ends the reading.
    pub fn read(input: impl Read, file: &str) -> Result<Self, PairsFileError> {
        Self::read_with(input, file, &[])
    }

    /// Reads a file that has other `columns` of numbers, too.
    ///
    /// # Errors
    /// As [`PairsFile::read`].
    pub fn read_with(
        input: impl Read,
        file: &str,
        columns: &[&'static str],
    ) -> Result<Self, PairsFileError> {
        Reader::new(input, file, columns).read()
    }

    /// Of all rows the numbers in the columns that were asked for, row by row.
    pub fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// The cells of the first line.
    pub fn header(&self) -> impl ExactSizeIterator<Item = &str> {
        self.header.range(0, self.header.count())
    }

    /// The cells of a row, as many as there are in the header.
    ///
    /// # Panics
    /// When there are not so many rows.
    pub fn cells(&self, row: usize) -> impl ExactSizeIterator<Item = &str> {
        let columns = self.header.count();
        self.rows.range(row * columns, (row + 1) * columns)
    }

    /// wi and wr of every row, of unit length.
    pub fn directions(&self) -> &[[[f64; 3]; 2]] {
        &self.directions
    }

    /// How many pairs have a direction below the surface, where ρ is 0.
    pub fn below(&self) -> usize {
        let is_below = |pair: &&[[f64; 3]; 2]| pair.iter().any(|w| w[2] < 0.0);
        self.directions.iter().filter(is_below).count()
    }

    /// How many directions were not of unit length and have been made so.
    pub fn not_unit(&self) -> usize {
        self.not_unit
    }
}

/// Text in cells, as one string: a string of its own for each would take many times what the file has.
#[derive(Debug, Clone, PartialEq, Default)]
struct Cells {
    text: String,
    /// Where each ends. All the text is part of a file, far below 4 GiB.
    ends: Vec<u32>,
}

impl Cells {
    fn extend(&mut self, record: &StringRecord) {
        for cell in record {
            self.text.push_str(cell);
            self.ends.push(self.text.len() as u32);
        }
    }

    fn count(&self) -> usize {
        self.ends.len()
    }

    fn range(&self, from: usize, to: usize) -> impl ExactSizeIterator<Item = &str> {
        let mut start = from.checked_sub(1).map_or(0, |before| self.ends[before]);
        self.ends[from..to].iter().map(move |end| {
            let cell = &self.text[start as usize..*end as usize];
            start = *end;
            cell
        })
    }
}

/// What the CSV reader says, in other words where it is easily said better.
fn unreadable(file: String, error: csv::Error) -> PairsFileError {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            pos,
            expected_len,
            len,
        } => PairsFileError::Ragged {
            file,
            line: pos.as_ref().map_or(0, csv::Position::line),
            found: *len,
            expected: *expected_len,
        },
        csv::ErrorKind::Utf8 { .. } => PairsFileError::NotText { file },
        _ => PairsFileError::Unreadable {
            file,
            source: error.into(),
        },
    }
}

struct Reader<'a, R> {
    file: &'a str,
    csv: csv::Reader<Limited<R>>,
    /// The columns that hold numbers, those of directions first.
    columns: Vec<&'static str>,
}

impl<'a, R: Read> Reader<'a, R> {
    fn new(input: R, file: &'a str, others: &[&'static str]) -> Self {
        let limited = Limited {
            input,
            // One more than allowed, so that none left means too many.
            file_left: MAX_CSV_BYTES + 1,
            line_left: MAX_CSV_LINE_BYTES + 1,
        };
        Self {
            file,
            csv: ReaderBuilder::new().has_headers(false).from_reader(limited),
            columns: COLUMNS.iter().chain(others).copied().collect(),
        }
    }

    fn read(mut self) -> Result<PairsFile, PairsFileError> {
        let mut record = StringRecord::new();
        self.next(&mut record)?;
        let places = self.places(&record)?;
        let mut read = PairsFile {
            header: Cells::default(),
            rows: Cells::default(),
            directions: Vec::new(),
            numbers: Vec::new(),
            not_unit: 0,
        };
        read.header.extend(&record);
        let mut numbers = Vec::new();
        while self.next(&mut record)? {
            let line = record.position().map_or(0, csv::Position::line);
            self.numbers(&record, &places, line, &mut numbers)?;
            let (directions, others) = numbers.split_at(COLUMNS.len());
            let component = |k: usize| [0, 1, 2].map(|axis| directions[3 * k + axis]);
            let mut unit = |name, w| {
                let (direction, is_unit) = self.unit(name, w, line)?;
                read.not_unit += usize::from(!is_unit);
                Ok(direction)
            };
            let pair = [unit("wi", component(0))?, unit("wr", component(1))?];
            read.directions.push(pair);
            read.numbers.extend(others);
            read.rows.extend(&record);
        }
        Ok(read)
    }

    /// Reads the next record, if there is one.
    fn next(&mut self, record: &mut StringRecord) -> Result<bool, PairsFileError> {
        let line = self.csv.position().line();
        self.csv.get_mut().line_left = MAX_CSV_LINE_BYTES + 1;
        let result = self.csv.read_record(record);
        result.map_err(|error| {
            let (file, limited) = (self.file.to_owned(), self.csv.get_ref());
            if limited.file_left == 0 {
                PairsFileError::TooLarge { file }
            } else if limited.line_left == 0 {
                PairsFileError::LineTooLong { file, line }
            } else {
                unreadable(file, error)
            }
        })
    }

    /// In which cells of a record the numbers are.
    fn places(&self, header: &StringRecord) -> Result<Vec<usize>, PairsFileError> {
        let places_of = |name: &str| {
            let cells = header.iter().enumerate();
            let places = cells.filter(|(_, column)| column.trim() == name);
            places.map(|(place, _)| place).collect::<Vec<usize>>()
        };
        let places: Vec<Vec<usize>> = self.columns.iter().map(|name| places_of(name)).collect();
        let columns = || self.columns.iter().copied().zip(&places);
        let file = || self.file.to_owned();
        let missing: Vec<&'static str> = columns()
            .filter(|(_, places)| places.is_empty())
            .map(|(name, _)| name)
            .collect();
        if !missing.is_empty() {
            let line = header.iter().collect::<Vec<_>>().join(",");
            return Err(PairsFileError::MissingColumns {
                file: file(),
                missing,
                remedy: self.remedy(&line),
                first_line: line.chars().take(MAX_QUOTED).collect(),
            });
        }
        if let Some((column, _)) = columns().find(|(_, places)| places.len() > 1) {
            let file = file();
            return Err(PairsFileError::RepeatedColumn { file, column });
        }
        Ok(places.into_iter().map(|places| places[0]).collect())
    }

    /// What a first line that lacks columns seems to be, and what to do.
    fn remedy(&self, line: &str) -> &'static str {
        let has_all = |line: &str, separator: char| {
            let names: Vec<&str> = line.split(separator).map(str::trim).collect();
            self.columns.iter().all(|column| names.contains(column))
        };
        let lower = line.to_lowercase();
        if line.trim_start().starts_with('#') {
            "it seems to be a comment: remove it, so that the names of the columns come first"
        } else if lower.starts_with("sep=") {
            "it tells a spreadsheet the separator: remove it, so that the names of the columns come first"
        } else if has_all(&lower, ';') {
            "it seems to be separated by semicolons: separate cells by commas, and write decimals with a point"
        } else if has_all(&lower, '\t') {
            "it seems to be separated by tabs: separate cells by commas"
        } else if has_all(&lower, '|') {
            "it seems to be separated by |: separate cells by commas"
        } else if has_all(&lower, ' ') {
            "it seems to be separated by spaces: separate cells by commas"
        } else if has_all(&lower, ',') {
            "it has capitals: write the names of the columns in small letters"
        } else if has_all(&lower.replace("wo_", "wr_"), ',') {
            "wi is the direction to the light, and that to the viewer is called wr here"
        } else if line
            .split(',')
            .all(|cell| cell.trim().parse::<f64>().is_ok())
        {
            "it seems to be a pair already: put a line with the names of the columns before it"
        } else {
            "name the columns in the first line, with commas between them"
        }
    }

    fn numbers(
        &self,
        record: &StringRecord,
        places: &[usize],
        line: u64,
        numbers: &mut Vec<f64>,
    ) -> Result<(), PairsFileError> {
        numbers.clear();
        for (place, column) in places.iter().zip(&self.columns) {
            let text = record.get(*place).unwrap_or_default().trim();
            match text.parse::<f64>() {
                Ok(number) if number.is_finite() => numbers.push(number),
                _ => {
                    return Err(PairsFileError::NotANumber {
                        file: self.file.to_owned(),
                        line,
                        column,
                        text: text.chars().take(MAX_QUOTED).collect(),
                    });
                }
            }
        }
        Ok(())
    }

    /// A direction of unit length, and whether it had that before.
    fn unit(
        &self,
        name: &'static str,
        w: [f64; 3],
        line: u64,
    ) -> Result<([f64; 3], bool), PairsFileError> {
        let direction = normalized(w).ok_or_else(|| PairsFileError::NoDirection {
            file: self.file.to_owned(),
            line,
            direction: name,
        })?;
        let differences = (0..3).map(|k| (direction[k] - w[k]).abs());
        Ok((direction, differences.fold(0.0, f64::max) <= UNIT_TOLERANCE))
    }
}

/// Reads no more of a file, and of a line, than is allowed.
struct Limited<R> {
    input: R,
    file_left: u64,
    line_left: u64,
}

impl<R: Read> Read for Limited<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let left = self.file_left.min(self.line_left);
        if left == 0 {
            return Err(io::Error::other("too many bytes"));
        }
        let wanted = buffer
            .len()
            .min(usize::try_from(left).unwrap_or(usize::MAX));
        let read = self.input.read(&mut buffer[..wanted])?;
        self.file_left -= read as u64;
        self.line_left -= read as u64;
        Ok(read)
    }
}
