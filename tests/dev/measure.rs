//! `--measure` leaves nothing behind.
#![cfg(unix)]

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::running::{Files, LONGEST, SCENE};

#[test]
fn an_interrupted_measurement_leaves_no_files() {
    crate::cli::heed_interrupts();
    let files = Files::new(SCENE);
    let temporary = tempfile::tempdir().unwrap();
    let mut program = Command::new(assert_cmd::cargo::cargo_bin!("wgray"))
        .args(["dev", "scene.toml", "--shaders", "shaders", "--measure"])
        .current_dir(files.folder.path())
        .env("TMPDIR", temporary.path())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let names = || -> Vec<_> {
        let entries = fs::read_dir(files.folder.path()).unwrap();
        entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect()
    };
    let start = Instant::now();
    while !(names().iter().any(|name| name.starts_with(".wgray-measure-"))
        && fs::read_dir(temporary.path()).unwrap().next().is_some())
    {
        assert!(start.elapsed() < LONGEST, "it does not begin");
        assert!(program.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(300)); // into the middle
    Command::new("kill")
        .args(["-INT", &program.id().to_string()])
        .status()
        .unwrap();
    assert_eq!(program.wait().unwrap().code(), Some(130));
    let mut left = names();
    left.sort();
    assert_eq!(left, ["scene.toml", "shaders"]);
    assert_eq!(fs::read_dir(temporary.path()).unwrap().count(), 0);
}
