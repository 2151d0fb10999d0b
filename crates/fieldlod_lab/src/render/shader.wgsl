struct View {
    clip_from_local: mat4x4<f32>,
    eye_in_local: vec4<f32>,
    light_in_local: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;

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
/// Waves along a unit of texture coordinates.
const WAVES: f32 = 24.0;

/// Albedo of a surface without texture coordinates.
const PLAIN: f32 = 0.55;

/// A pattern of waves that fades where it is finer than the picture.
fn albedo(uv: vec2<f32>) -> f32 {
    let width = fwidth(uv) * WAVES;
    let fade = exp(-4.0 * dot(width, width));
    let waves = sin(2.0 * PI * WAVES * uv);
    return PLAIN + 0.25 * fade * waves.x * waves.y;
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
    // Backs are lit too, but silhouettes keep their normals.
    return select(-normal, normal, dot(normal, to_eye) >= -0.15 * length(to_eye));
}

@fragment
fn color(in: Corner) -> @location(0) vec4<f32> {
    let to_eye = normalize(view.eye_in_local.xyz - in.position);
    return vec4(shade(facing(in), to_eye, albedo(in.uv) * in.color), 1.0);
}
