//! Values that the page and the game exchange.

use std::sync::Mutex;

use bevy::platform::time::Instant;
use bevy::prelude::*;

/// What the player chose on the page.
#[derive(Debug)]
pub(crate) struct Controls {
    pub(crate) error_px: f32,
    pub(crate) is_full_detail: bool,
    /// Turns of the camera around the vertical axis and upwards, in radians, and the factor of its distance.
    pub(crate) turn: [f32; 2],
    pub(crate) zoom: f32,
}

pub(crate) static CONTROLS: Mutex<Controls> = Mutex::new(Controls {
    error_px: 1.0,
    is_full_detail: false,
    turn: [0.0; 2],
    zoom: 1.0,
});

/// What the page shows. Times are sums over all frames.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct Numbers {
    pub(crate) loaded: f32,
    pub(crate) entities: u32,
    pub(crate) triangles: u64,
    pub(crate) triangles_full: u64,
    pub(crate) selection_ms: f32,
    frames: u32,
    main_ms: f32,
    begin: Option<Instant>,
}

#[cfg(target_arch = "wasm32")]
static NUMBERS: Mutex<String> = Mutex::new(String::new());

/// The systems in `Last` that count.
#[derive(SystemSet, Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Counting;

pub(crate) fn plugin(app: &mut App) {
    app.init_resource::<Numbers>()
        .add_systems(First, |mut numbers: ResMut<Numbers>| {
            numbers.begin = Some(Instant::now());
        })
        .add_systems(Last, end_frame.after(Counting));
}

fn end_frame(mut numbers: ResMut<Numbers>) {
    let begin = numbers.begin.unwrap_or_else(Instant::now);
    numbers.main_ms += 1e3 * begin.elapsed().as_secs_f32();
    numbers.frames += 1;
    #[cfg(target_arch = "wasm32")]
    {
        *NUMBERS.lock().expect("no panic") = numbers.to_json();
    }
}

impl Numbers {
    fn to_json(&self) -> String {
        let Self {
            loaded,
            entities,
            triangles,
            triangles_full,
            selection_ms,
            frames,
            main_ms,
            begin: _,
        } = self;
        format!(
            "{{\"loaded\": {loaded}, \"entities\": {entities}, \"triangles\": {triangles}, \
             \"triangles_full\": {triangles_full}, \"selection_ms\": {selection_ms}, \"frames\": {frames}, \
             \"main_ms\": {main_ms}}}"
        )
    }
}

/// Prints the numbers of the last frame.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn print_numbers(numbers: Res<Numbers>, exit: MessageReader<AppExit>) {
    if !exit.is_empty() {
        println!("{}", numbers.to_json());
    }
}

/// The functions that the page calls.
#[cfg(target_arch = "wasm32")]
#[expect(unreachable_pub, reason = "wasm-bindgen exports public functions only")]
mod page {
    use wasm_bindgen::prelude::wasm_bindgen;

    use super::{CONTROLS, NUMBERS};

    #[wasm_bindgen]
    pub fn set_quality(error_px: f32, is_full_detail: bool) {
        let mut controls = CONTROLS.lock().expect("no panic");
        (controls.error_px, controls.is_full_detail) = (error_px, is_full_detail);
    }

    #[wasm_bindgen]
    pub fn orbit(yaw: f32, pitch: f32, zoom: f32) {
        let mut controls = CONTROLS.lock().expect("no panic");
        controls.turn[0] += yaw;
        controls.turn[1] += pitch;
        controls.zoom *= zoom;
    }

    /// The numbers of the last frame, as JSON.
    #[wasm_bindgen]
    pub fn numbers() -> String {
        NUMBERS.lock().expect("no panic").clone()
    }
}
