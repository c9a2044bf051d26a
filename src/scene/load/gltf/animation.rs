//! Node animation: where the first animation of a file has moved nodes and morph weights at a time.
//!
//! All three interpolations; before the first and after the last key everything rests. Other animations of the file are
//! named and left out.

use super::super::error::LoadError;
use super::buffers::Buffers;
use glam::{Mat4, Quat, Vec3, Vec4};
use gltf::animation::{Interpolation, Property};
use std::collections::HashMap;
use std::path::Path;

/// What an animation says of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Posed {
    translation: Option<Vec3>,
    rotation: Option<Quat>,
    scale: Option<Vec3>,
    /// Weights of the morph targets.
    pub(super) weights: Option<Vec<f32>>,
}

/// The animated nodes, by index.
pub(super) type Pose = HashMap<usize, Posed>;

/// When a channel has a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KeyTime {
    pub(super) seconds: f32,
    /// Whether what it says holds from then on at once.
    pub(super) jumps: bool,
}

/// Times of the first animation's keys, in no order.
pub(super) fn key_times(document: &gltf::Document, buffers: &Buffers) -> Result<Vec<KeyTime>, LoadError> {
    let mut times = Vec::new();
    for channel in document.animations().next().into_iter().flat_map(|animation| animation.channels()) {
        let jumps = channel.sampler().interpolation() == Interpolation::Step;
        let of_channel = buffers.floats::<1>(&channel.sampler().input())?.into_iter().flatten();
        times.extend(of_channel.map(|seconds| KeyTime { seconds, jumps }));
    }
    Ok(times)
}

/// The pose of the first animation at a time in seconds.
pub(super) fn pose(path: &Path, document: &gltf::Document, buffers: &Buffers, seconds: f64) -> Result<Pose, LoadError> {
    let mut pose = Pose::new();
    let Some(animation) = document.animations().next() else { return Ok(pose) };
    for channel in animation.channels() {
        let sampler = channel.sampler();
        let wrong =
            |problem: &str| LoadError::invalid(path, format_args!("animation {}: {problem}", animation.index()));
        let times: Vec<f32> = buffers.floats::<1>(&sampler.input())?.into_iter().map(|[time]| time).collect();
        if times.is_empty() || !times.is_sorted() || times.iter().any(|time| !time.is_finite()) {
            return Err(wrong("its times are missing or do not increase"));
        }
        let cubic = sampler.interpolation() == Interpolation::CubicSpline;
        let per_key = if cubic { 3 } else { 1 };
        let at = Place::of(&times, seconds);
        let target = channel.target();
        let property = target.property();
        let width = match property {
            Property::Translation | Property::Scale => 3,
            Property::Rotation => 4,
            Property::MorphTargetWeights => 0,
        };
        let mut numbers: Vec<f32> = match width {
            3 => buffers.floats::<3>(&sampler.output())?.into_flattened(),
            4 => buffers.floats::<4>(&sampler.output())?.into_flattened(),
            _ => buffers.floats::<1>(&sampler.output())?.into_flattened(),
        };
        let width = if width == 0 { numbers.len() / (times.len() * per_key) } else { width };
        if numbers.len() < times.len() * per_key * width || width == 0 {
            return Err(wrong("it has fewer values than times"));
        }
        numbers.iter_mut().filter(|number| !number.is_finite()).for_each(|number| *number = 0.0);
        let key = |index: usize, part: usize| &numbers[(index * per_key + part) * width..][..width];
        let values: Vec<f32> = match sampler.interpolation() {
            Interpolation::Step => key(at.before, 0).to_vec(),
            Interpolation::Linear if property == Property::Rotation => {
                let quaternion = |index| Quat::from_vec4(Vec4::from_slice(key(index, 0))).normalize();
                quaternion(at.before).slerp(quaternion(at.after), at.share).to_array().to_vec()
            }
            Interpolation::Linear => {
                let (from, to) = (key(at.before, 0), key(at.after, 0));
                from.iter().zip(to).map(|(a, b)| a + (b - a) * at.share).collect()
            }
            Interpolation::CubicSpline => {
                // In-tangent, value, out-tangent; Hermite over the span.
                let (t, t2, t3) = (at.share, at.share * at.share, at.share.powi(3));
                (0..width)
                    .map(|i| {
                        (2.0 * t3 - 3.0 * t2 + 1.0) * key(at.before, 1)[i]
                            + at.span * (t3 - 2.0 * t2 + t) * key(at.before, 2)[i]
                            + (3.0 * t2 - 2.0 * t3) * key(at.after, 1)[i]
                            + at.span * (t3 - t2) * key(at.after, 0)[i]
                    })
                    .collect()
            }
        };
        let posed = pose.entry(target.node().index()).or_default();
        match property {
            Property::Translation => posed.translation = Some(Vec3::from_slice(&values)),
            Property::Scale => posed.scale = Some(Vec3::from_slice(&values)),
            Property::Rotation => {
                let length = Vec4::from_slice(&values).length();
                posed.rotation = (length > 1e-6).then(|| Quat::from_slice(&values).normalize());
            }
            Property::MorphTargetWeights => posed.weights = Some(values),
        }
    }
    Ok(pose)
}

/// The keys around a time.
struct Place {
    before: usize,
    after: usize,
    share: f32,
    span: f32,
}

impl Place {
    /// Which keys are past is told by f32 times, as files hold them: frame n's own key lies after n / fps by f32 rounding in 34 of
    /// 100 frames at 24 a second and in 53 at 30, and a STEP would come a frame late. How far past is told by f64: after 28 hours f32
    /// times are a fifth of a frame apart.
    fn of(times: &[f32], time: f64) -> Self {
        let after = times.partition_point(|&key| key <= time as f32);
        let (before, after) = (after.saturating_sub(1), after.min(times.len() - 1));
        let span = times[after] - times[before];
        let since = time - f64::from(times[before]);
        let share = if span > 0.0 { (since / f64::from(span)).clamp(0.0, 1.0) as f32 } else { 0.0 };
        Self { before, after, share, span }
    }
}

/// A node's own transform in a pose.
pub(super) fn local(node: &gltf::Node, pose: &Pose) -> Mat4 {
    let Some(posed) = pose.get(&node.index()) else {
        return Mat4::from_cols_array_2d(&node.transform().matrix());
    };
    let (translation, rotation, scale) = node.transform().decomposed();
    Mat4::from_scale_rotation_translation(
        posed.scale.unwrap_or(Vec3::from_array(scale)),
        posed.rotation.unwrap_or(Quat::from_array(rotation)),
        posed.translation.unwrap_or(Vec3::from_array(translation)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_beyond_the_keys_rest() {
        let times = [1.0, 2.0, 4.0];
        for (time, before, after, share) in [(0.0, 0, 0, 0.0), (1.5, 0, 1, 0.5), (3.0, 1, 2, 0.5), (9.0, 2, 2, 0.0)] {
            let place = Place::of(&times, time);
            assert_eq!((place.before, place.after, place.share), (before, after, share), "at {time}");
        }
        // A quarter second after 28 hours, where f32 times are 1/128 s apart.
        let place = Place::of(&[1e5, 100_010.0], 1e5 + 0.241);
        assert!((place.share - 0.0241).abs() < 1e-6, "{}", place.share);
    }

    /// Of keys at n / fps, that of every frame counts in that frame.
    #[test]
    fn a_key_at_a_frame_is_that_frames() {
        for rate in [24.0, 25.0, 30.0, 30_000.0 / 1001.0] {
            let times: Vec<f32> = (0..500).map(|frame| (f64::from(frame) / rate) as f32).collect();
            for frame in 0..500 {
                let place = Place::of(&times, frame as f64 / rate);
                assert!(
                    place.before == frame && place.share < 1e-3,
                    "{frame} at {rate}: {} {}",
                    place.before,
                    place.share
                );
            }
        }
    }
}
