//! The documentation: its links, the table of pages, the tutorials, and the scene of the README.

use std::path::{Path, PathBuf};

use wgray::{Options, Overrides, Scene};

use crate::sources::path as project;

fn pages_in(folder: &str) -> Vec<PathBuf> {
    let mut pages = Vec::new();
    for entry in std::fs::read_dir(project(folder)).unwrap() {
        let path = entry.unwrap().path();
        let name = Path::new(folder).join(path.file_name().unwrap());
        if path.is_dir() {
            pages.extend(pages_in(name.to_str().unwrap()));
        } else if name.extension().is_some_and(|end| end == "md") {
            pages.push(name);
        }
    }
    pages.sort();
    pages
}

fn read(page: &Path) -> String {
    std::fs::read_to_string(project(page.to_str().unwrap())).unwrap()
}

fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut fenced = false;
    page.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        !fenced && !fence
    })
}

fn links(page: &str) -> Vec<String> {
    let targets = |line: &str| -> Vec<String> {
        let link_ends = line.split("](").skip(1);
        link_ends
            .filter_map(|link_end| Some(link_end.split_once(')')?.0.to_owned()))
            .collect()
    };
    prose(page).flat_map(targets).collect()
}

fn anchors(page: &str) -> Vec<String> {
    let headings = prose(page).filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            title
                .chars()
                .filter(|c| c.is_alphanumeric() || " -_".contains(*c))
                .map(|c| if c == ' ' { '-' } else { c })
                .collect()
        })
        .collect()
}

/// Returns the relative links whose targets do not exist.
fn broken_links(page: &Path, text: &str) -> Vec<String> {
    let is_broken = |link: &String| {
        if link.contains("://") {
            return false;
        }
        let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
        let target = page.parent().unwrap().join(file);
        if !file.is_empty() && !project(target.to_str().unwrap()).exists() {
            return true;
        }
        if anchor.is_empty() {
            return false;
        }
        let headings = if file.is_empty() {
            anchors(text)
        } else {
            anchors(&read(&target))
        };
        !headings.iter().any(|heading| heading == anchor)
    };
    let broken = links(text).into_iter().filter(is_broken);
    broken.map(|link| format!("{}: {link}", page.display())).collect()
}

#[test]
fn relative_links_have_existing_targets() {
    let mut pages = pages_in("docs");
    pages.extend(
        [
            "README.md",
            "CONTRIBUTING.md",
            "CHANGELOG.md",
            "benches/peers/README.md",
        ]
        .map(PathBuf::from),
    );
    let count: usize = pages.iter().map(|page| links(&read(page)).len()).sum();
    assert!(count > 150, "{count} links");
    let broken: Vec<String> = pages.iter().flat_map(|page| broken_links(page, &read(page))).collect();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn broken_links_are_detected() {
    let page = "# A `b`, c\n[1](../README.md) [2](gltf.md#extensions) [3](#a-b-c) [4](https://example.com/x)\n";
    assert_eq!(broken_links(Path::new("docs/page.md"), page), Vec::<String>::new());
    for link in ["missing.md", "gltf.md#missing", "#missing", "README.md.png"] {
        let page = format!("# A\n![image]({link})\n```\n[code](missing.md)\n```\n");
        assert_eq!(
            broken_links(Path::new("docs/page.md"), &page),
            [format!("docs/page.md: {link}")]
        );
    }
}

#[test]
fn the_table_of_pages_is_complete() {
    let overview = read(Path::new("docs/README.md"));
    let listed = links(&overview);
    for page in pages_in("docs") {
        let name = page.strip_prefix("docs").unwrap().to_str().unwrap().to_owned();
        let rows = listed.iter().filter(|link| **link == name).count();
        assert_eq!(
            rows,
            usize::from(name != "README.md"),
            "docs/README.md: links to {name}"
        );
    }
}

#[test]
fn the_readme_scene_renders() {
    let readme = read(Path::new("README.md"));
    let (_, rest) = readme.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let small = Overrides {
        size: Some((64, 36)),
        pixel_samples: Some(16),
        ..Overrides::default()
    };
    let scene = Scene::parse_with(text, "README.md", &small).unwrap();
    let options = Options {
        device: wgray::Device::Cpu,
        ..Options::default()
    };
    let picture = wgray::render(&scene, &options).unwrap();
    let pixel = |x: usize, y: usize| picture.pixels().colors[64 * y + x];
    let [gold, ground] = [pixel(32, 18), pixel(4, 32)];
    assert!(gold[0] > 1.5 * gold[2], "{gold:?}");
    assert!(
        ground.iter().all(|&value| value > 0.1) && ground[0] < 1.3 * ground[2],
        "{ground:?}"
    );
}

/// The tutorials, run with `sh` and `timeout`.
#[cfg(all(target_os = "linux", feature = "dev"))]
mod tutorials {
    use super::{Path, pages_in, project, read};

    /// Returns the commands of a tutorial as a shell script, and the texts that its output must contain.
    ///
    /// Blocks marked `sh` run in order. A block after a line that ends with "`NAME`:" is the contents of the file NAME.
    /// Other blocks marked `text` are output.
    fn tutorial_script(page: &str) -> (String, Vec<String>) {
        let (mut script, mut outputs, mut introduction) = (String::new(), Vec::new(), "");
        let mut lines = page.lines();
        while let Some(line) = lines.next() {
            let Some(language) = line.strip_prefix("```") else {
                if !line.is_empty() {
                    introduction = line;
                }
                continue;
            };
            let block = lines.by_ref().take_while(|line| *line != "```");
            let block: String = block.map(|line| format!("{line}\n")).collect();
            let file = introduction
                .strip_suffix("`:")
                .and_then(|start| start.rsplit('`').next());
            introduction = "";
            match (language, file) {
                ("sh", _) => script += &block,
                (_, Some(file)) => script += &format!("cat > {file} << 'END_OF_FILE'\n{block}END_OF_FILE\n"),
                ("text", None) => outputs.push(block),
                _ => {}
            }
        }
        (script, outputs)
    }

    /// Runs `wgray dev` in the background, at a free port. Waits for the images that the tutorial compares.
    fn with_dev_in_background(script: &str) -> String {
        let dev = "wgray dev scene.toml --out live.png";
        let in_background = format!("{dev} --listen 127.0.0.1:0 > dev.log 2>&1 &\ntrap \"kill $!\" EXIT");
        let wait_for_first_image = "until grep -q Finished dev.log && [ -e live.png ]; do sleep 0.1; done";
        let wait_for_second_image =
            "until [ $(grep -c Finished dev.log) -ge 2 ] && ! cmp -s live.png before.png; do sleep 0.1; done";
        script
            .replace(
                &format!("{dev}\n"),
                &format!("{in_background}\n{wait_for_first_image}\n"),
            )
            .replace(
                "wgray diff live.png",
                &format!("{wait_for_second_image}\nwgray diff live.png"),
            )
    }

    /// Runs a tutorial in an empty folder beside the folder `wgray`, the repository. Returns whether it succeeds, and
    /// its output.
    fn run_tutorial(script: &str) -> (bool, String) {
        let folder = tempfile::tempdir().unwrap();
        let work = folder.path().join("work");
        std::fs::create_dir(&work).unwrap();
        std::os::unix::fs::symlink(project(""), folder.path().join("wgray")).unwrap();
        let program = Path::new(env!("CARGO_BIN_EXE_wgray")).parent().unwrap();
        let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
        let script = format!("exec 2>&1\n{}", with_dev_in_background(script));
        let output = std::process::Command::new("timeout")
            .args(["300", "sh", "-ec", &script])
            .current_dir(work)
            .env("PATH", path)
            .output()
            .unwrap();
        (
            output.status.success(),
            String::from_utf8_lossy(&output.stdout).into_owned(),
        )
    }

    #[test]
    fn the_tutorials_run_from_an_empty_folder() {
        let pages = pages_in("docs/tutorials");
        assert!(pages.len() >= 6, "{pages:?}");
        for page in pages {
            if page.ends_with("shader-edit.md") && crate::adapter::device().is_none() {
                continue;
            }
            let (script, outputs) = tutorial_script(&read(&page));
            let (succeeds, output) = run_tutorial(&script);
            assert!(succeeds, "{}:\n{output}", page.display());
            for text in outputs {
                assert!(output.contains(&text), "{}: {text} is not in\n{output}", page.display());
            }
        }
    }

    #[test]
    fn mistakes_in_tutorials_are_detected() {
        let page = "Save `a b` as `name.txt`:\n\n```text\nx\n```\n\n```sh\ncat name.txt\n```\n\n```text\nx\n```\n";
        let (script, outputs) = tutorial_script(page);
        assert_eq!(outputs, ["x\n"]);
        assert_eq!(run_tutorial(&script), (true, "x\n".to_owned()));
        let (succeeds, _) = run_tutorial(&script.replace("cat name.txt", "wgray render name.png\necho x"));
        assert!(!succeeds, "the script continues after a failure");
    }
}
