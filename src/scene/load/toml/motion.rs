//! Transforms and keyframes. Positions and scales move linearly between keyframes; before the first and after the last
//! keyframe everything rests. Objects' own are in [`turns`].

mod turns;

pub(super) use turns::{most_cuts, object_keyframes};

use super::fields::{Fields, Value};
use crate::scene::load::{LoadError, Shutter};
use crate::scene::{Camera, Motion, MotionKey, Pose, right_of};
use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};

/// Values at increasing times.
pub(super) struct Keyframes<T> {
    frames: Vec<(f64, T)>,
}

/// The two keyframes around a time, and how far between them it is.
pub(super) struct Between<'a, T> {
    pub(super) before: &'a T,
    pub(super) after: &'a T,
    pub(super) share: f32,
}

impl<T> Keyframes<T> {
    /// Reads a list of tables that have a `time` and what `read` takes from them.
    pub(super) fn read(
        list: &Value,
        known: &[&str],
        read: impl Fn(&Fields) -> Result<T, LoadError>,
    ) -> Result<Self, LoadError> {
        let mut frames: Vec<(f64, T)> = Vec::new();
        for value in list.array()? {
            let fields = value.fields(known)?;
            let time = fields.require("time")?;
            let seconds = time.number()?;
            if frames.last().is_some_and(|(last, _)| *last >= seconds) {
                return Err(time.error("times must increase from keyframe to keyframe"));
            }
            frames.push((seconds, read(&fields)?));
        }
        if frames.is_empty() {
            return Err(list.error("needs at least one keyframe"));
        }
        Ok(Self { frames })
    }

    /// Times at which the shutter opens and closes, those of keyframes between, and `between` more before each next
    /// one.
    fn times(&self, shutter: Shutter, between: u32) -> Vec<f64> {
        let closes = shutter.opens + shutter.stays_open;
        let inner = self.frames.iter().map(|(time, _)| *time).filter(|t| *t > shutter.opens && *t < closes);
        let ends: Vec<f64> = [shutter.opens].into_iter().chain(inner).chain([closes]).collect();
        let mut times = vec![shutter.opens];
        for pair in ends.windows(2) {
            let step = |i: u32| pair[0] + (pair[1] - pair[0]) * f64::from(i) / f64::from(between + 1);
            times.extend((1..=between).map(step).chain([pair[1]]));
        }
        times
    }

    /// What the keyframes say, in their order.
    pub(super) fn values(&self) -> impl Iterator<Item = &T> {
        self.frames.iter().map(|(_, value)| value)
    }

    pub(super) fn around(&self, time: f64) -> Between<'_, T> {
        let after = self.frames.partition_point(|(seconds, _)| *seconds <= time);
        let clamp = |index: usize| &self.frames[index.min(self.frames.len() - 1)];
        let (before_time, before) = clamp(after.saturating_sub(1));
        let (after_time, after) = clamp(after);
        let span = after_time - before_time;
        let share = if span > 0.0 { ((time - before_time) / span).clamp(0.0, 1.0) as f32 } else { 0.0 };
        Between { before, after, share }
    }
}

/// The camera's `keyframes`: position and point looked at.
pub(super) fn camera_keyframes(list: &Value) -> Result<Keyframes<(Vec3, Vec3)>, LoadError> {
    Keyframes::read(list, &["time", "position", "look_at"], |fields| {
        Ok((fields.require("position")?.vec3()?, fields.require("look_at")?.vec3()?))
    })
}

impl Keyframes<(Vec3, Vec3)> {
    /// Position and point looked at.
    pub(super) fn at(&self, time: f64) -> (Vec3, Vec3) {
        let Between { before, after, share } = self.around(time);
        (before.0.lerp(after.0, share), before.1.lerp(after.1, share))
    }

    /// What moves `camera` from where it is when the shutter opens; `None` where it rests. Positions are exact; turns
    /// are slerped between 16 views of each interval, since the point looked at moves on a line.
    pub(super) fn motion(&self, camera: &Camera, shutter: Shutter) -> Option<Motion> {
        if shutter.stays_open == 0.0 {
            return None;
        }
        let pose = |time: f64| {
            let (position, look_at) = self.at(time);
            let forward = (look_at - position).normalize_or(camera.forward);
            let right = right_of(forward, camera.up);
            let axes = Mat3A::from_cols(right.into(), right.cross(forward).into(), (-forward).into());
            let rotation = Quat::from_mat3a(&axes).normalize();
            Pose { translation: Vec3A::from(position), rotation, stretch: Mat3A::IDENTITY }
        };
        moving(self.times(shutter, 15), shutter, pose, Affine3A::IDENTITY).map(|motion| motion.since_open())
    }
}

/// A motion through poses; `None` where it rests.
fn moving(times: Vec<f64>, shutter: Shutter, pose: impl Fn(f64) -> Pose, before: Affine3A) -> Option<Motion> {
    let key = |time: f64| MotionKey { time: ((time - shutter.opens) / shutter.stays_open) as f32, pose: pose(time) };
    let mut keys: Vec<MotionKey> = times.into_iter().map(key).collect();
    keys.dedup_by_key(|key| key.time);
    Motion::new(before, keys).filter(|motion| !motion.rests())
}

/// An object's `transform`: a list of steps, applied in this order.
pub(super) fn transform(list: &Value) -> Result<Affine3A, LoadError> {
    let mut total = Affine3A::IDENTITY;
    for step in list.array()? {
        let fields = step.fields(&["scale", "rotate_deg", "axis", "translate"])?;
        let (kind, value) = fields.exactly_one(&["scale", "rotate_deg", "translate"])?;
        if kind != "rotate_deg"
            && let Some(axis) = fields.get("axis")
        {
            return Err(axis.error("belongs to rotate_deg only"));
        }
        let step = match kind {
            "scale" => Affine3A::from_scale(scale(&value)?),
            "translate" => Affine3A::from_translation(value.vec3()?),
            _ => Affine3A::from_quat(turn(&fields)?.map_or(Quat::IDENTITY, Turn::rotation)),
        };
        total = step * total;
    }
    Ok(total)
}

/// One number for all axes or three, none of them 0.
fn scale(value: &Value) -> Result<Vec3, LoadError> {
    let scale = if value.is_array() { value.vec3()? } else { Vec3::splat(value.number()? as f32) };
    if scale.min_element() == 0.0 || scale.max_element() == 0.0 || scale.y == 0.0 {
        return Err(value.error("a scale of 0 flattens the object"));
    }
    Ok(scale)
}

/// A rotation as it is written, by any number of full turns.
#[derive(Clone, Copy, Debug)]
struct Turn {
    axis: Vec3,
    degrees: f64,
}

impl Turn {
    /// The quaternion of the whole turn: that of 360° more has the opposite sign.
    fn rotation(self) -> Quat {
        Quat::from_axis_angle(self.axis, (self.degrees % 720.0).to_radians() as f32)
    }
}

/// `rotate_deg` about `axis`.
fn turn(fields: &Fields) -> Result<Option<Turn>, LoadError> {
    match (fields.get("rotate_deg"), fields.get("axis")) {
        (None, None) => Ok(None),
        (Some(angle), Some(axis)) => Ok(Some(Turn { axis: axis.direction()?, degrees: angle.number()? })),
        _ => Err(fields.error("rotate_deg and axis belong together")),
    }
}
