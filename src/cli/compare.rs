//! `fechner compare`: can one picture, or one sequence of them, be told from another by eye?

mod sequence;

use super::animate::parse_rate;
use super::finished::{all_written, write_figures};
use super::kept_tone::shown_by;
use super::maps::check_map;
use super::picture::{Ground, InputPicture, Shape, Source};
use super::seeing::{SeeingArguments, operator_values};
use super::targets::check_kept;
use super::words::OF_THE_MODEL;
use anyhow::{Context, Result, bail};
use clap::Args;
use fechner::adaptive::settings::THRESHOLD;
use fechner::output::{self, false_colour};
use fechner_perception::difference::{Difference, colour_difference};
use fechner_perception::psychometric::detection_probability;
use fechner_perception::tone::FittedTone;
use fechner_perception::{ContrastSensitivity, Viewing, csf};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArguments {
    /// The picture that is right; with # for each digit of a frame's number, a sequence of them: a.####.exr. PNG and
    /// JPEG files hold sRGB, or PQ where they say so, which colour management brings to the display; 16 bits without
    /// a tag are the display's own codes.
    reference: PathBuf,
    /// The picture, or sequence, to be told from it.
    test: PathBuf,
    #[command(flatten)]
    seeing: SeeingArguments,
    /// Tone operator that shows scene-linear pictures, fitted to the reference, or to the test where only that is one
    /// [default: as that one was shown when it was rendered, if its file says so and the display is as bright and
    /// dark, else constant].
    #[arg(long, value_name = "NAME", value_parser = operator_values())]
    operator: Option<String>,
    /// Frames a second, of sequences. Beyond its ends a sequence is expected to go on as it is within a fifth of a
    /// second of them; flicker of three frames and more a period may be seen too well there.
    #[arg(long, value_name = "N", value_parser = parse_rate, allow_negative_numbers = true)]
    fps: Option<f64>,
    /// Motion of what a sequence shows, in pixels a frame, which the eye follows, smearing what is held; without it,
    /// it rests. Frames of `animate` have it.
    #[arg(long, value_name = "FILE.exr")]
    velocity: Option<PathBuf>,
    /// Write where the difference is seen, in the colours of render's map of visibility: blue below threshold, red to
    /// yellow above; for a sequence with # in the name.
    #[arg(long, value_name = "FILE.png")]
    map: Option<PathBuf>,
    /// Write the figures here.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What is said of every comparison.
#[derive(Serialize)]
struct Figures {
    reference: String,
    test: String,
    display: String,
    pixels_per_degree: f64,
    csf: &'static str,
    /// What brought the scene's light to the display, where the pictures hold such light.
    operator: Option<String>,
    #[serde(flatten)]
    seen: Seen,
}

impl Figures {
    fn of(
        arguments: &CompareArguments,
        viewing: &Viewing,
        csf: &'static str,
        operator: Option<String>,
        seen: Seen,
    ) -> Self {
        Self {
            reference: arguments.reference.display().to_string(),
            test: arguments.test.display().to_string(),
            display: viewing.display.name.clone(),
            pixels_per_degree: viewing.display.pixels_per_degree,
            csf,
            operator,
            seen,
        }
    }
}

/// What is seen of a difference.
#[derive(Clone, Copy, Serialize)]
struct Seen {
    worst_visibility: f64,
    mean_visibility: f64,
    visible_fraction: f64,
    detection_probability_worst: f64,
    is_visible: bool,
}

impl Seen {
    fn of(difference: &Difference) -> Self {
        Self {
            worst_visibility: difference.worst_visibility,
            mean_visibility: difference.visibility.mean(),
            visible_fraction: difference.visible_fraction,
            detection_probability_worst: detection_probability(difference.worst_visibility),
            is_visible: difference.is_visible(),
        }
    }
}

/// Exit status 0: the same to the eye; 1: told apart.
pub(super) fn run(arguments: &CompareArguments) -> Result<ExitCode> {
    let has_number = |path: &Path| path.file_name().is_some_and(|name| name.to_string_lossy().contains('#'));
    if has_number(&arguments.reference) || has_number(&arguments.test) {
        return sequence::run(arguments);
    }
    if arguments.fps.is_some() || arguments.velocity.is_some() {
        bail!("--fps and --velocity are for sequences, whose names have # for each digit of the frame's number");
    }
    check_targets(arguments)?;
    let compared = Compared::read(arguments)?;
    let difference = compared.difference()?;
    let figures = compared.figures(&difference);
    // First the answer: it may have taken long.
    tell(&figures);
    let map = arguments.map.as_ref().map_or(Ok(()), |path| {
        say!("{}: {}", path.display(), write_map(path, &difference)?);
        Ok(())
    });
    let json = write_figures(arguments.json.as_deref(), &figures);
    all_written([map, json])?;
    Ok(ExitCode::from(u8::from(figures.seen.is_visible)))
}

fn check_targets(arguments: &CompareArguments) -> Result<()> {
    let read = [
        ("the reference", Some(arguments.reference.as_path())),
        ("the test", Some(&arguments.test)),
        arguments.seeing.display_file(),
    ];
    check_kept(&read, &[("--map", arguments.map.as_deref()), ("--json", arguments.json.as_deref())])?;
    if let Some(map) = &arguments.map {
        check_map(map)?;
    }
    if let Some(json) = &arguments.json {
        output::check_writable(json)?;
    }
    Ok(())
}

/// Two pictures, and who looks at them in which way.
struct Compared<'a> {
    arguments: &'a CompareArguments,
    reference: InputPicture,
    test: InputPicture,
    viewing: Viewing,
    csf: Box<dyn ContrastSensitivity>,
    /// `None` where both are ready for the display.
    fitted: Option<Box<dyn FittedTone>>,
}

impl<'a> Compared<'a> {
    fn read(arguments: &'a CompareArguments) -> Result<Self> {
        let nits_per_unit = arguments.seeing.nits_per_unit;
        let mut reference = InputPicture::read(&arguments.reference, nits_per_unit)?;
        let mut test = InputPicture::read(&arguments.test, nits_per_unit)?;
        reference.be_a_pass_beside(&test);
        test.be_a_pass_beside(&reference);
        check_alike((&arguments.reference, reference.shape()), (&arguments.test, test.shape()))?;
        let pictures = [(arguments.reference.as_path(), &reference), (arguments.test.as_path(), &test)];
        for (path, picture) in pictures {
            picture.note_if_transparent(Source::single(path), "is judged before black and over white");
        }
        arguments.seeing.note_what_is_ready(arguments.operator.as_deref(), &pictures);
        arguments.seeing.note_area_of_colours();
        let viewing = reference
            .viewed(&arguments.seeing.viewing(&pictures)?)
            .with_context(|| arguments.reference.display().to_string())?;
        let csf = csf::by_name(&arguments.seeing.csf, &viewing)?;
        let fitted = shown_by(arguments.operator.as_deref(), &pictures, &viewing)?;
        Ok(Self { arguments, reference, test, viewing, csf, fitted })
    }

    fn difference(&self) -> Result<Difference> {
        let Self { reference, test, .. } = self;
        let difference = self.difference_over(Ground::Black)?;
        // What is dark hides its edges before black.
        if reference.is_transparent() || test.is_transparent() {
            return Ok(difference.or_worse(&self.difference_over(Ground::White)?));
        }
        Ok(difference)
    }

    fn difference_over(&self, ground: Ground) -> Result<Difference> {
        let (width, height) = self.reference.size();
        let [reference, test] = [&self.reference, &self.test]
            .map(|picture| picture.displayed_rgb_over(ground, self.fitted.as_deref(), &self.viewing));
        Ok(colour_difference(&reference, &test, width, height, &self.viewing, self.csf.as_ref())?)
    }

    fn figures(&self, difference: &Difference) -> Figures {
        let operator = self.fitted.as_ref().map(|fitted| fitted.describe());
        Figures::of(self.arguments, &self.viewing, self.csf.name(), operator, Seen::of(difference))
    }
}

fn tell(figures: &Figures) {
    answer!(
        "{}: worst visibility {:.2} (seen in a 1° patch with {:.1} %), {:.2} % of the picture above threshold, on \
         \"{}\" at {} pixels a degree ({OF_THE_MODEL})",
        if figures.seen.is_visible { "visible" } else { "the same to the eye" },
        figures.seen.worst_visibility,
        100.0 * figures.seen.detection_probability_worst,
        100.0 * figures.seen.visible_fraction,
        figures.display,
        figures.pixels_per_degree
    );
}

/// Refuses pictures that are not of one size and shape, which cannot be compared.
pub(super) fn check_alike(
    (reference_file, reference): (&Path, Shape),
    (test_file, test): (&Path, Shape),
) -> Result<()> {
    let (a, b) = (reference_file.display(), test_file.display());
    if reference.size != test.size {
        let ((w, h), (x, y)) = (reference.size, test.size);
        bail!("{a} has {w}x{h} pixels and {b} has {x}x{y}: only pictures of one size can be compared");
    }
    let [wide, wide_too] = [reference, test].map(|shape| shape.pixel_aspect_ratio);
    if (wide / wide_too - 1.0).abs() > 1e-3 {
        bail!(
            "{a} has pixels {wide} times as wide as high and {b} {wide_too} times: only pictures of one shape can be compared"
        );
    }
    Ok(())
}

/// Writes a map of visibility on the scale that a render's has, and returns what its colours mean.
fn write_map(path: &Path, seen: &Difference) -> Result<String> {
    let map = &seen.visibility;
    let colours = false_colour::visibility(map, THRESHOLD);
    output::write_codes_png(path, map.width() as u32, map.height() as u32, &colours.rgb8)?;
    Ok(colours.legend)
}
