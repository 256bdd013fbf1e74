#!/usr/bin/env bash
# Runs jobs, verifies and reports each, and prints the next steps. The first is a set of bins of scans; without the scans, the set
# FALLBACK takes its place. Usage: quickstart.sh PROGRAM SET DATASETS FALLBACK DATASETS [JOB DATASET]...
set -uo pipefail
program=$1
clutter=("$2" "$3")
fallback=("$4" "$5")
shift 5

step() {
    echo
    echo "quickstart: $*"
    "$@"
}

# Makes, verifies and reports one dataset, or those of a set.
make_dataset() {
    local job=$1 data=$2 stood code
    stood=$(test -e "$data" && echo yes)
    step "$program" run "$job" --out "$data"
    code=$?
    case $code in
        0) ;;
        3) echo "quickstart: some meshes or samples were refused (see above); the others are complete" ;;
        75) echo "quickstart: interrupted; run 'make quickstart' again to resume"; exit $code ;;
        *) echo "quickstart: the run failed with exit code $code"
           if [ "$stood" ]; then
               echo "  if $data contains the data of another job, remove it or choose another folder:"
               echo "  make quickstart QUICKSTART_DATA=datasets/second"
           fi
           exit $code ;;
    esac
    step "$program" verify "$data" || exit
    step "$program" report "$data" || exit
}

# Completes the objects in the first depth picture of the bins, as a robot's camera would see them, and shows the result first on the
# set's page.
complete_picture() {
    local data=$1 frames=$1-frames completed=$1-completed scene
    rm -rf "$frames" "$completed"
    step "$program" export "$data/views" --to bop --out "$frames" || exit
    scene=$(dirname "$(dirname "$(find "$frames" -path '*/depth/*.png' | sort | head -n 1)")")
    step "$program" complete "$scene/depth/000004.png" --intrinsics "$scene/scene_camera.json" --camera 4 --target all \
        --loose drop --out "$completed"
    case $? in
        0) ;;
        3) echo "quickstart: some objects were refused (see above); the others are complete" ;;
        *) exit 1 ;;
    esac
    step "$program" report "$data" --cover "$completed/overlay.png" \
        --cover-text "One depth picture of a bin, completed by the network in the program: seen parts outlined, and the meshes from two other sides." || exit
    rm -rf "$frames"
}

start=$(date +%s)
if ! compgen -G '.deps/ycb/*.stl' > /dev/null; then
    echo "quickstart: the scans are not in .deps/ycb; ${fallback[0]} is made without them (make setup fetches them)"
    clutter=("${fallback[@]}")
fi
set -- "${clutter[@]}" "$@"
pages=()
made=()
while [ $# -ge 2 ]; do
    make_dataset "$1" "$2"
    if [ "$2" = "${clutter[1]}" ]; then complete_picture "$2"; fi
    pages+=("  open $2/report.html in a browser")
    made+=("  $2 ($(du -sh "$2" | cut -f1))")
    shift 2
done

cat <<END

quickstart: done in $(($(date +%s) - start)) s after building:
$(printf '%s\n' "${made[@]}")
Next:
$(printf '%s\n' "${pages[@]:0:2}")
  $program inspect ${clutter[1]}/views
  $program run jobs/half-shapes.toml --out datasets/half-shapes      (shapes that only touch distinguishes)
  $program run jobs/grasps-quick.toml --out datasets/grasps-quick    (grasps of a Barrett hand on three shapes)
  $program run jobs/ycb-completion.toml --out datasets/ycb-completion
  $program complete DEPTH.png --intrinsics FX,FY,CX,CY --out completed    (your own camera's picture)
  make model-quick    (trains a network on such pairs and shows what it completes; PyTorch, 5 GB once)
END
