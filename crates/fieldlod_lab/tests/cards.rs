//! Levels of cards are drawn as what they stand for looks.

mod common;

use std::sync::Arc;

use fieldlod_bake::{BakeConfig, SourceMesh, Surface, SurfaceAlpha, bake_mesh, fixtures};
use fieldlod_hierarchy::{Card, CardLevel, CardPicture, Cards, Hierarchy, Sphere};
use fieldlod_lab::eye::Eye;
use fieldlod_lab::props;
use fieldlod_lab::render::{Picture, PlacedUnits};
use glam::{Affine3A, Vec2, Vec3, Vec4};

fn eye(from: Vec3) -> Eye {
    let eye = Eye::perspective(20.0, Vec2::splat(128.0), 0.01);
    eye.looking_at(from, Vec3::ZERO)
}

fn covered(picture: &Picture) -> f64 {
    picture.covered.iter().filter(|covered| **covered).count() as f64
}

/// The mean colour of pixels that are covered wholly, 0 to 255.
fn mean_color(picture: &Picture) -> [f64; 3] {
    let width = picture.size_px.x as usize;
    let texel = |pixel: usize, x: usize, y: usize| {
        (pixel / width * 2 + y) * width * 2 + pixel % width * 2 + x
    };
    let is_covered = |pixel: &usize| {
        let texels = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(x, y)| texel(*pixel, x, y));
        texels.iter().all(|texel| picture.covered[*texel])
    };
    let pixels: Vec<usize> = (0..picture.colors.len()).filter(is_covered).collect();
    let sum = |channel: usize| {
        let colors = pixels.iter().map(|pixel| picture.colors[*pixel][channel]);
        colors.map(f64::from).sum::<f64>()
    };
    [0, 1, 2].map(|channel| sum(channel) / pixels.len() as f64)
}

/// Leaves on a ball that are known to be opaque, so that they get cards.
fn crown() -> Hierarchy {
    let mesh = SourceMesh {
        surface: Some(Arc::new(Surface::new(Vec4::ONE, SurfaceAlpha::Opaque))),
        ..fixtures::crown(4000, 1)
    };
    let config = BakeConfig {
        cards: true,
        ..BakeConfig::default()
    };
    bake_mesh(&mesh, &config).unwrap()
}

/// A sheet that faces +Y, and after it a card in its place whose first half alone is opaque.
fn sheet() -> Hierarchy {
    let mut baked = bake_mesh(&fixtures::plane(8), &BakeConfig::default()).unwrap();
    let color = |at: usize| match at % 16 < 8 {
        true => [255, 255, 255, 255],
        false => [255, 255, 255, 0],
    };
    let picture = CardPicture {
        side_texels: 16,
        colors: (0..256).map(color).collect(),
        normals: vec![[128, 128, 255]; 256],
        turns_over: true,
        tint: Vec3::ONE,
    };
    let sphere = Sphere::around(baked.vertices.positions.iter().copied());
    let min = baked.vertices.positions.iter().copied().reduce(Vec3::min);
    let max = baked.vertices.positions.iter().copied().reduce(Vec3::max);
    let (min, max) = (min.unwrap(), max.unwrap());
    let card = Card {
        corner: min,
        // To +Y: from z to x.
        across: Vec3::Z * (max.z - min.z),
        down: Vec3::X * (max.x - min.x),
        first_texel: [0; 2],
        size_texels: [16; 2],
    };
    baked.cards = Some(Cards {
        levels: vec![CardLevel {
            error_in_local: sphere.radius,
            cards: vec![card],
        }],
        picture: Arc::new(picture),
    });
    baked.whole_mesh_levels().unwrap()
}

#[test]
fn cards_cover_what_the_source_covers_and_are_lit_alike() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let whole = crown().whole_mesh_levels().unwrap();
    let units = whole.card_units();
    assert!(units.len() >= 2, "{units:?}");
    let model = renderer.upload(&whole);
    let draw = |unit: usize, from: Vec3| {
        let units = [unit as u32];
        let (picture, map) = renderer.draw_units(&model, &eye(from), &units).unwrap();
        let shown = map.units.iter().map(|shown| *shown == Some(unit as u32));
        assert_eq!(shown.collect::<Vec<bool>>(), picture.covered);
        assert_eq!(renderer.draw(&model, &eye(from), &units).unwrap(), picture);
        picture
    };
    for from in [
        Vec3::new(5.0, 3.0, 6.0),
        Vec3::new(-9.0, 1.0, -12.0),
        Vec3::new(1.0, -25.0, 8.0),
    ] {
        let source = draw(0, from);
        for unit in units.clone().take(2) {
            let cards = draw(unit, from);
            let ratio = covered(&cards) / covered(&source);
            let (color, expected) = (mean_color(&cards), mean_color(&source));
            println!("{from} {unit}: {ratio:.3} {color:.1?} {expected:.1?}");
            assert!((0.95..1.05).contains(&ratio), "{from} {unit}: {ratio}");
            for (color, expected) in color.into_iter().zip(expected) {
                let ratio = color / expected;
                assert!((0.9..1.1).contains(&ratio), "{from} {unit}: {ratio}");
            }
        }
    }
}

#[test]
fn a_card_is_lit_from_both_sides_as_a_sheet_is() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let sheet = sheet();
    let unit = sheet.card_units().start as u32;
    assert_eq!(unit as usize, sheet.units.len() - 1);
    let model = renderer.upload(&sheet);
    for from in [
        Vec3::new(0.3, 9.0, 0.2),
        Vec3::new(0.3, -9.0, 0.2),
        Vec3::new(6.0, -7.0, 0.1),
    ] {
        let [whole, half] =
            [0, unit].map(|unit| renderer.draw(&model, &eye(from), &[unit]).unwrap());
        let ratio = covered(&half) / covered(&whole);
        println!(
            "{from}: {ratio:.3} {:.1?} {:.1?}",
            mean_color(&half),
            mean_color(&whole)
        );
        assert!((0.49..0.51).contains(&ratio), "{from}: {ratio}");
        for (color, expected) in mean_color(&half).into_iter().zip(mean_color(&whole)) {
            assert!(
                (0.95..1.05).contains(&(color / expected)),
                "{from}: {color} {expected}"
            );
        }
    }
}

/// A card throws the shadow of what is opaque of it.
#[test]
fn shadows_are_cut_out() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let sheet = sheet();
    let unit = sheet.card_units().start as u32;
    let model = renderer.upload(&sheet);
    // The floor is the sheet, three times as large; what hangs above it is out of view.
    let eye = eye(Vec3::new(0.0, 12.0, 0.1));
    let lit = Sphere {
        center: Vec3::ZERO,
        radius: 12.0,
    };
    let dark_share = |unit: u32| {
        let draw = |units: &[u32]| {
            let floor = PlacedUnits {
                world_from_local: Affine3A::from_scale(Vec3::splat(4.0)),
                ..PlacedUnits::at_origin(&model, &[0])
            };
            let above = PlacedUnits {
                world_from_local: Affine3A::from_translation(Vec3::new(-5.0, 7.0, 5.0)),
                ..PlacedUnits::at_origin(&model, units)
            };
            renderer
                .draw_scene(&[floor, above], &eye, Some(&lit))
                .unwrap()
                .0
        };
        let (without, with) = (draw(&[]), draw(&[unit]));
        let pairs = without.colors.iter().zip(&with.colors);
        pairs.filter(|(a, b)| b[0] < 0.8 * a[0]).count() as f64
    };
    let (whole, half) = (dark_share(0), dark_share(unit));
    println!("{whole} {half}");
    assert!(whole > 50.0, "{whole}");
    let ratio = half / whole;
    assert!((0.48..0.52).contains(&ratio), "{ratio}");
}

#[test]
fn levels_that_are_cards_are_named_in_the_table() {
    let Some((renderer, _one)) = common::renderer() else {
        return;
    };
    let result = props::measure(&renderer, "crown", &[crown()], 2).unwrap();
    let cards = result.levels.iter().filter(|level| level.has_cards).count();
    assert!(cards >= 2 && cards < result.levels.len(), "{result:?}");
    let table = props::table(std::slice::from_ref(&result));
    println!("{table}");
    assert_eq!(table.matches(" c  0.").count(), cards, "{table}");
}
