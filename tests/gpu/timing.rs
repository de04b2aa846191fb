//! How long does a pixel take, by a table and by direct integration? On whatever graphics hardware there is.
//!
//! `cargo run --release --manifest-path tests/gpu/Cargo.toml --example timing -- denim.sateen [PIXELS]`
//!
//! Every pixel is a point of a sphere that is lit from the side, as in `sateen render sphere`. Times are those between two timestamps of the
//! hardware, medians of 21 passes, less those of a pass that looks nothing up; errors are those of all pixels on the sphere against 512
//! midpoints, relative to these plus a hundredth of their mean.

mod gpu;

use std::time::Instant;

use gpu::{Bound, Gpu};
use sateen::shader::{WGSL, parameters};
use sateen::table::Table;
use sateen::volume::{Settings, Volume};

const PASSES: usize = 21;
const BEFORE: &str = "
@group(0) @binding(0) var<storage, read_write> parameters: array<vec4f>;
@group(0) @binding(1) var volume: texture_3d<f32>;
@group(0) @binding(2) var filtered: sampler;
@group(0) @binding(3) var<storage, read_write> pairs: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> values: array<vec4f>;
fn sateen_parameter(index: i32) -> vec4f { return parameters[index]; }
fn sateen_volume(uvw: vec3f) -> vec4f { return textureSampleLevel(volume, filtered, uvw, 0.0); }
";

/// A shader that fills the pixels with an expression of wi and wr. Pixels beside the sphere are those on it, seen again.
fn shader(expression: &str) -> String {
    let main = format!(
        "
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {{
    let width = u32(pairs[0].x);
    let at = (vec2f(f32(id.x % width), f32(id.x / width)) + 0.5) / pairs[0].x;
    let radius = sqrt(at.x) * 0.999;
    let around = 6.2831853 * at.y;
    let n = vec3f(radius * cos(around), radius * sin(around), sqrt(1.0 - radius * radius));
    let t = normalize(vec3f(n.z, 0.0, -n.x));
    let b = cross(n, t);
    let view = vec3f(0.0, 0.0, 1.0);
    let light = pairs[1].xyz;
    let wi = vec3f(dot(t, light), dot(b, light), dot(n, light));
    let wr = vec3f(dot(t, view), dot(b, view), dot(n, view));
    values[id.x] = vec4f({expression}, 1.0);
}}"
    );
    [BEFORE, WGSL, &main].concat()
}

/// Nanoseconds of passes, from the least to the most.
fn times(gpu: &Gpu, pipeline: &wgpu::ComputePipeline, bound: &Bound, count: usize) -> Vec<f64> {
    let has_stamps = gpu
        .device
        .features()
        .contains(wgpu::Features::TIMESTAMP_QUERY);
    let stamps = has_stamps.then(|| {
        let set = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2,
        });
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 16,
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        (set, buffer)
    });
    let pass = |_| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let writes = stamps
            .as_ref()
            .map(|(set, _)| wgpu::ComputePassTimestampWrites {
                query_set: set,
                beginning_of_pass_write_index: Some(0),
                end_of_pass_write_index: Some(1),
            });
        Gpu::pass(&mut encoder, pipeline, bound, count, writes);
        if let Some((set, buffer)) = &stamps {
            encoder.resolve_query_set(set, 0..2, buffer, 0);
        }
        let start = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        gpu.wait();
        let Some((_, buffer)) = &stamps else {
            return start.elapsed().as_secs_f64() * 1e9;
        };
        let bytes = gpu.bytes(buffer);
        let (ticks, _) = bytes.as_chunks();
        let [start, end] = [ticks[0], ticks[1]].map(u64::from_le_bytes);
        end.wrapping_sub(start) as f64 * f64::from(gpu.queue.get_timestamp_period())
    };
    let mut times: Vec<f64> = (0..PASSES).map(pass).collect();
    times.sort_by(f64::total_cmp);
    times
}

/// Mean relative error, over pixels that are lit.
fn error(values: &[[f32; 4]], truth: &[[f32; 4]]) -> f64 {
    let channels = || {
        truth
            .iter()
            .zip(values)
            .flat_map(|(t, v)| (0..3).map(|c| (t[c], v[c])))
    };
    let lit = || channels().filter(|(truth, _)| *truth > 0.0);
    let floor = 0.01 * lit().map(|(truth, _)| f64::from(truth)).sum::<f64>() / lit().count() as f64;
    let relative = |(truth, value): (f32, f32)| {
        (f64::from(value) - f64::from(truth)).abs() / (f64::from(truth) + floor)
    };
    lit().map(relative).sum::<f64>() / lit().count() as f64
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("the path of a table");
    let pixels: usize = arguments.next().map_or(1 << 20, |pixels| {
        pixels.parse().expect("a number of pixels")
    });
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let table = Table::from_bytes(&bytes).unwrap_or_else(|error| panic!("{path}: {error}"));
    let volume = Volume::new(&table, &Settings::default()).expect("it fits into a texture");
    let gpu = Gpu::new(wgpu::Features::TIMESTAMP_QUERY).expect("there is no Vulkan adapter");
    let width = pixels.isqrt().next_multiple_of(8);
    let count = width * width;
    let scene = [[width as f32, 0.0, 0.0, 0.0], [0.36, 0.48, 0.8, 0.0]];
    let bound = Bound::new(&gpu, &parameters(&table, &volume), &volume, &scene, count);
    let pipeline =
        |expression: &str| gpu.pipeline(wgpu::ShaderSource::Wgsl(shader(expression).into()));
    let nothing = times(&gpu, &pipeline("wi + wr"), &bound, count)[PASSES / 2];
    gpu.run(&pipeline("sateen_direct_cos(wi, wr, 512)"), &bound, count);
    let truth = gpu.read(&bound);
    let stamps = gpu
        .device
        .features()
        .contains(wgpu::Features::TIMESTAMP_QUERY);
    println!(
        "{count} pixels; times by {}",
        if stamps {
            "the hardware's timestamps"
        } else {
            "the clock of this program"
        }
    );
    println!(
        "{:14} {:>12} {:>10} {:>8}",
        "", "ns a pixel", "least", "error"
    );
    let direct = [3, 4, 6, 8, 12, 16, 24, 50].map(|n| {
        (
            format!("direct, {n}"),
            format!("sateen_direct_cos(wi, wr, {n})"),
        )
    });
    for (name, expression) in
        std::iter::once(("table".to_owned(), "sateen_eval_cos(wi, wr)".to_owned())).chain(direct)
    {
        let pipeline = pipeline(&expression);
        let times = times(&gpu, &pipeline, &bound, count);
        let of = |time: f64| (time - nothing).max(0.0) / count as f64;
        let error = 100.0 * error(&gpu.read(&bound), &truth);
        println!(
            "{name:14} {:12.3} {:10.3} {error:7.3} %",
            of(times[PASSES / 2]),
            of(times[0])
        );
    }
}
