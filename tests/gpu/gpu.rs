//! Compute shaders on whatever graphics hardware there is; else on Mesa's software.

use sateen::volume::{self, Volume};

/// Whether a test may be skipped for what the machine lacks.
pub fn skip(what: &str) {
    assert!(
        std::env::var("SATEEN_REQUIRE_ALL").as_deref() != Ok("1"),
        "{what}, which SATEEN_REQUIRE_ALL=1 requires"
    );
    eprintln!("SKIPPED: {what}");
}

pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
}

impl Gpu {
    /// With what of `features` the adapter has; none where there is no adapter.
    pub fn new(features: wgpu::Features) -> Option<Self> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(descriptor);
        let options = wgpu::RequestAdapterOptions::default();
        let Ok(adapter) = pollster::block_on(instance.request_adapter(&options)) else {
            skip("there is no Vulkan adapter (Debian: mesa-vulkan-drivers)");
            return None;
        };
        println!("{:?}", adapter.get_info());
        let device = adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: features & adapter.features(),
            required_limits: adapter.limits(),
            ..Default::default()
        });
        let (device, queue) = pollster::block_on(device).expect("a device");
        Some(Self { device, queue })
    }

    fn layout(&self) -> wgpu::BindGroupLayout {
        // What SPIR-V says of buffers that are only read gets lost on the way.
        let buffer = || wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: false },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let types = [
            buffer(),
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: true },
                view_dimension: wgpu::TextureViewDimension::D3,
                multisampled: false,
            },
            wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            buffer(),
            buffer(),
        ];
        let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let entries: Vec<_> = (0..).zip(types).map(entry).collect();
        self.device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: None,
                entries: &entries,
            })
    }

    pub fn pipeline(&self, source: wgpu::ShaderSource<'_>) -> wgpu::ComputePipeline {
        let module = self
            .device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source,
            });
        let layout = self.layout();
        let layout = self
            .device
            .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                bind_group_layouts: &[Some(&layout)],
                ..Default::default()
            });
        self.device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: Some(&layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: Default::default(),
                cache: None,
            })
    }

    fn buffer(&self, numbers: &[[f32; 4]], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let bytes: Vec<u8> = numbers
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes.len() as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&buffer, 0, &bytes);
        buffer
    }

    fn texture(&self, volume: &Volume) -> wgpu::TextureView {
        let [width, height, depth] = volume.size().map(|side| side as u32);
        let size = wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: depth,
        };
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        self.queue.write_texture(
            texture.as_image_copy(),
            &volume.to_bytes(),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(volume::TEXEL_BYTES as u32 * width),
                rows_per_image: Some(height),
            },
            size,
        );
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Runs `pipeline` once for every value.
    pub fn run(&self, pipeline: &wgpu::ComputePipeline, bound: &Bound, count: usize) {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        Self::pass(&mut encoder, pipeline, bound, count, None);
        self.queue.submit([encoder.finish()]);
    }

    pub fn pass(
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::ComputePipeline,
        bound: &Bound,
        count: usize,
        timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: None,
            timestamp_writes,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bound.group, &[]);
        pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
    }

    /// Waits until all that was submitted is done.
    pub fn wait(&self) {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .expect("it ends");
    }

    /// A buffer's bytes.
    pub fn bytes(&self, buffer: &wgpu::Buffer) -> Vec<u8> {
        let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: buffer.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
        self.queue.submit([encoder.finish()]);
        copy.map_async(wgpu::MapMode::Read, .., |result| result.expect("mapped"));
        self.wait();
        copy.get_mapped_range(..).expect("mapped").to_vec()
    }

    /// The values.
    pub fn read(&self, bound: &Bound) -> Vec<[f32; 4]> {
        let bytes = self.bytes(&bound.values);
        let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let numbers: Vec<f32> = bytes.chunks_exact(4).map(number).collect();
        numbers.as_chunks().0.to_vec()
    }
}

/// What shaders are bound to: parameters, volume, filter, pairs and values, in this order.
pub struct Bound {
    group: wgpu::BindGroup,
    values: wgpu::Buffer,
}

impl Bound {
    pub fn new(
        gpu: &Gpu,
        parameters: &[[f32; 4]],
        volume: &Volume,
        pairs: &[[f32; 4]],
        values: usize,
    ) -> Self {
        use wgpu::BufferUsages as Usage;
        let parameters = gpu.buffer(parameters, Usage::STORAGE);
        let pairs = gpu.buffer(pairs, Usage::STORAGE);
        let values = gpu.buffer(&vec![[0.0; 4]; values], Usage::STORAGE | Usage::COPY_SRC);
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let view = gpu.texture(volume);
        let resources = [
            parameters.as_entire_binding(),
            wgpu::BindingResource::TextureView(&view),
            wgpu::BindingResource::Sampler(&sampler),
            pairs.as_entire_binding(),
            values.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &gpu.layout(),
            entries: &entries,
        });
        Self { group, values }
    }
}
