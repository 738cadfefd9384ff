//! Sections of the manual pages that are not part of the help.

/// The section on scenes.
pub const SCENES: &str = "\
A scene is a TOML file, a glTF file (.gltf, .glb), or a JSON file with the course format of docs/scene-format.md, \
which also documents every TOML key; wgray schema prints a JSON Schema for editors; wgray check validates files.

The files that a scene refers to must lie in its folder or below, unless --asset-root names another folder.";

/// Environment variables that the program or its libraries read: name, description, and the commands that read it.
pub const ENVIRONMENT: &[(&str, &str, &[&str])] = &[
    (
        "VK_DRIVER_FILES",
        "Read by the Vulkan loader: the drivers to use instead of all installed ones.",
        DEVICES,
    ),
    (
        "WGPU_BACKEND",
        "Graphics APIs to use: vulkan, metal or dx12, separated by commas.",
        DEVICES,
    ),
    (
        "LP_NUM_THREADS",
        "Read by Mesa's software Vulkan: number of threads. --threads sets it.",
        DEVICES,
    ),
    (
        "MESA_SHADER_CACHE_DIR",
        "Read by Mesa: the cache folder of compiled kernels, which later renders reuse.",
        DEVICES,
    ),
    (
        "XDG_RUNTIME_DIR",
        "Read by Mesa, which warns if it is unset; wgray then sets it to the temporary folder.",
        DEVICES,
    ),
    (
        "RAYON_NUM_THREADS",
        "Number of CPU threads unless --threads is given; by default all.",
        &[
            "wgray-render",
            "wgray-check",
            "wgray-info",
            "wgray-diff",
            "wgray-merge",
            "wgray-convert",
        ],
    ),
    ("NO_COLOR", "Disables colors in messages.", &["wgray-dev"]),
];

/// Commands that use devices.
const DEVICES: &[&str] = &[
    "wgray-render",
    "wgray-devices",
    "wgray-info",
    "wgray-farm-openjd",
    "wgray-farm-slurm",
    "wgray-dev",
];

/// Output files.
pub const FILES: &[(&str, &str)] = &[
    (
        "NAME.png, NAME.exr, NAME.jpg, NAME.webp",
        "Images. Files are written under a hidden temporary name, .wgray-*, in the same folder and renamed when complete.",
    ),
    (
        "NAME.checkpoint",
        "Saved progress of an image, written by --checkpoint under any name; --resume continues from it. It is kept after success.",
    ),
    (
        "NAME.part",
        "A part of an image, written by --tile under any name; wgray merge joins parts.",
    ),
];

/// An example command.
pub struct Example {
    /// Purpose.
    pub what: &'static str,
    /// The whole command line.
    pub line: &'static str,
}

impl Example {
    /// Returns whether the example belongs on the page of a command, such as `wgray-render`. The page of `wgray` shows a selection.
    pub fn of(&self, command: &str) -> bool {
        match command {
            "wgray" => PROGRAM.contains(&self.line),
            command => {
                self.line.starts_with(&format!("{} ", command.replace('-', " ")))
                    || self.line == command.replace('-', " ")
            }
        }
    }
}

/// Examples on the program's page.
const PROGRAM: &[&str] = &[
    "wgray render model.glb -o image.png",
    "wgray check scene.toml",
    "wgray devices",
];

/// All examples.
pub const EXAMPLES: &[Example] = &[
    Example {
        what: "Render a model, in a neutral studio if it has no lights:",
        line: "wgray render model.glb -o image.png",
    },
    Example {
        what: "Render a linear EXR with normal and depth layers, with size and samples overridden:",
        line: "wgray render scene.toml --size 1920x1200 --spp 64 -o image.exr --aov normal,depth",
    },
    Example {
        what: "Render the missing frames of an animation:",
        line: "wgray render scene.toml --frames 1-100 -o 'out.####.png' --skip-existing",
    },
    Example {
        what: "Render for a long time, and resume after any interruption:",
        line: "wgray render scene.toml --spp 4096 --checkpoint scene.checkpoint --resume",
    },
    Example {
        what: "Render the second of four parts of an image:",
        line: "wgray render scene.toml --tile 2/4 -o 2.part",
    },
    Example {
        what: "Print messages as one JSON object per line:",
        line: "wgray render scene.toml --log-format json",
    },
    Example {
        what: "Validate a scene:",
        line: "wgray check scene.toml",
    },
    Example {
        what: "Print the contents of a scene and the device that would render it:",
        line: "wgray info scene.toml",
    },
    Example {
        what: "Print the same information as JSON:",
        line: "wgray info scene.toml --json",
    },
    Example {
        what: "Join four parts:",
        line: "wgray merge 1.part 2.part 3.part 4.part -o image.exr",
    },
    Example {
        what: "Write a template for Open Job Description that renders 16 parts and joins them:",
        line: "wgray farm openjd scene.toml -o image.exr --tiles 16",
    },
    Example {
        what: "Write Slurm scripts with parts of about five minutes each:",
        line: "wgray farm slurm scene.toml -o image.exr --task-time 5m",
    },
    Example {
        what: "Convert a model to an editable scene that renders the same bits:",
        line: "wgray convert model.glb -o scene.toml",
    },
    Example {
        what: "Check whether two images differ visibly:",
        line: "wgray diff new.png golden.png --fail flip=0.01 --out differences.png",
    },
    Example {
        what: "List the devices:",
        line: "wgray devices",
    },
    Example {
        what: "Write the JSON Schema of scene files for an editor:",
        line: "wgray schema > wgray.schema.json",
    },
    Example {
        what: "Print completions for bash:",
        line: "wgray completions bash",
    },
    Example {
        what: "Read a page:",
        line: "wgray man render | man -l -",
    },
    Example {
        what: "Write all pages:",
        line: "wgray man -o man1",
    },
    #[cfg(feature = "dev")]
    Example {
        what: "Show a scene on a web page that updates after every save:",
        line: "wgray dev scene.toml",
    },
];
