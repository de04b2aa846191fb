//! A sphere and a sheet of cloth in a window, or the picture of `sateen render sphere` without one.

mod picture;
mod surface;

use std::f32::consts::PI;
use std::path::{Path, PathBuf};

use bevy::app::AppExit;
use bevy::asset::AssetPath;
use bevy::camera::Exposure;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;

use sateen_bevy::{Cloth, ClothPlugin, ClothSettings};

const USAGE: &str = "\
usage: sateen-bevy [TABLE] [OPTIONS]

TABLE                    a .sateen file [default: denim of examples/web/tables]
--mib N                  the most MiB of its volume, 1 to 64 [default: 1]
--screenshot FILE        write the sphere of `sateen render`, as PNG, and exit; of that picture:
--size N                 rows, 1 to 4096 [default: 512]
--light-deg A            how far the light is turned from the camera to the right [default: 0]
--light-elevation-deg A  how far it is raised [default: 0]";

const DENIM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../web/tables/denim.sateen");

fn main() -> AppExit {
    match Options::from_args(std::env::args().skip(1)) {
        Ok(options) => run(options),
        Err(message) => {
            eprintln!("{message}\n\n{USAGE}");
            AppExit::from_code(2)
        }
    }
}

#[derive(Resource)]
struct Options {
    table: PathBuf,
    max_bytes: usize,
    screenshot: Option<PathBuf>,
    size: u32,
    light_deg: f32,
    light_elevation_deg: f32,
}

impl Options {
    fn from_args(mut args: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            table: DENIM.into(),
            max_bytes: 1 << 20,
            screenshot: None,
            size: 512,
            light_deg: 0.0,
            light_elevation_deg: 0.0,
        };
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or(format!("{arg} needs a value"));
            let count = |text: String, most: u32| match text.parse() {
                Ok(number) if (1..=most).contains(&number) => Ok(number),
                _ => Err(format!("{arg} {text}: not a number from 1 to {most}")),
            };
            let angle = |text: String| match text.parse::<f32>() {
                Ok(angle) if angle.is_finite() => Ok(angle),
                _ => Err(format!("{arg} {text}: not an angle in degrees")),
            };
            match arg.as_str() {
                "--mib" => options.max_bytes = (count(value()?, 64)? as usize) << 20,
                "--screenshot" => options.screenshot = Some(value()?.into()),
                "--size" => options.size = count(value()?, 4096)?,
                "--light-deg" => options.light_deg = angle(value()?)?,
                "--light-elevation-deg" => options.light_elevation_deg = angle(value()?)?,
                _ if arg.starts_with('-') => return Err(format!("{arg}: no such option")),
                _ => options.table = arg.into(),
            }
        }
        Ok(options)
    }
}

fn run(options: Options) -> AppExit {
    let table = match options.table.canonicalize() {
        Ok(table) => table,
        Err(error) => {
            eprintln!("{}: {error}", options.table.display());
            return AppExit::error();
        }
    };
    let folder = table.parent().unwrap_or(Path::new("/"));
    let assets = AssetPlugin {
        file_path: folder.to_string_lossy().into_owned(),
        ..default()
    };
    let mut app = App::new();
    let plugins = DefaultPlugins.set(assets);
    match &options.screenshot {
        None => app
            .add_plugins(plugins)
            .add_systems(Startup, scene)
            .add_systems(Update, (dye, orbit)),
        Some(_) => app
            .add_plugins(picture::without_window(plugins))
            .add_systems(Startup, picture::scene)
            .add_systems(Update, picture::give_up),
    };
    app.add_plugins(ClothPlugin).insert_resource(options).run()
}

/// The table that was asked for.
fn load(assets: &AssetServer, options: &Options) -> Handle<Cloth> {
    let max_bytes = options.max_bytes;
    let name = options.table.file_name().unwrap_or_default();
    assets
        .load_builder()
        .with_settings(move |settings: &mut ClothSettings| settings.max_bytes = max_bytes)
        .load(AssetPath::from_path(Path::new(name)))
}

/// A light that is turned from +z to the right and raised, in degrees, with or without shadows. Under it a white Lambertian surface that
/// faces it has radiance 1 at Bevy's default exposure: its irradiance is π.
fn light(azimuth: f32, elevation: f32, shadow_maps_enabled: bool) -> impl Bundle {
    let [y, x] = [azimuth, -elevation].map(f32::to_radians);
    (
        DirectionalLight {
            illuminance: PI / Exposure::default().exposure(),
            shadow_maps_enabled,
            ..default()
        },
        Transform::from_rotation(Quat::from_euler(EulerRot::YXZ, y, x, 0.0)),
    )
}

/// What is dyed once it is there.
#[derive(Component)]
struct Sheet;

fn scene(
    mut commands: Commands,
    assets: Res<AssetServer>,
    options: Res<Options>,
    mut meshes: ResMut<Assets<Mesh>>,
) {
    let cloth = load(&assets, &options);
    commands.spawn((
        Mesh3d(meshes.add(surface::sphere(1.0))),
        MeshMaterial3d(cloth.clone()),
        Transform::from_xyz(-1.2, 0.0, 0.0),
    ));
    commands.spawn((
        Sheet,
        Mesh3d(meshes.add(surface::sheet(2.2, 2.0))),
        MeshMaterial3d(cloth),
        Transform::from_xyz(1.3, 0.0, 0.0),
    ));
    commands.spawn(light(35.0, 30.0, true));
    // Not Bevy's default, which needs the feature `tonemapping_luts`.
    commands.spawn((Camera3d::default(), Tonemapping::None, Transform::default()));
}

/// Dyes the sheet's first thread red, as soon as the table is loaded.
fn dye(
    mut loaded: MessageReader<AssetEvent<Cloth>>,
    mut cloths: ResMut<Assets<Cloth>>,
    mut sheet: Single<&mut MeshMaterial3d<Cloth>, With<Sheet>>,
) {
    for event in loaded.read() {
        if event.is_loaded_with_dependencies(&sheet.0)
            && let Some(mut dyed) = cloths.get(&sheet.0).cloned()
        {
            dyed.dyes[0] = LinearRgba::rgb(0.4, 0.02, 0.02);
            sheet.0 = cloths.add(dyed);
        }
    }
}

/// The camera swings before the cloth.
fn orbit(time: Res<Time>, mut camera: Single<&mut Transform, With<Camera3d>>) {
    let angle = (0.5 * time.elapsed_secs()).sin();
    let from = 6.0 * Vec3::new(angle.sin(), 0.2, angle.cos());
    **camera = Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y);
}
