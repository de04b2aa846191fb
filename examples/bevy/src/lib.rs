//! Cloth in Bevy: a material, and a loader that makes one of a `.sateen` file.
//!
//! ```no_run
//! # use bevy::prelude::*;
//! # use sateen_bevy::{Cloth, ClothPlugin};
//! # fn spawn(mut commands: Commands, assets: Res<AssetServer>, mut meshes: ResMut<Assets<Mesh>>) {
//! // App::new().add_plugins((DefaultPlugins, ClothPlugin))
//! let sphere = Sphere::new(1.0).mesh().uv(96, 48).with_generated_tangents();
//! commands.spawn((
//!     Mesh3d(meshes.add(sphere.expect("it has normals and coordinates"))),
//!     MeshMaterial3d(assets.load::<Cloth>("denim.sateen")),
//! ));
//! # }
//! ```

use bevy::asset::io::Reader;
use bevy::asset::{AssetLoader, LoadContext, RenderAssetUsages, uuid_handle};
use bevy::image::ImageSampler;
use bevy::mesh::MeshVertexBufferLayoutRef;
use bevy::pbr::{MaterialPipeline, MaterialPipelineKey};
use bevy::prelude::*;
use bevy::render::render_resource::{
    AsBindGroup, Extent3d, RenderPipelineDescriptor, SpecializedMeshPipelineError,
    TextureDimension, TextureFormat,
};
use bevy::render::storage::ShaderBuffer;
use bevy::shader::ShaderRef;
use sateen::shader::{WGSL, parameters};
use sateen::table::Table;
use sateen::volume::{self, Volume};
use serde::{Deserialize, Serialize};

/// [`Cloth`], and the loader of it.
pub struct ClothPlugin;

const SHADER: Handle<Shader> = uuid_handle!("7d8f1c8e-64f5-4a1f-9a53-0d3c1f6a0b72");

impl Plugin for ClothPlugin {
    fn build(&self, app: &mut App) {
        let text = [include_str!("cloth.wgsl"), WGSL].concat();
        let shader = Shader::from_wgsl(text, "sateen/cloth.wgsl");
        let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
        shaders
            .insert(SHADER.id(), shader)
            .expect("an identity of its own is free");
        app.add_plugins(MaterialPlugin::<Cloth>::default())
            .register_asset_loader(ClothLoader);
    }
}

/// A fabric by its table. Meshes need tangents, which are the warp, and are lit by directional lights, from either side.
#[derive(Asset, AsBindGroup, TypePath, Debug, Clone)]
pub struct Cloth {
    /// The table's [`Volume`]: RGBA16F, linear filters, clamped to the edge, no mips.
    #[texture(0, dimension = "3d", visibility(fragment))]
    #[sampler(1, visibility(fragment))]
    pub volume: Handle<Image>,
    /// [`parameters`] of both.
    #[storage(2, read_only, visibility(fragment))]
    pub parameters: Handle<ShaderBuffer>,
    /// What the first four threads are dyed with, by alpha from not at all, as they are loaded, to wholly.
    #[uniform(3, visibility(fragment))]
    pub dyes: [LinearRgba; 4],
}

impl Material for Cloth {
    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        layout: &MeshVertexBufferLayoutRef,
        _: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        // A mesh without tangents is an error in the log, rather than one of the shader's.
        layout
            .0
            .get_layout(&[Mesh::ATTRIBUTE_TANGENT.at_shader_location(4)])?;
        descriptor.primitive.cull_mode = None;
        Ok(())
    }
}

/// Reads `.sateen` files, and makes volumes of them.
#[derive(TypePath)]
struct ClothLoader;

/// How to load a `.sateen` file.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct ClothSettings {
    /// The most bytes of the volume: see [`sateen::volume`] for what errors that means. 1 MiB takes about a second to make, 8 MiB some
    /// seconds.
    pub max_bytes: usize,
}

impl Default for ClothSettings {
    fn default() -> Self {
        Self { max_bytes: 1 << 20 }
    }
}

/// Why a file is no cloth.
#[derive(Debug, thiserror::Error)]
pub enum ClothError {
    /// It could not be read.
    #[error("cannot read the table: {0}")]
    Read(#[from] std::io::Error),
    /// It is no table.
    #[error("not a table: {0}")]
    Table(#[from] sateen::table::Error),
    /// It has no volume of that size.
    #[error("cannot make the table's volume: {0}")]
    Volume(#[from] volume::Error),
}

impl AssetLoader for ClothLoader {
    type Asset = Cloth;
    type Settings = ClothSettings;
    type Error = ClothError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &ClothSettings,
        context: &mut LoadContext<'_>,
    ) -> Result<Cloth, ClothError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        let table = Table::from_bytes(&bytes)?;
        let settings = volume::Settings {
            max_bytes: settings.max_bytes,
            ..volume::Settings::default()
        };
        let volume = Volume::new(&table, &settings)?;
        let numbers: Vec<Vec4> = parameters(&table, &volume)
            .into_iter()
            .map(Vec4::from_array)
            .collect();
        Ok(Cloth {
            volume: context.add_labeled_asset("volume".to_owned(), image(&volume)),
            parameters: context.add_labeled_asset("parameters".to_owned(), numbers.into()),
            dyes: [LinearRgba::NONE; 4],
        })
    }

    fn extensions(&self) -> &[&str] {
        &["sateen"]
    }
}

/// The volume as a texture.
fn image(volume: &Volume) -> Image {
    // At most 2048 texels along a side.
    let [width, height, depth_or_array_layers] = volume.size().map(|side| side as u32);
    let size = Extent3d {
        width,
        height,
        depth_or_array_layers,
    };
    let mut image = Image::new(
        size,
        TextureDimension::D3,
        volume.to_bytes(),
        TextureFormat::Rgba16Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    // Clamped to the edge, too.
    image.sampler = ImageSampler::linear();
    image
}
