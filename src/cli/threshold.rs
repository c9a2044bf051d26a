//! `fechner threshold`: how much noise may stay in a picture, and how visible the noise is that it has; in `made_of`
//! what a picture has of its halves, in `motion` how what it shows moves.

mod made_of;
mod motion;

use super::animate::parse_rate;
use super::channels;
use super::compare::check_alike;
use super::kept_tone::shown_by;
use super::picture::{BEFORE_BLACK, InputPicture, Source, note};
use super::seeing::{SeeingArguments, model_values, operator_values};
use super::targets::check_kept;
use super::words::OF_THE_MODEL;
use anyhow::{Context, Result, bail};
use clap::Args;
use fechner::exr_read::ExrImage;
use fechner::output::covered::Mapping;
use fechner::output::{self, Attribute, PIXEL_ASPECT_RATIO, Picture, PictureFormat, attribute, channel};
use fechner_perception::colour::chromatic_visibility;
use fechner_perception::display::Glare;
use fechner_perception::model::{self, ModelInputs, ThresholdModel};
use fechner_perception::photometry::luminance;
use fechner_perception::tone::acuity::BehindAcuity;
use fechner_perception::tone::{FittedTone, map_picture, map_pixels};
use fechner_perception::{ContrastSensitivity, GuideNoise, Plane, ThresholdInputs, Viewing, csf, threshold_map};
use made_of::MadeOf;
use motion::{Motion, check_knows_motion, velocity_in};
use std::path::{Path, PathBuf};

/// Arguments of `threshold`.
#[derive(Debug, Args)]
pub(super) struct ThresholdArguments {
    /// Picture of any renderer, taken to be without noise unless it is the mean of the halves' values: the noise of
    /// that is known by them, and csf-bands does not take it for detail that hides noise.
    input: PathBuf,
    /// EXR file to write: threshold.Y (standard error in display cd/m² at visibility 1), adaptation.Y and, with
    /// --halves, visibility.Y by the model's thresholds, and by those of colour where the model is csf-bands.
    #[arg(short, long, value_name = "FILE.exr")]
    output: PathBuf,
    /// Two renders with independent samples: half of their difference is the noise that is judged, by csf-bands in
    /// luminance and in colour (by castleCSF's, as at rest), of which the more visible counts; by any other model in
    /// luminance alone.
    #[arg(long, num_args = 2, value_names = ["A", "B"])]
    halves: Option<Vec<PathBuf>>,
    /// Motion in pixels a frame, for error that travels with what is shown. For the models csf-bands, yee and
    /// tvi-masked; the others know no motion.
    #[arg(long, value_name = "FILE.exr")]
    velocity: Option<PathBuf>,
    /// Frames a second of --velocity. Without it as its file says (frames of `animate` do), else the display's, which
    /// is 60 unless its own file says otherwise.
    #[arg(long, value_name = "N", value_parser = parse_rate, allow_negative_numbers = true, requires = "velocity")]
    fps: Option<f64>,
    /// Let the eye follow only what stands out in the picture and in its motion (Itti 1998, Yee 2001): what moves
    /// elsewhere is seen less well. Without it, it follows everything.
    #[arg(long, requires = "velocity")]
    saliency: bool,
    /// Add the veil that bright things cast inside the eye (CIE), for an observer of this age (25 if none is given).
    #[arg(long, value_name = "AGE", num_args = 0..=1, default_missing_value = "25", allow_negative_numbers = true)]
    glare: Option<f64>,
    /// Threshold model.
    #[arg(long, value_name = "NAME", value_parser = model_values(), default_value = model::DEFAULT)]
    model: String,
    /// Tone operator that shows scene-linear pictures, fitted to the input, or to the halves where only they are ones
    /// [default: as that one was shown when it was rendered, if its file says so and the display is as bright and
    /// dark, else constant].
    #[arg(long, value_name = "NAME", value_parser = operator_values())]
    operator: Option<String>,
    #[command(flatten)]
    seeing: SeeingArguments,
}

/// Writes the maps.
pub(super) fn run(arguments: &ThresholdArguments) -> Result<()> {
    check_targets(arguments)?;
    let asked = Asked::read(arguments)?;
    let found = asked.judge()?;
    output::write_exr(&arguments.output, &asked.picture_of(&found))?;
    answer!(
        "median threshold {:.3} cd/m² of standard error at visibility 1 ({OF_THE_MODEL})",
        median(&found.threshold_cd_m2)
    );
    if let Some(visibility) = &found.visibility {
        answer!("median visibility of the noise {:.2}", median(visibility));
    }
    Ok(())
}

fn check_targets(arguments: &ThresholdArguments) -> Result<()> {
    let halves = arguments.halves.iter().flatten().map(|half| ("a half", Some(half.as_path())));
    let others = [
        ("the picture", Some(arguments.input.as_path())),
        ("the motion", arguments.velocity.as_deref()),
        arguments.seeing.display_file(),
    ];
    check_kept(&halves.chain(others).collect::<Vec<_>>(), &[("-o", Some(&arguments.output))])?;
    if output::check_target(&arguments.output)? != PictureFormat::Exr {
        bail!("{}: threshold maps are data; end the name in .exr", arguments.output.display());
    }
    if arguments.velocity.is_some() {
        check_knows_motion(model::named(&arguments.model)?.as_ref())?;
    }
    Ok(())
}

/// Whether noise in colours is judged beside luminance: by the default model, the only one that has thresholds for it.
fn judges_colours(model: &dyn ThresholdModel) -> bool {
    model.name() == model::DEFAULT
}

/// A picture, and who looks at it in which way.
struct Asked {
    guide: InputPicture,
    halves: Option<[InputPicture; 2]>,
    /// What the guide has of the halves.
    made_of: MadeOf,
    /// The display by its own pixels, for the file.
    display: Option<(String, Attribute)>,
    /// By the guide's pixels.
    viewing: Viewing,
    model: Box<dyn ThresholdModel>,
    csf: BehindAcuity<Box<dyn ContrastSensitivity>>,
    /// `None` where the guide is ready for the display.
    fitted: Option<Box<dyn FittedTone>>,
    motion: Option<Motion>,
}

/// What is seen of the noise in it.
struct Found {
    threshold_cd_m2: Plane,
    adaptation_cd_m2: Plane,
    /// Visibility of the halves' noise.
    visibility: Option<Plane>,
}

impl Asked {
    fn read(arguments: &ThresholdArguments) -> Result<Self> {
        let guide = InputPicture::read(&arguments.input, arguments.seeing.nits_per_unit)?;
        let halves = read_halves(arguments, &guide)?;
        let names = std::iter::once(&arguments.input).chain(arguments.halves.iter().flatten());
        let pictures = std::iter::once(&guide).chain(halves.iter().flatten());
        let named: Vec<_> = names.map(PathBuf::as_path).zip(pictures).collect();
        named.iter().for_each(|(path, picture)| picture.note_if_transparent(Source::single(path), BEFORE_BLACK));
        arguments.seeing.note_what_is_ready(arguments.operator.as_deref(), &named);
        let velocity = arguments.velocity.as_deref();
        let velocity = velocity
            .map(|path| Ok::<_, anyhow::Error>((path, channels::read_motion(path, guide.size())?)))
            .transpose()?;
        let viewing = viewing(arguments, &named, velocity.as_ref().map(|(_, exr)| exr))?;
        let display = output::display_attribute(&viewing.display);
        let viewing = guide.viewed(&viewing).with_context(|| arguments.input.display().to_string())?;
        let model = model::named(&arguments.model)?;
        arguments.seeing.note_what_is_idle(model.as_ref(), halves.is_some() && judges_colours(model.as_ref()));
        let made_of = halves.as_ref().map_or(MadeOf::Else, |halves| MadeOf::of(&guide, halves));
        if let Some(told) = made_of.told().filter(|_| judges_colours(model.as_ref())) {
            note(&arguments.input, told);
        }
        let fitted = shown_by(arguments.operator.as_deref(), &named, &viewing)?;
        let acuity = fitted.as_ref().and_then(|fitted| fitted.acuity());
        let csf = BehindAcuity { csf: csf::by_name(&arguments.seeing.csf, &viewing)?, acuity };
        let motion = match &velocity {
            None => None,
            Some((path, exr)) => {
                let motion = velocity_in(path, exr, viewing.display.frames_per_second)?;
                Some(Motion::of(&motion, arguments.saliency, &guide, fitted.as_deref(), &viewing)?)
            }
        };
        Ok(Self { guide, halves, made_of, display, viewing, model, csf, fitted, motion })
    }

    /// Noise goes through the loss of acuity that the operator shows, and so does what masks it: by the
    /// contrast sensitivity, so that neither the guide nor the halves have it already, or, where the model asks
    /// for none, by the pictures.
    fn mapping(&self) -> Mapping {
        if self.model.knows_csf() { map_pixels } else { map_picture }
    }

    fn judge(&self) -> Result<Found> {
        let shown = self.guide.displayed(self.fitted.as_deref(), &self.viewing, self.mapping());
        let noise = self.halves.as_ref().map(|halves| self.noise_of(halves));
        // Of the mean of two, the variance is that of half their difference, however noisy each is.
        let of_mean = noise.as_ref().filter(|_| self.made_of == MadeOf::TheirMean);
        let own_variance = of_mean.map(|noise| noise.luminance.map(|light| light * light));
        let inputs = ModelInputs {
            display_luminance_cd_m2: &shown,
            guide_noise: own_variance.as_ref().map_or(GuideNoise::Clean, GuideNoise::White),
            image_velocity_deg_s: self.motion.as_ref().map(|motion| &motion.image_velocity_deg_s),
            attention: self.motion.as_ref().and_then(|motion| motion.attention.as_ref()),
            viewing: &self.viewing,
            csf: &self.csf,
        };
        let map = threshold_map(&ThresholdInputs::clean(&shown), &self.viewing, &self.csf)?;
        Ok(Found {
            threshold_cd_m2: self.model.allowed_standard_error_cd_m2(&inputs)?,
            adaptation_cd_m2: map.adaptation_cd_m2().clone(),
            visibility: noise.map(|noise| self.noise_visibility(&noise, &inputs)).transpose()?,
        })
    }

    fn noise_of(&self, halves: &[InputPicture; 2]) -> HalfDifference {
        let rgb = half_difference(&halves.each_ref().map(|half| self.displayed_rgb(half)));
        let (width, height) = self.guide.size();
        let luminance = Plane::from_fn(width, height, |x, y| luminance(rgb[y * width + x]));
        HalfDifference { rgb, luminance }
    }

    fn displayed_rgb(&self, picture: &InputPicture) -> Vec<[f32; 3]> {
        picture.displayed_rgb_by(self.fitted.as_deref(), &self.viewing, self.mapping())
    }

    /// How visible the noise of two halves is: by the model's own thresholds of luminance, and by those of colour where
    /// it knows them.
    fn noise_visibility(&self, noise: &HalfDifference, inputs: &ModelInputs<'_>) -> Result<Plane> {
        let of_luminance = self.model.measured_visibility(inputs, &noise.luminance)?;
        if !judges_colours(self.model.as_ref()) {
            return Ok(of_luminance);
        }
        let (size, guide) = (self.guide.size(), self.displayed_rgb(&self.guide));
        let own = if self.made_of == MadeOf::TheirMean { 1.0 } else { 0.0 };
        let of_colour = chromatic_visibility(&guide, &noise.rgb, size, own, &self.viewing, self.csf.acuity)?;
        Ok(of_luminance.combined(&of_colour, f32::max))
    }

    fn picture_of<'a>(&self, found: &'a Found) -> Picture<'a> {
        let (width, height) = self.guide.size();
        let mut picture = Picture::new(width as u32, height as u32);
        picture.push_f32(channel::THRESHOLD, found.threshold_cd_m2.values());
        picture.push_f32(channel::ADAPTATION, found.adaptation_cd_m2.values());
        if let Some(visibility) = &found.visibility {
            picture.push_f32(channel::VISIBILITY, visibility.values());
        }
        let text = |s: &str| Attribute::Text(s.to_owned());
        picture.push_attribute(attribute::MODEL, text(self.model.name()));
        if self.model.knows_csf() {
            picture.push_attribute(attribute::CSF, text(self.csf.name()));
        }
        let display = &self.viewing.display;
        picture.push_attribute(attribute::OBSERVER_DISPLAY, text(&display.name));
        picture.attributes.extend(self.display.clone());
        let ppd = display.pixels_per_degree as f32;
        picture.push_attribute(attribute::OBSERVER_PIXELS_PER_DEGREE, Attribute::Float(ppd));
        if self.motion.is_some() {
            let rate = display.frames_per_second as f32;
            picture.push_attribute("fechner.observer.frames_per_second", Attribute::Float(rate));
        }
        picture.push_attribute(PIXEL_ASPECT_RATIO, Attribute::Float(self.guide.pixel_aspect_ratio() as f32));
        picture
    }
}

/// With the glare and the rate of frames that are asked for or recorded.
fn viewing(
    arguments: &ThresholdArguments,
    named: &[(&Path, &InputPicture)],
    velocity: Option<&ExrImage>,
) -> Result<Viewing> {
    let mut viewing = arguments.seeing.viewing(named)?;
    if let Some(age_years) = arguments.glare {
        viewing.observer.glare = Glare::Cie { age_years };
        viewing.check().context("--glare")?;
    }
    if let Some(rate) = arguments.fps.or(velocity.and_then(ExrImage::frames_per_second)) {
        viewing.display.frames_per_second = rate;
    }
    Ok(viewing)
}

/// The two renders, of the guide's size.
fn read_halves(arguments: &ThresholdArguments, guide: &InputPicture) -> Result<Option<[InputPicture; 2]>> {
    let Some([a_path, b_path]) = arguments.halves.as_deref() else { return Ok(None) };
    let [a, b] = [a_path, b_path].map(|path| InputPicture::read(path, arguments.seeing.nits_per_unit));
    let halves = [a?, b?];
    if halves[0].stored_rgb() == halves[1].stored_rgb() {
        bail!(
            "--halves {} {}: equal in every value, which tells nothing of noise: one picture twice, two renders by one seed, or a \
             scene without noise; give two renders by different seeds",
            a_path.display(),
            b_path.display()
        );
    }
    for (path, half) in arguments.halves.iter().flatten().zip(&halves) {
        check_alike((&arguments.input, guide.shape()), (path, half.shape()))?;
    }
    Ok(Some(halves))
}

/// Half the difference that two halves make on the display, cd/m².
struct HalfDifference {
    rgb: Vec<[f32; 3]>,
    luminance: Plane,
}

/// (A − B)/2 of what the display shows, linear RGB in cd/m².
fn half_difference([a, b]: &[Vec<[f32; 3]>; 2]) -> Vec<[f32; 3]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] - b[c]))).collect()
}

fn median(plane: &Plane) -> f32 {
    let mut values = plane.values().to_vec();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f32::total_cmp).1
}
