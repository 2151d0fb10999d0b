//! A scene that stands for a game in a browser: terrain in pieces, props in numbers, characters and a minimap, with
//! levels of detail from `.fieldlod` files beside the assets.
//!
//! `.ci/web` builds everything, opens the page in headless browsers and compares the pictures with that of a native
//! program. It leaves the page in `target/web-page`: serve that folder with any web server. The steps of a native build:
//! - `web assets FOLDER` writes the assets and bakes their levels.
//! - `web still FOLDER --picture FILE` draws a picture and prints the selected triangles.
//! - `web compare FILE FILE` prints the image error FLIP.

#[cfg(not(target_arch = "wasm32"))]
mod assets;
#[cfg(not(target_arch = "wasm32"))]
#[path = "../../../crates/bevy_fieldlod/examples/common/mod.rs"]
mod common;
mod controls;
#[cfg(feature = "lods")]
mod lods;
mod scene;

use bevy::prelude::*;
use scene::Options;

/// Adds everything but Bevy's plugins.
fn add_game(app: &mut App, options: Options) {
    app.add_plugins((scene::plugin, controls::plugin))
        .insert_resource(options);
    #[cfg(feature = "lods")]
    app.add_plugins(lods::plugin);
}

/// Starts the game on the page, with the fields of [`Options`].
#[cfg(target_arch = "wasm32")]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn start(copies: u32, is_still: bool, has_ranges: bool) {
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(AssetPlugin {
                // Otherwise each asset costs another request, for settings that do not exist.
                meta_check: bevy::asset::AssetMetaCheck::Never,
                ..default()
            })
            .set(WindowPlugin {
                primary_window: Some(Window {
                    canvas: Some("#game".into()),
                    fit_canvas_to_parent: true,
                    ..default()
                }),
                ..default()
            }),
    );
    let options = Options {
        copies,
        is_still,
        has_ranges,
    };
    add_game(&mut app, options);
    app.run();
}

/// The page calls [`start`].
#[cfg(target_arch = "wasm32")]
fn main() {}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> Result {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["assets", folder] => assets::write(folder.as_ref()),
        ["compare", reference, picture] => compare(reference.as_ref(), picture.as_ref()),
        ["still", folder, ..] => {
            let mut app = App::new();
            app.add_plugins(common::plugins_with_assets_in(folder.into()));
            let options = Options {
                copies: 1,
                is_still: true,
                has_ranges: false,
            };
            add_game(&mut app, options);
            app.add_systems(Last, controls::print_numbers);
            app.run();
            Ok(())
        }
        _ => {
            Err("usage: web assets FOLDER | still FOLDER --picture FILE | compare FILE FILE".into())
        }
    }
}

/// Prints the mean of FLIP over two pictures of one size.
#[cfg(not(target_arch = "wasm32"))]
fn compare(reference: &std::path::Path, picture: &std::path::Path) -> Result {
    use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};
    let [reference, picture] = [reference, picture].map(image::open);
    let [reference, picture] = [reference?.to_rgb8(), picture?.to_rgb8()];
    if reference.dimensions() != picture.dimensions() {
        let sizes = [reference.dimensions(), picture.dimensions()];
        return Err(format!("the pictures have different sizes: {sizes:?}").into());
    }
    let [reference, picture] = [reference, picture]
        .map(|picture| FlipImageRgb8::with_data(picture.width(), picture.height(), &picture));
    let errors = nv_flip::flip(reference, picture, DEFAULT_PIXELS_PER_DEGREE).to_vec();
    println!("{:.4}", errors.iter().sum::<f32>() / errors.len() as f32);
    Ok(())
}
