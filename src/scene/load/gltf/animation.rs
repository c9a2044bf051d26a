//! Node animation: where the first animation of a file has moved nodes and morph weights at a time.
//!
//! All three interpolations; before the first and after the last key everything rests. Other animations of the file are
//! named and left out.

use super::super::error::LoadError;
use super::buffers::Buffers;
use glam::{Mat4, Quat, Vec3};
use gltf::animation::{Channel, Interpolation, Property};
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
        let wrong =
            |problem: &str| LoadError::invalid(path, format_args!("animation {}: {problem}", animation.index()));
        let sampler = channel.sampler();
        let times: Vec<f32> = buffers.floats::<1>(&sampler.input())?.into_iter().map(|[time]| time).collect();
        if times.is_empty() || !times.is_sorted() || times.iter().any(|time| !time.is_finite()) {
            return Err(wrong("its times are missing or do not increase"));
        }
        let keys = Keys::read(&channel, buffers, times.len())?;
        let keys = keys.ok_or_else(|| wrong("it has fewer values than times"))?;
        let place = Place::of(&times, seconds);
        let posed = pose.entry(channel.target().node().index()).or_default();
        match channel.target().property() {
            Property::Translation => posed.translation = Some(Vec3::from_slice(&keys.at(&place))),
            Property::Scale => posed.scale = Some(Vec3::from_slice(&keys.at(&place))),
            Property::Rotation => posed.rotation = keys.rotation_at(&place),
            Property::MorphTargetWeights => posed.weights = Some(keys.at(&place)),
        }
    }
    Ok(pose)
}

/// What a channel says at its times.
struct Keys {
    interpolation: Interpolation,
    /// Numbers of a value.
    width: usize,
    /// Value after value; of splines each stands between its two tangents.
    numbers: Vec<f32>,
}

impl Keys {
    /// `None` where there are fewer than times.
    fn read(channel: &Channel, buffers: &Buffers, times: usize) -> Result<Option<Self>, LoadError> {
        let sampler = channel.sampler();
        let interpolation = sampler.interpolation();
        let values = times * per_key(interpolation);
        let output = sampler.output();
        let (width, mut numbers) = match channel.target().property() {
            Property::Translation | Property::Scale => (3, buffers.floats::<3>(&output)?.into_flattened()),
            Property::Rotation => (4, buffers.floats::<4>(&output)?.into_flattened()),
            Property::MorphTargetWeights => {
                let numbers = buffers.floats::<1>(&output)?.into_flattened();
                (numbers.len() / values, numbers)
            }
        };
        numbers.iter_mut().filter(|number| !number.is_finite()).for_each(|number| *number = 0.0);
        let is_whole = width > 0 && numbers.len() >= values * width;
        Ok(is_whole.then_some(Self { interpolation, width, numbers }))
    }

    fn part(&self, key: usize, part: usize) -> &[f32] {
        &self.numbers[(key * per_key(self.interpolation) + part) * self.width..][..self.width]
    }

    fn in_tangent(&self, key: usize) -> &[f32] {
        self.part(key, 0)
    }

    fn value(&self, key: usize) -> &[f32] {
        self.part(key, if self.interpolation == Interpolation::CubicSpline { 1 } else { 0 })
    }

    fn out_tangent(&self, key: usize) -> &[f32] {
        self.part(key, 2)
    }

    /// Number by number.
    fn at(&self, place: &Place) -> Vec<f32> {
        let (from, to) = (self.value(place.before), self.value(place.after));
        match self.interpolation {
            Interpolation::Step => from.to_vec(),
            Interpolation::Linear => from.iter().zip(to).map(|(a, b)| a + (b - a) * place.share).collect(),
            Interpolation::CubicSpline => {
                // Hermite over the span.
                let (t, t2, t3) = (place.share, place.share * place.share, place.share.powi(3));
                let (leaving, arriving) = (self.out_tangent(place.before), self.in_tangent(place.after));
                (0..self.width)
                    .map(|i| {
                        (2.0 * t3 - 3.0 * t2 + 1.0) * from[i]
                            + place.span * (t3 - 2.0 * t2 + t) * leaving[i]
                            + (3.0 * t2 - 2.0 * t3) * to[i]
                            + place.span * (t3 - t2) * arriving[i]
                    })
                    .collect()
            }
        }
    }

    /// `None` for what is no turn.
    fn rotation_at(&self, place: &Place) -> Option<Quat> {
        let quaternion = match self.interpolation {
            Interpolation::Linear => {
                let turn = |key: usize| Quat::from_slice(self.value(key)).normalize();
                turn(place.before).slerp(turn(place.after), place.share)
            }
            Interpolation::Step | Interpolation::CubicSpline => Quat::from_slice(&self.at(place)),
        };
        (quaternion.length() > 1e-6).then(|| quaternion.normalize())
    }
}

/// Values of a key: splines have a tangent on either side.
fn per_key(interpolation: Interpolation) -> usize {
    if interpolation == Interpolation::CubicSpline { 3 } else { 1 }
}

/// The keys around a time.
struct Place {
    before: usize,
    after: usize,
    share: f32,
    span: f32,
}

impl Place {
    /// Which keys are past is told by f32 times, as files hold them: frame n's own key lies after n / fps by f32
    /// rounding in 34 of 100 frames at 24 a second and in 53 at 30, and a STEP would come a frame late. How far past is
    /// told by f64: after 28 hours f32 times are a fifth of a frame apart.
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
