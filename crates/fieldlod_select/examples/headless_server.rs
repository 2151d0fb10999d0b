//! A server without a GPU selects levels of detail for its players, for instance to send no more than they can see.
//!
//! Run with `cargo run --release -p fieldlod_select --example headless_server`.

use camera_field::Camera;
use fieldlod_bake::{BakeConfig, MeshError, bake_mesh, fixtures};
use fieldlod_select::{LodSettings, Scene, Selector, View};
use glam::{Affine3A, Mat4, Vec2, Vec3};

/// A player: the position of the eye, and the selector, which keeps the previous cuts.
struct Player {
    name: &'static str,
    eye: Vec3,
    selector: Selector,
}

fn main() -> Result<(), MeshError> {
    // Ten by ten rocks. A server would read hierarchies from `.fieldlod` files.
    let rock = bake_mesh(&fixtures::rock(5, 1), &BakeConfig::default())?;
    let mut scene = Scene::default();
    let mesh = scene.add_mesh(&rock);
    for index in 0..100u8 {
        let (x, z) = (f32::from(index % 10), f32::from(index / 10));
        let place = Affine3A::from_translation(Vec3::new(4.0 * x, 0.0, -4.0 * z));
        scene.add_instance(mesh, place, 1.0);
    }
    scene.update();

    let player = |name, eye| Player {
        name,
        eye,
        selector: Selector::default(),
    };
    let mut players = [
        player("near", Vec3::new(18.0, 2.0, 4.0)),
        player("far", Vec3::new(18.0, 2.0, 400.0)),
    ];
    let projection = Mat4::perspective_infinite_reverse_rh(1.0, 16.0 / 9.0, 0.1);
    let screen = Vec2::new(1920.0, 1080.0);
    let camera = Camera::from_projection(&projection, screen).expect("a perspective projection");
    let settings = LodSettings::with_error_px(1.0);
    for frame in 0..3u8 {
        for player in &mut players {
            // Everybody walks forward.
            player.eye.z -= 1.0;
            let view = View::new(camera, &Affine3A::from_translation(player.eye));
            player.selector.select(&scene, &view, &settings);
            println!(
                "frame {frame}: {} needs {} of {} triangles, {} instances changed",
                player.name,
                player.selector.triangle_count(),
                100 * rock.source_triangle_count(),
                player.selector.changes().count(),
            );
        }
    }
    Ok(())
}
