#!/usr/bin/env bash
# Runs jobs, verifies and reports each, and says what to do next. Usage: quickstart.sh PROGRAM JOB DATASET [JOB DATASET]...
set -uo pipefail
program=$1
shift

step() {
    echo
    echo "quickstart: $*"
    "$@"
}

# Makes, verifies and reports one dataset.
make_dataset() {
    local job=$1 data=$2 stood code
    stood=$(test -e "$data" && echo yes)
    step "$program" run "$job" --out "$data"
    code=$?
    case $code in
        0) ;;
        3) echo "quickstart: some meshes or samples were refused (see above); the others are complete" ;;
        75) echo "quickstart: interrupted; 'make quickstart' again goes on where it stopped"; exit $code ;;
        *) echo "quickstart: the run failed with exit code $code"
           if [ "$stood" ]; then
               echo "  if $data holds the data of another job, remove it or choose another place:"
               echo "  make quickstart QUICKSTART_DATA=datasets/second"
           fi
           exit $code ;;
    esac
    step "$program" verify "$data" || exit
    step "$program" report "$data" || exit
}

start=$(date +%s)
first=$2
made=()
while [ $# -ge 2 ]; do
    make_dataset "$1" "$2"
    made+=("  $2 ($(du -sh "$2" | cut -f1))")
    shift 2
done

cat <<END

quickstart: done in $(($(date +%s) - start)) s after building:
$(printf '%s\n' "${made[@]}")
Next:
  open $first/report.html in a browser
  $program inspect $first
  $program run jobs/ycb-completion.toml --out datasets/ycb-completion
  make model-quick    (trains a network on such pairs and shows what it completes; PyTorch, 5 GB once)
END
