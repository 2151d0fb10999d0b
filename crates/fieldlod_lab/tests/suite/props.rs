//! Levels of plants: changes of level as the camera approaches, and the gain of baking meshes together.

use fieldlod_bake::{BakeConfig, bake_mesh, bake_together, fixtures};
use fieldlod_lab::props::{self, LevelResult, Prop, PropResult, RADII_PX};

use crate::common::renderer;

/// While the camera approaches a prop, a change of level changes FLIP by a factor of at most 1.6. It changes the covered
/// area by at most 2 % of that of the source, or by four pixels: two standard deviations that the bake allows. Changes to
/// full detail are left out, because its FLIP is 0.
#[test]
fn changes_of_level_on_approach_are_small() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let crown = fixtures::crown(1500, 1);
    let prop = Prop::new(
        &renderer,
        &[bake_mesh(&crown, &BakeConfig::default()).unwrap()],
    );
    // Each frame enlarges the prop by a sixtieth. At a distance of 3 m that is a speed of 3 m/s at 60 frames per second.
    let radii = std::iter::successors(Some(3.0f32), |radius_px| Some(radius_px * 61.0 / 60.0));
    let frames = radii
        .take_while(|radius_px| *radius_px < 160.0)
        .map(|radius_px| {
            let eye = props::eye(&prop.sphere, props::direction(3, 8), radius_px);
            let units = prop.selected(&eye);
            (eye, units, radius_px)
        });
    let frames: Vec<_> = frames.collect();
    let mut changes = 0;
    for pair in frames.windows(2) {
        let [before, after] = [&pair[0], &pair[1]].map(|(_, units, _)| prop.triangles(units));
        if before == after {
            continue;
        }
        let [a, b] = [&pair[0], &pair[1]].map(|(eye, units, _)| {
            let draw = |units: &[Vec<u32>]| prop.draw(&renderer, eye, units).unwrap();
            props::look_of(&draw(&prop.source()), &draw(units))
        });
        if a.flip > 0.0 && b.flip > 0.0 {
            let (ratio, step) = (a.flip / b.flip, b.covered - a.covered);
            let is_small = (1.0 / 1.6..=1.6).contains(&ratio);
            assert!(is_small, "{before} {after}: {ratio}");
            // A crown covers less than its sphere.
            let disc_px = std::f32::consts::PI * pair[1].2 * pair[1].2;
            let step_px = step * f64::from(disc_px);
            let is_small = step.abs() <= 0.02 || step_px.abs() <= 4.0;
            assert!(is_small, "{before} {after}: {step} {step_px}");
            changes += 1;
        }
    }
    assert!(changes > 0);
}

/// Interpolates the triangles that levels need for a value of FLIP at one of the sizes.
fn triangles_at(result: &PropResult, size: usize, flip: f64) -> Option<f64> {
    let of_level = |level: &LevelResult| (f64::from(level.triangles), level.looks[size].flip);
    result.levels.windows(2).find_map(|pair| {
        let [(more, low), (less, high)] = [&pair[0], &pair[1]].map(of_level);
        let share = (flip - low) / (high - low);
        ((0.0..=1.0).contains(&share)).then(|| more * (less / more).powf(share))
    })
}

/// At each size, bark and leaves that are baked together need fewer triangles on average for the same FLIP.
#[test]
fn meshes_baked_together_need_fewer_triangles() {
    let Some((renderer, _lock)) = renderer() else {
        return;
    };
    let [bark, leaves] = fixtures::tree_in_parts(4000, 1);
    let config = BakeConfig::default();
    let apart = [&bark, &leaves].map(|mesh| bake_mesh(mesh, &config).unwrap());
    let together = bake_together(&[&bark, &leaves], &config).into_iter();
    let together: Vec<_> = together.map(|baked| baked.unwrap().0).collect();
    let apart = props::measure(&renderer, "apart", &apart).unwrap();
    let together = props::measure(&renderer, "together", &together).unwrap();
    for (size, radius_px) in RADII_PX.iter().enumerate() {
        let levels = together.levels.iter();
        let levels = levels.filter(|level| (100..4_000).contains(&level.triangles));
        let ratios: Vec<f64> = levels
            .filter_map(|level| {
                let apart = triangles_at(&apart, size, level.looks[size].flip)?;
                Some(f64::from(level.triangles) / apart)
            })
            .collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let is_better = ratios.len() > 3 && mean < 1.0;
        assert!(is_better, "{radius_px} px: {ratios:.2?}");
    }
}
