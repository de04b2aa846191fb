//! The shaders against what they are held to in Rust, on whatever graphics hardware there is; else on Mesa's software.
//!
//! Skipped where there is no Vulkan adapter or no `glslangValidator`, unless `SATEEN_REQUIRE_ALL=1`.
#![cfg(test)]

mod gpu;

use std::path::Path;
use std::process::Command;

use sateen::bake::{Direct, For, Preset, Settings, bake};
use sateen::brdf::Reweighting;
use sateen::fabric::{Fabric, LIBRARY};
use sateen::metrics::{Pair, PairKind, protocol_pairs};
use sateen::progress::Progress;
use sateen::shader::{Filter, GLSL, HLSL, Lookup, WGSL, parameters};
use sateen::table::Table;
use sateen::volume::{self, Volume};

use crate::gpu::{Bound, Gpu, skip};

const PAIRS: usize = 2048;
const SEED: u64 = 30;
/// Midpoints of the direct integration.
const MIDPOINTS: u32 = 16;
/// Per channel |a − b| / (b + 0.01 b̄): roundings of f32 in another order, and of filters.
const TOLERANCE: f64 = 2e-3;

const WGSL_BEFORE: &str = "
@group(0) @binding(0) var<storage, read_write> parameters: array<vec4f>;
@group(0) @binding(1) var volume: texture_3d<f32>;
@group(0) @binding(2) var filtered: sampler;
@group(0) @binding(3) var<storage, read_write> pairs: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> values: array<vec4f>;
fn sateen_parameter(index: i32) -> vec4f { return parameters[index]; }
fn sateen_volume(uvw: vec3f) -> vec4f { return textureSampleLevel(volume, filtered, uvw, 0.0); }
";
const WGSL_AFTER: &str = "
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    let wi = pairs[2 * k].xyz;
    let wr = pairs[2 * k + 1].xyz;
    values[3 * k] = vec4f(sateen_eval_cos(wi, wr), 0.0);
    values[3 * k + 1] = vec4f(sateen_eval(wi, wr), 0.0);
    values[3 * k + 2] = vec4f(sateen_direct_cos(wi, wr, 16), 0.0);
}";
const GLSL_BEFORE: &str = "#version 450
layout(local_size_x = 64) in;
layout(set = 0, binding = 0) readonly buffer Parameters { vec4 parameters[]; };
layout(set = 0, binding = 1) uniform texture3D volume;
layout(set = 0, binding = 2) uniform sampler filtered;
layout(set = 0, binding = 3) readonly buffer Pairs { vec4 pairs[]; };
layout(set = 0, binding = 4) buffer Values { vec4 values[]; };
vec4 sateen_parameter(int index) { return parameters[index]; }
vec4 sateen_volume(vec3 uvw) { return textureLod(sampler3D(volume, filtered), uvw, 0.0); }
";
const GLSL_AFTER: &str = "
void main() {
    uint k = gl_GlobalInvocationID.x;
    vec3 wi = pairs[2u * k].xyz;
    vec3 wr = pairs[2u * k + 1u].xyz;
    values[3u * k] = vec4(sateen_eval_cos(wi, wr), 0.0);
    values[3u * k + 1u] = vec4(sateen_eval(wi, wr), 0.0);
    values[3u * k + 2u] = vec4(sateen_direct_cos(wi, wr, 16), 0.0);
}";
const HLSL_BEFORE: &str = "
[[vk::binding(0, 0)]] RWStructuredBuffer<float4> parameters : register(u0);
[[vk::binding(1, 0)]] Texture3D<float4> volume : register(t1);
[[vk::binding(2, 0)]] SamplerState filtered : register(s2);
[[vk::binding(3, 0)]] RWStructuredBuffer<float4> pairs : register(u3);
[[vk::binding(4, 0)]] RWStructuredBuffer<float4> values : register(u4);
float4 sateen_parameter(int index) { return parameters[index]; }
float4 sateen_volume(float3 uvw) { return volume.SampleLevel(filtered, uvw, 0.0); }
";
const HLSL_AFTER: &str = "
[numthreads(64, 1, 1)] void main(uint3 id : SV_DispatchThreadID) {
    uint k = id.x;
    float3 wi = pairs[2 * k].xyz;
    float3 wr = pairs[2 * k + 1].xyz;
    values[3 * k] = float4(sateen_eval_cos(wi, wr), 0.0);
    values[3 * k + 1] = float4(sateen_eval(wi, wr), 0.0);
    values[3 * k + 2] = float4(sateen_direct_cos(wi, wr, 16), 0.0);
}";
/// A fragment shader of WebGL 2, and of desktop OpenGL with another first line.
const FRAGMENT_BEFORE: &str = "
precision highp float;
precision highp int;
uniform vec4 parameters[1024];
uniform highp sampler3D volume;
in vec3 wi;
in vec3 wr;
out vec4 colour;
vec4 sateen_parameter(int index) { return parameters[index]; }
vec4 sateen_volume(vec3 uvw) { return textureLod(volume, uvw, 0.0); }
";
const FRAGMENT_AFTER: &str = "
void main() { colour = vec4(sateen_eval_cos(wi, wr) + sateen_direct_cos(wi, wr, 50), 1.0); }";

/// Runs a program on a file, which has to please it; says whether there is such a program.
fn pleases(program: &str, arguments: &[&str], file: &Path) -> bool {
    let Ok(output) = Command::new(program).args(arguments).arg(file).output() else {
        skip(&format!(
            "there is no {program} (Debian: glslang-tools, spirv-tools)"
        ));
        return false;
    };
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success(), "{}: {said}", file.display());
    true
}

/// Compiles a text to SPIR-V or, without a place for that, checks it; says whether there is a compiler.
fn glslang(arguments: &[&str], text: &str, folder: &Path, name: &str) -> bool {
    let file = folder.join(name);
    std::fs::write(&file, text).expect("a writable folder");
    pleases("glslangValidator", arguments, &file)
}

struct Case {
    name: String,
    fabric: Fabric,
    table: Table,
    volume: Volume,
}

impl Case {
    fn new(name: &str, fabric: Fabric, direct: Direct) -> Self {
        let mut settings = Settings {
            max_bytes: 12 << 10,
            error_pairs: 16,
            tolerance: 1e-2,
            direct,
            ..Preset::Draft.settings()
        };
        if direct == Direct::Worthwhile {
            // For grids that end before the horizon, however much so few bytes err.
            (settings.made_for, settings.max_error) = (For::Single, 1.0);
        }
        let table = bake(&fabric, &settings, Progress::silent())
            .expect("nobody stops it")
            .table;
        if direct == Direct::Worthwhile {
            assert!(table.threads().iter().any(|t| t.rim().is_some()), "{name}");
        }
        let settings = volume::Settings {
            max_bytes: 256 << 10,
            ..volume::Settings::default()
        };
        let volume = Volume::new(&table, &settings).expect("it fits");
        Self {
            name: name.to_owned(),
            fabric,
            table,
            volume,
        }
    }
}

/// Every fabric of the library, by grids where it can have them; and what the library lacks.
fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = LIBRARY
        .iter()
        .map(|entry| Case::new(entry.name, entry.load(), Direct::Never))
        .collect();
    let direct = |name: &str| Fabric::from_library(name).expect("the library has it");
    cases.push(Case::new(
        "velvet, placed nodes",
        direct("velvet"),
        Direct::Always,
    ));
    cases.push(Case::new(
        "denim, placed nodes",
        direct("denim"),
        Direct::Always,
    ));
    let read = |fabric: Fabric| {
        Fabric::from_toml(&fabric.to_toml(), "changed.toml", None).expect("what was written")
    };
    let mut stiff = direct("linen-plain");
    for thread in &mut stiff.threads {
        thread.optics.gamma_s = 0.2f64.to_radians();
        thread.optics.gamma_v = 0.1f64.to_radians();
    }
    cases.push(Case::new(
        "stiff linen, placed nodes",
        read(stiff),
        Direct::Always,
    ));
    cases.push(Case::new(
        "denim, rims",
        direct("denim"),
        Direct::Worthwhile,
    ));
    for name in ["polka-dot-lining-pink", "corduroy"] {
        let mut both = direct(name);
        both.reweighting = Reweighting::Both;
        cases.push(Case::new(
            &format!("{name}, both"),
            read(both),
            Direct::Worthwhile,
        ));
    }
    cases
}

/// eval_cos, eval and direct_cos of every pair.
fn evaluate(
    gpu: &Gpu,
    pipeline: &wgpu::ComputePipeline,
    case: &Case,
    pairs: &[Pair],
) -> Vec<[[f32; 3]; 3]> {
    let vector = |w: [f64; 3]| [w[0] as f32, w[1] as f32, w[2] as f32, 0.0];
    let both = |pair: &Pair| [vector(pair.wi), vector(pair.wr)];
    let pairs: Vec<[f32; 4]> = pairs.iter().flat_map(both).collect();
    let count = pairs.len() / 2;
    let parameters = parameters(&case.table, &case.volume);
    let bound = Bound::new(gpu, &parameters, &case.volume, &pairs, 3 * count);
    gpu.run(pipeline, &bound, count);
    let numbers = gpu.read(&bound);
    let three = |n: &[[f32; 4]]| [n[0], n[1], n[2]].map(|[r, g, b, _]| [r, g, b]);
    numbers.chunks_exact(3).map(three).collect()
}

/// The largest deviation of `a` from `b`, relative to `b` and a hundredth of its mean over render pairs.
fn deviation(pairs: &[Pair], a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let mut worst = 0.0f64;
    for channel in 0..3 {
        let of = |values: &[[f32; 3]], k: usize| f64::from(values[k][channel]);
        let renders: Vec<f64> = (0..pairs.len())
            .filter(|k| pairs[*k].kind == PairKind::Render)
            .map(|k| of(b, k))
            .collect();
        let floor = 0.01 * renders.iter().sum::<f64>() / renders.len() as f64;
        for k in 0..pairs.len() {
            let relative = (of(a, k) - of(b, k)).abs() / (of(b, k) + floor).max(1e-30);
            // Unlike `max`, this keeps what is no number.
            if !(relative <= worst) {
                worst = relative;
            }
        }
    }
    worst
}

/// Of eval_cos, eval and direct_cos.
fn text(deviations: [f64; 3]) -> String {
    let [cos, brdf, direct] = deviations.map(|x| format!("{x:.0e}"));
    format!("{cos} {brdf} {direct}")
}

#[test]
fn shaders_compute_what_the_library_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let fragment = |version: &str| [version, FRAGMENT_BEFORE, GLSL, FRAGMENT_AFTER].concat();
    let es = fragment("#version 300 es");
    let desktop = fragment("#version 330");
    let has_compiler = glslang(&[], &es, folder.path(), "es.frag")
        && glslang(&[], &desktop, folder.path(), "desktop.frag");

    let Some(gpu) = Gpu::new(wgpu::Features::empty()) else {
        return;
    };
    let wgsl = [WGSL_BEFORE, WGSL, WGSL_AFTER].concat();
    let mut shaders = vec![("WGSL", gpu.pipeline(wgpu::ShaderSource::Wgsl(wgsl.into())))];
    let glsl = [GLSL_BEFORE, GLSL, GLSL_AFTER].concat();
    let hlsl = [HLSL_BEFORE, HLSL, HLSL_AFTER].concat();
    for (name, file, text) in [("GLSL", "glsl.comp", glsl), ("HLSL", "hlsl.comp", hlsl)] {
        let binary = folder.path().join(file).with_extension("spv");
        let to = binary.to_str().expect("a path of characters");
        let mut arguments = vec![
            "-V",
            "--target-env",
            "vulkan1.1",
            "-S",
            "comp",
            "-e",
            "main",
            "-o",
            to,
        ];
        if name == "HLSL" {
            arguments.push("-D");
        }
        if has_compiler && glslang(&arguments, &text, folder.path(), file) {
            pleases("spirv-val", &["--target-env", "vulkan1.1"], &binary);
            let binary = std::fs::read(&binary).expect("it was written");
            shaders.push((name, gpu.pipeline(wgpu::util::make_spirv(&binary))));
        }
    }

    let mut failures = Vec::new();
    for case in cases() {
        let pairs = protocol_pairs(&case.fabric, PAIRS, SEED);
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let all = |filter: Filter| {
            let lookup = Lookup::new(&case.table, &case.volume, filter);
            let value = |pair: &Pair| {
                let (wi, wr) = (single(pair.wi), single(pair.wr));
                [
                    lookup.eval_cos(wi, wr),
                    lookup.eval(wi, wr),
                    lookup.direct_cos(wi, wr, MIDPOINTS),
                ]
            };
            pairs.iter().map(value).collect::<Vec<_>>()
        };
        let column =
            |values: &[[[f32; 3]; 3]], k: usize| values.iter().map(|v| v[k]).collect::<Vec<_>>();
        let expected = all(Filter::Exact);
        let mut line = format!("{:35}", case.name);
        for (shader, pipeline) in &shaders {
            let values = evaluate(&gpu, pipeline, &case, &pairs);
            let deviations =
                [0, 1, 2].map(|k| deviation(&pairs, &column(&values, k), &column(&expected, k)));
            let worst = deviations
                .into_iter()
                .fold(0.0, |a, b| if b <= a { a } else { b });
            line += &format!("  {shader} {}", text(deviations));
            if !(worst <= TOLERANCE) {
                failures.push(format!("{}, {shader}: {}", case.name, text(deviations)));
            }
        }
        let eight = deviation(
            &pairs,
            &column(&all(Filter::EightBit), 0),
            &column(&expected, 0),
        );
        println!("{line}  8-bit weights {eight:.1e}");
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
