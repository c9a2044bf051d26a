//! The program as a user runs it: good runs leave whole files, bad input leaves one line and nothing else.

use crate::support::command::{self, cornell_box, fechner};
use std::path::Path;

fn assert_refused(arguments: &[&str], folder: &Path, fragments: &[&str]) {
    command::assert_refused(fechner().args(arguments).current_dir(folder), fragments);
}

/// Figures of one adaptive render of 24×16 pixels for visibility 8 that say the same in two ways.
fn assert_figures_agree(json: &serde_json::Value) {
    let figure = |key: &str| json[key].as_f64().unwrap_or_else(|| panic!("{key} is no number: {json}"));
    assert_eq!((figure("width"), figure("height"), figure("visibility_target")), (24.0, 16.0, 8.0));
    let (pixels, mean, most) = (24.0 * 16.0, figure("spp_mean"), figure("spp_max"));
    assert!((figure("samples_total") / (mean * pixels) - 1.0).abs() < 1e-9, "{json}");
    // Every pixel has its pilot of 8 + 8.
    assert!(most >= mean && mean >= 16.0, "{json}");
    assert!(figure("seconds_total") >= figure("seconds_perception") && figure("seconds_perception") > 0.0, "{json}");
    // It ended because 99.9 % of the pixels are at the target or below, so 99 % are.
    assert_eq!(json["stop_reason"], "visibility");
    assert!(
        figure("visibility_p99") <= figure("visibility_max") && figure("samples_total") <= figure("rays_total"),
        "{json}"
    );
    assert!(figure("visibility_p99") <= 8.0 && (0.0..=0.001).contains(&figure("fraction_visible")), "{json}");
    assert!((0.0..=1.0).contains(&figure("detection_probability_p99")), "{json}");
    assert!(figure("plans") >= 1.0 && figure("nonfinite_samples") == 0.0, "{json}");
    assert!(figure("peak_memory_bytes") > 1e6, "{json}");
}

#[test]
fn a_render_leaves_a_picture_and_its_figures() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell_box();
    let arguments = ["--size", "24x16", "--visibility", "8", "--json", "out.json", "-o"];
    for name in ["out.png", "out.exr"] {
        command::run(fechner().arg("render").arg(&scene).args(arguments).arg(name).current_dir(folder.path()));
    }
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out.json")).expect("written")).expect("JSON");
    for key in [
        "scene",
        "width",
        "height",
        "seed",
        "sampling",
        "model",
        "csf",
        "operator",
        "observer",
        "samples_total",
        "spp_mean",
        "spp_max",
        "seconds_total",
        "seconds_perception",
        "visibility_target",
        "visibility_p99",
        "fraction_visible",
        "detection_probability_p99",
        "nonfinite_samples",
        "peak_memory_bytes",
        "plans",
        "stop_reason",
    ] {
        assert!(!json[key].is_null(), "{key} is missing");
    }
    assert_eq!(json["seeds"].as_array().map(Vec::len), Some(1));
    assert_figures_agree(&json);
    let picture = image::open(folder.path().join("out.png")).expect("a PNG");
    assert_eq!((picture.width(), picture.height()), (24, 16));
    let exr = fechner::exr_read::read_exr(&folder.path().join("out.exr")).expect("an EXR");
    for channel in [
        "R",
        "G",
        "B",
        "albedo.R",
        "normal.X",
        "depth.Z",
        "id.Y",
        "samples.Y",
        "threshold.Y",
        "visibility.Y",
        "variance.Y",
    ] {
        assert!(exr.channel(channel).is_some(), "{channel} is missing");
    }
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .expect("readable")
        .map(|e| e.expect("an entry").file_name().into_string().expect("text"))
        .collect();
    left.sort();
    assert_eq!(left, ["out.exr", "out.json", "out.png"]);
    let info = fechner().args(["info", "out.exr"]).current_dir(folder.path()).output().expect("runs");
    assert!(String::from_utf8_lossy(&info.stdout).contains("visibility.Y"));
}

/// A render that ended by time is repeated by its number of plans, also where nothing but these ends it.
#[test]
fn plans_repeat_what_time_ended() {
    let folder = tempfile::tempdir().expect("a folder");
    // Asked for so little that it is reached at once: not what ends a uniform render of so many plans.
    let text = std::fs::read_to_string(cornell_box()).expect("there").replace("visibility = 2", "visibility = 50");
    std::fs::write(folder.path().join("easy.toml"), text).expect("written");
    for sampling in ["uniform", "budget"] {
        let rendered = |limit: [&str; 2]| {
            let arguments = ["render", "easy.toml", "--size", "24x24", "-o", "a.png", "--json", "a.json"];
            let arguments = [&arguments[..], &["--sampling", sampling], &limit[..]].concat();
            command::run(fechner().args(arguments).current_dir(folder.path()));
            let json: serde_json::Value =
                serde_json::from_slice(&std::fs::read(folder.path().join("a.json")).expect("written")).expect("JSON");
            (std::fs::read(folder.path().join("a.png")).expect("written"), json)
        };
        let (by_time, told) = rendered(["--time", "0.2"]);
        let plans = told["plans"].to_string();
        let (by_plans, again) = rendered(["--plans", &plans]);
        assert_eq!((&again["plans"], &again["stop_reason"]), (&told["plans"], &"plans".into()), "{sampling}");
        assert!(by_time == by_plans, "{sampling}: {plans} plans make another picture");
    }
}

/// Times beyond what clocks count are as good as none.
#[test]
fn endless_times_are_no_limit() {
    let folder = tempfile::tempdir().expect("a folder");
    command::run(
        fechner()
            .arg("render")
            .arg(cornell_box())
            .args(["--size", "16x16", "--spp", "4", "-o", "a.png", "--time", "1e20", "--checkpoint", "a.film"])
            .args(["--checkpoint-every", "1e20"])
            .current_dir(folder.path()),
    );
}

/// The memory that a crop needs is its own, not the whole picture's.
#[test]
fn a_crop_of_a_huge_picture_fits_into_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    command::run(
        fechner()
            .arg("render")
            .arg(cornell_box())
            .args(["--size", "40000x40000", "--crop", "20000,20000,16,16", "--spp", "4", "-o", "a.png"])
            .current_dir(folder.path()),
    );
    assert_eq!(image::open(folder.path().join("a.png")).expect("a picture").width(), 16);
}

/// A dark corner is as dark as it is in the whole picture: fitted to itself it would come out as light as any other.
#[test]
fn a_crop_is_exposed_as_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let render = |name: &str, more: &[&str]| {
        command::run(
            fechner()
                .arg("render")
                .arg(cornell_box())
                .args(["--size", "96x96", "--sampling", "uniform", "--spp", "16", "-o", name])
                .args(more)
                .current_dir(folder.path()),
        );
        image::open(folder.path().join(name)).expect("a picture").into_rgb8()
    };
    let whole = render("whole.png", &[]);
    let mean = |picture: image::RgbImage| {
        picture.pixels().flat_map(|pixel| pixel.0).map(f64::from).sum::<f64>()
            / f64::from(3 * picture.width() * picture.height())
    };
    for (x, y) in [(10, 70), (40, 0)] {
        let part = mean(render("part.png", &["--crop", &format!("{x},{y},24,24")]));
        let of_whole = mean(image::imageops::crop_imm(&whole, x, y, 24, 24).to_image());
        assert!((part / of_whole - 1.0).abs() < 0.02, "at {x}, {y}: {part}, in the whole {of_whole}");
    }
}

/// The picture of a film has alpha where the film's render would have, and figures do not take the place of a film.
#[test]
fn merging_keeps_alpha_and_films() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| fechner().args(arguments).current_dir(folder.path()).output().expect("runs");
    let dark = cornell_box();
    let dark = dark.to_str().expect("text");
    let render =
        ["render", dark, "--size", "16x16", "--spp", "4", "-o", "a.exr", "--transparent", "--checkpoint", "a.film"];
    command::run(fechner().args(render).current_dir(folder.path()));
    let film = std::fs::read(folder.path().join("a.film")).expect("a film");
    std::fs::write(folder.path().join("film.exr"), &film).expect("written");
    for (arguments, option) in [
        (["merge", "a.film", "-o", "b.exr", "--json", "a.film"].as_slice(), "--json"),
        (&["merge", "film.exr", "-o", "film.exr"], "-o"),
    ] {
        let refused = run(arguments);
        let message = String::from_utf8_lossy(&refused.stderr);
        let expected = format!("{option} would replace a film that is read");
        assert!(refused.status.code() == Some(2) && message.contains(&expected), "{message}");
    }
    let refused = run(&["merge", "a.film", "-o", "b.exr", "--json", "b.exr"]);
    assert_eq!(refused.status.code(), Some(2), "{}", String::from_utf8_lossy(&refused.stderr));
    command::run(fechner().args(["merge", "a.film", "-o", "b.exr"]).current_dir(folder.path()));
    let [rendered, merged] =
        ["a.exr", "b.exr"].map(|name| fechner::exr_read::read_exr(&folder.path().join(name)).expect("an EXR"));
    assert!(merged.channel("A").is_some(), "no alpha");
    assert_eq!(rendered.channel("A"), merged.channel("A"));
}

/// Two samples a pixel say how much noise there is, and one says nothing: it is not called fine.
#[test]
fn a_render_of_few_samples_makes_no_claim() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell_box();
    let told = |spp: &str, film: &str, more: &[&str]| {
        let arguments = ["--size", "24x24", "--json", "out.json", "-o", "out.png", "--checkpoint", film, "--spp", spp];
        let run =
            command::run(fechner().arg("render").arg(&scene).args(arguments).args(more).current_dir(folder.path()));
        let json = std::fs::read(folder.path().join("out.json")).expect("written");
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        (json, String::from_utf8_lossy(&run.stderr).into_owned())
    };
    let (two, _) = told("2", "two.film", &[]);
    assert!(two["visibility_p99"].as_f64() > Some(1.0), "{}", two["visibility_p99"]);
    for (film, more) in [("raw.film", &[][..]), ("denoised.film", &["--denoise", "builtin"][..])] {
        let (one, message) = told("1", film, more);
        for key in ["visibility_p99", "fraction_visible", "detection_probability_p99", "measured_over_predicted"] {
            assert!(one[key].is_null(), "{key}: {}", one[key]);
        }
        assert!(message.contains("too few samples to tell") && !message.contains("visibility 0"), "{message}");
        assert_eq!(one["outlier_pixels"], 0);
        let merge = ["merge", film, "-o", "merged.png"];
        let merged = command::run(fechner().args(merge).current_dir(folder.path()));
        let message = String::from_utf8_lossy(&merged.stderr);
        assert!(!message.contains("the target is reached"), "{message}");
    }
}

/// Rules that do not look at what is seen aim at no visibility, whatever the scene says (cornell-box.toml: 2).
#[test]
fn rivals_aim_at_no_visibility() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell_box();
    for rule in ["relative", "variance", "budget"] {
        let film = format!("{rule}.film");
        let arguments = ["--size", "24x24", "--spp", "18", "--sampling", rule, "--json", "a.json", "-o", "a.exr"];
        let mut command = fechner();
        command.arg("render").arg(&scene).args(arguments).args(["--checkpoint", &film]);
        let run = command::run(command.current_dir(folder.path()));
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(said.contains("is above visibility 1"), "{said}");
        assert!(!said.contains("target"), "{said}");
        let json = std::fs::read(folder.path().join("a.json")).expect("written");
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        assert!(json["visibility_target"].is_null() && json["fraction_visible"].is_number(), "{json}");
        for (file, fragment, is_there) in [("a.exr", "visibility_target", false), (&film, "none aimed at", true)] {
            let info = fechner().args(["info", file]).current_dir(folder.path()).output().expect("runs");
            let info = String::from_utf8_lossy(&info.stdout);
            assert_eq!(info.contains(fragment), is_there, "{info}");
        }
    }
}

#[test]
fn bad_arguments_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let cornell = cornell_box();
    let cornell = cornell.to_str().expect("text");
    let at = folder.path();
    assert_refused(&["render", "missing.toml", "-o", "a.png"], at, &["missing.toml"]);
    assert_refused(&["render", ".", "-o", "a.png"], at, &["is a directory"]);
    assert_refused(&["render", cornell], at, &["arguments were not provided: --output <FILE>"]);
    assert_refused(
        &["render", cornell, "-o", "a.png", "--sise", "8x8"],
        at,
        &["unexpected argument '--sise' found; tip:"],
    );
    assert_refused(&["render", cornell, "-o", "a.gif"], at, &["a.gif", ".exr"]);
    assert_refused(&["render", cornell, "-o", "no/such/a.png"], at, &["no/such"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--size", "0x10"], at, &["0x10", "WIDTHxHEIGHT"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--size", "-3x4"], at, &["\"-3x4\" is not a size"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--size", "40000x40000"], at, &["memory", "--size"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--visibility", "-1"], at, &["above 0"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--sampling", "budget"], at, &["--spp"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--model", "guess"], at, &["guess", "csf-bands"]);
    let blind = ["render", cornell, "-o", "a.png", "--denoise", "builtin", "--model", "tvi"];
    assert_refused(&blind, at, &["--denoise", "--model csf-bands", "tvi"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--display", "cinemax"], at, &["cinemax", "cinema"]);
    assert_refused(&["render", cornell, "-o", "a.png", "--operator", "magic"], at, &["magic", "constant"]);
    let render = |more: &[&'static str], fragments: &[&str]| {
        assert_refused(&[&["render", cornell, "-o", "a.png", "--size", "16x16"], more].concat(), at, fragments);
    };
    render(&["--noise-threshold", "0.1"], &["--noise-threshold", "--sampling relative"]);
    for rule in ["relative", "variance", "budget"] {
        render(
            &["--sampling", rule, "--spp", "16", "--visibility", "2"],
            &["--visibility and --quality", "leave them out"],
        );
        render(&["--sampling", rule, "--spp", "16", "--quality", "good"], &["--visibility and --quality"]);
    }
    render(&["--sampling", "budget", "--noise-threshold", "0.1", "--spp", "16"], &["--noise-threshold"]);
    render(&["--confidence", "0.95"], &["\"0.95\" is not a confidence from 50 to 99.99 per cent"]);
    for (other, said) in [
        (&["--sampling", "relative"][..], "use adaptive or uniform"),
        (&["--model", "tvi"], "tvi pools no pixels"),
        (&["--denoise", "builtin"], "is for raw pictures"),
        (&["--transparent"], "leave out --transparent"),
        (&["--sequence", "z-order"], "use per-pixel"),
    ] {
        render(&[&["--confidence", "95"], other].concat(), &["--confidence", said]);
    }
    render(&["--seed", "-1"], &["invalid value '-1' for '--seed <N>'"]);
    render(&["--crop", "-1,0,4,4"], &["\"-1,0,4,4\" is not a crop"]);
    render(&["--no-such-thing"], &["unexpected argument '--no-such-thing' found\n"]);
    render(&["--sampling", "uniform", "--allocation", "local"], &["--allocation", "--sampling adaptive"]);
    render(&["--json", "a.png"], &["a.png: -o and --json name the same file"]);
    render(&["--checkpoint", "./a.png"], &["-o and --checkpoint name the same file"]);
    render(&["--checkpoint", "a.json", "--json", "a.json"], &["--json and --checkpoint name the same file"]);
    let bench = |more: &[&'static str], fragments: &[&str]| {
        assert_refused(&[&["bench", cornell], more].concat(), at, fragments);
    };
    bench(&["--denoise", "builtin"], &["--denoise is for --suite denoise and animation"]);
    bench(&["--suite", "full", "--law-only"], &["--law-only is for --suite denoise"]);
    bench(&["--fps", "24"], &["--fps is for --suite animation"]);
    for suite in ["denoise", "animation"] {
        bench(&["--suite", suite, "--bound"], &["--bound is for --suite quick and full"]);
        bench(&["--suite", suite, "--arms", "tvi"], &["--arms is for --suite quick and full"]);
    }
    bench(&["--suite", "animation", "--seeds", "2"], &["--seeds is for"]);
    bench(&["--bound", "--arms", "tvi"], &["--arms is not for --bound"]);
    bench(&["--bound", "--seeds", "2"], &["--seeds is not for --bound"]);
    for more in [&["--bound"][..], &["--suite", "denoise", "--denoise", "builtin"], &["--suite", "animation"], &[]] {
        bench(&[&["missing.toml"], more].concat(), &["missing.toml: no such file"]);
    }
    assert_refused(&["bench", cornell, cornell], at, &["named twice"]);
    assert_refused(&["info", "missing.exr"], at, &["missing.exr"]);
    assert_eq!(std::fs::read_dir(at).expect("readable").count(), 0, "something was written");
}

/// Two renders of different seeds at few samples differ visibly, a picture does not differ from itself, and the noise
/// of the pair is above threshold; a file without a unit is refused.
#[test]
fn pictures_are_compared_and_thresholds_mapped() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let scene = cornell_box();
    for seed in ["1", "2"] {
        let name = format!("{seed}.exr");
        command::run(
            fechner()
                .arg("render")
                .arg(&scene)
                .args(["--size", "64x48", "--sampling", "uniform", "--spp", "16", "--seed", seed, "-o", &name])
                .current_dir(at),
        );
    }
    let run = |arguments: &[&str]| fechner().args(arguments).current_dir(at).output().expect("runs");
    let same = run(&["compare", "1.exr", "1.exr"]);
    assert_eq!(same.status.code(), Some(0), "{}", String::from_utf8_lossy(&same.stderr));
    let differ = run(&["compare", "1.exr", "2.exr", "--map", "map.png", "--json", "figures.json"]);
    assert_eq!(differ.status.code(), Some(1), "{}", String::from_utf8_lossy(&differ.stderr));
    let map = image::open(at.join("map.png")).expect("a map");
    assert_eq!((map.width(), map.height()), (64, 48));
    // On the scale of a render's map of visibility, which is told.
    let said = String::from_utf8_lossy(&differ.stderr);
    assert!(said.contains("map.png: blue: at most 1; "), "{said}");
    let figures: serde_json::Value =
        serde_json::from_slice(&std::fs::read(at.join("figures.json")).expect("written")).expect("JSON");
    assert!(figures["worst_visibility"].as_f64().expect("a number") > 1.0);
    let threshold = run(&["threshold", "1.exr", "--halves", "1.exr", "2.exr", "-o", "threshold.exr"]);
    assert_eq!(threshold.status.code(), Some(0), "{}", String::from_utf8_lossy(&threshold.stderr));
    let maps = fechner::exr_read::read_exr(&at.join("threshold.exr")).expect("maps");
    assert!(maps.channel("threshold.Y").expect("thresholds").iter().all(|&t| t > 0.0 && t.is_finite()));
    assert!(maps.channel("visibility.Y").expect("visibility").iter().any(|&v| v > 1.0));

    let mut unitless = fechner::output::Picture::new(2, 2);
    for name in ["R", "G", "B"] {
        unitless.push_f32(name, vec![0.5; 4]);
    }
    fechner::output::write_exr(&at.join("unitless.exr"), &unitless).expect("written");
    assert_refused(&["compare", "unitless.exr", "unitless.exr"], at, &["unitless.exr", "--nits-per-unit"]);
    assert_refused(&["compare", "1.exr", "unitless.exr", "--nits-per-unit", "100"], at, &["64x48", "2x2"]);
    assert_refused(&["threshold", "1.exr", "-o", "a.exr", "--model", "guess"], at, &["guess", "csf-bands"]);
}

/// What is said of the noise of two halves is said by the thresholds of the model and the motion that were asked for.
#[test]
fn noise_is_judged_by_the_model_and_the_motion_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let write = |name: &str, channels: &[&str], value: &dyn Fn(u32) -> f32| {
        let mut picture = fechner::output::Picture::new(48, 40);
        let values: Vec<f32> = (0..48 * 40).map(value).collect();
        channels.iter().for_each(|channel| picture.push_f32(channel, values.clone()));
        fechner::output::write_exr(&at.join(name), &picture).expect("written");
    };
    // Tiles that stand out a little, and noise that does not repeat.
    let tiles = |i: u32| if (i % 48 / 4 + i / 192).is_multiple_of(2) { 20.0 } else { 40.0 };
    let noise = |i: u32| (i.wrapping_mul(2_654_435_761) >> 24) as f32 / 64.0 - 2.0;
    write("guide.exr", &["R", "G", "B"], &tiles);
    write("a.exr", &["R", "G", "B"], &|i| tiles(i) + noise(i));
    write("b.exr", &["R", "G", "B"], &|i| tiles(i) - noise(i));
    write("motion.exr", &["velocity.X", "velocity.Y"], &|i| if i % 48 < 24 { 12.0 } else { 4.0 });
    let mean = |more: &[&str], channel: &str| {
        let common = ["threshold", "guide.exr", "--halves", "a.exr", "b.exr", "--nits-per-unit", "1", "-o", "out.exr"];
        let output = command::run(fechner().args(common).args(more).current_dir(at));
        let maps = fechner::exr_read::read_exr(&at.join("out.exr")).expect("maps");
        let values = maps.channel(channel).expect("a map");
        (values.iter().sum::<f32>() / values.len() as f32, String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let visibility = |more: &[&str]| mean(more, "visibility.Y").0;
    let threshold = |more: &[&str]| mean(more, "threshold.Y").0;
    let still = visibility(&[]);
    let by_intensity = visibility(&["--model", "tvi"]);
    assert!((by_intensity / still).ln().abs() > 0.2, "{still} by bands, {by_intensity} by intensity alone");
    let moving = ["--velocity", "motion.exr"];
    let moved = visibility(&moving);
    // 0.92 times on these tiles: 0.630 and 0.578.
    assert!(moved < 0.95 * still, "{still} at rest, {moved} in motion");
    // Slower frames are slower motion.
    let (slow, said) = mean(&["--velocity", "motion.exr", "--fps", "10"], "visibility.Y");
    assert!(slow > 1.05 * moved && said.contains("at 10 frames a second"), "{slow} and {moved}: {said}");
    assert!(mean(&moving, "threshold.Y").1.contains("at 60 frames a second"), "the rate is not said");
    // An eye that does not follow everything sees less of what moves.
    let yee = ["--model", "yee", "--velocity", "motion.exr", "--fps", "10"];
    let (followed, salient) = (threshold(&yee), threshold(&[&yee[..], &["--saliency"]].concat()));
    // 1.008 times on a picture as small as this: 1.9178 and 1.9020.
    assert!(salient > 1.005 * followed, "{followed} followed, {salient} by saliency");
    for (more, expected) in [
        (
            &["--velocity", "motion.exr", "--model", "tvi"][..],
            &["tvi knows no motion", "csf-bands, yee, tvi-masked"][..],
        ),
        (&["--fps", "24"], &["--velocity"]),
        (&["--saliency"], &["--velocity"]),
    ] {
        let common = ["threshold", "guide.exr", "--nits-per-unit", "1", "-o", "none.exr"];
        assert_refused(&[&common[..], more].concat(), at, expected);
        assert!(!at.join("none.exr").exists());
    }
}

/// An EXR with pixels twice as wide as high has thresholds as on a display that says so, and its ratio goes on into
/// what is written.
#[test]
fn oblong_pixels_of_a_file_are_honoured() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (name, ratio) in [("oblong.exr", 2.0), ("square.exr", 1.0)] {
        let mut picture = fechner::output::Picture::new(48, 40);
        let values: Vec<f32> =
            (0..48 * 40).map(|i| if (i % 48 / 6 + i / 480) % 2 == 0 { 20.0 } else { 60.0 }).collect();
        ["R", "G", "B"].iter().for_each(|channel| picture.push_f32(channel, values.clone()));
        picture.push_attribute("pixelAspectRatio", fechner::output::Attribute::Float(ratio));
        fechner::output::write_exr(&at.join(name), &picture).expect("written");
    }
    let display = "name = \"oblong\"\npixels_per_degree = 30.0\npixel_aspect_ratio = 2.0\nwhite_cd_m2 = 200.0\n\
                   black_cd_m2 = 0.2\nambient_cd_m2 = 0.0\neotf = \"srgb\"\n";
    std::fs::write(at.join("oblong.toml"), display).expect("written");
    let thresholds = |input: &str, display: &str| {
        let arguments = ["threshold", input, "--nits-per-unit", "1", "--display", display, "-o", "out.exr"];
        command::run(fechner().args(arguments).current_dir(at));
        fechner::exr_read::read_exr(&at.join("out.exr")).expect("maps")
    };
    let of_file = thresholds("oblong.exr", "desktop");
    let of_display = thresholds("square.exr", "oblong.toml");
    assert_eq!((of_file.pixel_aspect_ratio, of_display.pixel_aspect_ratio), (2.0, 1.0));
    assert_eq!(of_file.channel("threshold.Y"), of_display.channel("threshold.Y"));
    assert_ne!(of_file.channel("threshold.Y"), thresholds("square.exr", "desktop").channel("threshold.Y"));
    let told = ["compare", "oblong.exr", "square.exr", "--nits-per-unit", "1"];
    assert_refused(&told, at, &["oblong.exr", "2 times as wide as high", "square.exr"]);
    let shown = ["tonemap", "oblong.exr", "--nits-per-unit", "1", "--operator", "ptyg", "-o", "shown.exr"];
    command::run(fechner().args(shown).current_dir(at));
    let shown = fechner::exr_read::read_exr(&at.join("shown.exr")).expect("a picture");
    assert_eq!(shown.pixel_aspect_ratio, 2.0);
    let Some(fechner::output::Attribute::Text(fit)) = shown.attribute("fechner.tone") else { panic!("no fit") };
    let fit: fechner_perception::tone::SavedTone = serde_json::from_str(fit).expect("a fit");
    let black = shown.channel("R").expect("red").iter().copied().fold(f32::INFINITY, f32::min);
    let emitted_cd_m2 =
        fechner_perception::Display::default().emitted_cd_m2(fit.restore().map_rgb([20.0; 3])[0].into());
    let again = (emitted_cd_m2 / 200.0) as f32;
    assert!((again - black).abs() < 1e-6, "the saved fit gives {again}, the picture has {black}");
}

/// Options that contradict each other or the picture are told apart before anything is traced.
#[test]
fn impossible_pictures_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = cornell_box();
    let scene = scene.to_str().expect("a plain path");
    let with = |extra: &[&'static str]| {
        let mut arguments = vec!["render", scene, "-o", "out.png", "--size", "32x32"];
        arguments.extend(extra);
        arguments.iter().map(|a| (*a).to_owned()).collect::<Vec<_>>()
    };
    let cases: [(&[&'static str], &[&str]); 8] = [
        (&["--filter", "mitchell"], &["negative lobes", "--sampling uniform", "blackman-harris"]),
        (
            &["--filter", "mitchell", "--sampling", "uniform", "--quality", "draft"],
            &["no visibility can end it", "--spp"],
        ),
        // The scene's was obeyed.
        (&["--filter", "mitchell", "--sampling", "uniform"], &["no visibility can end it", "--spp"]),
        (&["--filter", "mitchell", "--sampling", "uniform", "--transparent"], &["alpha knows nothing of"]),
        (&["--crop", "20,0,20,10"], &["--crop 20,0,20,10 reaches beyond the picture of 32x32 pixels"]),
        (&["--crop", "1,2,3"], &["expected X,Y,WIDTH,HEIGHT"]),
        // More samples than a film may hold.
        (&["--spp", "1073741825"], &["is not a whole number from 1 to 1073741824"]),
        (&["--max-spp", "1073741825"], &["is not a whole number from 16 to 1073741824"]),
    ];
    for (extra, fragments) in cases {
        let arguments = with(extra);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        assert_refused(&arguments, folder.path(), fragments);
    }
    // More pixels than memory can be counted for: "17179863584.0 GiB".
    let endless = ["render", scene, "-o", "out.png", "--size", "4294967295x4294967295"];
    assert_refused(&endless, folder.path(), &["more than the 2147483647 pixels", "smaller --size"]);
    let run = command::run(
        fechner()
            .args(with(&["--filter", "mitchell", "--sampling", "uniform", "--spp", "4", "--crop", "4,4,8,8"]))
            .current_dir(folder.path()),
    );
    let message = String::from_utf8_lossy(&run.stderr);
    assert!(message.contains("note: --filter mitchell"), "{message}");
}
