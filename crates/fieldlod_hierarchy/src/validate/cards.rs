//! Levels of cards, and their picture.

use super::InvalidHierarchy as E;
use crate::cards::{Card, CardLevel, CardPicture, Cards};

/// Of the angle between the edges of a card: they are rounded.
const MOST_COSINE: f32 = 1e-3;

impl Cards {
    pub(super) fn check(&self) -> Result<(), E> {
        self.picture.check()?;
        self.check_errors()?;
        self.check_counts()?;
        for (number, level) in self.levels.iter().enumerate() {
            level.check(number, self.picture.side_texels)?;
        }
        Ok(())
    }

    fn check_errors(&self) -> Result<(), E> {
        let mut least = 0.0;
        for (level, error) in self.levels.iter().map(|l| l.error_in_local).enumerate() {
            if !error.is_finite() || error < least {
                return Err(E::BadCardError { level, error });
            }
            least = error;
        }
        Ok(())
    }

    fn check_counts(&self) -> Result<(), E> {
        if self.levels.is_empty() {
            return Err(E::BadCardCount { level: 0, count: 0 });
        }
        let mut before = usize::MAX;
        for (level, count) in self.levels.iter().map(|l| l.cards.len()).enumerate() {
            if count == 0 || count >= before {
                return Err(E::BadCardCount { level, count });
            }
            before = count;
        }
        Ok(())
    }
}

impl CardLevel {
    fn check(&self, level: usize, side_texels: u32) -> Result<(), E> {
        for (card, data) in self.cards.iter().enumerate() {
            if !data.is_finite() {
                return Err(E::CardNotFinite { level, card });
            }
            if !data.has_edges() {
                return Err(E::CardWithoutEdge { level, card });
            }
            if !data.is_rectangular() {
                return Err(E::CardNotRectangular { level, card });
            }
            if !data.is_inside(side_texels) {
                return Err(E::CardOutsidePicture { level, card });
            }
        }
        Ok(())
    }
}

impl Card {
    fn is_finite(&self) -> bool {
        let edges_in_local = [self.across.length(), self.down.length()];
        let are_finite = edges_in_local.iter().all(|length| length.is_finite());
        are_finite && self.corners().iter().all(|corner| corner.is_finite())
    }

    fn has_edges(&self) -> bool {
        self.across.length() > 0.0 && self.down.length() > 0.0
    }

    fn is_rectangular(&self) -> bool {
        let [tangent, bitangent, _] = self.axes();
        tangent.dot(bitangent).abs() <= MOST_COSINE
    }

    fn is_inside(&self, side_texels: u32) -> bool {
        let rows_and_columns = self.first_texel.into_iter().zip(self.size_texels);
        rows_and_columns
            .map(|(first, size)| (u32::from(first), u32::from(size)))
            .all(|(first, size)| size > 0 && first + size <= side_texels)
    }
}

impl CardPicture {
    fn check(&self) -> Result<(), E> {
        let side_texels = self.side_texels;
        if !Self::is_side(side_texels) {
            return Err(E::BadPictureSide { side_texels });
        }
        let texels = side_texels as usize * side_texels as usize;
        let counts = [
            ("colors", self.colors.len()),
            ("normals", self.normals.len()),
        ];
        if let Some((what, count)) = counts.into_iter().find(|&(_, count)| count != texels) {
            return Err(E::PictureTexelCount {
                what,
                count,
                texels,
            });
        }
        let tint = self.tint;
        match tint.is_finite() && tint.min_element() >= 0.0 {
            true => Ok(()),
            false => Err(E::BadPictureTint { tint }),
        }
    }
}
