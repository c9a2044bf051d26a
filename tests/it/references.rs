//! Scenes of others beside the pictures that another renderer made of them: the table in scenes/README.md.

use crate::load_assets::assets;
use crate::support::{loop_settings, trace_settings};
use fechner::adaptive::settings::{LoopSettings, Sampling};
use fechner::adaptive::{Quiet, render};
use fechner::integrator::{PathTracer, TraceSettings};
use fechner::sampler::PixelFilter;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{ColorInput, Distribution, Scene, Surface, Texels, Texture, TextureId, TextureLookup, Wrap};
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Regions along each side of the picture.
const REGIONS: u32 = 4;

struct Case {
    scene: &'static str,
    /// Pixels of the reference along a side of one of ours.
    divisor: u32,
    samples: u32,
    /// Scatterings that the reference's paths have at most: two fewer than the "maxdepth" of the file, which
    /// Tungsten's exporter writes as one more than its own count, of which the last does not look for lights. Seen in
    /// veach-mis, where the file says 3 and what no lamp reaches directly is exactly 0.
    max_depth: u32,
    /// What is known to differ between the file and its reference, undone.
    known: Option<Known>,
    /// How far the mean ratio may be from 1 beside three standard errors; none where that is not promised.
    within: Option<f64>,
}

#[derive(Clone, Copy)]
struct Known {
    what: &'static str,
    change: fn(&mut Scene),
}

impl Case {
    const fn plain(scene: &'static str, divisor: u32, samples: u32, max_depth: u32, within: Option<f64>) -> Self {
        Self { scene, divisor, samples, max_depth, known: None, within }
    }
}

/// Seen in the reference of veach-mis: the plates' fronts, which no lamp reaches, are exactly 0, so it was made with
/// one scattering event; the largest lamp (7.598) mirrored in the smoothest plate is (2.166, 1.416, 1.184), 0.297
/// times what the file's copper reflects in each channel; and the rough plates' highlights end where Beckmann's do,
/// not GGX's. The same scene in Mitsuba's form says "specular_reflectance" 0.3 and "beckmann".
const VEACH_MIS: Known = Known {
    what: "metals tinted 0.3, Beckmann",
    change: |scene| {
        for material in &mut scene.materials {
            if let Surface::Conductor { tint, roughness, .. } = &mut material.surface {
                *tint = ColorInput::constant(Vec3::splat(0.3));
                roughness.distribution = Distribution::Beckmann;
            }
        }
    },
};

/// Seen in the reference of veach-ajar: a floor of light and dark tiles where the file has one even metal. The same
/// scene in Mitsuba's form tints that metal by a checkerboard of 0.8 and 0.2, 20 × 80 over the floor, and makes the
/// door's handle Beckmann's.
const VEACH_AJAR: Known = Known {
    what: "floor tinted 0.8 and 0.2 in tiles",
    change: |scene| {
        let texture = TextureId(scene.textures.len() as u32);
        let [light, dark] = [[0.8, 0.8, 0.8, 1.0], [0.2, 0.2, 0.2, 1.0]];
        scene.textures.push(Texture {
            name: "tiles".to_owned(),
            width: 2,
            height: 2,
            texels: Texels::Floats(Arc::new(vec![light, dark, dark, light])),
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
            nearest: true,
        });
        let lookup = TextureLookup { scale: Vec2::new(20.0, 80.0), ..TextureLookup::plain(texture) };
        for material in &mut scene.materials {
            if let Surface::Conductor { tint, roughness, .. } = &mut material.surface {
                match material.name.as_str() {
                    "Floor" => *tint = ColorInput { factor: Vec3::ONE, texture: Some(lookup) },
                    "DoorHandle" => roughness.distribution = Distribution::Beckmann,
                    _ => {}
                }
            }
        }
    },
};

const CASES: &[Case] = &[
    Case::plain("scenes-pbrt/cornell-box/scene-v4.pbrt", 8, 512, 63, Some(0.02)),
    Case::plain("scenes-pbrt/veach-mis/scene-v4.pbrt", 5, 64, 1, None),
    Case { known: Some(VEACH_MIS), ..Case::plain("scenes-pbrt/veach-mis/scene-v4.pbrt", 5, 128, 1, Some(0.02)) },
    Case::plain("scenes-pbrt/veach-ajar/scene-v4.pbrt", 8, 64, 11, None),
    Case { known: Some(VEACH_AJAR), ..Case::plain("scenes-pbrt/veach-ajar/scene-v4.pbrt", 8, 256, 11, Some(0.02)) },
    Case::plain("scenes-pbrt/staircase2/scene-v4.pbrt", 8, 128, 63, Some(0.05)),
    Case::plain("scenes-pbrt/coffee/scene-v4.pbrt", 8, 256, 15, Some(0.05)),
    Case::plain("scenes-pbrt/water-caustic/scene-v4.pbrt", 8, 256, 7, None),
    Case::plain("scenes-mitsuba/living-room/scene.xml", 8, 128, 63, Some(0.05)),
];

/// Mean RGB of the blocks of `divisor`² pixels.
fn reduced(picture: &fechner::exr_read::ExrImage, divisor: u32) -> Vec<Vec3> {
    let channel = |name| picture.channel(name).expect("the reference has R, G and B");
    let channels = ["R", "G", "B"].map(channel);
    let (width, height) = (picture.width / divisor, picture.height / divisor);
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let mut sum = DVec3::ZERO;
            let mut count = 0.0;
            for i in 0..divisor * divisor {
                let (px, py) = (x * divisor + i % divisor, y * divisor + i / divisor);
                let at = (py * picture.width + px) as usize;
                let rgb = DVec3::from_array(channels.map(|c| f64::from(c[at])));
                // One pixel of water-caustic is infinite.
                if rgb.is_finite() {
                    sum += rgb;
                    count += 1.0;
                }
            }
            pixels.push((sum / count).as_vec3());
        }
    }
    pixels
}

fn luminance(rgb: Vec3) -> f64 {
    f64::from(rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722)))
}

/// Ours to the left of theirs, the reference's mean at 18 % grey, in target/references/NAME.png.
fn side_by_side(ours: &[[f32; 3]], theirs: &[Vec3], width: u32, name: &str) {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("target/references");
    std::fs::create_dir_all(&folder).unwrap();
    let scale = 0.18 * theirs.len() as f64 / theirs.iter().copied().map(luminance).sum::<f64>();
    let height = theirs.len() as u32 / width;
    image::RgbImage::from_fn(2 * width, height, |x, y| {
        let at = (y * width + x % width) as usize;
        let rgb = if x < width { Vec3::from_array(ours[at]) } else { theirs[at] };
        let shown = (rgb * scale as f32).clamp(Vec3::ZERO, Vec3::ONE).powf(1.0 / 2.2) * 255.0;
        image::Rgb(shown.to_array().map(|value| value.round() as u8))
    })
    .save(folder.join(format!("{name}.png")))
    .unwrap();
}

/// `cargo test --release -p fechner --test it references -- --ignored --nocapture [scene's name in FECHNER_SCENE]`
#[test]
#[ignore = "minutes of rendering"]
fn pictures_have_their_references_brightness() {
    let Some(folder) = assets() else { return };
    let only = std::env::var("FECHNER_SCENE").unwrap_or_default();
    println!("scene | triangles | load s | mean ratio | standard error | median region | lowest and highest region");
    for case in CASES.iter().filter(|case| case.scene.contains(&only)) {
        let path = folder.join(case.scene);
        let start = Instant::now();
        let mut scene = load(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let seconds = start.elapsed().as_secs_f64();
        let reference = fechner::exr_read::read_exr(&path.with_file_name("TungstenRender.exr")).unwrap();
        let (width, height) = (reference.width / case.divisor, reference.height / case.divisor);
        let triangles: usize = scene.instances.iter().map(|i| scene.meshes[i.mesh.0 as usize].triangles.len()).sum();
        // Values of the file, not cd/m².
        scene.nits_per_unit = 1.0;
        // A reference's pixels are reduced to means over ours, which is the box filter.
        let filter = PixelFilter::Box;
        let trace = TraceSettings { max_depth: case.max_depth, filter, ..trace_settings(width, height, 1) };
        if let Some(known) = &case.known {
            (known.change)(&mut scene);
        }
        let settings = LoopSettings { filter, ..loop_settings(1.0, Sampling::Uniform, None, Some(case.samples)) };
        let tracer = PathTracer::new(Arc::new(scene), trace);
        let rendered = render(&tracer, &settings, &Quiet).expect("the perception model takes the picture");
        let estimate = &rendered.judgement.estimate;
        let theirs = reduced(&reference, case.divisor);
        let name = case.scene.split('/').nth(1).unwrap_or("scene");
        let suffix = if case.known.is_some() { "-known" } else { "" };
        side_by_side(&estimate.rgb_cd_m2, &theirs, width, &format!("{name}{suffix}"));
        let mut of_regions = vec![[0.0; 2]; (REGIONS * REGIONS) as usize];
        let mut variance = 0.0;
        for (i, (ours, theirs)) in estimate.rgb_cd_m2.iter().zip(&theirs).enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let region = &mut of_regions[(y * REGIONS / height * REGIONS + x * REGIONS / width) as usize];
            region[0] += luminance(Vec3::from_array(*ours));
            region[1] += luminance(*theirs);
            variance += f64::from(estimate.variance_of_mean.values()[i]);
        }
        let total = of_regions.iter().fold([0.0; 2], |sum, region| [sum[0] + region[0], sum[1] + region[1]]);
        let mut ratios: Vec<f64> = of_regions.iter().filter(|r| r[1] > 0.0).map(|r| r[0] / r[1]).collect();
        println!("    by region: {}", ratios.iter().map(|r| format!("{r:.3}")).collect::<Vec<_>>().join(" "));
        ratios.sort_by(f64::total_cmp);
        let (ratio, standard_error) = (total[0] / total[1], variance.sqrt() / total[1]);
        println!(
            "{}{} | {triangles} | {seconds:.2} | {:.4} | {:.4} | {:.3} | {:.3} .. {:.3}",
            case.scene,
            case.known.map_or(String::new(), |known| format!(" ({})", known.what)),
            ratio,
            standard_error,
            ratios[ratios.len() / 2],
            ratios[0],
            ratios[ratios.len() - 1],
        );
        if let Some(within) = case.within {
            assert!((ratio - 1.0).abs() <= within + 3.0 * standard_error, "{}: {ratio}", case.scene);
        }
    }
}
