//! Day and night: what is there by day only or by night only.

use bevy::pbr::{DistanceFog, FogFalloff};
use bevy::prelude::*;

use crate::cameras::Look;
use crate::sky;

/// When an entity is there.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hours {
    Day,
    Night,
}

impl Hours {
    pub(crate) fn of(look: &Look) -> Self {
        if look.night { Self::Night } else { Self::Day }
    }

    /// The haze of distance.
    pub(crate) fn fog(self) -> DistanceFog {
        let (haze, toward_light) = match self {
            Self::Day => (sky::HORIZON, Color::linear_rgba(1.0, 0.7, 0.4, 0.35)),
            Self::Night => (
                sky::NIGHT_HORIZON,
                Color::linear_rgba(0.20, 0.26, 0.4, 0.25),
            ),
        };
        DistanceFog {
            color: Color::linear_rgb(haze.x, haze.y, haze.z),
            directional_light_color: toward_light,
            directional_light_exponent: 12.0,
            falloff: FogFalloff::ExponentialSquared { density: 0.0024 },
        }
    }

    /// Light of the sky in candela per square metre, and its colours above, around and below.
    pub(crate) fn skylight(self) -> (f32, [Color; 3]) {
        match self {
            Self::Day => (
                650.0,
                [
                    Color::linear_rgb(0.55, 0.75, 1.1),
                    Color::linear_rgb(0.75, 0.70, 0.65),
                    Color::linear_rgb(0.34, 0.26, 0.18),
                ],
            ),
            Self::Night => (
                150.0,
                [
                    Color::linear_rgb(0.45, 0.65, 1.2),
                    Color::linear_rgb(0.40, 0.50, 0.75),
                    Color::linear_rgb(0.20, 0.20, 0.22),
                ],
            ),
        }
    }
}

/// Shows what belongs to the hour.
pub(crate) fn plugin(app: &mut App) {
    app.add_systems(Update, keep_hours);
}

fn keep_hours(look: Res<Look>, mut things: Query<(Ref<Hours>, &mut Visibility)>) {
    for (hours, mut visibility) in &mut things {
        if look.is_changed() || hours.is_added() {
            visibility.set_if_neq(if *hours == Hours::of(&look) {
                Visibility::Inherited
            } else {
                Visibility::Hidden
            });
        }
    }
}
