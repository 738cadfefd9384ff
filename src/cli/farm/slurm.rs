//! Batch scripts of Slurm.

use std::path::Path;

use super::text::word;
use super::{File, Work, command, comments};

/// A task that was requeued so often is left to be looked at.
const MOST_RESTARTS: u32 = 20;

/// The scripts: one for parts, one that joins them, one that submits both.
pub fn files(work: &Work, to: &Path) -> Vec<File> {
    let file = |name: &str, text: String| File {
        path: to.join(name),
        text,
        is_program: name == "submit",
    };
    vec![
        file("tile.sh", tile(work)),
        file("merge.sh", merge(work)),
        file("submit", submit(work)),
    ]
}

/// What to do with them.
pub fn next(to: &Path) -> String {
    let name = to.join("submit").display().to_string();
    let name = match name.contains('/') && !name.starts_with('-') {
        true => name,
        false => format!("./{name}"),
    };
    word(&name)
}

/// The names that both kinds of tasks know.
fn names(work: &Work) -> String {
    let ranges = work.frames.as_ref().map(|frames| {
        let told = frames
            .ranges()
            .into_iter()
            .map(|(first, last, step)| match last == first {
                true => first.to_string(),
                false => format!("$(seq {first} {step} {last})"),
            });
        format!("frames=({})\n", told.collect::<Vec<_>>().join(" "))
    });
    format!(
        "folder={}   # names are counted from here\nplace={}   # parts and checkpoints\ntiles={}   # parts of a picture\n{}",
        word(&work.folder),
        word(&work.place),
        work.tiles,
        ranges.unwrap_or_default(),
    )
}

/// What stands before `-of-` in the names of a picture's folders, from the task's number.
fn picture(work: &Work, index: &str) -> (String, &'static str) {
    match work.frames {
        None => (String::new(), "picture"),
        Some(_) => (format!("frame=${{frames[{index}]}}\n"), "$frame"),
    }
}

fn tile(work: &Work) -> String {
    let head = comments(&work.head(&format!(
        "A part of a picture of {}: a task of a Slurm array, which ./submit submits.",
        work.name
    )));
    let limit = work.limit.map(|limit| {
        format!(
            "#SBATCH --time={}   # minutes; a task whose time is up goes on in another try\n",
            limit.as_secs().div_ceil(60)
        )
    });
    let (frame, picture) = picture(work, "task / tiles");
    let mut words = vec![format!("{} render", word(&work.program))];
    words.extend(work.render.iter().cloned());
    if work.frames.is_some() {
        words.push("--frames=\"$frame\"".to_owned());
    }
    words.extend(
        [
            "--tile=\"$tile/$tiles\"",
            "--output=\"$parts/$tile.part\"",
            "--checkpoint=\"$kept\"",
            "--resume",
            "--skip-existing",
            "--progress=plain",
            "\"${again[@]}\"",
        ]
        .map(str::to_owned),
    );
    words.push(format!("-- {} &", word(&work.scene)));
    format!(
        r#"#!/bin/bash
{head}#SBATCH --job-name=wgray-tile
#SBATCH --requeue
#SBATCH --open-mode=append
{limit}#SBATCH --signal=B:USR1@60   # a minute before, wgray is told, keeps what it has, and the task is requeued: the last lines

{names}
task=$(( ${{1:-0}} + SLURM_ARRAY_TASK_ID ))   # of all, from 0; an array holds so many, and there may be several
tile=$(( task % tiles + 1 ))
{frame}parts=$place/parts/{picture}-of-$tiles
kept=$place/checkpoints/{picture}-of-$tiles/$tile   # a folder: a changed scene has a file of its own

cd -- "$folder" || exit
mkdir -p -- "$parts" "$kept" || exit

# A lost device, and a time that is up, are worth another try: then wgray ends with code 75. What was finished is not rendered again.
again=(--requeue-exit=75)
if [ "${{SLURM_RESTART_COUNT:-0}}" -ge {MOST_RESTARTS} ]; then
    again=()
fi
{command}
wgray=$!
trap 'kill -TERM $wgray' USR1
trap 'cancelled=1' TERM   # by scancel, which tells wgray too
while kill -0 $wgray 2>/dev/null; do
    wait $wgray   # or until a signal
done
wait $wgray
code=$?
# A task that ended with a code, by RequeueExit of slurm.conf too, would count as failed for the job that joins the parts.
if [ $code = 75 ] && [ -z "${{cancelled:-}}" ]; then
    scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID" && sleep 60   # Slurm ends this at once
fi
exit $code
"#,
        limit = limit.unwrap_or_default(),
        names = names(work),
        command = command("", &words),
    )
}

fn merge(work: &Work) -> String {
    let head = comments(&work.head(&format!(
        "Joins the parts of a picture of {}, when all are there.",
        work.name
    )));
    let (frame, picture) = picture(work, "${1:-0} + SLURM_ARRAY_TASK_ID");
    let mut words = vec![format!("{} merge", word(&work.program))];
    if work.frames.is_some() {
        words.push("--frame=\"$frame\"".to_owned());
    }
    words.extend(work.merge.iter().cloned());
    words.extend(work.outputs.iter().map(|output| word(&format!("--output={output}"))));
    words.push("-- \"$parts\" || exit".to_owned());
    format!(
        r#"#!/bin/bash
{head}#SBATCH --job-name=wgray-merge
#SBATCH --requeue
#SBATCH --open-mode=append

{names}
{frame}parts=$place/parts/{picture}-of-$tiles

cd -- "$folder" || exit
{command}
rm -rf -- "$place/checkpoints/{picture}-of-$tiles"   # the parts stay, so that another try finds them; remove $place when all is done
"#,
        names = names(work),
        command = command("", &words),
    )
}

fn submit(work: &Work) -> String {
    let head = comments(&work.head(&format!(
        "{}. This submits it; options of sbatch may follow: ./submit --partition=gpu --gres=gpu:1",
        work.what()
    )));
    format!(
        r#"#!/bin/bash
{head}set -eu
cd -- "$(dirname -- "$0")"
mkdir -p logs

# Submits a script for so many tasks, in as few arrays as the cluster has room for; prints their numbers with colons before them.
most=$(( $(scontrol show config | sed -n 's/^MaxArraySize *= *//p') ))   # an array's indices are less than this
if [ "$most" -lt 1 ]; then
    echo "$0: scontrol does not tell MaxArraySize" >&2
    exit 1
fi
arrays() {{
    local script=$1 count=$2 first job
    shift 2
    for (( first = 0; first < count; first += most )); do
        job=$(sbatch --parsable --array=0-$(( (count - first < most ? count - first : most) - 1 )) \
            --chdir="$PWD" --output=logs/%x-%A_%a.txt "$@" "$script" "$first") || return
        echo -n ":${{job%%;*}}"
    done
}}

# What was submitted before something failed is cancelled.
merges=
give_up() {{
    if [ -n "$tiles$merges" ]; then
        scancel ${{tiles//:/ }} ${{merges//:/ }}
    fi
    exit 1
}}
tiles=$(arrays tile.sh {tasks} "$@") || give_up
merges=$(arrays merge.sh {pictures} "$@" --dependency=afterok"$tiles" --kill-on-invalid-dep=yes) || give_up
echo "tiles${{tiles//:/ }}, merge${{merges//:/ }}"
"#,
        tasks = work.tasks(),
        pictures = work.pictures(),
    )
}
