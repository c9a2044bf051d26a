//! The reference of a scene: a long uniform render with its halves and converged variances, kept by content.

use super::keep::{keep_pixels, kept_pixels};
use super::{BenchSettings, MAIN_COVERAGE, Subject};
use crate::adaptive::judge::{display_scale, judge};
use crate::adaptive::plan::uniform_plan;
use crate::adaptive::statistics::SampleStatistics;
use crate::film::{CHANNELS, Film};
use crate::integrator::PathTracer;
use crate::sampler::Half;
use crate::scene::ViewingDefaults;
use crate::scene::hash::content_hash;
use anyhow::Result;
use fechner_perception::Plane;
use fechner_perception::tone::{FittedTone, SceneLight, coloured};
use std::sync::OnceLock;

/// Seed of references, far from those of arms.
const REFERENCE_SEED: u64 = 0x5245_4645;
/// Most samples a pixel that a reference takes.
const MAX_SAMPLES: f64 = 16_384.0;

/// A long uniform render.
pub(crate) struct Reference {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Samples a pixel.
    pub(crate) spp: u32,
    /// Linear RGB in cd/m² of each half.
    pub(crate) halves: [Vec<[f32; 3]>; 2],
    /// Variance of one sample by channel, (cd/m²)².
    pub(crate) sample_variance: [Plane; CHANNELS],
    /// What stratification makes of it at about the samples that uniform sampling needs, by channel.
    pub(crate) low_discrepancy_factor: [Plane; CHANNELS],
    /// Samples a pixel that uniform sampling was found to need for v\* on 99 % of the picture, by its own prediction.
    pub(crate) uniform_spp: f64,
}

impl Reference {
    /// Renders the reference, or reads it back.
    pub(crate) fn cached(subject: &Subject, settings: &BenchSettings, say: &dyn Fn(&str)) -> Result<Self> {
        let key = subject.key(settings.reference_factor);
        let file = settings.output.join("references").join(format!("{}-{key}.f32", subject.file_name()));
        if let Some(values) = kept_pixels(&file, values_of(subject), say) {
            return Ok(Self::from_values(&values, subject));
        }
        let started = std::time::Instant::now();
        let reference = Self::render(subject, settings.reference_factor)?;
        say(&format!(
            "{}: reference of {} spp in {:.0} s; uniform sampling needs about {:.0} spp",
            subject.name,
            reference.spp,
            started.elapsed().as_secs_f64(),
            reference.uniform_spp
        ));
        keep_pixels(&file, &reference.to_values())?;
        Ok(reference)
    }

    fn render(subject: &Subject, factor: f64) -> Result<Self> {
        let tracer = subject.tracer(REFERENCE_SEED);
        let settings = subject.loop_settings()?;
        let mut film = Film::new(subject.size.0, subject.size.1);
        let mut spp = 16;
        // Stratification pays more the more samples there are: its factor is taken where uniform sampling would end.
        let uniform_spp = loop {
            trace_up_to(&tracer, &mut film, spp);
            let reached = judge(&film, &settings, 1.0)?.predicted.quantile(MAIN_COVERAGE) / subject.visibility;
            let needed = f64::from(spp) * reached * reached;
            if needed <= f64::from(spp) || f64::from(spp) >= MAX_SAMPLES {
                // A picture without noise needs none; no render takes fewer than one. As it is kept: a run
                // that goes on has the same.
                break f64::from(needed.max(1.0) as f32);
            }
            spp *= 2;
        };
        let factors = Self::display_factors(subject, &film)?;
        let wanted = (factor * uniform_spp).clamp(512.0, MAX_SAMPLES).log2().ceil().exp2() as u32;
        while spp < wanted {
            spp *= 2;
            trace_up_to(&tracer, &mut film, spp);
        }
        let nits = subject.scene.nits_per_unit;
        let rgb = |half: Half| film.half(half).iter().map(|p| p.mean.map(|v| (v * nits) as f32)).collect();
        let own_variance = |c: usize| {
            let [a, b] = Half::BOTH.map(|half| film.half(half));
            film.plane(|i| (0.5 * (a[i].sample_variance(c) + b[i].sample_variance(c)) * nits * nits) as f32)
        };
        Ok(Self {
            width: film.width() as usize,
            height: film.height() as usize,
            spp,
            halves: Half::BOTH.map(rgb),
            sample_variance: std::array::from_fn(own_variance),
            low_discrepancy_factor: factors,
            uniform_spp,
        })
    }

    /// What stratification makes of each pixel's displayed variance, by channel.
    fn display_factors(subject: &Subject, film: &Film) -> Result<[Plane; CHANNELS]> {
        let settings = subject.loop_settings()?;
        let estimate = film.estimate(settings.nits_per_unit);
        let light = SceneLight::of(settings.operator.as_ref(), film.width() as usize, &estimate.rgb_cd_m2);
        let fitted = settings.operator.fit(&light.guide(), &settings.viewing, None);
        let tone = coloured(fitted, film.width() as usize, &estimate.rgb_cd_m2);
        let scale = display_scale(film, &light, &estimate.rgb_cd_m2, tone.as_ref(), &settings);
        Ok(SampleStatistics::of(film, &scale).channels.map(|channel| channel.low_discrepancy_factor))
    }

    /// Mean of the halves, cd/m².
    pub(crate) fn rgb_cd_m2(&self) -> Vec<[f32; 3]> {
        let [a, b] = &self.halves;
        a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect()
    }

    /// Scene luminance, cd/m².
    pub(crate) fn luminance(&self) -> Plane {
        let rgb = self.rgb_cd_m2();
        Plane::from_fn(self.width, self.height, |x, y| {
            fechner_perception::photometry::luminance(rgb[y * self.width + x]).max(0.0)
        })
    }

    /// The operator of the arms, fitted to the reference.
    pub(crate) fn fit(&self, subject: &Subject) -> Result<Box<dyn FittedTone>> {
        let settings = subject.loop_settings()?;
        let rgb_cd_m2 = self.rgb_cd_m2();
        let light = SceneLight::of(settings.operator.as_ref(), self.width, &rgb_cd_m2);
        Ok(coloured(settings.operator.fit(&light.guide(), &subject.viewing, None), self.width, &rgb_cd_m2))
    }

    fn to_values(&self) -> Vec<f32> {
        let header = [self.spp as f32, self.uniform_spp as f32];
        let planes = self.sample_variance.iter().chain(&self.low_discrepancy_factor);
        header
            .into_iter()
            .chain(self.halves.iter().flatten().flatten().copied())
            .chain(planes.flat_map(|plane| plane.values().iter().copied()))
            .collect()
    }

    /// Of [`values_of`] a subject.
    fn from_values(values: &[f32], subject: &Subject) -> Self {
        let (width, height) = (subject.size.0 as usize, subject.size.1 as usize);
        let pixels = width * height;
        let (header, rest) = values.split_at(2);
        let (halves, planes) = rest.split_at(6 * pixels);
        let half = |h: usize| halves[3 * pixels * h..3 * pixels * (h + 1)].chunks_exact(3).map(|c| [c[0], c[1], c[2]]);
        let plane = |index: usize| Plane::from_fn(width, height, |x, y| planes[index * pixels + y * width + x]);
        Self {
            width,
            height,
            spp: header[0] as u32,
            uniform_spp: f64::from(header[1]),
            halves: [half(0).collect(), half(1).collect()],
            sample_variance: std::array::from_fn(plane),
            low_discrepancy_factor: std::array::from_fn(|c| plane(CHANNELS + c)),
        }
    }
}

/// Values of a reference's file: two counts, colours of both halves, two planes a channel.
fn values_of(subject: &Subject) -> usize {
    2 + subject.size.0 as usize * subject.size.1 as usize * (6 + 2 * CHANNELS)
}

/// Takes what a film lacks of `spp` samples in every pixel.
pub fn trace_up_to(tracer: &PathTracer, film: &mut Film, spp: u32) {
    loop {
        let plan = uniform_plan(film, spp);
        if plan.blocks.is_empty() {
            return;
        }
        tracer.trace(&plan, film, &|_| {});
    }
}

impl Subject {
    /// Hash of the scene's content and of everything else that a reference depends on, the program among it.
    pub(crate) fn key(&self, factor: f64) -> String {
        let (scene, program) = (content_hash(&self.scene), program());
        let ViewingDefaults { operator, exposure_stops, .. } = &self.scene.viewing;
        let text = format!(
            "{scene}|{program}|{:?}|{}|{factor}|{:?}|{operator:?}|{exposure_stops:?}",
            self.size, self.visibility, self.viewing
        );
        // The first 16 hexadecimal digits name a file well enough.
        blake3::hash(text.as_bytes()).to_hex()[..16].to_owned()
    }
}

/// Hash of the running program: what it renders and measures depends on all of its code, whose version stays the same
/// while it changes. Its version, where its file cannot be read. Takes 0.1 s once, for 160 MB with debug information.
fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let bytes = std::env::current_exe().and_then(std::fs::read);
        bytes.map_or_else(|_| env!("CARGO_PKG_VERSION").to_owned(), |bytes| blake3::hash(&bytes).to_hex().to_string())
    })
}
