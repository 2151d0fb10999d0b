//! Hierarchies made of numbers alone: no mesh, no baker, equal on every machine.

use fieldlod_hierarchy::{Group, Hierarchy, NO_GROUP, Sphere, Unit, fixtures};
use glam::{Vec2, Vec3};

/// Triangles of a unit of source geometry, and of any other.
const SOURCE_TRIANGLES: u32 = 200;
const COARSER_TRIANGLES: u32 = 40;

/// A ball of radius 1 whose level 0 has `4^levels` groups, each coarser level a quarter of that, and
/// one terminal group at the end: `(4^(levels + 1) − 1) / 3` groups.
///
/// Four groups pass their simplifications to one coarser group, and one of them also to its neighbour, so that the links
/// form a graph, not a tree. The error of level `k` is `finest_error · 2.2^k`.
pub(crate) fn ball(levels: u32, finest_error: f32) -> Hierarchy {
    let template = fixtures::two_level_strip();
    let first_of_level: Vec<u32> = (0..=levels)
        .scan(0, |first, level| {
            let this = *first;
            *first += 4u32.pow(levels - level);
            Some(this)
        })
        .collect();
    let mut hierarchy = Hierarchy::default();
    for level in 0..=levels {
        let side = 1 << (levels - level);
        for cell in 0..side * side {
            let finer = finer_cells(level, cell, side);
            let finer = finer.map(|index| index + first_of_level[level.saturating_sub(1) as usize]);
            let first_finer = hierarchy.finer.len() as u32;
            let first_unit = hierarchy.units.len() as u32;
            let index = hierarchy.groups.len() as u32;
            let producers: Vec<u32> = if level == 0 {
                vec![NO_GROUP]
            } else {
                finer.collect()
            };
            for &produced_by in &producers {
                hierarchy.units.push(Unit {
                    consumed_by: index,
                    produced_by,
                    triangle_count: if level == 0 {
                        SOURCE_TRIANGLES
                    } else {
                        COARSER_TRIANGLES
                    },
                    ..template.units[0]
                });
            }
            if level > 0 {
                hierarchy.finer.extend(&producers);
            }
            let mut group = group_at(cell, side, &template.groups[0]);
            group.error_in_local = if level == levels {
                f32::INFINITY
            } else {
                (0..level).fold(finest_error, |error, _| error * 2.2)
            };
            group.deviation_in_local = group.error_in_local * 1.5;
            hierarchy.groups.push(Group {
                level,
                first_finer,
                finer_count: hierarchy.finer.len() as u32 - first_finer,
                first_unit,
                unit_count: producers.len() as u32,
                ..group
            });
        }
    }
    hierarchy
}

/// A mesh simplified as a whole, `levels` times, and its terminal group; the error of level `k` is
/// `finest_error · 2.2^k`.
#[allow(dead_code, reason = "each suite uses its part")]
pub(crate) fn whole_mesh_levels(levels: u32, finest_error: f32) -> Hierarchy {
    let template = fixtures::two_level_strip();
    let mut hierarchy = Hierarchy::default();
    for level in 0..=levels {
        let error_in_local = if level == levels {
            f32::INFINITY
        } else {
            (0..level).fold(finest_error, |error, _| error * 2.2)
        };
        hierarchy.units.push(Unit {
            consumed_by: level,
            produced_by: level.checked_sub(1).unwrap_or(NO_GROUP),
            triangle_count: SOURCE_TRIANGLES >> level,
            ..template.units[0]
        });
        let first_finer = hierarchy.finer.len() as u32;
        hierarchy.finer.extend(level.checked_sub(1));
        hierarchy.groups.push(Group {
            level,
            first_finer,
            finer_count: u32::from(level > 0),
            first_unit: level,
            unit_count: 1,
            error_in_local,
            whole_mesh_error_in_local: if level == levels { 0.0 } else { error_in_local },
            deviation_in_local: error_in_local * 1.5,
            ..group_at(0, 1, &template.groups[0])
        });
    }
    hierarchy
}

/// The cells of the next finer level below a cell, and one that belongs to its neighbour. Cells
/// are numbered along a Morton curve, as neighbours in a baked hierarchy are near in memory too.
fn finer_cells(level: u32, cell: u32, side: u32) -> impl Iterator<Item = u32> {
    let (x, y) = (even_bits(cell), even_bits(cell >> 1));
    let own = 4 * cell..4 * cell + 4;
    let neighbour = (x + 1 < side).then(|| 4 * (spread(x + 1) | spread(y) << 1));
    own.chain(neighbour).filter(move |_| level > 0)
}

fn even_bits(x: u32) -> u32 {
    (0..16).map(|bit| (x >> (2 * bit) & 1) << bit).sum()
}

fn spread(x: u32) -> u32 {
    (0..16).map(|bit| (x >> bit & 1) << (2 * bit)).sum()
}

fn group_at(cell: u32, side: u32, template: &Group) -> Group {
    let size = 2.0 / side as f32;
    let corner = Vec2::new(even_bits(cell) as f32, even_bits(cell >> 1) as f32) * size;
    let center = octahedral(corner + size * 0.5 - 1.0);
    let flatness = (1.0 - size * size * 0.5).max(0.0);
    Group {
        bounds: Sphere {
            center: center * flatness,
            radius: (size * 1.2).min(1.05),
        },
        mean_normal: center * flatness,
        ..*template
    }
}

/// The square `[−1, 1]²` wrapped around the unit sphere, without trigonometry.
fn octahedral(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    let xy = p - p.signum() * fold;
    Vec3::new(xy.x, xy.y, z).normalize()
}
