struct View {
    clip_from_local: mat4x4<f32>,
    eye_in_local: vec4<f32>,
    light_in_local: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(1) @binding(0) var base_color: texture_2d<f32>;
@group(1) @binding(1) var base_sampler: sampler;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) color: vec3<f32>,
}

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) uv: vec2<f32>,
    @location(3) color: vec3<f32>,
}

@vertex
fn vertex(in: Vertex) -> Corner {
    var out: Corner;
    out.clip = view.clip_from_local * vec4(in.position, 1.0);
    out.position = in.position;
    out.normal = in.normal;
    out.uv = in.uv;
    out.color = in.color;
    return out;
}

const PI: f32 = 3.14159265;
/// Number of waves per unit of texture coordinates.
const WAVES: f32 = 24.0;

/// Albedo of a surface without texture coordinates.
const PLAIN: f32 = 0.55;

/// Colour of the texture. A single transparent texel stands for a pattern of waves, which fades where waves are
/// finer than a pixel.
fn albedo(uv: vec2<f32>) -> vec4<f32> {
    let texel = textureSample(base_color, base_sampler, uv);
    let width = fwidth(uv) * WAVES;
    let fade = exp(-4.0 * dot(width, width));
    let waves = sin(2.0 * PI * WAVES * uv);
    let pattern = vec4(vec3(PLAIN + 0.25 * fade * waves.x * waves.y), 1.0);
    // A texture with one transparent texel stands for no texture.
    let is_missing = all(textureDimensions(base_color) == vec2(1u)) && texel.a == 0.0;
    return select(texel, pattern, is_missing);
}

fn shade(normal: vec3<f32>, to_eye: vec3<f32>, albedo: vec3<f32>) -> vec3<f32> {
    let to_light = view.light_in_local.xyz;
    let half_way = normalize(to_light + to_eye);
    let sun = max(dot(normal, to_light), 0.0);
    let lamp = max(dot(normal, to_eye), 0.0);
    let highlight = pow(max(dot(normal, half_way), 0.0), 40.0) + 0.5 * pow(lamp, 60.0);
    let body = vec3(1.0, 0.92, 0.82) * (sun * 0.65) + vec3(0.75, 0.85, 1.0) * (0.06 + 0.3 * lamp);
    return albedo * body + 0.18 * highlight;
}

fn facing(in: Corner) -> vec3<f32> {
    let to_eye = view.eye_in_local.xyz - in.position;
    let normal = normalize(in.normal);
    // Back faces are lit as front faces. The tolerance keeps smooth normals at the silhouette, where they may point away.
    return select(-normal, normal, dot(normal, to_eye) >= -0.15 * length(to_eye));
}

@fragment
fn color(in: Corner) -> @location(0) vec4<f32> {
    let to_eye = normalize(view.eye_in_local.xyz - in.position);
    let albedo = albedo(in.uv);
    if albedo.a < 0.5 {
        discard;
    }
    return vec4(shade(facing(in), to_eye, albedo.rgb * in.color), 1.0);
}
