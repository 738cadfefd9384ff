//! The adapter that the tests run on, told before anything else, and what is known to differ on which driver.

use std::io::Write as _;
use std::sync::OnceLock;

use wgray_render::gpu::{Choice, Device, choose};

/// Part of the name, driver or type of the adapter to test, where there are several.
const ADAPTER: &str = "WGRAY_TEST_ADAPTER";
/// Set to 1 on a machine without an adapter, to run what needs none.
const WITHOUT: &str = "WGRAY_TEST_WITHOUT_GPU";

/// The adapter under test. `None` only where the environment says to do without one; without that, a missing adapter
/// fails the test that asks for it.
pub fn device() -> Option<&'static Device> {
    static DEVICE: OnceLock<Option<Device>> = OnceLock::new();
    DEVICE.get_or_init(open).as_ref()
}

fn open() -> Option<Device> {
    if std::env::var_os(WITHOUT).is_some_and(|value| value == "1") {
        tell("adapter: none, as WGRAY_TEST_WITHOUT_GPU=1 asks; GPU and CPU are not compared");
        return None;
    }
    let choice = std::env::var(ADAPTER).map_or(Choice::Auto, Choice::Named);
    match choose(&choice) {
        Ok(device) => {
            let info = &device.info;
            tell(&format!(
                "adapter: {}, {} ({}, {})",
                info.name, info.driver, info.backend, info.kind
            ));
            Some(device)
        }
        Err(error) => panic!("{error}. To run only the tests that need no adapter, set {WITHOUT}=1."),
    }
}

/// Past the test harness, which would swallow it.
fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}"); // a closed terminal is no reason to fail
}

/// Whether this device is software Vulkan, on which every picture must be the same bit for bit.
pub fn bit_exact(device: &Device) -> bool {
    device.info.exact && device.info.is_software()
}

/// A difference of one driver that is known and understood.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Part of the adapter's name or driver.
    pub adapter: &'static str,
    /// Which check: the name of a shared function, `denormal numbers` of all of them, `picture` or `first hits`.
    pub what: &'static str,
    /// Why.
    pub reason: &'static str,
    /// The largest share of the results that differs.
    pub share: f64,
}

/// All of them.
pub const KNOWN: &[Known] = &[
    swiftshader("denormal numbers", "zero taken for denormal numbers", 0.0096),
    swiftshader("grid_sample", ROUNDED_TWICE, 0.0014),
    swiftshader("rotated_grid_sample", ROUNDED_TWICE, 0.0014),
    swiftshader("jittered_sample", ROUNDED_TWICE, 0.0065),
    swiftshader("sample_square", ROUNDED_TWICE, 0.0008),
    swiftshader("filter_offset", ROUNDED_TWICE, 0.0102),
];

/// An integer that is made a float in two steps, each of which rounds. No picture has an index as large.
pub const ROUNDED_TWICE: &str = "unsigned integers from 2^31 on, which are rounded twice";

const fn swiftshader(what: &'static str, reason: &'static str, share: f64) -> Known {
    Known {
        adapter: "SwiftShader",
        what,
        reason,
        share,
    }
}

/// What the table allows a check on this device.
pub fn allowed<'a>(known: &'a [Known], name: &str, driver: &str, what: &str) -> Option<&'a Known> {
    known
        .iter()
        .find(|k| k.what == what && (name.contains(k.adapter) || driver.contains(k.adapter)))
}

/// Holds the share of results that differ against the table: without an entry none may, and an entry that no longer
/// applies must go.
pub fn judge(known: Option<&Known>, what: &str, share: f64) -> Result<(), String> {
    match known {
        None if share == 0.0 => Ok(()),
        None => Err(format!("{what}: {:.4} % of the results differ", share * 100.0)),
        Some(k) if share == 0.0 => Err(format!(
            "{what}: nothing differs any more, its entry must go: {}",
            k.reason
        )),
        Some(k) if share > k.share => Err(format!(
            "{what}: {share} of the results differ, not by {} alone",
            k.reason
        )),
        Some(_) => Ok(()),
    }
}

#[test]
fn known_differences_that_no_longer_apply_or_have_grown_fail() {
    let known = [Known {
        adapter: "Some GPU",
        what: "dot",
        reason: "division by an approximation",
        share: 0.1,
    }];
    let entry = allowed(&known, "Some GPU 9000", "driver 1", "dot");
    assert!(entry.is_some());
    assert!(judge(entry, "dot", 0.05).is_ok());
    assert!(judge(entry, "dot", 0.0).is_err(), "an entry that no longer applies");
    assert!(judge(entry, "dot", 0.2).is_err(), "more than is known");
    for (name, driver, what) in [("Some GPU", "driver 1", "cross"), ("Other", "driver 1", "dot")] {
        let entry = allowed(&known, name, driver, what);
        assert!(entry.is_none());
        assert!(judge(entry, what, 1e-6).is_err(), "an unknown difference");
        assert!(judge(entry, what, 0.0).is_ok());
    }
}

/// What the drivers can be asked for is told by them, so that a question that goes wrong is not taken for "nothing".
#[test]
fn software_vulkan_can_be_asked_for_float_controls() {
    let Some(device) = device().filter(|device| bit_exact(device)) else {
        return;
    };
    let controls = device.info.float_controls;
    if device.info.name.contains("llvmpipe") {
        assert!(controls.rounding && !controls.signed_zeros, "{controls:?}");
    } else if device.info.name.contains("SwiftShader") {
        assert!(controls.signed_zeros, "{controls:?}");
    }
}
