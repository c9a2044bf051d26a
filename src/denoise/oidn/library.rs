//! Intel's Open Image Denoise through its C interface, version 2, opened at run time.
//!
//! Every call into the library is in this file.

#![allow(
    unsafe_code,
    reason = "a C library that is opened at run time can be called in no other way; measured gain in benches/results/denoising.md"
)]

use super::OidnError;
use libloading::Library;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};

/// `OIDN_DEVICE_TYPE_CPU`: the same code on every machine, and no driver is asked.
const DEVICE_CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FORMAT_FLOAT3: c_int = 3;

type Handle = *mut c_void;
type SetImage = unsafe extern "C" fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);

/// The library's functions that we call, and its CPU device.
pub(super) struct Device {
    device: Handle,
    functions: Functions,
    /// Keeps the code loaded for as long as `functions` point into it.
    _library: Library,
}

#[derive(Clone, Copy)]
struct Functions {
    new_device: unsafe extern "C" fn(c_int) -> Handle,
    set_device_int: unsafe extern "C" fn(Handle, *const c_char, c_int),
    get_device_int: unsafe extern "C" fn(Handle, *const c_char) -> c_int,
    set_device_bool: unsafe extern "C" fn(Handle, *const c_char, bool),
    commit_device: unsafe extern "C" fn(Handle),
    device_error: unsafe extern "C" fn(Handle, *mut *const c_char) -> c_int,
    release_device: unsafe extern "C" fn(Handle),
    new_filter: unsafe extern "C" fn(Handle, *const c_char) -> Handle,
    set_image: SetImage,
    set_filter_bool: unsafe extern "C" fn(Handle, *const c_char, bool),
    commit_filter: unsafe extern "C" fn(Handle),
    execute_filter: unsafe extern "C" fn(Handle),
    release_filter: unsafe extern "C" fn(Handle),
}

// SAFETY: a device may be used from any thread (the library's documentation, "Device"); it is used by one at a time,
// since `Oidn` keeps it in a mutex. The function pointers are plain addresses.
unsafe impl Send for Device {}

/// Columns and rows of a picture, which is row-major.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Size {
    pub(super) width: usize,
    pub(super) height: usize,
}

/// What is known of the first surfaces, itself noisy where edges, lenses and shutters are sampled.
#[derive(Clone, Copy, Debug)]
pub(super) enum Guide {
    Albedo,
    Normal,
}

impl Device {
    /// Opens the library at `path` (or by that name, for the system's loader to find) and starts its CPU device.
    pub(super) fn open(path: &Path, threads: usize) -> Result<Self, OidnError> {
        let refused = |problem: String| {
            // Loaders begin with the place, which the error names by itself.
            let place = format!("{}: ", path.display());
            OidnError::Library {
                path: path.to_owned(),
                problem: problem.strip_prefix(&place).unwrap_or(&problem).to_owned(),
            }
        };
        // SAFETY: loading runs the library's own initialisers, which its documentation allows at any time.
        let library = unsafe { Library::new(path) }.map_err(|error| refused(error.to_string()))?;
        let functions = Functions::of(&library).map_err(|error| refused(error.to_string()))?;
        // SAFETY: the functions have the signatures of oidn.h, version 2, and strings end in 0; the handle is checked.
        let device = unsafe {
            let device = (functions.new_device)(DEVICE_CPU);
            if device.is_null() {
                return Err(refused("it has no device for this CPU".to_owned()));
            }
            (functions.set_device_int)(device, c"numThreads".as_ptr(), c_int::try_from(threads).unwrap_or(0));
            // Pinned threads would stand in the way of the tracer's own, which run between two denoisings.
            (functions.set_device_bool)(device, c"setAffinity".as_ptr(), false);
            (functions.commit_device)(device);
            device
        };
        let opened = Self { device, functions, _library: library };
        opened.check()?;
        Ok(opened)
    }

    /// Version as major, minor and patch in one number, 20501 for 2.5.1.
    pub(super) fn version(&self) -> i32 {
        // SAFETY: the device is alive and the string ends in 0.
        unsafe { (self.functions.get_device_int)(self.device, c"version".as_ptr()) }
    }

    /// Denoises a picture of any positive range, guided by what [`Self::denoise_alone`] made of albedo and normal.
    pub(super) fn denoise(
        &self,
        size: Size,
        color: &[[f32; 3]],
        albedo: &[[f32; 3]],
        normal: &[[f32; 3]],
    ) -> Result<Vec<[f32; 3]>, OidnError> {
        let images = [(c"color", color), (c"albedo", albedo), (c"normal", normal)];
        self.run(size, &images, &[c"hdr", c"cleanAux"])
    }

    /// Denoises a guide by itself.
    pub(super) fn denoise_alone(
        &self,
        guide: Guide,
        size: Size,
        values: &[[f32; 3]],
    ) -> Result<Vec<[f32; 3]>, OidnError> {
        let name = match guide {
            Guide::Albedo => c"albedo",
            Guide::Normal => c"normal",
        };
        self.run(size, &[(name, values)], &[])
    }

    /// Runs the filter `RT` on images by their names in its documentation, with some of its switches on.
    fn run(&self, size: Size, images: &[(&CStr, &[[f32; 3]])], switches: &[&CStr]) -> Result<Vec<[f32; 3]>, OidnError> {
        let Size { width, height } = size;
        let count = width * height;
        if images.iter().any(|(_, values)| values.len() != count) {
            return Err(OidnError::Failed("pictures of different sizes".to_owned()));
        }
        let mut output = vec![[0.0f32; 3]; count];
        let f = &self.functions;
        // SAFETY: every picture has width × height × 3 floats without gaps (checked above), stays borrowed
        // until the filter is released, and only `output`, which nobody else holds, is written to; the
        // filter's handle is checked.
        unsafe {
            let filter = (f.new_filter)(self.device, c"RT".as_ptr());
            if filter.is_null() {
                self.check()?;
                return Err(OidnError::Failed("it made no filter".to_owned()));
            }
            let set = |name: &CStr, values: *mut c_void| {
                (f.set_image)(filter, name.as_ptr(), values, FORMAT_FLOAT3, width, height, 0, 0, 0);
            };
            images.iter().for_each(|(name, values)| set(name, values.as_ptr().cast_mut().cast()));
            set(c"output", output.as_mut_ptr().cast());
            switches.iter().for_each(|name| (f.set_filter_bool)(filter, name.as_ptr(), true));
            (f.commit_filter)(filter);
            (f.execute_filter)(filter);
            (f.release_filter)(filter);
        }
        self.check()?;
        Ok(output)
    }

    /// The first error since the last question.
    fn check(&self) -> Result<(), OidnError> {
        let mut message = null();
        // SAFETY: the device is alive; the message, where there is one, stays valid until the next question.
        unsafe {
            if (self.functions.device_error)(self.device, &raw mut message) == 0 {
                return Ok(());
            }
            let text =
                if message.is_null() { "no reason given".into() } else { CStr::from_ptr(message).to_string_lossy() };
            Err(OidnError::Failed(text.into_owned()))
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the handle is alive and used no more.
        unsafe { (self.functions.release_device)(self.device) };
        self.device = null_mut();
    }
}

impl Functions {
    fn of(library: &Library) -> Result<Self, libloading::Error> {
        // SAFETY: each name has this signature in oidn.h of every version 2; the addresses live as long as the library,
        // which stands beside them.
        unsafe {
            Ok(Self {
                new_device: *library.get(b"oidnNewDevice\0")?,
                set_device_int: *library.get(b"oidnSetDeviceInt\0")?,
                get_device_int: *library.get(b"oidnGetDeviceInt\0")?,
                set_device_bool: *library.get(b"oidnSetDeviceBool\0")?,
                commit_device: *library.get(b"oidnCommitDevice\0")?,
                device_error: *library.get(b"oidnGetDeviceError\0")?,
                release_device: *library.get(b"oidnReleaseDevice\0")?,
                new_filter: *library.get(b"oidnNewFilter\0")?,
                set_image: *library.get(b"oidnSetSharedFilterImage\0")?,
                set_filter_bool: *library.get(b"oidnSetFilterBool\0")?,
                commit_filter: *library.get(b"oidnCommitFilter\0")?,
                execute_filter: *library.get(b"oidnExecuteFilter\0")?,
                release_filter: *library.get(b"oidnReleaseFilter\0")?,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_that_is_not_there_is_named_once() {
        let Err(error) = Device::open(Path::new("/nowhere/libOpenImageDenoise.so.2"), 1) else {
            panic!("there is none")
        };
        let text = error.to_string();
        assert_eq!(text.matches("/nowhere/").count(), 1, "{text}");
    }
}
