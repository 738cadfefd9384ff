//! Device loss: the device is re-opened, up to a limit of losses in a row, and the image does not change.

use std::io::{Read as _, Write as _};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::test_folder::TestFolder;

use super::driver::{Ran, SCENE, driver};

const WAYS: [&str; 3] = ["submit", "status", "wait"];

/// Submits of [`SCENE`]: warm-up, samples, film, first hits, readback.
const SUBMITS: usize = 5;

const GPU: [&str; 2] = ["--device", "gpu"];
const AUTO: [&str; 2] = ["--device", "auto"];

/// Checks that the messages are `reopened` warnings, followed by lines that start with `rest`.
fn assert_reopened(ran: &Ran, reopened: usize, rest: &[&str]) {
    let lines = ran.lines();
    assert_eq!(lines.len(), reopened + rest.len(), "{}", ran.stderr);
    for line in &lines[..reopened] {
        assert!(line.starts_with("warning: llvmpipe"), "{line}");
        assert!(line.contains(": the device was lost: the driver ended it"), "{line}");
        assert!(line.ends_with("; re-opening it"), "{line}");
    }
    for (line, start) in lines[reopened..].iter().zip(rest) {
        assert!(line.starts_with(start), "{line}");
    }
}

#[test]
fn without_faults_the_driver_renders_as_lavapipe_does() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    for device in [GPU, AUTO, ["--device", "llvmpipe"]] {
        let ran = place.run_on(driver, &device, &[]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{device:?}");
        assert_eq!(
            (ran.count("device"), ran.count("submit")),
            (1, SUBMITS),
            "{:?}",
            ran.log
        );
        assert!(ran.picture == Some(expected.clone()), "{device:?}");
    }
    // Negative control: another seed.
    let other = place.run_on(driver, &["--device", "gpu", "--seed", "7"], &[]);
    assert!(other.code == 0 && other.picture != Some(expected));
}

#[test]
fn a_device_lost_anywhere_is_reopened() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    for way in WAYS {
        for submit in 1..=SUBMITS {
            let at = submit.to_string();
            let ran = place.run_on(driver, &GPU, &[("FAULTS_LOSE", &at), ("FAULTS_LOSE_IN", way)]);
            assert_eq!(ran.code, 0, "{way} {submit}: {}", ran.stderr);
            assert_reopened(&ran, 1, &[]);
            let happened = (
                ran.count("lost in"),
                ran.count(&format!("lost in {way}")),
                ran.count("device"),
            );
            assert_eq!(happened, (1, 1, 2), "{way} {submit}: {:?}", ran.log);
            assert!(ran.picture == Some(expected.clone()), "{way} {submit}");
        }
    }
}

#[test]
fn a_device_lost_several_times_is_reopened_each_time() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    let twice = place.run_on(driver, &GPU, &[("FAULTS_LOSE", "2,4")]);
    assert_eq!((twice.code, twice.count("lost")), (0, 2), "{}", twice.stderr);
    assert_reopened(&twice, 2, &[]);
    assert!(twice.picture == Some(expected.clone()));
    // Two losses in the samples, then two in the first hits: at the last submit but one and after the following
    // warm-up. Four losses in a row would exceed the limit.
    let hits = twice.count("submit") - 1;
    let lose = format!("2,4,{hits},{}", hits + 2);
    // The number of submits before the first hits depends on timing, so a run may miss them.
    let mut runs = (0..5).map(|_| place.run_on(driver, &GPU, &[("FAULTS_LOSE", &lose)]));
    let ran = runs.find(|ran| (ran.code, ran.count("lost")) == (0, 4));
    let ran = ran.unwrap_or_else(|| panic!("{lose}: no run of five survived four losses"));
    assert_reopened(&ran, 4, &[]);
    assert!(ran.picture == Some(expected));
}

/// Losses in the middle of many dispatches.
#[test]
fn a_long_render_survives() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let size = ["--size", "512x512", "--spp", "16"];
    let expected = place.expected(driver, &size);
    for way in WAYS {
        let ran = place.run_on(
            driver,
            &[&size[..], &GPU].concat(),
            &[("FAULTS_LOSE", "4"), ("FAULTS_LOSE_IN", way)],
        );
        assert_eq!((ran.code, ran.count("lost")), (0, 1), "{way}: {}", ran.stderr);
        assert_reopened(&ran, 1, &[]);
        assert!(ran.picture == Some(expected.clone()), "{way}");
    }
}

#[test]
fn a_permanently_lost_device_is_an_error_or_the_cpu_renders() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    // In parallel, because each run waits for some seconds.
    let never = |lose: &str, device: &str| {
        let place = TestFolder::of(SCENE);
        let faults = [("FAULTS_LOSE", lose), ("FAULTS_REFUSE", "99")];
        let ran = place.run_on(driver, &["--device", device], &faults);
        assert_eq!((ran.code, ran.picture.is_some()), (6, false), "{lose}");
        assert_reopened(&ran, 1, &["error: llvmpipe"]);
        let end = "; it could not be opened again: the driver does not open it";
        assert!(ran.stderr.trim_end().ends_with(end), "{}", ran.stderr);
        assert_eq!((ran.count("device refused"), ran.count("lost")), (3, 1));
        let requeue = ["--device", device, "--requeue-exit", "75"];
        let ran = place.run_on(driver, &requeue, &faults);
        assert_eq!((ran.code, ran.picture.is_some()), (75, false), "{lose}");
        assert_reopened(
            &ran,
            1,
            &["error: llvmpipe", "note: exit code 75 requests another attempt"],
        );
        let ran = place.run_on(driver, &[&AUTO[..], &requeue[2..]].concat(), &faults);
        assert_eq!(ran.code, 0, "{lose}: {}", ran.stderr);
        assert_reopened(&ran, 1, &["warning: rendering on the CPU: llvmpipe"]);
        assert!(ran.picture == Some(expected.clone()), "{lose}");
    };
    std::thread::scope(|scope| {
        for (lose, device) in [("1", "gpu"), ("2", "llvmpipe"), ("4", "gpu")] {
            let never = &never;
            scope.spawn(move || never(lose, device));
        }
    });
    let faults = [("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "99")];
    let ran = place.run_on(driver, &["--device", "auto", "--quiet"], &faults);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(ran.picture == Some(expected.clone()));
    // The program waits for a device that reopens late.
    let late = [("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "2")];
    let ran = place.run_on(driver, &GPU, &late);
    assert_eq!((ran.code, ran.count("device refused")), (0, 2), "{}", ran.stderr);
    assert_reopened(&ran, 1, &[]);
    assert!(ran.picture == Some(expected));
}

#[test]
fn repeated_losses_reach_a_limit() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    // In the warm-up the device never becomes ready; in the samples each loss is reported.
    let again = |lose: &str, reopened: usize| {
        let place = TestFolder::of(SCENE);
        let ran = place.run_on(driver, &GPU, &[("FAULTS_LOSE", lose)]);
        assert_eq!((ran.code, ran.picture.is_some()), (6, false), "{lose}");
        assert_eq!(
            (ran.count("lost"), ran.count("device")),
            (4, 4),
            "{lose}: {:?}",
            ran.log
        );
        assert_reopened(&ran, reopened, &["error: llvmpipe"]);
        let ran = place.run_on(driver, &AUTO, &[("FAULTS_LOSE", lose)]);
        assert_eq!((ran.code, ran.count("lost")), (0, 4), "{lose}: {}", ran.stderr);
        assert_reopened(&ran, reopened, &["warning: rendering on the CPU: llvmpipe"]);
        assert!(ran.picture == Some(expected.clone()), "{lose}");
    };
    std::thread::scope(|scope| {
        for (lose, reopened) in [("every:1", 1), ("every:2", 3)] {
            let again = &again;
            scope.spawn(move || again(lose, reopened));
        }
    });
}

/// With these return codes, wgpu panics when it drops the queue.
#[test]
fn a_panic_on_dropping_a_lost_device_is_caught() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    for code in ["-1", "-2", "-13"] {
        for way in WAYS {
            let faults = [("FAULTS_LOSE", "2"), ("FAULTS_LOSE_IN", way), ("FAULTS_IDLE", code)];
            let ran = place.run_on(driver, &GPU, &faults);
            assert_eq!((ran.code, ran.count("lost")), (0, 1), "{code} {way}: {}", ran.stderr);
            assert!(ran.count("idle") > 0, "the driver was not asked: {:?}", ran.log);
            assert_reopened(&ran, 1, &[]);
            assert!(ran.picture == Some(expected.clone()), "{code} {way}");
        }
    }
}

#[test]
fn a_requested_device_is_opened_repeatedly() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    let ran = place.run_on(driver, &GPU, &[("FAULTS_REFUSE_FIRST", "2")]);
    assert_eq!((ran.code, ran.count("device refused")), (0, 2), "{}", ran.stderr);
    assert!(ran.picture == Some(expected.clone()));
    let ran = place.run_on(driver, &GPU, &[("FAULTS_REFUSE_FIRST", "99")]);
    assert_eq!((ran.code, ran.picture.is_some()), (6, false), "{}", ran.stderr);
    let ran = place.run_on(driver, &AUTO, &[("FAULTS_REFUSE_FIRST", "99")]);
    assert_eq!(
        (ran.code, ran.count("device refused")),
        (0, 1),
        "the program did not open another device at once: {}",
        ran.stderr
    );
    assert!(ran.picture == Some(expected));
}

#[test]
fn a_slow_submit_does_not_change_the_image() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let size = ["--size", "256x256"];
    let expected = place.expected(driver, &size);
    let ran = place.run_on(driver, &[&size[..], &GPU].concat(), &[("FAULTS_SLEEP", "2:1500")]);
    assert_eq!((ran.code, ran.stderr.as_str(), ran.count("sleep")), (0, "", 1));
    assert!(ran.picture == Some(expected));
}

#[test]
fn waiting_for_a_device_can_be_interrupted() {
    let Some(driver) = driver() else { return };
    crate::cli::heed_interrupts();
    let place = TestFolder::of(SCENE);
    let faults = [("FAULTS_LOSE", "2"), ("FAULTS_REFUSE", "99")];
    let mut child = place.start(driver, &GPU, &faults);
    // After two failures, the longest pause (2 s) has begun.
    let log = place.path("log");
    let refused = || std::fs::read_to_string(&log).map_or(0, |log| log.matches("device refused").count());
    let start = Instant::now();
    while refused() < 2 {
        assert!(start.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(10));
    }
    let sent = Instant::now();
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(killed.unwrap().success());
    let status = child.wait().unwrap();
    assert!(sent.elapsed() < Duration::from_millis(1500), "{:?}", sent.elapsed());
    assert_eq!(status.code(), Some(130));
    assert_eq!(refused(), 2, "the program did not stop during the pause");
    let mut message = String::new();
    child.stderr.unwrap().read_to_string(&mut message).unwrap();
    assert!(!message.contains("panicked"), "{message}");
    assert!(!place.path("out.exr").exists());
}

/// Environment variable with the number of random cases.
const CASES: &str = "WGRAY_TEST_FAULTS";

/// `scripts/test-slow faults` runs many cases.
#[test]
fn random_faults_do_not_change_the_image() {
    let Some(driver) = driver() else { return };
    let asked = std::env::var(CASES).ok();
    let cases = asked
        .as_ref()
        .map_or(4, |n| n.parse().expect("WGRAY_TEST_FAULTS is a number"));
    let place = TestFolder::of(SCENE);
    let size = ["--size", "320x240", "--spp", "16"];
    let expected = place.expected(driver, &size);
    let (mut losses, mut refused, mut on_cpu) = (0, 0, 0);
    for case in 0..cases {
        let faults = at_random(&mut Draws::new(case));
        let faults: Vec<(&str, &str)> = faults.iter().map(|(name, value)| (*name, value.as_str())).collect();
        let ran = place.run_on(driver, &[&size[..], &AUTO].concat(), &faults);
        assert_eq!(ran.code, 0, "{faults:?}: {}", ran.stderr);
        assert!(ran.picture.as_ref() == Some(&expected), "{faults:?}");
        losses += ran.count("lost");
        refused += ran.log.iter().filter(|line| line.ends_with("refused")).count();
        on_cpu += usize::from(ran.stderr.contains("rendering on the CPU"));
    }
    if asked.is_some() {
        let what = format!("{losses} losses, {refused} refusals, {on_cpu} of them ended by the CPU");
        let _ = writeln!(
            std::io::stderr(),
            "{cases} renders with faults: {what}; all images equal"
        );
    }
    assert!(losses as u64 >= cases, "{losses} losses in {cases} renders");
}

/// Returns losses a few submits apart, failing device creations after each, and sometimes a lack of memory.
fn at_random(draws: &mut Draws) -> Vec<(&'static str, String)> {
    let mut submit = 1 + draws.below(5);
    let mut lose = submit.to_string();
    for _ in 0..draws.below(5) {
        submit += 1 + draws.below(5);
        lose += &format!(",{submit}");
    }
    let mut faults = vec![
        ("FAULTS_LOSE", lose),
        ("FAULTS_LOSE_IN", WAYS[draws.below(3) as usize].to_string()),
        ("FAULTS_REFUSE", draws.below(6).saturating_sub(2).to_string()),
    ];
    if draws.below(4) == 0 {
        faults.push(("FAULTS_NO_MEMORY_FROM", (5 + draws.below(20)).to_string()));
    }
    faults
}

struct Draws(u64);

impl Draws {
    fn new(seed: u64) -> Draws {
        Draws(seed)
    }

    /// Returns a number below `end`: SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
    /// generators", 2014, figure 17).
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }
}
