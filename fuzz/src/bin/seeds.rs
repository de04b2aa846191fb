//! Writes the seeds of every target into `fuzz/seeds/`: the library's fabrics, patterns and their images, tables of every kind,
//! files of pairs, scenes, meshes, images, recordings.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sateen::bake::{Direct, Preset, Request, Scope, Settings, bake};
use sateen::chart::Chart;
use sateen::fabric::Fabric;
use sateen::needs::{Directions, Needs};
use sateen::progress::Progress;
use sateen::table::Table;

const HEADER: &str = "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z";
/// Rows of the golden files: the fuzzer's inputs are small.
const GOLDEN_LINES: usize = 12;

fn main() -> io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let repository = root.join("..");
    let folder = |target: &str| -> io::Result<PathBuf> {
        let path = root.join("seeds").join(target);
        fs::create_dir_all(&path)?;
        Ok(path)
    };
    let (table, repaired) = (folder("table")?, folder("table_repaired")?);
    for (name, bytes) in tables(&repository)? {
        fs::write(table.join(&name), &bytes)?;
        fs::write(repaired.join(&name), &bytes)?;
        if let Some(stored) = with_stored_chunks(&bytes) {
            fs::write(table.join(format!("{name}-stored")), &stored)?;
            fs::write(repaired.join(format!("{name}-stored")), &stored)?;
        }
    }
    write_fabrics(&repository.join("tables/fabrics"), &folder("fabric")?)?;
    write_patterns(&repository.join("tables/patterns"), &folder("pattern")?)?;
    write_pairs(&repository.join("tests/data"), &folder("pairs")?)?;
    for path in files(&repository.join("tables/scenes"))? {
        fs::copy(
            &path,
            folder("scene")?.join(path.file_name().unwrap_or_default()),
        )?;
    }
    write_meshes(&folder("mesh")?)?;
    write_images(&folder("image")?)?;
    let needs = [Needs::none(), Needs::everything()];
    for (index, needs) in needs.iter().enumerate() {
        fs::write(folder("needs")?.join(index.to_string()), needs.to_bytes())?;
    }
    for (extension, targets) in [
        ("sateen", &["table", "table_repaired"][..]),
        ("toml", &["fabric"]),
        ("csv", &["pairs"]),
    ] {
        for target in targets {
            copy_corrupt(&repository, extension, &folder(target)?)?;
        }
    }
    Ok(())
}

/// A triangle in each format, after the byte that the target takes it by.
fn write_meshes(folder: &Path) -> io::Result<()> {
    let obj =
        "\0v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n";
    fs::write(folder.join("obj"), obj)?;
    // Positions and texture coordinates of a triangle: 0, 0, 0, 1, 0, 0, 0, 1, 0; 0, 0, 1, 0, 0, 1.
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/";
    let gltf = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}}}}]}}],"buffers":[{{"byteLength":60,"uri":"data:application/octet-stream;base64,{data}"}}],"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}}]}}"#
    );
    fs::write(folder.join("gltf"), format!("\u{1}{gltf}"))?;
    Ok(())
}

/// Small ones of every kind that the image crate writes.
fn write_images(folder: &Path) -> io::Result<()> {
    use image::{DynamicImage, ImageFormat};
    let rgb = DynamicImage::ImageRgba8(image::RgbaImage::from_fn(5, 3, |x, y| {
        image::Rgba([40 * x as u8, 90 * y as u8, 7, 255])
    }));
    let kinds = [
        ("rgba8", rgb.clone(), ImageFormat::Png),
        ("grey8", rgb.to_luma8().into(), ImageFormat::Png),
        ("rgb16", rgb.to_rgb16().into(), ImageFormat::Png),
        ("float", rgb.to_rgba32f().into(), ImageFormat::OpenExr),
    ];
    for (name, image, format) in kinds {
        let mut bytes = io::Cursor::new(Vec::new());
        image
            .write_to(&mut bytes, format)
            .map_err(io::Error::other)?;
        fs::write(folder.join(name), bytes.into_inner())?;
    }
    Ok(())
}

/// Copies what was once read wrongly.
fn copy_corrupt(repository: &Path, extension: &str, to: &Path) -> io::Result<()> {
    for path in files(&repository.join("tests/data/corrupt"))? {
        if path.extension().is_some_and(|found| found == extension) {
            fs::copy(&path, to.join(path.file_name().unwrap_or_default()))?;
        }
    }
    Ok(())
}

/// Names and bytes of golden tables and of small ones baked for the purpose.
fn tables(repository: &Path) -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut tables = Vec::new();
    for path in files(&repository.join("tests/data/tables"))? {
        if path
            .extension()
            .is_some_and(|extension| extension == "sateen")
        {
            let name = path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            tables.push((name, fs::read(&path)?));
        }
    }
    // Segments alone, and tilts with segments.
    for fabric in ["denim", "silk-crepe-de-chine"] {
        for chart in Chart::ALL {
            let settings = Settings {
                chart: Some(chart),
                ..small(Direct::Never)
            };
            tables.push((
                format!("{fabric}-{chart:?}"),
                baked(fabric, settings.into()),
            ));
        }
        // Part of each, of one channel where the albedo is grey.
        let needs = some_needs();
        let request = Request {
            scope: Scope {
                needs: Some(&needs),
                fixed_albedo: true,
            },
            ..small(Direct::Never).into()
        };
        tables.push((format!("{fabric}-part"), baked(fabric, request)));
        tables.push((
            format!("{fabric}-direct"),
            baked(fabric, small(Direct::Always).into()),
        ));
    }
    // All of a thread in two grids: of four, three and two coordinates, and of one.
    for fabric in ["weft-knit-curve", "felt"] {
        let settings = small(Direct::Never);
        tables.push((format!("{fabric}-curve"), baked(fabric, settings.into())));
    }
    Ok(tables)
}

fn small(direct: Direct) -> Settings {
    Settings {
        max_bytes: 4 << 10,
        error_pairs: 64,
        tolerance: 1e-2,
        direct,
        ..Preset::Draft.settings()
    }
}

/// A lamp and a viewer in some parts of the hemisphere.
fn some_needs() -> Needs {
    let (mut lights, mut viewers) = (Directions::none(), Directions::none());
    lights.add_cap([0.48, -0.36, 0.8], 0.2);
    viewers.add_cap([0.0, 0.6, 0.8], 0.3);
    let mut needs = Needs::none();
    needs.add(&lights, &viewers);
    needs
}

fn baked(fabric: &str, request: Request<'_>) -> Vec<u8> {
    let fabric = Fabric::from_library(fabric).expect("it is in the library");
    let table = bake(&fabric, request, Progress::silent())
        .expect("nobody stops it")
        .table;
    table.to_bytes().expect("there is memory")
}

/// The same table with chunks that are not compressed, so that a mutation changes single samples.
fn with_stored_chunks(bytes: &[u8]) -> Option<Vec<u8>> {
    let table = Table::from_bytes(bytes).ok()?;
    Some(table.to_mappable_bytes())
}

fn write_fabrics(from: &Path, to: &Path) -> io::Result<()> {
    for path in files(from)? {
        fs::copy(&path, to.join(path.file_name().unwrap_or_default()))?;
    }
    Ok(())
}

/// Patterns are followed by a NUL and the file that they name.
fn write_patterns(from: &Path, to: &Path) -> io::Result<()> {
    let wale = fs::read_to_string(from.join("corduroy-wale.toml"))?;
    for path in files(from)? {
        let text = fs::read_to_string(&path)?;
        let name = path.file_name().unwrap_or_default();
        fs::write(to.join(name), format!("{text}\0{wale}"))?;
    }
    let material = "[[material]]\nname = \"a\"\nfabric = \"denim\"\n";
    let layouts = [
        (
            "checks",
            "checks = { materials = [\"a\", \"a\"], size = [1, 2] }",
        ),
        (
            "mask",
            "mask = { image = \"i\", materials = [\"a\"], size = [1, 2] }",
        ),
        (
            "albedo",
            "albedo = { image = \"i\", material = \"a\", size = [1, 2], scale = 0.5, threads = [\"warp\"] }",
        ),
    ];
    let image =
        image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([100 * x as u8, 200 * y as u8, 7]));
    let image = image::DynamicImage::from(image);
    for (layout_name, layout) in layouts {
        for (format_name, format) in [
            ("png", image::ImageFormat::Png),
            ("exr", image::ImageFormat::OpenExr),
        ] {
            let mut bytes = io::Cursor::new(Vec::new());
            let pixels = match format {
                image::ImageFormat::Png => image.clone(),
                _ => image.to_rgb32f().into(),
            };
            pixels
                .write_to(&mut bytes, format)
                .map_err(io::Error::other)?;
            let mut seed = format!("name = \"p\"\n{layout}\n{material}\0").into_bytes();
            seed.extend(bytes.into_inner());
            fs::write(to.join(format!("{layout_name}-{format_name}")), seed)?;
        }
    }
    Ok(())
}

fn write_pairs(from: &Path, to: &Path) -> io::Result<()> {
    for path in files(from)? {
        if path.extension().is_some_and(|extension| extension == "csv") {
            let text = fs::read_to_string(&path)?;
            let lines: Vec<&str> = text.lines().take(GOLDEN_LINES).collect();
            fs::write(
                to.join(path.file_name().unwrap_or_default()),
                lines.join("\n"),
            )?;
        }
    }
    for (name, rows) in [
        ("plain", "0,0,1,0,0.6,0.8\n0.6,0,0.8,-0.6,0,0.8\n"),
        (
            "not-unit",
            "0,0,3,0,6,8\n1e300,1e300,1e-300,1e-320,0,1e-320\n",
        ),
        ("quoted", "\"0\",\"0\",\"1\",\"0\",\"0\n\",\"1\"\r\n"),
        ("short-row", "0,0,1\n"),
        ("zero-vector", "0,0,1,0,0,0\n"),
        ("not-a-number", "0,0,NaN,0,0,inf\n"),
    ] {
        fs::write(to.join(name), format!("{HEADER}\n{rows}"))?;
    }
    fs::write(
        to.join("named"),
        format!("\u{feff}name,{HEADER},\"a \"\"note\"\"\"\na,0,0,1,0,0.6,0.8,\n"),
    )
}

/// The files of a folder in order of their names; none if there is no such folder.
fn files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
