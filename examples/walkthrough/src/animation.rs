//! Pictures of a run, joined to a GIF.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use gif::{Encoder, Frame, Repeat};
use image::RgbImage;
use image::imageops::{self, FilterType};

const WIDTH_PX: u32 = 400;
/// From 1, best, to 30, fastest: how well each frame's 256 colours are chosen.
const COLOR_SPEED: i32 = 4;

/// Frames in the order in which they will be shown.
pub(crate) struct Animation {
    file: PathBuf,
    /// Time that each frame is shown, in hundredths of a second, as the format has it.
    delay_in_cs: u16,
    frames: Vec<Option<RgbImage>>,
}

impl Animation {
    /// An animation of `count` frames that will last so long.
    pub(crate) fn new(file: &Path, count: usize, duration_in_s: f32) -> Self {
        let delay_in_s = duration_in_s / count.max(1) as f32;
        Self {
            file: file.to_owned(),
            // Viewers slow down what is faster than 50 frames a second.
            delay_in_cs: (delay_in_s * 100.0).round().clamp(2.0, 1000.0) as u16,
            frames: vec![None; count],
        }
    }

    /// Takes a picture, scaled down.
    pub(crate) fn put(&mut self, index: usize, picture: &RgbImage) {
        let width = WIDTH_PX.min(picture.width());
        let height = (picture.height() * width / picture.width()).max(1);
        self.frames[index] = Some(imageops::resize(
            picture,
            width,
            height,
            FilterType::CatmullRom,
        ));
    }

    /// Writes the file.
    pub(crate) fn save(self) -> Result<(), String> {
        let fault = |fault: &dyn std::fmt::Display| format!("{}: {fault}", self.file.display());
        let file = File::create(&self.file).map_err(|cause| fault(&cause))?;
        self.write(BufWriter::new(file))
            .map_err(|cause| fault(&cause))
    }

    fn write(&self, out: impl std::io::Write) -> Result<(), gif::EncodingError> {
        let pictures = || self.frames.iter().flatten();
        let Some(first) = pictures().next() else {
            return Ok(());
        };
        let side = |side: u32| u16::try_from(side).unwrap_or(u16::MAX);
        let (width, height) = (side(first.width()), side(first.height()));
        let mut encoder = Encoder::new(out, width, height, &[])?;
        encoder.set_repeat(Repeat::Infinite)?;
        for picture in pictures() {
            let mut frame = Frame::from_rgb_speed(width, height, picture.as_raw(), COLOR_SPEED);
            frame.delay = self.delay_in_cs;
            encoder.write_frame(&frame)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_animation_keeps_its_frames_in_order_whatever_order_they_come_in() {
        let mut animation = Animation::new(Path::new("unused.gif"), 3, 0.6);
        for index in [2, 0, 1] {
            let shade = 100 * index as u8;
            animation.put(
                index,
                &RgbImage::from_pixel(800, 450, image::Rgb([shade; 3])),
            );
        }
        let mut file = Vec::new();
        animation.write(&mut file).unwrap();
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&*file).unwrap();
        assert_eq!((decoder.width(), decoder.height()), (400, 225));
        for shade in [0, 100, 200] {
            let frame = decoder.read_next_frame().unwrap().unwrap();
            assert_eq!((frame.buffer[0], frame.delay), (shade, 20));
        }
        assert!(decoder.read_next_frame().unwrap().is_none());
    }
}
