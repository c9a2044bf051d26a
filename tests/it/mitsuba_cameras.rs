//! What Mitsuba's sensors see; figures are those of Mitsuba 3.9.

use crate::mitsuba_format::{LIGHT, folder, scene};
use crate::support::has_note;
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{FilmDefaults, Projection, ScreenWindow};
use glam::{Vec2, Vec3};

#[test]
fn cameras_are_mitsubas() {
    let camera = |kind: &str, inside: &str| {
        let film =
            r#"<film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film>"#;
        scene(&format!(r#"<sensor type="{kind}">{film}{inside}</sensor><shape type="rectangle"/>"#))
    };
    assert_eq!(camera("thinlens", "").camera.focus_distance, 1e4);
    assert_eq!(camera("thinlens", r#"<float name="far_clip" value="7"/>"#).camera.focus_distance, 7.0);
    let offset =
        r#"<float name="principal_point_offset_x" value="0.25"/><float name="principal_point_offset_y" value="0.5"/>"#;
    let window = ScreenWindow { min: Vec2::new(-0.5, -2.0), max: Vec2::new(1.5, 0.0) };
    assert_eq!(camera("perspective", offset).camera.screen_window, Some(window));
    let oblong = camera("orthographic", r#"<transform name="to_world"><scale x="2" y="1"/></transform>"#).camera;
    assert_eq!(oblong.projection, Projection::Orthographic { height: 2.0 });
    assert_eq!(oblong.screen_window, Some(ScreenWindow { min: Vec2::new(-2.0, -1.0), max: Vec2::new(2.0, 1.0) }));
    assert!(!has_note(
        &camera("perspective", r#"<transform name="to_world"><translate z="9"/></transform>"#),
        "cuts the scene"
    ));
    let back = r#"<transform name="to_world"><translate z="-4"/></transform>"#;
    assert!(!has_note(&camera("perspective", back), "cuts the scene"));
    // The surface's depth is 0.001, within Mitsuba's default.
    let touching = r#"<transform name="to_world"><translate z="-0.001"/></transform>"#;
    assert!(!has_note(&camera("perspective", touching), "near_clip"));
    let clipped = camera("perspective", &format!(r#"{back}<float name="near_clip" value="4.1"/>"#));
    assert!(has_note(&clipped, "near_clip 4.1 cuts the scene"), "{:?}", clipped.notes);
}

#[test]
fn cameras_without_an_up_stand_as_mitsubas_do() {
    let axes = |look_at: &str| {
        let sensor = format!(
            r#"<sensor type="perspective"><transform name="to_world"><lookat {look_at}/></transform></sensor>"#
        );
        scene(&format!(r#"{sensor}<shape type="rectangle"/>"#)).camera.axes()
    };
    assert!(axes(r#"origin="0,0,4" target="0,0,0""#).up.abs_diff_eq(Vec3::X, 1e-6));
    // As mi.coordinate_system says.
    let up = axes(r#"origin="3,2,4" target="0,0,0" up="0,0,0""#).up;
    assert!(up.abs_diff_eq(Vec3::new(0.82193, -0.11872, -0.55709), 1e-4), "{up}");
}

/// The view that a film of 32 × 32 has at another size: what it shows at a distance of 1, where the film's own half
/// height is 1.
fn window_at(sensor: &str, [width, height]: [u32; 2]) -> ScreenWindow {
    let folder = folder();
    let path = folder.path().join("scene.xml");
    let film = r#"<film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film>"#;
    let body = format!(r#"{LIGHT}<shape type="rectangle"/><sensor type="perspective">{film}{sensor}</sensor>"#);
    std::fs::write(&path, format!("<scene version=\"3.0.0\">{body}</scene>")).unwrap();
    let options = LoadOptions { film: Some(FilmDefaults { width, height }), ..LoadOptions::default() };
    let window = load(&path, &options).unwrap().camera.screen_window;
    window.unwrap_or(ScreenWindow::centered(width as f32 / height as f32))
}

/// As far off the principal point as the file says, in shares of the picture, whatever its size.
#[test]
fn shifted_cameras_have_square_pixels_at_every_size() {
    let shift = r#"<float name="principal_point_offset_x" value="0.25"/><string name="fov_axis" value="y"/><float name="fov" value="40"/>"#;
    for (width, half_width) in [(32, 1.0), (64, 2.0), (16, 0.5)] {
        let expected = ScreenWindow { min: Vec2::new(-0.5 * half_width, -1.0), max: Vec2::new(1.5 * half_width, 1.0) };
        assert_eq!(window_at(shift, [width, 32]), expected, "{width}");
    }
}

/// The axis that `fov_axis` names keeps its angle at every size; the vertical one did.
#[test]
fn fields_of_view_stay_on_their_axis_at_every_size() {
    let half_size = |axis: &str, size: [u32; 2]| {
        let view = format!(r#"<float name="fov" value="40"/>{axis}"#);
        window_at(&view, size).max
    };
    let named = |axis: &str| format!(r#"<string name="fov_axis" value="{axis}"/>"#);
    for (axis, wide, high) in [
        (String::new(), [1.0, 0.5], [1.0, 2.0]),
        (named("x"), [1.0, 0.5], [1.0, 2.0]),
        (named("y"), [2.0, 1.0], [0.5, 1.0]),
        (named("smaller"), [2.0, 1.0], [1.0, 2.0]),
        (named("larger"), [1.0, 0.5], [0.5, 1.0]),
        (named("diagonal"), [1.264_911, 0.632_455_5], [0.632_455_5, 1.264_911]),
    ] {
        for (size, expected) in [([64, 32], wide), ([32, 64], high), ([16, 16], [1.0, 1.0])] {
            let found = half_size(&axis, size);
            assert!(found.abs_diff_eq(expected.into(), 1e-6), "{axis} at {size:?}: {found}");
        }
    }
}
