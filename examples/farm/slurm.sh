#!/bin/sh
# Renders a scene on a Slurm cluster. Copy this file next to the scene, edit the settings and run it there:
#
#     sh slurm.sh --partition=gpu --gres=gpu:1 --time=60
#
# The arguments are options of sbatch. An array of tasks renders parts of images, and a dependent array merges the parts.
# Run the script again to render only missing parts. docs/farm.md describes the details.
#SBATCH --requeue
#SBATCH --open-mode=append

# Settings. Paths are relative to the folder of this file, which must have the same path on all machines.
job=scene.farm   # folder for parts, checkpoints and logs
tiles=16         # parts per image
frames=          # frame numbers, such as "$(seq 1 48)"; empty for a single image
render() {       # options that affect the image; exec, so that signals reach wgray
    exec wgray render --size 3840x2160 --spp 4096 "$@" -- scene.toml
}
merge() {        # options of the image files; with frames, names such as image.####.exr
    exec wgray merge --output image.exr "$@"
}
# End of the settings.

set -eu
max_restarts=20   # maximum number of times a task is requeued

# Sets the folders and the frame number of an image; images are counted from 0.
select_image() {
    frame='' name=image
    if [ -n "$frames" ]; then
        image=$1
        set -- $frames
        shift "$image"
        frame=$1 name=$1
    fi
    parts=$job/parts/$name-of-$tiles
    checkpoints=$job/checkpoints/$name-of-$tiles
}

# Renders a part; parts are counted from 0 over all images.
tile() {
    select_image $(( $1 / tiles ))
    tile=$(( $1 % tiles + 1 ))
    mkdir -p -- "$parts" "$checkpoints/$tile"   # a folder, so that each version of the scene has its own checkpoint
    set -- --tile="$tile/$tiles" --output="$parts/$tile.part" --checkpoint="$checkpoints/$tile" --resume --skip-existing
    if [ -n "$frame" ]; then
        set -- "$@" --frames="$frame"
    fi
    # With this option, wgray exits with code 75 after a lost device or a signal, and the task is requeued.
    if [ "${SLURM_RESTART_COUNT:-0}" -lt $max_restarts ]; then
        set -- "$@" --requeue-exit=75
    fi
    render "$@" --progress=plain &
    wgray=$!
    trap 'interrupted=1; kill -TERM $wgray' USR1   # sent a minute before the time limit
    trap 'interrupted=1; cancelled=1' TERM         # sent by scancel, also to wgray
    code=1 interrupted=1 cancelled=''
    while [ -n "$interrupted" ]; do   # a signal ends wait, but not wgray
        interrupted='' status=0
        wait $wgray || status=$?
        [ $status = 127 ] || code=$status   # 127: an earlier wait has returned the status
    done
    # Slurm regards a task that exits with an error code as failed and cancels the merge, even with RequeueExit.
    if [ $code = 75 ] && [ -z "$cancelled" ]; then
        scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" && sleep 60   # Slurm ends this task during the sleep
    fi
    exit $code
}

# Merges the parts of an image; images are counted from 0. The parts are kept: delete the job's folder after a check.
merge_image() {
    select_image "$1"
    set -- -- "$parts"
    if [ -n "$frame" ]; then
        set -- --frame="$frame" "$@"
    fi
    (merge "$@")
    rm -rf -- "$checkpoints"
}

# Submits tasks of a kind in as few arrays as the cluster allows, and prints each job ID after a colon.
arrays() {
    kind=$1 count=$2 first=0
    shift 2
    while [ $first -lt "$count" ]; do
        size=$(( count - first < max ? count - first : max ))
        id=$(sbatch --parsable --job-name="wgray-$kind" --array="0-$(( size - 1 ))" --chdir="$logs" \
            --output=%x-%A_%a.txt "$@" "$script" "$kind" "$folder" $first) || return
        printf :%s "${id%%;*}"
        first=$(( first + max ))
    done
}

# Cancels the submitted arrays after a failure.
give_up() {
    jobs=$(echo "$tiles_ids$merge_ids" | tr : ' ')
    if [ -n "$jobs" ]; then
        scancel $jobs
    fi
    exit 1
}

case ${1-} in
    tile | merge)
        cd -- "$2"
        number=$(( $3 + SLURM_ARRAY_TASK_ID ))
        if [ "$1" = tile ]; then tile $number; else merge_image $number; fi
        exit
        ;;
esac

cd -- "$(dirname -- "$0")"
folder=$PWD script=$PWD/$(basename -- "$0")
mkdir -p -- "$job/logs"
logs=$(cd -- "$job/logs" && pwd)
max=$(scontrol show config | sed -n 's/^MaxArraySize *= *//p')   # upper bound of array indices, exclusive
if [ "${max:-0}" -lt 1 ]; then
    echo "$0: scontrol does not report MaxArraySize" >&2
    exit 1
fi
count() { echo $#; }
images=$(count $frames)
if [ "$images" = 0 ]; then
    images=1
fi
tiles_ids='' merge_ids=''
tiles_ids=$(arrays tile $(( images * tiles )) --signal=B:USR1@60 "$@") || give_up
merge_ids=$(arrays merge "$images" "$@" --dependency=afterok"$tiles_ids" --kill-on-invalid-dep=yes) || give_up
echo "tiles$(echo "$tiles_ids" | tr : ' '), merge$(echo "$merge_ids" | tr : ' ')"
