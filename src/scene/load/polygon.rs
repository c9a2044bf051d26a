//! Polygons into triangles: a fan where that is right, ear clipping where a corner points inwards.

use glam::{DVec2, DVec3, Vec3};

mod corner_grid;
mod ears;

/// Ear clipping is nearly quadratic: larger polygons get a fan.
const MAX_CORNERS_TO_CLIP: usize = 50_000;

/// How a polygon's area was covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Covering {
    /// Once, wherever it does not cross itself.
    Exact,
    /// Covered by a fan, although a corner points inwards: there are more than [`MAX_CORNERS_TO_CLIP`].
    RoughFan,
}

/// Triangles of a polygon given by vertex indices; all indices in range.
pub(super) fn triangulate(positions: &[Vec3], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) -> Covering {
    let fan = polygon.windows(2).skip(1).map(|pair| [polygon[0], pair[0], pair[1]]);
    if polygon.len() <= 3 {
        triangles.extend(fan);
        return Covering::Exact;
    }
    let flat = flatten(positions, polygon);
    let count = flat.len();
    let is_convex = (0..count).all(|i| turn(flat[(i + count - 1) % count], flat[i], flat[(i + 1) % count]) >= 0.0);
    let is_large = count > MAX_CORNERS_TO_CLIP;
    if is_convex || is_large {
        triangles.extend(fan);
        return if is_convex { Covering::Exact } else { Covering::RoughFan };
    }
    triangles.extend(ears::clip(&flat).into_iter().map(|corners| corners.map(|corner| polygon[corner])));
    Covering::Exact
}

/// Says of a file how many of its faces are [`Covering::RoughFan`].
pub(super) fn note_of_rough_fans(file: &str, faces: usize) -> Option<String> {
    (faces > 0).then(|| {
        format!(
            "{file}: {faces} faces of more than {MAX_CORNERS_TO_CLIP} corners are filled as fans, which is wrong where corners point \
             inwards."
        )
    })
}

/// The polygon in the plane that fits it best, counter-clockwise.
fn flatten(positions: &[Vec3], polygon: &[u32]) -> Vec<DVec2> {
    let points: Vec<DVec3> = polygon.iter().map(|&index| positions[index as usize].as_dvec3()).collect();
    // Newell's normal: the sum over all edges, so that a few collinear corners do no harm.
    let origin = points[0];
    let normal: DVec3 =
        (0..points.len()).map(|i| (points[i] - origin).cross(points[(i + 1) % points.len()] - origin)).sum();
    let Some(normal) = normal.try_normalize() else {
        return vec![DVec2::ZERO; points.len()];
    };
    let tangent = normal.any_orthonormal_vector();
    let bitangent = normal.cross(tangent);
    points.iter().map(|point| DVec2::new((point - origin).dot(tangent), (point - origin).dot(bitangent))).collect()
}

/// Twice the signed area of a triangle; above 0 for a turn to the left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(positions: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
        let corner = |index: u32| positions[index as usize];
        triangles.iter().map(|&[a, b, c]| 0.5 * (corner(b) - corner(a)).cross(corner(c) - corner(a)).length()).sum()
    }

    #[test]
    fn a_concave_polygon_is_covered_once() {
        // An L of area 3; a fan from its first corner would cover more.
        let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        for start in 0..6 {
            let positions: Vec<Vec3> =
                (0..6).map(|i| outline[(i + start) % 6]).map(|[x, y]| Vec3::new(x, 5.0, -y)).collect();
            let mut triangles = Vec::new();
            triangulate(&positions, &[0, 1, 2, 3, 4, 5], &mut triangles);
            assert_eq!(triangles.len(), 4);
            assert!((area(&positions, &triangles) - 3.0).abs() < 1e-6, "from corner {start}: {triangles:?}");
        }
    }

    /// A C of `count` corners about the origin, counter-clockwise, and its area.
    fn letter_c(count: usize) -> (Vec<Vec3>, f64) {
        let half = count / 2;
        let place = |step: usize, radius: f64| {
            let turned = 0.6 + (std::f64::consts::TAU - 1.2) * step as f64 / (half - 1) as f64;
            DVec2::from_angle(turned) * radius
        };
        let outline: Vec<DVec2> =
            (0..half).map(|step| place(step, 1.0)).chain((0..half).rev().map(|step| place(step, 0.6))).collect();
        let area = 0.5 * (0..count).map(|i| outline[i].perp_dot(outline[(i + 1) % count])).sum::<f64>();
        (outline.iter().map(|place| place.as_vec2().extend(0.0)).collect(), area)
    }

    #[test]
    fn large_concave_polygons_are_covered_once() {
        for count in [1002, 20_000] {
            let (positions, expected) = letter_c(count);
            let polygon: Vec<u32> = (0..count as u32).collect();
            let mut triangles = Vec::new();
            assert_eq!(triangulate(&positions, &polygon, &mut triangles), Covering::Exact);
            assert_eq!(triangles.len(), count - 2);
            let found: f64 = triangles.iter().map(|&triangle| f64::from(area(&positions, &[triangle]))).sum();
            assert!((found - expected).abs() < 1e-4 * expected, "{count} corners: {found}, not {expected}");
        }
    }

    #[test]
    fn polygons_too_large_to_clip_are_named() {
        let count = MAX_CORNERS_TO_CLIP + 2;
        let polygon: Vec<u32> = (0..count as u32).collect();
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&letter_c(count).0, &polygon, &mut triangles), Covering::RoughFan);
        assert_eq!(triangles.len(), count - 2);
    }

    /// The first of all corners that can be cut off, looked for among all, at every step.
    fn clip_slowly(flat: &[DVec2]) -> Vec<[usize; 3]> {
        let is_ear = |rest: &[usize], [a, b, c]: [usize; 3]| {
            let [a, b, c] = [flat[a], flat[b], flat[c]];
            let is_inside = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
            let blocks = |p: DVec2| p != a && p != b && p != c && is_inside(p);
            turn(a, b, c) > 0.0 && !rest.iter().any(|&corner| blocks(flat[corner]))
        };
        let mut rest: Vec<usize> = (0..flat.len()).collect();
        let mut triangles = Vec::new();
        while rest.len() > 3 {
            let count = rest.len();
            let triangle = |i: usize| [rest[(i + count - 1) % count], rest[i], rest[(i + 1) % count]];
            let ear = (0..count).find(|&i| is_ear(&rest, triangle(i))).unwrap_or(0);
            triangles.push(triangle(ear));
            rest.remove(ear);
        }
        triangles.push([rest[0], rest[1], rest[2]]);
        triangles
    }

    /// Stars, and polygons that cross themselves, on a lattice too, where corners coincide and lie on others' edges.
    #[test]
    fn ears_are_cut_in_order_of_their_numbers() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        for count in [4, 5, 7, 12, 40, 150] {
            for _ in 0..10 {
                let step = std::f64::consts::TAU / count as f64;
                let star: Vec<DVec2> =
                    (0..count).map(|i| DVec2::from_angle(i as f64 * step) * (0.2 + random())).collect();
                let anything: Vec<DVec2> = (0..count).map(|_| DVec2::new(random(), random())).collect();
                let lattice: Vec<DVec2> = star.iter().map(|place| (place * 6.0).round()).collect();
                for flat in [star, anything, lattice] {
                    assert_eq!(ears::clip(&flat), clip_slowly(&flat), "{flat:?}");
                }
            }
        }
    }

    #[test]
    fn degenerate_polygons_end() {
        let positions = [Vec3::ZERO; 5];
        let mut triangles = Vec::new();
        triangulate(&positions, &[0, 1, 2, 3, 4], &mut triangles);
        triangulate(&[Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y], &[0, 3, 1, 2], &mut triangles);
        assert!(!triangles.is_empty());
    }
}
