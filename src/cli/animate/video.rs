//! A shot's frames as a video: .y4m by ourselves, .mp4 by an installed ffmpeg.

use crate::cli::picture::InputPicture;
use anyhow::{Context, Result, bail};
use fechner::animate::ShotSettings;
use fechner::animate::video::Y4mWriter;
use fechner::output::{decode_pq, encode_srgb8, write_beside, write_beside_by_name};
use fechner_perception::display::Eotf;
use fechner_perception::primaries::Primaries;
use fechner_perception::tone::{FittedTone, map_picture};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Kinds of video files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VideoFormat {
    Y4m,
    Mp4,
}

impl VideoFormat {
    /// Format of a video by its file's ending; .mp4 only where there is an ffmpeg to write it.
    pub(super) fn of(path: &Path) -> Result<Self> {
        if path.as_os_str().to_string_lossy().ends_with(['/', std::path::MAIN_SEPARATOR]) {
            bail!("{}: a video is a file, and this is a folder's name", path.display());
        }
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("y4m") => Ok(Self::Y4m),
            Some("mp4") => {
                let found = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
                if found.is_ok_and(|status| status.success()) {
                    return Ok(Self::Mp4);
                }
                bail!("{}: .mp4 is written by ffmpeg, which is not installed; .y4m needs nothing", path.display())
            }
            _ => bail!("{}: videos end in .y4m or .mp4", path.display()),
        }
    }
}

/// Writes the frames' files as a video. `fitted` gives the tone operator of a frame, counted from 0, for files
/// that hold the scene's light.
pub(super) fn write(
    path: &Path,
    format: VideoFormat,
    files: impl Iterator<Item = PathBuf>,
    fitted: &dyn Fn(usize) -> Box<dyn FittedTone>,
    shot: &ShotSettings,
) -> Result<()> {
    let failed = |error: anyhow::Error| io::Error::other(format!("{error:#}"));
    match format {
        VideoFormat::Y4m => {
            write_beside(path, |file| stream(BufWriter::new(file), files, fitted, shot).map_err(failed))?;
            say!(
                "note: {}: its colours are those of ITU-R BT.709, which .y4m has no word for: ffmpeg has to be told by \
                 -vf scale=in_color_matrix=bt709",
                path.display()
            );
        }
        // Under a name of this process's own: several that complete one shot would write into each other's file.
        VideoFormat::Mp4 => {
            write_beside_by_name(path, |beside| encode(beside, files, fitted, shot).map_err(failed))?;
        }
    }
    Ok(())
}

/// Has ffmpeg write a file.
fn encode(
    file: &Path,
    files: impl Iterator<Item = PathBuf>,
    fitted: &dyn Fn(usize) -> Box<dyn FittedTone>,
    shot: &ShotSettings,
) -> Result<()> {
    let mut ffmpeg = Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-f", "yuv4mpegpipe", "-i", "-", "-c:v", "libx264", "-crf", "14"])
        .args(["-pix_fmt", "yuv420p", "-color_primaries", "bt709", "-color_trc", "bt709", "-colorspace", "bt709"])
        .args(["-vf", &even_sides(shot.trace.width, shot.trace.height), "-f", "mp4"])
        // It takes what begins with a dash or with letters and a colon for something else than a file, unless its
        // folder is named.
        .arg(std::path::absolute(file)?)
        .stdin(Stdio::piped())
        .spawn()
        .context("ffmpeg could not be started")?;
    let pipe = ffmpeg.stdin.take().context("ffmpeg takes no input")?;
    let sent = stream(BufWriter::new(pipe), files, fitted, shot);
    let ended = ffmpeg.wait().context("ffmpeg")?;
    match sent {
        // It also fails of what came to an end too soon.
        Err(error) if !is_by_the_reader(&error) => Err(error),
        _ if !ended.success() => bail!("ffmpeg failed with {ended}"),
        sent => sent,
    }
}

/// A filter that gives a picture even sides, as half as many colours to a side want them: an odd one's last column or
/// row comes twice.
fn even_sides(width: u32, height: u32) -> String {
    let (right, bottom) = (width % 2, height % 2);
    format!("pad=iw+{right}:ih+{bottom},fillborders=right={right}:bottom={bottom}:mode=smear")
}

/// Whether writing failed since nobody reads any more.
fn is_by_the_reader(error: &anyhow::Error) -> bool {
    let mut causes = error.chain().filter_map(|cause| cause.downcast_ref::<io::Error>());
    causes.any(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}

fn stream<W: Write>(
    to: W,
    files: impl Iterator<Item = PathBuf>,
    fitted: &dyn Fn(usize) -> Box<dyn FittedTone>,
    shot: &ShotSettings,
) -> Result<()> {
    let mut video = Y4mWriter::new(to, shot.trace.width, shot.trace.height, shot.frames_per_second)?;
    for (number, file) in files.enumerate() {
        let rgb8 = shown_rgb8(&file, || fitted(number), shot)?;
        video.frame(&rgb8).with_context(|| format!("{}", file.display()))?;
    }
    video.finish()?;
    Ok(())
}

/// A frame's file as sRGB bytes, R′G′B′ after R′G′B′; `fitted` makes its tone operator. Where the shot is for an HDR
/// display, that display's white is white.
pub(super) fn shown_rgb8(
    file: &Path,
    fitted: impl Fn() -> Box<dyn FittedTone>,
    shot: &ShotSettings,
) -> Result<Vec<u8>> {
    let picture = InputPicture::read_frame(file, None)?;
    let (width, height) = (shot.trace.width, shot.trace.height);
    if picture.size() != (width as usize, height as usize) {
        bail!("{}: not of {width}x{height} pixels as the shot's frames are", file.display());
    }
    Ok(match picture.scene_rgb_cd_m2() {
        Some(scene) => encode_srgb8(width, &map_picture(fitted().as_ref(), width as usize, &scene)),
        None if shot.viewing.display.eotf == Eotf::Pq => {
            encode_srgb8(width, &decode_pq(picture.stored_rgb(), &Primaries::REC2020, &shot.viewing.display))
        }
        None => picture.codes8(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fechner::adaptive::settings::Limits;
    use fechner::integrator::TraceSettings;
    use fechner_perception::display::Viewing;

    fn shot() -> ShotSettings {
        let trace = TraceSettings::new(4, 2, 0);
        let of_a_frame = ShotSettings::new(24.0, trace, Limits::of_visibility(1.0), Viewing::default(), 100.0);
        ShotSettings { last: 1, ..of_a_frame }
    }

    #[test]
    fn a_folder_is_no_video() {
        for name in ["e.y4m/", "e.mp4/"] {
            let error = VideoFormat::of(Path::new(name)).expect_err("a folder's name");
            assert!(format!("{error}").contains("a folder's name"), "{error}");
        }
    }

    /// Names that ffmpeg would take for an address or an option, and a place where no file can be put.
    #[test]
    fn ffmpeg_takes_any_name() {
        if VideoFormat::of(Path::new("a.mp4")).is_err() {
            eprintln!("no ffmpeg: not tested");
            return;
        }
        // Relative to where the tests run: an absolute name was never a problem.
        let folder = tempfile::Builder::new().prefix("video").tempdir_in(".").expect("a folder");
        let frame = folder.path().join("a.0.png");
        fechner::output::write_png(&frame, 4, 2, &[[0.5; 3]; 8]).expect("written");
        let fitted = |_: usize| -> Box<dyn FittedTone> { panic!("PNG frames need no operator") };
        let make = |path: &Path| write(path, VideoFormat::Mp4, [frame.clone()].into_iter(), &fitted, &shot());
        let odd = format!("b{}:1.mp4", std::process::id());
        make(Path::new(&odd)).expect("written");
        std::fs::remove_file(&odd).expect("a video");
        // Of three columns and rows, which it wants to be even.
        let three = ShotSettings { trace: TraceSettings::new(3, 3, 0), ..shot() };
        fechner::output::write_png(&frame, 3, 3, &[[0.5; 3]; 9]).expect("written");
        write(Path::new(&odd), VideoFormat::Mp4, [frame.clone()].into_iter(), &fitted, &three).expect("written");
        std::fs::remove_file(&odd).expect("a video");
        fechner::output::write_png(&frame, 4, 2, &[[0.5; 3]; 8]).expect("written");
        let taken = folder.path().join("c.mp4");
        std::fs::create_dir(&taken).expect("a folder");
        make(&taken).expect_err("there is a folder");
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 2, "nothing is left beside it");
    }

    /// Of an empty stream ffmpeg says that it is empty: why it is says the frame.
    #[test]
    fn a_frame_that_cannot_be_read_is_named() {
        if VideoFormat::of(Path::new("a.mp4")).is_err() {
            eprintln!("no ffmpeg: not tested");
            return;
        }
        let folder = tempfile::tempdir().expect("a folder");
        let fitted = |_: usize| -> Box<dyn FittedTone> { panic!("there is no frame") };
        let missing = folder.path().join("a.0.exr");
        let error = write(&folder.path().join("a.mp4"), VideoFormat::Mp4, [missing].into_iter(), &fitted, &shot())
            .expect_err("there is no such frame");
        assert!(format!("{error:#}").contains("a.0.exr"), "{error:#}");
    }

    /// A frame that cannot be read leaves the video that was there, and nothing beside it.
    #[test]
    fn a_video_that_fails_replaces_none() {
        let folder = tempfile::tempdir().expect("a folder");
        let shot = shot();
        let frame = folder.path().join("a.0.png");
        fechner::output::write_png(&frame, 4, 2, &[[0.5; 3]; 8]).expect("written");
        let video = folder.path().join("a.y4m");
        let fitted = |_: usize| -> Box<dyn FittedTone> { panic!("PNG frames need no operator") };
        let make = |files: &[&Path]| {
            write(&video, VideoFormat::Y4m, files.iter().map(|file| file.to_path_buf()), &fitted, &shot)
        };
        make(&[&frame, &frame]).expect("written");
        let whole = std::fs::read(&video).expect("a video");
        let error = make(&[&frame, &folder.path().join("a.1.png")]).expect_err("there is no such frame");
        assert!(format!("{error:#}").contains("a.1.png"), "{error:#}");
        assert!(std::fs::read(&video).expect("a video") == whole, "half a video has taken its place");
        assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 2);
    }
}
