//! Reads `[camera]`.

use super::fields::{Fields, Value};
use super::motion;
use crate::scene::load::{LoadError, Shutter};
use crate::scene::{Camera, Projection, ScreenWindow};
use glam::{Vec2, Vec3};

/// Reads the camera as it is when the shutter opens, with its motion until it closes.
pub(super) fn read(value: &Value, shutter: Shutter) -> Result<Camera, LoadError> {
    let fields = value.fields(&[
        "position",
        "look_at",
        "up",
        "vertical_fov_deg",
        "orthographic_height",
        "screen_window",
        "mirrored",
        "aperture_radius",
        "focus_distance",
        "shutter_s",
        "keyframes",
    ])?;
    let keyframes = fields.get_some("keyframes", |value| motion::camera_keyframes(value))?;
    let (position, look_at) = match &keyframes {
        Some(keyframes) => {
            if let Some(value) = fields.get("position").or_else(|| fields.get("look_at")) {
                return Err(value.error("excludes camera.keyframes, whose entries have their own"));
            }
            keyframes.at(shutter.opens)
        }
        None => (fields.require("position")?.vec3()?, fields.require("look_at")?.vec3()?),
    };
    let Some(forward) = (look_at - position).try_normalize() else {
        return Err(fields.error("position and look_at are the same point"));
    };
    let up = fields.get_or("up", Vec3::Y, Value::direction)?;
    if !Camera::axes_span(forward, up) {
        return Err(fields.error(format_args!("looks along its own up vector {up}; set another \"up\"")));
    }
    let projection = projection(&fields)?;
    let mut camera = Camera {
        screen_window: fields.get_some("screen_window", screen_window)?,
        mirrored: fields.get_or("mirrored", false, Value::boolean)?,
        aperture_radius: fields.get_or("aperture_radius", 0.0, Value::non_negative)? as f32,
        focus_distance: match fields.get("focus_distance") {
            Some(distance) => distance.positive()? as f32,
            None => position.distance(look_at),
        },
        ..Camera::placed(position, forward, up, projection)
    };
    camera.motion = keyframes.and_then(|keyframes| keyframes.motion(&camera, shutter));
    Ok(camera)
}

fn projection(fields: &Fields) -> Result<Projection, LoadError> {
    let angle = fields.get("vertical_fov_deg");
    let Some(height) = fields.get("orthographic_height") else {
        let (least, most) = Camera::FOV_DEG.into_inner();
        let vertical_fov_deg = match angle {
            Some(angle) => angle.within(least, most)? as f32,
            None => Camera::USUAL_FOV_DEG,
        };
        return Ok(Projection::Perspective { vertical_fov_deg });
    };
    match angle {
        Some(angle) => Err(angle.error("excludes camera.orthographic_height")),
        None => Ok(Projection::Orthographic { height: height.positive()? as f32 }),
    }
}

/// [left, right, bottom, top] in half heights of the picture.
fn screen_window(value: &Value) -> Result<ScreenWindow, LoadError> {
    let edges = value.array()?;
    let [left, right, bottom, top] = edges.as_slice() else {
        return Err(value.error(format_args!("expected [left, right, bottom, top], found {} values", edges.len())));
    };
    let corner = |x: &Value, y: &Value| Ok(Vec2::new(x.number()? as f32, y.number()? as f32));
    let window = ScreenWindow { min: corner(left, bottom)?, max: corner(right, top)? };
    if window.max.cmpgt(window.min).all() {
        Ok(window)
    } else {
        Err(value.error("right must be above left, and top above bottom"))
    }
}
