//! Failing memory allocations: the program ends with an error message and exit code 7.

use std::fmt::Write as _;

use super::TestFolder;

/// Writes a scene with a mesh of 180,000 triangles.
fn write_large_scene(folder: &TestFolder) {
    const SIDE: usize = 300;
    let mut mesh = String::new();
    for y in 0..=SIDE {
        for x in 0..=SIDE {
            let height = (x * 7 + y * 13) % 5;
            let _ = writeln!(mesh, "v {x} {y} {height}");
        }
    }
    for y in 0..SIDE {
        for x in 0..SIDE {
            let [a, b] = [y, y + 1].map(|y| y * (SIDE + 1) + x + 1);
            let _ = writeln!(mesh, "f {a} {} {} {b}", a + 1, b + 1);
        }
    }
    folder.write("mesh.obj", &mesh);
    folder.write(
        "large.toml",
        "image = { width = 64, height = 64 }\ncamera = { position = [150, -300, 200], look_at = [150, 150, 0], fov = 60 }\n\
         [materials.m]\ntype = \"phong\"\ncolor = [1, 1, 1]\n\
         [[shapes]]\ntype = \"mesh\"\nfile = \"mesh.obj\"\nmaterial = \"m\"\n",
    );
}

/// Whichever allocation fails first, the program prints one line and leaves no image.
#[test]
fn failed_allocations_end_a_render_with_code_7() {
    let folder = TestFolder::new();
    write_large_scene(&folder);
    let before = folder.files();
    let (mut failed, mut succeeded) = (0, 0);
    for limit in (0..24).map(|i| 24_000 + 5_000 * i) {
        let options = "--spp 1 --device cpu --threads 1 -o out.png --checkpoint c -q";
        let line = format!("ulimit -v {limit}; RUST_BACKTRACE=1 $0 render large.toml {options}");
        let result = folder.shell("sh", &line);
        let is_loaded = ![127, 139, -1].contains(&result.code) && !result.stderr.contains("an alternative stack");
        if failed == 0 && !is_loaded {
            continue; // the program, or Rust's runtime, cannot start within the limit
        }
        match result.code {
            0 => {
                succeeded += 1;
                assert_eq!(result.stderr, "");
                for name in ["out.png", "c"] {
                    std::fs::remove_file(folder.path(name)).expect("written");
                }
            }
            code => {
                failed += 1;
                assert_eq!(code, 7, "{limit}: {}", result.stderr);
                assert!(result.stderr.starts_with("error: "), "{limit}: {}", result.stderr);
                assert!(result.stderr.contains("out of memory"), "{limit}: {}", result.stderr);
                assert_eq!(result.stderr.lines().count(), 1, "{limit}: {}", result.stderr);
                let _ = std::fs::remove_file(folder.path("c")); // the checkpoint remains for --resume
            }
        }
        assert_eq!(folder.files(), before, "{limit}");
    }
    assert!(failed > 2 && succeeded > 3, "{failed} failed, {succeeded} succeeded");
}

/// Some limits are too low even for the threads of the program, so other exit codes occur, too.
#[test]
fn failed_allocations_end_other_commands_with_code_7() {
    let folder = TestFolder::new();
    write_large_scene(&folder);
    let mut failed = 0;
    for limit in (0..24).map(|i| 24_000 + 1_500 * i) {
        for command in ["check large.toml", "info large.toml", "diff mesh.obj large.toml"] {
            let result = folder.shell("sh", &format!("ulimit -v {limit}; RUST_BACKTRACE=1 $0 {command}"));
            failed += usize::from(result.code == 7);
            assert!(
                !result.stderr.contains("panicked"),
                "{command} {limit}: {}",
                result.stderr
            );
        }
    }
    assert!(failed > 2, "{failed}");
}

/// The program compares the size of an image with the available memory, so no allocation fails.
#[test]
fn images_that_exceed_the_memory_are_errors() {
    let folder = TestFolder::new();
    let options = "--spp 1 --size 30000x30000 --time-limit 1 --device cpu --threads 1 -o out.png";
    let result = folder.shell(
        "sh",
        &format!("ulimit -v 2000000; $0 render small.toml --pixel-pattern sobol {options}"),
    );
    assert_eq!(result.code, 7, "{}", result.stderr);
    assert!(!result.stderr.contains("cannot allocate"), "{}", result.stderr);
    assert!(folder.files().is_empty());
}
