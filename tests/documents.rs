//! The documentation: its links, the table of pages, and the scene of the README.

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
