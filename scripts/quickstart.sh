#!/usr/bin/env bash
# Runs a job, verifies and reports it, and says what to do next. Usage: quickstart.sh PROGRAM JOB DATASET
set -uo pipefail
program=$1 job=$2 data=$3

step() {
    echo
    echo "quickstart: $*"
    "$@"
}

start=$(date +%s)
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

cat <<END

quickstart: done in $(($(date +%s) - start)) s after building: $data ($(du -sh "$data" | cut -f1))
Next:
  open $data/report.html in a browser
  $program inspect $data
  $program run jobs/ycb-completion.toml --out datasets/ycb-completion
END
