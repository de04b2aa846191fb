// Cloth in Bevy's forward pass: before sateen's WGSL (src/shader/lookup.wgsl), which calls the first two functions.

#import bevy_pbr::{
    forward_io::VertexOutput,
    mesh_view_bindings::{lights, view},
    mesh_view_types::DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT,
    shadows::fetch_directional_shadow,
}
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::tone_mapping
#endif

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var cloth: texture_3d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var cloth_sampler: sampler;
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<storage, read> cloth_parameters: array<vec4f>;
@group(#{MATERIAL_BIND_GROUP}) @binding(3) var<uniform> dyes: array<vec4f, 4>;

fn sateen_parameter(index: i32) -> vec4f {
    return cloth_parameters[index];
}

fn sateen_volume(uvw: vec3f) -> vec4f {
    return textureSampleLevel(cloth, cloth_sampler, uvw, 0.0);
}

// The fabric's own albedos, and dyes over them.
fn dyed() -> SateenAlbedos {
    var albedos = sateen_albedos();
    for (var k = 0; k < 4; k++) {
        albedos.of_thread[k] = mix(albedos.of_thread[k], dyes[k].rgb, dyes[k].a);
    }
    return albedos;
}

// Unit vector from a point to the viewer.
fn to_viewer(position: vec3f) -> vec3f {
    let is_orthographic = view.clip_from_view[3].w == 1.0;
    return normalize(select(view.world_position - position, view.world_from_view[2].xyz, is_orthographic));
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let n = select(-1.0, 1.0, is_front) * normalize(in.world_normal);
    let t = normalize(in.world_tangent.xyz - n * dot(n, in.world_tangent.xyz));
    let b = in.world_tangent.w * cross(n, t);
    let viewer = to_viewer(in.world_position.xyz);
    let wr = vec3f(dot(t, viewer), dot(b, viewer), dot(n, viewer));
    let depth = (view.view_from_world * in.world_position).z;
    let albedos = dyed();

    var radiance = vec3f(0.0);
    for (var k = 0u; k < lights.n_directional_lights; k++) {
        let light = lights.directional_lights[k].direction_to_light;
        let wi = vec3f(dot(t, light), dot(b, light), dot(n, light));
        var irradiance = lights.directional_lights[k].color.rgb;
        if ((lights.directional_lights[k].flags & DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) != 0u) {
            irradiance *= fetch_directional_shadow(k, in.world_position, n, depth, in.position.xy);
        }
        radiance += irradiance * sateen_eval_cos_with(wi, wr, albedos);
    }
    var colour = vec4f(view.exposure * radiance, 1.0);
#ifdef TONEMAP_IN_SHADER
    colour = tone_mapping(colour, view.color_grading);
#endif
    return colour;
}
