//! What the exit codes mean, as the manual pages tell it; the README has the same table.

/// Each code with its meaning.
pub const EXIT_CODES: [(&str, &str); 11] = [
    ("0", "done; for wgray diff the same, or near enough"),
    (
        "1",
        "failed: shaders that do not compile, pictures or parts that cannot be read, a driver's error",
    ),
    (
        "2",
        "wrong command line; an output that is an input; a checkpoint of another job",
    ),
    ("3", "bad scene"),
    ("4", "no such device, or several that one name fits"),
    ("5", "pictures differ, for wgray diff"),
    ("6", "the device was lost and did not come back"),
    ("7", "out of memory: the device's, or the machine's"),
    ("8", "a picture, a stream or another output could not be written"),
    (
        "what --requeue-exit says",
        "in place of 6 and of 143: the same command may succeed elsewhere or later",
    ),
    (
        "128 + n",
        "ended by signal n: 130 by SIGINT (Ctrl+C), 143 by SIGTERM, 129 by SIGHUP",
    ),
];

#[cfg(test)]
mod tests {
    #[test]
    fn the_readme_has_the_same_table() {
        let readme = include_str!("../../README.md").replace('`', "");
        let (_, table) = readme.split_once("| exit code | meaning |").expect("the table");
        let rows = table.lines().skip(2).map(str::trim);
        let rows = rows.map_while(|line| line.strip_prefix("| ")?.strip_suffix(" |")?.split_once(" | "));
        assert_eq!(rows.collect::<Vec<_>>(), super::EXIT_CODES);
    }

    #[test]
    fn the_help_has_all_of_them() {
        let told = super::super::EXIT_CODES;
        for (code, _) in super::EXIT_CODES.iter().filter(|(code, _)| code.len() == 1) {
            assert!(told.contains(&format!(" {code} ")), "{code}");
        }
    }
}
