//! DDS with a DX10 header: a volume of RGBA16F.

use ddsfile::{AlphaMode, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, Error, NewDxgiParams};

pub(super) fn write(size: [usize; 3], texels: &[u8]) -> Result<Vec<u8>, Error> {
    // Sides are at most `volume::MAX_SIDE`.
    let [width, height, depth] = size.map(|side| side as u32);
    let mut dds = Dds::new_dxgi(NewDxgiParams {
        height,
        width,
        depth: Some(depth),
        format: DxgiFormat::R16G16B16A16_Float,
        mipmap_levels: None,
        array_layers: None,
        caps2: Some(Caps2::VOLUME),
        is_cubemap: false,
        resource_dimension: D3D10ResourceDimension::Texture3D,
        // Alpha is a number like the others, but older readers refuse a file that says so (Microsoft, DDS_HEADER_DXT10, miscFlags2).
        alpha_mode: AlphaMode::Unknown,
    })?;
    dds.data = texels.to_vec();
    let mut bytes = Vec::new();
    dds.write(&mut bytes)?;
    Ok(bytes)
}
