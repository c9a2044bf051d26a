//! Camera and surroundings from the command line, for scenes that lack them or have the wrong ones. What they say
//! stands in place of the file's.

use super::job::Size;
use super::numbers::whole;
use anyhow::{Context, bail};
use clap::Args;
use fechner::scene::load::environment;
use fechner::scene::load::sky::{self, Sky};
use fechner::scene::load::{LoadOptions, NO_CAMERA, megabytes};
use fechner::scene::{Camera, Environment, FilmDefaults, Projection, Scene};
use glam::Vec3;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// What is chosen of the scene, and what is put in the place of its own.
#[derive(Clone, Debug, Args)]
pub(super) struct Staging {
    /// Camera of the scene file, by name.
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Surroundings instead of the scene's: a lat-long picture (.hdr, .exr, .png),
    /// sky:ELEVATION[,AZIMUTH[,TURBIDITY]] in degrees, or constant:CD_M2.
    #[arg(long, value_name = "FILE|sky:...", value_parser = parse_surroundings, allow_negative_numbers = true)]
    environment: Option<Surroundings>,
    /// Look from one point to another: X,Y,Z,X,Y,Z, and the vertical field of view in degrees if wanted.
    #[arg(long, value_name = "FROM,TO[,FOV]", value_parser = parse_look_at, allow_hyphen_values = true, conflicts_with = "camera")]
    look_at: Option<LookAt>,
    /// Most memory for decoded textures, of one frame where there are several: beyond it the largest are halved until
    /// they fit. No limit unless told.
    #[arg(long, value_name = "MB", value_parser = whole(1..=u32::MAX), allow_negative_numbers = true)]
    texture_memory: Option<u32>,
}

#[derive(Clone, Debug)]
enum Surroundings {
    Picture(PathBuf),
    Sky(Sky),
    Constant(f32),
}

#[derive(Clone, Copy, Debug)]
struct LookAt {
    from: Vec3,
    to: Vec3,
    vertical_fov_deg: Option<f32>,
}

fn numbers(text: &str) -> Option<Vec<f32>> {
    text.split(',').map(|word| word.trim().parse().ok().filter(|number: &f32| number.is_finite())).collect()
}

fn parse_surroundings(text: &str) -> Result<Surroundings, String> {
    if let Some(nits) = text.strip_prefix("constant:") {
        return match numbers(nits).as_deref() {
            Some(&[nits]) if nits >= 0.0 => Ok(Surroundings::Constant(nits)),
            _ => Err(format!("\"{text}\": expected constant: and a luminance in cd/m², such as constant:500")),
        };
    }
    let Some(sky) = text.strip_prefix("sky:") else { return Ok(Surroundings::Picture(PathBuf::from(text))) };
    let default = Sky::default();
    let values = numbers(sky).filter(|values| (1..=3).contains(&values.len()));
    let values = values.ok_or_else(|| {
        format!("\"{text}\": expected sky:ELEVATION[,AZIMUTH[,TURBIDITY]], such as sky:30 or sky:30,120,4")
    })?;
    let at = |place: usize, default: f32| values.get(place).copied().unwrap_or(default);
    let sky = Sky {
        sun_elevation_deg: at(0, default.sun_elevation_deg),
        sun_azimuth_deg: at(1, default.sun_azimuth_deg),
        turbidity: at(2, default.turbidity),
        ..default
    };
    if !Sky::ELEVATION_DEG.contains(&sky.sun_elevation_deg) || !Sky::TURBIDITY.contains(&sky.turbidity) {
        let [(low, high), (clear, hazy)] = [Sky::ELEVATION_DEG, Sky::TURBIDITY].map(RangeInclusive::into_inner);
        return Err(format!(
            "\"{text}\": the elevation must lie in [{low}, {high}] degrees, the turbidity in [{clear}, {hazy}]"
        ));
    }
    Ok(Surroundings::Sky(sky))
}

fn parse_look_at(text: &str) -> Result<LookAt, String> {
    let look = |values: &[f32], vertical_fov_deg| LookAt {
        from: Vec3::from_slice(&values[..3]),
        to: Vec3::from_slice(&values[3..6]),
        vertical_fov_deg,
    };
    let look = match numbers(text).as_deref() {
        Some(values @ [_, _, _, _, _, _]) => look(values, None),
        Some(values @ [_, _, _, _, _, _, fov]) if Camera::FOV_DEG.contains(&f64::from(*fov)) => {
            look(values, Some(*fov))
        }
        _ => {
            let (least, most) = Camera::FOV_DEG.into_inner();
            return Err(format!(
                "\"{text}\": expected X,Y,Z,X,Y,Z and perhaps a field of view in [{least}, {most}] degrees"
            ));
        }
    };
    if look.from == look.to { Err("both points are the same".to_owned()) } else { Ok(look) }
}

impl LookAt {
    /// The scene's camera, lens and projection and all, moved there, at rest and focused on the point looked at. A
    /// field of view that is told is that of a central projection, pixels square.
    fn camera(self, own: &Camera, forward: Vec3) -> Camera {
        let up = if forward.cross(Vec3::Y).length() < 1e-3 { Vec3::NEG_Z } else { Vec3::Y };
        let focus_distance = self.from.distance(self.to);
        let moved = Camera { position: self.from, forward, up, focus_distance, motion: None, ..own.clone() };
        match self.vertical_fov_deg {
            None => moved,
            Some(vertical_fov_deg) => {
                Camera { projection: Projection::Perspective { vertical_fov_deg }, screen_window: None, ..moved }
            }
        }
    }
}

impl Staging {
    /// How the scene is read, as it is at a time, for a unit and a picture of a size that the command line may name.
    pub(super) fn load_options(&self, seconds: f64, nits_per_unit: Option<f64>, size: Option<Size>) -> LoadOptions {
        LoadOptions {
            camera: self.camera.clone(),
            frame_time: seconds,
            shutter_s: 0.0,
            frame_s: None,
            environment_follows: self.environment.is_some(),
            on_texture: None,
            texture_memory: self.texture_memory.map(megabytes),
            nits_per_unit,
            film: size.map(|Size { width, height }| FilmDefaults { width, height }),
        }
    }

    /// Puts everything into the scene.
    pub(super) fn apply(&self, scene: &mut Scene) -> anyhow::Result<()> {
        let nits_per_unit = scene.nits_per_unit;
        match &self.environment {
            None => {}
            Some(Surroundings::Picture(file)) => {
                let environment = environment::from_file(file, 1.0, 0.0, &mut scene.notes).context("--environment")?;
                scene.surround(environment, None);
            }
            Some(Surroundings::Constant(nits)) => {
                let radiance = (f64::from(*nits) / nits_per_unit) as f32;
                scene.surround(Environment::constant(Vec3::splat(radiance)), None);
            }
            Some(Surroundings::Sky(sky)) => {
                let light = sky::light(sky, nits_per_unit);
                scene.surround(light.environment, light.sun);
            }
        }
        if let Some(look) = self.look_at {
            let way = look.to - look.from;
            if !way.length().is_finite() {
                bail!("--look-at: the points are too far apart");
            }
            let forward = way.try_normalize().context("--look-at: the points are too close")?;
            scene.camera = look.camera(&scene.camera, forward);
            scene.notes.retain(|note| note != NO_CAMERA);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use fechner::scene::{Light, ScreenWindow};
    use glam::Vec2;

    #[derive(Parser)]
    struct Arguments {
        #[command(flatten)]
        staging: Staging,
    }

    /// A scene as it is staged by the command line.
    fn staged(scene: Scene, arguments: &[&str]) -> Scene {
        let mut scene = scene;
        let arguments = Arguments::parse_from(["fechner"].iter().chain(arguments));
        arguments.staging.apply(&mut scene).unwrap();
        scene
    }

    /// The sun goes with its sky, whatever comes in its place; what else shines from afar stays.
    #[test]
    fn other_surroundings_have_no_sun_but_their_own() {
        let lamp =
            Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE, angular_radius: 0.0, is_of_sky: false };
        let under_a_sky = || {
            let sky = sky::light(&Sky::default(), 1.0);
            let lights = [lamp.clone()].into_iter().chain(sky.sun).collect();
            Scene { environment: Some(sky.environment), lights, ..Scene::default() }
        };
        assert_eq!(under_a_sky().lights.len(), 2);
        for (surroundings, suns) in [("constant:1000", 0), ("sky:30", 1)] {
            let scene = staged(under_a_sky(), &["--environment", surroundings]);
            assert_eq!(scene.lights[0], lamp, "{surroundings}");
            assert_eq!(scene.lights.len(), 1 + suns, "{surroundings}: {:?}", scene.lights);
        }
    }

    /// Where the scene's camera stands and looks is told anew, not what kind of camera it is.
    #[test]
    fn looking_elsewhere_keeps_lens_and_projection() {
        let window = ScreenWindow { min: Vec2::new(-2.0, -1.0), max: Vec2::new(2.0, 0.5) };
        let own = Camera {
            projection: Projection::Orthographic { height: 3.0 },
            aperture_radius: 0.1,
            screen_window: Some(window),
            mirrored: true,
            ..Camera::pinhole(Vec3::ZERO, Vec3::NEG_Z, Vec3::Y, 40.0)
        };
        let looking = |arguments: &str| {
            staged(Scene { camera: own.clone(), ..Scene::default() }, &["--look-at", arguments]).camera
        };
        let moved = looking("1,2,3,1,2,8");
        let expected =
            Camera { position: Vec3::new(1.0, 2.0, 3.0), forward: Vec3::Z, focus_distance: 5.0, ..own.clone() };
        assert_eq!(moved, expected);
        let wider = looking("1,2,3,1,2,8,70");
        let central = Projection::Perspective { vertical_fov_deg: 70.0 };
        assert_eq!(wider, Camera { projection: central, screen_window: None, ..expected });
    }
}
