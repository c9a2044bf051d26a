//! Ray–sphere test that stays precise far from the sphere (Haines, Günther and Akenine-Möller, "Precision Improvements
//! for Ray/Sphere Intersection", Ray Tracing Gems 2019).

use super::Ray;
use glam::Vec3A;

/// Which of the two places where a line meets a sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Where it enters.
    Near,
    /// Where it leaves.
    Far,
}

/// The nearest ray parameter in (0, `t_max`) at which the ray meets the sphere, from outside or inside, and that is
/// accepted.
pub fn intersect(ray: &Ray, center: Vec3A, radius: f32, t_max: f32, accept: impl Fn(f32, Side) -> bool) -> Option<f32> {
    let to_center = center - ray.origin;
    let along = to_center.dot(ray.direction);
    // Squared distance of the centre from the ray, taken from the perpendicular itself: no cancellation.
    let perpendicular = to_center - along * ray.direction;
    let discriminant = radius * radius - perpendicular.length_squared();
    // Also refuses NaN.
    if discriminant.is_nan() || discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    // q has no cancellation; the other root is c / q.
    let c = to_center.length_squared() - radius * radius;
    let q = along + root.copysign(along);
    let (mut near, mut far) = (if q == 0.0 { 0.0 } else { c / q }, q);
    if near > far {
        std::mem::swap(&mut near, &mut far);
    }
    let met =
        [(near, Side::Near), (far, Side::Far)].into_iter().find(|&(t, side)| t > 0.0 && t < t_max && accept(t, side));
    met.map(|(t, _)| t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3a;

    fn intersect(ray: &Ray, center: Vec3A, radius: f32, t_max: f32) -> Option<f32> {
        super::intersect(ray, center, radius, t_max, |_, _| true)
    }

    #[test]
    fn near_and_inside() {
        let ray = Ray::new(vec3a(0.0, 0.0, 5.0), vec3a(0.0, 0.0, -1.0));
        assert_eq!(intersect(&ray, Vec3A::ZERO, 1.0, f32::INFINITY), Some(4.0));
        assert_eq!(intersect(&ray, Vec3A::ZERO, 1.0, 3.9), None);
        let inside = Ray::new(Vec3A::ZERO, vec3a(1.0, 0.0, 0.0));
        assert_eq!(intersect(&inside, Vec3A::ZERO, 2.0, f32::INFINITY), Some(2.0));
        let behind = Ray::new(vec3a(0.0, 0.0, 5.0), vec3a(0.0, 0.0, 1.0));
        assert_eq!(intersect(&behind, Vec3A::ZERO, 1.0, f32::INFINITY), None);
    }

    #[test]
    fn what_is_not_accepted_is_not_there() {
        let ray = Ray::new(vec3a(0.0, 0.0, 5.0), vec3a(0.0, 0.0, -1.0));
        let far = super::intersect(&ray, Vec3A::ZERO, 1.0, f32::INFINITY, |_, side| side == Side::Far);
        assert_eq!(far, Some(6.0));
        assert_eq!(super::intersect(&ray, Vec3A::ZERO, 1.0, f32::INFINITY, |_, _| false), None);
    }

    #[test]
    fn a_small_sphere_far_away_is_hit_at_its_distance() {
        let ray = Ray::new(vec3a(0.0, 0.0, 1e4), vec3a(0.0, 0.0, -1.0));
        let t = intersect(&ray, Vec3A::ZERO, 0.01, f32::INFINITY).expect("on the axis");
        assert!((t - (1e4 - 0.01)).abs() <= 2e-3, "{t}");
    }
}
