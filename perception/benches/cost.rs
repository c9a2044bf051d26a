//! What the perception step costs, as a ratio to real 2-D Fourier transforms of the same picture in the same run.

use std::time::Instant;

use fechner_perception::allocation::{AllocationProblem, FINE_GAP, allocate};
use fechner_perception::guide::{GuideInputs, denoise};
use fechner_perception::{CastleCsf, GuideNoise, Plane, ThresholdInputs, Viewing, threshold_map};
use rayon::prelude::*;
use rustfft::num_complex::Complex32;

/// The least of a few runs, in seconds of all threads' time on the processors: unlike the clock on the wall it does
/// not count how long other programs had them. Where the system does not tell, the clock on the wall.
fn fastest(runs: usize, mut work: impl FnMut()) -> f64 {
    (0..runs)
        .map(|_| {
            let (start, before) = (Instant::now(), processor_seconds());
            work();
            match (before, processor_seconds()) {
                (Some(before), Some(after)) => after - before,
                _ => start.elapsed().as_secs_f64(),
            }
        })
        .fold(f64::INFINITY, f64::min)
}

/// Time on the processors of all threads of this process so far, from Linux's /proc.
fn processor_seconds() -> Option<f64> {
    let mut nanoseconds = 0.0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        let figures = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
        nanoseconds += figures.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    Some(1e-9 * nanoseconds)
}

/// A figure of this process in bytes, from Linux's /proc: `VmRSS` now, or `VmHWM`, the most so far.
fn memory(figure: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(figure)?.strip_prefix(':'))?;
    Some(1024.0 * line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()?)
}

/// Prints how much memory a threshold map takes at its worst, beyond the picture itself. The first thing the program
/// does, so that nothing given back earlier hides it.
fn report_memory() {
    let (width, height) = (1920, 1080);
    let picture = Plane::from_fn(width, height, |x, y| 50.0 + ((x * 31 + y * 17) % 13) as f32);
    let inputs = ThresholdInputs::clean(&picture);
    let before = memory("VmRSS");
    std::hint::black_box(threshold_map(&inputs, &Viewing::default(), &CastleCsf::default()).is_ok());
    match (before, memory("VmHWM")) {
        (Some(before), Some(most)) => {
            println!("{width}×{height}  threshold map: {:.0} bytes a pixel", (most - before) / (width * height) as f64);
        }
        _ => println!("memory: only Linux tells"),
    }
}

/// A plain real 2-D transform: rows, a transposition, columns; on all threads.
fn fourier_transform(width: usize, height: usize) -> impl FnMut() {
    let rows = realfft::RealFftPlanner::<f32>::new().plan_fft_forward(width);
    let columns = rustfft::FftPlanner::<f32>::new().plan_fft_forward(height);
    let picture = vec![1.0_f32; width * height];
    move || {
        let kept = width / 2 + 1;
        let mut by_row = vec![Complex32::default(); kept * height];
        by_row.par_chunks_mut(kept).zip(picture.par_chunks(width)).for_each_init(
            || (rows.make_input_vec(), rows.make_scratch_vec()),
            |(input, scratch), (bins, row)| {
                input.copy_from_slice(row);
                rows.process_with_scratch(input, bins, scratch).expect("lengths of the plan");
            },
        );
        let mut by_column = vec![Complex32::default(); kept * height];
        by_column.par_chunks_mut(8 * height).enumerate().for_each(|(strip, lines)| {
            for y in 0..height {
                for (line, value) in lines.chunks_exact_mut(height).zip(&by_row[y * kept + 8 * strip..]) {
                    line[y] = *value;
                }
            }
        });
        by_column.par_chunks_mut(height).for_each_init(
            || vec![Complex32::default(); columns.get_inplace_scratch_len()],
            |scratch, line| columns.process_with_scratch(line, scratch),
        );
        std::hint::black_box(&by_column);
    }
}

fn main() {
    report_memory();
    for (width, height) in [(512, 512), (1920, 1080)] {
        let picture = Plane::from_fn(width, height, |x, y| {
            60.0 + 40.0 * ((x as f32 * 0.11).sin() * (y as f32 * 0.07).cos()) + ((x * 31 + y * 17) % 13) as f32
        });
        let variance = Plane::from_fn(width, height, |x, y| 100.0 + ((x / 64 + y / 64) % 7) as f32 * 300.0);
        let cost = Plane::filled(width, height, 1.0);
        let viewing = Viewing::default();
        let csf = CastleCsf::default();
        let inputs = ThresholdInputs::clean(&picture);
        let map = threshold_map(&inputs, &viewing, &csf).expect("a good picture");
        let unit = fastest(7, fourier_transform(width, height));
        let report = |what: &str, seconds: f64| {
            println!(
                "{width}×{height}  {what:24} {:7.1} transforms  ({:.1} ms; one transform {:.2} ms)",
                seconds / unit,
                1e3 * seconds,
                1e3 * unit
            );
        };
        report("threshold map", fastest(5, || drop(threshold_map(&inputs, &viewing, &csf))));
        let noisy = ThresholdInputs { guide_noise: GuideNoise::BeforeDenoising(&variance), ..inputs };
        report("threshold map of a guide", fastest(5, || drop(threshold_map(&noisy, &viewing, &csf))));
        report("predicted visibility", fastest(5, || drop(map.predicted_visibility(&variance))));
        report("measured visibility", fastest(3, || drop(map.measured_visibility(&variance))));
        let problem = AllocationProblem {
            variance_per_sample: &variance,
            thresholds: &map,
            cost: &cost,
            tolerance: None,
            visibility: 1.0,
            min_samples: 16.0,
            max_samples: 1e6,
            enough_gap: FINE_GAP,
        };
        report("allocation", fastest(3, || drop(allocate(&problem))));
        if let Ok(found) = allocate(&problem) {
            // Multipliers are solved for on blocks of pixels, the gap is taken at every pixel: it bounds what both
            // leave.
            println!(
                "{width}×{height}  allocation costs at most {:.2} % more than the optimum, after {} updates",
                100.0 * found.gap,
                found.iterations
            );
        }
        let rgb: Vec<[f32; 3]> = picture.values().iter().map(|&value| [value; 3]).collect();
        let albedo = vec![[0.5; 3]; rgb.len()];
        let normal = vec![[0.0, 0.0, 1.0]; rgb.len()];
        let depth = vec![1.0; rgb.len()];
        let guide = GuideInputs {
            rgb: &rgb,
            variance: &variance,
            albedo: &albedo,
            normal: &normal,
            depth: &depth,
            width,
            height,
        };
        report("guide", fastest(3, || drop(denoise(&guide))));
    }
}
