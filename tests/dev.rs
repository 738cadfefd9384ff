//! The development mode without a browser: whatever happens to the files, the picture is the one that `render` makes of
//! what they say last, or the last good one with the error beside it.

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wgray::cpu::Cpu;
use wgray::dev::{Command, Content, Diagnostic, Frame, Listener, Move, Session, Settings, Sources, State, View};
use wgray::film::Region;
use wgray::gpu::compose::{BUILT_IN, Shaders};
use wgray::gpu::{Choice, Gpu, Options, choose};
use wgray::image::Pixels;
use wgray::job::{self, Backend as _, Cut};
use wgray::pack::{Packed, pack};
use wgray::scene::{Overrides, Scene};

/// However busy the machine is, what is waited for comes within this time, or never.
const LONGEST: Duration = Duration::from_secs(40);
/// Nothing happens for so long: then nothing will.
const SETTLED: Duration = Duration::from_millis(400);

const SCENE: &str = "# a small scene
[image]
width = 40
height = 30

[camera] # looks from the front
position = [0, -4, 1] # a comment
look_at = [0, 0, 0.5]
fov = 40

[render]
ambient = [0.2, 0.2, 0.2]
pixel_samples = { pattern = \"grid\", count = 4 }
light_samples = { pattern = \"grid\", count = 4 }

[materials.red]
type = \"phong\"
color = [0.8, 0.1, 0.1]
shininess = 16

[[lights]]
type = \"rectangle\"
center = [0, 0, 3]
size = [1, 1]
normal = [0, 0, -1]
tangent = [1, 0, 0]
color = [0.8, 0.8, 0.8]

[[shapes]]
type = \"sphere\"
material = \"red\"
center = [0, 0, 0.5]
radius = 0.5

[[shapes]]
type = \"plane\"
material = \"red\"
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
";

/// A shader whose picture depends on every line.
const KERNEL: &str = "shaders/kernels/render.wgsl";
/// What it adds up.
const RADIANCE: &str = "pixel_radiance(pixel, sample)";

/// A scene and shaders in a folder of their own.
struct Files {
    folder: TempDir,
}

impl Files {
    fn new(scene: &str) -> Files {
        let files = Files {
            folder: tempfile::tempdir().unwrap(),
        };
        fs::create_dir_all(files.path("shaders/kernels")).unwrap();
        for (name, text) in BUILT_IN {
            files.write(&format!("shaders/{name}"), text);
        }
        files.write("scene.toml", scene);
        files
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// As most editors save: another file takes the name.
    fn save_by_rename(&self, name: &str, text: &str) {
        self.write("new~", text);
        fs::rename(self.path("new~"), self.path(name)).unwrap();
    }

    fn edit(&self, name: &str, old: &str, new: &str) {
        let text = self.read(name);
        assert!(text.contains(old), "{name} has no '{old}'");
        self.write(name, &text.replacen(old, new, 1));
    }

    /// Saves a kernel that multiplies the picture.
    fn tint(&self, factor: f64) {
        let kernel = Shaders::built_in().text("kernels/render.wgsl").to_string();
        assert!(kernel.contains(RADIANCE));
        self.write(
            KERNEL,
            &kernel.replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f({factor:?}), 1.0))")),
        );
    }

    fn sources(&self) -> Sources {
        Sources {
            scene: self.path("scene.toml"),
            overrides: Overrides::default(),
            shaders: Some(self.path("shaders")),
        }
    }

    fn start(&self) -> Running {
        Running::start(self.sources(), None)
    }

    fn packed(&self) -> Packed {
        pack(&Scene::load(&self.path("scene.toml"), &Overrides::default()).unwrap())
    }

    /// What `render` makes of the files.
    fn rendered(&self) -> Pixels {
        let packed = self.packed();
        let device = choose(&Choice::Auto).unwrap();
        let shaders = Shaders::read(&self.path("shaders")).unwrap();
        let options = Options {
            baked: false,
            ..Options::best(&device)
        };
        let mut gpu = Gpu::new(&device, &packed, &shaders, options).unwrap();
        let (width, height) = (packed.camera.width, packed.camera.height);
        let mut colors = Vec::new();
        let whole = Region::whole(width, height);
        job::render(
            &mut gpu,
            whole,
            packed.pixel_samples,
            &Cut::default(),
            &mut |_| true,
            &mut |film| {
                colors.extend(film.means());
                Ok(())
            },
        )
        .unwrap();
        Pixels { width, height, colors }
    }
}

struct Running {
    session: Session,
}

impl Running {
    fn start(sources: Sources, out: Option<PathBuf>) -> Running {
        let settings = Settings {
            sources,
            device: Choice::Auto,
            out,
            report: Box::new(|_| ()),
        };
        Running {
            session: Session::start(settings).unwrap(),
        }
    }

    fn state(&self) -> Arc<State> {
        self.session.state.borrow().clone()
    }

    fn frame(&self) -> Option<Arc<Frame>> {
        self.session.frames.borrow().clone()
    }

    #[track_caller]
    fn wait<T>(&self, what: &str, ready: impl Fn(&Running) -> Option<T>) -> T {
        let start = Instant::now();
        while start.elapsed() < LONGEST {
            if let Some(value) = ready(self) {
                return value;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        panic!(
            "{what}: not within {LONGEST:?}; state: {:?}, frame: {:?}",
            self.state(),
            self.frame().map(|f| f.header.clone())
        );
    }

    /// Waits until a picture with all samples is shown that is later than a revision.
    #[track_caller]
    fn wait_done(&self, after: u64) -> Arc<Frame> {
        self.wait("a finished picture", |running| {
            running
                .frame()
                .filter(|frame| frame.header.done && frame.header.revision > after)
        })
    }

    /// Waits until the picture is the one that `render` makes of the files.
    #[track_caller]
    fn wait_rendered(&self, files: &Files) {
        let wanted = files.rendered();
        self.wait("the picture that render makes", |running| {
            let frame = running.frame()?;
            matches!(&frame.content, Content::Color(pixels) if frame.header.done && *pixels == wanted).then_some(())
        });
        assert_eq!(self.state().problems, []);
    }

    #[track_caller]
    fn wait_problem(&self) -> Diagnostic {
        self.wait("a problem", |running| running.state().problems.first().cloned())
    }

    #[track_caller]
    fn wait_well(&self) {
        self.wait("no problem", |running| {
            (running.state().problems.is_empty() && !running.state().compiling).then_some(())
        });
    }

    fn revision(&self) -> u64 {
        self.frame().map_or(0, |frame| frame.header.revision)
    }

    fn colors(&self) -> Pixels {
        match &self.frame().unwrap().content {
            Content::Color(pixels) => pixels.clone(),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn the_first_picture_is_what_render_makes() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let frame = running.frame().unwrap();
    assert_eq!((frame.header.samples, frame.header.total), (4, 4));
    let colors = running.colors().colors;
    assert!(colors.iter().any(|color| *color != colors[0]), "a picture of something");
    let (x, y) = (20, 20);
    let [r, g, b] = colors[y * 40 + x];
    let told = frame.pixel(x as u32, y as u32).unwrap();
    assert_eq!(told, [("linear RGB", format!("{r}  {g}  {b}"))]);
    assert_eq!(frame.pixel(40, 0), None);
}

#[test]
fn a_saved_scene_is_uploaded_and_a_changed_count_is_compiled() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let (before, compiled) = (running.colors(), running.state().compile_seconds);
    files.edit("scene.toml", "0.8, 0.1, 0.1", "0.1, 0.8, 0.1");
    running.wait_rendered(&files);
    assert_ne!(running.colors(), before);
    assert_eq!(running.state().compile_seconds, compiled, "nothing was compiled");
    files.edit(
        "scene.toml",
        "[[shapes]]",
        "[[shapes]]\ntype = 'sphere'\nmaterial = 'red'\ncenter = [1, 0, 1]\nradius = 0.3\n\n[[shapes]]",
    );
    running.wait_rendered(&files);
    assert_ne!(running.state().compile_seconds, compiled, "another kernel was compiled");
    files.edit("scene.toml", "width = 40", "width = 33");
    running.wait_rendered(&files);
}

#[test]
fn a_comment_starts_nothing_anew() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let revision = running.revision();
    files.edit("scene.toml", "# a small scene", "# a very small scene");
    std::thread::sleep(SETTLED);
    assert_eq!(running.revision(), revision);
    files.edit("scene.toml", "fov = 40", "fov = 41"); // it was looking
    running.wait_rendered(&files);
}

#[test]
fn a_broken_shader_is_told_and_the_picture_stays() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let (good, revision) = (running.colors(), running.revision());
    files.edit(KERNEL, "= sum;", "= sun;");
    let problem = running.wait_problem();
    assert_eq!(problem.kind, "shader");
    let text = files.read(KERNEL);
    let before = &text[..text.find("sun;").unwrap()];
    let (line, column) = (
        before.matches('\n').count() + 1,
        before.len() - before.rfind('\n').unwrap(),
    );
    let place = format!("{}:{line}:{column}", files.path(KERNEL).display());
    assert_eq!(problem.place, Some(place));
    assert!(problem.message.contains("sun"), "{}", problem.message);
    let excerpt = problem.excerpt.unwrap();
    assert!(excerpt.contains("= sun;") && excerpt.contains("^^^"), "{excerpt}");
    std::thread::sleep(SETTLED);
    assert_eq!((running.colors(), running.revision()), (good, revision));
    // What does not need the broken shaders goes on.
    running.session.send(Command::Move(Move::Orbit(0.3, 0.0)));
    running.wait_done(revision);
    running.session.send(Command::ResetCamera);
    files.edit("scene.toml", "0.8, 0.1, 0.1", "0.1, 0.8, 0.1");
    let scene_changed = Files::new(&files.read("scene.toml")).rendered();
    running.wait("the changed scene by the last good shaders", |running| {
        (running.colors() == scene_changed).then_some(())
    });
    // Even where it takes another kernel.
    files.edit(
        "scene.toml",
        "radius = 0.5",
        "radius = 0.5\n\n[[shapes]]\ntype = 'sphere'\nmaterial = 'red'\ncenter = [1, 0, 1]\nradius = 0.3",
    );
    let scene_changed = Files::new(&files.read("scene.toml")).rendered();
    running.wait("a new kernel of the last good shaders", |running| {
        (running.colors() == scene_changed).then_some(())
    });
    assert_eq!(running.wait_problem().kind, "shader");
    files.tint(0.5);
    running.wait_rendered(&files);
}

#[test]
fn a_shader_that_is_wrong_in_its_types_is_told_too() {
    let files = Files::new(SCENE);
    files.edit(
        "shaders/camera.wgsl",
        "return Ray(camera.position, ",
        "return Ray(camera.seed, ",
    );
    let running = files.start();
    let problem = running.wait_problem();
    assert!(
        problem.place.unwrap().contains("camera.wgsl:"),
        "there is no picture, but the error is told"
    );
    assert!(running.frame().is_none());
    files.edit(
        "shaders/camera.wgsl",
        "return Ray(camera.seed, ",
        "return Ray(camera.position, ",
    );
    running.wait_rendered(&files);
}

#[test]
fn a_broken_scene_is_told_and_the_picture_stays() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let good = running.colors();
    for (old, new, line, said) in [
        ("radius = 0.5", "radius = -1", 33, "must be"),
        ("radius = -1", "radius = = 1", 33, "expected"),
        ("radius = = 1", "radius = 1\nradios = 2", 34, "radios"),
    ] {
        files.edit("scene.toml", old, new);
        let place = format!("{}:{line}", files.path("scene.toml").display());
        let problem = running.wait("the problem", |running| {
            let problem = running.state().problems.first().cloned()?;
            (problem.place.as_ref()?.starts_with(&place) && problem.message.contains(said)).then_some(problem)
        });
        assert_eq!(problem.kind, "scene");
        assert!(problem.excerpt.unwrap().contains(new.lines().last().unwrap()));
        assert_eq!(running.colors(), good);
    }
    files.edit("scene.toml", "radios = 2\n", "");
    running.wait_rendered(&files);
}

#[test]
fn of_a_burst_of_saves_the_last_one_counts() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    for i in 1..=40 {
        files.write("scene.toml", &SCENE.replace("fov = 40", &format!("fov = {}", 40 + i)));
        if i % 4 == 0 {
            files.tint(1.0 + i as f64 / 100.0);
        }
        if i % 7 == 0 {
            files.write("shaders/phong.wgsl", "half written");
            files.write("shaders/phong.wgsl", Shaders::built_in().text("phong.wgsl"));
        }
        std::thread::sleep(Duration::from_millis(i % 12));
    }
    running.wait_rendered(&files);
}

#[test]
fn saves_by_rename_and_links_are_seen() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    files.save_by_rename("scene.toml", &SCENE.replace("fov = 40", "fov = 50"));
    running.wait_rendered(&files);
    let kernel = files
        .read(KERNEL)
        .replace(RADIANCE, &format!("({RADIANCE} * vec4f(vec3f(0.25), 1.0))"));
    files.save_by_rename(KERNEL, &kernel);
    running.wait_rendered(&files);
    #[cfg(unix)]
    {
        // The scene becomes a link to a file elsewhere, which is then edited there; likewise a shader.
        let elsewhere = Files::new(&SCENE.replace("fov = 40", "fov = 60"));
        for name in ["scene.toml", "shaders/phong.wgsl"] {
            fs::remove_file(files.path(name)).unwrap();
            std::os::unix::fs::symlink(elsewhere.path(name), files.path(name)).unwrap();
        }
        running.wait_rendered(&files);
        elsewhere.save_by_rename("scene.toml", &SCENE.replace("fov = 40", "fov = 70"));
        running.wait_rendered(&files);
        elsewhere.edit(
            "shaders/phong.wgsl",
            "return lobes;",
            "return Lobes(lobes.specular, lobes.diffuse);",
        );
        running.wait_rendered(&files);
    }
}

#[test]
fn deleted_files_are_told_and_seen_again() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let good = running.colors();
    fs::remove_file(files.path("scene.toml")).unwrap();
    let problem = running.wait_problem();
    assert_eq!(problem.kind, "file");
    assert!(
        problem.message.contains("scene.toml: cannot be read"),
        "{}",
        problem.message
    );
    files.write("scene.toml", &SCENE.replace("fov = 40", "fov = 50"));
    running.wait_rendered(&files);
    assert_ne!(running.colors(), good);

    fs::remove_file(files.path("shaders/phong.wgsl")).unwrap();
    assert!(running.wait_problem().message.contains("phong.wgsl"));
    files.write("shaders/phong.wgsl", Shaders::built_in().text("phong.wgsl"));
    running.wait_well();

    // A whole folder goes and comes back, as when another branch is checked out.
    for name in ["shaders/kernels", "shaders"] {
        fs::rename(files.path(name), files.path("away")).unwrap();
        assert_eq!(running.wait_problem().kind, "file");
        fs::rename(files.path("away"), files.path(name)).unwrap();
        running.wait_well();
    }
    fs::remove_dir_all(files.path("shaders")).unwrap();
    fs::create_dir_all(files.path("shaders/kernels")).unwrap();
    for (name, text) in BUILT_IN {
        files.write(&format!("shaders/{name}"), text);
    }
    files.tint(0.125);
    running.wait_rendered(&files);
    files.edit(
        "shaders/kernels/render.wgsl",
        "film[index] = sum;",
        "film[index] = sum * vec4f(2.0, 1.0, 1.0, 1.0);",
    );
    running.wait_rendered(&files);
}

#[test]
fn an_edited_texture_is_seen() {
    let textured = SCENE.replacen("color = [0.8, 0.1, 0.1]", "color = { texture = 'picture' }", 1)
        + "\n[textures.picture]\ntype = 'image'\nfile = 'textures/picture.png'\n";
    let files = Files::new(&textured);
    let paint = |color: [u8; 3]| {
        fs::create_dir_all(files.path("textures")).unwrap();
        image::RgbImage::from_pixel(4, 4, image::Rgb(color))
            .save(files.path("textures/picture.png"))
            .unwrap();
    };
    paint([200, 30, 30]);
    let running = files.start();
    running.wait_rendered(&files);
    let red = running.colors();
    paint([30, 30, 200]);
    running.wait_rendered(&files);
    assert_ne!(running.colors(), red);
    fs::remove_dir_all(files.path("textures")).unwrap();
    assert!(running.wait_problem().message.contains("textures/picture.png"));
    paint([30, 200, 30]);
    running.wait_rendered(&files);
    fs::write(files.path("textures/picture.png"), "no picture").unwrap();
    assert!(running.wait_problem().message.contains("textures/picture.png"));
    paint([200, 30, 30]);
    running.wait("the first picture again", |running| {
        (running.colors() == red).then_some(())
    });
}

#[test]
fn the_camera_moves_and_is_saved_without_a_flicker() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    assert!(!running.state().camera_moved);
    for by in [Move::Orbit(0.4, 0.2), Move::Pan(0.1, -0.1), Move::Dolly(0.3)] {
        let revision = running.revision();
        running.session.send(Command::Move(by));
        running.wait_done(revision);
    }
    // Moved and at once seen otherwise: neither is forgotten.
    running.session.send(Command::Move(Move::Orbit(-0.1, 0.0)));
    running.session.send(Command::View(View::Normal));
    running.session.send(Command::View(View::Color));
    let settled = |running: &Running| {
        let frame = running.frame()?;
        (frame.header.done && frame.header.view == View::Color).then_some(frame.header.revision)
    };
    std::thread::sleep(SETTLED);
    running.wait("a finished picture", settled);
    let state = running.state();
    assert!(state.camera_moved);
    // The text is that of a scene file: put into one it gives the picture that is shown.
    let from_text = {
        let (start, end) = (SCENE.find("[camera]").unwrap(), SCENE.find("[render]").unwrap());
        Files::new(&format!("{}{}\n{}", &SCENE[..start], state.camera, &SCENE[end..]))
    };
    assert_eq!(running.colors(), from_text.rendered());
    let (shown, revision) = (running.colors(), running.revision());
    running.session.send(Command::SaveCamera);
    running.wait("the camera to be the file's", |running| {
        (!running.state().camera_moved).then_some(())
    });
    assert_eq!(files.rendered(), shown);
    let saved = files.read("scene.toml");
    for kept in [
        "# a small scene\n",
        "[camera] # looks from the front\n",
        "] # a comment\n",
        "fov = 40\n",
    ] {
        assert!(saved.contains(kept), "{saved}");
    }
    let notice = running.state().notice.clone().unwrap();
    assert!(!notice.bad && notice.text.contains("scene.toml"), "{}", notice.text);
    std::thread::sleep(SETTLED);
    assert_eq!(running.revision(), revision, "nothing was rendered again");
    // Whoever edits the file's camera sees that one.
    running.session.send(Command::Move(Move::Orbit(0.4, 0.2)));
    running.wait_done(revision);
    files.edit("scene.toml", "fov = 40", "fov = 44");
    running.wait_rendered(&files);
    assert!(!running.state().camera_moved);
}

#[test]
fn the_views_show_the_first_hits() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let packed = files.packed();
    let wanted = Cpu::new(&packed).first_hits(Region::whole(40, 30)).unwrap();
    for view in [View::Normal, View::Depth, View::Uv, View::Primitive] {
        running.session.send(Command::View(view));
        let frame = running.wait("the view", |running| {
            running
                .frame()
                .filter(|frame| frame.header.view == view && frame.header.done)
        });
        let Content::Hits(_, hits) = &frame.content else {
            panic!("{:?}", frame.content)
        };
        assert_eq!(*hits, wanted);
        let told = frame.pixel(20, 15).unwrap();
        assert!(
            told.contains(&("on", "shapes[0]".to_string())) && told.contains(&("material", "red".to_string())),
            "{told:?}"
        );
    }
    running.session.send(Command::View(View::Samples));
    let frame = running.wait("the counts", |running| {
        running.frame().filter(|frame| frame.header.view == View::Samples)
    });
    assert!(matches!(&frame.content, Content::Samples(counts, 4) if counts.iter().all(|count| *count == 4)));
    running.session.send(Command::View(View::Color));
    running.wait_rendered(&files);
}

#[test]
fn the_cpu_agrees_until_a_shader_is_changed() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    running.session.send(Command::View(View::Compare));
    let compared = |running: &Running| {
        running
            .frame()
            .filter(|frame| frame.header.done)
            .and_then(|frame| frame.header.differing)
    };
    assert_eq!(running.wait("a comparison", compared), (0, 0.0));
    files.edit(KERNEL, RADIANCE, &format!("({RADIANCE} + vec4f(0.25, 0.0, 0.0, 0.0))"));
    let (pixels, largest) = running.wait("a difference", |running| {
        compared(running).filter(|(pixels, _)| *pixels > 0)
    });
    assert!(pixels > 100, "{pixels}");
    assert!((largest - 0.25).abs() < 1e-5, "{largest}");
    let Content::Compare(gpu, cpu) = &running.frame().unwrap().content else {
        panic!()
    };
    assert_ne!(gpu, cpu);
}

#[test]
fn the_file_of_out_is_the_finished_picture() {
    let files = Files::new(SCENE);
    let out = files.path("pictures.png");
    let running = Running::start(files.sources(), Some(out.clone()));
    for fov in [40, 50] {
        files.write("scene.toml", &SCENE.replace("fov = 40", &format!("fov = {fov}")));
        running.wait_rendered(&files);
        let wanted: Vec<u8> = running
            .colors()
            .colors
            .iter()
            .flat_map(|color| color.map(wgray::image::encode))
            .collect();
        running.wait("the file", |_| {
            let picture = image::open(&out).ok()?.into_rgb8();
            (picture.dimensions() == (40, 30) && *picture.as_raw() == wanted).then_some(())
        });
    }
    // A picture that is written beside the scene does not wake the session, nor is anything left behind.
    let mut names: Vec<_> = fs::read_dir(files.folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["pictures.png", "scene.toml", "shaders"]);
}

/// A scene so heavy that nobody waits for all of it.
fn heavy() -> String {
    let large = SCENE
        .replace("width = 40", "width = 1200")
        .replace("height = 30", "height = 900");
    large.replace("count = 4 }", "count = 1024 }")
}

#[test]
fn a_save_or_a_move_does_not_wait_for_the_picture() {
    let files = Files::new(&heavy());
    let running = files.start();
    let frame = running.wait("a first picture", |running| running.frame());
    assert!(
        !frame.header.done && frame.header.sent[0] < 1200,
        "it is coarse: {:?}",
        frame.header
    );
    let mut worst = Duration::ZERO;
    for i in 0..4 {
        std::thread::sleep(Duration::from_millis(150));
        let revision = running.revision();
        let start = Instant::now();
        if i % 2 == 0 {
            files.write("scene.toml", &heavy().replace("fov = 40", &format!("fov = {}", 50 + i)));
        } else {
            running.session.send(Command::Move(Move::Orbit(0.1, 0.0)));
        }
        running.wait("the next picture", |running| {
            (running.revision() > revision).then_some(())
        });
        worst = worst.max(start.elapsed());
    }
    // The whole picture takes minutes; the goal is 0.3 s on an idle machine.
    assert!(worst < Duration::from_secs(5), "{worst:?}");
    assert!(!running.frame().unwrap().header.done);
}

#[test]
fn a_camera_that_never_rests_is_shown_all_the_same() {
    let files = Files::new(&heavy());
    let running = files.start();
    running.wait("a first picture", |running| running.frame());
    let revision = running.revision();
    let start = Instant::now();
    let mut seen = 0;
    while seen < 5 {
        assert!(start.elapsed() < LONGEST, "{seen} pictures");
        running.session.send(Command::Move(Move::Orbit(0.01, 0.0)));
        std::thread::sleep(Duration::from_millis(4));
        seen = running.revision() - revision;
    }
}

/// A request, and the answer's first line and whole text.
fn ask(address: SocketAddr, request: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LONGEST)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    let mut buffer = [0; 4096];
    while !is_whole(&answer) {
        let n = stream.read(&mut buffer).unwrap();
        assert_ne!(n, 0, "the answer breaks off: {answer}");
        answer.push_str(&String::from_utf8_lossy(&buffer[..n]));
    }
    (answer.lines().next().unwrap_or_default().to_string(), answer)
}

fn is_whole(answer: &str) -> bool {
    let Some((head, body)) = answer.split_once("\r\n\r\n") else {
        return false;
    };
    let length = head
        .lines()
        .find_map(|line| line.to_lowercase().strip_prefix("content-length: ")?.parse().ok());
    head.starts_with("HTTP/1.1 101") || body.len() >= length.unwrap_or(usize::MAX)
}

fn get(path: &str, host: &str, more: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}Connection: close\r\n\r\n")
}

fn upgrade(host: &str, origin: &str) -> String {
    format!(
        "GET /socket HTTP/1.1\r\nHost: {host}\r\n{origin}Connection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
}

#[test]
fn the_server_answers_its_own_pages_only() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let listener = Listener::open("127.0.0.1:0").unwrap();
    let address = listener.address().unwrap();
    // It serves as long as the program runs.
    let session: &'static Running = Box::leak(Box::new(running));
    std::thread::spawn(move || listener.serve(&session.session).unwrap());
    let (own, port) = (address.to_string(), address.port());

    for path in ["/", "/style.css", "/page.js", "/picture.js"] {
        let (status, text) = ask(address, &get(path, &own, ""));
        assert_eq!(status, "HTTP/1.1 200 OK", "{path}");
        assert!(
            text.contains("default-src 'none'") && text.contains("nosniff"),
            "{text}"
        );
        assert!(
            !text.contains("://cdn") && !text.contains("src=\"http"),
            "nothing comes from elsewhere"
        );
    }
    for path in [
        "/scene.toml",
        "/../scene.toml",
        "/shaders/phong.wgsl",
        "/%2e%2e/etc/passwd",
        "//etc/passwd",
    ] {
        assert_eq!(ask(address, &get(path, &own, "")).0, "HTTP/1.1 404 Not Found", "{path}");
    }
    let refused = "HTTP/1.1 403 Forbidden";
    for host in [
        "evil.example",
        &format!("evil.example:{port}"),
        "192.168.0.1",
        "127.0.0.1.evil.example",
    ] {
        assert_eq!(ask(address, &get("/", host, "")).0, refused, "{host}");
        assert_eq!(
            ask(address, &upgrade(host, &format!("Origin: http://{host}\r\n"))).0,
            refused,
            "{host}"
        );
    }
    for origin in [
        "Origin: http://evil.example\r\n",
        "Origin: null\r\n",
        "Origin: http://127.0.0.1:1\r\n",
        "",
    ] {
        assert_eq!(ask(address, &upgrade(&own, origin)).0, refused, "{origin}");
    }
    assert_eq!(
        ask(address, &get("/", &own, "Origin: http://evil.example\r\n")).0,
        refused
    );
    let accepted = ask(address, &upgrade(&own, &format!("Origin: http://{own}\r\n"))).0;
    assert_eq!(accepted, "HTTP/1.1 101 Switching Protocols");

    // The number of viewers is bounded, and a place that is left is free again.
    let request = upgrade(&own, &format!("Origin: http://{own}\r\n"));
    let mut open = Vec::new();
    let full = loop {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(LONGEST)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = [0; 12];
        stream.read_exact(&mut head).unwrap();
        if head != *b"HTTP/1.1 101" {
            break head;
        }
        open.push(stream);
        assert!(open.len() <= 16, "no bound");
    };
    assert_eq!(full, *b"HTTP/1.1 503");
    assert!(open.len() >= 15, "{}", open.len());
    // None of them reads anything: that holds up nobody.
    for _ in 0..20 {
        let revision = session.revision();
        session.session.send(Command::Move(Move::Orbit(0.1, 0.0)));
        session.wait_done(revision);
    }
    // A message that is too large ends the connection: 5,000 bytes of text, masked with zeros.
    let mut large = vec![0x81, 0x80 | 126, 0x13, 0x88, 0, 0, 0, 0];
    large.resize(8 + 5000, b' ');
    let mut stream = open.pop().unwrap();
    stream.write_all(&large).unwrap();
    let mut rest = Vec::new();
    let end = stream.read_to_end(&mut rest);
    assert!(end.is_ok() || end.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset));
    drop(open);
    session.wait("a free place", |_| {
        (ask(address, &request).0 == "HTTP/1.1 101 Switching Protocols").then_some(())
    });
}

#[test]
fn what_cannot_be_listened_on_is_told() {
    let taken = Listener::open("127.0.0.1:0").unwrap();
    let place = taken.address().unwrap().to_string();
    let error = Listener::open(&place).err().unwrap().to_string();
    assert!(error.starts_with(&place), "{error}");
    assert!(Listener::open("nowhere").is_err());
}
