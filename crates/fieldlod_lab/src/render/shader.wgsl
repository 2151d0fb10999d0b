struct View {
    clip_from_local: mat4x4<f32>,
    shadow_from_local: mat4x4<f32>,
    eye_in_local: vec4<f32>,
    /// The direction, and in `w` whether there are shadows.
    light_in_local: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var shadow_map: texture_depth_2d;

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
    @location(3) @interpolate(flat) unit: u32,
    @location(4) color: vec3<f32>,
}

struct Texel {
    @location(0) color: vec4<f32>,
    @location(1) unit: u32,
}

@vertex
fn vertex(in: Vertex, @builtin(instance_index) unit: u32) -> Corner {
    var out: Corner;
    out.clip = view.clip_from_local * vec4(in.position, 1.0);
    out.position = in.position;
    out.normal = in.normal;
    out.uv = in.uv;
    out.unit = unit;
    out.color = in.color;
    return out;
}

@vertex
fn shadow_vertex(in: Vertex) -> @builtin(position) vec4<f32> {
    return view.shadow_from_local * vec4(in.position, 1.0);
}

/// By how much nearer to the light something must be to throw a shadow, of the map's depth.
const SHADOW_BIAS: f32 = 0.002;

/// 1 where the light comes to or outside of the map, else 0: the mean of four texels, weighted by how near
/// they are.
fn lit(in: Corner) -> f32 {
    if view.light_in_local.w == 0.0 {
        return 1.0;
    }
    let at = view.shadow_from_local * vec4(in.position, 1.0);
    if any(abs(at.xyz - vec3(0.0, 0.0, 0.5)) > vec3(1.0, 1.0, 0.5)) {
        return 1.0;
    }
    let size = vec2<f32>(textureDimensions(shadow_map));
    let texel = vec2(0.5 + 0.5 * at.x, 0.5 - 0.5 * at.y) * size - 0.5;
    let weight = fract(texel);
    var lit = vec4<f32>();
    for (var i = 0; i < 4; i++) {
        let corner = clamp(vec2<i32>(floor(texel)) + vec2(i & 1, i >> 1), vec2(0), vec2<i32>(size) - 1);
        lit[i] = step(textureLoad(shadow_map, corner, 0), at.z + SHADOW_BIAS);
    }
    return mix(mix(lit.x, lit.y, weight.x), mix(lit.z, lit.w, weight.x), weight.y);
}

const PI: f32 = 3.14159265;
/// Waves along a unit of texture coordinates.
const WAVES: f32 = 24.0;

/// What is seen of a surface without texture coordinates.
const PLAIN: f32 = 0.55;

/// A pattern of waves that fades where it is finer than the picture.
fn albedo(uv: vec2<f32>) -> f32 {
    let width = fwidth(uv) * WAVES;
    let fade = exp(-4.0 * dot(width, width));
    let waves = sin(2.0 * PI * WAVES * uv);
    return PLAIN + 0.25 * fade * waves.x * waves.y;
}

fn shade(normal: vec3<f32>, to_eye: vec3<f32>, albedo: vec3<f32>, lit: f32) -> vec3<f32> {
    let to_light = view.light_in_local.xyz;
    let half_way = normalize(to_light + to_eye);
    let sun = lit * max(dot(normal, to_light), 0.0);
    let lamp = max(dot(normal, to_eye), 0.0);
    let highlight = lit * pow(max(dot(normal, half_way), 0.0), 40.0) + 0.5 * pow(lamp, 60.0);
    let body = vec3(1.0, 0.92, 0.82) * (sun * 0.65) + vec3(0.75, 0.85, 1.0) * (0.06 + 0.3 * lamp);
    return albedo * body + 0.18 * highlight;
}

fn facing(in: Corner) -> vec3<f32> {
    let to_eye = view.eye_in_local.xyz - in.position;
    let normal = normalize(in.normal);
    // Backs are seen too, but silhouettes keep their normals.
    return select(-normal, normal, dot(normal, to_eye) >= -0.15 * length(to_eye));
}

fn color_of(in: Corner) -> vec4<f32> {
    let to_eye = normalize(view.eye_in_local.xyz - in.position);
    return vec4(shade(facing(in), to_eye, albedo(in.uv) * in.color, lit(in)), 1.0);
}

@fragment
fn color(in: Corner) -> @location(0) vec4<f32> {
    return color_of(in);
}

@fragment
fn color_and_unit(in: Corner) -> Texel {
    return Texel(color_of(in), in.unit + 1u);
}

// Cards.

@group(1) @binding(0) var card_colors: texture_2d<f32>;
@group(1) @binding(1) var card_normals: texture_2d<f32>;
@group(1) @binding(2) var card_sampler: sampler;

struct CardVertex {
    @location(0) position: vec3<f32>,
    @location(1) tangent: vec3<f32>,
    @location(2) bitangent: vec3<f32>,
    @location(3) uv: vec2<f32>,
    @location(4) tint: vec3<f32>,
}

struct CardCorner {
    @builtin(position) clip: vec4<f32>,
    @location(0) position: vec3<f32>,
    @location(1) tangent: vec3<f32>,
    @location(2) bitangent: vec3<f32>,
    @location(3) uv: vec2<f32>,
    @location(4) tint: vec3<f32>,
    @location(5) @interpolate(flat) unit: u32,
}

fn card_corner(in: CardVertex, clip: vec4<f32>, unit: u32) -> CardCorner {
    var out: CardCorner;
    out.clip = clip;
    out.position = in.position;
    out.tangent = in.tangent;
    out.bitangent = in.bitangent;
    out.uv = in.uv;
    out.tint = in.tint;
    out.unit = unit;
    return out;
}

@vertex
fn card_vertex(in: CardVertex, @builtin(instance_index) unit: u32) -> CardCorner {
    return card_corner(in, view.clip_from_local * vec4(in.position, 1.0), unit);
}

@vertex
fn card_shadow_vertex(in: CardVertex) -> CardCorner {
    return card_corner(in, view.shadow_from_local * vec4(in.position, 1.0), 0u);
}

fn color_of_card(in: CardCorner) -> vec4<f32> {
    let color = textureSample(card_colors, card_sampler, in.uv);
    let along = 2.0 * textureSample(card_normals, card_sampler, in.uv).xyz - 1.0;
    if color.a < 0.5 {
        discard;
    }
    let to_eye = normalize(view.eye_in_local.xyz - in.position);
    let across = cross(in.tangent, in.bitangent);
    var surface: Corner;
    surface.position = in.position;
    surface.normal = along.x * in.tangent + along.y * in.bitangent + along.z * across;
    let albedo = PLAIN * in.tint * color.rgb;
    return vec4(shade(facing(surface), to_eye, albedo, lit(surface)), 1.0);
}

@fragment
fn card_color(in: CardCorner) -> @location(0) vec4<f32> {
    return color_of_card(in);
}

@fragment
fn card_color_and_unit(in: CardCorner) -> Texel {
    return Texel(color_of_card(in), in.unit + 1u);
}

@fragment
fn card_shadow(in: CardCorner) {
    if textureSample(card_colors, card_sampler, in.uv).a < 0.5 {
        discard;
    }
}
