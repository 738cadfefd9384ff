//! Manual pages and shell completions.

use super::{RunResult, TestFolder};

fn commands(folder: &TestFolder) -> Vec<String> {
    let help = folder.run(&["--help"]).stdout;
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names = list
        .lines()
        .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
    // Continuation lines of descriptions are indented further.
    let names: Vec<String> = (names.zip(list.lines()))
        .filter(|(name, line)| !line.starts_with("   ") && *name != "help")
        .map(|(name, _)| name.to_owned())
        .collect();
    assert!(names.contains(&"render".to_owned()), "{help}");
    names
}

#[test]
fn every_command_has_a_page() {
    let folder = TestFolder::new();
    folder.run_quietly(&["man", "-o", "pages/man1"]);
    let mut expected: Vec<String> = commands(&folder).iter().map(|name| format!("wgray-{name}.1")).collect();
    expected.push("wgray.1".to_owned());
    expected.sort();
    let pages = folder.folder().join("pages/man1");
    let mut found: Vec<String> = std::fs::read_dir(&pages)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    found.sort();
    assert_eq!(found, expected);
    for name in found {
        let page = std::fs::read_to_string(pages.join(&name)).unwrap();
        for text in [
            ".TH WGRAY",
            ".SH NAME",
            ".SH SYNOPSIS",
            ".SH \"EXIT STATUS\"",
            ".SH EXAMPLES",
            ".SH \"SEE ALSO\"",
        ] {
            assert!(page.contains(text), "{name}: {text}");
        }
        let command = name.strip_prefix("wgray-").and_then(|name| name.strip_suffix(".1"));
        let arguments: Vec<&str> = std::iter::once("man").chain(command).collect();
        assert_eq!(folder.run(&arguments).stdout, page, "`wgray man` does not print {name}");
        // The page contains every option of the help in bold, with escaped hyphens.
        let arguments: Vec<&str> = command.into_iter().chain(["--help"]).collect();
        let help = folder.run(&arguments).stdout;
        let is_option = |line: &&str| line.starts_with("  -") || line.starts_with("      -");
        let options = help.lines().filter(is_option).filter_map(|line| line.split_once("--"));
        let names = options.map(|(_, rest)| rest.split([' ', ',', '=', '[']).next().unwrap());
        let names: Vec<String> = names
            .map(|name| format!("\\fB\\-\\-{}\\fR", name.replace('-', "\\-")))
            .collect();
        assert!(names.contains(&"\\fB\\-\\-log\\-format\\fR".to_owned()), "{help}");
        for option in names {
            assert!(page.contains(&option), "{name}: {option}");
        }
        assert!(!page.contains("\\fB\\-\\-no\\-such\\-option\\fR"));
        assert_no_groff_warnings(&pages.join(&name));
    }
    let render = folder.run(&["man", "render"]).stdout;
    for text in [
        ".SH ENVIRONMENT",
        "VK_DRIVER_FILES",
        ".SH FILES",
        "checkpoint\\-interval",
        "128 + n",
    ] {
        assert!(render.contains(text), "{text}");
    }
    std::fs::write(pages.join("wgray.1"), "old").unwrap();
    folder.run_quietly(&["man", "-o", "pages/man1"]);
    assert_ne!(std::fs::read_to_string(pages.join("wgray.1")).unwrap(), "old");
}

#[test]
fn unknown_pages_are_rejected() {
    let folder = TestFolder::new();
    let result = folder.run(&["man", "paint"]);
    assert_eq!((result.code, result.stdout.as_str()), (2, ""));
    assert!(
        result
            .stderr
            .starts_with("error: COMMAND: \"paint\" must be one of render, check, "),
        "{}",
        result.stderr
    );
    let result = folder.run(&["man", "-o", "small.toml"]);
    assert_eq!(result.code, 8);
    assert!(result.stderr.contains("small.toml"), "{}", result.stderr);
    let result = folder.run(&["man", "render", "-o", "pages"]);
    assert_eq!(result.code, 2);
    assert!(folder.files().is_empty());
}

/// Checks that groff, if installed, prints no warnings.
fn assert_no_groff_warnings(page: &std::path::Path) {
    let groff = std::process::Command::new("groff")
        .args(["-man", "-Tutf8", "-ww", "-z"])
        .arg(page)
        .output();
    if let Ok(result) = groff {
        let warnings = String::from_utf8_lossy(&result.stderr);
        assert!(
            result.status.success() && warnings.is_empty(),
            "{}: {warnings}",
            page.display()
        );
    }
}

/// The documentation and the help list the same exit codes; the manual pages contain the text of the help.
#[test]
fn exit_codes_are_documented() {
    let page = std::fs::read_to_string(super::project_path("docs/command-line.md")).unwrap();
    let (_, table) = page.split_once("| exit code | meaning |").expect("the table");
    let rows = table
        .lines()
        .skip(2)
        .map_while(|line| line.strip_prefix("| ")?.split_once(" | "));
    let documented: Vec<&str> = rows.map(|(code, _)| code).filter(|code| code.len() == 1).collect();
    let help = TestFolder::new().run(&["--help"]).stdout;
    let (_, codes) = help.split_once("Exit codes: ").expect("exit codes");
    let codes: Vec<&str> = codes
        .split_whitespace()
        .filter(|word| word.parse::<u8>().is_ok_and(|code| code < 9))
        .collect();
    assert_eq!(codes, documented);
    assert!(page.contains("| 128 + n |") && help.contains("128 + n"));
}

#[test]
fn completions_of_every_shell_list_every_command() {
    let folder = TestFolder::new();
    let names = commands(&folder);
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let result = folder.run(&["completions", shell]);
        assert_eq!((result.code, result.stderr.as_str()), (0, ""), "{shell}");
        for name in &names {
            assert!(result.stdout.contains(name.as_str()), "{shell}: {name}");
        }
    }
    let result = folder.run(&["completions", "tcsh"]);
    assert_eq!((result.code, result.stdout.as_str()), (2, ""));
    assert!(result.stderr.contains("possible values: bash"), "{}", result.stderr);
}

/// Returns the completions that bash offers for the last of these words.
#[cfg(unix)]
fn completions(folder: &TestFolder, words: &[&str]) -> Vec<String> {
    let line = words.join("' '");
    let last = words.len() - 1;
    let script = format!(
        "source <($0 completions bash)\ncompopt() {{ echo \"compopt $*\"; }}\nCOMP_WORDS=('{line}')\nCOMP_CWORD={last}\n_wgray wgray \"${{COMP_WORDS[{last}]}}\" \
         \"${{COMP_WORDS[{last} - 1]}}\"\nprintf '%s\\n' \"${{COMPREPLY[@]}}\""
    );
    let RunResult {
        code, stdout, stderr, ..
    } = folder.shell("bash", &script);
    assert_eq!((code, stderr.as_str()), (0, ""), "{words:?}");
    stdout.lines().map(str::to_owned).collect()
}

#[test]
#[cfg(unix)]
fn bash_completes_commands_options_names_and_files() {
    let folder = TestFolder::new();
    std::fs::create_dir(folder.folder().join("smalls")).unwrap();
    assert_eq!(completions(&folder, &["wgray", "rend"]), ["render"]);
    assert_eq!(
        completions(&folder, &["wgray", "render", "--pixel-p"]),
        ["--pixel-pattern"]
    );
    assert_eq!(
        completions(&folder, &["wgray", "render", "a.toml", "--integrator", "p"]),
        ["phong", "path"]
    );
    assert_eq!(completions(&folder, &["wgray", "man", "che"]), ["check"]);
    for command in ["render", "info"] {
        let devices = completions(&folder, &["wgray", command, "a.toml", "--device", ""]);
        assert_eq!(devices, ["auto", "gpu", "cpu"], "{command}");
    }
    assert_eq!(
        completions(&folder, &["wgray", "render", "a.toml", "--spp", "sm"]),
        ["compopt -o nospace", "sm"],
        "file names are offered for --spp"
    );
    let files = |option: &str| {
        let mut files = completions(&folder, &["wgray", "render", "a.toml", option, "sma"]);
        files.sort();
        files
    };
    assert_eq!(files("--checkpoint"), ["small.toml", "smalls"]);
    // Bash completes folder names itself.
    assert_eq!(files("--asset-root"), ["", "compopt -o plusdirs"]);
    assert!(completions(&folder, &["wgray", "xyz"]).iter().all(String::is_empty));
}
