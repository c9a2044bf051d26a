//! Keyframes of objects, which turn as they are written: about one axis by the angle, however many turns that is;
//! between different axes by slerp, which knows the short way alone, so that steps of half a turn and more are refused
//! there.

use super::{Between, Keyframes, Turn, moving, scale, turn};
use crate::scene::load::toml::fields::Value;
use crate::scene::load::{LoadError, Shutter, shapes};
use crate::scene::{Motion, Pose};
use glam::{Affine3A, Quat, Vec3};

/// A keyframe of an object.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene::load::toml) struct ObjectKey {
    pose: Pose,
    turn: Option<Turn>,
}

/// An object's `keyframes`.
pub(in crate::scene::load::toml) fn object_keyframes(list: &Value) -> Result<Keyframes<ObjectKey>, LoadError> {
    let keyframes = Keyframes::read(list, &["time", "translate", "rotate_deg", "axis", "scale"], |fields| {
        let turn = turn(fields)?;
        let pose = Pose::from_parts(
            fields.get_or("scale", Vec3::ONE, scale)?,
            turn.map_or(Quat::IDENTITY, Turn::rotation),
            fields.get_or("translate", Vec3::ZERO, Value::vec3)?,
        );
        Ok(ObjectKey { pose, turn })
    })?;
    for pair in keyframes.frames.windows(2) {
        let [(before_time, before), (after_time, after)] = [&pair[0], &pair[1]];
        if before.common_axis(after).is_none() && before.pose.rotation.dot(after.pose.rotation) <= 0.0 {
            return Err(list.error(format_args!(
                "from {before_time} s to {after_time} s it turns by half a turn or more, from one axis to another: a keyframe \
                 between them has to say which way"
            )));
        }
    }
    Ok(keyframes)
}

impl ObjectKey {
    /// The axis about which both keyframes turn, and by how many degrees at each of them.
    fn common_axis(&self, other: &Self) -> Option<(Vec3, [f64; 2])> {
        const ALIKE: f32 = 1.0 - 1e-6;
        // Without a turn about it any axis will do.
        let turns = |key: &Self| key.turn.filter(|turn| turn.degrees != 0.0);
        match (turns(self), turns(other)) {
            (None, None) => None,
            (Some(from), None) => Some((from.axis, [from.degrees, 0.0])),
            (None, Some(to)) => Some((to.axis, [0.0, to.degrees])),
            (Some(from), Some(to)) => {
                let alike = from.axis.dot(to.axis);
                let to_degrees = to.degrees * f64::from(alike.signum());
                (alike.abs() >= ALIKE).then_some((from.axis, [from.degrees, to_degrees]))
            }
        }
    }

    fn interpolate(&self, other: &Self, share: f32) -> Pose {
        let pose = self.pose.interpolate(other.pose, share);
        let Some((axis, [from, to])) = self.common_axis(other) else { return pose };
        let degrees = from + (to - from) * f64::from(share);
        Pose { rotation: Turn { axis, degrees }.rotation(), ..pose }
    }
}

/// How often the motion of each of so many objects with keyframes is cut at most: a pose takes about as much memory as
/// all that a file says of a small object.
pub(in crate::scene::load::toml) fn most_cuts(moving: usize) -> u32 {
    // 256 turns of an open shutter are a blur in which nobody can tell more.
    const OF_ONE: usize = 1023;
    const OF_ALL: usize = 1 << 18;
    // Four turns of an open shutter are left to any object.
    const LEAST: usize = 15;
    (OF_ALL / moving.max(1)).clamp(LEAST, OF_ONE) as u32
}

impl Keyframes<ObjectKey> {
    fn pose(&self, time: f64) -> Pose {
        let Between { before, after, share } = self.around(time);
        before.interpolate(after, share)
    }

    /// Whether spheres placed by `before` stay spheres at all times. Between two keyframes the stretch S is linear
    /// in time, so that how far SᵀS is from that of a sphere is quadratic: what is none at both ends and once
    /// between is none anywhere.
    pub(in crate::scene::load::toml) fn leave_spheres(&self, before: Affine3A) -> bool {
        let is_sphere = |pose: Pose| shapes::similarity_scale(&(pose.to_affine() * before)).is_some();
        self.frames.iter().all(|(_, key)| is_sphere(key.pose))
            && self.frames.windows(2).all(|pair| is_sphere(pair[0].1.interpolate(&pair[1].1, 0.3)))
    }

    /// The transform at a time.
    pub(in crate::scene::load::toml) fn at(&self, time: f64) -> Affine3A {
        self.pose(time).to_affine()
    }

    /// The motion of something placed by `before` while the shutter is open, cut at most so often between
    /// keyframes ([`most_cuts`]): fast turns have fewer cuts then, slow ones keep theirs, or they would go the
    /// wrong way. `None` where it rests.
    pub(in crate::scene::load::toml) fn motion(
        &self,
        before: Affine3A,
        shutter: Shutter,
        most_cuts: u32,
    ) -> Option<Motion> {
        if shutter.stays_open == 0.0 {
            return None;
        }
        let ends = self.times(shutter, 0);
        let cuts: Vec<f64> = ends.windows(2).map(|pair| self.cuts(pair[0], pair[1])).collect();
        let most = level_of(&cuts, f64::from(most_cuts));
        let mut times = vec![shutter.opens];
        for (pair, cuts) in ends.windows(2).zip(cuts) {
            let pieces = cuts.min(most) as u32 + 1;
            times.extend((1..=pieces).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / f64::from(pieces)));
        }
        moving(times, shutter, |time| self.pose(time), before)
    }

    /// How often a time without a keyframe inside must be cut, so that the short way from cut to cut is the way.
    fn cuts(&self, opens: f64, closes: f64) -> f64 {
        const LONGEST_DEG: f64 = 90.0;
        let (from, to) = (self.around(opens), self.around(0.5 * (opens + closes)));
        let Some((_, [start, end])) = to.before.common_axis(to.after) else { return 0.0 };
        let share = 2.0 * f64::from((to.share - from.share).abs());
        (((end - start).abs() * share / LONGEST_DEG).ceil() - 1.0).max(0.0)
    }
}

/// What no need may get more of, so that all of them together get at most so much.
fn level_of(needs: &[f64], most: f64) -> f64 {
    let mut needs = needs.to_vec();
    needs.sort_unstable_by(f64::total_cmp);
    let mut left = most;
    for (index, need) in needs.iter().enumerate() {
        let share = left / (needs.len() - index) as f64;
        if *need > share {
            return share.floor();
        }
        left -= need;
    }
    f64::INFINITY
}
