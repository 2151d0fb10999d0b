// Paints levels of detail, or a quantity of the camera-sampling field (Lin and Lee, 2004).

#import bevy_pbr::{forward_io::VertexOutput, mesh_functions, mesh_view_bindings::view}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> mode: vec4<u32>;

const LEVELS: u32 = 0u;
const SAMPLING_DENSITY: u32 = 1u;
const ASPECT_RATIO: u32 = 2u;
const CURL: u32 = 3u;

fn hsl(hue: f32, saturation: f32, lightness: f32) -> vec3<f32> {
    let chroma = (1.0 - abs(2.0 * lightness - 1.0)) * saturation;
    let wave = clamp(abs(fract(hue + vec3<f32>(1.0, 2.0 / 3.0, 1.0 / 3.0)) * 6.0 - 3.0) - 1.0, vec3<f32>(0.0), vec3<f32>(1.0));
    return lightness + chroma * (wave - 0.5);
}

// From blue (0) over green to red (1).
fn heat(share: f32) -> vec3<f32> {
    return hsl((1.0 - clamp(share, 0.0, 1.0)) * 2.0 / 3.0, 0.9, 0.5);
}

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
    let tag = mesh_functions::get_tag(in.instance_index);
    let level = tag >> 24u;
    let error_in_world = bitcast<f32>(tag << 8u);

    let position = (view.view_from_world * vec4<f32>(in.world_position.xyz, 1.0)).xyz;
    let is_orthographic = view.clip_from_view[3][3] == 1.0;
    let focal_px = 0.5 * view.clip_from_view[1][1] * view.viewport.w;
    let depth = -position.z;
    let distance = length(position);
    var strength = focal_px * focal_px * distance / (depth * depth * depth);
    var aspect_ratio = depth / distance;
    var relative_curl = 3.0 * length(position.xy) / (depth * distance);
    var to_camera = normalize(view.world_position - in.world_position.xyz);
    if is_orthographic {
        strength = focal_px * focal_px;
        aspect_ratio = 1.0;
        relative_curl = 0.0;
        to_camera = normalize(view.world_from_view[2].xyz);
    }
    let facing = max(dot(normalize(in.world_normal), to_camera), 0.0);

    var color: vec3<f32>;
    switch mode.x {
        case LEVELS: {
            color = hsl(f32(level * 5u % 12u) / 12.0, 0.75, 0.55);
        }
        case SAMPLING_DENSITY: {
            // The scale starts at 1 and ends at 2^20 samples per square unit.
            color = heat(log2(max(strength * facing, 1.0)) / 20.0);
        }
        case ASPECT_RATIO: {
            color = heat(1.0 - aspect_ratio);
        }
        case CURL: {
            // The scale starts at a change of 1/1024 per unit and ends at 1 per unit.
            color = heat(1.0 + log2(max(relative_curl, 1e-6)) / 10.0);
        }
        default: {
            color = heat(error_in_world * sqrt(strength / aspect_ratio));
        }
    }
    // Light from the camera keeps the shape visible.
    return vec4<f32>(color * (0.35 + 0.65 * facing), 1.0);
}
