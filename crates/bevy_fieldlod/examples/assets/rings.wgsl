#import bevy_pbr::forward_io::VertexOutput

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> color: vec4<f32>;

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
    let light = 0.4 + 0.6 * max(dot(normalize(in.world_normal), normalize(vec3(0.5, 0.8, 0.4))), 0.0);
    let ring = step(0.5, fract(4.0 * in.world_position.y));
    return vec4(light * mix(color.rgb, vec3(0.9), ring), 1.0);
}
