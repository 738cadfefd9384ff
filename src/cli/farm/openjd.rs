//! Template for Open Job Description.

use std::path::Path;

use super::text::{plain, scalar, word};
use super::{File, Work, command, comments};
use crate::cli::Usage;

/// Maximum length of a parameter's value.
const MAX_VALUE_LEN: usize = 1024;
/// Maximum length of a job's name.
const MAX_NAME_LEN: usize = 64;

/// Returns the template.
pub fn files(work: &Work, to: &Path) -> Result<Vec<File>, Usage> {
    let ends = to.extension().is_some_and(|end| end == "yaml" || end == "yml");
    if !ends {
        return Err(Usage(format!("--to: {}: must end in .yaml or .yml", to.display())));
    }
    if let Some(text) = frames(work).filter(|text| text.len() > MAX_VALUE_LEN) {
        let rule = format!(
            "the list takes {} characters, and a template allows {MAX_VALUE_LEN}",
            text.len()
        );
        return Err(Usage(format!("--frames: {rule}; write several templates")));
    }
    Ok(vec![File {
        path: to.to_owned(),
        text: template(work, to)?,
        is_program: false,
    }])
}

/// Returns the command that runs the template.
pub fn next(work: &Work, to: &Path) -> String {
    let mut words = vec!["openjd run".to_owned(), word(&dashed(&to.display().to_string()))];
    let (folder, scene) = (folder(work, to), scene(work, to));
    if folder.is_none() {
        words.push(format!("-p {}", word(&format!("Folder={}", work.folder))));
    }
    if scene.is_none() {
        words.push(format!("-p {}", word(&format!("Scene={}", work.scene))));
    }
    words.join(" ")
}

/// Returns a path that cannot be mistaken for an option.
fn dashed(path: &str) -> String {
    match path.starts_with('-') {
        true => format!("./{path}"),
        false => path.to_owned(),
    }
}

/// Returns a path relative to the template's folder if it is below it; other paths cannot be defaults.
fn below(path: &str, to: &Path) -> Option<String> {
    let absolute = |path: &Path| std::fs::canonicalize(path).ok();
    let parent = to.parent().filter(|parent| !parent.as_os_str().is_empty());
    let folder = absolute(parent.unwrap_or(Path::new(".")))?;
    let below = absolute(Path::new(path))?.strip_prefix(folder).ok()?.to_owned();
    match plain("", below.as_os_str()).ok()?.as_str() {
        "" => Some(".".to_owned()),
        below => Some(below.to_owned()),
    }
}

fn folder(work: &Work, to: &Path) -> Option<String> {
    below(&work.folder, to)
}

fn scene(work: &Work, to: &Path) -> Option<String> {
    below(&work.scene, to)
}

fn frames(work: &Work) -> Option<String> {
    let told = work.frames.as_ref()?.ranges().into_iter().map(|range| match range {
        (first, last, _) if first == last => first.to_string(),
        (first, last, 1) => format!("{first}-{last}"),
        (first, last, step) => format!("{first}-{last}:{step}"),
    });
    Some(told.collect::<Vec<_>>().join(","))
}

/// A parameter of the job.
fn parameter(name: &str, kind: &str, what: &str, more: &[(&str, String)]) -> String {
    let mut text = format!(
        "  - name: {name}\n    type: {kind}\n    description: {}\n",
        scalar(what)
    );
    for (key, value) in more {
        text += &format!("    {key}: {value}\n");
    }
    text
}

fn parameters(work: &Work, to: &Path) -> String {
    let path = |kind: &str, flow: &str, default: Option<String>| {
        let mut keys = vec![("objectType", kind.to_owned()), ("dataFlow", flow.to_owned())];
        keys.extend(default.map(|default| ("default", scalar(&default))));
        keys
    };
    let text = |default: &str| [("default", scalar(default))];
    let mut all = vec![
        parameter("Scene", "PATH", "The scene file", &path("FILE", "IN", scene(work, to))),
        parameter(
            "Folder",
            "PATH",
            "The base folder of relative paths, shared by all machines",
            &path("DIRECTORY", "INOUT", folder(work, to)),
        ),
    ];
    for (number, output) in (1..).zip(&work.outputs) {
        all.push(parameter(
            &output_name(number),
            "STRING",
            "An image to write",
            &text(output),
        ));
    }
    if let Some(frames) = frames(work) {
        all.push(parameter(
            "Frames",
            "STRING",
            "The frames: comma-separated numbers and ranges A-B:STEP",
            &text(&frames),
        ));
    }
    let tiles = [("minValue", "1".to_owned()), ("default", work.tiles.to_string())];
    all.push(parameter("Tiles", "INT", "The number of parts of each image", &tiles));
    all.push(parameter(
        "Program",
        "STRING",
        "The name or path of wgray",
        &text(&work.program),
    ));
    all.concat()
}

fn output_name(number: usize) -> String {
    match number {
        1 => "Output".to_owned(),
        number => format!("Output{number}"),
    }
}

/// Formats the script of a step from the arguments of the shell and the lines.
fn step(indent: &str, words: &[&str], limit: &str, script: &str) -> String {
    let list: Vec<String> = words.iter().map(|word| scalar(word)).collect();
    let lines: String = script
        .lines()
        .map(|line| match line {
            "" => "\n".to_owned(),
            line => format!("{indent}          {line}\n"),
        })
        .collect();
    format!(
        "{indent}script:
{indent}  actions:
{indent}    onRun:
{indent}      command: sh
{indent}      args: [{list}]
{limit}{indent}      cancelation:
{indent}        mode: NOTIFY_THEN_TERMINATE
{indent}        notifyPeriodInSeconds: 30
{indent}  embeddedFiles:
{indent}    - name: Script
{indent}      type: TEXT
{indent}      data: |
{lines}",
        list = list.join(", "),
    )
}

fn template(work: &Work, to: &Path) -> Result<String, Usage> {
    let what = format!(
        "{}, for engines of Open Job Description. `{}` runs it on this machine.",
        work.what(),
        next(work, to)
    );
    let head = comments(&work.head(&what));
    // Job names have a maximum length, and braces could form references to parameters.
    let name = work.name.chars().map(|c| if "{}".contains(c) { ' ' } else { c });
    let name: String = name.take(MAX_NAME_LEN).collect();
    let has_frames = work.frames.is_some();
    let stem = if has_frames { "$frame" } else { "picture" };
    let limit = work
        .limit
        .map(|limit| format!("          timeout: {}   # seconds\n", limit.as_secs()));

    let mut frame = String::new();
    if has_frames {
        frame = "        - name: Frame\n          type: INT\n          range: \"{{Param.Frames}}\"\n".to_owned();
    }
    let merge_space = match has_frames {
        true => format!("    parameterSpace:\n      taskParameterDefinitions:\n{frame}"),
        false => String::new(),
    };

    let mut words = vec![
        "{{Task.File.Script}}",
        "{{Param.Folder}}",
        "{{Param.Program}}",
        "{{Param.Tiles}}",
    ];
    let mut names = "folder=$1 program=$2 tiles=$3".to_owned();
    if has_frames {
        words.push("{{Task.Param.Frame}}");
        names += " frame=$4\nshift 4";
    } else {
        names += "\nshift 3";
    }
    let mut render = vec!["exec \"$program\" render".to_owned()];
    render.extend(work.render.iter().cloned());
    if has_frames {
        render.push("--frames=\"$frame\"".to_owned());
    }
    render.extend(
        [
            "--tile=\"$2/$tiles\"",
            "--output=\"$parts/$2.part\"",
            "--checkpoint=\"$kept\"",
            "--resume",
            "--skip-existing",
            "--progress=openjd",
            "-- \"$1\"",
        ]
        .map(str::to_owned),
    );
    let place = word(&work.place);
    let tile_script = format!(
        "# Renders a part of an image. Finished work is not repeated.
set -eu
{names}
# the remaining arguments are the scene and the number of the part
cd -- \"$folder\"
parts={place}/parts/{stem}-of-$tiles
kept={place}/checkpoints/{stem}-of-$tiles/$2   # a folder: each version of the scene gets its own checkpoint
mkdir -p -- \"$parts\" \"$kept\"
{}
",
        command("", &render)
    );
    let tile_words = [&words[..], &["{{Param.Scene}}", "{{Task.Param.Tile}}"]].concat();

    let outputs: Vec<String> = (1..=work.outputs.len())
        .map(|number| format!("{{{{Param.{}}}}}", output_name(number)))
        .collect();
    let merge_words: Vec<&str> = words
        .iter()
        .copied()
        .chain(outputs.iter().map(String::as_str))
        .collect();
    let mut merge = vec!["\"$program\" merge".to_owned()];
    if has_frames {
        merge.push("--frame=\"$frame\"".to_owned());
    }
    merge.extend(work.merge.iter().cloned());
    merge.extend((1..=work.outputs.len()).map(|number| format!("--output=\"${number}\"")));
    merge.push("-- \"$parts\"".to_owned());
    let merge_script = format!(
        "# Joins the parts of an image.
set -eu
{names}
# the remaining arguments are the images to write
cd -- \"$folder\"
parts={place}/parts/{stem}-of-$tiles
{}
rm -rf -- {place}/checkpoints/{stem}-of-$tiles   # parts are kept; delete {place} when the job is done
",
        command("", &merge)
    );
    Ok(format!(
        r#"{head}specificationVersion: jobtemplate-2023-09
name: {name}
parameterDefinitions:
{parameters}steps:
  - name: render
    parameterSpace:
      taskParameterDefinitions:
{frame}        - name: Tile
          type: INT
          range: "1-{{{{Param.Tiles}}}}"
{tile}  - name: merge
    dependencies:
      - dependsOn: render
{merge_space}{merge}"#,
        name = scalar(&name),
        parameters = parameters(work, to),
        tile = step("    ", &tile_words, &limit.unwrap_or_default(), &tile_script),
        merge = step("    ", &merge_words, "", &merge_script),
    ))
}
