//! Nodes while the shutter is open: the animation's poses at several moments, and the motion through them. Not for
//! skins, nor for the shapes of morph targets, which keep the form they have when it opens.

use super::super::Shutter;
use super::super::error::LoadError;
use super::animation::{self, KeyTime};
use super::buffers::Buffers;
use crate::scene::{Motion, MotionKey, Pose};
use glam::{Affine3A, Mat3A, Mat4};
use std::path::Path;

/// Between two keys what turns about a parent moves on an arc; so many chords of the open shutter stand for it.
const STEPS: u32 = 8;
/// Keys inside the shutter that are met exactly; a shutter rarely holds one.
const MAX_KEYS: usize = 64;
/// Size of what is hidden by a scale of 0, as share of its own: small beyond any pixel, and still a transform that can
/// be undone.
const SPECK: f32 = 1e-4;

/// The pose of all animated nodes at a moment of the open shutter.
pub(super) struct Moment {
    /// Share of the shutter, 0 where it opens.
    share: f32,
    pub(super) pose: animation::Pose,
}

/// The moments of a shutter in order, the first when it opens; that one alone where nothing is animated or it does not
/// stay open.
pub(super) fn moments(
    path: &Path,
    document: &gltf::Document,
    buffers: &Buffers,
    shutter: Shutter,
) -> Result<Vec<Moment>, LoadError> {
    let mut times = vec![(0.0, shutter.opens)];
    if shutter.stays_open > 0.0 && document.animations().next().is_some() {
        times.extend(at_keys(animation::key_times(document, buffers)?, shutter));
        times.extend((1..=STEPS).map(|step| {
            let share = f64::from(step) / f64::from(STEPS);
            (share as f32, shutter.opens + share * shutter.stays_open)
        }));
        times.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        times.dedup_by_key(|(share, _)| *share);
    }
    let moment = |(share, seconds)| Ok(Moment { share, pose: animation::pose(path, document, buffers, seconds)? });
    times.into_iter().map(moment).collect()
}

/// Shares of the shutter and times of the keys inside it, and just before those that jump: else the jump would be
/// smeared from the moment before.
fn at_keys(mut keys: Vec<KeyTime>, shutter: Shutter) -> Vec<(f32, f64)> {
    // By f32 times, as poses are found: a key that f32 rounding puts after the opening is met there.
    let (opens, closes) = (shutter.opens as f32, (shutter.opens + shutter.stays_open) as f32);
    keys.retain(|key| key.seconds > opens && key.seconds <= closes);
    // Channels share their times.
    keys.sort_by(|a, b| a.seconds.total_cmp(&b.seconds).then(b.jumps.cmp(&a.jumps)));
    keys.dedup_by_key(|key| key.seconds);
    let mut times = Vec::new();
    for KeyTime { seconds, jumps } in keys.into_iter().take(MAX_KEYS) {
        let share = ((f64::from(seconds) - shutter.opens) / shutter.stays_open).min(1.0) as f32;
        let before = f64::from(seconds.next_down());
        match (seconds < closes, jumps) {
            (true, true) => times.extend([(share.next_down().max(0.0), before), (share, f64::from(seconds))]),
            (true, false) => times.push((share, f64::from(seconds))),
            // What comes when the shutter has closed is not seen.
            (false, true) => times.push((1.0, before)),
            (false, false) => {}
        }
    }
    times
}

/// The motion through a node's transforms at those moments; `None` where it rests or is flat all the time.
/// While it is flat, which is how files hide a thing, it is a speck: what is there for a part of the shutter
/// blurs and covers for that part.
pub(super) fn through(moments: &[Moment], transforms: &[Mat4]) -> Option<Motion> {
    if transforms.windows(2).all(|pair| pair[0] == pair[1]) {
        return None;
    }
    let mut seen = Pose::decompose(Affine3A::from_mat4(*transforms.iter().find(|transform| is_there(transform))?));
    let key = |(moment, transform): (&Moment, &Mat4)| {
        let transform = Affine3A::from_mat4(*transform);
        let pose = if is_there(&Mat4::from(transform)) {
            seen = Pose::decompose(transform);
            seen
        } else {
            let is_somewhere = transform.translation.is_finite();
            let translation = if is_somewhere { transform.translation } else { seen.translation };
            Pose { translation, stretch: seen.stretch * SPECK, ..seen }
        };
        MotionKey { time: moment.share, pose }
    };
    Motion::new(Affine3A::IDENTITY, moments.iter().zip(transforms).map(key).collect())
}

/// The motion of a camera through a node's transforms at those moments, from where it is when the shutter opens; its
/// scale changes nothing. `None` as by [`through`].
pub(super) fn of_camera(moments: &[Moment], transforms: &[Mat4]) -> Option<Motion> {
    let whole = through(moments, transforms)?;
    let rigid = |key: &MotionKey| MotionKey { pose: Pose { stretch: Mat3A::IDENTITY, ..key.pose }, ..*key };
    let keys = whole.keys().iter().map(rigid).collect();
    Motion::new(Affine3A::IDENTITY, keys).map(|motion| motion.since_open())
}

/// Whether a transform is finite and flattens nothing.
pub(super) fn is_there(transform: &Mat4) -> bool {
    transform.is_finite() && Mat3A::from_mat4(*transform).determinant() != 0.0
}
