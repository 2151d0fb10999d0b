//! Distances between points and triangles.

use glam::{DVec3, Vec3};

/// [`nearest_point_exact`] in single precision.
pub(crate) fn nearest_point(place: Vec3, corners: [Vec3; 3]) -> Vec3 {
    nearest_point_exact(place.as_dvec3(), corners.map(Vec3::as_dvec3)).as_vec3()
}

/// Distance between a point and a triangle in double precision.
pub(crate) fn exact_distance(place: DVec3, corners: [DVec3; 3]) -> f64 {
    place.distance(nearest_point_exact(place, corners))
}

/// Nearest point of a triangle: the projection onto the plane if that is inside, otherwise the nearest point of an edge.
fn nearest_point_exact(place: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(c - a);
    let is_inside = |from: DVec3, to: DVec3| normal.cross(to - from).dot(place - from) >= 0.0;
    if normal != DVec3::ZERO && is_inside(a, b) && is_inside(b, c) && is_inside(c, a) {
        return place - (place - a).project_onto(normal);
    }
    let nearer = |nearest: DVec3, other: DVec3| {
        let is_nearer = other.distance_squared(place) < nearest.distance_squared(place);
        if is_nearer { other } else { nearest }
    };
    let edges = [(b, c), (c, a)].map(|(from, to)| nearest_on_edge(place, from, to));
    edges.into_iter().fold(nearest_on_edge(place, a, b), nearer)
}

fn nearest_on_edge(place: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let edge = to - from;
    let along = (place - from).dot(edge) / edge.length_squared();
    // NaN for an edge without length.
    let along = if along > 0.0 { along.min(1.0) } else { 0.0 };
    from + edge * along
}
