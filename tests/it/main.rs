//! End-to-end and statistical tests, one binary.
//!
//! - `support`: scenes made in code, and rendering them
//! - `furnace`: energy: closed and open white furnaces with known answers
//! - `direct_light`: irradiance from a rectangle, a disk, a sphere, a point and environments against closed forms;
//!   radiosity
//! - `clear_coats`: clear coats of glTF over bumps and lamps
//! - `coverage`: alpha: stacks, spheres, lamps that no ray meets
//! - `adaptive_render`: adaptive and uniform renders against a reference: bias, calibration, determinism
//! - `bench`: the benchmark from end to end, small
//! - `small_lamps`, `lit_things`: lamps and other things smaller than a pixel, and light beside the film, which the
//!   first samples may pass by
//! - `camera_and_time`: blur of lens and shutter, moving lamps, crops
//! - `denoise`: denoised pictures: the raw mean beside them, equal bytes, libraries that are not there
//! - `formats`: the same scene from several formats
//! - `gltf_counts`: attributes of glTF that do not fit their meshes
//! - `gltf_motion`: jumps, hidden things and morphing nodes of glTF while the shutter is open
//! - `mitsuba_format`, `mitsuba_cameras`, `pbrt_format`: what their files mean where readers go wrong easily
//! - `mitsuba_textures`: colours, numbers, pictures and spectra of Mitsuba's files
//! - `animate`: the frames of a shot in any order and from any process, kept when they are there
//! - `animate_mishaps`: shots that are refused before anything is rendered, or named
//! - `bad_input`: bad scene files, and our own ones
//! - `own_format`: lamps of a luminous power, photometric ones, keys that change nothing, files beside the scene
//! - `importance`: samples go where a user's map sends them
//! - `load_assets`: scenes that others made, sound and damaged
//! - `mutations`: thousands of damaged files a format, in a child process (ignored)
//! - `scene_table`: scenes of others: how long until nothing is seen (ignored)
//! - `relief`: height maps: normals, energy, every format
//! - `maps`: false-colour maps beside a picture
//! - `overscan`: files whose data reach beyond what is to be shown
//! - `reprojection`: velocity maps against rendered frames
//! - `references`: scenes of others beside reference pictures (ignored)
//! - `no_allocation`: the heap is left alone while paths are traced
//! - `command_line`: the program as a user runs it
//! - `checkpoint`: renders stopped, continued and merged against renders in one go
//! - `kill`: the program, killed and resumed
//! - `mishaps`: renders whose listeners go, whose disk is full, or whose files are asked for twice
//! - `farm`: many processes on one folder
//! - `farm_mishaps`: farms that lost a file, were interrupted, or were asked for what cannot be
//! - `view`: the live preview, over its WebSocket
//! - `wild_files`: files as other programs write them
//! - `texture_memory`: textures within a limit
//! - `texture_values`: colours, numbers and infinities of EXR pictures as textures and surroundings
//! - `displayed`, `told`: pictures compared as the display shows them, and what is said of those that are not
//! - `tonemap`: HDR pictures for displays, one by one and over time
//! - `units_and_colours`: what a picture's file says of its unit, its curve and its colours
//! - `units_and_views`: what the caller's unit and picture size change of a scene

mod adaptive_render;
mod animate;
mod animate_mishaps;
mod bad_input;
mod bench;
mod camera_and_time;
mod checkpoint;
mod clear_coats;
mod command_line;
mod coverage;
mod denoise;
mod direct_light;
mod displayed;
mod farm;
mod farm_mishaps;
mod formats;
mod furnace;
mod gltf_counts;
mod gltf_motion;
mod importance;
mod kill;
mod lit_things;
mod load_assets;
mod maps;
mod mishaps;
mod mitsuba_cameras;
mod mitsuba_format;
mod mitsuba_textures;
mod mutations;
mod no_allocation;
mod overscan;
mod own_format;
mod pbrt_format;
mod references;
mod relief;
mod reprojection;
mod scene_table;
mod small_lamps;
mod support;
mod texture_memory;
mod texture_values;
mod told;
mod tonemap;
mod units_and_colours;
mod units_and_views;
mod view;
mod wild_files;
