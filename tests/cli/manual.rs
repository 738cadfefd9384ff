//! The manual pages, and completions of the command line.

use super::{Place, Ran};

/// The names of all commands, out of the help.
fn commands(place: &Place) -> Vec<String> {
    let help = place.run(&["--help"]).stdout;
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list
        .lines()
        .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
    // A description that goes on in the next line is farther to the right.
    let names: Vec<String> = (names.zip(list.lines()))
        .filter(|(name, line)| !line.starts_with("   ") && *name != "help")
        .map(|(name, _)| name.to_owned())
        .collect();
    assert!(names.contains(&"render".to_owned()), "{help}");
    names
}

#[test]
fn every_command_has_a_page() {
    let place = Place::new();
    place.quietly(&["man", "-o", "pages/man1"]);
    let mut wanted: Vec<String> = commands(&place).iter().map(|name| format!("wgray-{name}.1")).collect();
    let others = ["wgray.1", "wgray-farm-openjd.1", "wgray-farm-slurm.1"];
    wanted.extend(others.map(str::to_owned));
    wanted.sort();
    let folder = place.folder().join("pages/man1");
    let mut there: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    there.sort();
    assert_eq!(there, wanted);
    for name in there {
        let page = std::fs::read_to_string(folder.join(&name)).unwrap();
        for part in [
            ".TH WGRAY",
            ".SH NAME",
            ".SH SYNOPSIS",
            ".SH \"EXIT STATUS\"",
            ".SH EXAMPLES",
            ".SH \"SEE ALSO\"",
        ] {
            assert!(page.contains(part), "{name}: {part}");
        }
        let own = name.strip_prefix("wgray-").and_then(|name| name.strip_suffix(".1"));
        let own = own.into_iter().flat_map(|name| name.split('-'));
        let arguments: Vec<&str> = std::iter::once("man").chain(own).collect();
        assert_eq!(place.run(&arguments).stdout, page, "{name} is printed");
    }
    let render = place.run(&["man", "render"]).stdout;
    for part in [
        ".SH ENVIRONMENT",
        "VK_DRIVER_FILES",
        ".SH FILES",
        "checkpoint\\-interval",
        "128 + n",
    ] {
        assert!(render.contains(part), "{part}");
    }
    // Pages are written anew.
    std::fs::write(folder.join("wgray.1"), "old").unwrap();
    place.quietly(&["man", "-o", "pages/man1"]);
    assert_ne!(std::fs::read_to_string(folder.join("wgray.1")).unwrap(), "old");
}

#[test]
fn pages_that_there_are_not_are_told() {
    let place = Place::new();
    let ran = place.run(&["man", "paint"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (2, ""));
    assert!(
        ran.stderr
            .starts_with("error: COMMAND: \"paint\" must be one of render, check, "),
        "{}",
        ran.stderr
    );
    let ran = place.run(&["man", "-o", "small.toml"]);
    assert_eq!(ran.code, 8);
    assert!(ran.stderr.contains("small.toml"), "{}", ran.stderr);
    let ran = place.run(&["man", "render", "-o", "pages"]);
    assert_eq!(ran.code, 2);
    assert!(place.files().is_empty());
}

#[test]
fn every_shell_has_completions_that_know_every_command() {
    let place = Place::new();
    let names = commands(&place);
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let ran = place.run(&["completions", shell]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{shell}");
        for name in &names {
            assert!(ran.stdout.contains(name.as_str()), "{shell}: {name}");
        }
    }
    let ran = place.run(&["completions", "tcsh"]);
    assert_eq!((ran.code, ran.stdout.as_str()), (2, ""));
    assert!(ran.stderr.contains("possible values: bash"), "{}", ran.stderr);
}

/// What bash offers for the last of these words.
#[cfg(unix)]
fn offered(place: &Place, words: &[&str]) -> Vec<String> {
    let line = words.join("' '");
    let last = words.len() - 1;
    let script = format!(
        "source <($0 completions bash)\ncompopt() {{ echo \"compopt $*\"; }}\nCOMP_WORDS=('{line}')\nCOMP_CWORD={last}\n_wgray wgray \"${{COMP_WORDS[{last}]}}\" \
         \"${{COMP_WORDS[{last} - 1]}}\"\nprintf '%s\\n' \"${{COMPREPLY[@]}}\""
    );
    let Ran {
        code, stdout, stderr, ..
    } = place.shell("bash", &script);
    assert_eq!((code, stderr.as_str()), (0, ""), "{words:?}");
    stdout.lines().map(str::to_owned).collect()
}

#[test]
#[cfg(unix)]
fn bash_completes_commands_options_names_and_files() {
    let place = Place::new();
    std::fs::create_dir(place.folder().join("smalls")).unwrap();
    assert_eq!(offered(&place, &["wgray", "rend"]), ["render"]);
    assert_eq!(offered(&place, &["wgray", "render", "--pixel-p"]), ["--pixel-pattern"]);
    assert_eq!(
        offered(&place, &["wgray", "render", "a.toml", "--integrator", "p"]),
        ["phong", "path"]
    );
    assert_eq!(offered(&place, &["wgray", "man", "che"]), ["check"]);
    assert_eq!(offered(&place, &["wgray", "man", "farm", "slu"]), ["slurm"]);
    for command in ["render", "info"] {
        let devices = offered(&place, &["wgray", command, "a.toml", "--device", ""]);
        assert_eq!(devices, ["auto", "gpu", "cpu"], "{command}");
    }
    assert_eq!(
        offered(&place, &["wgray", "render", "a.toml", "--spp", "sm"]),
        ["compopt -o nospace", "sm"],
        "no file"
    );
    let files = |option: &str| {
        let mut files = offered(&place, &["wgray", "render", "a.toml", option, "sma"]);
        files.sort();
        files
    };
    assert_eq!(files("--checkpoint"), ["small.toml", "smalls"]);
    // Bash finds folders by itself.
    assert_eq!(files("--asset-root"), ["", "compopt -o plusdirs"]);
    assert!(offered(&place, &["wgray", "xyz"]).iter().all(String::is_empty));
}
