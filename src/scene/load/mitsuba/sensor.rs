//! Reads `<sensor>` and its `<film>`.

use super::super::builder::NamedCamera;
use super::super::default_view;
use super::super::error::{LoadError, Place, names_of};
use super::super::framing::{FilmAxis, Framing, LONGEST_SIDE};
use super::Reader;
use super::element::{Element, canonical};
use super::transform;
use crate::scene::{Camera, FilmDefaults, Projection, ScreenWindow};
use glam::{Affine3A, Vec2, Vec3};

/// Mitsuba's default.
const FAR_CLIP: f32 = 1e4;

/// Depths along a camera's axis before and behind which Mitsuba shows nothing, in scene units, where the file gives
/// them.
pub(super) struct Clips {
    place: Place,
    /// Mitsuba's default of 0.01 leaves out nothing that anyone would look for.
    near: Option<f32>,
    /// [`FAR_CLIP`] if the file gives none.
    far: Option<f32>,
}

/// How a sensor's rays run.
#[derive(Clone, Copy)]
enum Rays {
    FromPoint,
    Parallel,
}

/// What lets the rays in.
#[derive(Clone, Copy)]
enum Aperture {
    Pinhole,
    Lens,
}

/// The sensors that are rendered.
const KINDS: &[(&str, (Rays, Aperture))] = &[
    ("perspective", (Rays::FromPoint, Aperture::Pinhole)),
    ("thinlens", (Rays::FromPoint, Aperture::Lens)),
    ("orthographic", (Rays::Parallel, Aperture::Pinhole)),
    ("telecentric", (Rays::Parallel, Aperture::Lens)),
];

impl Reader {
    /// Adds a camera; the first one's film is the picture's size.
    pub(super) fn sensor(&mut self, sensor: &Element) -> Result<(), LoadError> {
        let is_first = self.builder.cameras.is_empty();
        let film = self.film(sensor)?;
        if is_first {
            self.builder.film = film;
        }
        let aspect = film.width as f32 / film.height as f32;
        let to_world = transform::of(sensor, "toworld")?;
        let axes = Axes::of(sensor, &to_world)?;
        let kind = sensor.kind();
        let Some((_, (rays, aperture))) = KINDS.iter().find(|(name, _)| *name == kind) else {
            let known = names_of(KINDS);
            return Err(sensor.unsupported(format_args!("sensor \"{kind}\" is not rendered; {known} are")));
        };
        let mut view = match rays {
            Rays::FromPoint => View::from_point(sensor, aspect)?,
            Rays::Parallel => View::along_parallels(&to_world, aspect),
        };
        view.shift(sensor)?;
        let aperture_radius = match aperture {
            Aperture::Pinhole => 0.0,
            Aperture::Lens => sensor.float_or("apertureradius", 0.0)?.max(0.0),
        };
        let clips = Clips { place: sensor.place(), near: sensor.float("nearclip")?, far: sensor.float("farclip")? };
        let focus_distance = sensor.float_or("focusdistance", clips.far.unwrap_or(FAR_CLIP))?.max(1e-6);
        sensor.ignore(&["shutteropen", "shutterclose"]);
        sensor.tagged("sampler").count();
        self.note_unused(&format!("sensor \"{kind}\""), sensor);
        let screen_window = (view.window != ScreenWindow::centered(aspect)).then_some(view.window);
        let framing = match (screen_window, view.axis) {
            (None, FilmAxis::Y) => Framing::Fixed,
            (_, axis) => Framing::Spanning { axis, film: aspect, whole: aspect },
        };
        let camera = Camera {
            screen_window,
            // Mitsuba's x points to the left of the picture.
            mirrored: axes.forward.cross(axes.up).dot(axes.left) > 0.0,
            aperture_radius,
            focus_distance,
            ..Camera::placed(to_world.translation.into(), axes.forward, axes.up, view.projection)
        };
        if is_first {
            self.clips = Some(clips);
        }
        self.builder.cameras.push(NamedCamera { name: sensor.name(), holder: None, camera, framing });
        Ok(())
    }

    /// Names clipping distances of the first camera that would cut something off, once everything is there.
    pub(super) fn note_clips(&mut self) {
        let (Some(Clips { place, near, far }), Some(first)) = (self.clips.take(), self.builder.cameras.first()) else {
            return;
        };
        let bounds = default_view::bounds(&self.builder.meshes, &self.builder.instances, &self.builder.spheres);
        let (position, forward) = (first.camera.position, first.camera.forward);
        let size = bounds.max - bounds.min;
        if !size.is_finite() {
            return; // nothing that could be cut
        }
        let depths = bounds.corners().map(|corner| (Vec3::from(corner) - position).dot(forward));
        let (nearest, farthest) = depths
            .into_iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), depth| (low.min(depth), high.max(depth)));
        // From inside a scene, what lies within a hundredth of it is seldom anything.
        let least = if nearest > 0.0 { nearest } else { 0.01 * size.length() };
        let near = near.filter(|near| farthest > 0.0 && *near > least);
        let far_name = if far.is_some() { "far_clip" } else { "Mitsuba's default far_clip" };
        let far = Some(far.unwrap_or(FAR_CLIP)).filter(|far| *far < farthest);
        for (name, distance) in [("near_clip", near), (far_name, far)] {
            if let Some(distance) = distance {
                self.builder.note(format!("{place}: {name} {distance} cuts the scene: here nothing is cut."));
            }
        }
    }

    fn film(&mut self, sensor: &Element) -> Result<FilmDefaults, LoadError> {
        let Some(film) = sensor.tagged("film").next().cloned() else {
            return Ok(FilmDefaults { width: 768, height: 576 });
        };
        let side = |name: &str, default: f32| {
            let side = film.float_or(name, default)?;
            if (1.0..=LONGEST_SIDE as f32).contains(&side) && side.fract() == 0.0 {
                Ok(side as u32)
            } else {
                Err(film.error(format_args!("\"{name}\" must be a whole number from 1 to {LONGEST_SIDE}, not {side}")))
            }
        };
        let size = FilmDefaults { width: side("width", 768.0)?, height: side("height", 576.0)? };
        if ["cropwidth", "cropheight", "cropoffsetx", "cropoffsety"].iter().any(|name| film.child(name).is_some()) {
            self.builder.note(format!("{}: the film's crop is not used: the whole picture is rendered.", film.place()));
        }
        Ok(size)
    }
}

/// A camera's own axes in the world, of length 1.
struct Axes {
    left: Vec3,
    up: Vec3,
    forward: Vec3,
}

impl Axes {
    fn of(sensor: &Element, to_world: &Affine3A) -> Result<Self, LoadError> {
        let direction = |vector| to_world.transform_vector3(vector).try_normalize();
        match (direction(Vec3::X), direction(Vec3::Y), direction(Vec3::Z)) {
            (Some(left), Some(up), Some(forward)) if Camera::axes_span(forward, up) => Ok(Self { left, up, forward }),
            _ => Err(sensor.error("its transform cannot be undone")),
        }
    }
}

/// What of the scene the film shows.
struct View {
    projection: Projection,
    window: ScreenWindow,
    /// The axis whose extent stays in a picture of another aspect.
    axis: FilmAxis,
}

impl View {
    fn from_point(sensor: &Element, aspect: f32) -> Result<Self, LoadError> {
        let field = FieldOfView::of(sensor)?;
        let projection = Projection::Perspective { vertical_fov_deg: field.vertical_deg(aspect) };
        Ok(Self { projection, window: ScreenWindow::centered(aspect), axis: field.axis })
    }

    /// The picture's width spans [−1, 1] of the camera's own x, its pixels are square in the camera's coordinates.
    fn along_parallels(to_world: &Affine3A, aspect: f32) -> Self {
        let mut window = ScreenWindow::centered(aspect);
        let [x, y] = [to_world.matrix3.x_axis, to_world.matrix3.y_axis].map(|axis| axis.length());
        if (x - y).abs() > 1e-5 * x {
            let across = Vec2::new(x / y, 1.0);
            window = ScreenWindow { min: window.min * across, max: window.max * across };
        }
        Self { projection: Projection::Orthographic { height: 2.0 * y / aspect }, window, axis: FilmAxis::X }
    }

    /// Moves the window by the offset of the principal point, which is in shares of the picture.
    fn shift(&mut self, sensor: &Element) -> Result<(), LoadError> {
        let offset = |name| sensor.float_or(name, 0.0);
        let shift = Vec2::new(offset("principalpointoffsetx")?, -offset("principalpointoffsety")?);
        let moved = shift * (self.window.max - self.window.min);
        self.window.min += moved;
        self.window.max += moved;
        Ok(())
    }
}

/// Tangent of half a field of view, and what it is for.
struct FieldOfView {
    tangent_of_half: f32,
    axis: FilmAxis,
}

impl FieldOfView {
    /// `fov` belongs to the x axis unless `fov_axis` says otherwise; without it a focal length on 35 mm film counts.
    fn of(sensor: &Element) -> Result<Self, LoadError> {
        let axis = match sensor.string("fovaxis")?.map(canonical).as_deref() {
            None | Some("x") => FilmAxis::X,
            Some("y") => FilmAxis::Y,
            Some("smaller") => FilmAxis::Smaller,
            Some("larger") => FilmAxis::Larger,
            Some("diagonal") => FilmAxis::Diagonal,
            Some(other) => return Err(sensor.error(format_args!("unknown fov axis \"{other}\""))),
        };
        match sensor.float("fov")? {
            Some(fov) if Camera::FOV_DEG.contains(&f64::from(fov)) => {
                Ok(Self { tangent_of_half: (0.5 * fov).to_radians().tan(), axis })
            }
            Some(fov) => {
                let (least, most) = Camera::FOV_DEG.into_inner();
                Err(sensor.error(format_args!("\"fov\" must lie in [{least}, {most}] degrees, not {fov}")))
            }
            None => {
                let text = sensor.string("focallength")?.unwrap_or("50mm");
                let millimetres: Option<f32> = text.trim().trim_end_matches("mm").trim().parse().ok();
                let millimetres = millimetres.filter(|length| *length > 0.0 && length.is_finite());
                let length =
                    millimetres.ok_or_else(|| sensor.error(format_args!("\"{text}\" is not a focal length")))?;
                // Half the diagonal of 36 mm × 24 mm.
                Ok(Self { tangent_of_half: 0.5 * 36.0_f32.hypot(24.0) / length, axis: FilmAxis::Diagonal })
            }
        }
    }

    fn vertical_deg(&self, aspect: f32) -> f32 {
        let vertical = self.tangent_of_half / self.axis.length(aspect);
        let (least, most) = Camera::FOV_DEG.into_inner();
        (2.0 * vertical.atan().to_degrees()).clamp(least as f32, most as f32)
    }
}
