//! The picture of `sateen render sphere --samples 1`: what its camera sees, by its light, at its exposure.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::time::Duration;

use bevy::app::{AppExit, PluginGroupBuilder, ScheduleRunnerPlugin};
use bevy::asset::LoadState;
use bevy::camera::{Hdr, RenderTarget, ScalingMode};
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::gpu_readback::{Readback, ReadbackComplete};
use bevy::render::render_resource::{TextureFormat, TextureUsages};
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;

use crate::{Options, light, load, surface};
use sateen_bevy::Cloth;

/// Half the height of the picture is 1.
const RADIUS: f32 = 0.96;
/// When there should have been something to see, in seconds after the program started.
const PATIENCE: f32 = 120.0;

/// Neither window nor event loop; frames as soon as can be, with their shaders.
pub(crate) fn without_window(plugins: PluginGroupBuilder) -> PluginGroupBuilder {
    plugins
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin {
            synchronous_pipeline_compilation: true,
            ..default()
        })
        .disable::<WinitPlugin>()
        .add(ScheduleRunnerPlugin::run_loop(Duration::ZERO))
}

/// What is waited for.
#[derive(Resource)]
pub(crate) struct Waiting {
    cloth: Handle<Cloth>,
    seconds: f32,
}

pub(crate) fn scene(
    mut commands: Commands,
    assets: Res<AssetServer>,
    options: Res<Options>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut images: ResMut<Assets<Image>>,
) {
    let cloth = load(&assets, &options);
    commands.insert_resource(Waiting {
        cloth: cloth.clone(),
        seconds: 0.0,
    });
    commands.spawn((
        Mesh3d(meshes.add(surface::sphere(RADIUS))),
        MeshMaterial3d(cloth),
    ));
    commands.spawn(light(options.light_deg, options.light_elevation_deg, false));

    let mut target =
        Image::new_target_texture(options.size, options.size, TextureFormat::Rgba32Float, None);
    target.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    let target = images.add(target);
    commands
        .spawn(Readback::texture(target.clone()))
        .observe(take);
    commands.spawn((
        Camera3d::default(),
        Camera {
            clear_color: Color::NONE.into(),
            ..default()
        },
        RenderTarget::Image(target.into()),
        Projection::from(OrthographicProjection {
            scaling_mode: ScalingMode::FixedVertical {
                viewport_height: 2.0,
            },
            ..OrthographicProjection::default_3d()
        }),
        Transform::from_xyz(0.0, 0.0, 2.0),
        Hdr,
        Msaa::Off,
        Tonemapping::None,
    ));
}

/// Writes the first frame that has cloth in it.
fn take(frame: On<ReadbackComplete>, options: Res<Options>, mut exit: MessageWriter<AppExit>) {
    let side = options.size as usize;
    if frame.data.len() < side {
        return;
    }
    // Rows are padded.
    let rows = frame.data.chunks_exact(frame.data.len() / side);
    let pixels: Vec<[f32; 4]> = rows
        .flat_map(|row| row.chunks_exact(16).take(side))
        .map(|bytes| {
            let value = |k: usize| f32::from_le_bytes([0, 1, 2, 3].map(|byte| bytes[4 * k + byte]));
            [0, 1, 2, 3].map(value)
        })
        .collect();
    if let Some(path) = &options.screenshot
        && pixels.iter().any(|pixel| pixel[3] > 0.0)
    {
        exit.write(match write(path, options.size, &pixels) {
            Ok(()) => AppExit::Success,
            Err(error) => {
                eprintln!("cannot write {}: {error}", path.display());
                AppExit::error()
            }
        });
    }
}

/// What a screen shows of linear radiance: sRGB, as sateen has it.
fn write(path: &Path, size: u32, pixels: &[[f32; 4]]) -> Result<(), png::EncodingError> {
    let srgb = |value: f32| match value {
        ..=0.003_130_8 => 12.92 * value,
        _ => 1.055 * value.powf(1.0 / 2.4) - 0.055,
    };
    let shown = |value: f32| (255.0 * srgb(value.max(0.0))).round() as u8;
    let bytes: Vec<u8> = pixels
        .iter()
        .flat_map(|[r, g, b, a]| [shown(*r), shown(*g), shown(*b), (255.0 * a) as u8])
        .collect();
    let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), size, size);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()
}

/// Ends where there is nothing more to wait for.
pub(crate) fn give_up(
    assets: Res<AssetServer>,
    time: Res<Time<Real>>,
    mut waiting: ResMut<Waiting>,
    mut exit: MessageWriter<AppExit>,
) {
    match assets.load_state(&waiting.cloth) {
        // Bevy has logged why.
        LoadState::Failed(_) => {
            exit.write(AppExit::error());
        }
        _ => waiting.seconds += time.delta_secs(),
    }
    if waiting.seconds > PATIENCE {
        eprintln!("nothing was drawn in {PATIENCE} seconds");
        exit.write(AppExit::error());
    }
}
