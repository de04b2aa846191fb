//! The command line.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand, ValueEnum, value_parser};
use sateen::bake::{Direct, Preset};
use sateen::chart::Chart;
use sateen::export::Format;
use sateen::metrics::{DEFAULT_PAIRS, VALIDATION_SEED};
use sateen::model::{ModelKind, Rule};
use sateen::table::Encoding;

/// Bakes fabric BRDFs into small 4D tables, evaluates them, and tells what the approximation costs.
#[derive(Parser)]
#[command(version, max_term_width = 100)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) verb: Verb,
    /// Say nothing but errors on stderr.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
}

#[derive(Subcommand)]
pub(crate) enum Verb {
    Fabrics(FabricsArgs),
    Bake(BakeArgs),
    Info(InfoArgs),
    Eval(EvalArgs),
    Validate(ValidateArgs),
    Fit(FitArgs),
    Report(ReportArgs),
    Stress(StressArgs),
    Render(RenderArgs),
    Scene(ExplainArgs),
    Record(RecordArgs),
    Export(ExportArgs),
    Compare(CompareArgs),
}

/// List the fabrics of the library.
#[derive(clap::Args)]
pub(crate) struct FabricsArgs {
    /// Print every parameter as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Bake fabrics into tables and print the error of each.
#[derive(clap::Args)]
pub(crate) struct BakeArgs {
    /// Names from the library, or TOML files of fabrics; or of patterns, which are baked as the fabrics that they need.
    #[arg(value_name = "FABRIC|PATTERN", required_unless_present_any = ["all", "scene"])]
    pub(crate) fabrics: Vec<String>,
    /// Bake the whole library.
    #[arg(long, conflicts_with = "fabrics")]
    pub(crate) all: bool,
    /// Bake what a scene needs: its fabrics, and of these the pairs of directions that its cameras and lights can bring about. A
    /// TOML, glTF or GLB file, which `sateen scene` explains.
    #[arg(long, value_name = "SCENE", conflicts_with_all = ["fabrics", "all", "needs", "albedo", "variant"])]
    pub(crate) scene: Option<PathBuf>,
    /// Bake the pairs that were recorded alone; several recordings count together.
    #[arg(long, value_name = "FILE")]
    pub(crate) needs: Vec<PathBuf>,
    /// Whether albedos change at run time; grey ones that do not need half the bytes.
    #[arg(long, value_enum, value_name = "HOW", default_value_t = AlbedoArg::Varies)]
    pub(crate) albedo: AlbedoArg,
    /// The file to write, or the folder for several [default: NAME.sateen in the current folder].
    #[arg(short, long, value_name = "PATH")]
    pub(crate) output: Option<PathBuf>,
    /// Write files that are not compressed, twice as large: programs map these into memory and look them up where they are.
    #[arg(long, conflicts_with = "resume")]
    pub(crate) stored: bool,
    /// Keep the tables that are there already, whole and made from the same fabric with the same settings by the same version,
    /// and bake only the others.
    #[arg(long, conflicts_with_all = ["max_error", "max_bytes", "max_ns"])]
    pub(crate) resume: bool,
    /// How large and how accurate.
    #[arg(long, value_enum, default_value_t = PresetArg::Standard)]
    pub(crate) preset: PresetArg,
    /// The most mean relative error (0.01 or 1%); the cheapest table that keeps this and the other limits is baked, and if
    /// there is none, nothing is written and the exit status is 3.
    #[arg(long, value_name = "E", value_parser = parse_share, conflicts_with = "preset")]
    pub(crate) max_error: Option<f64>,
    /// The most bytes in memory, as 64KiB or 4MiB.
    #[arg(long, value_name = "N", value_parser = parse_size, conflicts_with = "preset")]
    pub(crate) max_bytes: Option<usize>,
    /// The most time per pair in nanoseconds, measured in batches on one core of this machine.
    #[arg(long, value_name = "T", value_parser = parse_nanoseconds, conflicts_with = "preset")]
    pub(crate) max_ns: Option<f64>,
    /// The four coordinates of the table [default: for each thread the better].
    #[arg(long, value_enum)]
    pub(crate) chart: Option<ChartArg>,
    /// How samples are stored [default: the preset's].
    #[arg(long, value_enum)]
    pub(crate) encoding: Option<EncodingArg>,
    /// Whether ρ is scaled, so that the fabric reflects nowhere more than arrives, as several published fits do.
    #[arg(long, value_enum, value_name = "HOW", default_value_t = EnergyArg::AsIs)]
    pub(crate) energy: EnergyArg,
    /// When threads are evaluated directly instead of from a grid [default: worthwhile; cheaper with limits]. Direct threads
    /// are fast in batches; single pairs are faster from grids.
    #[arg(long, value_enum, value_name = "WHEN", conflicts_with_all = ["max_error", "max_ns"])]
    pub(crate) direct: Option<DirectArg>,
    /// Which of the named albedos of a TOML file is the table's own [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Print sizes and errors as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Say what a table is and what made it.
#[derive(clap::Args)]
pub(crate) struct InfoArgs {
    #[arg(value_name = "TABLE")]
    pub(crate) table: PathBuf,
    /// Print everything, nodes included, as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the fabric's parameters as the TOML file that was baked.
    #[arg(long, conflicts_with = "json")]
    pub(crate) toml: bool,
}

/// Evaluate pairs of directions.
///
/// Reads CSV with the columns wi_x, wi_y, wi_z (to the light) and wr_x, wr_y, wr_z (to the viewer) in the surface frame: x
/// warp, y weft, z normal. Appends rho_r, rho_g, rho_b: BRDF × cosine, 1/sr, linear RGB. Other columns pass through.
#[derive(clap::Args)]
pub(crate) struct EvalArgs {
    /// A table, a name from the library, or the TOML file of a fabric or a pattern.
    #[arg(value_name = "TABLE|FABRIC|PATTERN")]
    pub(crate) subject: String,
    /// The CSV file of pairs, or - for stdin. For a pattern it has columns u and v, too.
    #[arg(long, value_name = "CSV")]
    pub(crate) pairs: PathBuf,
    /// The CSV file to write [default: stdout].
    #[arg(short, long, value_name = "CSV")]
    pub(crate) output: Option<PathBuf>,
    /// table, midpoint:N (the thesis takes 50), quadrature:N (N placed tilts per segment) or reference [default: table for a table, else reference].
    #[arg(long, value_parser = parse_evaluator)]
    pub(crate) evaluator: Option<Evaluator>,
    /// The folder of the tables that a pattern is evaluated with: what `bake PATTERN -o DIR` wrote.
    #[arg(long, value_name = "DIR")]
    pub(crate) tables: Option<PathBuf>,
    /// Which model of the fabric. Others than sadeghi have a section of their name in its TOML file, which `sateen fit` makes;
    /// irawan is translated from the threads where there is none.
    #[arg(long, default_value = SADEGHI, value_parser = evaluated_model())]
    pub(crate) model: ::std::option::Option<ModelKind>,
    /// Append S, V and P of every thread, and Q, too.
    #[arg(long)]
    pub(crate) components: bool,
    /// Fail where a table was not baked for a pair, rather than take the nearest value.
    #[arg(long)]
    pub(crate) strict: bool,
    /// Which of the named albedos of a TOML file to use [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
}

/// Measure tables against direct integration.
///
/// Relative error is max over channels of |table − direct| / (direct + 1 % of the mean), over pairs of which half are
/// cosine-weighted and half near highlights, the same for the same seed.
#[derive(clap::Args)]
pub(crate) struct ValidateArgs {
    #[arg(value_name = "TABLE", required = true)]
    pub(crate) tables: Vec<PathBuf>,
    /// Exit with status 3 when the mean relative error of any table exceeds this (0.01 or 1%).
    #[arg(long, value_name = "E", value_parser = parse_share)]
    pub(crate) max_error: Option<f64>,
    /// How many pairs of directions.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PAIRS as u32, value_parser = value_parser!(u32).range(1..=100_000_000))]
    pub(crate) pairs: u32,
    /// The seed that draws them. The error recorded in a table was measured with 2013.
    #[arg(long, value_name = "SEED", default_value_t = VALIDATION_SEED)]
    pub(crate) seed: u64,
    /// Threads to work with [default: all cores].
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Print JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Fit another model to a fabric.
///
/// Prints the section of its parameters and says what the mean relative error is, measured as `validate` measures tables.
#[derive(clap::Args)]
pub(crate) struct FitArgs {
    /// The model to fit.
    #[arg(value_name = "MODEL", value_parser = fitted_model())]
    pub(crate) model: ModelKind,
    /// A name from the library, or a TOML file.
    #[arg(value_name = "FABRIC")]
    pub(crate) fabric: String,
    /// The TOML file to write: the whole fabric with the section [default: the section to stdout].
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Which of the named albedos of a TOML file to fit to [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
}

/// Measure error, time and bytes of every evaluator.
///
/// Writes index.html, report.csv, report.json and plots. Every number of midpoints and every table is measured on the same
/// pairs, in turn and on one core; the figure to quote is the ratio to midpoint:50 in the same run.
#[derive(clap::Args)]
pub(crate) struct ReportArgs {
    /// Names from the library, or TOML files [default: the whole library].
    #[arg(value_name = "FABRIC")]
    pub(crate) fabrics: Vec<String>,
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// A rough report within seconds: few evaluators, a draft table, 512 pairs, one round of timing.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Presets to bake, with commas between them [default: all; fine takes minutes per fabric].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub(crate) presets: Option<Vec<PresetArg>>,
    /// Other sizes in memory to bake, as 64KiB,16MiB with a grid for every thread [default: 64KiB,256KiB,1MiB,4MiB,16MiB].
    #[arg(long, value_delimiter = ',', value_parser = parse_size, value_name = "LIST")]
    pub(crate) sizes: Option<Vec<usize>>,
    /// Bake no other sizes and encodings than those of the presets.
    #[arg(long, conflicts_with = "sizes")]
    pub(crate) no_sweep: bool,
    /// Fit no other models, which takes up to half a minute per fabric.
    #[arg(long)]
    pub(crate) no_fits: bool,
    /// Which of the named albedos of a TOML file to use [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// How many pairs of directions [default: 65536].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=10_000_000))]
    pub(crate) pairs: Option<u32>,
    /// The seed that draws them.
    #[arg(long, value_name = "SEED", default_value_t = VALIDATION_SEED)]
    pub(crate) seed: u64,
    /// Threads to bake and to measure error with [default: all cores]. Time is always that of one.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
}

/// Try every evaluator on stiff fabrics and extreme directions.
///
/// Drives each parameter of a fabric to its extremes, asks at directions that are hard, and writes stress.csv and stress.json:
/// what is finite, how far single precision is from double, where values step, and whether tables keep
/// their preset's promise. Exit status 3 if a case fails.
#[derive(clap::Args)]
pub(crate) struct StressArgs {
    /// Names from the library, or TOML files [default: polyester-lining, denim and velvet].
    #[arg(value_name = "FABRIC")]
    pub(crate) fabrics: Vec<String>,
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// A rough report within a minute: three values of each parameter, few pairs, and no tables unless --presets says so.
    #[arg(long)]
    pub(crate) quick: bool,
    /// Presets to bake in every case, with commas between them [default: draft,standard, which take an hour per fabric].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub(crate) presets: Option<Vec<PresetArg>>,
    /// Bake no tables, which is what takes long.
    #[arg(long, conflicts_with = "presets")]
    pub(crate) no_tables: bool,
    /// Which of the named albedos of a TOML file to use [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// How many pairs of each geometry [default: 200].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    pub(crate) pairs: Option<u32>,
    /// The seed that draws them.
    #[arg(long, value_name = "SEED", default_value_t = VALIDATION_SEED)]
    pub(crate) seed: u64,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
}

/// Take pictures of cloth on cylinders, on a sphere, as a curtain, or on a mesh.
///
/// Lights have irradiance π, so that white cloth which scatters evenly and faces one has radiance 1. A PNG shows radiance to the
/// power 1/2.2 at the --exposure, a transparent background, and what made it as text; an EXR has linear radiance without
/// --exposure.
#[derive(clap::Args)]
pub(crate) struct RenderArgs {
    #[command(subcommand)]
    pub(crate) scene: SceneArg,
}

/// What is rendered.
#[derive(Subcommand)]
pub(crate) enum SceneArg {
    /// Three upright cylinders, their warp vertical, horizontal and diagonal.
    ///
    /// Beside the picture the radiance across each of them is written, as a drawing and as numbers: the same name ending in
    /// .svg and .csv.
    Cylinders(PictureArgs),
    /// A sphere whose slices through the centre are cylinders of every orientation.
    Sphere(PictureArgs),
    /// A pleated curtain, its warp hanging down.
    Curtain(DrapeArgs),
    /// A trouser leg bent at the knee, its warp along the leg.
    Trousers(DrapeArgs),
    /// A mesh with texture coordinates, along the first of which the warp runs.
    Mesh {
        /// An OBJ, glTF or GLB file.
        #[arg(value_name = "MESH")]
        mesh: PathBuf,
        #[command(flatten)]
        drape: DrapeArgs,
    },
    /// A scene of cameras, lights and cloths, as a TOML, glTF or GLB file has it.
    Scene(StageArgs),
}

/// What happens to pairs that tables were not baked for.
#[derive(clap::Args)]
pub(crate) struct MissingArgs {
    /// Show in magenta where tables lack pairs.
    #[arg(long)]
    pub(crate) show_missing: bool,
    /// Fail where tables lack pairs, rather than take the nearest value.
    #[arg(long)]
    pub(crate) strict: bool,
}

/// How a picture of a scene is taken.
#[derive(clap::Args)]
pub(crate) struct StageArgs {
    /// A TOML, glTF or GLB file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// The picture to write, which ends in .png or .exr.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// The folder of the tables to take it with: what `bake --scene SCENE -o DIR` wrote [default: fabrics are integrated directly].
    #[arg(long, value_name = "DIR")]
    pub(crate) tables: Option<PathBuf>,
    /// Take it with the tables in this folder, too, and say how many pixels differ; 3 if any do.
    #[arg(long, value_name = "DIR", requires = "tables")]
    pub(crate) against: Option<PathBuf>,
    /// How many pictures to take, each from a camera, with lights and in a state drawn anew within their ranges; the last is
    /// written [default: one, in the middle of all ranges].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    pub(crate) draws: Option<u32>,
    /// The first of the seeds that draw them.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "draws")]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) missing: MissingArgs,
    /// Write the pairs that the pictures ask for, by cloth, into this folder, as recordings for `bake --needs`.
    #[arg(long, value_name = "DIR")]
    pub(crate) record: Option<PathBuf>,
    /// Rows and columns of the picture.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = value_parser!(u16).range(1..=4096))]
    pub(crate) size: u16,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = value_parser!(u32).range(1..=4096))]
    pub(crate) samples: u32,
    /// Stops by which a PNG is brighter.
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = parse_stops, allow_negative_numbers = true)]
    pub(crate) exposure: f64,
    /// Print what was found as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
}

/// Say what a scene needs of its fabrics, and what a bake for it leaves out.
#[derive(clap::Args)]
pub(crate) struct ExplainArgs {
    /// A TOML, glTF or GLB file.
    #[arg(value_name = "SCENE")]
    pub(crate) scene: PathBuf,
    /// How large and how accurate the tables would be.
    #[arg(long, value_enum, default_value_t = PresetArg::Standard)]
    pub(crate) preset: PresetArg,
    /// Draw which part of every table's box is needed, projected onto two coordinates at a time: FABRIC.svg in this folder.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: Option<PathBuf>,
    /// Write what is needed of each fabric as a recording, FABRIC.needs in this folder.
    #[arg(long, value_name = "DIR")]
    pub(crate) record: Option<PathBuf>,
    /// Print it as JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
}

/// Record pairs of directions that a program asked for, to bake these alone.
///
/// Programs in Rust call `Needs::add_pair` and write `Needs::to_bytes`; others may write CSV.
#[derive(clap::Args)]
pub(crate) struct RecordArgs {
    /// CSV files of pairs, as `eval` reads them, or - for stdin; and recordings, which are joined.
    #[arg(value_name = "CSV|NEEDS", required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// The recording to write, for `bake --needs`.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}

/// Write a table as a texture and parameters for shaders.
///
/// The texture's size, the bytes, and the error of the lookup in it against direct integration are printed. What it holds and how it is
/// read is in the file's metadata: the key `sateen` of KTX2, the attribute `sateen` of EXR, NAME.json beside others.
#[derive(clap::Args)]
pub(crate) struct ExportArgs {
    #[arg(value_name = "TABLE")]
    pub(crate) table: PathBuf,
    /// What to write.
    #[arg(long, value_enum)]
    pub(crate) format: FormatArg,
    /// The file to write, which ends in .ktx2, .dds, .exr or .bin as the format has it; DDS and raw texels get a NAME.json beside them.
    #[arg(short, long, value_name = "PATH")]
    pub(crate) output: PathBuf,
    /// The most bytes of the volume as RGBA16F, up to 64MiB; rgb9e5 takes half of it, bc6h an eighth.
    #[arg(long, value_name = "N", value_parser = parse_size, default_value = "8MiB")]
    pub(crate) max_bytes: usize,
    /// Leave the texels of a KTX2 file as they are, for readers without zstd.
    #[arg(long)]
    pub(crate) no_supercompression: bool,
    /// How many pairs of directions the error is measured on.
    #[arg(long, value_name = "N", default_value_t = 16_384, value_parser = value_parser!(u32).range(1..=100_000_000))]
    pub(crate) pairs: u32,
    /// The seed that draws them.
    #[arg(long, value_name = "SEED", default_value_t = VALIDATION_SEED)]
    pub(crate) seed: u64,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Print sizes and errors as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Tell how far a picture, such as an engine's screenshot, looks from one that is right.
///
/// PNG or EXR files of the same size, camera and framing. A PNG shows radiance by the power 1/2.2, as those of `sateen render` do, without
/// other tone mapping; of an EXR of several layers the first is read. What is transparent in both is left out; a picture that is opaque all
/// over has a black background, or none.
#[derive(clap::Args)]
pub(crate) struct CompareArgs {
    /// The picture.
    pub(crate) picture: PathBuf,
    /// The truth.
    pub(crate) truth: PathBuf,
    /// The most mean FLIP, from 0 to 1; beyond it the exit status is 3.
    #[arg(long, value_name = "E", value_parser = parse_share)]
    pub(crate) max_flip: Option<f64>,
    /// Print the differences as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// How cloth that hangs is looked at.
#[derive(clap::Args)]
pub(crate) struct DrapeArgs {
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    /// How far it is turned, its right side to the viewer, in degrees.
    #[arg(long, value_name = "A", default_value_t = 0.0, value_parser = parse_degrees, allow_negative_numbers = true)]
    pub(crate) turn_deg: f64,
}

/// How a picture is taken.
#[derive(clap::Args)]
pub(crate) struct PictureArgs {
    /// A name from the library, the TOML file of a fabric or a pattern, or a table.
    #[arg(value_name = "FABRIC|TABLE|PATTERN")]
    pub(crate) subject: String,
    /// The picture to write, which ends in .png or .exr.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// table, midpoint:N, quadrature:N or reference, as `eval` has them [default: table for a table, else quadrature:8].
    #[arg(long, value_parser = parse_evaluator, conflicts_with = "compare")]
    pub(crate) evaluator: Option<Evaluator>,
    /// Two evaluators, the second as the truth: writes both pictures, their difference and FLIP, the difference that the eye sees,
    /// and prints how large they are. Each is table, midpoint:N, quadrature:N, reference, another model's name as --model has
    /// it, or the file of a table of the same fabric, which is dyed like it.
    #[arg(long, num_args = 2, value_names = ["A", "B"], value_parser = parse_compared)]
    pub(crate) compare: Option<Vec<Compared>>,
    /// The folder of the tables that a pattern is evaluated with: what `bake PATTERN -o DIR` wrote.
    #[arg(long, value_name = "DIR")]
    pub(crate) tables: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) missing: MissingArgs,
    /// Which model of the fabric, as `eval` has them.
    #[arg(long, default_value = SADEGHI, value_parser = evaluated_model(), conflicts_with = "compare")]
    pub(crate) model: ::std::option::Option<ModelKind>,
    /// Rows of the picture. It has as many columns, but twice as many for cylinders.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = value_parser!(u16).range(1..=4096))]
    pub(crate) size: u16,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = value_parser!(u32).range(1..=4096))]
    pub(crate) samples: u32,
    /// How far the light is turned from the camera to the right, in degrees.
    #[arg(long, value_name = "A", value_parser = parse_degrees, allow_negative_numbers = true)]
    pub(crate) light_deg: Option<f64>,
    /// How far the light is raised, in degrees.
    #[arg(long, value_name = "A", value_parser = parse_degrees, allow_negative_numbers = true)]
    pub(crate) light_elevation_deg: Option<f64>,
    /// The direction to the light instead, or those to several of the same strength: x right, y up, z to the viewer, of any length
    /// [default: one at the camera; for curtains, trousers and meshes three, before them to the left, beside them to the right,
    /// and a weak one from the viewer].
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true, conflicts_with_all = ["light_deg", "light_elevation_deg"])]
    pub(crate) light: Vec<Direction>,
    /// Stops by which a PNG is brighter.
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = parse_stops, allow_negative_numbers = true)]
    pub(crate) exposure: f64,
    /// How often a pattern repeats across half the circumference, along a curtain, or along a mesh's texture coordinate of 1.
    #[arg(long, value_name = "N", default_value_t = 4.0, value_parser = parse_repeats)]
    pub(crate) repeats: f64,
    /// Store 32-bit floats in an EXR, not halves.
    #[arg(long)]
    pub(crate) float: bool,
    /// Print what --compare finds as JSON.
    #[arg(long, requires = "compare")]
    pub(crate) json: bool,
    /// Which of the named albedos of a TOML file to use [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// Threads to work with [default: all cores]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
}

/// A unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Direction(pub(crate) [f64; 3]);

/// One side of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Compared {
    Evaluator(Evaluator),
    Model(ModelKind),
    File(PathBuf),
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum PresetArg {
    /// At most 512 KiB in memory.
    Draft,
    /// At most 4 MiB in memory.
    Standard,
    /// At most 32 MiB in memory; takes minutes.
    Fine,
}

impl From<PresetArg> for Preset {
    fn from(preset: PresetArg) -> Self {
        match preset {
            PresetArg::Draft => Self::Draft,
            PresetArg::Standard => Self::Standard,
            PresetArg::Fine => Self::Fine,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum FormatArg {
    /// KTX2: a 3D texture of RGBA16F.
    Ktx2,
    /// DDS with a DX10 header: a 3D texture of RGBA16F.
    Dds,
    /// OpenEXR: all slabs of the volume side by side, halves.
    Exr,
    /// KTX2 of three channels that share an exponent: half the bytes, two fetches a lookup.
    Rgb9e5,
    /// KTX2 of BC6H blocks: an eighth of the bytes, two fetches a lookup; look at the error.
    Bc6h,
    /// RGBA16F without a header.
    Raw,
}

impl FormatArg {
    pub(crate) fn name(self) -> String {
        self.to_possible_value()
            .map_or(String::new(), |value| value.get_name().to_owned())
    }
}

impl From<FormatArg> for Format {
    fn from(format: FormatArg) -> Self {
        match format {
            FormatArg::Ktx2 => Self::Ktx2,
            FormatArg::Dds => Self::Dds,
            FormatArg::Exr => Self::Exr,
            FormatArg::Rgb9e5 => Self::Rgb9e5,
            FormatArg::Bc6h => Self::Bc6h,
            FormatArg::Raw => Self::Raw,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum ChartArg {
    /// (θ_h, θ_d, φ_d, roll).
    Thesis,
    /// (ψ of the half vector, θ_d, φ_d, φ_h).
    Highlight,
}

impl From<ChartArg> for Chart {
    fn from(chart: ChartArg) -> Self {
        match chart {
            ChartArg::Thesis => Self::Thesis,
            ChartArg::Highlight => Self::Highlight,
        }
    }
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum AlbedoArg {
    /// They may.
    Varies,
    /// They stay those of the fabric.
    Fixed,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub(crate) enum EnergyArg {
    /// Not: what is published is baked.
    AsIs,
    /// By one factor, which the table records, where it is needed.
    Clamp,
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum DirectArg {
    /// Never: all have grids.
    Never,
    /// Where that errs no more and costs no more.
    Worthwhile,
    /// Always: there are no grids.
    Always,
}

impl From<DirectArg> for Direct {
    fn from(direct: DirectArg) -> Self {
        match direct {
            DirectArg::Never => Self::Never,
            DirectArg::Worthwhile => Self::Worthwhile,
            DirectArg::Always => Self::Always,
        }
    }
}

#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum EncodingArg {
    /// 32-bit floats.
    F32,
    /// 16-bit integers.
    I16,
    /// 32-bit floats of the square root.
    SqrtF32,
    /// 16-bit integers of the square root.
    SqrtI16,
    /// 8-bit integers of the square root.
    SqrtI8,
}

impl From<EncodingArg> for Encoding {
    fn from(encoding: EncodingArg) -> Self {
        match encoding {
            EncodingArg::F32 => Self::F32,
            EncodingArg::I16 => Self::I16,
            EncodingArg::SqrtF32 => Self::SqrtF32,
            EncodingArg::SqrtI16 => Self::SqrtI16,
            EncodingArg::SqrtI8 => Self::SqrtI8,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Evaluator {
    Table,
    Direct(Rule),
}

const MAX_MIDPOINTS: u32 = 1_000_000;
const MAX_NODES: u32 = 64;

/// The model of which tables are made.
const SADEGHI: &str = "sadeghi";

/// A model that can be fitted, by name.
fn fitted_model() -> impl TypedValueParser<Value = ModelKind> {
    PossibleValuesParser::new(ModelKind::ALL.map(ModelKind::name))
        .map(|name| other_model(&name).expect("one of those names"))
}

/// A model to evaluate: none is Sadeghi's.
fn evaluated_model() -> impl TypedValueParser<Value = Option<ModelKind>> {
    let names = [SADEGHI]
        .into_iter()
        .chain(ModelKind::ALL.map(ModelKind::name));
    PossibleValuesParser::new(names).map(|name| other_model(&name))
}

fn other_model(name: &str) -> Option<ModelKind> {
    ModelKind::ALL.into_iter().find(|kind| kind.name() == name)
}

fn parse_evaluator(text: &str) -> Result<Evaluator, String> {
    let within = |count: &str, most: u32, rule: fn(u32) -> Rule| match count.parse() {
        Ok(count) if (1..=most).contains(&count) => Ok(Evaluator::Direct(rule(count))),
        _ => Err(format!("N is 1 to {most}")),
    };
    match text.split_once(':') {
        None if text == "table" => Ok(Evaluator::Table),
        None if text == "reference" => Ok(Evaluator::Direct(Rule::REFERENCE)),
        Some(("midpoint", count)) => within(count, MAX_MIDPOINTS, Rule::Midpoint),
        Some(("quadrature", count)) => within(count, MAX_NODES, Rule::Quadrature),
        _ => Err("it is one of table, midpoint:N, quadrature:N, reference".to_owned()),
    }
}

fn parse_compared(text: &str) -> Result<Compared, String> {
    if text.ends_with(".sateen") || text.contains(['/', '\\']) {
        return Ok(Compared::File(text.into()));
    }
    if let Some(kind) = other_model(text) {
        return Ok(Compared::Model(kind));
    }
    parse_evaluator(text)
        .map(Compared::Evaluator)
        .map_err(|error| {
            format!("{error}, another model's name, or the file of a table, which ends in .sateen")
        })
}

fn parse_degrees(text: &str) -> Result<f64, String> {
    parse_within(text, -360.0..=360.0, "degrees")
}

fn parse_stops(text: &str) -> Result<f64, String> {
    parse_within(text, -64.0..=64.0, "stops")
}

fn parse_repeats(text: &str) -> Result<f64, String> {
    parse_within(text, 1e-3..=1e4, "repeats")
}

fn parse_within(text: &str, range: RangeInclusive<f64>, what: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => Err(format!(
            "it is a number of {what}, from {} to {}",
            range.start(),
            range.end()
        )),
    }
}

fn parse_direction(text: &str) -> Result<Direction, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
    let wrong = || "it is three numbers as 0.5,0,1, not all 0".to_owned();
    let [x, y, z] = numbers
        .ok()
        .and_then(|numbers| <[f64; 3]>::try_from(numbers).ok())
        .ok_or_else(wrong)?;
    let length = x.hypot(y).hypot(z);
    if length > 0.0 && length.is_finite() {
        Ok(Direction([x, y, z].map(|component| component / length)))
    } else {
        Err(wrong())
    }
}

fn parse_nanoseconds(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(ns) if ns > 0.0 && ns.is_finite() => Ok(ns),
        _ => Err("it is a number of nanoseconds above 0".to_owned()),
    }
}

fn parse_share(text: &str) -> Result<f64, String> {
    let (number, unit) = text
        .strip_suffix('%')
        .map_or((text, 1.0), |number| (number, 0.01));
    match number.trim().parse::<f64>() {
        Ok(share) if share >= 0.0 && share.is_finite() => Ok(share * unit),
        _ => Err("it is a share like 0.01 or 1%".to_owned()),
    }
}

/// From what a grid needs at least to the most that a reader takes.
const SIZES: RangeInclusive<usize> = 16 << 10..=256 << 20;

fn parse_size(text: &str) -> Result<usize, String> {
    let units = [("KiB", 10), ("MiB", 20)];
    let size = units.iter().find_map(|(unit, bits)| {
        let number: usize = text.strip_suffix(unit)?.parse().ok()?;
        number.checked_mul(1 << bits)
    });
    size.filter(|size| SIZES.contains(size))
        .ok_or_else(|| "it is a size like 64KiB or 2MiB, from 16KiB to 256MiB".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Args::command().debug_assert();
    }

    #[test]
    fn evaluators_shares_and_sizes_are_understood() {
        for (text, rule) in [
            ("midpoint:50", Rule::THESIS),
            ("quadrature:4", Rule::Quadrature(4)),
            ("reference", Rule::REFERENCE),
        ] {
            assert_eq!(parse_evaluator(text), Ok(Evaluator::Direct(rule)));
        }
        for bad in [
            "midpoint",
            "midpoint:0",
            "midpoint:-1",
            "midpoint:9999999",
            "quadrature:0",
            "quadrature:65",
            "quad",
            "",
        ] {
            assert!(parse_evaluator(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_share("1%"), Ok(0.01));
        assert_eq!(parse_share("0.5"), Ok(0.5));
        for bad in ["", "%", "-1", "nan", "inf", "x"] {
            assert!(parse_share(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_size("64KiB"), Ok(65536));
        for bad in [
            "",
            "64",
            "1B",
            "15KiB",
            "257MiB",
            "-1MiB",
            "99999999999999999MiB",
        ] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }
}
