//! Number formats of vertex attributes.

use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions};

/// Meaning of a vertex attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Attribute {
    Position,
    Normal,
    Tangent,
    Uv,
    Color,
}

/// Formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Formats {
    /// The formats of plain glTF that Bevy reads.
    AsBevy,
    /// The formats of `KHR_mesh_quantization` as well.
    Quantized,
}

impl Formats {
    /// The formats of a primitive with these positions. `None` if neither glTF nor the extension allows their format.
    /// Bevy reads primitives with plain positions, so their other attributes are read exactly as Bevy reads them.
    pub(super) fn of_positions(positions: &Accessor<'_>) -> Option<Self> {
        let all = [Self::AsBevy, Self::Quantized];
        all.into_iter()
            .find(|formats| formats.allow(Attribute::Position, positions))
    }

    /// Returns `true` if `attribute` may have the format of `accessor`.
    pub(super) fn allow(self, attribute: Attribute, accessor: &Accessor<'_>) -> bool {
        let shape = accessor.dimensions();
        let shapes: &[Dimensions] = match attribute {
            Attribute::Position | Attribute::Normal => &[Dimensions::Vec3],
            Attribute::Tangent => &[Dimensions::Vec4],
            Attribute::Uv => &[Dimensions::Vec2],
            Attribute::Color => &[Dimensions::Vec3, Dimensions::Vec4],
        };
        let (kind, normalized) = (accessor.data_type(), accessor.normalized());
        let plain = is_plain(attribute, kind, normalized);
        let quantized = self == Self::Quantized && is_quantized(attribute, kind, normalized);
        shapes.contains(&shape) && (plain || quantized)
    }
}

fn is_plain(attribute: Attribute, kind: DataType, normalized: bool) -> bool {
    let shares = matches!(attribute, Attribute::Uv | Attribute::Color);
    match kind {
        DataType::F32 => !normalized,
        DataType::U8 | DataType::U16 => shares && normalized,
        _ => false,
    }
}

/// The table of `KHR_mesh_quantization`.
fn is_quantized(attribute: Attribute, kind: DataType, normalized: bool) -> bool {
    let signed = matches!(kind, DataType::I8 | DataType::I16);
    let unsigned = matches!(kind, DataType::U8 | DataType::U16);
    match attribute {
        Attribute::Position | Attribute::Uv => signed || unsigned,
        Attribute::Normal | Attribute::Tangent => signed && normalized,
        Attribute::Color => false,
    }
}

/// The format of one component.
#[derive(Clone, Copy, Debug)]
pub(super) struct Component {
    kind: DataType,
    normalized: bool,
}

impl Component {
    pub(super) fn of(accessor: &Accessor<'_>) -> Self {
        Self {
            kind: accessor.data_type(),
            normalized: accessor.normalized(),
        }
    }

    /// The number in `bytes`, with the same bits as in Bevy. The smallest two normalized signed integers are both -1.
    pub(super) fn number(self, bytes: &[u8]) -> f32 {
        let bits = little_endian(bytes);
        let (value, largest) = match self.kind {
            DataType::F32 => return f32::from_bits(bits),
            DataType::I8 => (f32::from(bits as u8 as i8), f32::from(i8::MAX)),
            DataType::U8 => (f32::from(bits as u8), f32::from(u8::MAX)),
            DataType::I16 => (f32::from(bits as u16 as i16), f32::from(i16::MAX)),
            DataType::U16 => (f32::from(bits as u16), f32::from(u16::MAX)),
            DataType::U32 => (bits as f32, u32::MAX as f32),
        };
        // Bevy multiplies by the reciprocal. A division would differ in the last bit.
        if self.normalized {
            (value * largest.recip()).max(-1.0)
        } else {
            value
        }
    }
}

/// The number in up to four bytes.
pub(super) fn little_endian(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |value, &byte| value << 8 | u32::from(byte))
}
