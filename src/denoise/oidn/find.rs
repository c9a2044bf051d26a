//! Lists where Open Image Denoise may be on this machine. To open it is left to `library`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What the loader calls the library.
const FILE_NAME: &str = if cfg!(windows) {
    "OpenImageDenoise.dll"
} else if cfg!(target_os = "macos") {
    "libOpenImageDenoise.2.dylib"
} else {
    "libOpenImageDenoise.so.2"
};

/// What of the environment says where libraries are.
pub(super) struct Environment {
    /// Value of `OIDN_DIR`: the library's folder, or the one above its `lib`.
    pub(super) oidn_dir: Option<OsString>,
    /// Value of `VIRTUAL_ENV`: the Python environment in use.
    pub(super) virtual_env: Option<OsString>,
    /// Value of `PATH`, in whose prefixes Python packages are looked for.
    pub(super) path: Option<OsString>,
}

impl Environment {
    pub(super) fn of_process() -> Self {
        let [oidn_dir, virtual_env, path] = ["OIDN_DIR", "VIRTUAL_ENV", "PATH"].map(std::env::var_os);
        Self { oidn_dir, virtual_env, path }
    }
}

/// Files to try, in this order: in `OIDN_DIR` (and then nowhere else), by name for the system's loader, in the Python
/// package `pyoidn` of the active virtual environment or beside a Python on the `PATH`.
pub(super) fn candidates(environment: &Environment) -> Vec<PathBuf> {
    if let Some(folder) = environment.oidn_dir.as_ref().filter(|folder| !folder.is_empty()) {
        let folder = Path::new(folder);
        return vec![folder.join("lib").join(FILE_NAME), folder.join(FILE_NAME)];
    }
    let mut files = vec![PathBuf::from(FILE_NAME)];
    let path = environment.path.as_deref().unwrap_or_default();
    let prefixes = std::env::split_paths(path).filter_map(|folder| folder.parent().map(Path::to_owned));
    for prefix in environment.virtual_env.iter().map(PathBuf::from).chain(prefixes) {
        for file in in_python_packages(&prefix) {
            if !files.contains(&file) {
                files.push(file);
            }
        }
    }
    files
}

/// The library inside `pyoidn` under a Python prefix, for each of its Python versions.
fn in_python_packages(prefix: &Path) -> Vec<PathBuf> {
    let lib = prefix.join("lib");
    let mut versions: Vec<PathBuf> = std::fs::read_dir(&lib)
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("python3")))
        .collect();
    versions.sort();
    let roots = versions.iter().flat_map(|version| [version.join("site-packages"), version.join("dist-packages")]);
    let windows = prefix.join("Lib").join("site-packages");
    roots
        .chain([windows])
        .map(|packages| packages.join("pyoidn").join("oidn").join("lib").join(FILE_NAME))
        .filter(|file| file.is_file())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nothing() -> Environment {
        Environment { oidn_dir: None, virtual_env: None, path: None }
    }

    #[test]
    fn a_folder_that_is_named_is_the_only_one() {
        let named = Environment { oidn_dir: Some("/opt/oidn".into()), path: Some("/usr/bin".into()), ..nothing() };
        let found = candidates(&named);
        assert!(found.len() == 2 && found.iter().all(|file| file.starts_with("/opt/oidn")), "{found:?}");
        assert_eq!(candidates(&nothing()), [PathBuf::from(FILE_NAME)]);
    }

    #[test]
    fn the_python_package_is_found_beside_its_interpreter() {
        let folder = tempfile::tempdir().unwrap();
        let lib = folder.path().join("lib/python3.11/site-packages/pyoidn/oidn/lib");
        std::fs::create_dir_all(&lib).unwrap();
        std::fs::write(lib.join(FILE_NAME), b"").unwrap();
        let prefix = folder.path().as_os_str().to_owned();
        let by_path = Environment { path: Some(folder.path().join("bin").into()), ..nothing() };
        let by_both = Environment { virtual_env: Some(prefix), ..by_path };
        assert_eq!(candidates(&by_both), [PathBuf::from(FILE_NAME), lib.join(FILE_NAME)]);
    }
}
