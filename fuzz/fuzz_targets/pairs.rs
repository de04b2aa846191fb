//! Any bytes: they are no file of pairs, or one whose directions are unit vectors and whose cells are all there.
#![no_main]

use sateen::metrics::PairsFile;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(file) = PairsFile::read(bytes, "fuzz.csv") else {
        return;
    };
    let columns = file.header().len();
    for (row, pair) in file.directions().iter().enumerate() {
        assert_eq!(file.cells(row).count(), columns);
        for direction in pair {
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-12, "{direction:?}");
        }
    }
    assert!(file.not_unit() <= 2 * file.directions().len());
});
