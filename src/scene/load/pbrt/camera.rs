//! `Camera` and `Film`: projection, lens, picture size, crop, and what the sensor multiplies.

use super::super::builder::NamedCamera;
use super::super::error::LoadError;
use super::super::framing::{FilmAxis, Framing, LONGEST_SIDE};
use super::Reader;
use super::parameters::Parameters;
use super::state::{Carried, Path, Transforms};
use crate::scene::{Camera, FilmDefaults, Motion, MotionKey, Pose, Projection, ScreenWindow};
use glam::{Affine3A, Vec2, Vec3};

/// A rectangle of the film in shares of it, from the upper left corner.
struct Crop {
    min: Vec2,
    max: Vec2,
}

/// Where a camera is, and its axes, of unit length.
struct PlacedAxes {
    position: Vec3,
    forward: Vec3,
    up: Vec3,
    right: Vec3,
}

impl PlacedAxes {
    /// `None` where the transform cannot be undone.
    fn of(placed: &Affine3A) -> Option<Self> {
        let axis = |vector| placed.transform_vector3(vector).try_normalize();
        let (forward, up, right) = (axis(Vec3::Z)?, axis(Vec3::Y)?, axis(Vec3::X)?);
        let position = Vec3::from(placed.translation);
        let spans = position.is_finite() && Camera::axes_span(forward, up);
        spans.then_some(Self { position, forward, up, right })
    }
}

impl Reader<'_> {
    /// Puts the camera together once `WorldBegin` is reached.
    pub(super) fn place_camera(&mut self) -> Result<(), LoadError> {
        let (full, crop) = self.film_size()?;
        let Some((kind, parameters, world_to_camera)) = self.camera.take() else {
            return Ok(());
        };
        self.open_shutter(&parameters)?;
        let to_world = world_to_camera.inverse();
        let placed = self.here(&to_world);
        let PlacedAxes { position, forward, up, right } =
            PlacedAxes::of(&placed).ok_or_else(|| parameters.error("the camera's transform cannot be undone"))?;
        let film_aspect = full.width as f32 / full.height as f32;
        let (window, framing) = self.window(&parameters, film_aspect)?;
        let projection = self.projection(&kind, &parameters)?;
        let stretch = stretch_of(&placed);
        let across = match projection {
            Projection::Orthographic { .. } => stretch.truncate(),
            Projection::Perspective { .. } => stretch.truncate() / stretch.z,
        };
        let window = ScreenWindow { min: window.min * across, max: window.max * across };
        let is_usual = window == ScreenWindow::centered(film_aspect);
        let camera = Camera {
            screen_window: (!is_usual || crop.is_some()).then(|| cropped(window, crop)),
            mirrored: forward.cross(up).dot(right) < 0.0,
            // A lens that a transform made oval is as large as the oval.
            aperture_radius: parameters.float_or("lensradius", 0.0)?.max(0.0) * (stretch.x * stretch.y).sqrt(),
            focus_distance: (parameters.float_or("focaldistance", 1e6)? * stretch.z).max(1e-6),
            motion: self.motion(&to_world).map(|m| m.since_open()),
            ..Camera::placed(position, forward, up, projection)
        };
        self.note_unread("camera", &parameters);
        self.builder.cameras.push(NamedCamera { name: kind, holder: None, camera, framing });
        Ok(())
    }

    /// When it is open, and what the sensor makes of that.
    fn open_shutter(&mut self, camera: &Parameters) -> Result<(), LoadError> {
        let opens = camera.float_or("shutteropen", 0.0)?;
        let closes = camera.float_or("shutterclose", 1.0)?;
        self.shutter = [opens, closes.max(opens)];
        self.builder.shutter_s = f64::from(self.shutter[1] - opens);
        self.exposure = self.sensor(closes - opens)?;
        Ok(())
    }

    /// The window of a camera that nothing stretches, and what it shows of another film.
    fn window(&self, camera: &Parameters, film_aspect: f32) -> Result<(ScreenWindow, Framing), LoadError> {
        let stated_aspect = camera.float("frameaspectratio")?.filter(|&aspect| aspect > 0.0);
        let stated_window = camera.numbers(&["float"], "screenwindow")?;
        let framing = match (stated_aspect, stated_window) {
            (None, None) => {
                let FilmDefaults { width, height } = self.builder.film;
                Framing::Spanning { axis: FilmAxis::Smaller, film: width as f32 / height as f32, whole: film_aspect }
            }
            // pbrt stretches what the file states.
            _ => Framing::Fixed,
        };
        let window = match stated_window {
            // The shorter side spans [−1, 1].
            None => {
                let half_size = FilmAxis::Smaller.half_size(stated_aspect.unwrap_or(film_aspect));
                ScreenWindow { min: -half_size, max: half_size }
            }
            Some(&[left, right, bottom, top]) if left < right && bottom < top => {
                ScreenWindow { min: Vec2::new(left as f32, bottom as f32), max: Vec2::new(right as f32, top as f32) }
            }
            Some(_) => return Err(camera.error("\"screenwindow\": expected [ left right bottom top ]")),
        };
        Ok((window, framing))
    }

    fn projection(&mut self, kind: &str, camera: &Parameters) -> Result<Projection, LoadError> {
        let usual_fov_deg = match kind {
            "perspective" => 90.0,
            "realistic" => {
                self.builder.note("The lens system of a \"realistic\" camera is not traced: a pinhole of 45 degrees.");
                45.0
            }
            "orthographic" => return Ok(Projection::Orthographic { height: 2.0 }),
            other => {
                return Err(camera.unsupported(format_args!(
                    "cameras of type \"{other}\" are not rendered; perspective, orthographic and, as a pinhole, realistic are"
                )));
            }
        };
        let fov_deg = camera.float_or("fov", usual_fov_deg)?;
        if !Camera::FOV_DEG.contains(&f64::from(fov_deg)) {
            let (least, most) = Camera::FOV_DEG.into_inner();
            return Err(camera.error(format_args!("\"fov\" must lie in [{least}, {most}] degrees, not {fov_deg}")));
        }
        Ok(Projection::Perspective { vertical_fov_deg: fov_deg })
    }

    /// Where a transform is when the shutter opens.
    pub(super) fn here(&self, transforms: &Transforms) -> Affine3A {
        transforms.at(self.share_when_open())
    }

    /// The motion while the shutter is open; `None` where nothing moves.
    pub(super) fn motion(&self, transforms: &Transforms) -> Option<Motion> {
        if !transforms.moves() {
            return None;
        }
        self.motion_after(Affine3A::IDENTITY, 1, |share| transforms.at(share))
    }

    /// Where a part is when the shutter opens, and how it moves from there.
    pub(super) fn carried(&self, part: &Carried) -> (Affine3A, Option<Motion>) {
        // Steps of a quarter turn leave its arc by 3e-4 of the radius.
        const STEPS: u16 = 32;
        match part.path() {
            Path::Whole(transforms) => (self.here(&transforms), self.motion(&transforms)),
            Path::After { inner, outer } => {
                (self.here(&outer) * inner, self.motion_after(inner, 1, |share| outer.at(share)))
            }
            Path::Apart => {
                let identity = Affine3A::IDENTITY;
                (part.at(self.share_when_open()), self.motion_after(identity, STEPS, |share| part.at(share)))
            }
        }
    }

    /// The motion of what `before` places at rest: along `at` from start to end of `TransformTimes`, with keys at so
    /// many steps.
    fn motion_after(&self, before: Affine3A, steps: u16, at: impl Fn(f32) -> Affine3A) -> Option<Motion> {
        if self.shutter[1] <= self.shutter[0] {
            return None;
        }
        let (opens, stays_open) = (f64::from(self.shutter[0]), f64::from(self.shutter[1] - self.shutter[0]));
        let frame_time = self.options.frame_time;
        // Before and after `TransformTimes` everything rests: where the shutter reaches beyond, the motion does not
        // fill it.
        let [start, end] = self.times;
        let times =
            (0..=steps).map(|step| f64::from(step) / f64::from(steps)).map(|way| start * (1.0 - way) + end * way);
        let steps = times.map(|time| ((time - frame_time - opens) / stays_open) as f32);
        let mut shares: Vec<f32> = [0.0, 1.0].into_iter().chain(steps).filter(|s| (0.0..=1.0).contains(s)).collect();
        shares.sort_by(f32::total_cmp);
        shares.dedup();
        let at_share = |share: f32| at(self.share_of(opens + f64::from(share) * stays_open));
        let places: Vec<Affine3A> = shares.iter().map(|&share| at_share(share)).collect();
        let can_be_undone = |place: &Affine3A| place.is_finite() && place.matrix3.determinant() != 0.0;
        if !places.iter().all(|place| can_be_undone(&(*place * before))) {
            return None;
        }
        let keys = shares.into_iter().zip(places).map(|(time, place)| MotionKey { time, pose: Pose::decompose(place) });
        Motion::new(before, keys.collect()).filter(|motion| !motion.rests())
    }

    fn share_when_open(&self) -> f32 {
        self.share_of(f64::from(self.shutter[0]))
    }

    /// How far a time lies between those of `TransformTimes`. Subtracted before it is narrowed: a shot's later hours
    /// have f32 times a frame apart.
    fn share_of(&self, time: f64) -> f32 {
        let [start, end] = self.times;
        let time = time + self.options.frame_time;
        if end > start { ((time - start) / (end - start)).clamp(0.0, 1.0) as f32 } else { 0.0 }
    }

    /// The film's size, and the part of it that is rendered.
    fn film_size(&mut self) -> Result<(FilmDefaults, Option<Crop>), LoadError> {
        let Some((_, film)) = &self.film else {
            let default = FilmDefaults { width: 1280, height: 720 };
            self.builder.film = default;
            return Ok((default, None));
        };
        let side = |name: &str, default: i64| match film.integer(name)?.unwrap_or(default) {
            side if (1..=i64::from(LONGEST_SIDE)).contains(&side) => Ok(side as u32),
            other => Err(film.error(format_args!("\"{name}\" must lie in [1, {LONGEST_SIDE}], not {other}"))),
        };
        let full = FilmDefaults { width: side("xresolution", 1280)?, height: side("yresolution", 720)? };
        let size = Vec2::new(full.width as f32, full.height as f32);
        // Corners in pixels. Bounds stay what they are: in f32 241 / 1920 × 1920 is above 241, and would be 242.
        let corners = match (film.numbers(&["float"], "cropwindow")?, film.numbers(&["integer"], "pixelbounds")?) {
            (Some(&[x0, x1, y0, y1]), None) => {
                let [x0, x1, y0, y1] = [x0, x1, y0, y1].map(|share| (share as f32).clamp(0.0, 1.0));
                Some([Vec2::new(x0, y0) * size, Vec2::new(x1, y1) * size])
            }
            (None, Some(&[x0, x1, y0, y1])) => {
                let corner = |x: f64, y: f64| Vec2::new(x as f32, y as f32).clamp(Vec2::ZERO, size);
                Some([corner(x0, y0), corner(x1, y1)])
            }
            (None, None) => None,
            _ => return Err(film.error("expected four numbers in either \"cropwindow\" or \"pixelbounds\"")),
        };
        let Some([first, last]) = corners.map(|corners| corners.map(Vec2::ceil)) else {
            self.builder.film = full;
            return Ok((full, None));
        };
        let pixels = last - first;
        if pixels.min_element() < 1.0 {
            return Err(film.error("the crop leaves no pixel"));
        }
        self.builder.film = FilmDefaults { width: pixels.x as u32, height: pixels.y as u32 };
        Ok((full, Some(Crop { min: first / size, max: last / size })))
    }

    /// What the sensor multiplies radiance by: exposure time × ISO / 100.
    fn sensor(&mut self, seconds: f32) -> Result<f32, LoadError> {
        let Some((kind, film)) = self.film.take() else { return Ok(1.0) };
        if kind != "rgb" {
            self.builder.note(format!("Film \"{kind}\" is rendered as \"rgb\"."));
        }
        if film.string("sensor")?.is_some_and(|sensor| sensor != "cie1931")
            || film.float("whitebalance")?.is_some_and(|kelvin| kelvin > 0.0)
        {
            self.builder.note("The sensor's own colour response and white balance are not rendered, its exposure is.");
        }
        if let Some(most) = film.float("maxcomponentvalue")?.filter(|most| most.is_finite()) {
            self.builder.note(format!(
                "The film's \"maxcomponentvalue\" limits no samples here: --clamp {most} does much the same."
            ));
        }
        let ratio = seconds * film.float_or("iso", 100.0)? / 100.0;
        for (type_, name) in
            [("string", "filename"), ("float", "diagonal"), ("bool", "savefp16"), ("string", "coordinatesystem")]
        {
            film.find(&[type_], name);
        }
        self.note_unread("film", &film);
        Ok(if ratio > 0.0 && ratio.is_finite() { ratio } else { 1.0 })
    }
}

/// How much longer a camera's axes are in the world; alike, or 1, where rounding alone makes a difference.
fn stretch_of(placed: &Affine3A) -> Vec3 {
    const ROUNDING: f32 = 1e-5;
    let [x, y, z] = [placed.x_axis, placed.y_axis, placed.z_axis].map(|axis| axis.length());
    let stretch = Vec3::new(x, y, z);
    match (stretch / x - 1.0).abs().max_element() < ROUNDING {
        true if (x - 1.0).abs() < ROUNDING => Vec3::ONE,
        true => Vec3::splat(x),
        false => stretch,
    }
}

fn cropped(window: ScreenWindow, crop: Option<Crop>) -> ScreenWindow {
    let Some(Crop { min, max }) = crop else { return window };
    let size = window.max - window.min;
    // The film's rows run down, the window's y runs up.
    ScreenWindow {
        min: Vec2::new(window.min.x + min.x * size.x, window.max.y - max.y * size.y),
        max: Vec2::new(window.min.x + max.x * size.x, window.max.y - min.y * size.y),
    }
}
