//! Failing memory allocations of the program.

use std::fmt::Write as _;

use super::TestFolder;

/// Writes a scene with a mesh of several hundred megabytes.
fn large(place: &TestFolder) {
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
    place.write("mesh.obj", &mesh);
    place.write(
        "large.toml",
        "image = { width = 64, height = 64 }\ncamera = { position = [150, -300, 200], look_at = [150, 150, 0], fov = 60 }\n\
         [materials.m]\ntype = \"phong\"\ncolor = [1, 1, 1]\n\
         [[shapes]]\ntype = \"mesh\"\nfile = \"mesh.obj\"\nmaterial = \"m\"\n",
    );
}

/// Whichever allocation fails first, the program prints one line and leaves no file.
#[test]
fn failed_allocations_end_a_render_with_code_7() {
    let place = TestFolder::new();
    large(&place);
    let before = place.files();
    let (mut failed, mut succeeded) = (0, 0);
    for limit in (0..24).map(|i| 24_000 + 5_000 * i) {
        let options = "--spp 1 --device cpu --threads 1 -o out.png --checkpoint c -q";
        let line = format!("ulimit -v {limit}; RUST_BACKTRACE=1 $0 render large.toml {options}");
        let ran = place.shell("sh", &line);
        let is_not_loaded = failed == 0 && [127, 139, -1].contains(&ran.code);
        if is_not_loaded {
            continue; // the limit does not even permit the program to be loaded
        }
        match ran.code {
            0 => {
                succeeded += 1;
                assert_eq!(ran.stderr, "");
                for name in ["out.png", "c"] {
                    std::fs::remove_file(place.path(name)).expect("written");
                }
            }
            code => {
                failed += 1;
                assert_eq!(code, 7, "{limit}: {}", ran.stderr);
                assert!(ran.stderr.starts_with("error: "), "{limit}: {}", ran.stderr);
                assert!(ran.stderr.contains("out of memory"), "{limit}: {}", ran.stderr);
                assert_eq!(ran.stderr.lines().count(), 1, "{limit}: {}", ran.stderr);
                let _ = std::fs::remove_file(place.path("c")); // the checkpoint remains for --resume
            }
        }
        assert_eq!(place.files(), before, "{limit}");
    }
    assert!(failed > 2 && succeeded > 3, "{failed} failed, {succeeded} succeeded");
}

/// Memory is too small for all threads.
#[test]
fn failed_allocations_end_other_commands_with_code_7() {
    let place = TestFolder::new();
    large(&place);
    let mut failed = 0;
    for limit in (0..24).map(|i| 24_000 + 1_500 * i) {
        for command in ["check large.toml", "info large.toml", "diff mesh.obj large.toml"] {
            let ran = place.shell("sh", &format!("ulimit -v {limit}; RUST_BACKTRACE=1 $0 {command}"));
            failed += usize::from(ran.code == 7);
            assert!(!ran.stderr.contains("panicked"), "{command} {limit}: {}", ran.stderr);
        }
    }
    assert!(failed > 2, "{failed}");
}

/// An image that exceeds the memory is reported as an error, not as a failed allocation.
#[test]
fn images_that_exceed_the_memory_are_errors() {
    let place = TestFolder::new();
    let options = "--spp 1 --size 30000x30000 --time-limit 1 --device cpu --threads 1 -o out.png";
    let ran = place.shell(
        "sh",
        &format!("ulimit -v 2000000; $0 render small.toml --pixel-pattern sobol {options}"),
    );
    assert_eq!(ran.code, 7, "{}", ran.stderr);
    assert!(!ran.stderr.contains("cannot allocate"), "{}", ran.stderr);
    assert!(place.files().is_empty());
}
