//! Time and memory are proportional to the size of the scene. The tests compare ratios of CPU times, not wall-clock
//! times.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use wgray::scene::Scene;
use wgray_render::gpu::{Forms, check_kernels};
use wgray_render::pack::pack;
use wgray_trace::records::Packed;

use crate::sources;

const SCENE_START: &str = "\
image = { width = 8, height = 8 }
camera = { position = [0, -5, 2], look_at = [0, 0, 0.5], fov = 40 }
[materials.first]
type = 'phong'
color = [0.5, 0.4, 0.3]
[[lights]]
type = 'point'
position = [0, 0, 9]
color = [1, 1, 1]
[[shapes]]
type = 'plane'
material = 'first'
point = [0, 0, 0]
normal = [0, 0, 1]
tangent = [1, 0, 0]
";

/// Returns a scene with n copies of `element`. In each copy, `{i}` is replaced by the number of the copy, and `{x}`,
/// `{y}` and `{z}` by coordinates.
fn scene(n: usize, element: &str) -> String {
    let mut text = SCENE_START.to_owned();
    for i in 0..n {
        let [x, y, z] = [7919, 104_729, 1_299_709].map(|step| format!("{:.3}", (i * step % 1000) as f64 / 250.0 - 2.0));
        let element = element.replace("{i}", &i.to_string());
        let _ = writeln!(
            text,
            "{}",
            element.replace("{x}", &x).replace("{y}", &y).replace("{z}", &z)
        );
    }
    text
}

const SPHERE: &str = "[[shapes]]\ntype = 'sphere'\nmaterial = 'first'\ncenter = [{x}, {y}, {z}]\nradius = 0.05";

/// All kinds of objects that a scene may contain in large numbers.
const KINDS: [(&str, &str); 13] = [
    ("spheres", SPHERE),
    (
        "ellipsoids",
        "[[shapes]]\ntype = 'ellipsoid'\nmaterial = 'first'\ncenter = [{x}, {y}, {z}]\na = [1, 0, 0]\nb = [0, 1, 0]\nc = [0, 0, 2]",
    ),
    (
        "rectangles",
        "[[shapes]]\ntype = 'rectangle'\nmaterial = 'first'\ncenter = [{x}, {y}, {z}]\nsize = [1, 1]\nnormal = [{x}, {y}, 9]\n\
         tangent = [1, 0, 0]",
    ),
    (
        "triangles",
        "[[shapes]]\ntype = 'triangle'\nmaterial = 'first'\nvertices = [[{x}, {y}, {z}], [9, {y}, {z}], [{x}, 9, {y}]]",
    ),
    // All other triangles are on the same side of the plane of a triangle.
    (
        "triangles on a slope",
        "[[shapes]]\ntype = 'triangle'\nmaterial = 'first'\nvertices = [[{x}, {y}, {x}], [9, {y}, 9], [9, 9, 9]]",
    ),
    (
        "tetrahedra",
        "[[shapes]]\ntype = 'tetrahedron'\nmaterial = 'first'\n\
         vertices = [[{x}, {y}, {z}], [9, {y}, {z}], [{x}, 9, {y}], [{x}, {y}, 9]]",
    ),
    (
        "planes",
        "[[shapes]]\ntype = 'plane'\nmaterial = 'first'\npoint = [{x}, {y}, {z}]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]",
    ),
    (
        "point lights",
        "[[lights]]\ntype = 'point'\nposition = [{x}, {y}, {z}]\ncolor = [1, 1, 1]",
    ),
    (
        "directional lights",
        "[[lights]]\ntype = 'directional'\ndirection = [{x}, {y}, 9]\ncolor = [1, 1, 1]",
    ),
    (
        "area lights",
        "[[lights]]\ntype = 'rectangle'\ncenter = [{x}, {y}, {z}]\nsize = [1, 1]\nnormal = [0, 0, 1]\ntangent = [1, 0, 0]\n\
         color = [1, 1, 1]",
    ),
    ("materials", "[materials.m{i}]\ntype = 'phong'\ncolor = [0.1, 0.2, 0.3]"),
    (
        "textures",
        "[textures.t{i}]\ntype = 'checker'\neven = [0, 0, 0]\nodd = [1, 1, 1]\n[materials.m{i}]\ntype = 'phong'\n\
         color = { texture = 't{i}' }",
    ),
    // The parent table `materials` also exists, so the parser handles all materials at once.
    (
        "materials in one table",
        "[materials.m{i}.color]\ntexture = 't'\n[materials.m{i}]\ntype = 'mirror'",
    ),
];

fn packed(text: &str) -> Option<Packed> {
    let scene = Scene::parse(text, "s.toml");
    scene.ok().map(|scene| pack(&scene))
}

/// Returns the CPU time of `task` in seconds, by the clock of the thread: the resolution of `/proc`, several
/// milliseconds, is too coarse.
fn cpu_time(task: impl Fn()) -> f64 {
    #[cfg(unix)]
    let now = || {
        let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: the clock writes to a valid `timespec`.
        let result = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
        assert_eq!(result, 0, "the CPU time of the thread is not available");
        time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
    };
    #[cfg(not(unix))]
    let now = {
        let start = std::time::Instant::now();
        move || start.elapsed().as_secs_f64()
    };
    let start = now();
    task();
    now() - start
}

/// Returns the minimum of three measurements, in a thread pool of one thread, which runs no code of other tests.
fn min_of_three(task: impl Fn() + Sync) -> f64 {
    let thread = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a thread");
    let min_time = || (0..3).map(|_| cpu_time(&task)).fold(f64::INFINITY, f64::min);
    thread.install(min_time)
}

/// Returns the CPU time of `large` divided by that of `small`. Repeats the measurements while the quotient is not below
/// `limit`, because other processes may disturb a measurement.
fn cpu_time_ratio(limit: f64, large: impl Fn() + Sync, small: impl Fn() + Sync) -> f64 {
    const ROUNDS: usize = 8;
    let (mut large_time, mut small_time) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        large_time = large_time.min(min_of_three(&large));
        small_time = small_time.min(min_of_three(&small));
        if large_time / small_time < limit {
            break;
        }
    }
    large_time / small_time
}

#[test]
fn parsing_and_packing_take_linear_time() {
    for (name, element) in KINDS {
        let (small, large) = (scene(1500, element), scene(12_000, element));
        let pack = |text: &str| {
            packed(text);
        };
        // 8 times the input: n log n takes 10 times as long, n^2 64 times.
        let ratio = cpu_time_ratio(24.0, || pack(&large), || pack(&small));
        println!("{name}: {ratio:.1}");
        assert!(ratio < 24.0, "{name}: 8 times the input takes {ratio} times as long");
    }
}

#[test]
fn quadratic_time_is_detected() {
    let square = |n: u64| {
        let pairs = (0..n).flat_map(|i| (0..n).map(move |j| i ^ j));
        assert!(std::hint::black_box(pairs.max()).is_some());
    };
    let ratio = cpu_time_ratio(24.0, || square(8 * 400), || square(400));
    assert!(ratio > 24.0, "{ratio}");
}

#[test]
fn kernels_for_large_scenes_take_no_longer_to_check() {
    for (name, element) in KINDS {
        if packed(&scene(2, element)).is_none() {
            continue; // only the parser is tested with this element
        }
        let [small, large] = [600, 6000].map(|n| packed(&scene(n, element)).expect("a scene"));
        let check = |packed: &Packed| check_kernels(packed, sources::shaders(), Forms::All).expect("valid kernels");
        let ratio = cpu_time_ratio(3.0, || check(&large), || check(&small));
        println!("{name}: {ratio:.2}");
        assert!(ratio < 3.0, "{name}: {ratio}");
    }
}

/// Runs `wgray check` with an address space limit in KiB.
#[cfg(target_os = "linux")]
fn check_within(kibibytes: u32, scene: &Path) -> (Option<i32>, String) {
    let script = format!("ulimit -v {kibibytes}; exec \"$0\" check \"$1\"");
    let mut command = Command::new("sh");
    // Threads and malloc arenas reserve address space.
    command.envs([("RAYON_NUM_THREADS", "1"), ("MALLOC_ARENA_MAX", "1")]);
    command.args(["-c", &script, env!("CARGO_BIN_EXE_wgray")]).arg(scene);
    let out = command.output().expect("a shell");
    (
        out.status.code(),
        String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned(),
    )
}

/// Returns the minimum address space for a scene in KiB, to within 500 KiB.
#[cfg(target_os = "linux")]
fn address_space(scene: &Path) -> u32 {
    let (mut insufficient, mut sufficient) = (0, 200_000);
    assert_eq!(check_within(sufficient, scene).0, Some(0));
    while sufficient - insufficient > 500 {
        let limit = (insufficient + sufficient) / 2;
        match check_within(limit, scene).0 {
            Some(0) => sufficient = limit,
            _ => insufficient = limit,
        }
    }
    sufficient
}

#[cfg(target_os = "linux")]
#[test]
fn memory_is_a_small_multiple_of_the_scene_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    let text = scene(100_000, SPHERE);
    std::fs::write(&path, &text).unwrap();
    let small = folder.path().join("small.toml");
    std::fs::write(&small, scene(1, SPHERE)).unwrap();
    let program = address_space(&small);
    // docs/performance.md states 400 bytes for a sphere with its text; memory is allocated in larger chunks.
    let (code, message) = check_within(program + 65_000, &path);
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("; 100001 shapes; "), "{message}");
    assert_ne!(check_within(program + 20_000, &path).0, Some(0));
}

#[cfg(target_os = "linux")]
#[test]
fn images_are_refused_by_their_headers() {
    let folder = tempfile::tempdir().unwrap();
    let (width, bytes) = (16_384, 2048);
    let file = std::fs::File::create(folder.path().join("bits.png")).unwrap();
    let mut bits = png::Encoder::new(file, width, width);
    bits.set_depth(png::BitDepth::One);
    bits.set_color(png::ColorType::Grayscale);
    let mut writer = bits.write_header().unwrap();
    writer.write_image_data(&vec![0; bytes * width as usize]).unwrap();
    drop(writer);
    // A color profile that decompresses to a thousand times its size.
    let file = std::fs::File::create(folder.path().join("profile.png")).unwrap();
    let mut info = png::Info::with_size(4, 4);
    info.color_type = png::ColorType::Rgb;
    info.icc_profile = Some(vec![0; 300 << 20].into());
    let mut writer = png::Encoder::with_info(file, info).unwrap().write_header().unwrap();
    writer.write_image_data(&[200; 48]).unwrap();
    drop(writer);
    let path = folder.path().join("s.toml");
    std::fs::write(&path, scene(1, SPHERE)).unwrap();
    let program = address_space(&path);
    let check = |name: &str| {
        std::fs::write(
            &path,
            format!("{SCENE_START}[textures.t]\ntype = 'image'\nfile = '{name}'\n"),
        )
        .unwrap();
        check_within(program + 20_000, &path)
    };
    let (code, message) = check("bits.png");
    assert_eq!(code, Some(3), "{message}");
    assert!(
        message.contains("\"bits.png\" (16384 x 16384 texels) needs 1365.3 MiB"),
        "{message}"
    );
    let (code, message) = check("profile.png");
    assert_eq!(code, Some(0), "{message}");
}
