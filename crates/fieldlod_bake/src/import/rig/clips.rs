//! Animation clips.
//!
//! Faulty channels and clips are left out without an error, because a bake also works without clips.

use gltf::Document;
use serde_json::Value;

use super::super::accessor::read_numbers;
use super::super::buffers::Buffers;

/// An animation.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// The name of the animation, or an empty string.
    pub name: String,
    /// The animated properties of nodes.
    pub channels: Vec<Channel>,
}

/// The animation of one property of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// The node, as an index into [`Import::nodes`](super::super::Import::nodes).
    pub node: u32,
    /// The animated property.
    pub property: Property,
    /// Interpolation between keyframes.
    pub interpolation: Interpolation,
    /// Times of the keyframes in seconds, ascending and finite.
    pub times: Vec<f32>,
    /// Finite values. Each keyframe has the same number of values. A cubic spline stores two tangents with each value.
    pub values: Vec<f32>,
}

/// An animated property of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Property {
    /// Translation.
    Translation,
    /// Rotation, as a quaternion.
    Rotation,
    /// Scale.
    Scale,
    /// Weights of morph targets.
    Weights,
}

/// Interpolation between keyframes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the previous keyframe.
    Step,
    /// Linear between two keyframes.
    Linear,
    /// A cubic spline with tangents.
    CubicSpline,
}

/// Reads the `animations` of a file's JSON.
pub(in super::super) fn read_clips(
    animations: &Value,
    document: &Document,
    buffers: &Buffers,
) -> Vec<Clip> {
    let file = File { document, buffers };
    let animations = animations.as_array().into_iter().flatten();
    let clips = animations.map(|animation| Clip {
        name: animation["name"].as_str().unwrap_or_default().to_owned(),
        channels: file.channels(animation),
    });
    clips.filter(|clip| !clip.channels.is_empty()).collect()
}

struct File<'a> {
    document: &'a Document,
    buffers: &'a Buffers,
}

impl File<'_> {
    fn channels(&self, animation: &Value) -> Vec<Channel> {
        let channels = animation["channels"].as_array().into_iter().flatten();
        let channels = channels.filter_map(|channel| self.channel(animation, channel));
        channels.collect()
    }

    fn channel(&self, animation: &Value, channel: &Value) -> Option<Channel> {
        let target = channel.get("target")?;
        let node = index(target.get("node")?)?;
        let sampler = animation["samplers"].get(index(channel.get("sampler")?)?)?;
        let channel = Channel {
            node: u32::try_from(node).ok()?,
            property: match target.get("path")?.as_str()? {
                "translation" => Property::Translation,
                "rotation" => Property::Rotation,
                "scale" => Property::Scale,
                "weights" => Property::Weights,
                _ => return None,
            },
            interpolation: match sampler["interpolation"].as_str() {
                Some("STEP") => Interpolation::Step,
                Some("CUBICSPLINE") => Interpolation::CubicSpline,
                _ => Interpolation::Linear,
            },
            times: self.numbers(sampler.get("input")?)?,
            values: self.numbers(sampler.get("output")?)?,
        };
        let exists = node < self.document.nodes().len();
        (exists && channel.is_usable()).then_some(channel)
    }

    fn numbers(&self, accessor: &Value) -> Option<Vec<f32>> {
        let accessor = self.document.accessors().nth(index(accessor)?)?;
        read_numbers(&accessor, self.buffers).ok()
    }
}

fn index(value: &Value) -> Option<usize> {
    usize::try_from(value.as_u64()?).ok()
}

impl Channel {
    fn is_usable(&self) -> bool {
        let are_finite = self.times.iter().chain(&self.values).all(|x| x.is_finite());
        let width = self.width();
        let fits = match self.property {
            Property::Translation | Property::Scale => width == 3,
            Property::Rotation => width == 4,
            Property::Weights => width > 0,
        };
        let is_whole = self.values.len() == width * self.times.len() * self.values_per_keyframe();
        !self.times.is_empty() && self.times.is_sorted() && are_finite && fits && is_whole
    }

    /// Number of components of a value.
    fn width(&self) -> usize {
        self.values.len() / (self.times.len().max(1) * self.values_per_keyframe())
    }

    fn values_per_keyframe(&self) -> usize {
        match self.interpolation {
            Interpolation::CubicSpline => 3,
            _ => 1,
        }
    }

    /// The value at a time.
    pub(crate) fn at(&self, time: f32) -> Vec<f32> {
        let width = self.width();
        let stride = width * self.values_per_keyframe();
        // A value, or a tangent of a spline.
        let part = |keyframe: usize, part: usize| {
            &self.values[keyframe * stride + part * width..][..width]
        };
        let value = |keyframe| match self.interpolation {
            Interpolation::CubicSpline => part(keyframe, 1),
            _ => part(keyframe, 0),
        };
        let next = self.times.partition_point(|&keyframe| keyframe <= time);
        if next == 0 || next == self.times.len() {
            return value(next.saturating_sub(1)).to_vec();
        }
        let (from, to) = (next - 1, next);
        let span = self.times[to] - self.times[from];
        let t = (time - self.times[from]) / span;
        let mix = |weights: [f32; 4], of: [&[f32]; 4]| {
            let number = |k: usize| (0..4).map(|i| weights[i] * of[i][k]).sum();
            (0..width).map(number).collect()
        };
        let (a, b) = (value(from), value(to));
        match self.interpolation {
            Interpolation::Step => a.to_vec(),
            Interpolation::Linear => {
                // q and −q are the same rotation; the nearer one gives the shorter way. Poses normalize the result,
                // which is close to a spherical interpolation between keyframes.
                let dot: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                let is_far = self.property == Property::Rotation && dot < 0.0;
                let sign = if is_far { -1.0 } else { 1.0 };
                mix([1.0 - t, t * sign, 0.0, 0.0], [a, b, a, b])
            }
            Interpolation::CubicSpline => {
                let (t2, t3) = (t * t, t * t * t);
                let weights = [
                    2.0 * t3 - 3.0 * t2 + 1.0,
                    3.0 * t2 - 2.0 * t3,
                    (t3 - 2.0 * t2 + t) * span,
                    (t3 - t2) * span,
                ];
                mix(weights, [a, b, part(from, 2), part(to, 0)])
            }
        }
    }
}
