//! The files of a run along the path: pictures, a sheet of all of them, an animation.

use std::path::{Path, PathBuf};

use bevy::image::Image;
use image::RgbImage;

use crate::animation::Animation;
use crate::args::Args;
use crate::contact_sheet::ContactSheet;
use crate::path::DURATION_IN_S;

/// Writes pictures as they come.
pub(crate) struct PictureWriter {
    directory: PathBuf,
    numbers: Vec<u32>,
    sheet: ContactSheet,
    animation: Option<Animation>,
    missing: usize,
}

impl PictureWriter {
    /// A writer into `directory`, which is made; `frames` are (number, fraction of a round on the path).
    pub(crate) fn new(
        directory: &Path,
        frames: &[(u32, f32)],
        size_in_px: (u32, u32),
        args: &Args,
    ) -> Result<Self, String> {
        make_writable(directory)?;
        let duration_in_s = (args.stretch.end - args.stretch.start) * DURATION_IN_S;
        let animation = |file: &PathBuf| Animation::new(file, frames.len(), duration_in_s);
        Ok(Self {
            directory: directory.to_owned(),
            numbers: frames.iter().map(|(number, _)| *number).collect(),
            sheet: ContactSheet::new(frames.len() as u32, size_in_px),
            animation: args.animation.as_ref().map(animation),
            missing: frames.len(),
        })
    }

    /// Writes a picture and keeps it, scaled down, for what shows all of them.
    pub(crate) fn add(&mut self, number: u32, picture: Image) -> Result<(), String> {
        let picture = picture.try_into_dynamic();
        let picture = picture.map_err(|fault| fault.to_string())?.to_rgb8();
        self.save(&format!("frame_{number:03}.png"), &picture)?;
        if let Some(index) = self.numbers.iter().position(|n| *n == number) {
            self.sheet.put(index as u32, &picture);
            if let Some(animation) = &mut self.animation {
                animation.put(index, &picture);
            }
        }
        self.missing -= 1;
        Ok(())
    }

    pub(crate) fn is_complete(&self) -> bool {
        self.missing == 0
    }

    /// Writes what shows all pictures; a single one needs no contact sheet.
    pub(crate) fn finish(self) -> Result<(), String> {
        if self.missing > 0 {
            let count = self.missing;
            return Err(format!("{count} pictures never came back from the GPU"));
        }
        if self.numbers.len() > 1 {
            self.save("contact_sheet.png", self.sheet.image())?;
        }
        self.animation.map_or(Ok(()), Animation::save)
    }

    fn save(&self, name: &str, picture: &RgbImage) -> Result<(), String> {
        let file = self.directory.join(name);
        let written = picture.save(&file);
        written.map_err(|fault| format!("{}: {fault}", file.display()))
    }
}

/// Makes a directory, and fails early where no file can be written.
fn make_writable(directory: &Path) -> Result<(), String> {
    let cannot_write = |fault| format!("{}: cannot write here: {fault}", directory.display());
    std::fs::create_dir_all(directory).map_err(cannot_write)?;
    let probe = directory.join(".walkthrough-probe");
    std::fs::write(&probe, []).map_err(cannot_write)?;
    std::fs::remove_file(&probe).map_err(cannot_write)
}
