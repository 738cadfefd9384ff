//! The help of all commands.

use super::{RunResult, TestFolder};

fn command_names(help: &str) -> Vec<String> {
    let list = help.split("Commands:\n").nth(1).unwrap_or_default();
    let lines = list.lines().take_while(|line| !line.is_empty());
    let names = lines.filter(|line| !line.starts_with("   ")); // continuation lines of a description are indented
    let names = names.filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

/// Calls `visit` with the words of each command.
fn for_each_command(folder: &TestFolder, words: &[&str], visit: &mut dyn FnMut(&[&str])) {
    visit(words);
    let help = folder.run(&[words, &["-h"]].concat()).stdout;
    for name in command_names(&help) {
        for_each_command(folder, &[words, &[&name]].concat(), visit);
    }
}

#[test]
fn help_is_short() {
    let folder = TestFolder::new();
    let mut commands = 0;
    for_each_command(&folder, &[], &mut |words| {
        commands += 1;
        for (option, max_lines) in [("-h", 60), ("--help", 120)] {
            let RunResult {
                code, stdout, stderr, ..
            } = folder.run(&[words, &[option]].concat());
            assert_eq!((code, stderr.as_str()), (0, ""), "{words:?} {option}");
            let lines = stdout.lines().count();
            assert!(
                (5..=max_lines).contains(&lines),
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
    let folder = TestFolder::new();
    let short = folder.run(&["render", "-h"]).stdout;
    let long = folder.run(&["render", "--help"]).stdout;
    assert!(!short.contains("--exr-compression") && short.contains("(see more with '--help')"));
    assert!(long.contains("--exr-compression") && long.contains("--checkpoint-interval"));
    assert_eq!(folder.run(&["help", "render"]).stdout, long);
    let page = folder.run(&["man", "render"]).stdout;
    for line in long.lines().filter_map(|line| line.trim_start().split_once("--")) {
        let option = line.1.split([' ', ',', '[']).next().unwrap_or_default();
        assert!(page.contains(&option.replace('-', "\\-")), "{option}");
    }
}

#[test]
fn the_most_used_options_come_first() {
    let folder = TestFolder::new();
    let help = folder.run(&["render", "-h"]).stdout;
    let position = |option: &str| help.find(option).unwrap_or_else(|| panic!("{option}: {help}"));
    let options = [
        "--output",
        "--size",
        "--spp",
        "--view",
        "--device",
        "--environment",
        "--frames",
    ];
    assert!(options.map(position).is_sorted(), "{help}");
}

#[test]
fn common_mistakes_have_hints() {
    let folder = TestFolder::new();
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
        let result = folder.run(arguments);
        assert_eq!(
            (result.code, result.stdout.as_str()),
            (2, ""),
            "{arguments:?}: {}",
            result.stderr
        );
        assert!(
            result.stderr.contains(message) && result.stderr.contains(hint),
            "{arguments:?}: {}",
            result.stderr
        );
    }
    let result = folder.run(&["box.glb", "--log-format", "json"]);
    assert!(result.stderr.contains("wgray render box.glb"), "{}", result.stderr);
    for option in ["--spp", "--samples", "--pixel-samples"] {
        folder.run_quietly(&["render", "small.toml", option, "2", "-o", "few.png"]);
        folder.run_quietly(&["render", "small.toml", "--background", "white", "-o", "white.png"]);
    }
}
