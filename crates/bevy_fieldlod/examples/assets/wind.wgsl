// Bevy's vertex stage, with a displacement that grows with the height above the origin of the mesh.
#import bevy_pbr::{mesh_functions, view_transformations::position_world_to_clip}

#ifdef PREPASS_PIPELINE
#import bevy_pbr::prepass_io::{Vertex, VertexOutput}
#import bevy_render::globals::Globals
@group(0) @binding(1) var<uniform> globals: Globals;
#else
#import bevy_pbr::forward_io::{Vertex, VertexOutput}
#import bevy_pbr::mesh_view_bindings::globals
#endif

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var<uniform> strength: f32;

fn swayed(world_from_local: mat4x4<f32>, position: vec3<f32>, time: f32) -> vec4<f32> {
    var place = mesh_functions::mesh_position_local_to_world(world_from_local, vec4(position, 1.0));
    let wave = sin(2.0 * time + place.x + 0.7 * place.z);
    place.x += strength * max(position.y, 0.0) * wave;
    return place;
}

@vertex
fn vertex(vertex: Vertex) -> VertexOutput {
    var out: VertexOutput;
    let world_from_local = mesh_functions::get_world_from_local(vertex.instance_index);
    let place = swayed(world_from_local, vertex.position, globals.time);
    out.world_position = place;
    out.position = position_world_to_clip(place.xyz);
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.unclipped_depth = out.position.z;
    out.position.z = min(out.position.z, 1.0);
#endif
#ifdef PREPASS_PIPELINE
#ifdef NORMAL_PREPASS_OR_DEFERRED_PREPASS
    out.world_normal = mesh_functions::mesh_normal_local_to_world(vertex.normal, vertex.instance_index);
#endif
    // The main pass has this name too.
#ifdef MOTION_VECTOR_PREPASS
    let previous = mesh_functions::get_previous_world_from_local(vertex.instance_index);
    out.previous_world_position = swayed(previous, vertex.position, globals.time - globals.delta_time);
#endif
#else
    out.world_normal = mesh_functions::mesh_normal_local_to_world(vertex.normal, vertex.instance_index);
#endif
#ifdef VERTEX_UVS_A
    out.uv = vertex.uv;
#endif
#ifdef VERTEX_OUTPUT_INSTANCE_INDEX
    out.instance_index = vertex.instance_index;
#endif
    return out;
}
