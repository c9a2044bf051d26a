//! Rigid nodes while the shutter is open: the animation's poses at several moments, and the motion through them. Not for meshes that
//! deform, which do not blur.

use super::super::Shutter;
use super::super::error::LoadError;
use super::animation;
use super::buffers::Buffers;
use crate::scene::{Motion, MotionKey, Pose};
use glam::{Affine3A, Mat3A, Mat4};
use std::path::Path;

/// Between two keys what turns about a parent moves on an arc; so many chords of the open shutter stand for it.
const STEPS: u32 = 8;
/// Keys inside the shutter that are met exactly; a shutter rarely holds one.
const MOST_KEYS: usize = 64;

/// The pose of all animated nodes at a moment of the open shutter.
pub(super) struct Moment {
    /// Share of the shutter, 0 where it opens.
    share: f32,
    pub(super) pose: animation::Pose,
}

/// The moments of a shutter in order, the first when it opens; that one alone where nothing is animated or it does not stay open.
pub(super) fn moments(
    path: &Path,
    document: &gltf::Document,
    buffers: &Buffers,
    shutter: Shutter,
) -> Result<Vec<Moment>, LoadError> {
    let mut shares = vec![0.0];
    if shutter.stays_open > 0.0 && document.animations().next().is_some() {
        let share = |time: f32| (f64::from(time) - shutter.opens) / shutter.stays_open;
        // By f32 times, as poses are found: a key that f32 rounding puts after the opening is met there.
        let (opens, closes) = (shutter.opens as f32, (shutter.opens + shutter.stays_open) as f32);
        // Channels share their times.
        let mut keys = animation::key_times(document, buffers)?;
        keys.retain(|&time| time > opens && time < closes);
        keys.sort_by(f32::total_cmp);
        keys.dedup();
        shares.extend(keys.into_iter().map(share).take(MOST_KEYS));
        shares.extend((1..=STEPS).map(|step| f64::from(step) / f64::from(STEPS)));
        shares.sort_by(f64::total_cmp);
        shares.dedup_by(|later, earlier| *later as f32 <= *earlier as f32);
    }
    shares
        .into_iter()
        .map(|share| {
            let pose = animation::pose(path, document, buffers, shutter.opens + share * shutter.stays_open)?;
            Ok(Moment { share: share as f32, pose })
        })
        .collect()
}

/// The motion through a node's transforms at those moments; `None` where it rests or one of them is flat.
pub(super) fn through(moments: &[Moment], transforms: &[Mat4]) -> Option<Motion> {
    let is_there = |transform: &Mat4| transform.is_finite() && Mat3A::from_mat4(*transform).determinant() != 0.0;
    if transforms.windows(2).all(|pair| pair[0] == pair[1]) || !transforms.iter().all(is_there) {
        return None;
    }
    let key = |(moment, transform): (&Moment, &Mat4)| MotionKey {
        time: moment.share,
        pose: Pose::decompose(Affine3A::from_mat4(*transform)),
    };
    Motion::new(Affine3A::IDENTITY, moments.iter().zip(transforms).map(key).collect())
}

/// The same of a camera, whose scale changes nothing: from where it is when the shutter opens.
pub(super) fn of_camera(moments: &[Moment], transforms: &[Mat4]) -> Option<Motion> {
    let whole = through(moments, transforms)?;
    let rigid = |key: &MotionKey| MotionKey { pose: Pose { stretch: Mat3A::IDENTITY, ..key.pose }, ..*key };
    let keys = whole.keys().iter().map(rigid).collect();
    Motion::new(Affine3A::IDENTITY, keys).map(|motion| motion.since_open())
}
