//! Reads `<transform>`: steps that are applied one after the other.

use super::super::error::LoadError;
use super::element::Element;
use glam::{Affine3A, Mat4, Quat, Vec3};

/// The transform of a child of this name; the identity if there is none.
pub(super) fn of(element: &Element, name: &str) -> Result<Affine3A, LoadError> {
    element.child(name).map_or(Ok(Affine3A::IDENTITY), |child| read(child))
}

fn read(transform: &Element) -> Result<Affine3A, LoadError> {
    let mut total = Affine3A::IDENTITY;
    for step in &transform.children {
        let matrix = match step.tag.as_str() {
            "translate" => Affine3A::from_translation(step.own_vector(0.0)?),
            "scale" => Affine3A::from_scale(step.own_vector(1.0)?),
            "rotate" => {
                let axis = step.own_vector(0.0)?.try_normalize();
                let axis = axis.ok_or_else(|| step.error("an axis of no length"))?;
                Affine3A::from_quat(Quat::from_axis_angle(axis, step.number_attribute("angle")?.to_radians()))
            }
            "lookat" | "lookAt" | "look_at" => look_at(step)?,
            "matrix" => matrix(step)?,
            other => return Err(step.error(format_args!("unknown step \"{other}\" of a transform"))),
        };
        total = matrix * total;
    }
    if total.is_finite() { Ok(total) } else { Err(transform.error("the transform is not finite")) }
}

fn look_at(step: &Element) -> Result<Affine3A, LoadError> {
    let (origin, target) = (step.triple("origin")?, step.triple("target")?);
    let up = if step.attribute("up").is_some() { step.triple("up")? } else { Vec3::ZERO };
    let frame = || {
        let ahead = (target - origin).try_normalize()?;
        let up = if up == Vec3::ZERO { any_up(ahead) } else { up };
        let left = up.cross(ahead).try_normalize()?;
        Some((left, ahead.cross(left), ahead))
    };
    let (left, up, ahead) =
        frame().ok_or_else(|| step.error("origin and target are the same point, or up lies along their line"))?;
    Ok(Affine3A::from_mat3_translation(glam::Mat3::from_cols(left, up, ahead), origin))
}

/// What Mitsuba takes for "up" where a file gives none: the first perpendicular of Duff et al. 2017 (Building an
/// Orthonormal Basis, Revisited).
fn any_up(ahead: Vec3) -> Vec3 {
    let sign = 1.0_f32.copysign(ahead.z);
    let a = -1.0 / (sign + ahead.z);
    Vec3::new(1.0 + sign * ahead.x * ahead.x * a, sign * ahead.x * ahead.y * a, -sign * ahead.x)
}

fn matrix(step: &Element) -> Result<Affine3A, LoadError> {
    let values = step.numbers(step.attribute("value").unwrap_or(""))?;
    match values.len() {
        16 => {
            let mut columns = [0.0; 16];
            columns.copy_from_slice(&values);
            Ok(Affine3A::from_mat4(Mat4::from_cols_array(&columns).transpose()))
        }
        9 => {
            let row = |i: usize| Vec3::new(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
            Ok(Affine3A::from_mat3(glam::Mat3::from_cols(row(0), row(1), row(2)).transpose()))
        }
        other => Err(step.error(format_args!("a matrix of {other} numbers; expected 16 or 9"))),
    }
}
