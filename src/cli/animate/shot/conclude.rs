//! What only a whole shot has, made when its last frame is there: its JSON, its contact sheet, its video.

use super::Shot;
use crate::cli::animate::contact::{ContactSheet, on_sheet};
use crate::cli::animate::record::FrameRecord;
use crate::cli::animate::video::{self, shown_rgb8};
use crate::cli::words::listed;
use anyhow::Result;
use fechner::animate::track::Track;
use fechner::json_file;
use fechner::output;
use std::path::PathBuf;

/// What there is of a shot.
struct FoundFrames {
    /// Of the frames that are there, in order, if their files all are.
    records: Vec<FrameRecord>,
    /// Those that are not.
    missing: Vec<u32>,
}

impl Shot<'_> {
    /// Writes what only the whole shot has, if all its frames are there as this run would make them; whether they are.
    pub(in crate::cli) fn conclude(&self, track: &Track) -> Result<bool> {
        let FoundFrames { records, missing } = self.find_frames(track)?;
        if !missing.is_empty() {
            let (frames, are) = if missing.len() == 1 { ("frame", "is") } else { ("frames", "are") };
            say!("{frames} {} of the shot {are} not there yet, or changed.", listed(&missing));
            self.note_outdated()?;
            return Ok(false);
        }
        for (_, file) in self.files_of_whole()? {
            output::remove_leftovers(&file);
        }
        json_file::write(&self.name.of_shot("json"), &records)?;
        let fits = |frame: usize| track.frames[frame].fitted.clone().restore();
        let count = records.len();
        let size = (self.settings.trace.width as usize, self.settings.trace.height as usize);
        let mut sheet = ContactSheet::new(on_sheet(count).count(), size);
        for frame in on_sheet(count) {
            let file = self.file(self.settings.first + frame as u32);
            sheet.add(&shown_rgb8(&file, || fits(frame), &self.settings)?);
        }
        sheet.write(&self.name.of_shot("contact.png"))?;
        if let Some((path, format)) = self.arguments.video()? {
            let files = (self.settings.first..=self.settings.last).map(|frame| self.file(frame));
            video::write(path, format, files, &fits, &self.settings)?;
        }
        Ok(true)
    }

    /// Names what there is of the shot as it was before, whose frames are no longer those.
    fn note_outdated(&self) -> Result<()> {
        let files = self.files_of_whole()?;
        let files = files.iter().filter(|(_, file)| file.is_file());
        let outdated: Vec<String> = files.map(|(_, file)| file.display().to_string()).collect();
        if !outdated.is_empty() {
            say!("note: still of the shot as it was before, until all its frames are there: {}", outdated.join(", "));
        }
        Ok(())
    }

    /// The files of what only the whole shot has, each with the option or words that name it.
    pub(super) fn files_of_whole(&self) -> Result<Vec<(&'static str, PathBuf)>> {
        let video = self.arguments.video()?.map(|(path, _)| ("--video", path.to_owned()));
        let always =
            [("the shot's record", self.name.of_shot("json")), ("the contact sheet", self.name.of_shot("contact.png"))];
        Ok(always.into_iter().chain(video).collect())
    }

    /// Looks for all frames of the shot. One of another scene, other settings or another format is not there.
    fn find_frames(&self, track: &Track) -> Result<FoundFrames> {
        let frames = || self.settings.first..=self.settings.last;
        // Keys take reading every scene: not for each run that makes a part of a shot.
        let missing = frames().filter(|&frame| FrameRecord::of_picture(&self.file(frame)).is_none()).collect();
        let mut found = FoundFrames { records: Vec::new(), missing };
        if !found.missing.is_empty() {
            return Ok(found);
        }
        for frame in frames() {
            let job = self.frame_of_track(frame, track)?;
            match job.and_then(|job| self.record(frame, &job.key)) {
                Some(record) => found.records.push(record),
                None => found.missing.push(frame),
            }
        }
        Ok(found)
    }
}
