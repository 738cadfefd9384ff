//! Batch scripts for Slurm.

use std::path::Path;

use super::text::word;
use super::{File, Work, command, comments};

/// Maximum number of times a task is requeued.
const MAX_RESTARTS: u32 = 20;

/// Returns the scripts: one renders parts, one joins them, one submits both.
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

/// Returns the command that submits the job.
pub fn next(to: &Path) -> String {
    let name = to.join("submit").display().to_string();
    let name = match name.contains('/') && !name.starts_with('-') {
        true => name,
        false => format!("./{name}"),
    };
    word(&name)
}

/// Returns the shell variables that both scripts set.
fn names(work: &Work) -> String {
    let ranges = work.frames.as_ref().map(|frames| {
        let lists = frames
            .ranges()
            .into_iter()
            .map(|(first, last, step)| match last == first {
                true => first.to_string(),
                false => format!("$(seq {first} {step} {last})"),
            });
        format!("frames=({})\n", lists.collect::<Vec<_>>().join(" "))
    });
    format!(
        "folder={}   # base of relative paths\nplace={}   # parts and checkpoints\ntiles={}   # parts per image\n{}",
        word(&work.folder),
        word(&work.place),
        work.tiles,
        ranges.unwrap_or_default(),
    )
}

/// Returns the line that sets the frame from the task number, and the prefix of the names of an image's folders.
fn stem(work: &Work, index: &str) -> (String, &'static str) {
    match work.frames {
        None => (String::new(), "picture"),
        Some(_) => (format!("frame=${{frames[{index}]}}\n"), "$frame"),
    }
}

fn tile(work: &Work) -> String {
    let head = comments(&work.head(&format!(
        "Renders a part of an image of {}: a task of a Slurm array, submitted by ./submit.",
        work.name
    )));
    let limit = work.limit.map(|limit| {
        format!(
            "#SBATCH --time={}   # minutes; a task that reaches this limit is requeued and resumes\n",
            limit.as_secs().div_ceil(60)
        )
    });
    let (frame, stem) = stem(work, "task / tiles");
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
{limit}#SBATCH --signal=B:USR1@60   # signal a minute before the limit, handled below

{names}
task=$(( ${{1:-0}} + SLURM_ARRAY_TASK_ID ))   # from 0, across all arrays: Slurm limits their size
tile=$(( task % tiles + 1 ))
{frame}parts=$place/parts/{stem}-of-$tiles
kept=$place/checkpoints/{stem}-of-$tiles/$tile   # a folder: each version of the scene gets its own checkpoint

cd -- "$folder" || exit
mkdir -p -- "$parts" "$kept" || exit

# wgray exits with code 75 after a lost device or a signal, and the task is requeued. Finished work is not repeated.
again=(--requeue-exit=75)
if [ "${{SLURM_RESTART_COUNT:-0}}" -ge {MAX_RESTARTS} ]; then
    again=()
fi
{command}
wgray=$!
trap 'kill -TERM $wgray' USR1
trap 'cancelled=1' TERM   # sent by scancel, also to wgray
while kill -0 $wgray 2>/dev/null; do
    wait $wgray   # returns early after a signal
done
wait $wgray
code=$?
# Requeue before exiting: the merge job would count a task that exits with an error code as failed, even with RequeueExit.
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
    let head = comments(&work.head(&format!("Joins the parts of an image of {}.", work.name)));
    let (frame, stem) = stem(work, "${1:-0} + SLURM_ARRAY_TASK_ID");
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
{frame}parts=$place/parts/{stem}-of-$tiles

cd -- "$folder" || exit
{command}
rm -rf -- "$place/checkpoints/{stem}-of-$tiles"   # parts are kept for another merge; delete $place when the job is done
"#,
        names = names(work),
        command = command("", &words),
    )
}

fn submit(work: &Work) -> String {
    let head = comments(&work.head(&format!(
        "{}. Submits the job and passes options to sbatch: ./submit --partition=gpu --gres=gpu:1",
        work.what()
    )));
    format!(
        r#"#!/bin/bash
{head}set -eu
cd -- "$(dirname -- "$0")"
mkdir -p logs

# Submits a script as arrays of tasks, as few as the cluster allows, and prints the job IDs, each after a colon.
max=$(( $(scontrol show config | sed -n 's/^MaxArraySize *= *//p') ))   # upper bound of array indices, exclusive
if [ "$max" -lt 1 ]; then
    echo "$0: scontrol does not report MaxArraySize" >&2
    exit 1
fi
arrays() {{
    local script=$1 count=$2 first job
    shift 2
    for (( first = 0; first < count; first += max )); do
        job=$(sbatch --parsable --array=0-$(( (count - first < max ? count - first : max) - 1 )) \
            --chdir="$PWD" --output=logs/%x-%A_%a.txt "$@" "$script" "$first") || return
        echo -n ":${{job%%;*}}"
    done
}}

# Cancels the submitted arrays after a failure.
merges=
give_up() {{
    if [ -n "$tiles$merges" ]; then
        scancel ${{tiles//:/ }} ${{merges//:/ }}
    fi
    exit 1
}}
tiles=$(arrays tile.sh {tasks} "$@") || give_up
merges=$(arrays merge.sh {images} "$@" --dependency=afterok"$tiles" --kill-on-invalid-dep=yes) || give_up
echo "tiles${{tiles//:/ }}, merge${{merges//:/ }}"
"#,
        tasks = work.tasks(),
        images = work.images(),
    )
}
