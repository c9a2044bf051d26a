//! What is rendered and how: the arguments that `render` and `view` share, so that both make the same picture.

mod choices;
mod memory;
mod rules;

pub(super) use choices::{Quality, Size, parse_size};
pub(super) use memory::check_memory;
pub(super) use rules::visibility_limit;

use super::console;
use super::denoise::DenoiseChoice;
use super::importance;
use super::numbers::{
    parse_confidence, parse_finite, parse_positive, parse_radiance, parse_seconds, parse_seed, parse_stops, parse_unit,
    whole,
};
use super::seeing::{display_help, model_values, operator_values};
use super::targets::{Named, display_file};
use super::threads;
use anyhow::bail;
use choices::{AllocationChoice, FilterChoice, PruneChoice, SamplingChoice, SequenceChoice, check_crop, parse_crop};
use clap::Args;
use fechner::adaptive::glimpse::steady_glimpse;
use fechner::adaptive::settings::{DEFAULT_MAX_SAMPLES, LoopSettings, RivalRule};
use fechner::checkpoint::SettingsRecord;
use fechner::film::Film;
use fechner::integrator::{Crop, DEFAULT_MAX_DEPTH, Pruning, TraceSettings};
use fechner::output::rendered::Background;
use fechner::scene::hash::ContentHash;
use fechner::scene::{Scene, load};
use fechner_perception::model;
use fechner_perception::tone::{SavedTone, SceneLight};
use rules::{check_filter, check_rule, limits, settings_record};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// A scene and how to render it.
#[derive(Clone, Debug, Args)]
pub(super) struct JobArguments {
    /// Scene: .toml, .gltf, .glb, .obj, .ply, .pbrt or .xml (Mitsuba).
    scene: PathBuf,
    /// Picture size.
    #[arg(long, value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<Size>,
    /// Trace only this part of the picture, with the samples and, to a few per cent, the exposure it has in the
    /// whole. An EXR says where it lies.
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_crop, allow_hyphen_values = true)]
    crop: Option<Crop>,
    #[command(flatten)]
    staging: super::staging::Staging,
    /// Time in the scene's keyframes, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = parse_finite, allow_negative_numbers = true)]
    at: f64,

    /// Stop when the remaining noise is at most this visible: 1 is at threshold [default: the scene's, else 1; none
    /// for uniform sampling with --spp, --time or --plans].
    #[arg(long, value_name = "V", value_parser = parse_positive, allow_negative_numbers = true, help_heading = "Until")]
    visibility: Option<f64>,
    /// The same, by name.
    #[arg(long, value_enum, conflicts_with = "visibility", help_heading = "Until")]
    quality: Option<Quality>,
    /// Stop where the picture is no more visible than that with this confidence, in per cent, however often it was
    /// looked at. Visibilities are told as such upper bounds [default: they are estimates].
    #[arg(long, value_name = "PERCENT", value_parser = parse_confidence, allow_negative_numbers = true, help_heading = "Until")]
    confidence: Option<f64>,
    /// Stop after this many seconds of rendering, between plans; the first of them, 16 samples a pixel (4 of a denoised
    /// picture), is always traced.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds, allow_negative_numbers = true, help_heading = "Until")]
    time: Option<Duration>,
    /// Stop at this mean number of samples a pixel.
    #[arg(long, value_name = "N", value_parser = whole(1..=Film::MAX_SAMPLES_PER_PIXEL), allow_negative_numbers = true, help_heading = "Until")]
    spp: Option<u32>,
    /// Most samples of one pixel, at least 16.
    #[arg(long, value_name = "N", value_parser = whole(16..=Film::MAX_SAMPLES_PER_PIXEL), allow_negative_numbers = true, default_value_t = DEFAULT_MAX_SAMPLES, help_heading = "Until")]
    max_spp: u32,
    /// Stop after this many plans: repeats a render that ended by --time.
    #[arg(long, value_name = "N", value_parser = whole(1..=u32::MAX), allow_negative_numbers = true, help_heading = "Until")]
    plans: Option<u32>,

    /// How samples are spread.
    #[arg(long, value_enum, default_value = "adaptive", help_heading = "Sampling")]
    sampling: SamplingChoice,
    #[arg(long, value_name = "X", value_parser = parse_positive, allow_negative_numbers = true, help_heading = "Sampling", help = format!(
        "Threshold at which --sampling relative and variance stop [default: {}]",
        RivalRule::USUAL_THRESHOLD,
    ))]
    noise_threshold: Option<f64>,
    /// How --sampling adaptive finds counts [default: convex].
    #[arg(long, value_enum, help_heading = "Sampling")]
    allocation: Option<AllocationChoice>,
    /// Scale samples whose largest channel is above X scene units down to it. Darkens the picture where light is rare.
    #[arg(long, value_name = "X", value_parser = parse_radiance, allow_negative_numbers = true, help_heading = "Sampling")]
    clamp: Option<f32>,
    /// Leave to chance what light could not be seen beside what its path has found: fewer rays, more noise, no bias.
    #[arg(long, value_enum, value_name = "BY", help_heading = "Sampling")]
    prune: Option<PruneChoice>,
    /// Most scattering events of a path.
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = DEFAULT_MAX_DEPTH, help_heading = "Sampling")]
    max_depth: u32,
    /// Pixel filter.
    #[arg(long, value_enum, default_value = "gaussian", help_heading = "Sampling")]
    filter: FilterChoice,
    /// How the samples of neighbouring pixels relate.
    #[arg(long, value_enum, default_value = "per-pixel", help_heading = "Sampling")]
    sequence: SequenceChoice,
    /// Picture whose values multiply the thresholds: 1 changes nothing, 2 lets twice the noise stand, 0.5 half of it.
    /// EXR or HDR as it stands, PNG from 0 to 1; of the picture's shape. Visibilities are told under it.
    #[arg(long, value_name = "MAP", help_heading = "Sampling")]
    importance: Option<PathBuf>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = parse_seed, allow_negative_numbers = true, help_heading = "Sampling")]
    seed: u64,

    #[arg(long, value_name = "NAME|FILE", help = display_help("the scene's, else desktop"), help_heading = "Seeing")]
    display: Option<String>,
    /// Threshold model that drives the sampling; csf-unmasked and tvi-masked show what a part of csf-bands is worth.
    /// Only csf-bands can judge denoised pictures.
    #[arg(long, value_name = "NAME", value_parser = model_values(), default_value = model::DEFAULT, help_heading = "Seeing")]
    model: String,
    /// Area in deg² over which the eye sums contrast [default: the display's, else 1].
    #[arg(long, value_name = "DEG2", value_parser = parse_positive, allow_negative_numbers = true, help_heading = "Seeing")]
    csf_area: Option<f64>,
    /// Luminance in cd/m² of RGB (1, 1, 1), in place of the scene's.
    #[arg(long, value_name = "CD_M2", value_parser = parse_unit, allow_negative_numbers = true, help_heading = "Seeing")]
    nits_per_unit: Option<f64>,

    /// Take the noise out of the picture, and judge what can then be seen: by the built-in filter, or by Open Image
    /// Denoise where it is installed. An EXR keeps the raw mean beside it.
    #[arg(long, value_enum, default_value = "none", help_heading = "Picture")]
    denoise: DenoiseChoice,
    /// Leave out what surrounds the scene and write alpha: straight in PNG, premultiplied in EXR.
    #[arg(long, help_heading = "Picture")]
    transparent: bool,
    /// Tone operator [default: the scene's, else constant].
    #[arg(long, value_name = "NAME", value_parser = operator_values(), help_heading = "Picture")]
    operator: Option<String>,
    /// Exposure correction in stops [default: the scene's, else 0].
    #[arg(long, value_name = "STOPS", value_parser = parse_stops, allow_negative_numbers = true, help_heading = "Picture")]
    exposure: Option<f64>,

    /// Threads, 1 to 1023; the picture does not depend on it.
    #[arg(long, value_name = "N", value_parser = whole(1..=1023), allow_negative_numbers = true, help_heading = "Running")]
    threads: Option<u32>,
}

/// A scene that was loaded, and all that the arguments and it ask for.
pub(super) struct Prepared {
    pub(super) scene: Arc<Scene>,
    pub(super) trace: TraceSettings,
    pub(super) record: SettingsRecord,
    pub(super) settings: LoopSettings,
    /// How light the whole is, where the picture is cut out of it or leaves out what surrounds the scene.
    pub(super) whole: Option<SceneLight>,
}

impl JobArguments {
    /// The scene file.
    pub(super) fn scene_file(&self) -> &Path {
        &self.scene
    }

    /// The files that it names.
    pub(super) fn files(&self) -> [Named<'_>; 3] {
        [
            ("the scene", Some(&self.scene)),
            ("the importance map", self.importance.as_deref()),
            display_file(self.display.as_deref()),
        ]
    }

    /// The scene's name in reports.
    pub(super) fn scene_name(&self) -> String {
        self.scene.display().to_string()
    }

    /// The seed of all random numbers.
    pub(super) fn seed(&self) -> u64 {
        self.seed
    }

    /// Area in deg² over which the eye sums contrast, if one is asked for.
    pub(super) fn csf_area_deg2(&self) -> Option<f64> {
        self.csf_area
    }

    /// Whether it ends by something that does not ask what the picture looks like.
    fn has_other_limit(&self) -> bool {
        self.spp.is_some() || self.time.is_some() || self.plans.is_some()
    }

    /// What stands where no surface covers the picture.
    pub(super) fn background(&self) -> Background {
        if self.transparent { Background::Transparent } else { Background::Shown }
    }

    /// Threads of the render's own.
    pub(super) fn thread_pool(&self) -> anyhow::Result<rayon::ThreadPool> {
        threads::pool(self.threads, "render")
    }

    /// The scene as it is so many seconds after the time that is asked for.
    pub(super) fn scene_later(&self, seconds: f64) -> anyhow::Result<Scene> {
        self.load_at(self.at + seconds, None)
    }

    fn load_at(&self, seconds: f64, on_texture: Option<fn(usize, usize)>) -> anyhow::Result<Scene> {
        let options =
            load::LoadOptions { on_texture, ..self.staging.load_options(seconds, self.nits_per_unit, self.size) };
        let mut scene = load::load(&self.scene, &options)?;
        self.staging.apply(&mut scene)?;
        Ok(scene)
    }

    /// Loads the scene and reads everything else that is named. A part is shown as the whole is; and of a picture
    /// with alpha a glimpse knows what is there, where eyes would take the rest of a film for darkness.
    pub(super) fn prepare(&self) -> anyhow::Result<Prepared> {
        let mut prepared = self.prepare_samples()?;
        prepared.fit_to_whole(None);
        Ok(prepared)
    }

    /// The same before a part is shown as the whole is: for who takes samples alone, and who may know how the whole
    /// is shown.
    pub(super) fn prepare_samples(&self) -> anyhow::Result<Prepared> {
        let scene = self.load_at(self.at, Some(console::texture_decoded))?;
        for note in &scene.notes {
            say!("note: {note}");
        }
        let size = self.size.unwrap_or(Size { width: scene.film.width, height: scene.film.height });
        let trace = trace_settings(self, size, scene.nits_per_unit)?;
        let Crop { width, height, .. } = trace.film_area();
        check_memory(Size { width, height })?;
        let mut record = settings_record(self, &scene)?;
        let mut settings = record.loop_settings(limits(self, &scene, record.sampling), &trace)?;
        if let Some(path) = &self.importance {
            if !settings.sampling.is_by_sight() {
                bail!("--importance multiplies thresholds, and this --sampling has none: use adaptive or uniform");
            }
            let map = importance::read(path, (size.width as usize, size.height as usize), trace.film_area())?;
            record.importance = Some(ContentHash::of_values(map.values()));
            settings.importance = Some(map);
        }
        check_rule(self)?;
        check_filter(trace.filter, &settings)?;
        Ok(Prepared { scene: Arc::new(scene), trace, record, settings, whole: None })
    }
}

impl Prepared {
    /// Shows a part as the whole is shown, and what there is of a picture with alpha to eyes that would take the rest
    /// for darkness: as it was before where that is known, or by a glimpse of the whole.
    pub(super) fn fit_to_whole(&mut self, known: Option<SavedTone>) {
        let Self { scene, trace, record, settings, whole } = self;
        if trace.crop.is_some() || (trace.transparent && settings.operator.counts_darkness()) {
            match known {
                Some(known) => settings.fitted = Some(known),
                None => *whole = whole_light(scene, trace),
            }
            if let Some(light) = whole {
                settings.fit_to(light);
            }
        }
        record.fitted.clone_from(&settings.fitted);
    }
}

fn trace_settings(arguments: &JobArguments, size: Size, nits_per_unit: f64) -> anyhow::Result<TraceSettings> {
    Ok(TraceSettings {
        width: size.width,
        height: size.height,
        seed: arguments.seed,
        max_depth: arguments.max_depth,
        clamp: arguments.clamp,
        filter: arguments.filter.filter(),
        sequence: arguments.sequence.sequence(),
        crop: arguments.crop.map(|crop| check_crop(crop, size)).transpose()?,
        transparent: arguments.transparent,
        prune: arguments.prune.map(|PruneChoice::Tvi| Pruning { nits_per_unit }),
    })
}

/// How light all of the picture is, at its own size, as operators that count degrees need it: a part is shown as it
/// is shown in the whole. `None` for pictures too large to be looked at as a whole.
fn whole_light(scene: &Arc<Scene>, trace: &TraceSettings) -> Option<SceneLight> {
    /// 8192×4096, for which a third of a gigabyte is taken.
    const MAX_PIXELS: u64 = 1 << 25;
    if u64::from(trace.width) * u64::from(trace.height) > MAX_PIXELS {
        say!("note: tone is fitted to the film alone: {}x{} pixels are too many", trace.width, trace.height);
        return None;
    }
    // Films of other seeds must be shown alike, to be merged.
    let light = steady_glimpse(Arc::clone(scene), &TraceSettings { seed: 0, ..*trace }, scene.nits_per_unit);
    Some(SceneLight::stacked(&[&light], trace.width as usize, trace.height as usize))
}
