//! Tests that who writes of a kind that is not rendered is told of every one that is.

use super::super::{LoadOptions, load};

fn error_of(file: &str, text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(file);
    std::fs::write(&path, text).unwrap();
    load(&path, &LoadOptions::default()).expect_err("it has a kind that is not rendered").to_string()
}

/// Regression: telecentric sensors were rendered and not named, nor were twelve BSDFs.
#[test]
fn errors_name_every_kind_that_is_rendered() {
    let mitsuba = |body: &str| error_of("scene.xml", &format!("<scene version=\"3.0.0\">{body}</scene>"));
    let pbrt = |body: &str| error_of("scene.pbrt", body);
    let of_bsdf = mitsuba("<shape type=\"sphere\"><bsdf type=\"hair\"/></shape>");
    for (error, kinds) in [
        (mitsuba("<sensor type=\"fisheye\"/>"), &["perspective", "thinlens", "orthographic", "telecentric"][..]),
        (of_bsdf, &["roughdielectric", "difftrans", "principledthin", "disney", "phong", "ward", "bump,", "null"]),
        (mitsuba("<emitter type=\"projector\"/>"), &["area", "point", "sunsky"]),
        (mitsuba("<mediun/>"), &["did you mean \"medium\"?"]),
        (mitsuba("<patth/>"), &["did you mean \"path\"?"]),
        (
            pbrt("WorldBegin\nMaterial \"hair\"\nShape \"sphere\"\n"),
            &["coateddiffuse", "subsurface", "mix", "interface"],
        ),
        (pbrt("Camera \"spherical\"\nWorldBegin\nShape \"sphere\"\n"), &["perspective", "orthographic", "realistic"]),
    ] {
        for kind in kinds {
            assert!(error.contains(kind), "{kind}: {error}");
        }
    }
}
