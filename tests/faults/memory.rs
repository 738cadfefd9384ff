//! Device memory exhaustion: an error with the sizes, or the fallback to the CPU.

use crate::test_folder::TestFolder;

use super::driver::{Ran, SCENE, driver};

const ADVICE: &str = "; render a crop or a smaller image, or use the CPU \
                      (--crop, --size, --device cpu)\n";

fn assert_out_of_memory(ran: &Ran, parts: &[&str]) {
    assert_eq!((ran.code, ran.picture.is_some()), (7, false), "{}", ran.stderr);
    assert!(ran.stderr.starts_with("error: llvmpipe"), "{}", ran.stderr);
    assert_eq!(ran.lines().len(), 1, "{}", ran.stderr);
    for part in parts {
        assert!(ran.stderr.contains(part), "{part}: {}", ran.stderr);
    }
}

#[test]
fn a_film_that_does_not_fit_is_reported_with_its_size() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let (large, gpu) = (["--size", "1024x1024"], ["--device", "gpu"]);
    let expected = place.expected(driver, &large);
    let ran = place.run_on(driver, &[large, gpu].concat(), &[("FAULTS_LARGEST", "8388608")]);
    let parts = [
        ": out of memory: the driver has no 16.0 MiB for a film of 1024 x 1024 pixels",
        ADVICE,
    ];
    assert_out_of_memory(&ran, &parts);
    assert!(ran.count("allocation") > 0 && ran.log.iter().any(|line| line.ends_with("of 16777216 refused")));
    // A crop fits; with a higher limit, the whole film does.
    let crop = ["--size", "1024x1024", "--crop", "0,0,1024,64", "--device", "gpu"];
    let ran = place.run_on(driver, &crop, &[("FAULTS_LARGEST", "8388608")]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    let ran = place.run_on(driver, &[large, gpu].concat(), &[("FAULTS_LARGEST", "67108864")]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
    assert!(ran.picture.as_ref() == Some(&expected));
    let ran = place.run_on(
        driver,
        &[large, ["--device", "auto"]].concat(),
        &[("FAULTS_LARGEST", "8388608")],
    );
    assert_eq!((ran.code, ran.lines().len()), (0, 1), "{}", ran.stderr);
    assert!(
        ran.stderr.starts_with("warning: rendering on the CPU: llvmpipe"),
        "{}",
        ran.stderr
    );
    assert!(ran.picture == Some(expected));
}

/// Each allocation of the device, the film and the readbacks fails in turn.
#[test]
fn exhausted_memory_is_reported_or_the_cpu_renders() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let large = ["--size", "1024x1024"];
    let expected = place.expected(driver, &large);
    let free = place.run_on(driver, &[large, ["--device", "gpu"]].concat(), &[]);
    let allocations = free.count("allocation");
    assert!((2..100).contains(&allocations), "{:?}", free.log);
    let mut refused = 0;
    for from in 1..=allocations {
        let from = from.to_string();
        let faults = [("FAULTS_NO_MEMORY_FROM", from.as_str())];
        let ran = place.run_on(driver, &[large, ["--device", "gpu"]].concat(), &faults);
        // The number of allocations depends on timing.
        if ran.log.iter().any(|line| line.ends_with("refused")) {
            assert_out_of_memory(&ran, &[": out of memory: the driver has n"]);
            refused += 1;
        } else {
            assert_eq!(ran.code, 0, "{from}: {}", ran.stderr);
        }
        let ran = place.run_on(driver, &[large, ["--device", "auto"]].concat(), &faults);
        assert_eq!(ran.code, 0, "{from}: {}", ran.stderr);
        assert!(ran.picture.as_ref() == Some(&expected), "{from}");
    }
    assert!(refused >= 2, "{refused}");
}

#[test]
fn a_scene_that_does_not_fit_is_reported_with_its_size() {
    let Some(driver) = driver() else { return };
    let textured = SCENE.replace("color = [0.5, 0.4, 0.3]", "color = { texture = \"large\" }")
        + "[textures.large]\ntype = \"image\"\nfile = \"large.png\"\n";
    let place = TestFolder::of(&textured);
    // 4 MiB of texels, and a third of that for the mip levels.
    let large = image::RgbImage::from_fn(1024, 1024, |x, y| image::Rgb([x as u8, y as u8, (x * y) as u8]));
    large.save(place.path("large.png")).expect("an image");
    let limit = [("FAULTS_LARGEST", "4194304")];
    let ran = place.run_on(driver, &["--device", "gpu"], &limit);
    assert_out_of_memory(
        &ran,
        &[": out of memory: the driver has no 5.3 MiB for the scene; ", ADVICE],
    );
    let ran = place.run_on(driver, &["--device", "gpu"], &[]);
    assert_eq!((ran.code, ran.stderr.as_str()), (0, ""));
}

/// wgpu drops the device when a submit runs out of memory.
#[test]
fn a_submit_without_memory_is_not_a_device_loss() {
    let Some(driver) = driver() else { return };
    let place = TestFolder::of(SCENE);
    let expected = place.expected(driver, &[]);
    for submit in ["1", "2", "3", "4", "5"] {
        let faults = [("FAULTS_NO_MEMORY_IN", submit)];
        let ran = place.run_on(driver, &["--device", "gpu"], &faults);
        assert_out_of_memory(&ran, &[": out of memory: the driver has no "]);
        let ran = place.run_on(driver, &["--device", "auto"], &faults);
        assert_eq!((ran.code, ran.lines().len()), (0, 1), "{submit}: {}", ran.stderr);
        assert!(ran.picture.as_ref() == Some(&expected), "{submit}");
    }
    let refused = [("FAULTS_REFUSE_FIRST", "1"), ("FAULTS_REFUSE_WITH", "-2")];
    let ran = place.run_on(driver, &["--device", "gpu"], &refused);
    assert_out_of_memory(&ran, &[": out of memory: the driver has no memory to open it; "]);
}
