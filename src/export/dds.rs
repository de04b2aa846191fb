//! DDS with a DX10 header: a volume of RGBA16F.

use ddsfile::{AlphaMode, Caps2, D3D10ResourceDimension, Dds, DxgiFormat, Error, NewDxgiParams};

/// Where the flags of the header are …
const FLAGS_AT: usize = 8;
/// … and that of a depth (Microsoft, DDS_HEADER).
const DDSD_DEPTH: u32 = 0x80_0000;
/// Where the flags of the pixel format are, and its bits per texel (Microsoft, DDS_PIXELFORMAT) …
const FORMAT_FLAGS_AT: usize = 80;
const FORMAT_BITS_AT: usize = 88;
/// … and the flag that says that the code, DX10, is all there is to read.
const DDPF_FOURCC: u32 = 0x4;

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
    // `ddsfile` leaves it out where there is one slab alone, but readers want it of every 3D texture (Microsoft, DirectXTex).
    bytes[FLAGS_AT + 2] |= (DDSD_DEPTH >> 16) as u8;
    // `ddsfile` also says that it is RGB of 64 bits. Readers that do not know DX10 and look at that first show noise.
    bytes[FORMAT_FLAGS_AT..][..4].copy_from_slice(&DDPF_FOURCC.to_le_bytes());
    bytes[FORMAT_BITS_AT..][..4].fill(0);
    Ok(bytes)
}
