//! Builds the fault-injecting Vulkan driver and runs the program on it.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;
use std::{env, fs};

use crate::cli::without_summary;
use crate::sources::path as project_path;
use crate::test_folder::TestFolder;

/// A scene of 40 x 30 pixels with different random samples in each pixel.
pub const SCENE: &str = r#"image = { width = 40, height = 30 }
camera = { position = [0, -5, 1], look_at = [0, 0, 1], fov = 40 }
[render]
ambient = [0.1, 0.1, 0.1]
background = [0.2, 0.3, 2]
pixel_samples = { pattern = "random", count = 3 }
light_samples = { pattern = "grid", count = 4 }
[materials.gray]
type = "phong"
color = [0.5, 0.4, 0.3]
[[lights]]
type = "rectangle"
center = [0, -1, 4]
size = [2, 2]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [0.8, 0.8, 0.8]
[[shapes]]
type = "sphere"
material = "gray"
center = [0, 0, 1]
radius = 0.8
[[shapes]]
type = "plane"
material = "gray"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
"#;

/// The files that the Vulkan loader and the driver need.
pub struct Driver {
    manifest: PathBuf,
    library: PathBuf,
    lavapipe: PathBuf,
}

/// Builds the driver on the first call. If lavapipe is missing, returns `None` if `WGRAY_TEST_WITHOUT_GPU` is 1, and
/// panics otherwise.
pub fn driver() -> Option<&'static Driver> {
    static DRIVER: OnceLock<Option<Driver>> = OnceLock::new();
    DRIVER.get_or_init(prepare).as_ref()
}

fn prepare() -> Option<Driver> {
    let Some((lavapipe, api_version)) = lavapipe() else {
        let is_optional = env::var_os("WGRAY_TEST_WITHOUT_GPU").is_some_and(|value| value == "1");
        assert!(
            is_optional,
            "the fault tests need lavapipe, whose manifest is missing; on Debian, run 'apt-get install mesa-vulkan-drivers'"
        );
        return None;
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faults");
    fs::create_dir_all(&folder).expect("a folder below target/");
    // Tests run concurrently, so each file is written to a temporary folder and moved when it is complete.
    let [library, manifest] = ["libfaults.so", "faults.json"].map(|name| folder.join(name));
    let temp_folder = tempfile::tempdir_in(&folder).expect("a temporary folder");
    let new_library = temp_folder.path().join("libfaults.so");
    let rustc = Command::new(env::var_os("RUSTC").unwrap_or("rustc".into()))
        .args(["--crate-type", "cdylib", "--edition", "2024", "-O", "-o"])
        .args([&new_library, &project_path("tests/faults/icd.rs")])
        .output()
        .expect("rustc runs");
    assert!(rustc.status.success(), "{}", String::from_utf8_lossy(&rustc.stderr));
    fs::rename(&new_library, &library).expect("the renamed library");
    let json = serde_json::json!({
        "file_format_version": "1.0.0",
        "ICD": { "library_path": library, "api_version": api_version },
    });
    let new_manifest = temp_folder.path().join("faults.json");
    fs::write(&new_manifest, json.to_string()).expect("a manifest");
    fs::rename(&new_manifest, &manifest).expect("the renamed manifest");
    Some(Driver {
        manifest,
        library,
        lavapipe,
    })
}

/// Returns the path of lavapipe's library and its Vulkan version, if lavapipe is installed.
fn lavapipe() -> Option<(PathBuf, String)> {
    let mut manifests = Vec::new();
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        manifests.extend(env::var_os(variable).iter().flat_map(env::split_paths));
    }
    for folder in ["/usr/local/share", "/usr/share", "/usr/local/etc", "/etc"] {
        let entries = fs::read_dir(Path::new(folder).join("vulkan/icd.d"));
        manifests.extend(entries.into_iter().flatten().flatten().map(|entry| entry.path()));
    }
    manifests.iter().find_map(|manifest| {
        let text = fs::read_to_string(manifest).ok()?;
        let json: serde_json::Value = serde_json::from_str(&text).ok()?;
        let icd_value = |key: &str| Some(json.get("ICD")?.get(key)?.as_str()?.to_string());
        let library = icd_value("library_path")?;
        let is_path = library.contains('/'); // otherwise the dynamic linker finds it
        let is_lavapipe = library.contains("libvulkan_lvp");
        let library = match is_path {
            true => manifest.parent()?.join(library),
            false => library.into(),
        };
        (is_lavapipe && (!is_path || library.exists())).then_some((library, icd_value("api_version")?))
    })
}

pub struct RunResult {
    pub code: i32,
    pub stderr: String,
    /// Lines of the driver's log.
    pub log: Vec<String>,
    pub picture: Option<Picture>,
}

/// Channels of an image: the name and the bits of each value.
pub type Picture = Vec<(String, Vec<u32>)>;

impl RunResult {
    /// Returns the number of log lines that start with `prefix`.
    pub fn count(&self, prefix: &str) -> usize {
        self.log.iter().filter(|line| line.starts_with(prefix)).count()
    }

    pub fn stderr_lines(&self) -> Vec<&str> {
        self.stderr.lines().collect()
    }
}

impl TestFolder {
    pub fn with_scene(scene: &str) -> TestFolder {
        TestFolder::with_file("scene.toml", scene)
    }

    /// Returns a command that renders on the driver with these faults; `arguments` follow the scene and the output.
    pub fn command_on(&self, driver: &Driver, arguments: &[&str], faults: &[(&str, &str)]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wgray"));
        command
            .current_dir(self.folder())
            .args(["render", "scene.toml", "-o", "out.exr", "--aov", "normal"])
            .args(arguments)
            .envs(driver.environment(&self.path("log")));
        if arguments.contains(&"auto") {
            command.env("FAULTS_GPU", "1"); // on software Vulkan, `auto` selects the CPU for small images
        }
        command.envs(faults.iter().copied());
        command
    }

    /// Runs the program and checks that no temporary files remain.
    pub fn run_on(&self, driver: &Driver, arguments: &[&str], faults: &[(&str, &str)]) -> RunResult {
        let out = self.path("out.exr");
        for name in ["out.exr", "log"] {
            let _ = fs::remove_file(self.path(name)); // files of an earlier run
        }
        let mut command = assert_cmd::Command::from_std(self.command_on(driver, arguments, faults));
        let output = command
            .timeout(Duration::from_secs(120))
            .output()
            .expect("the program runs");
        let is_expected = |name: &str| ["scene.toml", "log", "out.exr"].contains(&name) || name.ends_with(".png");
        let unexpected = self.files_except(is_expected);
        assert_eq!(unexpected, [""; 0], "temporary files remain");
        let stderr = without_summary(&String::from_utf8(output.stderr).expect("UTF-8"));
        assert!(
            !stderr.contains("panicked") && !stderr.contains("backtrace"),
            "{stderr}"
        );
        let log = fs::read_to_string(self.path("log")).unwrap_or_default();
        RunResult {
            code: output.status.code().unwrap_or(-1),
            stderr,
            log: log.lines().map(str::to_string).collect(),
            picture: out.exists().then(|| read(&out)),
        }
    }

    /// Renders the image on the CPU, which uses no driver.
    pub fn render_expected(&self, driver: &Driver, arguments: &[&str]) -> Picture {
        let result = self.run_on(driver, &[arguments, &["--device", "cpu"]].concat(), &[]);
        assert_eq!((result.code, result.stderr.as_str(), result.log.len()), (0, "", 0));
        result.picture.expect("an image")
    }

    pub fn start(&self, driver: &Driver, arguments: &[&str], faults: &[(&str, &str)]) -> Child {
        let mut command = self.command_on(driver, arguments, faults);
        command.stderr(Stdio::piped()).spawn().expect("the program starts")
    }
}

impl Driver {
    /// Returns environment variables that select only this driver.
    pub fn environment(&self, log: &Path) -> [(&'static str, PathBuf); 5] {
        [
            ("VK_DRIVER_FILES", self.manifest.clone()),
            ("VK_ICD_FILENAMES", self.manifest.clone()),
            ("FAULTS_DRIVER", self.lavapipe.clone()),
            ("FAULTS_ITSELF", self.library.clone()),
            ("FAULTS_LOG", log.to_path_buf()),
        ]
    }
}

fn read(path: &Path) -> Picture {
    let image = exr::prelude::read_first_flat_layer_from_file(path).expect("an OpenEXR file");
    let bits = |samples: &exr::prelude::FlatSamples| match samples {
        exr::prelude::FlatSamples::F32(values) => values.iter().map(|value| value.to_bits()).collect(),
        exr::prelude::FlatSamples::U32(values) => values.clone(),
        exr::prelude::FlatSamples::F16(_) => panic!("an unexpected channel of half floats"),
    };
    let channels = image.layer_data.channel_data.list.iter();
    channels
        .map(|channel| (channel.name.to_string(), bits(&channel.sample_data)))
        .collect()
}
