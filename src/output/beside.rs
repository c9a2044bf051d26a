//! Files that are complete or not there: written beside the target under another name, flushed to the disk, renamed.

use super::OutputError;
use crate::poison::Unpoisoned as _;
use crate::scene::hash::ContentHash;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use tempfile::NamedTempFile;

/// Writes `path` by letting `write` fill a new file in the same folder, which then takes the target's place at once.
///
/// If `write` fails, the new file is removed and the target stays as it was. A symbolic link is followed: the file that
/// it points to is replaced or made, not the link.
///
/// # Errors
/// That of `write`, or if the file cannot be made or put in its place.
pub fn write_beside(path: &Path, write: impl FnOnce(&mut File) -> std::io::Result<()>) -> Result<(), OutputError> {
    let (mut file, target) = create_beside(path)?;
    let io = |error| OutputError::Io { path: path.to_owned(), error };
    write(file.as_file_mut()).map_err(io)?;
    // Without this a crash of the machine after the rename could leave the new name with no content.
    file.as_file().sync_all().map_err(io)?;
    file.persist(target).map_err(|error| io(error.error))?;
    Ok(())
}

/// Writes `path` as [`write_beside`] does, where something else writes the file, by its name; what ends it
/// says nothing of its kind.
///
/// # Errors
/// If `write` fails, or the file cannot be made or renamed.
pub fn write_beside_by_name(path: &Path, write: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), OutputError> {
    let (file, target) = create_beside(path)?;
    let io = |error| OutputError::Io { path: path.to_owned(), error };
    write(file.path()).map_err(io)?;
    file.as_file().sync_all().map_err(io)?;
    file.persist(target).map_err(|error| io(error.error))?;
    Ok(())
}

/// Makes the new file, which is removed when dropped, and says what it should be renamed to.
pub(super) fn create_beside(path: &Path) -> Result<(NamedTempFile, PathBuf), OutputError> {
    let io = |error| OutputError::Io { path: path.to_owned(), error };
    let not_a_file = |found| OutputError::NotAFile { path: path.to_owned(), found };
    let target = match path.metadata() {
        Ok(found) if found.is_dir() => return Err(not_a_file("a folder")),
        // Renaming over a device such as /dev/null would replace the device.
        Ok(found) if !found.is_file() => return Err(not_a_file("not an ordinary file")),
        _ => target_of(path).map_err(io)?,
    };
    let Some(name) = target.file_name() else {
        return Err(not_a_file("a folder"));
    };
    let folder = folder_of(&target);
    match folder.metadata() {
        Ok(found) if found.is_dir() => {}
        Ok(_) => {
            return Err(io(std::io::Error::new(
                std::io::ErrorKind::NotADirectory,
                format!("{} is a file, not a folder", folder.display()),
            )));
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(OutputError::MissingFolder { path: path.to_owned(), folder: folder.to_owned() });
        }
        Err(error) => return Err(io(error)),
    }
    check_name(path)?;
    let prefix = part_prefix(name);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).rand_bytes(PART_LETTERS).suffix(PART_SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any new file: all may read and write, less the user's umask. The default of temporary files is owner only.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(|error| {
        // The error's own text names the temporary file, which the user never asked for.
        io(std::io::Error::new(error.kind(), format!("cannot make a file in {}: {}", folder.display(), plain(&error))))
    })?;
    // Freed when it is renamed or its process ends, however it ends: by this others see that it is no leftover.
    // Elsewhere locks keep what is written by name from being written.
    #[cfg(unix)]
    let _ = file.as_file().try_lock();
    let mut unfinished = UNFINISHED.lock().unpoisoned();
    // Under that name until they are renamed or dropped.
    unfinished.retain(|path| path.exists());
    unfinished.push(file.path().to_owned());
    Ok((file, target))
}

/// New files that are being written, and some that no longer are.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the new files that this process is writing. For one that is about to end by `exit`, which drops nothing.
pub fn abandon_unfinished() {
    for path in UNFINISHED.lock().unpoisoned().drain(..) {
        // Nothing is there of those that are finished, and nobody is left to hear of another failure.
        let _ = std::fs::remove_file(path);
    }
}

/// What [`write_beside`] would replace: the path, or what its links lead to, which may not be there yet.
///
/// # Errors
/// If links lead in a circle.
pub fn target_of(path: &Path) -> std::io::Result<PathBuf> {
    path.canonicalize().or_else(|_| end_of_links(path))
}

/// The folder that a file is in, as it can be opened: the current one for a mere name.
pub fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where links lead from a path at whose end nothing is.
fn end_of_links(path: &Path) -> std::io::Result<PathBuf> {
    /// As many as Linux follows.
    const MAX_LINKS: usize = 40;
    let mut end = path.to_owned();
    for _ in 0..MAX_LINKS {
        let Ok(next) = end.read_link() else { return Ok(end) };
        end = end.parent().unwrap_or(Path::new("")).join(next);
    }
    Err(std::io::Error::other("its links lead in a circle"))
}

/// How the names of new files end until they are renamed.
const PART_SUFFIX: &str = ".part";
/// Random letters and digits before that.
const PART_LETTERS: usize = 6;

/// Bytes of the longest name that file systems take.
const LONGEST_NAME: usize = 255;

/// How the names of new files begin that will be called `name`.
fn part_prefix(name: &OsStr) -> OsString {
    let mut prefix = hidden_within(LONGEST_NAME - ".".len() - PART_LETTERS - PART_SUFFIX.len(), name);
    prefix.push(".");
    prefix
}

/// Tells whether a file may be called so where it will be, before the work is done: the name that it has until it is
/// complete is another, and is taken whatever this one is. Its folder may still have to be made.
///
/// # Errors
/// [`OutputError::LongName`] if the system takes no such name.
pub fn check_name(path: &Path) -> Result<(), OutputError> {
    let target = target_of(path).unwrap_or_else(|_| path.to_owned());
    let Some(name) = target.file_name() else { return Ok(()) };
    let folder = folder_of(&target).ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new("."));
    match folder.join(name).symlink_metadata() {
        // Of a path that is too long as a whole the system says so itself.
        Err(error) if error.kind() == std::io::ErrorKind::InvalidFilename && name.len() > LONGEST_NAME => {
            Err(OutputError::LongName { path: path.to_owned(), bytes: name.len() })
        }
        _ => Ok(()),
    }
}

/// A name that common file systems take: of one that is too long the end gives way, but for its ending.
pub fn shortened_name(name: &OsStr) -> OsString {
    if name.len() <= LONGEST_NAME {
        return name.to_owned();
    }
    let text = name.to_string_lossy();
    let ending = match text.rfind('.') {
        Some(dot) if text.len() - dot <= LONGEST_NAME => &text[dot..],
        _ => "",
    };
    OsString::from(format!("{}{ending}", &text[..text.floor_char_boundary(LONGEST_NAME - ending.len())]))
}

/// The name of a hidden file that stands beside the one called `name`.
pub fn hidden_name(name: &OsStr, ending: &str) -> OsString {
    let mut hidden = hidden_within(LONGEST_NAME - ending.len(), name);
    hidden.push(ending);
    hidden
}

/// A dot and a name, in no more than so many bytes. Of one that is too long the end gives way to a hash of all of it:
/// names of a sequence's frames differ in their ends.
fn hidden_within(most_bytes: usize, name: &OsStr) -> OsString {
    let mut hidden = OsString::from(".");
    let most_kept = most_bytes - hidden.len();
    if name.len() <= most_kept {
        hidden.push(name);
    } else {
        let hash = ContentHash::of_bytes(name.as_encoded_bytes()).to_string();
        let text = name.to_string_lossy();
        hidden.push(&text[..text.floor_char_boundary(most_kept - hash.len())]);
        hidden.push(hash);
    }
    hidden
}

/// Removes new files beside `path` that a killed program could not complete, as far as the folder can be read and they
/// can be removed: no work is lost for the sake of tidiness. Those that another program is writing stay, as does
/// everything where the file system has no locks.
pub fn remove_leftovers(path: &Path) {
    let Ok(target) = target_of(path) else { return };
    let Some(name) = target.file_name() else { return };
    let folder = folder_of(&target);
    let prefix = part_prefix(name);
    // No more than the random letters: `.a.film.png.x1Y2z3.part` is of a.film.png, which another program may be
    // writing.
    let is_leftover = |bytes: &[u8]| {
        let rest = bytes.strip_prefix(prefix.as_encoded_bytes());
        let letters = rest.and_then(|rest| rest.strip_suffix(PART_SUFFIX.as_bytes()));
        letters.is_some_and(|letters| letters.len() == PART_LETTERS && letters.iter().all(u8::is_ascii_alphanumeric))
    };
    for entry in folder.read_dir().into_iter().flatten().flatten() {
        let found = entry.file_name();
        let part = folder.join(&found);
        if is_leftover(found.as_encoded_bytes()) && is_nobodys(&part) {
            // It may be gone: renamed or removed by another meanwhile.
            let _ = std::fs::remove_file(part);
        }
    }
}

/// Whether no program is writing a new file; one that cannot be opened or locked may be somebody else's.
fn is_nobodys(part: &Path) -> bool {
    let file = File::options().write(true).open(part);
    file.is_ok_and(|file| file.try_lock().is_ok())
}

/// The system's words without the path that `tempfile` adds. Of a folder that is there it means that no file can be
/// made in it, as in `/proc`.
fn plain(error: &std::io::Error) -> String {
    if error.kind() == std::io::ErrorKind::NotFound {
        return "the folder takes no new files".to_owned();
    }
    error
        .raw_os_error()
        .map_or_else(|| error.kind().to_string(), |code| std::io::Error::from_raw_os_error(code).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    /// Not [`abandon_unfinished`] itself, which would take the files of tests beside this one.
    #[test]
    fn what_is_being_written_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let is_known = |path: &Path| UNFINISHED.lock().unwrap().iter().any(|known| known == path);
        let (file, _) = create_beside(&folder.path().join("a")).unwrap();
        let path = file.path().to_owned();
        assert!(is_known(&path));
        drop(file);
        create_beside(&folder.path().join("b")).unwrap();
        assert!(!is_known(&path));
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        std::fs::write(&path, "old").unwrap();
        let result = write_beside(&path, |file| {
            file.write_all(b"half a pic")?;
            Err(std::io::Error::other("the disk is full"))
        });
        assert!(result.unwrap_err().to_string().ends_with("a.png: the disk is full"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    /// Regression: the message was "entity not found" of a folder that is there.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_folder_that_takes_no_files_is_named() {
        let error = write_beside(Path::new("/proc/x.png"), |_| Ok(())).unwrap_err().to_string();
        assert!(error.ends_with("cannot make a file in /proc: the folder takes no new files"), "{error}");
    }

    /// Regression: with one fixed name beside the file, one writer renamed the other's half-written file.
    #[test]
    fn two_that_write_one_file_by_name_do_not_meet() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mp4");
        write_beside_by_name(&path, |first| {
            std::fs::write(first, "half")?;
            write_beside_by_name(&path, |second| {
                assert_ne!(first, second);
                std::fs::write(second, "second")
            })
            .unwrap();
            assert_eq!(std::fs::read_to_string(&path)?, "second");
            std::fs::write(first, "first")
        })
        .unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "first");
        write_beside_by_name(&path, |_| Err(std::io::Error::other("no encoder"))).unwrap_err();
        assert_eq!(names(folder.path()), ["a.mp4"]);
    }

    #[test]
    fn leftovers_of_this_file_are_removed_and_of_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let of_others = [".a.film.part.png", ".a.film.png.x1Y2z3.part"];
        for name in of_others.into_iter().chain(["a.film", ".a.film.x1Y2z3.part", ".b.film.x1Y2z3.part"]) {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        remove_leftovers(&folder.path().join("a.film"));
        assert_eq!(names(folder.path()), [of_others[0], of_others[1], ".b.film.x1Y2z3.part", "a.film"]);
        let (file, _) = create_beside(&folder.path().join("b.film")).unwrap();
        file.keep().unwrap();
        remove_leftovers(&folder.path().join("b.film"));
        assert_eq!(names(folder.path()), [of_others[0], of_others[1], "a.film"]);
    }

    /// As where two programs make frames of one shot.
    #[cfg(unix)]
    #[test]
    fn what_another_program_is_writing_is_no_leftover() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        write_beside(&path, |file| {
            remove_leftovers(&path);
            file.write_all(b"whole")
        })
        .unwrap();
        assert_eq!(names(folder.path()), ["a.png"]);
    }

    #[test]
    fn the_longest_names_can_be_written() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a".repeat(255), "a".repeat(242), "a".repeat(243), "ä".repeat(127)] {
            let [path, other] = [&name, &format!("{}b", &name[..name.len() - 2])].map(|name| folder.path().join(name));
            write_beside(&path, |file| file.write_all(b"x")).unwrap();
            let parts = [&path, &other].map(|path| create_beside(path).unwrap().0.keep().unwrap().1);
            remove_leftovers(&path);
            assert_eq!(parts.each_ref().map(|part| part.exists()), [false, true], "{name}");
            remove_leftovers(&other);
            assert_eq!(names(folder.path()), [name]);
            std::fs::remove_file(path).unwrap();
        }
    }

    /// Regression: the new file beside it had a name that was taken, and the picture was lost when it was renamed.
    #[test]
    fn names_that_no_file_can_have_are_refused_beforehand() {
        let folder = tempfile::tempdir().unwrap();
        let of = |letters: usize| folder.path().join("no/folder/yet").join("w".repeat(letters));
        assert!(check_name(&of(255)).is_ok());
        assert!(check_name(&of(256)).unwrap_err().to_string().contains("256 bytes"));
        let error = create_beside(&folder.path().join("w".repeat(256))).unwrap_err();
        assert!(matches!(error, OutputError::LongName { bytes: 256, .. }), "{error}");
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_shortened_name_keeps_its_ending() {
        let shortened = |name: &str| shortened_name(OsStr::new(name)).into_string().unwrap();
        assert_eq!(shortened("a.exr"), "a.exr");
        assert_eq!(shortened(&format!("{}.exr", "w".repeat(252))), format!("{}.exr", "w".repeat(251)));
        assert_eq!(shortened(&format!("{}.exr", "ä".repeat(200))), format!("{}.exr", "ä".repeat(125)));
        assert_eq!(shortened(&format!("a.{}", "w".repeat(300))), format!("a.{}", "w".repeat(253)));
    }

    #[test]
    fn a_panic_while_writing_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let result = std::panic::catch_unwind(|| {
            let _ = write_beside(&path, |file| {
                file.write_all(b"half a pic")?;
                panic!("stopped on purpose by a test");
            });
        });
        assert!(result.is_err());
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn a_new_file_replaces_the_old_one_and_only_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        for content in ["one", "two"] {
            write_beside(&path, |file| file.write_all(content.as_bytes())).unwrap();
            assert_eq!(std::fs::read_to_string(&path).unwrap(), content);
            assert_eq!(names(folder.path()), ["a.png"]);
        }
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_an_ordinary_file_and_links_are_followed() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (plain, ours, link) = (folder.path().join("p"), folder.path().join("o"), folder.path().join("l"));
        std::fs::write(&plain, "").unwrap();
        write_beside(&ours, |_| Ok(())).unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&ours), mode(&plain));

        std::os::unix::fs::symlink(&ours, &link).unwrap();
        write_beside(&link, |file| file.write_all(b"x")).unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(std::fs::read(&ours).unwrap(), b"x");

        // Also where nothing is at its end yet; relative to where the link is.
        std::fs::remove_file(&ours).unwrap();
        let before = folder.path().join("b");
        std::os::unix::fs::symlink("l", &before).unwrap();
        write_beside(&before, |file| file.write_all(b"y")).unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink() && before.symlink_metadata().unwrap().is_symlink());
        assert_eq!(std::fs::read(&ours).unwrap(), b"y");

        let circle = folder.path().join("c");
        std::os::unix::fs::symlink("c", &circle).unwrap();
        assert!(write_beside(&circle, |_| Ok(())).unwrap_err().to_string().contains("lead in a circle"));
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        let message = |path: &Path| write_beside(path, |_| Ok(())).unwrap_err().to_string();
        assert!(message(folder.path()).contains("it is a folder"), "{}", message(folder.path()));
        assert!(message(&folder.path().join("no/such.png")).contains("does not exist; create it first"));
        assert!(message(&file.join("a.png")).contains("cannot write"), "{}", message(&file.join("a.png")));
        assert!(message(Path::new("/")).contains("it is a folder"));
        #[cfg(unix)]
        assert!(message(Path::new("/dev/null")).contains("not an ordinary file"));
        assert_eq!(names(folder.path()), ["file"]);
    }
}
