//! What the manual pages say besides what the help says.

/// What a scene is.
pub const SCENES: &str = "\
A scene is a TOML file, a glTF file (.gltf, .glb), or a JSON file of a course on path tracing. The manual of the format, \
docs/scene-format.md, documents every key; wgray schema prints a JSON Schema by which editors complete and check the keys; \
wgray check says whether a file is sound.

Files that a scene names lie in its folder or below, unless --asset-root names another one.";

/// Variables of the environment that the program, or what it is made of, reads; with the commands that do.
pub const ENVIRONMENT: &[(&str, &str, &[&str])] = &[
    (
        "VK_DRIVER_FILES",
        "Read by the Vulkan loader: the drivers that it looks for, in place of all that are installed.",
        DEVICES,
    ),
    (
        "WGPU_BACKEND",
        "Which interfaces to drivers are asked: vulkan, metal or dx12, with commas between.",
        DEVICES,
    ),
    (
        "LP_NUM_THREADS",
        "Read by Mesa's software Vulkan: its threads. --threads sets it.",
        DEVICES,
    ),
    (
        "MESA_SHADER_CACHE_DIR",
        "Read by Mesa: the folder in which compiled kernels are kept, so that the next render need not wait for them.",
        DEVICES,
    ),
    (
        "XDG_RUNTIME_DIR",
        "Read by Mesa. Where it is not set the program sets it to the folder of temporary files, as Mesa complains otherwise.",
        DEVICES,
    ),
    (
        "RAYON_NUM_THREADS",
        "Threads of the CPU, if --threads does not say; all that there are if absent.",
        &[
            "wgray-render",
            "wgray-check",
            "wgray-info",
            "wgray-diff",
            "wgray-merge",
            "wgray-convert",
        ],
    ),
    ("NO_COLOR", "If it is set, messages have no colours.", &["wgray-dev"]),
];

/// The commands that look for devices.
const DEVICES: &[&str] = &[
    "wgray-render",
    "wgray-devices",
    "wgray-info",
    "wgray-farm-openjd",
    "wgray-farm-slurm",
    "wgray-dev",
];

/// Files that are written.
pub const FILES: &[(&str, &str)] = &[
    (
        "NAME.png, NAME.exr, NAME.jpg, NAME.webp",
        "Pictures. One appears when it is whole: until then a hidden file beside it, .wgray-*, is written, of which nothing is left.",
    ),
    (
        "NAME.checkpoint",
        "What --checkpoint keeps of an unfinished picture, under any name, or one of its own in a folder; --resume goes on from it. It remains after success.",
    ),
    (
        "NAME.part",
        "A part of a picture, of --tile, under any name; wgray merge joins parts.",
    ),
];

/// A line to type.
pub struct Example {
    /// What it does.
    pub what: &'static str,
    /// With the program's name in front.
    pub line: &'static str,
}

impl Example {
    /// Whether it is one of this command, `wgray-render`; the program's own page has the first of each.
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

/// Those that the program's own page shows.
const PROGRAM: &[&str] = &[
    "wgray render model.glb -o picture.png",
    "wgray check scene.toml",
    "wgray devices",
];

/// All of them.
pub const EXAMPLES: &[Example] = &[
    Example {
        what: "A model of another program, in a neutral studio if it has no lights:",
        line: "wgray render model.glb -o picture.png",
    },
    Example {
        what: "Linear light with layers, of another size and with more samples:",
        line: "wgray render scene.toml --size 1920x1200 --spp 64 -o picture.exr --aov normal,depth",
    },
    Example {
        what: "Frames of a camera that moves, those that are not there yet:",
        line: "wgray render scene.toml --frames 1-100 -o 'out.####.png' --skip-existing",
    },
    Example {
        what: "A long render that goes on after any end:",
        line: "wgray render scene.toml --spp 4096 --checkpoint scene.checkpoint --resume",
    },
    Example {
        what: "The second of four parts of a picture:",
        line: "wgray render scene.toml --tile 2/4 -o 2.part",
    },
    Example {
        what: "Messages that a program reads, one JSON object a line:",
        line: "wgray render scene.toml --log-format json",
    },
    Example {
        what: "Whether a scene is sound:",
        line: "wgray check scene.toml",
    },
    Example {
        what: "What is in a scene, and what would render it:",
        line: "wgray info scene.toml",
    },
    Example {
        what: "The same for a program:",
        line: "wgray info scene.toml --json",
    },
    Example {
        what: "Four parts to a picture:",
        line: "wgray merge 1.part 2.part 3.part 4.part -o picture.exr",
    },
    Example {
        what: "A template of Open Job Description, of 16 parts that it joins:",
        line: "wgray farm openjd scene.toml -o picture.exr --tiles 16",
    },
    Example {
        what: "Scripts of Slurm, with parts that take some five minutes each:",
        line: "wgray farm slurm scene.toml -o picture.exr --task-time 5m",
    },
    Example {
        what: "A scene to edit that renders the same bits as a model:",
        line: "wgray convert model.glb -o scene.toml",
    },
    Example {
        what: "Whether two pictures differ by more than can be seen:",
        line: "wgray diff new.png golden.png --fail flip=0.01 --out differences.png",
    },
    Example {
        what: "What there is to render on:",
        line: "wgray devices",
    },
    Example {
        what: "The JSON Schema of scene files, as a file for an editor:",
        line: "wgray schema > wgray.schema.json",
    },
    Example {
        what: "Completions of the command line for bash:",
        line: "wgray completions bash",
    },
    Example {
        what: "A page to read:",
        line: "wgray man render | man -l -",
    },
    Example {
        what: "All pages as files:",
        line: "wgray man -o man1",
    },
    #[cfg(feature = "dev")]
    Example {
        what: "A scene on a web page that follows every save:",
        line: "wgray dev scene.toml",
    },
];
