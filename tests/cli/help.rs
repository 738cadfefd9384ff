//! The help of all commands.

use super::{Ran, TestFolder};

fn listed(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap_or_default();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter(|line| !line.starts_with("   ")); // continuation lines of a description are indented
    let names = names.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// Calls `each` with the words of every command.
fn for_each_command(place: &TestFolder, words: &[&str], each: &mut dyn FnMut(&[&str])) {
    each(words);
    let help = place.run(&[words, &["-h"]].concat()).stdout;
    for name in listed(&help) {
        for_each_command(place, &[words, &[&name]].concat(), each);
    }
}

#[test]
fn help_is_short() {
    let place = TestFolder::new();
    let mut commands = 0;
    for_each_command(&place, &[], &mut |words| {
        commands += 1;
        for (option, most) in [("-h", 60), ("--help", 120)] {
            let Ran {
                code, stdout, stderr, ..
            } = place.run(&[words, &[option]].concat());
            assert_eq!((code, stderr.as_str()), (0, ""), "{words:?} {option}");
            let lines = stdout.lines().count();
            assert!(
                (5..=most).contains(&lines),
                "{words:?} {option}: {lines} lines\n{stdout}"
            );
            let widest = stdout.lines().map(|line| line.chars().count()).max().unwrap_or(0);
            assert!(widest <= 100, "{words:?} {option}: {widest} columns");
        }
    });
    assert!(commands >= 12, "{commands}");
}

/// `-h` omits rarely used options.
#[test]
fn the_long_help_lists_all_options() {
    let place = TestFolder::new();
    let short = place.run(&["render", "-h"]).stdout;
    let long = place.run(&["render", "--help"]).stdout;
    assert!(!short.contains("--exr-compression") && short.contains("(see more with '--help')"));
    assert!(long.contains("--exr-compression") && long.contains("--checkpoint-interval"));
    assert_eq!(place.run(&["help", "render"]).stdout, long);
    let page = place.run(&["man", "render"]).stdout;
    for line in long.lines().filter_map(|line| line.trim_start().split_once("--")) {
        let option = line.1.split([' ', ',']).next().unwrap_or_default();
        assert!(page.contains(&option.replace('-', "\\-")), "{option}");
    }
}

#[test]
fn the_most_used_options_come_first() {
    let place = TestFolder::new();
    let help = place.run(&["render", "-h"]).stdout;
    let place_of = |option: &str| help.find(option).unwrap_or_else(|| panic!("{option}: {help}"));
    let first = [
        "--output",
        "--size",
        "--spp",
        "--view",
        "--device",
        "--environment",
        "--frames",
    ];
    assert!(first.map(place_of).is_sorted(), "{help}");
}

#[test]
fn common_mistakes_have_hints() {
    let place = TestFolder::new();
    for (arguments, message, hint) in [
        (
            &["render", "small.toml", "--width", "64"][..],
            "unexpected argument '--width'",
            "use '--size WIDTHxHEIGHT'",
        ),
        (
            &["render", "small.toml", "--height=64"],
            "unexpected argument '--height'",
            "use '--size WIDTHxHEIGHT'",
        ),
        (
            &["render", "small.toml", "--transparent"],
            "unexpected argument '--transparent'",
            "use '--background none'",
        ),
        (
            &["render", "small.toml", "--hdri", "a.hdr"],
            "unexpected argument '--hdri'",
            "use '--environment FILE.hdr'",
        ),
        (
            &["render", "small.toml", "-s", "64"],
            "unexpected argument '-s'",
            "use '--size WIDTHxHEIGHT' or '--spp N'",
        ),
        (
            &["render", "small.toml", "--denoise"],
            "unexpected argument '--denoise'",
            "use '--spp N'; more samples reduce noise",
        ),
        (
            &["render", "small.toml", "--turntable", "0"],
            "invalid value '0' for '--turntable <N>'",
            "must be a whole number from 1 to 100000",
        ),
        (
            &["render", "small.toml", "--seed", "-1"],
            "invalid value '-1' for '--seed <N>'",
            "must be a whole number from 0 to 4294967295",
        ),
        (
            &["render", "small.toml", "--quality", "101"],
            "invalid value '101' for '--quality <N>'",
            "must be a whole number from 1 to 100",
        ),
        (
            &["render", "small.toml", "--spp", "1e9"],
            "invalid value '1e9' for '--spp <N>'",
            "must be a whole number from 1 to 65536",
        ),
        (
            &["render", "small.toml", "--cpu"],
            "unexpected argument '--cpu'",
            "use '--device cpu'",
        ),
        (
            &["box.glb"],
            "unrecognized subcommand 'box.glb'",
            "use 'wgray render box.glb'",
        ),
        (
            &["models/Box.OBJ", "-o", "a.png"],
            "unrecognized subcommand",
            "use 'wgray render models/Box.OBJ'",
        ),
        (&["rendr"], "unrecognized subcommand 'rendr'", "'render'"),
        (
            &["render", "small.toml", "--spp", "abc"],
            "invalid value 'abc' for '--spp <N>'",
            "must be a whole number from 1 to 65536",
        ),
        (&["render", "small.toml", "--spp", "0"], "--spp: 0 must be from 1", ""),
        (
            &["render", "small.toml", "--samples", "0"],
            "--spp: 0 must be from 1",
            "",
        ),
        (
            &[
                "render",
                "small.toml",
                "--environment",
                "forest",
                "--integrator",
                "path",
            ],
            "studio, sky, an image file",
            "white",
        ),
        (
            &["render", "small.toml", "--background", "forest"],
            "none or a color",
            "white",
        ),
    ] {
        let ran = place.run(arguments);
        assert_eq!(
            (ran.code, ran.stdout.as_str()),
            (2, ""),
            "{arguments:?}: {}",
            ran.stderr
        );
        assert!(
            ran.stderr.contains(message) && ran.stderr.contains(hint),
            "{arguments:?}: {}",
            ran.stderr
        );
    }
    let ran = place.run(&["box.glb", "--log-format", "json"]);
    assert!(ran.stderr.contains("wgray render box.glb"), "{}", ran.stderr);
    for option in ["--spp", "--samples", "--pixel-samples"] {
        place.quietly(&["render", "small.toml", option, "2", "-o", "few.png"]);
        place.quietly(&["render", "small.toml", "--background", "white", "-o", "white.png"]);
    }
}
