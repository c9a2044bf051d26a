//! Polygons into triangles: a fan where that is right, ear clipping where a corner points inwards.

use glam::{DVec2, DVec3, Vec3};

/// Ear clipping is quadratic at best: larger polygons get a fan.
const MOST_CORNERS_TO_CLIP: usize = 1000;

/// Triangles of a polygon given by vertex indices; all indices in range.
pub(super) fn triangulate(positions: &[Vec3], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
    let fan = |triangles: &mut Vec<[u32; 3]>| {
        triangles.extend(polygon.windows(2).skip(1).map(|pair| [polygon[0], pair[0], pair[1]]));
    };
    if polygon.len() <= 3 || polygon.len() > MOST_CORNERS_TO_CLIP {
        return fan(triangles);
    }
    let flat = flatten(positions, polygon);
    let count = flat.len();
    let convex = (0..count).all(|i| turn(flat[(i + count - 1) % count], flat[i], flat[(i + 1) % count]) >= 0.0);
    if convex {
        return fan(triangles);
    }
    let mut rest: Vec<usize> = (0..count).collect();
    while rest.len() > 3 {
        let ear = (0..rest.len()).find(|&i| is_ear(&flat, &rest, i));
        // A polygon that crosses itself may have no ear: any corner ends the search.
        let i = ear.unwrap_or(0);
        let n = rest.len();
        triangles.push([rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]].map(|corner| polygon[corner]));
        rest.remove(i);
    }
    triangles.push([rest[0], rest[1], rest[2]].map(|corner| polygon[corner]));
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

/// Whether the corner can be cut off: it turns left and no other corner lies inside its triangle.
fn is_ear(flat: &[DVec2], rest: &[usize], i: usize) -> bool {
    let n = rest.len();
    let [a, b, c] = [flat[rest[(i + n - 1) % n]], flat[rest[i]], flat[rest[(i + 1) % n]]];
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    let inside = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    rest.iter().all(|&corner| {
        let p = flat[corner];
        p == a || p == b || p == c || !inside(p)
    })
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

    #[test]
    fn degenerate_polygons_end() {
        let positions = [Vec3::ZERO; 5];
        let mut triangles = Vec::new();
        triangulate(&positions, &[0, 1, 2, 3, 4], &mut triangles);
        triangulate(&[Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y], &[0, 3, 1, 2], &mut triangles);
        assert!(!triangles.is_empty());
    }
}
