//! The exit codes, for the manual pages; docs/command-line.md has the same table.

/// The codes and their meanings.
pub const EXIT_CODES: [(&str, &str); 11] = [
    ("0", "success; for wgray diff: the images agree"),
    (
        "1",
        "failure: a shader does not compile, an image or part cannot be read, or a driver reported an error",
    ),
    (
        "2",
        "usage error: an invalid option, an output that is an input, or a checkpoint of another job",
    ),
    ("3", "invalid scene"),
    ("4", "no such device, or an ambiguous name"),
    ("5", "the images differ (wgray diff)"),
    ("6", "the device was lost and could not be re-opened"),
    ("7", "out of memory, on the device or the host"),
    ("8", "an output could not be written"),
    (
        "value of --requeue-exit",
        "replaces 6 and 143: the same command may succeed later or on another machine",
    ),
    (
        "128 + n",
        "ended by signal n: 130 by SIGINT (Ctrl+C), 143 by SIGTERM, 129 by SIGHUP",
    ),
];

#[cfg(test)]
mod tests {
    #[test]
    fn the_documentation_has_the_same_table() {
        let page = include_str!("../../docs/command-line.md").replace('`', "");
        let (_, table) = page.split_once("| exit code | meaning |").expect("the table");
        let rows = table.lines().skip(2).map(str::trim);
        let rows = rows.map_while(|line| line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | "));
        assert_eq!(rows.collect::<Vec<_>>(), super::EXIT_CODES);
    }

    #[test]
    fn the_help_lists_all_codes() {
        let help = super::super::EXIT_CODES;
        for (code, _) in super::EXIT_CODES.iter().filter(|(code, _)| code.len() == 1) {
            assert!(help.contains(&format!(" {code} ")), "{code}");
        }
    }
}
