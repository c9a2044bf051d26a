//! Motion while the shutter is open: rigid poses (with a stretch) between which translation and stretch move linearly
//! and rotation turns by slerp. Not for deforming meshes, which do not blur.

use glam::{Affine3A, Mat3A, Quat, Vec3, Vec3A};

/// A transform in parts: stretch, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where the origin goes.
    pub translation: Vec3A,
    /// Unit quaternion.
    pub rotation: Quat,
    /// Scale and shear: symmetric when decomposed, any matrix otherwise.
    pub stretch: Mat3A,
}

/// A pose at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionKey {
    /// Time as share of the shutter: it opens at 0 and closes at 1.
    pub time: f32,
    /// The pose.
    pub pose: Pose,
}

/// A transform that changes with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Applied first, and at rest.
    before: Affine3A,
    /// At increasing times, at least one; before the first and after the last everything rests.
    keys: Vec<MotionKey>,
}

impl Pose {
    /// Splits an invertible transform by polar decomposition (Higham's Newton iteration, 1986; Shoemake and Duff,
    /// "Matrix Animation and Polar Decomposition", 1992). A reflection goes into the stretch.
    pub fn decompose(transform: Affine3A) -> Self {
        let matrix = transform.matrix3;
        let flip = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
        let mut rotation = matrix * flip;
        for _ in 0..64 {
            let next = (rotation + rotation.inverse().transpose()) * 0.5;
            let change = next - rotation;
            rotation = next;
            let largest = [change.x_axis, change.y_axis, change.z_axis].map(|c| c.abs().max_element());
            if largest.into_iter().fold(0.0, f32::max) < 1e-7 {
                break;
            }
        }
        Self {
            translation: transform.translation,
            rotation: Quat::from_mat3a(&rotation).normalize(),
            stretch: rotation.transpose() * matrix,
        }
    }

    /// A pose of scale, rotation and translation.
    pub fn from_parts(scale: Vec3, rotation: Quat, translation: Vec3) -> Self {
        Self { translation: translation.into(), rotation, stretch: Mat3A::from_diagonal(scale) }
    }

    /// The whole transform.
    pub fn to_affine(self) -> Affine3A {
        Affine3A { matrix3: Mat3A::from_quat(self.rotation) * self.stretch, translation: self.translation }
    }

    /// The pose between this one (share 0) and another (share 1).
    pub fn interpolate(self, other: Self, share: f32) -> Self {
        Self {
            translation: self.translation.lerp(other.translation, share),
            rotation: self.rotation.slerp(other.rotation, share),
            stretch: self.stretch + (other.stretch - self.stretch) * share,
        }
    }
}

impl Motion {
    /// A motion that is `before`, then the pose between its keys. `None` where there is no key, or the keys' times do
    /// not increase.
    pub fn new(before: Affine3A, keys: Vec<MotionKey>) -> Option<Self> {
        let increasing = keys.windows(2).all(|pair| pair[0].time < pair[1].time);
        (!keys.is_empty() && increasing).then_some(Self { before, keys })
    }

    /// A motion from one transform when the shutter opens to another when it closes.
    pub fn between(open: Affine3A, close: Affine3A) -> Self {
        let key = |time, transform| MotionKey { time, pose: Pose::decompose(transform) };
        Self { before: Affine3A::IDENTITY, keys: vec![key(0.0, open), key(1.0, close)] }
    }

    /// The transform at a share of the shutter.
    pub fn at(&self, time: f32) -> Affine3A {
        self.pose_at(time).to_affine() * self.before
    }

    fn pose_at(&self, time: f32) -> Pose {
        let after = self.keys.partition_point(|key| key.time <= time);
        let last = self.keys.len() - 1;
        let (from, to) = (&self.keys[after.saturating_sub(1)], &self.keys[after.min(last)]);
        let span = to.time - from.time;
        if span > 0.0 { from.pose.interpolate(to.pose, ((time - from.time) / span).clamp(0.0, 1.0)) } else { from.pose }
    }

    /// This motion for things that are given as they are when the shutter opens: the identity at time 0.
    pub fn since_open(&self) -> Self {
        Self { before: self.before * self.at(0.0).inverse(), keys: self.keys.clone() }
    }

    /// The keys.
    pub fn keys(&self) -> &[MotionKey] {
        &self.keys
    }

    /// Whether all times of the open shutter see the same transform.
    pub fn rests(&self) -> bool {
        // Between equal poses slerp rounds.
        if self.keys.iter().all(|key| key.pose == self.keys[0].pose) {
            return true;
        }
        let (open, close) = (self.at(0.0), self.at(1.0));
        open == close && self.keys.iter().filter(|k| (0.0..1.0).contains(&k.time)).all(|k| self.at(k.time) == open)
    }

    /// Calls `visit` with balls (centre, radius) whose hull holds every place where the hull of `points` can be while
    /// the shutter is open. Between substeps a point leaves its chord by at most h²/8 · max|p″|, and
    /// |p″| ≤ ω²|Sx| + 2ω|S′x| for a rotation at the speed ω of a stretch S that changes at the speed S′.
    pub fn sweep(&self, points: &[Vec3A], mut visit: impl FnMut(Vec3A, f32)) {
        const STEPS: u16 = 16;
        let inner = self.keys.iter().map(|k| k.time).filter(|t| (0.0..1.0).contains(t));
        let mut times: Vec<f32> = [0.0].into_iter().chain(inner).chain([1.0]).collect();
        times.dedup();
        for pair in times.windows(2) {
            let (open, close) = (self.pose_at(pair[0]), self.pose_at(pair[1]));
            let span = pair[1] - pair[0];
            let turn = open.rotation.angle_between(close.rotation) / span;
            for step in 0..=STEPS {
                let transform = self.at(pair[0] + span * f32::from(step) / f32::from(STEPS));
                let h = span / f32::from(STEPS);
                for &point in points {
                    let rest = self.before.transform_point3a(point);
                    let (from, to) = (open.stretch * rest, close.stretch * rest);
                    let bend = turn * turn * from.length().max(to.length()) + 2.0 * turn * (to - from).length() / span;
                    visit(transform.transform_point3a(point), bend * h * h / 8.0);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheared() -> Affine3A {
        let mut transform = Affine3A::from_scale_rotation_translation(
            Vec3::new(2.0, -0.5, 1.0),
            Quat::from_rotation_x(0.7) * Quat::from_rotation_z(2.0),
            Vec3::new(1.0, 2.0, 3.0),
        );
        transform.matrix3.x_axis += 0.3 * transform.matrix3.y_axis;
        transform
    }

    #[test]
    fn parts_make_the_whole() {
        for transform in [Affine3A::IDENTITY, sheared(), Affine3A::from_scale(Vec3::splat(1e-4))] {
            let pose = Pose::decompose(transform);
            let back = pose.to_affine();
            let size = transform.matrix3.x_axis.length();
            assert!(back.matrix3.abs_diff_eq(transform.matrix3, 1e-5 * size), "{transform:?}: {back:?}");
            let s = pose.stretch;
            assert!(s.abs_diff_eq(s.transpose(), 1e-5 * size), "the stretch is symmetric: {s:?}");
        }
    }

    /// A quarter turn is an eighth half way, and a point on it keeps its distance from the axis.
    #[test]
    fn rotations_turn_evenly() {
        let quarter = Affine3A::from_rotation_y(std::f32::consts::FRAC_PI_2);
        let motion = Motion::between(Affine3A::IDENTITY, quarter);
        for (time, angle) in [(0.0, 0.0f32), (0.25, 22.5), (0.5, 45.0), (1.0, 90.0), (-1.0, 0.0), (2.0, 90.0)] {
            let expected = Affine3A::from_rotation_y(angle.to_radians());
            assert!(motion.at(time).abs_diff_eq(expected, 1e-5), "{time}");
        }
    }

    /// Points followed in small steps never leave the box around the balls of the sweep.
    #[test]
    fn the_sweep_holds_every_place() {
        let turned = Affine3A::from_scale_rotation_translation(
            Vec3::new(3.0, 1.0, 0.5),
            Quat::from_rotation_y(3.0),
            Vec3::X * 4.0,
        );
        let motion = Motion::between(Affine3A::IDENTITY, turned);
        let points = [Vec3A::ONE, Vec3A::new(-2.0, 0.3, 1.0)];
        let (mut min, mut max) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
        motion.sweep(&points, |center, radius| {
            min = min.min(center - radius);
            max = max.max(center + radius);
        });
        let mut closest = f32::INFINITY;
        for i in 0..=10_000 {
            for point in points {
                let place = motion.at(i as f32 / 10_000.0).transform_point3a(point);
                assert!(place.cmpge(min - 1e-5).all() && place.cmple(max + 1e-5).all(), "{place} outside {min} {max}");
                closest = closest.min((max - place).min_element().min((place - min).min_element()));
            }
        }
        assert!(closest < 0.1, "the box is tight: {closest}");
    }
}
