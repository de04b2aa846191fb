//! Exports read back by other libraries: what they read is what was written, and looks up as before.

use std::sync::OnceLock;

use half::f16;
use sateen::bake::{Direct, Preset, Provenance, Settings, bake};
use sateen::export::{About, Cost, Export, File, Format};
use sateen::fabric::Fabric;
use sateen::metrics::{Pair, protocol_pairs};
use sateen::progress::Progress;
use sateen::shader::{Filter, Lookup, parameters};
use sateen::table::Table;
use sateen::volume::{self, Volume};
use serde_json::Value;

const PAIRS: usize = 256;
const SEED: u64 = 5;

/// Grids of four axes, of three, and none.
const FABRICS: [&str; 3] = ["denim", "felt", "faux-suede"];

struct Case {
    fabric: Fabric,
    table: Table,
    volume: Volume,
}

fn cases() -> &'static [Case] {
    static CASES: OnceLock<Vec<Case>> = OnceLock::new();
    CASES.get_or_init(|| {
        let case = |name: &&str| {
            let fabric = Fabric::from_library(name).expect("a library fabric");
            let settings = Settings {
                max_bytes: 64 << 10,
                error_pairs: 64,
                direct: Direct::Never,
                ..Preset::Draft.settings()
            };
            let table = bake(&fabric, &settings, Progress::silent())
                .expect("a table")
                .table;
            let settings = volume::Settings {
                max_bytes: 256 << 10,
                ..volume::Settings::default()
            };
            let volume = Volume::new(&table, &settings).expect("a volume");
            Case {
                fabric,
                table,
                volume,
            }
        };
        FABRICS.iter().map(case).collect()
    })
}

impl Case {
    fn export(&self, format: Format) -> Export<'_> {
        Export::new(&self.table, &self.volume, format).expect("texels")
    }

    fn cost(&self, export: &Export<'_>) -> Cost {
        export
            .measure(&self.fabric, PAIRS, SEED, Progress::silent())
            .expect("not cancelled")
    }

    fn files(&self, export: &Export<'_>, supercompress: bool) -> Vec<File> {
        let provenance = Provenance::of(&self.table).expect("what made it");
        let about = About {
            fabric: &self.fabric.name,
            recorded: &provenance.error,
            measured: &self.cost(export),
        };
        export.files(&about, supercompress).expect("files")
    }

    fn pairs(&self) -> Vec<Pair> {
        protocol_pairs(&self.fabric, PAIRS, SEED)
    }

    /// ρ of every pair by the lookup in a volume.
    fn values(&self, volume: &Volume) -> Vec<[f32; 3]> {
        let lookup = Lookup::new(&self.table, volume, Filter::EightBit);
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let pairs = self.pairs();
        let values = pairs
            .iter()
            .map(|pair| lookup.eval_cos(single(pair.wi), single(pair.wr)));
        values.collect()
    }

    /// That halves which a reader found, R, G, B, A of every texel, look up as the volume does.
    fn assert_looks_up(&self, halves: &[u16]) {
        let texels = halves.chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]);
        let read = self.volume.with_texels(texels).expect("as many texels");
        assert_eq!(read, self.volume);
        assert_eq!(self.values(&read), self.values(&self.volume));
    }
}

fn halves(bytes: &[u8]) -> Vec<u16> {
    let pairs = bytes.chunks_exact(2);
    pairs.map(|b| u16::from_le_bytes([b[0], b[1]])).collect()
}

/// The metadata, and that they have what they should.
fn check_metadata(json: &str, case: &Case, export: &Export<'_>) -> Value {
    assert!(json.is_ascii());
    let note: Value = serde_json::from_str(json).expect("JSON");
    assert_eq!(note["fabric"], case.fabric.name);
    assert_eq!(numbers(&note["size"]), export.size().map(|n| n as f32));
    let read: Vec<f32> = note["parameters"]
        .as_array()
        .expect("an array")
        .iter()
        .flat_map(numbers)
        .collect();
    assert_eq!(read, export.parameters().as_flattened());
    let threads = note["threads"].as_array().expect("an array");
    assert_eq!(threads.len(), case.table.threads().len());
    for (read, thread) in threads.iter().zip(case.table.threads()) {
        assert_eq!(read["name"], thread.name());
        assert_eq!(numbers(&read["albedo"]), thread.albedo());
    }
    let mean = &note["measured"]["exported"]["all"]["mean"];
    let mean = mean.as_f64().expect("a number");
    let expected = case.cost(export).exported.all.mean;
    // What reads JSON may miss the last bit.
    assert!(
        (mean - expected).abs() <= 1e-14 * expected,
        "{mean} {expected}"
    );
    assert!(note["recorded"]["all"]["p99"].is_number());
    assert!(note["recipe"].as_str().unwrap().contains("0.5)/n"));
    note
}

fn numbers(value: &Value) -> Vec<f32> {
    let values = value.as_array().expect("an array").iter();
    values
        .map(|x| x.as_f64().expect("a number") as f32)
        .collect()
}

/// Checks everything that a KTX2 file says, and gives its texels.
fn read_ktx2(file: &File, case: &Case, export: &Export<'_>, format: ktx2::Format) -> Vec<u8> {
    let reader = ktx2::Reader::new(&file.bytes).expect("a KTX2 file");
    let header = reader.header();
    assert_eq!(header.format, Some(format));
    let sides = [header.pixel_width, header.pixel_height, header.pixel_depth];
    assert_eq!(sides.map(|side| side as usize), export.size());
    assert_eq!(
        [header.layer_count, header.face_count, header.level_count],
        [0, 1, 1]
    );
    let (descriptor, type_size) = ktx2::dfd::Basic::from_format(format).expect("a known format");
    assert_eq!(reader.basic_dfd(), Some(&descriptor));
    assert_eq!(header.type_size, type_size);
    let entries: Vec<_> = reader.key_value_data().collect();
    let keys: Vec<&str> = entries.iter().map(|(key, _)| *key).collect();
    assert_eq!(keys, ["KTXorientation", "KTXwriter", "sateen"]);
    assert_eq!(entries[0].1, b"rdi\0");
    assert!(
        reader
            .writer()
            .is_some_and(|tool| tool.starts_with("sateen "))
    );
    let json = entries[2].1.strip_suffix(b"\0").expect("it ends in 0");
    check_metadata(std::str::from_utf8(json).unwrap(), case, export);

    let levels: Vec<_> = reader.levels().collect();
    assert_eq!(levels.len(), 1);
    let texels = match header.supercompression_scheme {
        None => levels[0].data.to_vec(),
        Some(scheme) => {
            assert_eq!(scheme, ktx2::SupercompressionScheme::Zstandard);
            zstd::bulk::decompress(levels[0].data, levels[0].uncompressed_byte_length as usize)
                .expect("zstd")
        }
    };
    assert_eq!(texels.len() as u64, levels[0].uncompressed_byte_length);
    texels
}

#[test]
fn ktx2_reads_back_the_same_compressed_or_not() {
    for case in cases() {
        let export = case.export(Format::Ktx2);
        for supercompress in [true, false] {
            let files = case.files(&export, supercompress);
            assert_eq!((files.len(), files[0].extension), (1, "ktx2"));
            let format = ktx2::Format::R16G16B16A16_SFLOAT;
            let texels = read_ktx2(&files[0], case, &export, format);
            assert_eq!(texels, export.texels());
            case.assert_looks_up(&halves(&texels));
        }
        assert_eq!(
            export.parameters(),
            parameters(&case.table, &case.volume).as_slice()
        );
    }
}

#[test]
fn dds_reads_back_the_same_with_its_metadata_beside_it() {
    for case in cases() {
        let export = case.export(Format::Dds);
        let files = case.files(&export, true);
        let extensions: Vec<_> = files.iter().map(|file| file.extension).collect();
        assert_eq!(extensions, ["dds", "dds.json"]);
        let bytes = &files[0].bytes;
        let read = ddsfile::Dds::read(bytes.as_slice()).expect("a DDS file");
        assert_eq!(
            read.get_dxgi_format(),
            Some(ddsfile::DxgiFormat::R16G16B16A16_Float)
        );
        let sides = [read.get_width(), read.get_height(), read.get_depth()];
        assert_eq!(sides.map(|side| side as usize), export.size());
        assert_eq!(read.data, export.texels());
        case.assert_looks_up(&halves(&read.data));
        // By the offsets of Microsoft's DDS_HEADER and DDS_HEADER_DXT10.
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(&bytes[..4], b"DDS ");
        assert_eq!([word(16), word(12), word(24)], export.size());
        assert_eq!(word(8) & 0x80_0000, 0x80_0000, "it has a depth");
        assert_eq!(
            [word(80), word(88)],
            [0x4, 0],
            "its format is told by its code alone"
        );
        assert_eq!(word(112) & 0x20_0000, 0x20_0000, "it is a volume");
        assert_eq!(&bytes[84..88], b"DX10");
        assert_eq!([word(128), word(132)], [10, 4], "RGBA16F, 3D");
        assert_eq!(&bytes[148..], export.texels());
        check_metadata(&String::from_utf8_lossy(&files[1].bytes), case, &export);
    }
}

#[test]
fn an_exr_atlas_has_every_slab_in_its_place() {
    use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, Text, read};
    for case in cases() {
        let export = case.export(Format::Exr);
        let files = case.files(&export, true);
        let reader = read().no_deep_data().largest_resolution_level();
        let image = reader
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(std::io::Cursor::new(&files[0].bytes))
            .expect("an EXR file");
        let layer = image.layer_data;
        let json = match layer.attributes.other.get(&Text::from("sateen")) {
            Some(AttributeValue::Text(json)) => json.to_string(),
            other => panic!("{other:?}"),
        };
        let note = check_metadata(&json, case, &export);
        let atlas = &note["atlas"];
        let columns = atlas["columns"].as_u64().unwrap() as usize;
        let rows = atlas["rows"].as_u64().unwrap() as usize;
        let [width, height, depth] = case.volume.size();
        assert_eq!(numbers(&atlas["slab"]), [width as f32, height as f32]);
        assert_eq!(atlas["row_origin"], "top");
        assert_eq!(layer.size.0, columns * width);
        assert_eq!(layer.size.1, rows * height);
        assert!(columns * rows >= depth && columns * (rows - 1) < depth);
        let plane = |name: &str| {
            let channels = layer.channel_data.list.iter();
            let channel = channels
                .into_iter()
                .find(|channel| channel.name.eq(name))
                .expect("a channel");
            match &channel.sample_data {
                FlatSamples::F16(halves) => halves.clone(),
                _ => panic!("halves"),
            }
        };
        let planes = ["R", "G", "B", "A"].map(plane);
        let mut halves = Vec::new();
        for z in 0..depth {
            for y in 0..height {
                for x in 0..width {
                    let row = z / columns * height + y;
                    let at = row * layer.size.0 + z % columns * width + x;
                    halves.extend(planes.iter().map(|plane| plane[at].to_bits()));
                }
            }
        }
        case.assert_looks_up(&halves);
        assert_eq!(case.files(&export, true), files, "the same from run to run");
    }
}

#[test]
fn raw_texels_are_the_bytes_to_upload() {
    for case in cases() {
        let export = case.export(Format::Raw);
        let files = case.files(&export, true);
        let extensions: Vec<_> = files.iter().map(|file| file.extension).collect();
        assert_eq!(extensions, ["bin", "bin.json"]);
        assert_eq!(files[0].bytes, case.volume.to_bytes());
        case.assert_looks_up(&halves(&files[0].bytes));
        check_metadata(&String::from_utf8_lossy(&files[1].bytes), case, &export);
    }
}

/// By EXT_texture_shared_exponent, in f64.
fn shared_exponent(bytes: &[u8]) -> [f32; 3] {
    let word = u32::from_le_bytes(bytes.try_into().expect("4 bytes"));
    let unit = 2f64.powi((word >> 27) as i32 - 15 - 9);
    [0, 9, 18].map(|shift| (f64::from(word >> shift & 511) * unit) as f32)
}

/// The texels of BC6H blocks, by another library.
fn decoded_blocks(bytes: &[u8], [width, height, depth]: [usize; 3]) -> Vec<[f32; 3]> {
    let mut texels = vec![[0.0; 3]; width * height * depth];
    for (index, block) in bytes.chunks_exact(16).enumerate() {
        let mut halves = [0; 48];
        bcdec_rs::bc6h_half(block, &mut halves, 12, false);
        let column = index % (width / 4);
        let row = index / (width / 4);
        for (k, texel) in halves.chunks_exact(3).enumerate() {
            let at = (4 * row + k / 4) * width + 4 * column + k % 4;
            texels[at] = [0, 1, 2].map(|c| f16::from_bits(texel[c]).to_f32());
        }
    }
    texels
}

/// The recipe of threes at a texel's centre.
fn sateen_volume(
    texels: &[[f32; 3]],
    size: [usize; 3],
    pitch: usize,
    [x, y, z]: [usize; 3],
) -> [f32; 4] {
    let depth = size[2] as f32;
    let uvw_z = (z as f32 + 0.5) / depth;
    let texture = |z: f32| {
        let z = (z * depth - 0.5).round() as usize;
        texels[(z * size[1] + y) * size[0] + x]
    };
    let pitch = pitch as f32;
    let z = uvw_z * depth - 0.5;
    let k = ((z + 0.5) / pitch).floor();
    let t = z - pitch * k;
    let first = pitch * (k - k % 2.0);
    let s = texture((first + t + 0.5) / depth);
    let v = texture((first + pitch + t + 0.5) / depth);
    if k % 2.0 == 0.0 {
        [s[0], v[0], s[1], v[1]]
    } else {
        [s[1], v[1], s[2], v[2]]
    }
}

/// Where in a parameter array the first grid of every thread is.
fn grids(parameters: &[[f32; 4]]) -> Vec<usize> {
    let mut grids = Vec::new();
    for thread in 0..parameters[1][3] as usize {
        let record = &parameters[2 + 7 * thread..];
        let count = match record[0][3] as u32 {
            1 => 1,
            3 => 2,
            _ => 0,
        };
        grids.extend(record[6][..count].iter().map(|place| *place as usize));
    }
    grids
}

/// That another decoder and the recipe give what the export says is looked up.
fn check_threes(case: &Case, export: &Export<'_>, texels: &[[f32; 3]], pitch: usize) {
    let looked_up: Vec<[u16; 4]> = export.volume().texels().collect();
    let [width, height, _] = case.volume.size();
    let whole = parameters(&case.table, &case.volume);
    let packed = export.parameters();
    for (grid, other) in grids(&whole).into_iter().zip(grids(packed)) {
        let [_, _, n2, n3] = whole[grid + 1].map(|x| x as usize);
        let (first, packed_first) = (whole[grid][3] as usize, packed[other][3] as usize);
        assert_eq!(packed[other + 1][2] as usize, pitch);
        for k in 0..(n3 - 1).max(1) {
            for c in 0..n2 {
                for y in 0..height {
                    for x in 0..width {
                        let place = [x, y, packed_first + pitch * k + c];
                        let read = sateen_volume(texels, export.size(), pitch, place);
                        let at = ((first + n2 * k + c) * height + y) * width + x;
                        let expected = looked_up[at].map(|bits| f16::from_bits(bits).to_f32());
                        assert_eq!(read, expected, "node {k}, texel {x} {y} {c}");
                    }
                }
            }
        }
    }
}

/// What the metadata call the pitch.
fn pitch(file: &File) -> usize {
    let reader = ktx2::Reader::new(&file.bytes).expect("a KTX2 file");
    let entries: Vec<_> = reader.key_value_data().collect();
    let json = entries[2].1.strip_suffix(b"\0").expect("it ends in 0");
    let note: Value = serde_json::from_slice(json).expect("JSON");
    note["pitch"].as_u64().expect("a number") as usize
}

/// How much the mean error of a format may exceed that of halves.
fn assert_costs_at_most(case: &Case, export: &Export<'_>, share: f64) {
    let halves = case.cost(&case.export(Format::Raw)).exported.all.mean;
    let mean = case.cost(export).exported.all.mean;
    #[expect(clippy::print_stdout, reason = "figures to compare")]
    {
        println!("{}: {mean:.5}, as halves {halves:.5}", case.fabric.name);
    }
    assert!(
        mean <= halves + share,
        "{}: {mean}, {halves}",
        case.fabric.name
    );
}

#[test]
fn rgb9e5_takes_half_and_reads_back_by_its_recipe() {
    for case in cases() {
        let export = case.export(Format::Rgb9e5);
        let files = case.files(&export, true);
        let format = ktx2::Format::E5B9G9R9_UFLOAT_PACK32;
        let bytes = read_ktx2(&files[0], case, &export, format);
        assert_eq!(bytes, export.texels());
        let texels: Vec<_> = bytes.chunks_exact(4).map(shared_exponent).collect();
        check_threes(case, &export, &texels, pitch(&files[0]));
        assert_costs_at_most(case, &export, 0.003);
        let volume = case.volume.bytes();
        let mut grids = case.volume.grids().iter();
        if grids.all(|grid| grid.nodes()[3].count() > 1) && volume > 100_000 {
            // Half, and where an axis has an even number of nodes, one more.
            assert!(bytes.len() <= volume * 7 / 10);
        } else {
            println!("{}: {} of {volume} bytes", case.fabric.name, bytes.len());
        }
    }
}

#[test]
fn bc6h_reads_back_by_another_decoder() {
    for case in cases() {
        let export = case.export(Format::Bc6h);
        let files = case.files(&export, false);
        let format = ktx2::Format::BC6H_UFLOAT_BLOCK;
        let bytes = read_ktx2(&files[0], case, &export, format);
        let texels = decoded_blocks(&bytes, export.size());
        check_threes(case, &export, &texels, pitch(&files[0]));
        assert_costs_at_most(case, &export, 0.05);
    }
}

#[test]
fn a_table_without_grids_is_one_texel() {
    let suede = &cases()[2];
    for format in Format::ALL {
        let export = suede.export(format);
        let side = if format == Format::Bc6h { 4 } else { 1 };
        assert_eq!(export.size(), [side, side, 1]);
        let cost = suede.cost(&export);
        assert!(cost.exported.all.max < 1e-4, "{:?}", cost.exported);
    }
}

#[cfg(feature = "cli")]
mod tool {
    use super::*;
    use assert_cmd::Command;
    use predicates::str::contains;

    fn sateen() -> Command {
        Command::cargo_bin("sateen").expect("the tool is built")
    }

    #[test]
    fn export_writes_each_format_and_refuses_other_names() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let table = folder.path().join("felt.sateen");
        let bytes = cases()[1].table.to_bytes().expect("bytes");
        std::fs::write(&table, bytes).unwrap();
        for (format, output, others) in [
            ("ktx2", "a.ktx2", None),
            ("dds", "b.dds", Some("b.dds.json")),
            ("exr", "c.exr", None),
            ("raw", "d.bin", Some("d.bin.json")),
            ("rgb9e5", "e.ktx2", None),
            ("bc6h", "f.ktx2", None),
        ] {
            let run = |path: &str| {
                let mut command = sateen();
                command.arg("export").arg(&table);
                command.args(["--format", format, "--pairs", "64", "--json", "-o"]);
                command.arg(folder.path().join(path)).assert()
            };
            let output_text = run(output).success().get_output().stdout.clone();
            let json: Value = serde_json::from_slice(&output_text).expect("JSON");
            assert_eq!(json["format"], format);
            assert!(json["error"]["exported"]["all"]["mean"].is_number());
            for name in [Some(output), others].into_iter().flatten() {
                let written = std::fs::metadata(folder.path().join(name)).unwrap().len();
                let files = json["files"].as_array().unwrap();
                let of_file = |file: &&Value| {
                    file["path"]
                        .as_str()
                        .is_some_and(|path| path.ends_with(name))
                };
                let file = files.iter().find(of_file).expect("it is listed");
                assert_eq!(file["bytes"].as_u64(), Some(written));
            }
            run("wrong.png").code(2).stderr(contains("end in ."));
        }
        let mut command = sateen();
        command.arg("export").arg(&table);
        command.args(["--format", "dds", "--no-supercompression", "-o", "x.dds"]);
        command
            .assert()
            .code(2)
            .stderr(contains("--no-supercompression is for KTX2 files"));
    }
}
