//! What surrounds a scene: pictures, one colour, or the soft studio sky of scenes that bring no light.

use super::error::LoadError;
use super::texture::{self, Values};
use crate::scene::{Encoding, Environment, Parametrisation, Texels};
use glam::{Affine3A, Mat3, Vec3};
use std::path::Path;
use std::sync::Arc;

/// Columns and rows of the studio sky: its softest edge spans 15 texels.
const STUDIO_SIZE: [u32; 2] = [256, 128];

/// A lat-long picture (.hdr, .exr, .png, ...), times `scale`, turned by `rotation_deg` about +y (counter-clockwise seen
/// from above). `notes` gets a sentence for whatever was done to its values.
///
/// # Errors
/// As of [`read`].
pub fn from_file(
    path: &Path,
    scale: f32,
    rotation_deg: f32,
    notes: &mut Vec<String>,
) -> Result<Environment, LoadError> {
    let environment = read(path, Parametrisation::LatLong, notes)?;
    Ok(Environment { scale, from_world: Mat3::from_rotation_y(-rotation_deg.to_radians()), ..environment })
}

/// A picture in a parametrisation, of scale 1 and not turned. An equal-area picture must be square. `notes` gets a
/// sentence for whatever was done to its values.
///
/// # Errors
/// Where the file cannot be read, or an equal-area picture is not square.
pub fn read(path: &Path, parametrisation: Parametrisation, notes: &mut Vec<String>) -> Result<Environment, LoadError> {
    let picture = texture::decode_bytes(&super::files::read(path)?, path, Encoding::Srgb, Values::Colours)?;
    notes.extend(picture.notes.iter().map(|note| format!("{}: {note}.", path.display())));
    if parametrisation == Parametrisation::EqualArea && picture.width != picture.height {
        let problem = format_args!(
            "an equal-area picture is square, and this one has {} x {} pixels",
            picture.width, picture.height
        );
        return Err(LoadError::invalid(path, problem));
    }
    let texels: Vec<Vec3> = match &picture.texels {
        Texels::Bytes(bytes, encoding) => {
            let decode = |byte| encoding.linear(byte);
            bytes.iter().map(|&[r, g, b, _]| Vec3::new(decode(r), decode(g), decode(b))).collect()
        }
        Texels::Floats(floats) => floats.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect(),
    };
    Ok(Environment {
        parametrisation,
        width: picture.width,
        height: picture.height,
        texels: Arc::new(texels),
        ..Environment::constant(Vec3::ZERO)
    })
}

/// The rotation (or reflection) of a transform, without its scale.
pub(super) fn rotation_of(transform: &Affine3A) -> Mat3 {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis].map(Vec3::from);
    let x = x.normalize_or(Vec3::X);
    let across = y - y.dot(x) * x;
    let y = across.try_normalize().unwrap_or_else(|| x.any_orthonormal_vector());
    let upright = x.cross(y);
    Mat3::from_cols(x, y, if upright.dot(z) < 0.0 { -upright } else { upright })
}

/// A soft studio: a bright ceiling that fades to a darker floor, one large warm key area up and to the left of a camera
/// that looks along `forward`, and a weaker cool one opposite. About 1000 cd/m² on average from above.
pub fn studio(nits_per_unit: f64, forward: Vec3) -> Environment {
    let [width, height] = STUDIO_SIZE;
    let ahead = Vec3::new(forward.x, 0.0, forward.z).normalize_or(Vec3::NEG_Z);
    let right = ahead.cross(Vec3::Y);
    let key = (-0.75 * right + 0.8 * Vec3::Y - 0.45 * ahead).normalize();
    let rim = (0.9 * right + 0.35 * Vec3::Y + 0.5 * ahead).normalize();
    // A lobe that is flat in the middle and falls off softly over about 10 degrees, like a soft box.
    let soft_box = |direction: Vec3, axis: Vec3, half_angle: f32| {
        let edge = 0.17;
        let outside = (direction.angle_between(axis) - half_angle) / edge;
        let inside = (0.5 - outside).clamp(0.0, 1.0);
        inside * inside * (3.0 - 2.0 * inside)
    };
    let nits = Environment::from_directions(width, height, |direction| {
        let height_share = 0.5 + 0.5 * direction.y;
        let ambient = Vec3::new(0.95, 0.97, 1.0) * (180.0 + 720.0 * height_share * height_share);
        ambient
            + Vec3::new(1.0, 0.96, 0.9) * 6000.0 * soft_box(direction, key, 0.42)
            + Vec3::new(0.9, 0.95, 1.0) * 2200.0 * soft_box(direction, rim, 0.28)
    });
    Environment { scale: (1.0 / nits_per_unit) as f32, ..nits }
}
