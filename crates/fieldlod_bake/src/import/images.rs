//! PNG and JPEG images in buffers, data URIs and files.

use std::fmt;
use std::io::Cursor;

use glam::UVec2;
use gltf::Document;
use thiserror::Error;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::ReadBeside;
use super::buffers::{Buffers, data_of, read_uri};

/// The largest side of a decoded image, in texels. 8,192² texels take a quarter of a gigabyte; larger images could use
/// up the memory of a build server.
const MOST_SIDE: u32 = 8_192;
/// Memory of the PNG decoder besides the texels, in bytes. Bounds what a damaged file can claim.
const MOST_BYTES: usize = 1 << 28;

/// An image that could not be read. Primitives with it have no surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnreadImage {
    /// Index of the image in the file. The number of images if a texture has no image.
    pub image: u32,
    /// The name of the image or of its file, or an empty string.
    pub name: String,
    /// The fault.
    pub fault: ImageFault,
}

impl fmt::Display for UnreadImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "image {}", self.image)?;
        if !self.name.is_empty() {
            write!(f, " ({:?})", self.name)?;
        }
        write!(f, " is ignored: {}", self.fault)
    }
}

/// Why an image could not be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImageFault {
    /// The image has no source, or an unsupported extension holds it.
    #[error("its source is missing or in an unsupported extension")]
    Missing,
    /// The bytes of the image could not be read.
    #[error("{0}")]
    Unavailable(String),
    /// The image is neither PNG nor JPEG, but for example KTX2 or WebP.
    #[error("it is neither PNG nor JPEG")]
    Format,
    /// The width and height in texels are too large.
    #[error("it is too large: {0} × {1} texels")]
    TooLarge(u32, u32),
    /// The error of the decoder.
    #[error("it could not be decoded: {0}")]
    Broken(String),
}

/// A decoded image.
pub(super) struct Pixels {
    pub(super) size: UVec2,
    channels: usize,
    bytes: Vec<u8>,
}

impl Pixels {
    /// Red, green, blue and alpha in column `x` and row `y`.
    pub(super) fn texel(&self, x: u32, y: u32) -> [u8; 4] {
        let first = (y as usize * self.size.x as usize + x as usize) * self.channels;
        match self.bytes[first..first + self.channels] {
            [gray] => [gray, gray, gray, u8::MAX],
            [gray, alpha] => [gray, gray, gray, alpha],
            [red, green, blue] => [red, green, blue, u8::MAX],
            [red, green, blue, alpha, ..] => [red, green, blue, alpha],
            [] => [0; 4],
        }
    }

    /// `None` if there are too few bytes.
    fn of(size: UVec2, bytes: Vec<u8>) -> Option<Self> {
        let texels = size.x as usize * size.y as usize;
        let channels = bytes.len().checked_div(texels).filter(|count| *count > 0)?;
        Some(Self {
            size,
            channels,
            bytes,
        })
    }
}

/// Reads an image of a valid document by its index.
pub(super) fn read(
    document: &Document,
    index: usize,
    buffers: &Buffers,
    beside: &ReadBeside<'_>,
) -> Result<Pixels, UnreadImage> {
    let image = &document.as_json().images[index];
    // A data URI is no name: it may have megabytes.
    let uri = image.uri.as_deref().filter(|uri| data_of(uri).is_none());
    let unread = |fault| UnreadImage {
        image: index as u32,
        name: uri.or(image.name.as_deref()).unwrap_or_default().to_owned(),
        fault,
    };
    let view = image.buffer_view.as_ref();
    let view = view.and_then(|view| document.views().nth(view.value()));
    if let Some(view) = view {
        let outside = || ImageFault::Unavailable("it lies outside its buffer".into());
        let bytes = buffers.view(&view).ok_or_else(outside);
        return bytes.and_then(decode).map_err(unread);
    }
    let Some(uri) = &image.uri else {
        return Err(unread(ImageFault::Missing));
    };
    let unavailable = |fault: super::BufferFault| ImageFault::Unavailable(fault.to_string());
    let bytes = read_uri(uri, beside).map_err(unavailable);
    bytes.and_then(|bytes| decode(&bytes)).map_err(unread)
}

/// Decodes an image in the format that its first bytes state. A panic of a decoder counts as a broken image.
fn decode(bytes: &[u8]) -> Result<Pixels, ImageFault> {
    let decode: fn(&[u8]) -> Result<Pixels, ImageFault> = match bytes {
        [0x89, b'P', b'N', b'G', ..] => decode_png,
        [0xff, 0xd8, ..] => decode_jpeg,
        _ => return Err(ImageFault::Format),
    };
    std::panic::catch_unwind(|| decode(bytes)).unwrap_or_else(|_| Err(broken("its decoder failed")))
}

fn broken(fault: impl fmt::Display) -> ImageFault {
    let one_line = fault.to_string().replace(char::is_control, " ");
    ImageFault::Broken(one_line)
}

fn checked_size(width: u32, height: u32) -> Result<UVec2, ImageFault> {
    if width.max(height) <= MOST_SIDE {
        Ok(UVec2::new(width, height))
    } else {
        Err(ImageFault::TooLarge(width, height))
    }
}

fn decode_png(bytes: &[u8]) -> Result<Pixels, ImageFault> {
    let limits = png::Limits { bytes: MOST_BYTES };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let (width, height) = decoder.read_header_info().map_err(broken)?.size();
    let size = checked_size(width, height)?;
    let mut reader = decoder.read_info().map_err(broken)?;
    let length = reader.output_buffer_size();
    let mut texels = vec![0; length.ok_or(ImageFault::TooLarge(width, height))?];
    reader.next_frame(&mut texels).map_err(broken)?;
    Pixels::of(size, texels).ok_or_else(|| broken("it has no texels"))
}

fn decode_jpeg(bytes: &[u8]) -> Result<Pixels, ImageFault> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(broken)?;
    let info = decoder.info().ok_or_else(|| broken("it has no header"))?;
    let size = checked_size(info.width.into(), info.height.into())?;
    let texels = decoder.decode().map_err(broken)?;
    Pixels::of(size, texels).ok_or_else(|| broken("it has no texels"))
}
