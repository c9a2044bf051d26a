//! A shot's frames as a video: .y4m by ourselves, .mp4 by an installed ffmpeg.

use crate::cli::picture::InputPicture;
use anyhow::{Context, Result, bail};
use fechner::animate::ShotSettings;
use fechner::animate::video::Y4mWriter;
use fechner::output::{encode_srgb8, write_beside};
use fechner_perception::tone::{FittedTone, map_picture};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Kinds of video files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VideoFormat {
    Y4m,
    Mp4,
}

impl VideoFormat {
    /// By the file's ending; .mp4 only where there is an ffmpeg to write it.
    pub(super) fn of(path: &Path) -> Result<Self> {
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

/// Writes the frames' files as a video. `fitted` gives the tone operator of a frame, counted from 0, for files that hold
/// the scene's light.
pub(super) fn write(
    path: &Path,
    format: VideoFormat,
    files: impl Iterator<Item = PathBuf>,
    fitted: &dyn Fn(usize) -> Box<dyn FittedTone>,
    shot: &ShotSettings,
) -> Result<()> {
    match format {
        VideoFormat::Y4m => {
            let mut failed = Ok(());
            write_beside(path, |file| {
                failed = stream(BufWriter::new(file), files, fitted, shot);
                Ok(())
            })?;
            failed
        }
        VideoFormat::Mp4 => {
            // ffmpeg tells the kind of file from its ending.
            let beside = path.with_extension("unfinished.mp4");
            let mut ffmpeg = Command::new("ffmpeg")
                .args(["-y", "-loglevel", "error", "-f", "yuv4mpegpipe", "-i", "-", "-c:v", "libx264", "-crf", "14"])
                .args([
                    "-pix_fmt",
                    "yuv420p",
                    "-color_primaries",
                    "bt709",
                    "-color_trc",
                    "bt709",
                    "-colorspace",
                    "bt709",
                ])
                .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"])
                .arg(&beside)
                .stdin(Stdio::piped())
                .spawn()
                .context("ffmpeg could not be started")?;
            let pipe = ffmpeg.stdin.take().context("ffmpeg takes no input")?;
            let sent = stream(BufWriter::new(pipe), files, fitted, shot);
            let status = ffmpeg.wait().context("ffmpeg")?;
            if !status.success() {
                std::fs::remove_file(&beside).ok();
                bail!("{}: ffmpeg failed with {status}", path.display());
            }
            sent?;
            std::fs::rename(&beside, path).with_context(|| format!("{}", path.display()))
        }
    }
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

/// A frame's file as bytes for a display, R′G′B′ after R′G′B′; `fitted` makes its tone operator.
pub(super) fn shown_rgb8(
    file: &Path,
    fitted: impl Fn() -> Box<dyn FittedTone>,
    shot: &ShotSettings,
) -> Result<Vec<u8>> {
    let picture = InputPicture::read(file, None)?;
    let (width, height) = (shot.trace.width, shot.trace.height);
    if picture.size() != (width as usize, height as usize) {
        bail!("{}: not of {width}x{height} pixels as the shot's frames are", file.display());
    }
    Ok(match picture.scene_rgb_cd_m2() {
        Some(scene) => encode_srgb8(width, &map_picture(fitted().as_ref(), width as usize, &scene)),
        None => picture.codes8(),
    })
}
