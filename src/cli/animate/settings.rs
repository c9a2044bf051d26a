//! What the command line and the scene say about a shot as a whole.

use super::frames::Frames;
use super::{AnimateArguments, EyeChoice, SamplingChoice, VelocityChoice};
use crate::cli::job::{Quality, Size, check_memory, visibility_limit};
use crate::cli::seeing;
use anyhow::{Context, Result, bail};
use fechner::adaptive::settings::{Limits, Sampling};
use fechner::animate::ShotSettings;
use fechner::animate::eye::Eye;
use fechner::animate::gaze::GazeTrack;
use fechner::animate::velocity::VelocityOf;
use fechner::denoise::Denoiser;
use fechner::integrator::TraceSettings;
use fechner::read_file;
use fechner::scene::Scene;

/// Command line before scene before default.
pub(super) fn shot_settings(arguments: &AnimateArguments, scene: &Scene, shot: Frames) -> Result<ShotSettings> {
    let size = arguments.size.unwrap_or(Size { width: scene.film.width, height: scene.film.height });
    check_memory(size)?;
    let display = arguments.asked_presentation().of_scene(scene).display;
    let asked = arguments.visibility.or(arguments.quality.map(Quality::visibility));
    let sampling = match arguments.sampling {
        SamplingChoice::Adaptive => Sampling::Adaptive,
        SamplingChoice::Uniform => Sampling::Uniform,
    };
    let has_other_limit = arguments.spp.is_some() || arguments.time.is_some();
    Ok(ShotSettings {
        first: shot.first,
        last: shot.last,
        frames_per_second: arguments.fps,
        pausable: arguments.pausable,
        trace: TraceSettings::new(size.width, size.height, arguments.seed),
        sampling,
        limits: Limits {
            visibility: visibility_limit(asked, scene, sampling, has_other_limit),
            confidence: None,
            time: None,
            mean_samples: arguments.spp,
            max_samples: arguments.max_spp,
            plans: None,
            pilot_samples: arguments.denoise.pilot_samples(),
        },
        viewing: seeing::viewing_of_render(display, None)?,
        nits_per_unit: scene.nits_per_unit,
        adapted_to_cd_m2: arguments.adapted_to,
        gaze: gaze(arguments, size, shot)?,
        eye: eye(arguments)?,
        velocity_of: match arguments.velocity_of {
            VelocityChoice::Surface => VelocityOf::Surface,
            VelocityChoice::Image => VelocityOf::Image,
        },
        denoiser: arguments.denoise.kind().map(Denoiser::open).transpose()?,
    })
}

fn eye(arguments: &AnimateArguments) -> Result<Eye> {
    let followed = match arguments.eye {
        EyeChoice::None => return Ok(Eye::Rests),
        EyeChoice::Gaze if arguments.gaze.is_none() => bail!("--eye gaze: --gaze says where viewers look"),
        EyeChoice::Saliency if arguments.gaze.is_some() => {
            bail!("--eye saliency: --gaze says where viewers look; with it the eye is none, track or gaze")
        }
        EyeChoice::Gaze => Eye::FollowsGaze,
        EyeChoice::Saliency => Eye::FollowsSalient,
        EyeChoice::Track => Eye::FollowsAll,
    };
    if arguments.pausable {
        bail!("--eye: frames that may be paused are judged as stills, whatever the eye does (--pausable)");
    }
    Ok(followed)
}

/// Where the shot is looked at. A table of another shot's frames, or of none, is a slip.
fn gaze(arguments: &AnimateArguments, size: Size, shot: Frames) -> Result<Option<GazeTrack>> {
    let Some(path) = &arguments.gaze else { return Ok(None) };
    let table = read_file::text(path).with_context(|| path.display().to_string())?;
    let track = GazeTrack::parse(&table, (size.width, size.height)).with_context(|| path.display().to_string())?;
    let Frames { first, last } = shot;
    let found = (first..=last).filter(|&frame| !track.of_frame(frame).is_empty()).count();
    let count = (last - first + 1) as usize;
    if found == 0 {
        let its = match track.frames() {
            None => "has no line of any frame".to_owned(),
            Some((first, last)) => format!("has lines of frames {first} to {last} alone"),
        };
        bail!("--gaze: {} says nothing of frames {first} to {last}: it {its}; expected frame,x,y", path.display());
    }
    if found < count {
        say!("note: {} says of {found} of {count} frames where in the picture is looked.", path.display());
    }
    Ok(Some(track))
}
